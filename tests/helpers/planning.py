"""Our planner, and a house for it, for tests."""

import numpy as np

from drake_mobarm import load_scenario
from drake_mobarm.driving.known_floor import KnownFloor
from drake_mobarm.navigation.map_planner import MapPlanner
from drake_mobarm.world.occupancy import OccupancyGrid
from helpers.rolling import LIDAR, SPEED_LIMIT, room
from helpers.shapes import rectangle

SHIPPED = load_scenario("navigation")
FREE = np.full(LIDAR.rays, LIDAR.range_max)
HOUSE = room(-3, -4, 6, 4)


def planner(plan=None, *, may_reverse=True, lidar=LIDAR):
    """Our planner with the plan of these outlines, or without one."""
    known = None
    if plan is not None:
        known = KnownFloor(OccupancyGrid.from_outlines(list(plan)))
    return MapPlanner(
        SHIPPED.map,
        SHIPPED.controller,
        lidar,
        SPEED_LIMIT,
        0.3,
        may_reverse,
        known,
    )


def wall_with_doors(*doors):
    """A wall at x = 2 across the house, with doors (low, high)."""
    ends = [-4.0, *(y for door in doors for y in door), 4.0]
    return [
        rectangle(2.0, low, 2.2, high)
        for low, high in zip(ends[::2], ends[1::2], strict=True)
    ]


U = [
    rectangle(2.0, -1.5, 2.2, 1.5),
    rectangle(0.0, 1.3, 2.0, 1.5),
    rectangle(0.0, -1.5, 2.0, -1.3),
]
