"""Our planner by plans that are wrong, and at targets inside of things."""

import math

import numpy as np
import pytest

from drake_mobarm.driving.known_floor import KnownFloor
from drake_mobarm.navigation.map_planner import MapPlanner
from drake_mobarm.world.occupancy import OccupancyGrid
from helpers.planning import HOUSE, SHIPPED, U, planner, wall_with_doors
from helpers.rolling import LIDAR, SPEED_LIMIT, Rolling, room
from helpers.shapes import rectangle

# By a plan that is wrong


@pytest.mark.parametrize(
    ("world", "plan", "target"),
    [
        # Walls on the plan that are not there: across the way, with no door
        # or one that is far; and right before the target.
        ([], wall_with_doors(), (5, 0)),
        ([], wall_with_doors((2.5, 3.4)), (5, 0)),
        ([], wall_with_doors(), (2.6, 0)),
        # A block about the target.
        ([], [rectangle(4, -1, 6, 1)], (5, 0)),
        # A door that is shut, where there is another one.
        (
            wall_with_doors((-3.2, -2.3)),
            wall_with_doors((-3.2, -2.3), (0.2, 1.1)),
            (5, 0),
        ),
        # A door that is not on the plan, which shows none, or another one.
        (wall_with_doors((0.2, 1.1)), wall_with_doors(), (5, 0)),
        (wall_with_doors((-3.2, -2.3)), wall_with_doors((2.3, 3.2)), (5, 0)),
        # A plan that is 10 cm off.
        (U, [outline + np.array([0.1, 0.1]) for outline in U], (4, 0)),
    ],
    ids=[
        "no wall",
        "no wall beside a door",
        "no wall before the target",
        "no block about the target",
        "shut door",
        "unknown door",
        "door elsewhere",
        "shifted",
    ],
)
def test_a_plan_that_is_wrong_is_overcome(world, plan, target):
    world = [*HOUSE, *world]
    drive = Rolling(planner([*HOUSE, *plan]), world, (-0.5, 0.0, 0.0), target)
    assert drive.run(40)
    assert drive.distance < 0.3
    assert drive.touches == 0


@pytest.mark.parametrize("size", [0.3, 0.7, 1.2, 3.0])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.25, -0.25)])
def test_a_robot_that_stands_where_the_plan_shows_a_thing_drives_out(
    size, place
):
    block = rectangle(-size / 2, -size / 2, size / 2, size / 2)
    x, y = size * np.array(place)
    drive = Rolling(planner([*HOUSE, block]), HOUSE, (x, y, 0.3), (5, 0.5))
    assert drive.run(10)
    assert drive.distance < 0.3


def test_a_robot_off_the_plan_drives_without_it():
    world = room(-12, -4, 6, 4)
    drive = Rolling(planner(HOUSE), world, (-10.0, 0.0, 0.0), (5, 0))
    assert drive.run(30)
    assert drive.distance < 0.3


def test_the_only_door_shut_is_given_up_with_the_place_of_the_door():
    door = rectangle(2.0, 0.2, 2.2, 1.1)
    walls = [*HOUSE, *wall_with_doors((0.2, 1.1))]
    drive = Rolling(planner(walls), [*walls, door], (0, 0, 0), (5, 0))
    assert not drive.run(120)
    x, y = drive.state.shut
    # On the near face of the wall, where the target's direction meets it.
    assert x == pytest.approx(2.0, abs=0.1)
    assert -0.5 < y < 0.7
    drive.step()
    assert drive.velocities[-1] == (0.0, 0.0)
    assert not drive.state.arrived


def test_what_only_the_plan_shows_is_kept_clear_of():
    # A table top above the lidar's plane, across the straight way.
    table = [rectangle(1.5, -1.0, 3.0, 1.0)]
    blind, knowing = (
        Rolling(planner(plan), HOUSE, (0, 0, 0), (5, 0), unseen=table)
        for plan in (None, [*HOUSE, *table])
    )
    assert knowing.run(20)
    assert knowing.touches == 0
    # Without the plan it runs into the table.
    blind.run(20)
    assert blind.touches > 0


# At a target in or beside a thing


@pytest.mark.parametrize("knows", [False, True], ids=["seen", "planned"])
@pytest.mark.parametrize("target", [(1.9, 0.0), (2.2, 0.1), (2.5, 0.4)])
def test_at_a_thing_that_the_target_is_in_it_has_arrived_where_it_ends(
    target, knows
):
    box = rectangle(2.0, -0.5, 3.0, 0.5)
    world = [*HOUSE, box]
    drive = Rolling(
        planner(world if knows else None), world, (-1, 0, 0), target
    )
    assert drive.run(15)
    assert drive.touches == 0
    assert drive.distance < 0.9


def walled_room():
    """A plan whose outermost cells are walls, from -3 to 6 and -4 to 4 m."""
    occupied = np.zeros((161, 181), dtype=bool)
    occupied[[0, -1]] = occupied[:, [0, -1]] = True
    return OccupancyGrid(np.array([-3.0, -4.0]), 0.05, occupied)


@pytest.mark.parametrize("target", [(math.inf, 0), (0, -math.inf), (1e9, 0)])
def test_a_target_that_makes_no_sense_is_not_arrived_at(target):
    law = MapPlanner(
        SHIPPED.map,
        SHIPPED.controller,
        LIDAR,
        SPEED_LIMIT,
        0.3,
        known=KnownFloor(walled_room()),
    )
    # Beside the wall at x = 6, where the way to a target at the wall ends.
    drive = Rolling(law, HOUSE, (3, 0, 0), (5.9, 0.0))
    assert drive.run(10)
    ranges = drive.scan()
    state = law.update(drive.state, drive.pose, np.array(target), ranges)
    assert not state.arrived
