"""Where the points of a highway stand: the first step of section 3.3.2.1.

Two ways: a number of points at random, kept apart by a distance that shrinks
where there is no room; and points whose number and spacing follow the density
of obstacles, (3.3) to (3.5).
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.geometry import Array
from drake_mobarm.world.occupancy import OccupancyGrid

# Points for a unit of summed density: the factor of (3.4).
_POINTS = 0.75
# Squares of spacing where the density is the share n / n_f: that of (3.5).
_SPACING = 6.0
# What the spacing shrinks to whenever there is no room for another point.
_SHRINK = 0.9


def choose_random_points(
    grid: OccupancyGrid,
    count: int,
    min_distance: float,
    rng: np.random.Generator,
) -> Array:
    """Centres of free squares at random, kept apart from each other.

    The minimum distance shrinks by 10 % whenever no square is left that keeps
    it, so that the wanted number is always reached.

    Args:
        grid: its squares are occupied already where the robot's centre must
            not be.
        count: number of points.
        min_distance: between two points to begin with [m].
        rng: source of the choice.

    Returns:
        Points in W [m], (count, 2), in the order of their choice.

    Raises:
        ParameterError: there are fewer free squares than points.
    """
    squares = free_centres(grid)
    if count > len(squares):
        raise ParameterError(
            f"count is {count}: valid is at most the number of free squares, "
            f"{len(squares)}"
        )
    spacing = np.full(len(squares), float(min_distance))
    return _spread(squares, np.ones(len(squares)), spacing, count, rng)


def choose_adaptive_points(
    grid: OccupancyGrid, blur: float, rng: np.random.Generator
) -> Array:
    """Centres of free squares, denser where obstacles are: (3.3) to (3.5).

    Squares are drawn with their density as probability. Each keeps the
    distance (3.5) from those already chosen. That asks for more room than
    there is in many plans; so it shrinks by 10 %, as the minimum distance of
    random points does, whenever no square is left that keeps it.

    Args:
        grid: its squares are occupied already where the robot's centre must
            not be.
        blur: standard deviation of the density's Gaussian blur [squares].
        rng: source of the choice.

    Returns:
        Points in W [m], (n, 2), in the order of their choice; n of (3.4), at
        least 1 and at most the number of free squares.
    """
    squares = free_centres(grid)
    if not len(squares):
        return squares
    density = obstacle_density(grid, blur)[~grid.occupied]
    count = int(np.clip(round(_POINTS * density.sum()), 1, len(squares)))
    spacing = _SPACING * grid.cell * count / (len(squares) * density)
    return _spread(squares, density, spacing, count, rng)


def obstacle_density(grid: OccupancyGrid, blur: float) -> Array:
    """The density of the plan around each square, (3.3), smoothed.

    It is high where free squares have obstacles close by on both sides, and
    higher in the middle between them. What lies outside the grid is no free
    square. The blur takes occupied squares as of density 0.

    Args:
        grid: the plan.
        blur: standard deviation of the Gaussian blur [squares]; 0 for none.

    Returns:
        (ny, nx), 0 in occupied squares.
    """
    free = ~grid.occupied
    left, right = _free_before(free), _free_before(free[:, ::-1])[:, ::-1]
    down, up = _free_before(free.T).T, _free_before(free.T[:, ::-1])[:, ::-1].T
    across, along = left + right + 1, up + down + 1
    density = (1 - np.abs(left - right) / across) / across
    density = density + (1 - np.abs(up - down) / along) / along
    density[grid.occupied] = 0
    if blur > 0:
        density = ndimage.gaussian_filter(density, blur, mode="constant")
        density[grid.occupied] = 0
    smoothed: Array = density
    return smoothed


def free_centres(grid: OccupancyGrid) -> Array:
    """Centres of the free squares in W [m], (n, 2), row by row."""
    return grid.centres()[~grid.occupied]


def _free_before(free: NDArray[np.bool_]) -> NDArray[np.int_]:
    """Number of consecutive free squares to the left of each square."""
    column = np.arange(free.shape[1])
    last = np.maximum.accumulate(np.where(free, -1, column), axis=1)
    before: NDArray[np.int_] = np.maximum(column - last - 1, 0)
    return before


def _spread(
    squares: Array,
    weight: Array,
    spacing: Array,
    count: int,
    rng: np.random.Generator,
) -> Array:
    """Draws squares by their weights, each far enough from those before it.

    To leave out squares that are too close beforehand draws the same as to
    draw from all that are left and to reject.
    """
    x, y = squares.T.copy()
    # All distances are squared: roots would take most of the time.
    nearest, least = np.full(len(squares), np.inf), spacing**2
    chosen = np.empty(count, dtype=int)
    for i in range(count):
        room = np.flatnonzero(nearest >= least)
        while not room.size:  # Squares at distance 0 are taken already.
            least = _SHRINK**2 * least
            room = np.flatnonzero(nearest >= least)
        bound = np.cumsum(weight[room])
        drawn = np.searchsorted(bound, rng.uniform(0, bound[-1]), "right")
        chosen[i] = at = room[min(drawn, len(room) - 1)]
        np.minimum(nearest, (x - x[at]) ** 2 + (y - y[at]) ** 2, out=nearest)
    return squares[chosen]
