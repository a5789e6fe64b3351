"""The trials of homing's tables: where they start and where beacons are."""

import math

import pytest

from drake_mobarm import load_scenario
from drake_mobarm.homing.tables import (
    AREA,
    ROOMS,
    half_turn,
    house_trials,
    open_space_trials,
    tau_trials,
    told_trials,
)
from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.world.obstacles import clearance, outlines
from drake_mobarm.world.sdf import load_world


def beacon(trial):
    return [trial.notes["beacon_x_m"], trial.notes["beacon_y_m"]]


def start(trial):
    return [trial.notes["start_x_m"], trial.notes["start_y_m"]]


def test_open_space_has_ten_targets_a_quadrant_the_same_for_every_case():
    trials = list(open_space_trials(0, 40))
    by_case = {}
    for trial in trials:
        by_case.setdefault(trial.case, []).append(trial)
    assert len(by_case) == 10
    first = next(iter(by_case.values()))
    for of_case in by_case.values():
        assert [beacon(t) for t in of_case] == [beacon(t) for t in first]
        assert [t.seed for t in of_case] == [t.seed for t in first]
    quadrants = [(beacon(t)[0] > 0, beacon(t)[1] > 0) for t in first]
    assert all(quadrants.count(q) == 10 for q in set(quadrants))
    assert len(set(quadrants)) == 4
    assert all(abs(x) <= AREA for t in first for x in beacon(t))
    assert len({t.seed for t in first}) == 40


def test_house_trials_stand_free_in_their_rooms():
    footprint = outlines(load_world("small_house").obstacles, *HEIGHTS)
    trials = list(house_trials(0, 80))
    pairs = [(t.notes["start_room"], t.notes["target_room"]) for t in trials]
    assert len(set(pairs)) == 16
    assert all(pairs.count(pair) == 2 * 2 * 5 for pair in set(pairs))
    for trial in trials:
        for place, room in (
            (start(trial), trial.notes["start_room"]),
            (beacon(trial), trial.notes["target_room"]),
        ):
            x_min, x_max, y_min, y_max = ROOMS[room]
            assert x_min <= place[0] <= x_max
            assert y_min <= place[1] <= y_max
            assert clearance(footprint, place) > 0.27


def test_a_trials_overrides_are_what_its_case_and_its_notes_say():
    shipped = load_scenario("homing")
    expected = {}
    ways = (("rules", "odometry"), ("map", "scan_matching"))
    for estimator in ("hybrid", "filter"):
        for avoidance, localization in ways:
            expected[f"{estimator}, {avoidance}"] = {
                "world": "small_house",
                "avoidance": avoidance,
                "localization": localization,
                "estimator": estimator,
                "noise": 5,
                "tau": shipped.hybrid.tau,
            }
    for noise in (1, 2, 3, 4, 5):
        floor = {
            "world": "empty",
            "avoidance": "none",
            "localization": "scan_matching",
            "noise": noise,
        }
        for estimator in ("hybrid", "filter"):
            expected[f"{estimator}, configuration {noise}"] = floor | {
                "estimator": estimator,
                "tau": shipped.hybrid.tau,
            }
        for tau in (1, 2, 4, 6, 8, 12, 20):
            expected[f"tau {tau}, configuration {noise}"] = floor | {
                "estimator": "hybrid",
                "tau": tau,
            }
    met = set()
    tables = (open_space_trials, house_trials, tau_trials)
    for trial in (t for table in tables for t in table(1, 2)):
        scenario = load_scenario("homing", trial.overrides)
        assert expected[trial.case] == {
            "world": scenario.world,
            "avoidance": scenario.avoidance,
            "localization": scenario.station.localization,
            "estimator": scenario.estimator,
            "noise": scenario.noise,
            "tau": scenario.hybrid.tau,
        }
        assert scenario.beacon == tuple(beacon(trial))
        yaw = trial.notes["start_yaw_rad"]
        assert scenario.start == (*start(trial), yaw)
        met.add(trial.case)
    assert met == set(expected)


def test_half_turn_tables_are_the_same_trials_with_another_antenna():
    for make_trials in (open_space_trials, house_trials):
        whole, half = make_trials(2, 2), half_turn(make_trials)(2, 2)
        for one, other in zip(whole, half, strict=True):
            assert one.case == other.case
            assert one.seed == other.seed
            full, narrow = (
                load_scenario("homing", t.overrides) for t in (one, other)
            )
            beacon = full.station.beacon
            assert beacon.field_of_view == pytest.approx(2 * math.pi)
            beacon = narrow.station.beacon
            assert beacon.field_of_view == pytest.approx(math.pi)
            assert narrow.beacon == full.beacon
            assert narrow.noise == full.noise
            assert narrow.avoidance == full.avoidance


def test_every_noise_meets_every_told_one_on_the_same_targets():
    met = set()
    for trial in told_trials(0, 2):
        scenario = load_scenario("homing", trial.overrides)
        told = scenario.filter.told
        assert trial.case == (
            f"configuration {scenario.noise}, told {told or 'none'}"
        )
        assert scenario.estimator == "filter"
        assert scenario.avoidance == "none"
        met.add((scenario.noise, told, scenario.beacon, trial.seed))
    targets = {(beacon, seed) for *_, beacon, seed in met}
    assert len(targets) == 2
    assert met == {
        (noise, told, *target)
        for noise in range(1, 6)
        for told in range(6)
        for target in targets
    }


def test_other_seeds_give_other_trials_and_the_same_seed_the_same():
    assert list(house_trials(3, 4)) == list(house_trials(3, 4))
    assert list(house_trials(3, 4)) != list(house_trials(4, 4))
