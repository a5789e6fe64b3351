"""The trials of Tables 3.2 to 3.4, and what the dissertation got."""

from types import SimpleNamespace

import numpy as np
import pytest

from drake_mobarm import load_scenario
from drake_mobarm.job import sample_path
from drake_mobarm.navigation.tables import (
    CASES,
    COLUMNS,
    POSES,
    TABLES,
)

ONLINE = {"3.2": "small_house", "3.3": "bookstore", "3.4": "cafe"}


def places(trial):
    names = ("start_x_m", "start_y_m", "start_yaw_rad")
    targets = ("target_x_m", "target_y_m")
    return tuple(trial.notes[name] for name in (*names, *targets))


def by_case(trials):
    cases = {}
    for trial in trials:
        cases.setdefault(trial.case, []).append(trial)
    return cases


@pytest.mark.parametrize(("name", "world"), ONLINE.items())
def test_every_case_has_the_same_pairs_and_seeds(name, world):
    cases = by_case(TABLES[name].make_trials(2, 6))
    assert list(cases) == list(CASES)
    first, *others = cases.values()
    assert len({places(trial) for trial in first}) == 6
    for trials in others:
        assert [places(t) for t in trials] == [places(t) for t in first]
        assert [t.seed for t in trials] == [t.seed for t in first]
        assert {t.notes["world"] for t in trials} == {world}


# planner, potential.repulsion, points, highway.repair, sees_plan
EXPECTED = {
    "apf": ("apf", "khatib", "adaptive", True, True),
    "apf, gnron": ("apf", "gnron", "adaptive", True, True),
    "apf_escape": ("apf_escape", "khatib", "adaptive", True, True),
    "apf_hw, adaptive": ("apf_hw", "khatib", "adaptive", False, True),
    "apf_hw, random": ("apf_hw", "khatib", "random", False, True),
    "apf_hw, adaptive, lidar alone": (
        "apf_hw",
        "khatib",
        "adaptive",
        False,
        False,
    ),
    "ours": ("ours", "khatib", "adaptive", True, False),
}


@pytest.mark.parametrize(("name", "world"), ONLINE.items())
def test_a_trials_overrides_are_what_its_case_and_its_notes_say(name, world):
    met = {}
    for trial in TABLES[name].make_trials(1, 2):
        scenario = load_scenario("navigation", trial.overrides)
        met[trial.case] = (
            scenario.planner,
            scenario.potential.repulsion,
            scenario.points,
            scenario.highway.repair,
            scenario.sees_plan,
        )
        assert scenario.world == world
        assert (*scenario.start, *scenario.target) == places(trial)
        # As in section 3.3.4: the beacon is heard, the plan is given.
        assert scenario.target_from == "beacon"
        assert scenario.noise == 5
        assert scenario.floor_plan == "given"
        assert scenario.pull.weight == 50
        assert scenario.station.odometry.radius_error == 0
    assert met == EXPECTED


def test_full_tables_have_the_dissertations_number_of_trials():
    assert {name: TABLES[name].trials for name in ONLINE} == {
        "3.2": 80,
        "3.3": 50,
        "3.4": 50,
    }


# As printed: time, final position error, net velocity and path efficiency,
# mean and median each, then the success rate.
PRINTED = {
    "3.2": {
        "apf": "15.628 11.20 0.299 0.289 0.520 0.555 0.830 0.854 0.775",
        "apf_escape": "17.032 13.45 0.272 0.274 0.495 0.518 0.792 0.806 0.825",
        "apf_hw, adaptive": (
            "13.125 11.375 0.278 0.277 0.568 0.580 0.844 0.873 0.9875"
        ),
        "apf_hw, random": (
            "12.759 11.425 0.255 0.232 0.578 0.587 0.860 0.872 0.975"
        ),
    },
    "3.3": {
        "apf": "20.932 14.05 0.291 0.253 0.363 0.348 0.710 0.680 0.60",
        "apf_escape": "24.286 18.90 0.304 0.288 0.336 0.317 0.669 0.689 0.64",
        "apf_hw, adaptive": (
            "13.391 11.25 0.290 0.294 0.464 0.476 0.779 0.823 1.00"
        ),
        "apf_hw, random": (
            "15.141 12.03 0.315 0.291 0.449 0.478 0.754 0.794 0.98"
        ),
    },
    "3.4": {
        "apf": "11.009 9.13 0.261 0.236 0.611 0.633 0.914 0.937 0.84",
        "apf_escape": "10.739 9.23 0.274 0.269 0.630 0.644 0.919 0.940 0.80",
        "apf_hw, adaptive": (
            "10.368 9.45 0.283 0.255 0.625 0.645 0.913 0.928 0.98"
        ),
        "apf_hw, random": (
            "10.208 8.625 0.253 0.259 0.637 0.657 0.927 0.948 0.92"
        ),
    },
}
NAMES = [
    "mean_time_s",
    "median_time_s",
    "mean_final_error_m",
    "median_final_error_m",
    "mean_net_velocity",
    "median_net_velocity",
    "mean_path_efficiency",
    "median_path_efficiency",
]


@pytest.mark.parametrize("name", ONLINE)
def test_beside_each_case_stand_the_dissertations_figures(name):
    for case, text in PRINTED[name].items():
        *figures, rate = map(float, text.split())
        assert TABLES[name].dissertation(case) == pytest.approx(
            dict(zip(NAMES, figures, strict=True))
            | {"success_percent": 100 * rate}
        )


@pytest.mark.parametrize("name", ONLINE)
def test_ours_stands_beside_the_adaptive_highway_and_the_rest_alone(name):
    figures = TABLES[name].dissertation
    assert figures("ours") == figures("apf_hw, adaptive")
    # The text's own method has the lidar alone.
    alone = figures("apf_hw, adaptive, lidar alone")
    assert alone == figures("apf_hw, adaptive")
    assert figures("apf, gnron") == {}


def test_the_dissertations_figures_are_columns_of_the_tables():
    assert set(NAMES) <= {column.name for column in COLUMNS}


# Pairs that no tuning saw


UNSEEN = ["unseen", "unseen-faulty"]


@pytest.mark.parametrize("name", UNSEEN)
def test_unseen_pairs_are_none_of_the_tables(name):
    tables = {
        (trial.notes["world"], places(trial))
        for online in ONLINE
        for seed in range(3)
        for trial in TABLES[online].make_trials(seed, 24)
    }
    met = {
        (trial.notes["world"], places(trial))
        for trial in TABLES[name].make_trials(0, 8)
    }
    assert len(met) == 3 * 8
    assert len(tables) == 3 * 3 * 24
    assert not met & tables


def test_unseen_pairs_are_the_same_for_each_source_of_the_pose():
    cases = {}
    for name in UNSEEN:
        cases |= by_case(TABLES[name].make_trials(0, 3))
    for world in ONLINE.values():
        right, *others = (
            cases[f"{world}, {pose}"] for pose in ("ours", *POSES)
        )
        for trials in others:
            assert [places(t) for t in trials] == [places(t) for t in right]
            assert [t.seed for t in trials] == [t.seed for t in right]
    assert len(cases) == 3 * 3


def test_faulty_odometry_is_wrong_by_a_hundredth_and_alone_is_not_corrected():
    found = {}
    for trial in (t for name in UNSEEN for t in TABLES[name].make_trials(0, 1)):
        scenario = load_scenario("navigation", trial.overrides)
        assert scenario.planner == "ours"
        odometry = scenario.station.odometry
        pose = trial.case.removeprefix(f"{scenario.world}, ")
        found[pose] = (
            odometry.radius_error,
            odometry.track_error,
            scenario.pose,
            scenario.station.localization,
        )
    shipped = load_scenario("navigation")
    corrected = (shipped.pose, shipped.station.localization)
    assert found == {
        "ours": (0.0, 0.0, *corrected),
        "ours, faulty odometry": (0.01, -0.01, *corrected),
        "ours, faulty odometry alone": (0.01, -0.01, "odometry", "odometry"),
    }
    assert corrected[0] == "corrected"


# What pictures need


def test_a_path_is_sampled_every_half_second_and_at_its_end():
    times = np.arange(0, 2.25, 0.1)
    truth = np.zeros((len(times), 7))
    truth[:, 0], truth[:, 1] = times, -times
    estimates = np.column_stack([3 * times, 4 * times, np.ones(len(times))])
    run = SimpleNamespace(
        trace={
            "t": times,
            "ground_truth": truth,
            "estimated_target": estimates,
        }
    )
    kept = np.array([0, 0.5, 1.0, 1.5, 2.0, 2.2])
    np.testing.assert_allclose(
        sample_path(run),
        np.column_stack([kept, kept, -kept, 3 * kept, 4 * kept]),
    )
