"""A planar lidar: rays cast on the world's cut at the sensor's height."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from drake_mobarm.checks import not_negative, positive, whole, within
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array


@frozen
class LidarParameters:
    """A scanner of the RPLIDAR A2M8's class.

    Attributes:
        rays: rays in a full turn, up to 10,000.
        rate: scans a second [Hz], 0.1 to 100.
        range_max: longest distance that it reports [m].
        noise: standard deviation of a range [m].
    """

    rays: int = 360
    rate: float = 10.0
    range_max: float = 12.0
    noise: float = 0.01

    def __post_init__(self) -> None:
        whole(self, 8, 10_000, "rays")
        within(self, "[0.1, 100]", "rate")
        positive(self, "range_max")
        not_negative(self, "noise")


@cache
def ray_angles(rays: int) -> Array:
    """Directions of the rays in the sensor's frame [rad], (rays,), read-only.

    Counter-clockwise from straight behind: the middle ray looks ahead.
    """
    angles: Array = -np.pi + 2 * np.pi * np.arange(rays) / rays
    angles.setflags(write=False)
    return angles


def cast_rays(
    starts: Array, ends: Array, pose: Sequence[float], rays: int
) -> Array:
    """Distance from a point to the nearest side along each ray.

    Only the rays that a side's ends span are intersected with it, so the
    cost follows what is in view, not rays times sides.

    Args:
        starts: first corners of the sides in W [m], (n, 2). Sides of
            outlines run counter-clockwise; their backs are not seen.
        ends: second corners [m], (n, 2).
        pose: X_WL of the sensor, [x, y, yaw] in m and rad, (3,).
        rays: number of rays in a full turn, as `ray_angles` orders them.

    Returns:
        Distances [m], (rays,), infinite where a ray meets nothing.
    """
    x, y, yaw = map(float, pose)
    a_x, a_y = starts[:, 0] - x, starts[:, 1] - y
    b_x, b_y = ends[:, 0] - x, ends[:, 1] - y
    # Twice the area that a side spans with the sensor, negative from outside.
    cross = a_x * b_y - a_y * b_x
    (seen,) = (cross < 0).nonzero()
    a_x, a_y, b_x, b_y, cross = (v[seen] for v in (a_x, a_y, b_x, b_y, cross))
    step = 2 * np.pi / rays
    # Seen from outside, a side runs clockwise: b is its first ray.
    last = (np.arctan2(a_y, a_x) - yaw + np.pi) / step
    span = np.arctan2(-cross, a_x * b_x + a_y * b_y) / step
    # A hair wider: no ray slips between two sides at their corner.
    first = np.ceil(last - span - 1e-9).astype(int)
    count = np.floor(last + 1e-9).astype(int) - first + 1
    # One entry a side and ray: each side, its rays in order.
    side = np.arange(len(seen)).repeat(count)
    ray = np.arange(len(side)) + (first + count - count.cumsum())[side]
    ray %= rays
    angles = ray_angles(rays) + yaw
    across = (
        np.cos(angles)[ray] * (b_y - a_y)[side]
        - np.sin(angles)[ray] * (b_x - a_x)[side]
    )
    # A ray along the side itself has across = 0: its neighbours meet it.
    reach = np.full(len(side), np.inf)
    np.divide(cross[side], across, out=reach, where=across < 0)
    distance = np.full(rays, np.inf)
    np.minimum.at(distance, ray, reach)
    return distance


def read_lidar(
    distance: Array, gaussian: Array, range_max: float, noise: float
) -> Array:
    """Ranges as the sensor reports them.

    Args:
        distance: true distances [m], (rays,).
        gaussian: standard normal noise, (rays,).
        range_max: longest distance that it reports [m]; it stands for "no
            return", too.
        noise: standard deviation of a range [m].

    Returns:
        Ranges [m], (rays,), within [0, range_max].
    """
    ranges: Array = np.clip(distance + noise * gaussian, 0.0, range_max)
    return np.where(distance > range_max, range_max, ranges)
