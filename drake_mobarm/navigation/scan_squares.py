"""What a lidar's scan shows as squares that repel, and what it lets be seen.

Section 3.3.4: readings are clustered into obstacles, and a point is in sight
where the reading in its direction is longer than the way to it.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from drake_mobarm.driving.scan import fill_missing
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.sensors.lidar import ray_angles

SQUARE = 0.1
"""Edge length of the squares that a scan's points are gathered in [m]."""

# More than there are cells along an axis.
_COLUMNS = 2**31
# A range this near to the lidar's longest [m] is "no return".
_NO_RETURN = 0.05


@dataclass(frozen=True, eq=False)
class ScanSquares:
    """The squares that a scan's points lie in.

    Attributes:
        centres: the mean of each square's points, p_BS_W from the robot in
            W's axes [m], (n, 2).
        ranges: of the scan, missing ones filled in [m], (rays,).
        yaw: of the robot in W [rad].
    """

    centres: Array
    ranges: Array
    yaw: float

    @classmethod
    def from_ranges(
        cls,
        yaw: float,
        ranges: Array,
        range_max: float,
        known: Array | None = None,
        known_size: float = 0.0,
    ) -> Self:
        """The squares of a scan.

        Args:
            yaw: of the robot in W [rad].
            ranges: [m], (rays,), in the order of `ray_angles`; NaN where
                missing, `range_max` where nothing is met.
            range_max: the longest range of the lidar [m].
            known: p_BP_W of points that count as seen where they are nearer
                than what is [m], (n, 2).
            known_size: edge length of the cells that these are the centres
                of [m]: each is met by all rays that pass it as near as its
                corners are.
        """
        distances = fill_missing(ranges)
        if known is not None and len(known):
            distances = distances.copy()
            number, rays = _met_by(known, known_size, yaw, ranges.size)
            apart = np.hypot(known[:, 0], known[:, 1])
            np.minimum.at(distances, rays, apart[number])
        met = distances < range_max - _NO_RETURN
        angles = yaw + ray_angles(ranges.size)[met]
        points = distances[met, None] * np.column_stack(
            [np.cos(angles), np.sin(angles)]
        )
        cells = np.floor(points / SQUARE).astype(int)
        # One number a cell, which is sorted sooner than two.
        numbers = cells[:, 0] * _COLUMNS + cells[:, 1]
        _, square = np.unique(numbers, return_inverse=True)
        count = np.bincount(square)
        sums = [np.bincount(square, weights=points[:, k]) for k in (0, 1)]
        centres = np.column_stack(sums) / np.maximum(count, 1)[:, None]
        return cls(centres, distances, yaw)

    def readings(self, ways: Array) -> Array:
        """The reading in the direction of each way p_BQ_W, (m, 2) [m], (m,)."""
        bearing = np.arctan2(ways[:, 1], ways[:, 0]) - self.yaw
        found: Array = self.ranges[_rays(bearing, self.ranges.size)]
        return found

    def sees(self, ways: Array) -> NDArray[np.bool_]:
        """Which places are in sight (section 3.3.4), (m,).

        Args:
            ways: p_BQ_W, from the robot to the places [m], (m, 2).
        """
        distance = np.hypot(ways[:, 0], ways[:, 1])
        seen: NDArray[np.bool_] = self.readings(ways) > distance
        return seen


def cluster(squares: Array, gap: float = 2 * RADIUS) -> NDArray[np.int_]:
    """Numbers the obstacles that squares belong to, (n,).

    Args:
        squares: centres [m], (n, 2).
        gap: squares nearer to each other than this are of one obstacle [m]:
            the robot cannot pass between them.
    """
    count = len(squares)
    if count == 0:
        return np.zeros(0, dtype=int)
    pairs = KDTree(squares).query_pairs(gap, output_type="ndarray")
    links = coo_array(
        (np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count)
    )
    _, numbers = connected_components(links, directed=False)
    return np.asarray(numbers, dtype=int)


def _met_by(
    cells: Array, size: float, yaw: float, rays: int
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Which cells p_BP_W (n, 2) are met by which rays: pairs of numbers.

    The nearest ray always meets a cell.
    """
    step = 2 * np.pi / rays
    distance = np.hypot(cells[:, 0], cells[:, 1])
    half = size / np.sqrt(2) / np.maximum(distance, 1e-9)
    reach = np.arcsin(np.minimum(half, 1.0)) / step
    bearing = np.arctan2(cells[:, 1], cells[:, 0]) - yaw
    middle = (wrap_angle(bearing) + np.pi) / step
    nearest = np.rint(middle).astype(int)
    first = np.minimum(np.ceil(middle - reach).astype(int), nearest)
    last = np.maximum(np.floor(middle + reach).astype(int), nearest)
    count = last - first + 1
    number = np.arange(len(cells)).repeat(count)
    place = np.arange(len(number)) - (count.cumsum() - count)[number]
    return number, (first[number] + place) % rays


def _rays(bearings: Array, rays: int) -> NDArray[np.int_]:
    """The numbers (n,) of the rays nearest to bearings from B [rad], (n,)."""
    step = 2 * np.pi / rays
    numbers: NDArray[np.int_] = (
        np.rint((wrap_angle(bearings) + np.pi) / step).astype(int) % rays
    )
    return numbers
