import json

import pytest

from drake_mobarm import load_scenario
from drake_mobarm.exceptions import OutputError, ParameterError
from drake_mobarm.homing.tables import (
    AREA,
    ROOMS,
    TABLES,
    house_trials,
    open_space_trials,
)
from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.runtime.sweep import run_sweep
from drake_mobarm.runtime.tables import reproduce, summarise
from drake_mobarm.world.obstacles import clearance, outlines
from drake_mobarm.world.sdf import load_world

TRIALS = [{"trial": n, "x": n / 3} for n in range(6)]
IDENTITY = {"table": "squares", "seed": 0}


def square(trial):
    return {"row": {"value": trial["x"] ** 2}}


def fail_on_4(trial):
    if trial["trial"] == 4:
        raise RuntimeError("power cut")
    return square(trial)


def forbidden(trial):
    raise AssertionError("done twice")


def test_outcomes_come_in_the_order_of_the_trials(tmp_path):
    for jobs in (1, 2):
        outcomes = run_sweep(
            TRIALS, square, tmp_path / f"{jobs}.jsonl", IDENTITY, jobs
        )
        assert [o["row"]["value"] for o in outcomes] == pytest.approx(
            [0, 1 / 9, 4 / 9, 1, 16 / 9, 25 / 9]
        )


def test_an_interrupted_sweep_goes_on_where_it_was(tmp_path):
    store = tmp_path / "store.jsonl"
    with pytest.raises(RuntimeError, match="power cut"):
        run_sweep(TRIALS, fail_on_4, store, IDENTITY, jobs=1)
    done = [json.loads(line) for line in store.read_text().splitlines()[1:]]
    assert [entry["trial"] for entry in done] == [0, 1, 2, 3]
    resumed = run_sweep(TRIALS, square, store, IDENTITY, jobs=1)
    fresh = run_sweep(TRIALS, square, tmp_path / "b", IDENTITY, jobs=1)
    assert resumed == fresh
    # Nothing is done twice.
    assert run_sweep(TRIALS, forbidden, store, IDENTITY, jobs=1) == fresh


def test_a_line_that_was_cut_off_is_done_again(tmp_path):
    store = tmp_path / "store.jsonl"
    whole = run_sweep(TRIALS, square, store, IDENTITY, jobs=1)
    store.write_text(store.read_text()[:-9])
    assert run_sweep(TRIALS, square, store, IDENTITY, jobs=1) == whole


def test_another_sweep_in_the_folder_is_not_mixed_in(tmp_path):
    store = tmp_path / "store.jsonl"
    run_sweep(TRIALS, square, store, IDENTITY, jobs=1)
    with pytest.raises(OutputError, match="another sweep"):
        run_sweep(TRIALS, square, store, {"table": "cubes"}, jobs=1)


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
    assert all(pairs.count(pair) == 2 * 5 for pair in set(pairs))
    for trial in trials:
        for place, room in (
            (start(trial), trial.notes["start_room"]),
            (beacon(trial), trial.notes["target_room"]),
        ):
            x_min, x_max, y_min, y_max = ROOMS[room]
            assert x_min <= place[0] <= x_max
            assert y_min <= place[1] <= y_max
            assert clearance(footprint, place) > 0.27


def test_a_trials_notes_are_what_its_overrides_say():
    for trial in [*open_space_trials(1, 4), *house_trials(1, 4)]:
        scenario = load_scenario("homing", trial.overrides)
        assert scenario.beacon == beacon(trial)
        assert scenario.start == [*start(trial), trial.notes["start_yaw_rad"]]
        assert scenario.estimator in trial.case


def test_other_seeds_give_other_trials_and_the_same_seed_the_same():
    assert list(house_trials(3, 4)) == list(house_trials(3, 4))
    assert list(house_trials(3, 4)) != list(house_trials(4, 4))


def test_means_are_over_successes_and_success_over_all():
    def row(success, error):
        return {
            "case": "c",
            "success": success,
            "time_to_target_s": 10.0,
            "net_velocity_m_per_s": 0.5,
            "goal_position_error_m": error,
            "final_position_error_m": 0.2,
            "path_efficiency": 0.9,
            "contacts": 2.0,
        }

    table = TABLES["2.3"]
    (summary,) = summarise(
        table, [row(True, 0.1), row(True, 0.3), row(False, 9.0)]
    )
    assert summary["success_percent"] == pytest.approx(200 / 3)
    assert summary["mean_goal_position_error_m"] == pytest.approx(0.2)
    assert summary["contacts"] == 6
    assert summary["trials_with_contact"] == 3
    (nothing,) = summarise(table, [row(False, 1.0)])
    assert nothing["mean_goal_position_error_m"] is None


def test_the_table_does_not_depend_on_the_number_of_jobs(tmp_path):
    tables = []
    for jobs in (1, 2):
        folder = tmp_path / str(jobs)
        reproduce("2.3", folder, trials=1, jobs=jobs, seed=5)
        tables.append(
            [
                (folder / name).read_text()
                for name in ("table.json", "trials.csv", "table.md")
            ]
        )
        assert (folder / "by_location.png").stat().st_size > 10_000
    assert tables[0] == tables[1]
    content = json.loads(tables[0][0])
    assert content["table"] == "2.3"
    assert content["trials"] == 1
    assert content["seed"] == 5
    assert len(content["rows"]) == 10
    assert content["rows"][4]["dissertation"]["success_percent"] == 100
    assert content["rows"][4]["dissertation"][
        "mean_goal_position_error_m"
    ] == pytest.approx(0.11)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"name": "7.1"}, "7.1"),
        ({"name": "2.3", "trials": 0}, "trials"),
        ({"name": "2.3", "jobs": -1}, "jobs"),
        ({"name": "2.3", "seed": -1}, "seed"),
    ],
)
def test_impossible_sweeps_are_refused(arguments, name, tmp_path):
    with pytest.raises(ParameterError, match=name):
        reproduce(folder=tmp_path / "t", **arguments)
    assert not (tmp_path / "t").exists()
