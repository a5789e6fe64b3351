"""How far a point is from the surfaces of a floor plan, and which way.

A cell of a floor plan is occupied where something touches it, so that the
surface passes through it, half a cell within its edge in the mean. There the
distance is 0; it is negative deeper inside, where no lidar sees a surface.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array, rotation
from drake_mobarm.immutable import Immutable

# The field reaches this far beyond the outermost cells [m].
_MARGIN = 1.0
# Of so many nodes, each of some 40 bytes while distances are worked out.
_MOST_NODES = 25_000_000


@dataclass(frozen=True, eq=False)
class DistanceField(Immutable):
    """Signed distances at nodes half a cell apart, bilinear between them.

    Frame F is the field's: node [0, 0] at its origin, rows along y.

    Attributes:
        distance: [m], (ny, nx); negative inside.
        spacing: of the nodes [m].
        pose: X_WF as (x, y, yaw) [m, m, rad].
    """

    distance: NDArray[np.float32]
    spacing: float
    pose: tuple[float, float, float]

    @classmethod
    def from_points(
        cls, points: ArrayLike, resolution: float, yaw: float = 0.0
    ) -> "DistanceField":
        """The field of a floor plan's occupied cells.

        Args:
            points: centres of the cells in W [m], (n, 2); there may be none.
            resolution: edge length of a cell [m].
            yaw: of the plan's rows in W [rad].

        Raises:
            ParameterError: resolution is out of its range, or points are not
                finite or too far apart.
        """
        centres = np.asarray(points, dtype=float).reshape(-1, 2)
        require(
            bool(np.isfinite(centres).all()), "points", points, "finite [m]"
        )
        require(
            1e-3 <= resolution <= 1e3,
            "resolution",
            resolution,
            "in [1e-3, 1e3] [m]",
        )
        spacing = resolution / 2
        if not len(centres):
            nothing = np.full((1, 1), np.inf, dtype=np.float32)
            return cls(nothing, spacing, (0.0, 0.0, yaw))
        p_F = centres @ rotation(yaw)  # As yet from W's origin.
        margin = int(np.ceil(_MARGIN / resolution))
        low = p_F.min(axis=0) - margin * resolution
        size = (np.ptp(p_F, axis=0) / resolution + 2 * margin).round() + 1
        require(
            bool(np.prod(2 * size) <= _MOST_NODES),
            "points",
            points,
            f"within an area of {_MOST_NODES // 4} cells of {resolution:g} m",
        )
        column, row = ((p_F - low) / resolution).round().astype(int).T
        nx, ny = size.astype(int)
        occupied = np.zeros((ny, nx), dtype=bool)
        occupied[row, column] = True
        # A cell has a node at its centre and eight on its edges, of which one
        # is the point of the edges nearest to any other node.
        square = np.ones((3, 3))
        at_centre = np.zeros((2 * ny - 1, 2 * nx - 1), dtype=bool)
        at_centre[::2, ::2] = occupied
        outside = ~ndimage.binary_dilation(at_centre, square)
        at_centre[::2, ::2] = ~occupied
        within = ~ndimage.binary_dilation(at_centre, square)
        distance = ndimage.distance_transform_edt(outside)
        distance -= ndimage.distance_transform_edt(within)
        x, y = rotation(yaw) @ low
        return cls(
            ((distance + 1) * spacing).astype(np.float32),
            spacing,
            (float(x), float(y), yaw),
        )

    @property
    def is_empty(self) -> bool:
        """Whether there is no surface."""
        return self.distance.size == 1

    @property
    def variance(self) -> float:
        """Of a surface's place, which is anywhere within a cell [m^2]."""
        return (2 * self.spacing) ** 2 / 12

    def at(self, points: Array) -> tuple[Array, Array]:
        """Distances of points, and their gradients.

        Args:
            points: in W [m], (n, 2).

        Returns:
            [m], (n,), infinite beyond the field; and the gradient in W [-],
            (n, 2), which is 0 there.
        """
        x, y, yaw = self.pose
        R_WF = rotation(yaw)
        node = (points - (x, y)) @ R_WF / self.spacing
        ny, nx = self.distance.shape
        column, row = node.T
        known = (column >= 0) & (row >= 0) & (column < nx - 1) & (row < ny - 1)
        distance, gradient = np.full(len(points), np.inf), np.zeros_like(points)
        column, row = column[known], row[known]
        left, low = column.astype(int), row.astype(int)
        u, v = column - left, row - low
        flat, first = self.distance.ravel(), low * nx + left
        d_00, d_10, d_01, d_11 = (
            flat[first + step].astype(float) for step in (0, 1, nx, nx + 1)
        )
        along = d_10 - d_00
        twist = d_11 - d_01 - along
        distance[known] = d_00 + along * u + (d_01 - d_00 + twist * u) * v
        slope = np.stack([along + twist * v, d_01 - d_00 + twist * u], axis=-1)
        gradient[known] = slope @ R_WF.T / self.spacing
        return distance, gradient
