"""Obstacles as convex bodies, and their outlines on the floor plan."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from drake_mobarm.geometry import Array

_CYLINDER_SIDES = 48
# Rings of a ball's corners from pole to pole, with one about its middle.
_BALL_RINGS = 44
# Between their corners, the rings' sides lie this far within the ball.
_BALL_DEPTH = 0.0037


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A fixed convex body.

    Attributes:
        name: of the body.
        corners: p_WV [m], (n, 3).
        edges: the indices of the corners that each edge joins, (k, 2); a body
            of few corners needs none.
    """

    name: str
    corners: Array
    edges: NDArray[np.int_] | None = None

    def outline(self, z_low: float, z_high: float) -> Array | None:
        """The body's floor plan between two heights, as `outline` has it."""
        return outline(self.corners, z_low, z_high, self.edges)


def box_corners(size: Array) -> Array:
    """Corners [m], (8, 3), of a box of edge lengths `size` about its centre."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    corners: Array = 0.5 * signs * np.asarray(size)
    return corners


def cylinder_corners(radius: float, length: float) -> Array:
    """Corners [m], (96, 3), of the prism inscribed in a cylinder along z.

    Its outline lies within 0.2 % of the radius of the circle's.
    """
    angle = 2 * np.pi * np.arange(_CYLINDER_SIDES) / _CYLINDER_SIDES
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.vstack(
        [
            np.column_stack([ring, np.full(len(ring), half)])
            for half in (-length / 2, length / 2)
        ]
    )


def capsule_corners(radius: float, length: float) -> Array:
    """Corners [m], (2114, 3), of a body like a capsule along z.

    Its outlines at any two heights, and at a single one, lie within 0.2 % of
    the radius of the capsule's.

    Args:
        radius: of the capsule [m].
        length: between the centres of its round ends [m]; 0 for a sphere.
    """
    angle = 2 * np.pi * np.arange(_CYLINDER_SIDES) / _CYLINDER_SIDES
    # Close together at the poles, where the outline grows fastest.
    share = np.arange(1, _BALL_RINGS // 2 + 1) / _BALL_RINGS
    polar = np.pi * np.sin(np.pi / 2 * share) ** 2
    # Half as far outside at the corners as inside between them.
    out = radius * (1 + _BALL_DEPTH / 2) * np.sin(polar)
    x, y = np.multiply.outer([np.cos(angle), np.sin(angle)], out)
    z = length / 2 + radius * np.cos(polar) + 0 * x
    upper = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    upper = np.vstack([upper, [0, 0, length / 2 + radius]])
    corners: Array = np.vstack([upper, upper * (1, 1, -1)])
    return corners


@cache
def capsule_edges() -> NDArray[np.int_]:
    """Edges, (k, 2), of the corners of any capsule, sphere or ellipsoid."""
    return hull_edges(capsule_corners(1.0, 1.0))


def hull_edges(corners: Array) -> NDArray[np.int_]:
    """Indices (k, 2) of the corners [m], (n, 3), that hull's edges join."""
    sides = ConvexHull(corners).simplices
    edges = np.sort(sides[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2))
    return np.unique(edges, axis=0)


def ellipsoid_corners(radii: Array) -> Array:
    """Corners [m], (2114, 3), of a body like an ellipsoid about its centre.

    Its surface lies within 0.2 % of the largest radius of the ellipsoid's.

    Args:
        radii: along x, y and z [m], (3,).
    """
    corners: Array = capsule_corners(1.0, 0.0) * np.asarray(radii)
    return corners


def outline(
    corners: Array,
    z_low: float,
    z_high: float,
    edges: NDArray[np.int_] | None = None,
) -> Array | None:
    """The floor plan of what a convex body has between two heights.

    Args:
        corners: p_WV [m], (n, 3).
        z_low: lower height [m].
        z_high: upper height [m]; equal to `z_low` for a plane's cut.
        edges: indices of the corners that each edge joins, (k, 2), if known.

    Returns:
        The outline's corners in W [m], (k, 2), counter-clockwise, or None
        where the body has no area between the heights.
    """
    z = corners[:, 2]
    points = [corners[(z >= z_low) & (z <= z_high), :2]]
    for height in {z_low, z_high}:
        if edges is None:
            # Every chord that crosses the plane: those inside the body only
            # add points inside the hull.
            below = corners[z < height][:, None]
            above = corners[z > height][None]
        else:
            ends = np.take_along_axis(edges, np.argsort(z[edges]), axis=1)
            low, high = ends.T
            crosses = (z[low] < height) & (z[high] > height)
            below, above = corners[low[crosses]], corners[high[crosses]]
        if below.size and above.size:
            share = (
                (height - below[..., 2]) / (above[..., 2] - below[..., 2])
            )[..., None]
            crossing = below[..., :2] * (1 - share) + above[..., :2] * share
            points.append(crossing.reshape(-1, 2))
    candidates = np.vstack(points)
    if len(candidates) < 3:
        return None
    try:
        hull = ConvexHull(candidates)
    except QhullError:
        return None
    corners_2d: Array = candidates[hull.vertices]
    return corners_2d


def outlines(
    obstacles: tuple[Obstacle, ...], z_low: float, z_high: float
) -> list[Array]:
    """The outlines (k_i, 2) [m] of all obstacles met between two heights."""
    found = (o.outline(z_low, z_high) for o in obstacles)
    return [o for o in found if o is not None]


def outlines_to_segments(outlines: list[Array]) -> tuple[Array, Array]:
    """The sides of outlines as starts and ends in W [m], (n, 2) each."""
    if not outlines:
        return np.empty((0, 2)), np.empty((0, 2))
    starts = np.vstack(outlines)
    ends = np.vstack([np.roll(o, -1, axis=0) for o in outlines])
    return starts, ends


def inside(polygon: Array, points: Array) -> NDArray[np.bool_]:
    """Whether points [m], (..., 2), lie in a convex polygon.

    Args:
        polygon: its corners, counter-clockwise [m], (k, 2).
        points: [m], (..., 2); those on the edge are inside.
    """
    side = np.roll(polygon, -1, axis=0) - polygon
    to_point = points[..., None, :] - polygon
    cross = side[:, 0] * to_point[..., 1] - side[:, 1] * to_point[..., 0]
    return np.asarray(np.all(cross >= 0, axis=-1))


def clearance(outlines: list[Array], points: Array) -> Array:
    """Distance [m] of points (..., 2) to the nearest outline.

    Zero inside an outline, infinite where there is none.
    """
    points = np.asarray(points, dtype=float)
    nearest = np.full(points.shape[:-1], np.inf)
    for polygon in outlines:
        side = np.roll(polygon, -1, axis=0) - polygon
        to_point = points[..., None, :] - polygon
        along = np.clip(
            np.sum(to_point * side, axis=-1) / np.sum(side**2, axis=-1), 0, 1
        )
        to_side = np.linalg.norm(to_point - along[..., None] * side, axis=-1)
        distance = np.where(inside(polygon, points), 0.0, to_side.min(axis=-1))
        nearest = np.minimum(nearest, distance)
    return nearest


def signed_distance(outline: Array, point: Array) -> tuple[Array, Array]:
    """Distance of one point (2,) to a convex outline, and its gradient.

    Args:
        outline: counter-clockwise, in W [m], (k, 2).
        point: in W [m], (2,).

    Returns:
        [m], (1,), negative inside, where it is that to the nearest side; and
        the unit vector (1, 2) along which it grows.
    """
    side = np.roll(outline, -1, axis=0) - outline
    length = np.linalg.norm(side, axis=1)
    normal = np.column_stack([side[:, 1], -side[:, 0]]) / length[:, None]
    to_point = point - outline
    depth = np.sum(to_point * normal, axis=1)
    deepest = int(np.argmax(depth))
    if depth[deepest] <= 0:
        return depth[deepest : deepest + 1], normal[deepest : deepest + 1]
    along = np.clip(np.sum(to_point * side, axis=1) / length**2, 0, 1)
    away = to_point - along[:, None] * side
    distance = np.linalg.norm(away, axis=1)
    nearest = int(np.argmin(distance))
    if distance[nearest] == 0:
        return np.zeros(1), normal[deepest : deepest + 1]
    direction = away[nearest][None] / distance[nearest]
    return distance[nearest : nearest + 1], direction
