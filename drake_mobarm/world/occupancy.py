"""An occupancy grid of the floor plan, and what a round robot can reach."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from drake_mobarm.exceptions import WorldError
from drake_mobarm.geometry import Array
from drake_mobarm.world.obstacles import inside

_MARGIN = 1.0
# Of so many, each of a few bytes while distances are worked out.
_MOST_CELLS = 50_000_000


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """Cells of the floor plan that something stands in.

    Attributes:
        origin: centre of cell [0, 0] in W [m], (2,).
        cell: edge length of a cell [m].
        occupied: (ny, nx), rows along y.
    """

    origin: Array
    cell: float
    occupied: NDArray[np.bool_]

    @classmethod
    def from_outlines(
        cls, outlines: list[Array], cell: float = 0.05
    ) -> "OccupancyGrid":
        """Rasters outlines (k_i, 2) [m], with a free metre around them.

        Raises:
            WorldError: they are so far apart that the cells are too many.
        """
        corners = np.vstack(outlines) if outlines else np.zeros((1, 2))
        origin = corners.min(axis=0) - _MARGIN
        count = np.ceil((corners.max(axis=0) + _MARGIN - origin) / cell)
        if not np.prod(count + 1) <= _MOST_CELLS:
            width, depth = corners.max(axis=0) - corners.min(axis=0)
            raise WorldError(
                f"a floor plan of {width:.4g} m by {depth:.4g} m has more than "
                f"{_MOST_CELLS} cells of {cell:g} m"
            )
        nx, ny = count.astype(int) + 1
        occupied = np.zeros((ny, nx), dtype=bool)
        for polygon in outlines:
            low = ((polygon.min(axis=0) - origin) / cell).astype(int)
            high = ((polygon.max(axis=0) - origin) / cell).astype(int) + 2
            x = origin[0] + cell * np.arange(low[0], high[0])
            y = origin[1] + cell * np.arange(low[1], high[1])
            centres = np.stack(np.meshgrid(x, y), axis=-1)
            # Sides too, or what is thinner than a cell would vanish.
            hit = inside(polygon, centres)
            hit |= _on_sides(polygon, origin, cell, low, hit.shape)
            occupied[low[1] : high[1], low[0] : high[0]] |= hit
        return cls(origin, cell, occupied)

    def centres(self) -> Array:
        """Cell centres in W [m], (ny, nx, 2)."""
        ny, nx = self.occupied.shape
        x = self.origin[0] + self.cell * np.arange(nx)
        y = self.origin[1] + self.cell * np.arange(ny)
        return np.stack(np.meshgrid(x, y), axis=-1)

    def clearance(self) -> Array:
        """Distance [m] of each cell's centre to the nearest occupied one."""
        if not self.occupied.any():
            return np.full(self.occupied.shape, np.inf)
        distance: Array = ndimage.distance_transform_edt(~self.occupied)
        return distance * self.cell

    def regions(self, radius: float) -> NDArray[np.int_]:
        """Numbers the regions in which a disc of `radius` [m] can move.

        Returns:
            (ny, nx): 0 where the disc cannot stand, 1 for the region that
            surrounds everything, 2 and up for regions closed off from it.
        """
        free = self.clearance() > radius
        free[[0, -1], :] = free[:, [0, -1]] = True
        # The first cell, which is free, is where label begins to number.
        numbered: NDArray[np.int_]
        numbered, _ = ndimage.label(free)
        return numbered

    def index(self, points: ArrayLike) -> tuple[NDArray[np.int_], ...]:
        """Row and column of points in W [m], (..., 2), clipped to the grid."""
        cells = np.rint((np.asarray(points) - self.origin) / self.cell)
        ny, nx = self.occupied.shape
        cells = np.clip(cells.astype(int), 0, (nx - 1, ny - 1))
        return cells[..., 1], cells[..., 0]


def _on_sides(
    polygon: Array,
    origin: Array,
    cell: float,
    low: NDArray[np.int_],
    shape: tuple[int, ...],
) -> NDArray[np.bool_]:
    hit = np.zeros(shape, dtype=bool)
    for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        steps = int(np.ceil(2 * np.linalg.norm(end - start) / cell)) + 1
        points = np.linspace(start, end, steps)
        column, row = (np.rint((points - origin) / cell).astype(int) - low).T
        hit[row, column] = True
    return hit
