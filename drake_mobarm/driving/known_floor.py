"""The floor that a plan of the building shows, for finding ways quickly.

What the plan shows is worked out once; what the lidar sees besides is added
for each way.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from scipy.spatial import KDTree

from drake_mobarm.driving.route import (
    SPACING,
    Floor,
    Links,
    Route,
    RouteParameters,
    cheapest_way,
    lattice_links,
)
from drake_mobarm.driving.scan import lengths
from drake_mobarm.geometry import Array
from drake_mobarm.world.occupancy import OccupancyGrid

# What is seen within this distance of a thing on the plan [m] is that thing.
_SAME_THING = 0.15
# Seen things are gathered in squares of this size [m].
_GATHERED = 0.05
# More than there are such squares along an axis.
_ROWS = 2.0**24
# A way starts at most this far from the plan's free floor [m].
_START = 0.4
# How far from the robot things on the plan matter for driving [m].
_NEAR = 3.0


class KnownFloor:
    """The free floor of a plan.

    Args:
        grid: the plan, finely resolved and not grown; all but free floor is
            occupied.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid
        self._distance = grid.clearance()
        step = max(round(SPACING / grid.cell), 1)
        clearance = self._distance[::step, ::step]
        places = grid.centres()[::step, ::step]
        is_free = (clearance > 0).ravel()
        links = lattice_links(*clearance.shape)
        number = np.cumsum(is_free) - 1
        kept = is_free[links.rows] & is_free[links.columns]
        rows = number[links.rows[kept]]
        count = int(np.count_nonzero(is_free))
        starts = np.searchsorted(rows, np.arange(count + 1))
        places = places.reshape(-1, 2)[is_free]
        self._shape = clearance.shape
        self._number = np.where(is_free, number, -1).reshape(self._shape)
        self._step = step * grid.cell
        self._tree = KDTree(places) if count else None
        self._floor = Floor(
            places,
            clearance.ravel()[is_free],
            Links(
                row_starts=starts.astype(np.int32),
                rows=rows.astype(np.int32),
                columns=number[links.columns[kept]].astype(np.int32),
                lengths=links.lengths[kept] * (self._step / SPACING),
            ),
            self._nearest,
        )
        beside = binary_dilation(~grid.occupied)
        self._edge: Array = grid.centres()[grid.occupied & beside]
        self._edge_tree = KDTree(self._edge) if len(self._edge) else None

    @property
    def cell(self) -> float:
        """Edge length of the plan's cells [m]."""
        return self._grid.cell

    def near(self, position: Array) -> Array:
        """p_WP of the edges on the plan near a place p_WB [m], (n, 2).

        No edges where the plan shows something in that place: it is wrong.
        """
        row, column = self._grid.index(position)
        if self._edge_tree is None or self._grid.occupied[row, column]:
            return np.empty((0, 2))
        found = self._edge_tree.query_ball_point(position, _NEAR)
        near: Array = self._edge[np.array(found, dtype=int)]
        return near

    def room(self, place: Array) -> float:
        """How far a place p_WQ is from all on the plan [m]; 0 on a thing."""
        row, column = self._grid.index(place)
        return float(self._distance[row, column])

    def unknown(self, points: Array) -> Array:
        """Of points p_WP [m], (n, 2), those that the plan does not show."""
        rows, columns = self._grid.index(points)
        new: Array = points[self._distance[rows, columns] > _SAME_THING]
        return new

    def find_route(
        self,
        points: Array,
        start: Array,
        target: Array,
        tolerance: float,
        parameters: RouteParameters,
        *,
        tried: Array,
        last: Route | None = None,
    ) -> Route | None:
        """The cheapest way over the plan's floor; see `route.find_route`.

        Args:
            points: p_WP of what is in the way besides the plan [m], (n, 2).
            start: p_WS [m], (2,).
            target: p_WT [m], (2,).
            tolerance: how far from the target a way may end [m].
            parameters: what a way costs.
            tried: places near which no way is to end [m], (m, 2).
            last: the way until now, if any.

        Returns:
            The way, or None where the start is not on the plan's floor.
        """
        if self._tree is None or self._tree.query(start)[0] > _START:
            return None
        floor = replace(
            self._floor, clearance=self._clearance(points, parameters)
        )
        return cheapest_way(
            floor, start, target, tolerance, parameters, tried=tried, last=last
        )

    def _nearest(self, places: Array) -> NDArray[np.int_]:
        assert self._tree is not None
        numbers: NDArray[np.int_] = np.asarray(self._tree.query(places)[1])
        return numbers

    def _clearance(self, points: Array, parameters: RouteParameters) -> Array:
        """Clearances of the floor's places with points added [m], (n,)."""
        clearance = self._floor.clearance.copy()
        if not len(points):
            return clearance
        points = _gathered(points)
        reach = int(np.ceil(parameters.comfort_clearance / self._step))
        steps = np.arange(-reach, reach + 1)
        around = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        around = around[np.hypot(*around.T) <= reach]
        middle = np.rint((points - self._grid.origin) / self._step)
        squares = middle[:, None].astype(int) + around
        columns, rows = squares[..., 0], squares[..., 1]
        ny, nx = self._shape
        inside = (columns >= 0) & (columns < nx) & (rows >= 0) & (rows < ny)
        number = np.full(inside.shape, -1)
        number[inside] = self._number[rows[inside], columns[inside]]
        kept = number >= 0
        point, number = kept.nonzero()[0], number[kept]
        apart = lengths(self._floor.places[number] - points[point])
        np.minimum.at(clearance, number, apart)
        return clearance


def _gathered(points: Array) -> Array:
    """One of the points (n, 2) [m] in each square of `_GATHERED`."""
    columns, rows = np.floor(points / _GATHERED).T
    # One number a square is sorted sooner than two.
    _, first = np.unique(_ROWS * columns + rows, return_index=True)
    return points[first]
