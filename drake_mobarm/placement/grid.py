"""Free squares laid in columns over the free space: section 4.3.3.

Columns are strips as wide as a square. Three things place the squares: the
columns' orientation, the offset of the first column from the left side of the
map, and a height for each column, shared by all its squares. A square that
overlaps obstacle space by any amount is not free.

Frame G is W turned by the orientation: columns run along its y.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array, rotation
from drake_mobarm.placement.free_space import FreeSpace

_TOUCH = 1e-9  # [m]: rounding; what overlaps by less only touches.
_TINY = 1e-200
_MOST_SQUARES = 1e6
_CORNERS = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


@dataclass(frozen=True)
class FreeGrid:
    """Squares of one size that lie wholly in the free space.

    Attributes:
        size: edge length of a square [m].
        orientation: of the columns [rad], counter-clockwise from y of W.
        offset: of the first column from the left side of the map, in sizes.
        centres: in W [m], (n, 2), column by column, upwards.
        columns: which column each is in, (n,), the first is 0.
        free_area: area of the free space [m^2].
    """

    size: float
    orientation: float
    offset: float
    centres: Array
    columns: NDArray[np.int_]
    free_area: float

    @property
    def coverage(self) -> float:
        """The share of the free area that the squares cover, 0 to 1."""
        return len(self.centres) * self.size**2 / self.free_area

    def corners(self) -> Array:
        """The squares' corners in W [m], (n, 4, 2), counter-clockwise."""
        square = self.size * _CORNERS @ rotation(self.orientation).T
        corners: Array = self.centres[:, None] + square
        return corners


def plain_grid(free: FreeSpace, size: float) -> FreeGrid:
    """The baseline: a lattice along the axes of W.

    It begins at the left and the lower side of the map, which is the free
    space's bounding box.

    Args:
        free: where the base's origin can be.
        size: edge length of a square [m].

    Raises:
        ParameterError: the size is not positive.
    """
    _require_size(free, size)
    gaps = _find_gaps(free.sides(), size, 0.0, 0.0)
    heights = np.full(len(gaps.low), free.polygon.bounds[1])
    return _fill(free, size, 0.0, 0.0, gaps, heights)


def grid_at(
    free: FreeSpace, size: float, orientation: float, offset: float
) -> FreeGrid:
    """The most squares that columns placed so can hold.

    Args:
        free: where the base's origin can be.
        size: edge length of a square [m].
        orientation: of the columns [rad], 0 to pi/2.
        offset: of the first column [sizes], 0 to 1.

    Raises:
        ParameterError: a value is out of its range.
    """
    _require_size(free, size)
    require(
        0 <= orientation <= math.pi / 2,
        "orientation",
        orientation,
        "0 to pi/2 [rad]",
    )
    require(0 <= offset <= 1, "offset", offset, "0 to 1 [sizes]")
    gaps = _find_gaps(free.sides(), size, orientation, offset)
    heights, _ = _best_heights(gaps, size)
    return _fill(free, size, orientation, offset, gaps, heights)


def optimise_grid(
    free: FreeSpace,
    size: float,
    seed: int = 0,
    population: int = 20,
    generations: int = 40,
) -> FreeGrid:
    """The grid that covers the most of the free space: section 4.3.3.

    Differential evolution over orientation and offset; heights follow from
    these exactly. The plain grid's orientation and offset are among the
    first generation, so that it is never better.

    Args:
        free: where the base's origin can be.
        size: edge length of a square [m].
        seed: of the search.
        population: members a parameter.
        generations: at most so many after the first.

    Raises:
        ParameterError: a value is out of its range.
    """
    _require_size(free, size)
    require(population >= 3, "population", population, "at least 3")
    require(generations >= 0, "generations", generations, "at least 0")
    sides = free.sides()

    def negative_count(x: Array) -> float:
        gaps = _find_gaps(sides, size, x[0], x[1])
        return -float(_best_heights(gaps, size)[1])

    # Counts are whole numbers, and good places differ by few squares: no
    # gradient to polish with, and the spread of a generation says little
    # until it is zero.
    best = differential_evolution(
        negative_count,
        [(0.0, math.pi / 2), (0.0, 1.0)],
        x0=(0.0, 0.0),
        seed=seed,
        popsize=population,
        maxiter=generations,
        tol=0.0,
        polish=False,
    )
    # It scales its members, which may round one past its bounds.
    orientation, offset = np.clip(best.x, 0.0, (math.pi / 2, 1.0))
    return grid_at(free, size, float(orientation), float(offset))


@dataclass(frozen=True)
class _Gaps:
    """Free stretches of columns that hold a square, by column and height.

    Attributes:
        left: of column 0 in G [m].
        column: which column, (n,), rising.
        low: lower end in G [m], (n,).
        high: upper end in G [m], (n,).
    """

    left: float
    column: NDArray[np.int_]
    low: Array
    high: Array


def _require_size(free: FreeSpace, size: float) -> None:
    require(0 < size < math.inf, "size", size, "a length above 0 [m]")
    least = math.sqrt(free.area / _MOST_SQUARES)
    require(
        size >= least,
        "size",
        size,
        f"{least:.2g} m or more for a map with {free.area:.0f} m^2 of floor",
    )


def _find_gaps(
    sides: tuple[Array, Array], size: float, orientation: float, offset: float
) -> _Gaps:
    """Where columns are free over their whole width.

    The ranges of y over which the edge of the free space is within a column's
    strip block it; what is between them is wholly free or wholly not, which
    the parity of the edge's crossings of the strip's middle line below tells.
    """
    # Elementwise: a matrix product may round a corner that ends one side and
    # starts the next in two ways, and the parity would break.
    c, s = math.cos(orientation), math.sin(orientation)
    start, end = (
        np.column_stack([c * x + s * y, c * y - s * x])
        for x, y in (points.T for points in sides)
    )
    leftward = start[:, 0] > end[:, 0]
    start, end = (
        np.where(leftward[:, None], end, start),
        np.where(leftward[:, None], start, end),
    )
    left = start[:, 0].min() + offset * size

    # All pairs of a side and a column that it may be in. What lies left of
    # column 0 is in no column; one that reaches past the right has no gap.
    first = np.floor((start[:, 0] - left) / size - 0.5).astype(int)
    last = np.floor((end[:, 0] - left) / size + 0.5).astype(int)
    first = np.maximum(first, 0)
    side, nth = _spread(np.maximum(last - first + 1, 0))
    column = first[side] + nth
    strip = left + column * size
    # A side on the strip's border only touches it.
    x_low, x_high = strip + _TOUCH, strip + size - _TOUCH
    (xa, ya), (xb, yb) = start[side].T, end[side].T
    within = (xa < x_high) & (xb > x_low)
    column, strip, x_low, x_high, xa, ya, xb, yb = (
        values[within]
        for values in (column, strip, x_low, x_high, xa, ya, xb, yb)
    )
    run = np.maximum(xb - xa, _TINY)
    y_in = ya + (yb - ya) * np.clip((x_low - xa) / run, 0, 1)
    y_out = ya + (yb - ya) * np.clip((x_high - xa) / run, 0, 1)
    middle = strip + size / 2
    crosses = (xa <= middle) & (xb > middle)

    low, high = np.minimum(y_in, y_out), np.maximum(y_in, y_out)
    order = np.lexsort((low, column))
    column, low, high = column[order], low[order], high[order]
    # Closed lines cross a middle an even number of times, so that the sum
    # begins each column even.
    odd = np.cumsum(crosses[order]) % 2 == 1
    # The highest so far in the column: one running maximum over columns
    # stacked so far apart that none reaches into the next.
    if len(low):
        stack = column * (high.max() - low.min() + 1)
        high = np.maximum.accumulate(high + stack) - stack
    free = (
        odd[:-1]
        & (column[1:] == column[:-1])
        & (low[1:] - high[:-1] >= size - _TOUCH)
    )
    return _Gaps(left, column[:-1][free], high[:-1][free], low[1:][free])


def _squares(
    gaps: _Gaps, size: float, height: Array, gap: NDArray[np.int_]
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """What of a stack of squares fits in a gap.

    Args:
        gaps: the gaps.
        size: edge length of a square [m].
        height: of the lower side of the stack's square 0 in G [m], (m,).
        gap: which gap, (m,).

    Returns:
        Number of the lowest square within the gap, and how many are, (m,)
        each.
    """
    first = np.ceil((gaps.low[gap] - height - _TOUCH) / size)
    beyond = np.floor((gaps.high[gap] - height + _TOUCH) / size)
    count = np.maximum(beyond - first, 0)
    return first.astype(int), count.astype(int)


def _best_heights(gaps: _Gaps, size: float) -> tuple[Array, int]:
    """Heights of columns that hold the most squares.

    Moving a column's squares down until one of them touches the lower end of
    its gap loses none; so the best height is the lower end of some gap.

    Returns:
        For each gap its column's height in G [m], (n,), and the number of
        squares in all.
    """
    total = len(gaps.column)
    if not total:
        return np.empty(0), 0
    begins = np.flatnonzero(np.diff(gaps.column, prepend=-1))
    lengths = np.diff(begins, append=total)
    # Each gap's lower end is tried on each gap of the same column.
    trial, nth = _spread(np.repeat(lengths, lengths))
    tried_on = np.repeat(begins, lengths)[trial] + nth
    _, count = _squares(gaps, size, gaps.low[trial], tried_on)
    counts = np.bincount(trial, count, total)
    # Within each column the greatest count, and of equals the lowest.
    ranked = np.lexsort((np.arange(total), -counts, gaps.column))[begins]
    return np.repeat(gaps.low[ranked], lengths), int(counts[ranked].sum())


def _fill(
    free: FreeSpace,
    size: float,
    orientation: float,
    offset: float,
    gaps: _Gaps,
    heights: Array,
) -> FreeGrid:
    """The squares of columns whose height in G [m] is told for each gap."""
    first, count = _squares(gaps, size, heights, np.arange(len(gaps.low)))
    gap, nth = _spread(count)
    columns = gaps.column[gap]
    x = gaps.left + (columns + 0.5) * size
    y = heights[gap] + (first[gap] + nth + 0.5) * size
    centres = np.column_stack([x, y]) @ rotation(orientation).T
    return FreeGrid(size, orientation, offset, centres, columns, free.area)


def _spread(
    counts: NDArray[np.int_],
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Each index as often as its count says, and which time it is."""
    owner = np.repeat(np.arange(len(counts)), counts)
    nth = np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]
    return owner, nth
