"""Which places on a grid of squares see each other in a straight line.

The test is exact, not sampled: a line of sight is a segment that touches no
occupied square, its sides and corners included. So no line slips through the
corner between two diagonal obstacle squares, and two neighbouring free squares
see each other along a diagonal only where both squares beside it are free.
What lies outside the grid counts as occupied.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_mobarm.geometry import Array
from drake_mobarm.world.occupancy import OccupancyGrid

# A segment nearer to a square than this touches it [squares]. Segments between
# centres are either exactly touching or far more distant than this.
_TOUCH = 1e-9
# So many squares' columns are looked at in one go.
_BATCH = 2**17
# So many pairs of points are held in memory at once.
_MOST_PAIRS = 10**6


class LineOfSight:
    """Tests of lines of sight on one grid.

    Args:
        grid: its squares are occupied already where the robot's centre must
            not be.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self._origin = np.asarray(grid.origin, dtype=float)
        self._cell = grid.cell
        # A ring of occupied squares stands for all that lies outside.
        occupied = np.pad(grid.occupied, 1, constant_values=True)
        # Number of occupied squares before each one in its column; in its row.
        self._in_columns = _counts(occupied.T)
        self._in_rows = _counts(occupied)

    def clear(self, starts: ArrayLike, ends: ArrayLike) -> NDArray[np.bool_]:
        """Whether each segment touches no occupied square.

        Args:
            starts: in W [m], (..., 2).
            ends: in W [m], broadcast against `starts`.

        Returns:
            One truth value a segment, (...).
        """
        squares = (self._squares(starts), self._squares(ends))
        start, end = np.broadcast_arrays(*squares)
        shape = start.shape[:-1]
        start, end = start.reshape(-1, 2), end.reshape(-1, 2)
        clear = np.empty(len(start), dtype=bool)
        extent = np.abs(end - start)
        # The fewer lines of squares a segment crosses, the less to look at.
        by_columns = extent[:, 0] <= extent[:, 1]
        for chosen, counts, axes in (
            (by_columns, self._in_columns, slice(None)),
            (~by_columns, self._in_rows, slice(None, None, -1)),
        ):
            clear[chosen] = _clear(
                counts, start[chosen][:, axes], end[chosen][:, axes]
            )
        return clear.reshape(shape)

    def links(
        self, points: ArrayLike, others: ArrayLike | None = None
    ) -> NDArray[np.int_]:
        """The pairs of points that see each other.

        Args:
            points: in W [m], (n, 2).
            others: in W [m], (m, 2): then pairs of a point and another one
                are tested, not those within `points`.

        Returns:
            Indices, (k, 2), in rising order; i < j where there are no others.
        """
        first = np.asarray(points, dtype=float).reshape(-1, 2)
        second = first
        if others is not None:
            second = np.asarray(others, dtype=float).reshape(-1, 2)
        rows = max(1, _MOST_PAIRS // max(1, len(second)))
        found = []
        for low in range(0, len(first), rows):
            i, j = np.meshgrid(
                np.arange(low, min(low + rows, len(first))),
                np.arange(len(second)),
                indexing="ij",
            )
            wanted = i < j if others is None else np.full(i.shape, True)
            i, j = i[wanted], j[wanted]
            clear = self.clear(first[i], second[j])
            found.append(np.column_stack([i[clear], j[clear]]))
        return np.vstack(found) if found else np.zeros((0, 2), dtype=int)

    def _squares(self, points: ArrayLike) -> Array:
        """Coordinates in squares, where square [r, c] has its centre (c, r)."""
        points = np.asarray(points, dtype=float)
        squares: Array = (points - self._origin) / self._cell + 1
        return squares


def _counts(occupied: NDArray[np.bool_]) -> NDArray[np.int_]:
    """(lines, squares + 1): occupied ones before each square of a line."""
    return np.cumsum(np.pad(occupied, ((0, 0), (1, 0))), axis=1, dtype=int)


def _clear(
    counts: NDArray[np.int_], start: Array, end: Array
) -> NDArray[np.bool_]:
    """Whether segments are clear, line by line of the squares they cross.

    Args:
        counts: as of `_counts`, of lines along the second coordinate.
        start: in squares, (n, 2).
        end: in squares, (n, 2), nowhere steeper than 45 degrees to the lines.
    """
    lines, size = counts.shape[0], counts.shape[1] - 1
    backwards = (end[:, 0] < start[:, 0])[:, None]
    start, end = np.where(backwards, (end, start), (start, end))
    low, high = np.minimum(start, end), np.maximum(start, end)
    # The ring is occupied: what leaves it, or is not finite, is not clear.
    inside = (low > 0) & (high < (lines - 1, size - 1))
    clear: NDArray[np.bool_] = np.all(inside, axis=1)
    left = np.flatnonzero(clear)
    first = np.ceil(start[left, 0] - 0.5 - _TOUCH).astype(int)
    last = np.floor(end[left, 0] + 0.5 + _TOUCH).astype(int)
    most = int((last - first).max(initial=-1)) + 1
    # Lines far apart come first: most that are blocked are found at once.
    order = np.argsort(np.arange(most) * 0.618 % 1)
    while order.size and left.size:
        batch = max(1, _BATCH // left.size)
        line = np.minimum(first[:, None] + order[:batch], last[:, None])
        order = order[batch:]
        hit = _touches(counts, line, start[left, None], end[left, None])
        blocked = hit.any(axis=1)
        clear[left[blocked]] = False
        left, first, last = (x[~blocked] for x in (left, first, last))
    return clear


def _touches(
    counts: NDArray[np.int_],
    line: NDArray[np.int_],
    start: Array,
    end: Array,
) -> NDArray[np.bool_]:
    """Whether segments touch an occupied square of some lines, (n, lines).

    Args:
        counts: as of `_counts`.
        line: lines that each segment crosses, (n, lines).
        start: in squares, (n, 1, 2), on the side of the lower lines.
        end: in squares, (n, 1, 2).
    """
    begin, width = start[..., 0], end[..., 0] - start[..., 0]
    # Where along the segment, 0 to 1, it enters and leaves the line; one that
    # runs along the line is in it from end to end.
    crossing = width > _TOUCH
    width = np.maximum(width, _TOUCH)
    enter = np.where(crossing, (line - 0.5 - begin) / width, 0)
    leave = np.where(crossing, (line + 0.5 - begin) / width, 1)
    rise = end[..., 1] - start[..., 1]
    sides = [start[..., 1] + rise * np.clip(x, 0, 1) for x in (enter, leave)]
    lowest = np.ceil(np.minimum(*sides) - 0.5 - _TOUCH).astype(int)
    highest = np.floor(np.maximum(*sides) + 0.5 + _TOUCH).astype(int)
    touches: NDArray[np.bool_] = (
        counts[line, highest + 1] > counts[line, lowest]
    )
    return touches
