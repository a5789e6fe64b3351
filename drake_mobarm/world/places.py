"""Places of a scenario, and whether they make sense in a world."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from drake_mobarm.exceptions import ScenarioError
from drake_mobarm.geometry import Array
from drake_mobarm.robot.shape import HEIGHTS, RADIUS
from drake_mobarm.world.obstacles import clearance, outlines
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.world import World

# The least area that walls close off, for there to be an inside [m^2].
_ROOM_AREA = 4.0


@dataclass(frozen=True)
class Place:
    """A place of a scenario.

    Attributes:
        name: of the scenario's field.
        value: of that field; it begins with x and y in W [m].
        robot: whether the robot has to stand there; otherwise it is a point.
    """

    name: str
    value: Sequence[float]
    robot: bool = False


def check_places(world: World, places: Sequence[Place]) -> None:
    """Refuses places where a run could not make sense.

    Raises:
        ScenarioError: the robot would start inside an obstacle, or a place
            is inside an obstacle or outside the walls.
    """
    footprint, walls = _floor(world)
    for place in places:
        room = float(clearance(footprint, np.array(place.value[:2])))
        if room <= (RADIUS if place.robot else 0.0):
            needed = (
                f": {room:.2f} m are free around it, the robot needs {RADIUS} m"
            )
            raise ScenarioError(
                f"{place.name} {list(place.value)} is inside an obstacle of "
                f"{world.name}" + (needed if place.robot else "")
            )
    if walls is None:
        return
    grid, regions = walls
    for place in places:
        if regions[grid.index(np.array(place.value[:2]))] == 1:
            raise ScenarioError(
                f"{place.name} {list(place.value[:2])} is outside the walls "
                f"of {world.name}"
            )


@lru_cache(maxsize=16)
def _floor(
    world: World,
) -> tuple[list[Array], tuple[OccupancyGrid, NDArray[np.int_]] | None]:
    """A world's outlines, and its regions where walls close some off.

    Walls are whatever closes off a room's worth of floor from outside.
    """
    footprint = outlines(world.obstacles, *HEIGHTS)
    grid = OccupancyGrid.from_outlines(footprint)
    regions = grid.regions(0.0)
    closed_off = np.sum(regions >= 2) * grid.cell**2
    return footprint, (grid, regions) if closed_off > _ROOM_AREA else None
