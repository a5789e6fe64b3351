"""Standing, touching what is unseen, and backing off, worked by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.driving.gaps import unit
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    ChosenGap,
    Follow,
    Leave,
    Recovery,
    Seek,
    initial_state,
)
from drake_mobarm.homing.recovery import (
    back_off,
    count_standing,
    has_stalled,
    start_backing_off,
)
from drake_mobarm.homing.situation import look

PARAMETERS = AvoidanceParameters()
RANGE_MAX = 12.0
FREE = np.full(360, RANGE_MAX)
# 0.06 m outside the robot's radius of 0.27 m.
TOUCH = 0.33


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


def standing(velocity, standing=3, **scene_of):
    state, situation = scene(recovery=Recovery(standing=standing), **scene_of)
    return count_standing(
        state, situation, velocity, PARAMETERS
    ).recovery.standing


# Standing


@pytest.mark.parametrize(
    ("velocity", "count"),
    [
        ((0.0, 0.0), 4),
        ((0.029, 0.0), 4),
        ((-0.029, 0.0), 4),
        ((0.031, 0.0), 2),
        ((-0.031, 0.0), 2),
        # It faces its way, so that it has not to turn.
        ((0.0, 1.0), 4),
    ],
)
def test_robot_that_is_to_move_stands_below_the_stall_speed(velocity, count):
    assert standing(velocity) == count


def test_count_of_standing_does_not_fall_below_nothing():
    assert standing((0.5, 0.0), standing=0) == 0


@pytest.mark.parametrize(
    ("limit", "way", "count"),
    [(0.11, 1.0, 4), (0.09, 1.0, 2), (0.5, 0.21, 4), (0.5, 0.19, 2)],
)
def test_robot_that_is_not_to_move_does_not_stand(limit, way, count):
    waypoint = np.array([1.0 + way, 2.0])
    assert standing((0, 0), speed_limit=limit, waypoint=waypoint) == count


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(
    ("error", "turn_rate", "count"),
    [(0.41, 0.11, 2), (0.41, -0.11, 2), (0.41, 0.09, 4), (0.39, 0.11, 4)],
)
def test_turning_towards_the_way_is_no_standing(side, error, turn_rate, count):
    assert standing((0, turn_rate), yaw=side * error) == count


def test_heading_error_is_that_across_half_a_turn():
    # The way is straight to -x, the robot looks 0.1 rad off.
    waypoint = np.array([0.0, 2.0])
    assert standing((0, 1), yaw=0.1 - math.pi, waypoint=waypoint) == 4
    # Straight to +y.
    waypoint = np.array([1.0, 3.0])
    assert standing((0, 1), yaw=math.pi / 2 - 0.1, waypoint=waypoint) == 4


@pytest.mark.parametrize(
    ("count", "backing", "stalled"),
    [(4, 0, False), (5, 0, True), (6, 0, True), (9, 1, False)],
)
def test_stall_is_standing_for_long_enough_and_not_backing_off(
    count, backing, stalled
):
    state, _ = scene(recovery=Recovery(standing=count, backing=backing))
    assert has_stalled(state, PARAMETERS) == stalled


# Touching


def touched(mode, known=(), yaw=0.0):
    known = np.array(known, dtype=float).reshape(-1, 2)
    state, situation = scene(mode=mode, touched=known, yaw=yaw)
    return start_backing_off(state, situation, PARAMETERS)


def test_touch_straight_ahead_is_three_points_across_the_way():
    after = touched(Seek(), yaw=math.pi / 2)
    np.testing.assert_allclose(
        after.touched,
        [[1.08, 2 + TOUCH], [1, 2 + TOUCH], [0.92, 2 + TOUCH]],
        atol=1e-12,
    )
    assert after.recovery == Recovery(standing=0, backing=12)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("follows", [False, True])
def test_touch_is_at_the_side_of_what_is_passed(side, follows):
    # With the thing to the right, +1, 0.7 rad to the right.
    mode = (
        Follow(side, np.array([1.0, 2.0]), leg=10.0)
        if follows
        else Seek(gap=ChosenGap(np.array([3.0, 3.0]), side))
    )
    place = touched(mode).touched[1]
    np.testing.assert_allclose(place, [1, 2] + TOUCH * unit(-side * 0.7))


def test_touch_goes_on_to_the_next_direction_where_one_is_known():
    mode = Follow(1, np.array([1.0, 2.0]), leg=10.0)
    known = []
    for angle in (-0.7, 0.0, 0.7, 0.7):
        after = touched(mode, known)
        place = after.touched[len(known) + 1]
        np.testing.assert_allclose(place, [1, 2] + TOUCH * unit(angle))
        known = after.touched
    # Known is what is within 0.15 m.
    for away, angle in [(0.14, 0.0), (0.16, -0.7)]:
        near = [1, 2] + (TOUCH + away) * unit(-0.7)
        place = touched(mode, [near]).touched[2]
        np.testing.assert_allclose(place, [1, 2] + TOUCH * unit(angle))


def test_the_last_thirty_touches_are_remembered():
    old = np.arange(180.0).reshape(90, 2) + 10
    after = touched(Seek(), old)
    assert after.touched.shape == (90, 2)
    np.testing.assert_array_equal(after.touched[:87], old[3:])


def test_a_touch_drops_the_gap_or_exit_and_keeps_the_boundary():
    gap = ChosenGap(np.array([3.0, 3.0]), 1)
    seek = touched(Seek(gap=gap, shortest_way=7.0, idle=3)).mode
    assert (seek.gap, seek.shortest_way, seek.idle) == (None, 7.0, 3)
    leave = touched(Leave(np.array([3.0, 3.0]))).mode
    assert isinstance(leave, Seek)
    assert (leave.gap, leave.idle) == (None, 0)
    follow = Follow(1, np.array([1.0, 2.0]), leg=10.0)
    assert touched(follow).mode is follow


# Backing off


@pytest.mark.parametrize(("room", "backs"), [(0.04, False), (0.06, True)])
def test_robot_backs_off_where_there_is_room_behind(room, backs):
    # Within its tight radius, 0.27 m and 0.015 m, from the centre.
    ranges = FREE.copy()
    ranges[0] = 0.285 + room
    state, situation = scene(
        yaw=1.0, ranges=ranges, recovery=Recovery(standing=2, backing=9)
    )
    after = back_off(state, situation, PARAMETERS)
    if backs:
        assert (after.rule, after.speed_limit) == ("back", -0.2)
        assert after.recovery == Recovery(standing=2, backing=8)
    else:
        assert (after.rule, after.speed_limit) == ("wait", 0.0)
        assert after.recovery == Recovery(standing=2, backing=0)
