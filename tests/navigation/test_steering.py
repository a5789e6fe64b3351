"""(3.9) and (3.10) by hand."""

import math

import numpy as np
import pytest

from drake_mobarm.navigation.steering import SteeringParameters, steer
from helpers.refusals import assert_refused

GAINS = SteeringParameters(linear_gain=0.5, angular_gain=3.0)


@pytest.mark.parametrize("yaw", [0.0, 2.5, -3.0])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(
    ("degrees", "share"), [(0, 1.0), (45, 0.5), (90, 0.0), (135, 0.0)]
)
def test_speed_falls_linearly_to_a_right_angle_and_turning_grows_linearly(
    degrees, share, side, yaw
):
    angle = side * math.radians(degrees)
    direction = np.array([math.cos(yaw + angle), math.sin(yaw + angle)])
    speed, turn = steer(4.0 * direction, yaw, GAINS)
    # 0.5 * 4 m/s straight ahead; 3 /s for each radian.
    assert speed == pytest.approx(2.0 * share, abs=1e-12)
    assert turn == pytest.approx(3.0 * angle, abs=1e-12)


@pytest.mark.parametrize("yaw", [0.0, 1.0, math.pi])
def test_a_force_that_points_behind_turns_the_robot_about_in_its_place(yaw):
    force = -np.array([math.cos(yaw), math.sin(yaw)])
    speed, turn = steer(force, yaw, GAINS)
    assert speed == 0.0
    # To either side: both are as near.
    assert abs(turn) == pytest.approx(3 * math.pi)


def test_a_forces_size_changes_the_speed_and_not_the_turn_rate():
    weak, strong = (
        steer(size * np.array([1.0, 0.3]), 0.2, GAINS) for size in (1, 7)
    )
    assert strong[0] == pytest.approx(7 * weak[0])
    assert strong[1] == pytest.approx(weak[1])
    assert weak[0] > 0


def test_without_a_force_the_robot_stands():
    assert steer(np.zeros(2), 1.0, GAINS) == (0.0, 0.0)


@pytest.mark.parametrize("name", ["linear_gain", "angular_gain"])
def test_a_gain_that_is_not_positive_is_named(name):
    assert_refused(name, SteeringParameters, **{name: 0.0})
