"""A planar lidar: rays cast on the world's cut at the sensor's height."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import at_least, not_negative, positive, within
from drake_mobarm.geometry import Array


@dataclass(kw_only=True)
class LidarParameters:
    """A scanner of the RPLIDAR A2M8's class.

    Attributes:
        rays: rays in a full turn.
        rate: scans a second [Hz].
        range_max: longest distance that it reports [m].
        noise: standard deviation of a range [m].
    """

    rays: int = 360
    rate: float = 10.0
    range_max: float = 12.0
    noise: float = 0.01

    def __post_init__(self) -> None:
        at_least(self, 8, "rays")
        within(self, "(0, 100]", "rate")
        positive(self, "range_max")
        not_negative(self, "noise")


def ray_angles(rays: int) -> Array:
    """Directions of the rays in the sensor's frame [rad], (rays,).

    Counter-clockwise from straight behind: the middle ray looks ahead.
    """
    return -np.pi + 2 * np.pi * np.arange(rays) / rays


def cast_rays(starts: Array, ends: Array, pose: ArrayLike, rays: int) -> Array:
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
    x, y, yaw = np.asarray(pose, dtype=float)
    distance = np.full(rays, np.inf)
    a, b = starts - (x, y), ends - (x, y)
    # Twice the area that a side spans with the sensor, negative from outside.
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    seen = cross < 0
    a, b, cross = a[seen], b[seen], cross[seen]
    step = 2 * np.pi / rays
    # Seen from outside, a side runs clockwise: b is its first ray.
    last = (np.arctan2(a[:, 1], a[:, 0]) - yaw + np.pi) / step
    span = np.arctan2(-cross, np.sum(a * b, axis=1)) / step
    # A hair wider: no ray slips between two sides at their corner.
    first = np.ceil(last - span - 1e-9).astype(int)
    count = np.floor(last + 1e-9).astype(int) - first + 1
    side = np.repeat(np.arange(len(a)), count)
    offset = np.arange(len(side)) - np.repeat(np.cumsum(count) - count, count)
    ray = first[side] + offset
    angle = ray * step - np.pi + yaw
    d = (b - a)[side]
    across = np.cos(angle) * d[:, 1] - np.sin(angle) * d[:, 0]
    # A ray along the side itself has across = 0: its neighbours meet it.
    with np.errstate(divide="ignore"):
        reach = np.where(across < 0, cross[side] / across, np.inf)
    np.minimum.at(distance, ray % rays, reach)
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
