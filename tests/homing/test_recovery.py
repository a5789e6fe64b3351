"""Rule "back": what is remembered of a touch, and what is dropped."""

from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.driving.gaps import unit
from drake_mobarm.driving.touch import Recovery
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    ChosenGap,
    Follow,
    Leave,
    Seek,
    initial_state,
)
from drake_mobarm.homing.recovery import back_off, start_backing_off
from drake_mobarm.homing.situation import look

PARAMETERS = AvoidanceParameters()
RANGE_MAX = 12.0
FREE = np.full(360, RANGE_MAX)
# 0.02 m outside the robot's radius of 0.27 m.
TOUCH = 0.29


def scene(yaw=0.0, ranges=FREE, **known):
    """The robot at (1, 2), on its way to (5, 2) at 0.5 m/s."""
    state = replace(
        initial_state(),
        **{
            "target": np.array([5.0, 2.0]),
            "waypoint": np.array([2.2, 2.0]),
            "speed_limit": 0.5,
            "rule": "target",
            **known,
        },
    )
    position = np.array([1.0, 2.0])
    return state, look(state, position, yaw, ranges, RANGE_MAX, PARAMETERS)


def touched(mode, known=(), yaw=0.0):
    known = np.array(known, dtype=float).reshape(-1, 2)
    state, situation = scene(mode=mode, touched=known, yaw=yaw)
    return start_backing_off(state, situation, PARAMETERS)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("follows", [False, True])
def test_touch_is_at_the_side_of_what_is_passed(side, follows):
    # With the thing to the right, +1, 0.7 rad to the right.
    mode = (
        Follow(side, np.array([1.0, 2.0]), leg=10.0)
        if follows
        else Seek(gap=ChosenGap(np.array([3.0, 3.0]), side))
    )
    after = touched(mode)
    place = after.touched[1]
    np.testing.assert_allclose(place, [1, 2] + TOUCH * unit(-side * 0.7))
    assert after.recovery == Recovery(standing=0.0, backing=1.2)


def test_the_last_thirty_touches_are_remembered():
    old = np.arange(180.0).reshape(90, 2) + 10
    after = touched(Seek(), old)
    assert after.touched.shape == (90, 2)
    np.testing.assert_array_equal(after.touched[:87], old[3:])


def test_a_touch_drops_the_gap_or_exit_and_keeps_the_boundary():
    gap = ChosenGap(np.array([3.0, 3.0]), 1)
    seek = touched(Seek(gap=gap, shortest_way=7.0, idle=0.3)).mode
    assert (seek.gap, seek.shortest_way, seek.idle) == (None, 7.0, 0.3)
    leave = touched(Leave(np.array([3.0, 3.0]))).mode
    assert isinstance(leave, Seek)
    assert (leave.gap, leave.idle) == (None, 0)
    follow = Follow(1, np.array([1.0, 2.0]), leg=10.0)
    assert touched(follow).mode is follow


@pytest.mark.parametrize(
    ("room", "rule", "limit"), [(0.04, "wait", 0.0), (0.06, "back", -0.2)]
)
def test_robot_backs_off_within_its_tight_radius(room, rule, limit):
    # 0.27 m and 0.015 m.
    ranges = FREE.copy()
    ranges[0] = 0.285 + room
    state, situation = scene(
        yaw=1.0, ranges=ranges, recovery=Recovery(backing=0.9)
    )
    after = back_off(state, situation, 0.1, PARAMETERS)
    assert (after.rule, after.speed_limit) == (rule, limit)
    assert after.recovery.backs_off == (rule == "back")
