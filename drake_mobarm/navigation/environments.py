"""Ten small floor plans of rising difficulty, for offline planning (3.3.3).

The dissertation's own are not in its text. These are rectangular rooms whose
furniture and inner walls are rectangles; the edges of the floor are walls, too.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.geometry import Array
from drake_mobarm.world.occupancy import OccupancyGrid

Rectangle = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max [m]."""

Point = tuple[float, float]
"""x, y [m]."""


@dataclass(frozen=True, kw_only=True)
class Environment:
    """A walled floor with obstacles on it, and where to plan on it.

    The world frame's origin is the floor's lower left corner.

    Attributes:
        name: what it is like.
        size: of the floor along x and y [m].
        obstacles: rectangles, which may overlap.
        starts: four positions.
        targets: three positions.
    """

    name: str
    size: tuple[float, float]
    obstacles: tuple[Rectangle, ...]
    starts: tuple[Point, Point, Point, Point]
    targets: tuple[Point, Point, Point]

    def clearance(self, points: ArrayLike) -> Array:
        """Distance to the nearest obstacle or wall.

        Args:
            points: in W [m], (..., 2).

        Returns:
            (...) [m]: 0 inside an obstacle, negative outside the floor.
        """
        points = np.asarray(points, dtype=float)
        walls = np.minimum(points, self.size - points).min(axis=-1)
        boxes = np.reshape(self.obstacles, (-1, 2, 2))
        places = points[..., None, :]
        apart = np.maximum(boxes[:, 0] - places, places - boxes[:, 1])
        gaps = np.linalg.norm(np.maximum(apart, 0), axis=-1)
        nearest: Array = np.minimum(walls, gaps.min(axis=-1, initial=np.inf))
        return nearest

    def grid(self, cell: float, radius: float) -> OccupancyGrid:
        """Squares where a disc can stand, from a ring outside the floor on.

        A square is occupied where its centre is nearer than the disc's radius
        to an obstacle or a wall.

        Args:
            cell: edge length of a square [m].
            radius: of the disc [m].
        """
        # Rounding must not add a row of squares.
        nx, ny = np.ceil(np.asarray(self.size) / cell - 1e-6).astype(int) + 2
        empty = np.zeros((ny, nx), dtype=bool)
        grid = OccupancyGrid(np.full(2, -cell / 2), cell, empty)
        occupied = self.clearance(grid.centres()) < radius
        return OccupancyGrid(grid.origin, cell, occupied)


ENVIRONMENTS = (
    Environment(
        name="one table",
        size=(4.4, 4.0),
        obstacles=((1.7, 1.6, 2.7, 2.4),),
        starts=((0.8, 0.8), (0.9, 2.0), (0.8, 3.2), (2.2, 0.7)),
        targets=((3.5, 3.0), (3.5, 2.0), (2.2, 3.2)),
    ),
    Environment(
        name="pillars",
        size=(5.0, 4.0),
        obstacles=(
            (1.3, 0.9, 1.7, 1.3),
            (1.3, 2.5, 1.7, 2.9),
            (3.1, 0.9, 3.5, 1.3),
            (3.1, 2.5, 3.5, 2.9),
            (2.2, 1.7, 2.6, 2.1),
        ),
        starts=((0.8, 0.6), (0.6, 1.9), (0.9, 3.4), (2.4, 0.5)),
        targets=((4.1, 3.3), (4.0, 1.9), (2.4, 3.4)),
    ),
    Environment(
        name="furniture",
        size=(5.0, 5.0),
        obstacles=(
            (0.0, 3.9, 1.8, 5.0),
            (2.0, 2.0, 3.1, 2.9),
            (4.1, 0.0, 5.0, 1.9),
            (1.1, 0.0, 2.0, 0.9),
            (3.0, 4.4, 4.6, 5.0),
            (0.0, 1.8, 0.5, 2.9),
            (4.4, 2.9, 5.0, 3.6),
        ),
        starts=((0.5, 0.5), (0.9, 3.3), (3.1, 0.7), (2.4, 4.5)),
        targets=((3.8, 3.9), (3.9, 2.4), (1.2, 2.2)),
    ),
    Environment(
        name="doorway",
        size=(4.6, 3.8),
        obstacles=(
            (2.2, 0.0, 2.4, 2.3),
            (2.2, 3.2, 2.4, 3.8),
            (0.8, 2.0, 1.3, 2.5),
            (3.4, 1.1, 4.0, 1.6),
        ),
        starts=((1.2, 0.9), (1.7, 1.7), (0.5, 3.0), (1.5, 3.2)),
        targets=((3.6, 3.0), (2.9, 1.0), (3.9, 2.2)),
    ),
    Environment(
        name="U trap",
        size=(4.4, 4.2),
        obstacles=(
            (1.5, 3.0, 2.8, 3.2),
            (2.6, 1.0, 2.8, 3.2),
            (1.5, 1.0, 2.8, 1.2),
        ),
        starts=((0.8, 2.4), (2.0, 2.3), (1.8, 1.8), (1.4, 3.7)),
        targets=((3.4, 2.1), (3.4, 3.4), (2.4, 0.5)),
    ),
    Environment(
        name="zigzag",
        size=(4.8, 3.4),
        obstacles=(
            (1.4, 0.0, 1.6, 2.4),
            (3.1, 1.0, 3.3, 3.4),
        ),
        starts=((0.8, 2.0), (0.9, 2.8), (2.0, 2.4), (2.4, 1.5)),
        targets=((4.0, 0.9), (3.9, 1.8), (2.4, 0.7)),
    ),
    Environment(
        name="three rooms",
        size=(5.6, 4.2),
        obstacles=(
            (0.0, 2.0, 1.0, 2.2),
            (1.9, 2.0, 3.8, 2.2),
            (4.7, 2.0, 5.6, 2.2),
            (2.7, 2.2, 2.9, 4.2),
            (0.0, 3.6, 1.6, 4.2),
            (2.2, 0.0, 3.2, 0.5),
        ),
        starts=((0.8, 2.9), (2.1, 3.2), (1.2, 1.2), (3.1, 1.1)),
        targets=((3.5, 2.9), (4.4, 3.4), (4.6, 1.0)),
    ),
    Environment(
        name="shelves",
        size=(5.8, 4.2),
        obstacles=(
            (1.0, 0.0, 1.5, 3.2),
            (2.4, 1.0, 2.9, 4.2),
            (3.8, 0.0, 4.3, 3.2),
            (4.3, 1.0, 4.9, 1.5),
        ),
        starts=((1.1, 3.7), (1.9, 2.4), (1.95, 1.0), (3.4, 3.4)),
        targets=((3.35, 1.9), (4.7, 3.0), (3.2, 0.6)),
    ),
    Environment(
        name="spiral",
        size=(5.2, 5.0),
        obstacles=(
            (1.0, 1.0, 1.2, 4.0),
            (1.0, 1.0, 4.2, 1.2),
            (4.0, 1.0, 4.2, 4.0),
            (2.2, 3.8, 4.2, 4.0),
            (2.2, 2.3, 2.4, 4.0),
        ),
        starts=((0.5, 3.4), (2.2, 4.5), (1.2, 4.5), (1.7, 3.4)),
        targets=((1.8, 1.8), (3.2, 3.0), (2.8, 1.8)),
    ),
    Environment(
        name="maze",
        size=(5.8, 4.8),
        obstacles=(
            (0.0, 1.1, 1.9, 1.3),
            (1.9, 1.1, 2.1, 2.3),
            (1.0, 2.3, 3.2, 2.5),
            (3.0, 0.0, 3.2, 1.4),
            (3.2, 2.3, 4.7, 2.5),
            (4.0, 1.2, 5.8, 1.4),
            (2.0, 3.4, 2.2, 4.8),
            (3.4, 2.5, 3.6, 3.8),
            (4.6, 3.4, 4.8, 4.8),
        ),
        starts=((1.6, 0.6), (1.2, 1.8), (1.2, 3.4), (2.8, 3.0)),
        targets=((2.6, 1.8), (4.1, 3.1), (5.2, 3.2)),
    ),
)
"""The ten, from the easiest to the hardest."""
