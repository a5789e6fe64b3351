"""Free corridors and gaps for a round robot among points.

A corridor is what a disc sweeps as it goes straight; a gap is an opening
beside a thing. All points and directions are relative to the robot's centre,
in any fixed axes.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_mobarm.geometry import Array

# A point nearer than the radius blocks only motion towards it, or a robot
# that stands a centimetre too near could not leave.
_SHRINK = 0.98


@dataclass(frozen=True, eq=False)
class Gaps:
    """Gaps beside the edges of things.

    Attributes:
        angles: directions that just pass the edges [rad], (n,).
        lengths: how far to go until past the edges [m], (n,).
        sides: where the things are, (n,): +1 to the right of the way, -1 to
            the left.
    """

    angles: Array
    lengths: Array
    sides: Array

    def points(self) -> Array:
        """The places just past the edges [m], (n, 2)."""
        return self.lengths[:, None] * unit(self.angles)


def unit(angles: Array | float) -> Array:
    """Unit vectors, (..., 2), along angles (...) [rad]."""
    if isinstance(angles, float):  # Five times faster than an array of one.
        return np.array([math.cos(angles), math.sin(angles)])
    vectors = np.empty((*angles.shape, 2))
    vectors[..., 0], vectors[..., 1] = np.cos(angles), np.sin(angles)
    return vectors


def free_length(angle: float, points: Array, radius: float) -> float:
    """How far a disc can go along an angle [rad] before it meets a point.

    Args:
        angle: direction [rad].
        points: obstacle points [m], (n, 2).
        radius: the disc's [m].

    Returns:
        The free length [m], infinite where nothing is met.
    """
    return float(_lengths(angle, points, radius)[0].min(initial=np.inf))


def blocking_point(angle: float, points: Array, radius: float) -> Array | None:
    """The point that a disc meets first.

    Args:
        angle: direction [rad].
        points: obstacle points [m], (n, 2).
        radius: the disc's [m].

    Returns:
        The point [m], (2,), or None where nothing is met.
    """
    lengths, met = _lengths(angle, points, radius)
    if not lengths.size:
        return None
    found: Array = met[np.argmin(lengths)]
    return found


def free_around(
    start: float, count: int, points: Array, radius: float, horizon: float
) -> Array:
    """`free_length` along equally spaced directions of a full turn.

    Only the directions that a point blocks are looked at for it.

    Args:
        start: first direction [rad].
        count: number of directions, counter-clockwise.
        points: obstacle points [m], (n, 2).
        radius: the disc's [m].
        horizon: the longest answer [m].

    Returns:
        Free lengths [m], (count,).
    """
    step = 2 * np.pi / count
    distance = np.hypot(points[:, 0], points[:, 1])
    reach = _reach(distance, radius)
    bearing = np.arctan2(points[:, 1], points[:, 0]) - start
    half = np.arcsin(reach / np.maximum(distance, 1e-9))
    first = np.ceil((bearing - half) / step).astype(int)
    blocked = np.floor((bearing + half) / step).astype(int) - first + 1
    # One entry a point and direction: each point, its directions in order.
    point = np.arange(len(points)).repeat(blocked)
    direction = (
        np.arange(len(point)) + (first + blocked - blocked.cumsum())[point]
    )
    # In single precision, far below the noise: several times faster.
    angle = (direction * step - bearing[point]).astype(np.float32)
    away = distance.astype(np.float32)[point]
    across = away * np.sin(angle)
    depth = (reach**2).astype(np.float32)[point] - across**2
    length = away * np.cos(angle) - np.sqrt(np.maximum(depth, 0))
    free = np.full(count, horizon)
    np.minimum.at(free, direction % count, length.astype(float))
    return free


def free_along(
    starts: Array, end: Array, points: Array, radius: float
) -> Array:
    """How far a disc can go from each start to one end.

    Args:
        starts: [m], (k, 2).
        end: [m], (2,).
        points: obstacle points [m], (n, 2).
        radius: the disc's [m].

    Returns:
        Distances [m], (k,) to the first point met; infinite for none.
    """
    way = end - starts
    length = np.hypot(way[:, 0], way[:, 1])
    along_unit = way / np.maximum(length, 1e-9)[:, None]
    normal = along_unit @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    offset = (starts * along_unit).sum(axis=1)[:, None]
    along = along_unit @ points.T - offset
    across = normal @ points.T - (starts * normal).sum(axis=1)[:, None]
    beyond = along - np.minimum(np.maximum(along, 0.0), length[:, None])
    met = across**2 + beyond**2 < radius**2
    first: Array = np.where(met, along, np.inf).min(axis=1, initial=np.inf)
    return first


def clearance_ahead(ends: Array, points: Array) -> Array:
    """The distance of straight ways from the robot to the points ahead.

    Args:
        ends: of the ways [m], (k, 2).
        points: obstacle points [m], (n, 2). One that lies behind the start of
            a way does not count: the robot leaves it.

    Returns:
        Distances [m], (k,), infinite where nothing is ahead.
    """
    if not points.size:
        return np.full(len(ends), np.inf)
    distance = np.maximum(np.hypot(ends[:, 0], ends[:, 1]), 1e-9)
    along_unit = ends / distance[:, None]
    along = along_unit @ points.T
    across = along_unit @ np.array([[0.0, 1.0], [-1.0, 0.0]]) @ points.T
    beyond = np.maximum(along - distance[:, None], 0.0)
    nearest: Array = np.where(along > 0, np.hypot(across, beyond), np.inf).min(
        axis=1
    )
    return nearest


def find_gaps(angles: Array, free: Array, jump: float, past: float) -> Gaps:
    """Finds where the free length jumps from one direction to the next.

    Args:
        angles: equally spaced directions of a full turn [rad], (m,).
        free: free lengths along them [m], (m,).
        jump: the least jump [m].
        past: how far beyond the edge a gap's place lies [m].

    Returns:
        The gaps: those with the thing to the right first.
    """
    after = np.concatenate([free[1:], free[:1]])
    following = np.concatenate([angles[1:], angles[:1]])
    left = after - free > jump  # Free to the left of a thing.
    right = free - after > jump
    near = np.concatenate([free[left], after[right]])
    far = np.concatenate([after[left], free[right]])
    sides = np.ones(near.size)
    sides[np.count_nonzero(left) :] = -1.0
    directions = np.concatenate([following[left], angles[right]])
    return Gaps(directions, np.minimum(near + past, far), sides)


def _reach(distance: Array, radius: float) -> Array:
    reach: Array = np.minimum(radius, _SHRINK * distance)
    return reach


def _lengths(angle: float, points: Array, radius: float) -> tuple[Array, Array]:
    """Free lengths (k,) up to the points (k, 2) in the disc's way."""
    cos, sin = math.cos(angle), math.sin(angle)
    along = points @ np.array([cos, sin])
    across = points @ np.array([-sin, cos])
    near = (along > 0) & (np.abs(across) < radius)
    points, along, across = points[near], along[near], across[near]
    reach = _reach(np.hypot(points[:, 0], points[:, 1]), radius)
    depth = reach**2 - across**2
    met = depth > 0
    return along[met] - np.sqrt(depth[met]), points[met]
