"""The floor where a round robot can be, as one polygon: section 4.3.3.

All obstacles are grown by the radius of the robot, which is then a point.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.polygon import orient

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array
from drake_mobarm.world.obstacles import signed_distance
from drake_mobarm.world.world import World

# How far the map reaches beyond all that is in it [m].
_MARGIN = 1.0
# Sides of the polygon that stands for the robot's disc.
_DISC_SIDES = 32
# Corners of the polygon are rounded to this [m]: without it, shapely's union of
# polygons whose sides nearly coincide may lose one of them without an error.
_RASTER = 1e-9


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """Where the origin of the base can be without the robot touching anything.

    It is connected: all of it can be reached from any place in it.

    Attributes:
        polygon: the free space in W [m], with holes where obstacles are.
        radius: of the robot [m].
        obstacles: the name of each obstacle, and its convex outline grown by
            the radius, counter-clockwise in W [m], (k_i, 2).
    """

    polygon: shapely.Polygon
    radius: float = 0.0
    obstacles: tuple[tuple[str, Array], ...] = ()

    def __post_init__(self) -> None:
        """Lets shapely index the polygon, for speed alone."""
        shapely.prepare(self.polygon)

    @classmethod
    def from_outlines(
        cls,
        outlines: Sequence[Array],
        radius: float,
        start: ArrayLike,
        bounds: ArrayLike | None = None,
        names: Sequence[str] = (),
    ) -> "FreeSpace":
        """The part of the floor around `start` that a disc can reach.

        Args:
            outlines: convex outlines of obstacles in W [m], (k_i, 2) each.
            radius: of the robot [m]; no point nearer to an outline is free,
                but for rounding by 2e-9 m.
            start: a free place p_WB [m], (2,).
            bounds: low and high corner of where the origin of the base can be
                [m], (2, 2); by default a metre around outlines and start.
            names: of the outlines; by default their numbers.

        Raises:
            ParameterError: `start` is not free, or another value makes no
                sense.
        """
        place = np.asarray(start, dtype=float)
        require(
            place.shape == (2,) and bool(np.isfinite(place).all()),
            "start",
            start,
            "two finite numbers [m]",
        )
        require(0 <= radius < np.inf, "radius", radius, "at least 0 [m]")
        if bounds is None:
            corners = np.vstack([place, *outlines])
            low, high = corners.min(axis=0), corners.max(axis=0)
            limits = np.array([low - _MARGIN, high + _MARGIN])
        else:
            limits = np.asarray(bounds, dtype=float)
            require(
                limits.shape == (2, 2)
                and bool(np.isfinite(limits).all())
                and bool((limits[0] < limits[1]).all()),
                "bounds",
                bounds,
                "a low corner and a higher one [m]",
            )
        grown = [_grown(o, radius) for o in outlines]
        blocked = shapely.union_all(grown, grid_size=_RASTER)
        floor = shapely.difference(
            shapely.box(*limits.ravel()), blocked, grid_size=_RASTER
        )
        parts = [
            part
            for part in shapely.get_parts(floor)
            if shapely.contains_xy(part, *place)
        ]
        require(
            len(parts) == 1,
            "start",
            place.tolist(),
            f"a place within the bounds, {radius:g} m clear of obstacles",
        )
        named = names or [f"obstacle {i}" for i in range(len(outlines))]
        shapes = [
            shapely.get_coordinates(orient(shape).exterior)[:-1]
            for shape in grown
        ]
        return cls(parts[0], radius, tuple(zip(named, shapes, strict=True)))

    @classmethod
    def of_world(
        cls,
        world: World,
        start: ArrayLike,
        radius: float,
        heights: tuple[float, float],
        goal: ArrayLike | None = None,
    ) -> "FreeSpace":
        """The free space of a world, up to a metre beyond all that is in it.

        Args:
            world: the building.
            start: a free place p_WB [m], (2,).
            radius: of the robot [m].
            heights: of the lowest and the highest part of the robot [m]; it
                passes over what is below and under what is above.
            goal: p_WB of another place that has to be within the bounds [m],
                (2,).

        Raises:
            ParameterError: `start` is not free.
        """
        found = [(o.name, o.outline(*heights)) for o in world.obstacles]
        met = [(name, shape) for name, shape in found if shape is not None]
        shapes = [shape for _, shape in met]
        corners = np.vstack([start, start if goal is None else goal, *shapes])
        bounds = [corners.min(axis=0) - _MARGIN, corners.max(axis=0) + _MARGIN]
        return cls.from_outlines(
            shapes,
            radius,
            start,
            bounds,
            names=[name for name, _ in met],
        )

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return float(self.polygon.area)

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points are in free space, (...); its edge is not.

        Args:
            points: in W [m], (..., 2).
        """
        places = np.asarray(points, dtype=float)
        return np.asarray(
            shapely.contains_xy(self.polygon, places[..., 0], places[..., 1])
        )

    def distance(self, points: ArrayLike) -> Array:
        """Distance of points in W, (..., 2), to the free space [m], (...)."""
        places = shapely.points(np.asarray(points, dtype=float))
        return np.asarray(shapely.distance(self.polygon, places))

    def obstacles_near(
        self, place: Array, distance: float
    ) -> list[tuple[str, Array]]:
        """The obstacles whose grown outline is near a place.

        Args:
            place: p_WB [m], (2,).
            distance: how near [m].
        """
        return [
            (name, shape)
            for name, shape in self.obstacles
            if np.all(shape.min(axis=0) - distance < place)
            and np.all(shape.max(axis=0) + distance > place)
            and signed_distance(shape, place)[0] < distance
        ]

    def sides(self) -> tuple[Array, Array]:
        """Starts and ends of the polygon's sides, its holes included.

        Returns:
            Both in W [m], (n, 2) each.
        """
        rings = [
            shapely.get_coordinates(ring)
            for ring in (self.polygon.exterior, *self.polygon.interiors)
        ]
        return (
            np.vstack([ring[:-1] for ring in rings]),
            np.vstack([ring[1:] for ring in rings]),
        )


def _grown(shape: Array, radius: float) -> shapely.Geometry:
    """A convex outline grown by a radius [m].

    This is the Minkowski sum with a polygon around the disc, so that nothing
    within the radius is left out; corners of that polygon are 0.5 % further
    out. The buffer of shapely would have corners on the arc, and leave out
    what is beside them. Sides along the axes, as most walls have, move by the
    radius exactly.
    """
    turn = 2 * np.pi * (np.arange(_DISC_SIDES) + 0.5) / _DISC_SIDES
    reach = radius / np.cos(np.pi / _DISC_SIDES)
    disc = reach * np.column_stack([np.cos(turn), np.sin(turn)])
    sums = (np.asarray(shape)[:, None] + disc).reshape(-1, 2)
    return shapely.convex_hull(shapely.multipoints(sums))
