"""Meeting, following and leaving a boundary, by hand-worked scenes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.driving.gaps import unit
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    Follow,
    Meeting,
    initial_state,
)
from drake_mobarm.homing.boundary import (
    find_exit,
    follow,
    is_once_round,
    meet,
)
from drake_mobarm.homing.situation import FreeAround, look
from drake_mobarm.sensors.lidar import ray_angles

PARAMETERS = AvoidanceParameters()
RANGE_MAX = 12.0
FREE = np.full(360, RANGE_MAX)


def scene(position, target, visited=((50.0, 50.0),), ranges=FREE):
    state = replace(
        initial_state(),
        target=np.array(target, dtype=float),
        visited=np.array(visited, dtype=float),
    )
    position = np.array(position, dtype=float)
    return state, look(state, position, 0.0, ranges, RANGE_MAX, PARAMETERS)


def around(length_of):
    """Free lengths every 2 degrees: a function of the angle [degrees]."""
    angles = ray_angles(180)
    lengths = [length_of(math.degrees(angle)) for angle in angles]
    return FreeAround(angles, np.array(lengths, dtype=float))


# Meeting


@pytest.mark.parametrize("side", [-1, 1])
def test_the_first_boundary_is_followed_on_the_side_asked_for(side):
    meeting = meet(None, np.array([1.0, 2.0]), side)
    np.testing.assert_array_equal(meeting.place, [1, 2])
    assert (meeting.side, meeting.repeats) == (side, 0)


@pytest.mark.parametrize(
    ("moved", "side", "repeats"),
    [(0.99, -1, 4), (1.01, 1, 4), (1.99, 1, 4), (2.01, 1, 0)],
)
def test_the_side_changes_at_the_same_place_and_repeats_count_near_it(
    moved, side, repeats
):
    last = Meeting(np.array([3.0, 4.0]), 1, repeats=3)
    place = last.place + moved * np.array([0.6, -0.8])
    meeting = meet(last, place, 1)
    np.testing.assert_array_equal(meeting.place, place)
    assert (meeting.side, meeting.repeats) == (side, repeats)


# Leaving


def test_the_exit_is_the_free_place_nearest_to_the_target():
    # From (1, 1), the target 5 m along +y; 3 m are free that way.
    state, situation = scene((1, 1), (1, 6))
    free = around(lambda degrees: 3.0 if abs(degrees - 90) < 1 else 0.5)
    place = find_exit(
        state, Meeting(np.zeros(2), 1), situation, free, PARAMETERS
    )
    np.testing.assert_allclose(place, [1, 4], atol=1e-9)


def test_the_exit_lies_at_the_targets_height_on_a_way_past_it():
    # 10 m are free at 60 degrees to the target's direction, which is 2 m off:
    # nearest to it is the foot of its perpendicular, 1 m along.
    state, situation = scene((0, 0), (2, 0))
    free = around(lambda degrees: 10.0 if abs(degrees - 60) < 1 else 0.0)
    place = find_exit(
        state, Meeting(np.zeros(2), 1), situation, free, PARAMETERS
    )
    np.testing.assert_allclose(place, unit(math.pi / 3), atol=1e-9)


def test_the_exit_is_the_target_itself_where_it_is_free():
    state, situation = scene((1, 1), (1, 1.5))
    place = find_exit(
        state,
        Meeting(np.zeros(2), 1),
        situation,
        around(lambda degrees: 3.0),
        PARAMETERS,
    )
    np.testing.assert_allclose(place, [1, 1.5], atol=1e-9)


@pytest.mark.parametrize(
    ("repeats", "least_gain"), [(0, 0.3), (1, 0.6), (2, 1.2), (5, 2.5)]
)
@pytest.mark.parametrize("more", [-0.01, 0.01])
def test_an_exit_gains_twice_as_much_each_time_up_to_half_of_the_way(
    repeats, least_gain, more
):
    # Of the places visited the nearest is 5 m from the target.
    state, situation = scene((1, 1), (1, 7), [(1, 2), (1, 1), (9, 9)])
    length = 1 + least_gain + more
    free = around(lambda degrees: length if abs(degrees - 90) < 1 else 0.0)
    meeting = Meeting(np.zeros(2), 1, repeats)
    found = find_exit(state, meeting, situation, free, PARAMETERS)
    assert (found is not None) == (more > 0)


# Once round


@pytest.mark.parametrize(
    ("away", "followed", "leg", "round_"),
    [
        (0.49, 3.1, 10.0, True),
        (0.51, 3.1, 10.0, False),
        (0.49, 2.9, 10.0, False),
        # After turning back the way of the first leg is in between.
        (0.49, 12.9, math.inf, False),
        (0.49, 13.1, math.inf, True),
    ],
)
def test_once_round_is_back_at_the_meeting_after_the_least_way(
    away, followed, leg, round_
):
    _, situation = scene((1, 1), (5, 5))
    meeting = Meeting(np.array([1 + away, 1]), 1)
    mode = Follow(1, np.array([1.0, 1.0]), leg, followed)
    assert is_once_round(mode, meeting, situation, PARAMETERS) == round_


# Following


@pytest.mark.parametrize("side", [-1, 1])
def test_the_first_open_direction_from_the_target_is_followed(side):
    # A wall ahead, from -45 to 45 degrees; the target is behind it.
    state, situation = scene((1, 2), (6, 2))
    free = around(lambda degrees: 0.1 if abs(degrees) < 45 else 3.0)
    mode = Follow(side, situation.scan.position, leg=10.0)
    after = follow(state, mode, situation, free, PARAMETERS)
    assert after.rule == "follow"
    # With the wall to the right (+1) the robot turns left; 1.2 m ahead.
    expected = [1, 2] + 1.2 * unit(math.radians(side * 46))
    np.testing.assert_allclose(after.waypoint, expected, atol=1e-9)
    assert after.mode.side == side


def test_the_robot_turns_back_once_after_the_first_leg():
    state, situation = scene((0, 0), (6, 0))
    free = around(lambda degrees: 0.1 if abs(degrees) < 45 else 3.0)
    mode = Follow(1, np.zeros(2), leg=10.0, followed=9.9)
    assert follow(state, mode, situation, free, PARAMETERS).mode.side == 1
    mode = replace(mode, followed=10.1)
    turned = follow(state, mode, situation, free, PARAMETERS)
    assert turned.mode.side == -1
    assert turned.mode.followed == 0
    assert turned.waypoint[1] < 0
    again = replace(turned.mode, followed=1000.0)
    assert follow(state, again, situation, free, PARAMETERS).mode.side == -1


@pytest.mark.parametrize(("open_", "turn"), [(0.39, 60), (0.41, 30)])
def test_a_direction_is_open_from_the_lookahead_on(open_, turn):
    state, situation = scene((0, 0), (6, 0))

    def length(degrees):
        return 0.1 if degrees < 29 else open_ if degrees < 59 else 3.0

    mode = Follow(1, np.zeros(2), leg=10.0)
    after = follow(state, mode, situation, around(length), PARAMETERS)
    way = math.degrees(math.atan2(after.waypoint[1], after.waypoint[0]))
    assert way == pytest.approx(turn)


def test_the_sweep_begins_at_the_edge_last_seen():
    # The wall's edge is at 90 degrees; what is open towards the target does
    # not count while the boundary is followed beyond it.
    state, situation = scene((1, 1), (6, 1))
    free = around(lambda degrees: 0.1 if 80 < degrees < 119 else 3.0)
    mode = Follow(1, np.ones(2), leg=10.0, edge=np.array([1.0, 2.0]))
    after = follow(state, mode, situation, free, PARAMETERS)
    np.testing.assert_allclose(
        after.waypoint, [1, 1] + 1.2 * unit(math.radians(120)), atol=1e-9
    )


def test_the_edge_is_the_point_that_blocks_the_last_closed_direction():
    # A post 1 m ahead: with the disc's radius of 0.315 m it blocks up to
    # 18.4 degrees, so that 18 is the last closed direction.
    ranges = FREE.copy()
    ranges[180] = 1.0
    state, situation = scene((2, 3), (8, 3), ranges=ranges)
    free = around(lambda degrees: 0.1 if abs(degrees) < 19 else 3.0)
    mode = Follow(1, situation.scan.position, leg=10.0)
    after = follow(state, mode, situation, free, PARAMETERS)
    np.testing.assert_allclose(after.mode.edge, [3, 3], atol=1e-9)
    # The same where an edge is known, straight behind the post.
    mode = replace(mode, edge=np.array([4.0, 3.0]))
    after = follow(state, mode, situation, free, PARAMETERS)
    np.testing.assert_allclose(after.mode.edge, [3, 3], atol=1e-9)


def test_a_known_edge_stays_while_its_direction_is_open():
    # A post 2 m away, 2 degrees to the right: before the sweep to the left.
    ranges = FREE.copy()
    ranges[178] = 2.0
    state, situation = scene((2, 3), (8, 3), ranges=ranges)
    post = [2, 3] + 2 * unit(math.radians(-2))
    free = around(lambda degrees: 3.0)
    edge = np.array([4.0, 3.0])
    for known, found in [(edge, edge), (None, post)]:
        mode = Follow(1, situation.scan.position, leg=10.0, edge=known)
        after = follow(state, mode, situation, free, PARAMETERS)
        np.testing.assert_allclose(after.mode.edge, found, atol=1e-9)
