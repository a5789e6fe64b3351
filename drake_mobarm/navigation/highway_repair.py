"""Adds points to a highway until nothing that could be joined is apart.

The text's highway may fall into pieces, which lost it a trial (section 3.4.2),
and may leave corners of the floor out of every point's sight. Both are cured
over the same squares and by the same rule as the links: neighbouring free
squares see each other, diagonal ones only where both squares beside them are
free. So a way over neighbours is always a way that points can follow.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree
from scipy.spatial import KDTree

from drake_mobarm.geometry import Array
from drake_mobarm.navigation.highway_points import free_centres
from drake_mobarm.navigation.line_of_sight import LineOfSight
from drake_mobarm.world.occupancy import OccupancyGrid

# So many of the nearest points are tried before all of them.
_NEAREST = 8


def cover_floor(
    grid: OccupancyGrid, sight: LineOfSight, points: Array
) -> Array:
    """Points such that each free square sees one, with those given.

    Of the squares that see none, the one with the most room around it becomes
    a point, again and again.

    Args:
        grid: the plan.
        sight: of that plan.
        points: in W [m], (n, 2), n at least 1.

    Returns:
        The points to add in W [m], (m, 2).
    """
    squares = free_centres(grid)
    room = _room(grid)[~grid.occupied]
    _, nearest = KDTree(points).query(squares, min(_NEAREST, len(points)))
    unseen = np.arange(len(squares))
    for column in nearest.reshape(len(squares), -1).T:
        near = points[column[unseen]]
        unseen = unseen[~sight.clear(squares[unseen], near)]
    for point in points:
        unseen = unseen[~sight.clear(squares[unseen], point)]
    added = []
    while unseen.size:
        added.append(squares[unseen[np.argmax(room[unseen])]])
        unseen = unseen[~sight.clear(squares[unseen], added[-1])]
    return np.array(added).reshape(-1, 2)


def join_pieces(
    grid: OccupancyGrid,
    sight: LineOfSight,
    points: Array,
    piece_of: NDArray[np.int_],
) -> Array:
    """Points that join all pieces of a highway between which there is a way.

    The ways lead from piece to piece over the free squares, short, but away
    from obstacles where there is room; of all ways, those are taken that join
    all pieces at the least cost. Points stand along them, each in sight of the
    next.

    Args:
        grid: the plan.
        sight: of that plan.
        points: centres of free squares in W [m], (n, 2).
        piece_of: number of the piece that each is in, (n,), from 0.

    Returns:
        The points to add in W [m], (m, 2).
    """
    squares = free_centres(grid)
    number = np.full(grid.occupied.shape, -1)
    number[~grid.occupied] = np.arange(len(squares))
    steps = _steps(grid, number)
    sources = number[grid.index(points)]
    distance, before, source = dijkstra(
        steps, indices=sources, min_only=True, return_predecessors=True
    )
    reached = np.isfinite(distance)
    # The piece nearest to each square: neighbours of two pieces' squares are
    # where a way between these leads over.
    piece = np.full(len(squares), -1)
    piece[sources] = piece_of
    piece[reached] = piece[source[reached]]
    i, j = steps.coords
    border = (piece[i] < piece[j]) & (piece[i] >= 0)
    i, j, step = i[border], j[border], steps.data[border]
    total = distance[i] + step + distance[j]
    order = np.argsort(total, kind="stable")
    i, j, total = i[order], j[order], total[order]
    pairs, best = np.unique(
        np.stack([piece[i], piece[j]]), axis=1, return_index=True
    )
    count = int(piece_of.max(initial=-1)) + 1
    tree = minimum_spanning_tree(
        coo_array((total[best], tuple(pairs)), shape=(count, count))
    ).tocoo()
    over = {tuple(pair): k for pair, k in zip(pairs.T, best, strict=True)}
    added = []
    for pair in zip(*tree.coords, strict=True):
        k = over[pair]
        way = _trace(before, i[k])[::-1] + _trace(before, j[k])
        added += _seen_in_turn(sight, squares[way])
    return np.array(added).reshape(-1, 2)


def _room(grid: OccupancyGrid) -> Array:
    """Distance of each square from the nearest that is not free [squares]."""
    room: Array = ndimage.distance_transform_edt(np.pad(~grid.occupied, 1))
    return room[1:-1, 1:-1]


def _steps(grid: OccupancyGrid, number: NDArray[np.int_]) -> coo_array:
    """Costs of the steps between neighbouring free squares, both directions.

    A step costs its length [squares] in the open, and up to four times as
    much where it is close to obstacles.
    """
    free, room = ~grid.occupied, _room(grid)
    ny, nx = free.shape
    both = []
    for rows, columns in ((0, 1), (1, 0), (1, 1), (1, -1)):
        right, left = max(0, columns), max(0, -columns)
        low = np.s_[: ny - rows, left : nx - right]
        high = np.s_[rows:, right : nx - left]
        open_ = free[low] & free[high]
        if rows and columns:
            open_ &= free[low[0], high[1]] & free[high[0], low[1]]
        i, j = number[low][open_], number[high][open_]
        near = np.minimum(room[low], room[high])[open_]
        both.append((i, j, np.hypot(rows, columns) * (1 + 3 / near)))
    i, j, cost = (np.concatenate(parts) for parts in zip(*both, strict=True))
    count = int(free.sum())
    return coo_array(
        (np.tile(cost, 2), (np.r_[i, j], np.r_[j, i])), shape=(count, count)
    )


def _trace(before: NDArray[np.int_], square: int) -> list[int]:
    """Squares from one back to the point that it is nearest to."""
    way = [int(square)]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    return way


def _seen_in_turn(sight: LineOfSight, way: Array) -> list[Array]:
    """A few places of a way, without its ends, each seen from the last."""
    chosen, at = [], 0
    while not sight.clear(way[at], way[-1]):
        # Neighbours see each other: the next square is seen at least.
        seen = sight.clear(way[at], way[at + 1 :])
        at += int(np.flatnonzero(seen)[-1]) + 1
        chosen.append(way[at])
    return chosen
