"""Places of a scenario, and whether they make sense in a world."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely

from drake_mobarm.exceptions import ScenarioError
from drake_mobarm.geometry import Array
from drake_mobarm.robot.shape import HEIGHTS, RADIUS
from drake_mobarm.world.obstacles import clearance, outlines
from drake_mobarm.world.world import FARTHEST, World

# The least area that walls close off, for there to be an inside [m^2].
_ROOM_AREA = 4.0
# A gap between walls that is no way out [m].
_GAP = 0.05


@dataclass(frozen=True)
class Place:
    """A place of a scenario.

    Attributes:
        name: of the scenario's field.
        value: of that field; it begins with x and y in W [m].
        robot: whether the robot has to stand there; otherwise it is a point.
        solid: whether that point may be inside an obstacle.
    """

    name: str
    value: Sequence[float]
    robot: bool = False
    solid: bool = False


def check_places(world: World, places: Sequence[Place]) -> None:
    """Refuses places where a run could not make sense.

    Raises:
        ScenarioError: the robot would start inside an obstacle, or a place
            is inside an obstacle, outside the walls or too far away.
    """
    for place in places:
        if not np.abs(place.value[:2]).max() <= FARTHEST:
            raise ScenarioError(
                f"{place.name} {list(place.value)} is further than "
                f"{FARTHEST / 1000:g} km from the origin"
            )
    footprint = _footprint(world)
    walled = floor_within_walls(world)
    for place in places:
        if place.solid:
            continue
        room = float(clearance(footprint, np.array(place.value[:2])))
        if room <= (RADIUS if place.robot else 0.0):
            needed = (
                f": {room:.3f} m are free around it, the robot needs more than "
                f"{RADIUS} m"
            )
            raise ScenarioError(
                f"{place.name} {list(place.value)} is inside an obstacle of "
                f"{world.name}" + (needed if place.robot else "")
            )
    for place in places:
        if not shapely.intersects_xy(walled, *place.value[:2]):
            raise ScenarioError(
                f"{place.name} {list(place.value[:2])} is outside the walls "
                f"of {world.name}"
            )


@lru_cache(maxsize=16)
def floor_within_walls(
    world: World, heights: tuple[float, float] = HEIGHTS
) -> shapely.Geometry:
    """The floor within a world's walls, with what stands on it.

    Walls are whatever closes off a room's worth of floor from outside; where
    there are none, all of the floor is within.

    Args:
        world: the building.
        heights: between which something has to stand to be a wall [m].

    Returns:
        An area of W [m].
    """
    grown = [
        shapely.buffer(shapely.polygons(o), _GAP / 2, join_style="mitre")
        for o in outlines(world.obstacles, *heights)
    ]
    standing = shapely.get_parts(shapely.union_all(grown))
    closed_off = sum(
        shapely.area(shapely.polygons(ring))
        for part in standing
        for ring in part.interiors
    )
    if closed_off <= _ROOM_AREA:
        far = 2 * FARTHEST
        return shapely.box(-far, -far, far, far)
    filled = [shapely.polygons(part.exterior) for part in standing]
    return shapely.union_all(filled)


@lru_cache(maxsize=16)
def _footprint(world: World) -> list[Array]:
    return outlines(world.obstacles, *HEIGHTS)
