"""A grid of free squares over the free space: section 4.3.3.

The squares lie in columns, which are strips as wide as a square. Three things
place them: the orientation of the columns, the offset of the first column
from the left side of the map, and for each column a height that all its
squares share. A square that overlaps an obstacle by any amount is not free.

Frame G is W turned by the orientation: columns run along its y axis.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array, rotation
from drake_mobarm.placement.free_space import FreeSpace

# Overlaps below this are rounding errors: the two only touch [m].
_TOUCH = 1e-9
# Stands in for a divisor of zero.
_TINY = 1e-200
# Free areas of more squares than this are refused.
_MOST_SQUARES = 1e6
_CORNERS = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


@dataclass(frozen=True, eq=False)
class FreeGrid:
    """Squares of one size that lie wholly in the free space.

    Attributes:
        size: edge length of a square [m].
        orientation: of the columns [rad], counter-clockwise from y of W.
        offset: of the first column from the left side of the map, in sizes
            of a square.
        centres: of the squares in W [m], (n, 2), column by column, upwards.
        columns: index of the column that each square is in, (n,), from 0.
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
        """Corners of the squares in W [m], (n, 4, 2), counter-clockwise."""
        square = self.size * _CORNERS @ rotation(self.orientation).T
        corners: Array = self.centres[:, None] + square
        return corners


def plain_grid(free: FreeSpace, size: float) -> FreeGrid:
    """A lattice along the axes of W, the baseline of the optimised grid.

    It begins at the left and the lower side of the map, which is the bounding
    box of the free space.

    Args:
        free: where the base's origin can be.
        size: edge length of a square [m].

    Raises:
        ParameterError: the size is not positive.
    """
    _require_size(free, size)
    stretches = _find_stretches(free.sides(), size, 0.0, 0.0)
    heights = np.full(len(stretches.low), free.polygon.bounds[1])
    return _fill(free, size, 0.0, 0.0, stretches, heights)


def grid_at(
    free: FreeSpace, size: float, orientation: float, offset: float
) -> FreeGrid:
    """The grid with the most squares for one orientation and offset.

    Args:
        free: where the base's origin can be.
        size: edge length of a square [m].
        orientation: of the columns [rad], 0 to pi/2.
        offset: of the first column, in sizes of a square, 0 to 1.

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
    stretches = _find_stretches(free.sides(), size, orientation, offset)
    heights, _ = _best_heights(stretches, size)
    return _fill(free, size, orientation, offset, stretches, heights)


def optimise_grid(
    free: FreeSpace,
    size: float,
    seed: int = 0,
    population: int = 20,
    generations: int = 40,
) -> FreeGrid:
    """The grid that covers the most of the free space: section 4.3.3.

    Differential evolution searches orientation and offset; the best heights
    for these are worked out exactly. Orientation and offset of the plain grid
    are in the first generation, so that the result is never worse than it.

    Args:
        free: where the base's origin can be.
        size: edge length of a square [m].
        seed: of the search.
        population: members of a generation per parameter, which are two.
        generations: largest number of generations after the first.

    Raises:
        ParameterError: a value is out of its range.
    """
    _require_size(free, size)
    require(population >= 3, "population", population, "at least 3")
    require(generations >= 0, "generations", generations, "at least 0")
    sides = free.sides()

    def negative_count(x: Array) -> float:
        stretches = _find_stretches(sides, size, x[0], x[1])
        return -float(_best_heights(stretches, size)[1])

    # Counts are whole numbers: they have no gradient to polish with, and a
    # generation has converged only once its counts are equal (tol = 0).
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
    # Rounding may leave a parameter just beyond its bounds.
    orientation, offset = np.clip(best.x, 0.0, (math.pi / 2, 1.0))
    return grid_at(free, size, float(orientation), float(offset))


@dataclass(frozen=True, eq=False)
class _Stretches:
    """Stretches of columns that are free and at least a square high.

    They are in the order of their columns, and upwards within a column.

    Attributes:
        left: x of the left side of column 0 in G [m].
        column: index of the column of each, (n,).
        low: y of the lower end in G [m], (n,).
        high: y of the upper end in G [m], (n,).
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


def _find_stretches(
    sides: tuple[Array, Array], size: float, orientation: float, offset: float
) -> _Stretches:
    """The stretches over which columns are free over their whole width.

    A column is blocked over each range of y in which a side of the free space
    is within the strip. What is between two such ranges is free or not as a
    whole: it is free where the sides below it cross the middle line of the
    strip an odd number of times.
    """
    # Elementwise: a matrix product may round the end of one side and the start
    # of the next, which are one corner, in two ways; crossings would be lost.
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
    # column 0 is in no column; one that ends right of the map is never free.
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
    # Closed lines cross a middle line an even number of times, so that one
    # sum over all columns is even where each column begins.
    odd = np.cumsum(crosses[order]) % 2 == 1
    # The highest so far in each column, as one running maximum: columns are
    # shifted so far apart that none reaches into the next.
    if len(low):
        stack = column * (high.max() - low.min() + 1)
        high = np.maximum.accumulate(high + stack) - stack
    fits = (
        odd[:-1]
        & (column[1:] == column[:-1])
        & (low[1:] - high[:-1] >= size - _TOUCH)
    )
    return _Stretches(left, column[:-1][fits], high[:-1][fits], low[1:][fits])


def _squares(
    stretches: _Stretches, size: float, height: Array, index: NDArray[np.int_]
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Which squares of a column of some height are within a stretch.

    Args:
        stretches: all stretches.
        size: edge length of a square [m].
        height: y of the lower side of square 0 of the column in G [m], (m,).
        index: which of the stretches, (m,).

    Returns:
        Number of the lowest square within the stretch, which may be negative,
        and how many squares are within it, (m,) each.
    """
    first = np.ceil((stretches.low[index] - height - _TOUCH) / size)
    beyond = np.floor((stretches.high[index] - height + _TOUCH) / size)
    count = np.maximum(beyond - first, 0)
    return first.astype(int), count.astype(int)


def _best_heights(stretches: _Stretches, size: float) -> tuple[Array, int]:
    """The heights of columns with the most squares.

    Moving the squares of a column down until one of them touches the lower
    end of its stretch loses none: a best height is the lower end of a stretch.

    Returns:
        For each stretch the height of its column in G [m], (n,), and the
        number of squares in all columns.
    """
    total = len(stretches.column)
    if not total:
        return np.empty(0), 0
    begins = np.flatnonzero(np.diff(stretches.column, prepend=-1))
    lengths = np.diff(begins, append=total)
    # The lower end of each stretch is tried on all stretches of its column.
    trial, nth = _spread(np.repeat(lengths, lengths))
    tried_on = np.repeat(begins, lengths)[trial] + nth
    _, count = _squares(stretches, size, stretches.low[trial], tried_on)
    counts = np.bincount(trial, count, total)
    # In each column the stretch of the greatest count, of equals the lowest.
    ranked = np.lexsort((np.arange(total), -counts, stretches.column))[begins]
    return np.repeat(stretches.low[ranked], lengths), int(counts[ranked].sum())


def _fill(
    free: FreeSpace,
    size: float,
    orientation: float,
    offset: float,
    stretches: _Stretches,
    heights: Array,
) -> FreeGrid:
    """The grid, given for each stretch the height of its column in G [m]."""
    first, count = _squares(
        stretches, size, heights, np.arange(len(stretches.low))
    )
    index, nth = _spread(count)
    columns = stretches.column[index]
    x = stretches.left + (columns + 0.5) * size
    y = heights[index] + (first[index] + nth + 0.5) * size
    centres = np.column_stack([x, y]) @ rotation(orientation).T
    return FreeGrid(size, orientation, offset, centres, columns, free.area)


def _spread(
    counts: NDArray[np.int_],
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Each index repeated as often as its count, and the repetition, from 0."""
    owner = np.repeat(np.arange(len(counts)), counts)
    nth = np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]
    return owner, nth
