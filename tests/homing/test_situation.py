"""What the rules of avoidance see, worked by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.driving.gaps import unit
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    Leave,
    Seek,
    initial_state,
)
from drake_mobarm.homing.situation import drive, look, look_around

PARAMETERS = AvoidanceParameters()
FREE = np.full(360, 12.0)
PLACE = np.array([2.0, 1.0])


def scene(distance, ranges=FREE, yaw=0.0, **known):
    """The target is so far along +x, the robot looks along `yaw`."""
    state = replace(
        initial_state(), target=np.add(PLACE, [distance, 0]), **known
    )
    return state, look(state, PLACE, yaw, ranges, 12.0, PARAMETERS)


def ranges_of(returns):
    """Ranges by degrees from straight ahead."""
    ranges = FREE.copy()
    for degrees, distance in returns.items():
        ranges[180 + degrees] = distance
    return ranges


def test_target_is_seen_from_the_robot_in_the_worlds_axes():
    _, situation = scene(-3.0, yaw=1.0)
    np.testing.assert_array_equal(situation.target, [-3, 0])
    assert situation.distance == 3
    assert abs(situation.bearing) == pytest.approx(math.pi)


@pytest.mark.parametrize(("tight", "radius"), [(False, 0.315), (True, 0.285)])
def test_disc_is_the_robot_and_the_margin_of_the_moment(tight, radius):
    _, situation = scene(3.0, tight=tight)
    assert situation.radius == pytest.approx(radius)
    assert situation.tight_radius == pytest.approx(0.285)


@pytest.mark.parametrize(
    ("distance", "tolerance"), [(4.0, 0.85), (1.0, 0.4), (0.2, 0.2)]
)
def test_tolerance_grows_with_the_distance_that_it_never_exceeds(
    distance, tolerance
):
    assert scene(distance)[1].tolerance == pytest.approx(tolerance)


@pytest.mark.parametrize(("more", "is_free"), [(-0.01, False), (0.01, True)])
def test_target_is_free_where_no_more_than_the_tolerance_is_missing(
    more, is_free
):
    # 4 m less 0.85 m have to be free; the disc ends 0.315 m ahead.
    wall = ranges_of({0: 3.15 + 0.315 + more})
    assert scene(4.0, wall)[1].target_is_free() == is_free


@pytest.mark.parametrize(
    ("distance", "across", "is_free"),
    [
        (1.45, 0.3, True),
        (1.45, 0.28, False),
        (1.55, 0.3, False),
        (1.55, 0.32, True),
    ],
)
def test_near_the_target_the_corridor_may_be_tight(distance, across, is_free):
    # A post to the left, 31 degrees off.
    post = ranges_of({31: across / math.sin(math.radians(31))})
    assert scene(distance, post)[1].target_is_free() == is_free


def test_free_lengths_around_are_every_two_degrees_from_straight_behind():
    _, situation = scene(4.0, ranges_of({-90: 2.0}), yaw=0.5)
    around = look_around(situation)
    expected = 0.5 + np.radians(np.arange(-180, 180, 2))
    np.testing.assert_allclose(around.angles, expected)
    # To the right, where the thing is, index 45; the disc is met before it.
    assert around.lengths[45] == pytest.approx(2 - 0.315, abs=1e-5)
    # 0.315 m at 2 m are up to 9.06 degrees to either side.
    blocked = np.flatnonzero(around.lengths < 12)
    np.testing.assert_array_equal(blocked, np.arange(41, 50))
    assert around.lengths.max() == 12


def test_unseen_things_that_were_touched_are_in_the_way():
    touched = np.array([[3.0, 1.0]])
    _, situation = scene(4.0, yaw=0.7, touched=touched)
    assert not situation.target_is_free()
    assert look_around(situation).lengths.min() == pytest.approx(
        1 - 0.315, abs=1e-2
    )


def test_driving_sets_the_waypoint_and_a_careful_speed():
    # 1 m ahead, less the tight disc and 3 cm while turning, at 0.8 m/s^2.
    state, situation = scene(4.0, ranges_of({0: 1.0}))
    way = 1.5 * unit(math.pi / 2)
    mode = Leave(PLACE + way)
    after = drive(state, situation, way, PARAMETERS, rule="leave", mode=mode)
    assert after.rule == "leave"
    assert after.mode is mode
    np.testing.assert_allclose(after.waypoint, PLACE + way)
    # Nearer than 0.8 m beside: 0.715 m of them.
    stopping = math.sqrt(2 * 0.8 * (1 - 0.285 - 0.03))
    beside = 0.4 + 0.6 * 0.715 / 0.8
    assert after.speed_limit == pytest.approx(min(stopping, beside))


def test_driving_is_careful_along_the_way_and_not_another():
    # 0.1 m free to the left: 0.4 m/s stop before it, and 0.475 m/s pass it.
    state, situation = scene(4.0, ranges_of({90: 0.385}))
    for angle, speed in [(90, 0.4), (45, 0.475), (0, 0.475), (-90, 0.475)]:
        way = 1.5 * unit(math.radians(angle))
        after = drive(
            state, situation, way, PARAMETERS, rule="target", mode=Seek()
        )
        assert after.speed_limit == pytest.approx(speed)
