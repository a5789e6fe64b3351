"""A map of what a robot's lidar has seen, from where odometry says it was."""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_mobarm.driving.gaps import unit
from drake_mobarm.geometry import Array
from drake_mobarm.immutable import Immutable
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.sensors.lidar import ray_angles

CELL = 0.05
"""Edge length of a cell of the map [m]."""

# A hit adds more than one look through a cell takes away: of a thin thing
# some scans meet only what is behind it.
_HIT = 3
_MOST_HITS = 12
# A ray that goes on at least this far behind a cell [m] looks through it.
_BEHIND = 0.15
# A range this near to the lidar's longest [m] is "no return".
_NO_RETURN = 0.05
# What is seen this far inside the robot [m] is no thing.
_INSIDE = 0.05
# Nothing is mapped that is seen farther off than this [m].
_FARTHEST = 50.0
# The map grows by so many cells at a time, up to so many: 250 m. Beyond them
# the robot's pose has jumped, or its way is so long that a new map will do.
_GROWTH = 100
_LARGEST = 5000


@dataclass(frozen=True, eq=False)
class SeenMap(Immutable):
    """What was seen and what was touched, in odometry's frame W.

    Cells where nothing was seen count as free: a way leads through what is
    not known until it is seen to be shut.

    Attributes:
        first: column and row of cell [0, 0] of `hits`, counted from the cell
            at W's origin, (2,).
        hits: how surely something stands in each cell [-], (ny, nx), rows
            along y; 0 for nothing.
        touched: p_WP of unseen things that were touched [m], (n, 2).
    """

    first: NDArray[np.int_] = field(
        default_factory=lambda: np.zeros(2, dtype=int)
    )
    hits: NDArray[np.int8] = field(
        default_factory=lambda: np.zeros((0, 0), dtype=np.int8)
    )
    touched: Array = field(default_factory=lambda: np.empty((0, 2)))

    def with_scan(
        self, position: Array, yaw: float, ranges: Array, range_max: float
    ) -> Self:
        """The map with a scan taken in.

        What the scan meets is added. What it looks through is taken away
        little by little, where its rays lie closer than a cell is wide.

        Args:
            position: p_WB of the robot's centre [m], (2,).
            yaw: of the robot in W [rad].
            ranges: [m], (rays,), in the order of `ray_angles`; NaN where
                missing.
            range_max: the longest range of the lidar [m], which it reports
                where nothing is met.

        Returns:
            The map with the scan: of the scan alone, and of what was touched,
            where the map would become larger than memory allows.
        """
        farthest = min(range_max - _NO_RETURN, _FARTHEST)
        met = (ranges < farthest) & (ranges > RADIUS - _INSIDE)
        angles = yaw + ray_angles(ranges.size)[met]
        cells = _cells(position + ranges[met, None] * unit(angles))
        robot = _cells(position)
        grown = self._grown(np.vstack([cells, robot]))
        hits = grown.hits.copy()
        columns, rows = (cells - grown.first).T
        before = hits[rows, columns]
        look_through(hits, robot - grown.first, yaw, ranges)
        hits[rows, columns] = np.minimum(before + _HIT, _MOST_HITS)
        return replace(grown, hits=hits)

    def with_touch(self, points: Array) -> Self:
        """The map with points that were touched, p_WP [m], (n, 2)."""
        return replace(self, touched=np.vstack([self.touched, points]))

    def points(self) -> Array:
        """p_WP of all that is known to be in the way [m], (n, 2)."""
        rows, columns = _nonzero(self.hits)
        seen = (np.column_stack([columns, rows]) + self.first) * CELL
        return np.vstack([seen, self.touched])

    def _grown(self, cells: NDArray[np.int_]) -> Self:
        """The map made large enough for cells, (n, 2)."""
        low, high = cells.min(axis=0), cells.max(axis=0) + 1
        ny, nx = self.hits.shape
        if not self.hits.size:
            first, end = low - _GROWTH, high + _GROWTH
        else:
            end = self.first + np.array([nx, ny])
            if np.all(low >= self.first) and np.all(high <= end):
                return self
            first = np.where(low < self.first, low - _GROWTH, self.first)
            end = np.where(high > end, high + _GROWTH, end)
        if np.any(end - first > _LARGEST):
            return type(self)(touched=self.touched)._grown(cells)
        hits = np.zeros((end - first)[::-1], dtype=np.int8)
        column, row = self.first - first
        hits[row : row + ny, column : column + nx] = self.hits
        return replace(self, first=first, hits=hits)


def look_through(
    hits: NDArray[np.int8],
    robot: NDArray[np.int_],
    yaw: float,
    ranges: Array,
) -> None:
    """Takes one hit from each cell that a scan looks through, in place.

    Args:
        hits: of a map, (ny, nx).
        robot: column and row of the robot's cell in it, (2,).
        yaw: of the robot in W [rad].
        ranges: [m], (rays,), in the order of `ray_angles`; NaN where missing.
    """
    step = 2 * np.pi / ranges.size
    reach = int(1 / step)  # Farther off, a thing may stand between two rays.
    low = np.maximum(robot - reach, 0)
    near = hits[low[1] : robot[1] + reach + 1, low[0] : robot[0] + reach + 1]
    rows, columns = _nonzero(near)
    dx, dy = columns + low[0] - robot[0], rows + low[1] - robot[1]
    beyond = CELL * np.hypot(dx, dy) + _BEHIND
    ray = np.rint((np.arctan2(dy, dx) - yaw + np.pi) / step).astype(int)
    through = np.ones(ray.size, dtype=bool)
    for beside in (-1, 0, 1):
        # A missing range, NaN, looks through nothing.
        through &= ranges[(ray + beside) % ranges.size] > beyond
    near[rows[through], columns[through]] -= 1


def _nonzero(
    hits: NDArray[np.int8],
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Rows and columns, as np.nonzero gives them, in a tenth of its time."""
    rows, columns = np.divmod(np.flatnonzero(hits > 0), max(hits.shape[1], 1))
    return rows, columns


def _cells(places: Array) -> NDArray[np.int_]:
    """Columns and rows of places p_WP [m], (..., 2), from W's origin."""
    return np.rint(places / CELL).astype(int)
