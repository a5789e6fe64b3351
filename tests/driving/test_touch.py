"""Standing, touching what is unseen, and backing off, worked by hand."""

import math

import numpy as np
import pytest

from drake_mobarm.driving.gaps import unit
from drake_mobarm.driving.scan import Scan
from drake_mobarm.driving.touch import (
    Recovery,
    TouchParameters,
    back_off,
    count_standing,
    has_stalled,
    touched_points,
)

PARAMETERS = TouchParameters()
PERIOD = 0.1
POSITION = np.array([1.0, 2.0])
RANGE_MAX = 12.0
FREE = np.full(360, RANGE_MAX)
NOTHING = np.empty((0, 2))
# 0.02 m outside the robot's radius of 0.27 m.
TOUCH = 0.29


def scan_of(yaw=0.0, ranges=FREE):
    return Scan.from_ranges(POSITION, yaw, ranges, RANGE_MAX, NOTHING)


# Standing


def standing(velocity, *, before=0.3, way=(1.2, 0.0), limit=0.5, yaw=0.0):
    """For how long the robot has stood, in tenths of a second."""
    recovery = count_standing(
        Recovery(standing=before),
        scan_of(yaw),
        POSITION + way,
        limit,
        velocity,
        PERIOD,
        PARAMETERS,
    )
    return round(recovery.standing / PERIOD, 6)


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


def test_time_of_standing_does_not_fall_below_nothing():
    assert standing((0.5, 0.0), before=0.0) == 0


@pytest.mark.parametrize(
    ("limit", "way", "count"),
    [(0.11, 1.0, 4), (0.09, 1.0, 2), (0.5, 0.21, 4), (0.5, 0.19, 2)],
)
def test_robot_that_is_not_to_move_does_not_stand(limit, way, count):
    assert standing((0, 0), limit=limit, way=(way, 0.0)) == count


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(
    ("error", "turn_rate", "count"),
    [(0.41, 0.11, 2), (0.41, -0.11, 2), (0.41, 0.09, 4), (0.39, 0.11, 4)],
)
def test_turning_towards_the_way_is_no_standing(side, error, turn_rate, count):
    assert standing((0, turn_rate), yaw=side * error) == count


def test_heading_error_is_that_across_half_a_turn():
    # The way is straight to -x, the robot looks 0.1 rad off.
    assert standing((0, 1), yaw=0.1 - math.pi, way=(-1.0, 0.0)) == 4
    # Straight to +y.
    assert standing((0, 1), yaw=math.pi / 2 - 0.1, way=(0.0, 1.0)) == 4


def test_half_as_many_scans_a_second_count_the_same_time():
    recovery = Recovery()
    for _ in range(2):
        assert not has_stalled(recovery, PARAMETERS)
        recovery = count_standing(
            recovery,
            scan_of(),
            POSITION + np.array([1, 0]),
            0.5,
            (0, 0),
            0.25,
            PARAMETERS,
        )
    assert has_stalled(recovery, PARAMETERS)


@pytest.mark.parametrize(
    ("time", "backing", "stalled"),
    [(0.4, 0.0, False), (0.5, 0.0, True), (0.6, 0.0, True), (0.9, 0.1, False)],
)
def test_stall_is_standing_for_long_enough_and_not_backing_off(
    time, backing, stalled
):
    recovery = Recovery(standing=time, backing=backing)
    assert has_stalled(recovery, PARAMETERS) == stalled


# Touching


def middle_of_touch(known=NOTHING, side=0, yaw=0.0):
    return touched_points(scan_of(yaw), known, side)[1]


def test_touch_is_three_points_across_the_direction_of_the_thing():
    points = touched_points(scan_of(math.pi / 2), NOTHING, 0)
    np.testing.assert_allclose(
        points,
        [[1.08, 2 + TOUCH], [1, 2 + TOUCH], [0.92, 2 + TOUCH]],
        atol=1e-12,
    )


@pytest.mark.parametrize(("side", "angle"), [(0, 0.0), (1, -0.7), (-1, 0.7)])
def test_touch_is_at_the_side_of_what_is_passed(side, angle):
    np.testing.assert_allclose(
        middle_of_touch(side=side), POSITION + TOUCH * unit(angle)
    )


def test_a_thing_that_was_touched_goes_on_beside_that_place():
    # It was touched at 0.35 rad: the next direction on its side is nearest.
    known = POSITION + TOUCH * unit(np.array([0.35]))
    away = 2 * TOUCH * math.sin(0.35 / 2)
    place = middle_of_touch(known)
    assert np.hypot(*(place - known[0])) == pytest.approx(away)


def test_a_touch_far_from_all_known_ones_is_a_new_thing():
    known = POSITION + np.array([[0.0, -2.0]])
    np.testing.assert_allclose(
        middle_of_touch(known), POSITION + np.array([TOUCH, 0.0])
    )


# Backing off


@pytest.mark.parametrize(("room", "backs"), [(0.04, False), (0.06, True)])
def test_robot_backs_off_where_there_is_room_behind(room, backs):
    ranges = FREE.copy()
    ranges[0] = 0.285 + room
    recovery = Recovery(standing=0.2, backing=0.9)
    after, limit = back_off(
        recovery, scan_of(1.0, ranges), 0.285, PERIOD, PARAMETERS
    )
    if backs:
        assert limit == -0.2
        assert after.backing == pytest.approx(0.8)
    else:
        assert limit == 0.0
        assert after.backing == 0.0
    assert after.standing == 0.2


def test_backing_off_lasts_for_its_time():
    recovery, updates = Recovery(backing=PARAMETERS.back_time), 0
    while recovery.backs_off:
        recovery, limit = back_off(
            recovery, scan_of(), 0.285, PERIOD, PARAMETERS
        )
        assert limit < 0
        updates += 1
    assert updates == 12
