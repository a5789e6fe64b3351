"""The highway of section 3.3.2.1: points in sight of each other, best paths."""

from collections import OrderedDict
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import KDTree

from drake_mobarm.checks import (
    at_least,
    not_negative,
    one_of,
    positive,
    require,
)
from drake_mobarm.exceptions import ParameterError
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.navigation.highway_points import (
    choose_adaptive_points,
    choose_random_points,
)
from drake_mobarm.navigation.highway_repair import cover_floor, join_pieces
from drake_mobarm.navigation.line_of_sight import LineOfSight
from drake_mobarm.world.occupancy import OccupancyGrid

POINTS = ("adaptive", "random")
"""How the points of a highway are chosen."""

# Up to so many points all best paths are worked out together; beyond, those
# from one point are when they are first asked for.
_WHOLE_TABLE = 1000
# So many numbers of best paths from single points are kept.
_KEPT = 20_000_000


@frozen
class HighwayParameters:
    """How the points of a highway are chosen.

    Attributes:
        count: number of random points; the text leaves it to the user.
        min_distance: between two random points to begin with [m]; the text
            advises a large one, as it shrinks where there is no room.
        blur: standard deviation of the density's Gaussian blur [squares]; the
            text gives none.
        repair: whether points are added until all that can be joined is, and
            every free square sees a point; the text adds none.
        smallest_region: a part of the floor that is apart from all others and
            less than this [m^2] has no points; the text has no such limit.
    """

    count: int = 100
    min_distance: float = 2.0
    blur: float = 1.0
    repair: bool = True
    smallest_region: float = 0.5

    def __post_init__(self) -> None:
        one_of(self, (True, False), "repair")
        at_least(self, 1, "count")
        positive(self, "min_distance")
        not_negative(self, "blur", "smallest_region")


@dataclass(frozen=True, eq=False)
class Highway:
    """Points, the links between those in sight of each other, best paths.

    Attributes:
        points: in W [m], (n, 2).
        links: pairs of points i < j, (k, 2), in rising order.
    """

    points: Array
    links: NDArray[np.int_]
    _rows: OrderedDict[int, tuple[Array, NDArray[np.int_]]] = field(
        default_factory=OrderedDict, init=False, repr=False
    )

    @classmethod
    def from_links(cls, points: ArrayLike, links: ArrayLike) -> "Highway":
        """A highway of links in any order, each as long as it is straight.

        Args:
            points: in W [m], (n, 2).
            links: pairs of different points, (k, 2).

        Raises:
            ParameterError: a link joins no two of the points.
        """
        points = np.array(points, dtype=float).reshape(-1, 2)
        given = np.array(links, dtype=int).reshape(-1, 2)
        wrong = np.any((given < 0) | (given >= len(points)), axis=1)
        wrong |= given[:, 0] == given[:, 1]
        if wrong.any():
            i, j = given[wrong][0]
            raise ParameterError(
                f"link is ({i}, {j}): valid are two different points, 0 to "
                f"{len(points) - 1}"
            )
        return cls(points, np.unique(np.sort(given, axis=1), axis=0))

    @cached_property
    def graph(self) -> csr_array:
        """Lengths of the links [m], a sparse (n, n), symmetric."""
        i, j = self.links.T
        length = np.hypot(*(self.points[i] - self.points[j]).T)
        n = len(self.points)
        return csr_array(
            (np.tile(length, 2), (np.r_[i, j], np.r_[j, i])), shape=(n, n)
        )

    @property
    def length(self) -> Array:
        """Lengths of the best paths [m], (n, n), infinite where is none."""
        return self._table[0]

    @property
    def before(self) -> NDArray[np.int_]:
        """The point before j on the best path from i, (n, n), -9999 for none.

        That is the best path table: all best paths follow from it.
        """
        return self._table[1]

    @cached_property
    def piece_of(self) -> NDArray[np.int_]:
        """Number of the connected piece that each point is in, (n,), from 0."""
        label: NDArray[np.int_]
        _, label = connected_components(self.graph, directed=False)
        return label

    @property
    def pieces(self) -> int:
        """Number of connected pieces."""
        return int(self.piece_of.max(initial=-1)) + 1

    def describe(self) -> str:
        """One line: how many points, links and pieces, and where these are."""
        size = np.bincount(self.piece_of)
        places = [
            f"{size[piece]} at ({x:.2f}, {y:.2f})"
            for piece in np.argsort(-size, kind="stable")
            for x, y in self.points[self.piece_of == piece][:1]
        ]
        return (
            f"points: {len(self.points)}, links: {len(self.links)}, pieces: "
            f"{self.pieces}" + (f" ({', '.join(places)})" if places else "")
        )

    def best_paths(self, i: int) -> tuple[Array, NDArray[np.int_]]:
        """Row i of `length` and of `before`, (n,) each.

        Of a highway too large for the whole table, the rows last used are
        kept: paths to or from the same points are looked up at once.
        """
        if len(self.points) <= _WHOLE_TABLE:
            return self.length[i], self.before[i]
        rows = self._rows
        if i not in rows:
            rows[i] = dijkstra(self.graph, indices=i, return_predecessors=True)
        rows.move_to_end(i)
        while len(rows) > 1 and len(rows) * len(self.points) > _KEPT:
            rows.popitem(last=False)
        return rows[i]

    def path(self, i: int, j: int) -> NDArray[np.int_]:
        """The points of the best path from i to j, both included.

        Empty where there is none.
        """
        # Backwards along the way from j: a target's row serves all paths there.
        length, before = self.best_paths(j)
        if not np.isfinite(length[i]):
            return np.empty(0, dtype=int)
        path = [i]
        while path[-1] != j:
            path.append(int(before[path[-1]]))
        return np.array(path)

    def within(self, position: ArrayLike, radius: float) -> NDArray[np.int_]:
        """Points at most `radius` [m] from a position in W, in rising order."""
        found = self._tree.query_ball_point(
            position, radius, return_sorted=True
        )
        return np.array(found, dtype=int)

    def best_entries(
        self, near: ArrayLike, approach: ArrayLike, targets: ArrayLike
    ) -> tuple[NDArray[np.int_], Array]:
        """For each target point the near point with the shortest way to it.

        That is step 3 of section 3.3.2.2: one path a target point.

        Args:
            near: near points, (a,), at least one.
            approach: distances of the robot from these [m], (a,).
            targets: target points, (t,).

        Returns:
            The near point to enter at, (t,), and the length from the robot to
            the target point through it [m], (t,), infinite for no path.
        """
        near, approach = np.asarray(near, dtype=int), np.asarray(approach)
        targets = np.asarray(targets, dtype=int).reshape(-1)
        # Paths are as long in either direction, and targets stay the same from
        # one update to the next: their rows are looked up, not those of `near`.
        total = np.array(
            [approach + self.best_paths(int(j))[0][near] for j in targets]
        ).reshape(len(targets), len(near))
        best = np.argmin(total, axis=1)
        return near[best], total[np.arange(len(targets)), best]

    @cached_property
    def _table(self) -> tuple[Array, NDArray[np.int_]]:
        length, before = dijkstra(self.graph, return_predecessors=True)
        return length, before

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(self.points)


def build_highway(
    grid: OccupancyGrid,
    parameters: HighwayParameters,
    rng: np.random.Generator,
    points: str = "adaptive",
) -> Highway:
    """Chooses points and links those that see each other.

    Args:
        grid: its squares are occupied already where the robot's centre must
            not be: they are grown by its radius.
        parameters: how to choose.
        rng: source of the choice.
        points: one of `POINTS`: `adaptive`, number and spacing by the
            obstacles' density, (3.3) to (3.5); or `random`, by `count` and
            `min_distance`.

    Raises:
        ParameterError: `points` is no such way; the grid has no free region
            that is large enough, or fewer free squares than random points are
            asked for.
    """
    require(points in POINTS, "points", points, ", ".join(POINTS))
    grid = _without_pockets(grid, parameters.smallest_region)
    if points == "random":
        chosen = choose_random_points(
            grid, parameters.count, parameters.min_distance, rng
        )
    else:
        chosen = choose_adaptive_points(grid, parameters.blur, rng)
    sight = LineOfSight(grid)
    if parameters.repair:
        chosen = np.vstack([chosen, cover_floor(grid, sight, chosen)])
    links = sight.links(chosen)
    highway = Highway.from_links(chosen, links)
    if not parameters.repair or highway.pieces == 1:
        return highway
    added = join_pieces(grid, sight, chosen, highway.piece_of)
    crossing = sight.links(chosen, added) + np.array([0, len(chosen)])
    among = sight.links(added) + len(chosen)
    return Highway.from_links(
        np.vstack([chosen, added]), np.vstack([links, crossing, among])
    )


def _without_pockets(grid: OccupancyGrid, smallest: float) -> OccupancyGrid:
    """The grid, where free regions below an area [m^2] are occupied, too."""
    # Labels join squares side by side, as lines of sight do.
    region, _ = ndimage.label(~grid.occupied)
    squares = np.bincount(region.ravel())
    small = squares * grid.cell**2 < smallest
    small[0] = True
    if small.all():
        raise ParameterError(
            f"the floor plan has no free region of {smallest:g} m^2 or more "
            "for a highway"
        )
    return OccupancyGrid(grid.origin, grid.cell, small[region])
