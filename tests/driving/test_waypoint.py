"""Proportional control to a target, by hand and in closed loop."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_mobarm.driving.waypoint import ControllerParameters, drive_to
from helpers.refusals import assert_refused

ANGLE = st.floats(-math.pi, math.pi)
COORDINATE = st.floats(-20, 20)
POSE = st.tuples(COORDINATE, COORDINATE, st.floats(-10, 10))
LIMIT = (1.0, 2.0)
GAINS = ControllerParameters(linear_gain=1.5, angular_gain=3.0, alignment=0.8)


def test_a_far_target_ahead_is_driven_to_at_full_speed_without_turning():
    assert drive_to([0, 0, 0], [5, 0], LIMIT, GAINS) == (1.0, 0.0)


def test_a_near_target_ahead_is_driven_to_in_proportion():
    v, w = drive_to([1, 1, math.pi / 2], [1, 1.4], LIMIT, GAINS)
    assert v == pytest.approx(0.6)
    assert w == pytest.approx(0)


def test_a_small_heading_error_is_turned_away_in_proportion():
    v, w = drive_to([0, 0, -0.2], [5, 0], LIMIT, GAINS)
    assert w == pytest.approx(0.6)
    # A quarter of `alignment`: (1 + cos 45 deg) / 2.
    assert v == pytest.approx((1 + math.sqrt(0.5)) / 2)


@given(st.floats(0.8, math.pi), st.floats(0.1, 20), st.sampled_from([-1, 1]))
def test_a_target_beside_or_behind_is_turned_to_in_place(error, far, side):
    target = [far * math.cos(error), side * far * math.sin(error)]
    v, w = drive_to([0, 0, 0], target, LIMIT, GAINS)
    assert v == pytest.approx(0, abs=1e-9)
    if error < math.pi - 1e-6:
        assert w == side * 2.0


@given(POSE, st.tuples(COORDINATE, COORDINATE), st.floats(0, 3))
def test_commands_stay_within_the_limits(pose, target, limit):
    v, w = drive_to(pose, target, (limit, 2.0), GAINS)
    assert 0 <= v <= limit
    assert abs(w) <= 2.0


@given(POSE, ANGLE, st.floats(0.1, 5), st.floats(-3, 3))
def test_the_command_depends_on_the_target_in_the_base_frame_only(
    pose, angle, far, error
):
    x, y, yaw = pose
    target = [x + far * math.cos(yaw + error), y + far * math.sin(yaw + error)]
    here = drive_to(pose, target, LIMIT, GAINS)
    local = [far * math.cos(error), far * math.sin(error)]
    assert here == pytest.approx(
        drive_to([0, 0, 0], local, LIMIT, GAINS), abs=1e-6
    )


def test_no_command_on_the_target():
    assert drive_to([1, 2, 3], [1, 2], LIMIT, GAINS) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("pose", "target", "limit", "name"),
    [
        ([0, 0, 0], [math.nan, 0], LIMIT, "p_WT"),
        ([0, 0, 0], [0, math.inf], LIMIT, "p_WT"),
        ([0, 0, math.nan], [1, 0], LIMIT, "pose_WB"),
        ([0, 0, 0], [1, 0], (-0.1, 2.0), "speed_limit"),
        ([0, 0, 0], [1, 0], (1.0, math.nan), "speed_limit"),
    ],
)
def test_what_is_not_finite_is_refused(pose, target, limit, name):
    assert_refused(name, drive_to, pose, target, limit, GAINS)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("linear_gain", 0.0),
        ("angular_gain", math.inf),
        ("alignment", 4.0),
        ("search_turn_rate", 0.0),
    ],
)
def test_invalid_parameters_are_refused_by_name(field, value):
    assert_refused(field, ControllerParameters, **{field: value})


@pytest.mark.parametrize("bearing", [0.0, 1.0, 2.0, 3.14, -2.5])
def test_the_robot_reaches_the_target_on_a_nearly_straight_path(bearing):
    target = [4 * math.cos(bearing), 4 * math.sin(bearing)]
    x = y = yaw = v = w = travelled = 0.0
    for _ in range(1000):  # 20 s with the robot's accelerations.
        v_c, w_c = drive_to([x, y, yaw], target, LIMIT, ControllerParameters())
        v += min(max(v_c - v, -0.02), 0.02)
        w += min(max(w_c - w, -0.06), 0.06)
        yaw += w * 0.02
        x += v * math.cos(yaw) * 0.02
        y += v * math.sin(yaw) * 0.02
        travelled += v * 0.02
        if math.hypot(target[0] - x, target[1] - y) < 0.05:
            break
    assert math.hypot(target[0] - x, target[1] - y) < 0.05
    assert travelled < 4 / 0.98
