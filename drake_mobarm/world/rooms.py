"""Where starts and targets of experiments are drawn from: rooms, free floor."""

from functools import lru_cache

import numpy as np

from drake_mobarm.geometry import Array
from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.world.obstacles import outlines
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.world import World

STAND_RADIUS = 0.28
"""Start and target are where a disc of this radius can stand [m]."""

ROOMS: dict[str, tuple[float, float, float, float]] = {
    "bedroom": (-9.30, -2.50, -5.50, 3.10),
    "living_room": (-2.50, 4.84, -5.50, 1.20),
    "fitness_room": (-2.50, 4.84, 1.20, 5.50),
    "kitchen": (4.84, 9.30, -5.50, 3.10),
}
"""Rooms of the small house: x_min, x_max, y_min, y_max [m]."""


@lru_cache(maxsize=4)
def reachable_floor(world: World) -> Array:
    """Cell centres in W [m], (n, 2), of a world's largest connected floor.

    It is indoors: the street beyond an open door is not of it.
    """
    grid = OccupancyGrid.from_outlines(outlines(world.obstacles, *HEIGHTS))
    regions = grid.regions(STAND_RADIUS)
    indoors = np.bincount(regions.ravel())
    indoors[:2] = 0
    floor: Array = grid.centres()[regions == np.argmax(indoors)]
    return floor


def within_room(floor: Array, room: str) -> Array:
    """The places of a floor (n, 2) [m] that are in a room of `ROOMS`."""
    x_min, x_max, y_min, y_max = ROOMS[room]
    x, y = floor.T
    inside = (x >= x_min) & (x < x_max) & (y >= y_min) & (y < y_max)
    found: Array = floor[inside]
    return found
