"""The map's driver beside walls: how fast it goes, and when it backs off."""

import math

import numpy as np
import pytest

from drake_mobarm.driving.map_avoidance import update
from drake_mobarm.driving.map_avoidance_state import (
    MapAvoidanceParameters,
    initial_state,
)
from drake_mobarm.sensors.lidar import cast_rays
from drake_mobarm.world.obstacles import outlines_to_segments
from helpers.shapes import rectangle

RANGE_MAX = 12.0


def states_at(pose, target, wall, count=1, **parameters):
    """The states after some scans from one pose."""
    sides = outlines_to_segments([wall])
    ranges = np.minimum(cast_rays(*sides, pose, 360), RANGE_MAX)
    state, states = initial_state(), []
    for _ in range(count):
        state = update(
            state,
            pose,
            target,
            ranges,
            RANGE_MAX,
            0.1,
            MapAvoidanceParameters(**parameters),
        )
        states.append(state)
    return states


@pytest.mark.parametrize("yaw", [math.pi / 2, -math.pi / 2])
def test_speed_stops_before_a_wall_on_the_way_that_it_turns_to(yaw):
    # 1 m along x, less the radius of 0.27 m and the margin: what it may be
    # beside things is out of the way.
    limited = {"deceleration": 0.1, "care_speed": 1.0, "margin": 0.03}
    passing = 1.0 + 0.75 * 0.7
    for x, speed in [(1.0, math.sqrt(2 * 0.1 * 0.7)), (-1.0, passing)]:
        wall = rectangle(min(x, 2 * x), -9, max(x, 2 * x), 9)
        (state,) = states_at([0, 0, yaw], [0.85, 0], wall, **limited)
        assert state.activity == "drive"
        np.testing.assert_allclose(state.waypoint, [0.85, 0])
        assert state.speed_limit == pytest.approx(speed, abs=1e-6)


@pytest.mark.parametrize(("behind", "backs"), [(0.33, False), (0.6, True)])
def test_it_backs_off_only_where_there_is_room_behind(behind, backs):
    wall = rectangle(-2, -9, -behind, 9)
    states = states_at([0, 0, 0], [4, 0], wall, count=12)
    assert "back" in [state.activity for state in states]
    limits = [state.speed_limit for state in states]
    assert (min(limits) < 0) == backs
