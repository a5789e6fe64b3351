"""The starts and targets of Tables 3.2 to 3.4."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from drake_mobarm.geometry import Array
from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.world.obstacles import outlines
from drake_mobarm.world.occupancy import OccupancyGrid

STAND_RADIUS = 0.28
"""Start and target are where a disc of this radius can stand [m]."""

MIN_DISTANCE = 1.5
"""From start to target [m]: nearer would succeed without moving."""

ROOMS: dict[str, tuple[float, float, float, float]] = {
    "bedroom": (-9.30, -2.50, -5.50, 3.10),
    "living_room": (-2.50, 4.84, -5.50, 1.20),
    "fitness_room": (-2.50, 4.84, 1.20, 5.50),
    "kitchen": (4.84, 9.30, -5.50, 3.10),
}
"""Rooms of the small house: x_min, x_max, y_min, y_max [m]."""


class Pair(NamedTuple):
    """Where a trial begins, and where it is to end.

    Attributes:
        start: X_WB, [x, y, yaw] in m and rad.
        target: p_WT [m].
        seed: of the run.
    """

    start: list[float]
    target: list[float]
    seed: int


def make_pair(world: str, seed: int, index: int) -> Pair:
    """A start and a target, uniform over the reachable floor.

    In the small house each pair of rooms comes in turn.

    Args:
        world: name of a shipped world.
        seed: of the table.
        index: of the trial.
    """
    rng = np.random.default_rng([seed, 3, index])
    floor = _reachable_floor(world)
    floors = [floor, floor]
    if world == "small_house":
        rooms = [(a, b) for a in ROOMS for b in ROOMS]
        floors = [
            _within(floor, ROOMS[room]) for room in rooms[index % len(rooms)]
        ]
    while True:
        start, target = (f[rng.integers(len(f))] for f in floors)
        if np.linalg.norm(start - target) >= MIN_DISTANCE:
            break
    yaw = float(rng.uniform(-np.pi, np.pi))
    return Pair(
        [*start.tolist(), yaw], target.tolist(), int(rng.integers(2**31))
    )


def _within(floor: Array, room: tuple[float, float, float, float]) -> Array:
    x, y = floor.T
    x_min, x_max, y_min, y_max = room
    inside = (x >= x_min) & (x < x_max) & (y >= y_min) & (y < y_max)
    within: Array = floor[inside]
    return within


@lru_cache(maxsize=4)
def _reachable_floor(world: str) -> Array:
    """Cell centres [m], (n, 2), of a world's largest connected floor.

    The street outside an open door is not of it.
    """
    # Drake's parser is not for laws.
    from drake_mobarm.world.sdf import load_world

    found = outlines(load_world(world).obstacles, *HEIGHTS)
    grid = OccupancyGrid.from_outlines(found)
    regions = grid.regions(STAND_RADIUS)
    indoors = np.bincount(regions.ravel())
    indoors[:2] = 0
    floor: Array = grid.centres()[regions == np.argmax(indoors)]
    return floor
