"""Homing with sensors that fail: never a false arrival, never poisoned."""

import math

import numpy as np
import pytest

from drake_mobarm import load_scenario, run
from drake_mobarm.homing.job import ESTIMATORS
from helpers.faults import (
    FaultyBeacon,
    between,
    faulty_odometry,
    louder,
    stuck_at,
)

FALSE_ARRIVAL = 0.5  # Farther from the beacon [m] nobody has arrived.
ALWAYS = math.inf
each_estimator = pytest.mark.parametrize("estimator", ESTIMATORS)


def open_space(*overrides):
    return load_scenario(
        "homing",
        [
            *["world=empty", "avoidance=none", "start=[0, 0, 0]", "noise=5"],
            *["beacon=[4, 3]", "time_limit=40", *overrides],
        ],
    )


def arrivals_error(result):
    """From robot to beacon [m] where it said that it arrived; else 0."""
    arrived = result.outputs["arrived"][0] > 0.5
    return result.metrics["final_position_error_m"] if arrived else 0.0


STRENGTHS = {
    "stuck near": between(0, ALWAYS, stuck_at(-34.0)),
    "stuck near on the way": between(2, ALWAYS, stuck_at(-34.0)),
    "10 dB too high": between(0, ALWAYS, louder(10.0)),
    "100 dB too high for a second": between(2, 3, louder(100.0)),
    "400 dB too low for 3 s": between(2, 5, louder(-400.0)),
}


@each_estimator
@pytest.mark.parametrize("fault", STRENGTHS.values(), ids=STRENGTHS)
def test_a_wrong_strength_makes_no_false_arrival(estimator, fault):
    scenario = open_space(f"estimator={estimator}", "noise=3")
    beacon = FaultyBeacon(scenario, fault)
    result = run(scenario, seed=1, blocks={"beacon": beacon})
    assert arrivals_error(result) < FALSE_ARRIVAL
    # The filter does better than to refuse: it arrives.
    assert result.success or estimator == "hybrid"


@each_estimator
def test_a_strength_far_too_low_for_3_s_is_dropped_and_told(estimator):
    scenario = open_space(f"estimator={estimator}")
    fault = between(2, 5, lambda angle, rssi, valid: (angle, -400.0, valid))
    beacon = FaultyBeacon(scenario, fault)
    result = run(scenario, seed=1, blocks={"beacon": beacon})
    assert result.success
    assert result.metrics["readings_dropped"] == pytest.approx(60, abs=1)
    assert "readings dropped" in result.describe()


POSES = {
    "a tenth too long": lambda time, x, y, yaw: (1.1 * x, 1.1 * y, yaw),
    "a frame turned by half a turn at 3 s": between(
        3, ALWAYS, lambda x, y, yaw: (-x, -y, yaw + math.pi)
    ),
    "a jump of 5 m at 3 s": between(
        3, ALWAYS, lambda x, y, yaw: (x + 5, y, yaw)
    ),
}


@each_estimator
@pytest.mark.parametrize("fault", POSES.values(), ids=POSES)
def test_wrong_odometry_makes_no_false_arrival(estimator, fault):
    scenario = open_space(f"estimator={estimator}")
    odometry = faulty_odometry(scenario, fault)
    result = run(scenario, seed=1, blocks={"odometry": odometry})
    assert arrivals_error(result) < FALSE_ARRIVAL
    assert result.success


@each_estimator
def test_a_heading_that_is_wrong_by_half_a_turn_makes_no_false_arrival(
    estimator,
):
    # Places go on in the old frame: nothing fits together any more.
    scenario = open_space(f"estimator={estimator}")
    fault = between(3, ALWAYS, lambda x, y, yaw: (x, y, yaw + math.pi))
    odometry = faulty_odometry(scenario, fault)
    result = run(scenario, seed=1, blocks={"odometry": odometry})
    assert arrivals_error(result) < FALSE_ARRIVAL


@each_estimator
def test_a_dropout_of_97_percent_makes_no_false_arrival(estimator):
    scenario = open_space(
        f"estimator={estimator}",
        "station.beacon.dropout=0.97",
        "time_limit=60",
    )
    result = run(scenario, seed=1)
    assert arrivals_error(result) < FALSE_ARRIVAL


@each_estimator
@pytest.mark.parametrize("number", [math.nan, math.inf, 1e300, -1e300])
@pytest.mark.parametrize("element", [0, 2])
def test_a_pose_that_cannot_be_one_is_survived_and_told(
    estimator, number, element
):
    def broken(*pose):
        return [number if i == element else p for i, p in enumerate(pose)]

    scenario = open_space(f"estimator={estimator}")
    odometry = faulty_odometry(scenario, between(2, 2.2, broken))
    result = run(scenario, seed=1, blocks={"odometry": odometry})
    assert result.success
    trace = result.trace
    bad = (trace["t"] > 2.001) & (trace["t"] < 2.199)
    assert bad.sum() == 3
    np.testing.assert_array_equal(trace["commanded_base_velocity"][bad], 0)
    assert result.metrics["poses_dropped"] >= 3
    assert "poses dropped" in result.describe()


@pytest.mark.parametrize("avoidance", ["rules", "map"])
def test_an_impossible_pose_in_a_house_is_survived(avoidance):
    scenario = load_scenario(
        "homing",
        [f"avoidance={avoidance}", "start=[-1, 1, 0]", "beacon=[2, 1]"],
    )
    for number in (math.nan, 1e300):
        fault = between(1, 1.2, lambda x, y, yaw, n=number: (n, y, yaw))
        odometry = faulty_odometry(scenario, fault)
        result = run(scenario, seed=1, blocks={"odometry": odometry})
        assert result.success
        assert np.isfinite(result.trace["commanded_base_velocity"]).all()


def test_a_sensor_that_hangs_makes_no_false_arrival():
    # From 5 s on it tells the same reading, however the robot turns.
    scenario = open_space("start=[0, 0, 0.5]", "beacon=[5, 3]", "time_limit=60")
    told = []

    def hang(*reading):
        told.append(told[0] if told else reading)
        return told[0]

    beacon = FaultyBeacon(scenario, between(5, ALWAYS, hang))
    result = run(scenario, seed=0, blocks={"beacon": beacon})
    assert len(told) > 100
    assert arrivals_error(result) < FALSE_ARRIVAL
