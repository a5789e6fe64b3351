"""The floor plan that a robot is given: a map in cells, as ROS has them.

Frame P is the plan's: its origin at the lower left corner of the image, x to
the right, y up. `origin` is its pose in W.
"""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage
from scipy.spatial import KDTree

from drake_mobarm.checks import finite_numbers, require
from drake_mobarm.exceptions import WorldError
from drake_mobarm.geometry import Array, rotation
from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.world.obstacles import outlines
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.places import floor_within_walls
from drake_mobarm.world.world import World

_MARGIN = 1.0  # Round what a plan has to cover [m].
_MOST_SQUARES = 50_000_000


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """Cells of the floor that are occupied, free or unknown.

    Attributes:
        occupied: (rows, columns); row 0 is the image's top.
        unknown: (rows, columns); no cell is both.
        resolution: edge length of a cell [m].
        origin: X_WP as (x, y, yaw) [m, m, rad].
    """

    occupied: NDArray[np.bool_]
    unknown: NDArray[np.bool_]
    resolution: float
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Checks the fields.

        Raises:
            ParameterError: a field is out of its range.
        """
        _check_size(self.resolution, "resolution")
        finite_numbers(self, "[x, y, yaw] in m and rad", "origin")
        shape = np.shape(self.occupied)
        require(
            len(shape) == 2 and min(shape) > 0,
            "shape of occupied",
            shape,
            "(rows, columns), each 1 or more",
        )
        require(
            np.shape(self.unknown) == shape,
            "shape of unknown",
            np.shape(self.unknown),
            f"that of occupied, {shape}",
        )
        both = int(np.sum(self.occupied & self.unknown))
        require(both == 0, "cells both occupied and unknown", both, "0")

    @classmethod
    def from_world(
        cls,
        world: World,
        resolution: float = 0.05,
        heights: tuple[float, float] = HEIGHTS,
        cover: ArrayLike = (),
    ) -> "FloorPlan":
        """The true plan of a world.

        Outside the walls, where there are walls, all is unknown, as it is to
        a robot that has been driven about inside to make a map.

        Args:
            world: the building.
            resolution: edge length of a cell [m].
            heights: between which something has to stand to be on it [m].
            cover: points in W that the plan has to reach beyond [m], (n, 2),
                such as a start and a target in the open.

        Raises:
            ParameterError: the resolution is out of its range.
            WorldError: the cells are too many.
        """
        _check_size(resolution, "resolution")
        found = outlines(world.obstacles, *heights)
        grid = OccupancyGrid.from_outlines(found, resolution)
        grid = _grown(grid, np.reshape(cover, (-1, 2)))
        walled = floor_within_walls(world, heights)
        shapely.prepare(walled)
        centres = grid.centres()
        inside = shapely.intersects_xy(walled, centres[..., 0], centres[..., 1])
        # As good, and short in a file.
        x, y = np.round(grid.origin - resolution / 2, 9)
        return cls(
            np.flipud(grid.occupied),
            np.flipud(~grid.occupied & ~inside),
            resolution,
            (float(x), float(y), 0.0),
        )

    @property
    def free(self) -> NDArray[np.bool_]:
        """Cells that are neither occupied nor unknown, (rows, columns)."""
        return ~(self.occupied | self.unknown)

    def corners(self) -> Array:
        """Corners of the plan in W [m], (4, 2), counter-clockwise."""
        rows, columns = self.occupied.shape
        size = self.resolution * np.array([columns, rows])
        return self.in_world(size * [[0, 0], [1, 0], [1, 1], [0, 1]])

    def points(self) -> Array:
        """Centres of the occupied cells in W [m], (n, 2)."""
        return self._centres(self.occupied)

    def grid(self, cell: float, radius: float) -> OccupancyGrid:
        """Squares along the axes of W where a disc can stand.

        A square is occupied where its centre is nearer than `radius` to the
        centre of a cell that is occupied, unknown or beyond the plan's edge.

        Args:
            cell: edge length of a square [m].
            radius: of the disc [m]; 0 for the bare floor.

        Raises:
            ParameterError: the size is out of its range.
            WorldError: the squares are too many.
        """
        _check_size(cell, "cell")
        corners = self.corners()
        low, high = corners.min(axis=0), corners.max(axis=0)
        # Rounding must not add a row of squares.
        count = np.maximum(np.ceil((high - low) / cell - 1e-6), 1)
        if not np.prod(count) <= _MOST_SQUARES:
            raise WorldError(
                f"a floor plan of {high[0] - low[0]:.4g} m by "
                f"{high[1] - low[1]:.4g} m has more than {_MOST_SQUARES} "
                f"squares of {cell:g} m"
            )
        nx, ny = count.astype(int)
        empty = np.zeros((ny, nx), dtype=bool)
        grid = OccupancyGrid(low + cell / 2, cell, empty)
        centres = grid.centres().reshape(-1, 2)
        blocked = np.pad(~self.free, 1, constant_values=True)
        row, column = self.index(centres)
        rows, columns = self.occupied.shape
        row, column = np.clip(row, -1, rows), np.clip(column, -1, columns)
        hit = blocked[row + 1, column + 1]
        # Those beside a free cell are the nearest to any point on free ones.
        edge = blocked & ndimage.binary_dilation(~blocked)
        standing = np.flatnonzero(~hit)
        if standing.size:
            tree = KDTree(self._centres(edge, padded=1))
            distance, _ = tree.query(
                centres[standing], distance_upper_bound=radius
            )
            hit[standing] = distance < radius
        return OccupancyGrid(grid.origin, cell, hit.reshape(ny, nx))

    def index(self, points: ArrayLike) -> tuple[NDArray[np.int_], ...]:
        """Row and column of the cells of points in W [m], (..., 2).

        Beyond the plan's edge they are below 0, or too large.
        """
        x, y, yaw = self.origin
        p_P = (np.asarray(points) - (x, y)) @ rotation(yaw)
        cells = np.floor(p_P / self.resolution).astype(int)
        return len(self.occupied) - 1 - cells[..., 1], cells[..., 0]

    def in_world(self, p_P: ArrayLike) -> Array:
        """Points of P in W [m], (..., 2)."""
        x, y, yaw = self.origin
        p_W: Array = np.asarray(p_P) @ rotation(yaw).T + (x, y)
        return p_W

    def _centres(self, cells: NDArray[np.bool_], padded: int = 0) -> Array:
        """Centres in W [m], (n, 2), of cells of a plan padded by some rows."""
        row, column = np.nonzero(cells)
        up = len(self.occupied) - 0.5 - (row - padded)
        right = column - padded + 0.5
        return self.in_world(self.resolution * np.column_stack([right, up]))


def adaptive_grid_size(grid: OccupancyGrid) -> float:
    """The size of grid squares that suits a floor plan, by (3.1) [m].

    The free lines of all rows and all columns count; their lengths are in
    cells, and so is (3.1), which is scaled by the size of a cell. The source
    does not say of which cells: with those of 5 cm in which the robot's centre
    can be on the shipped floor plans, it is 0.40 m for the house, 0.29 m for
    the bookstore and 0.49 m for the café.

    Args:
        grid: such as `plan.grid(plan.resolution, radius)`.

    Raises:
        WorldError: nothing is free.
    """
    free = ~grid.occupied
    padded = np.pad(free, 1)
    lines = sum(
        np.count_nonzero(np.diff(padded.astype(np.int8), axis=axis) == 1)
        for axis in (0, 1)
    )
    if lines == 0:
        raise WorldError("nothing of the floor plan is free")
    # Every free cell lies on one line along each axis.
    mean_length = 2 * np.count_nonzero(free) / lines
    return grid.cell * float(np.sqrt(mean_length))


def _check_size(size: float, field: str) -> None:
    require(1e-4 <= size <= 1e3, field, size, "in [1e-4, 1000]")


def _grown(grid: OccupancyGrid, points: Array) -> OccupancyGrid:
    """A grid with free cells added, so that it reaches beyond points."""
    if not len(points):
        return grid
    ny, nx = grid.occupied.shape
    last = grid.origin + grid.cell * np.array([nx - 1, ny - 1])
    low = grid.origin - (points.min(axis=0) - _MARGIN)
    high = points.max(axis=0) + _MARGIN - last
    before, after = (
        np.ceil(np.maximum(x, 0) / grid.cell).astype(int) for x in (low, high)
    )
    cells = np.pad(
        grid.occupied,
        ((before[1], after[1]), (before[0], after[0])),
    )
    return OccupancyGrid(grid.origin - grid.cell * before, grid.cell, cells)
