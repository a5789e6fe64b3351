"""A run's figures from traces made by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_mobarm.homing.metrics import count_dropped, homing_metrics, judge
from drake_mobarm.sensors.rssi import RssiModel

POINT = st.tuples(st.floats(-10, 10), st.floats(-10, 10))


def trace(times, path, estimates=None, contacts=0):
    path = np.asarray(path, dtype=float)
    ground_truth = np.zeros((len(path), 7))
    ground_truth[:, :2] = path
    ground_truth[:, 2:6] = 77.0  # Nobody's business here.
    ground_truth[:, 6] = np.linspace(0, contacts, len(path))
    if estimates is None:
        estimates = np.full((len(path), 3), math.nan)
    return {
        "t": np.asarray(times, dtype=float),
        "ground_truth": ground_truth,
        "estimated_target": np.asarray(estimates, dtype=float),
    }


def test_metrics_of_a_right_angled_way_are_those_of_the_footnotes():
    # 3 m along x, 4 m along y, in 10 s; the beacon is 1 m on, guessed 0.5 m
    # to its side.
    run = trace(
        [0, 4, 10],
        [(1, 1), (4, 1), (4, 5)],
        [(9, 9, 1), (8, 8, 1), (4.5, 6, 1)],
        contacts=2,
    )
    assert homing_metrics(run, [4.0, 6.0]) == pytest.approx(
        {
            "time_to_target_s": 10.0,
            "net_velocity_m_per_s": 0.5,
            "goal_position_error_m": 0.5,
            "final_position_error_m": 1.0,
            "path_efficiency": 5 / 7,
            "distance_travelled_m": 7.0,
            "contacts": 2.0,
        }
    )


def test_straight_way_has_an_efficiency_of_one():
    run = trace([0, 1, 2], [(0, 0), (1, 1), (3, 3)])
    assert homing_metrics(run, [3, 3])["path_efficiency"] == pytest.approx(1)


def test_short_way_has_its_efficiency_too():
    # 0.3 m along x, 0.4 m along y: 0.5 m from where it began.
    run = trace([0, 1, 2], [(0, 0), (0.3, 0), (0.3, 0.4)])
    assert homing_metrics(run, [1, 1])["path_efficiency"] == pytest.approx(
        0.5 / 0.7
    )


def test_way_back_to_the_start_has_no_net_velocity_and_no_efficiency():
    run = trace([0, 1, 2], [(0, 0), (2, 0), (0, 0)])
    metrics = homing_metrics(run, [5, 0])
    assert metrics["net_velocity_m_per_s"] == 0
    assert metrics["path_efficiency"] == 0
    assert metrics["distance_travelled_m"] == 4


def test_robot_that_never_left_has_an_efficiency_of_one():
    metrics = homing_metrics(trace([0, 3], [(1, 1), (1, 1)]), [1, 1.5])
    assert metrics["path_efficiency"] == 1
    assert metrics["net_velocity_m_per_s"] == 0
    assert metrics["distance_travelled_m"] == 0
    assert metrics["final_position_error_m"] == 0.5


def test_trace_of_one_sample_has_no_velocity():
    metrics = homing_metrics(trace([0], [(1, 1)]), [1, 1])
    assert metrics["net_velocity_m_per_s"] == 0
    assert metrics["time_to_target_s"] == 0


def test_goal_error_is_nan_without_an_estimate_and_the_rest_is_known():
    metrics = homing_metrics(trace([0, 1], [(0, 0), (1, 0)]), [2, 0])
    assert math.isnan(metrics.pop("goal_position_error_m"))
    assert all(math.isfinite(value) for value in metrics.values())


def test_only_the_last_estimate_counts():
    run = trace([0, 1], [(0, 0), (1, 0)], [(50, 50, 1), (2, 0, 1)])
    assert homing_metrics(run, [2, 0])["goal_position_error_m"] == 0


@given(st.lists(POINT, min_size=2, max_size=20), POINT)
def test_metrics_keep_the_triangles_inequality(path, beacon):
    run = trace(np.arange(len(path)), path)
    metrics = homing_metrics(run, beacon)
    assert 0 <= metrics["path_efficiency"] <= 1 + 1e-9
    straight = metrics["net_velocity_m_per_s"] * metrics["time_to_target_s"]
    assert straight <= metrics["distance_travelled_m"] + 1e-9
    start = math.dist(path[0], beacon)
    assert abs(start - straight) <= metrics["final_position_error_m"] + 1e-9


@given(st.lists(POINT, min_size=2, max_size=20), POINT, POINT)
def test_metrics_do_not_depend_on_where_the_world_is(path, beacon, shift):
    times = np.arange(len(path))
    here = homing_metrics(trace(times, path), beacon)
    there = homing_metrics(
        trace(times, np.add(path, shift)), np.add(beacon, shift)
    )
    for name in ("net_velocity_m_per_s", "final_position_error_m"):
        assert here[name] == pytest.approx(there[name], abs=1e-9)


def metrics_with_error(error):
    return {"final_position_error_m": error}


@pytest.mark.parametrize(
    ("error", "arrived", "success"),
    [
        (0.2, True, True),
        (0.999, True, True),
        (1.0, True, False),
        (1.5, True, False),
        (0.2, False, False),
        (1.5, False, False),
    ],
)
def test_success_is_to_end_by_oneself_less_than_a_metre_away(
    error, arrived, success
):
    assert judge(metrics_with_error(error), arrived, 60.0)[0] is success


def test_reason_says_what_went_wrong_and_by_how_much():
    assert "1.50 m" in judge(metrics_with_error(1.5), True, 60.0)[1]
    assert "60 s" in judge(metrics_with_error(0.1), False, 60.0)[1]


def test_final_error_that_is_not_a_number_is_no_success():
    assert judge(metrics_with_error(math.nan), True, 60.0)[0] is False


def test_samples_that_no_estimator_can_use_are_counted():
    poses = [[0, 0, 0], [math.nan, 0, 0], [1e300, 0, 0], [1, 1, 90]]
    readings = [
        [0.1, -60.0, 1],
        [math.nan, math.nan, 0],  # Nothing heard: nothing dropped.
        [math.nan, -60.0, 1],
        [0.1, -400.0, 1],
    ]
    run = {
        "measured_base_pose": np.array(poses),
        "beacon_reading": np.array(readings),
    }
    assert count_dropped(run, RssiModel()) == {
        "poses_dropped": 2.0,
        "readings_dropped": 2.0,
    }
