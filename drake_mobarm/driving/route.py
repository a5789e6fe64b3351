"""The cheapest way of a round robot among points, by Dijkstra on a lattice."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from drake_mobarm.checks import positive, require, within
from drake_mobarm.driving.gaps import clearance_ahead
from drake_mobarm.driving.scan import Scan, lengths
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.robot.shape import RADIUS

# Edge length [m] of the cells that points are sorted into, to measure
# clearances; the lattice's places are every second of them.
_CELL = 0.05
SPACING = 2 * _CELL
"""From a place of a lattice to the next one along an axis [m]."""
# How far beyond all points the lattice reaches [m]: wide enough to pass them.
_BESIDE = 1.5
# It is made of blocks of this size [m], and ends this far from the start [m].
_BLOCK = 2.0
_HORIZON = 60.0
# No way ends this near to a place that was tried [m].
_TRIED = 0.3
# Where no way ends near enough, ends that are this much farther off than the
# nearest [m] are as good as that.
_AS_NEAR = 0.2
# Ways that are this far apart somewhere [m] are two ways.
_ELSEWHERE = 0.7
# So many places after the robot's own are as good as passed.
_PASSED = 4
# Places to go to straight are looked for from here on [m].
_FIRST_AHEAD = 0.3
# A straight piece may be as much less clear than the way [m]; places that are
# clearer than this [m] are as good as open ground.
_CUT = 0.05
_WIDE = 0.55
# Within this distance of the start [m] the robot may leave through places that
# are shut: it stands among them.
_LEAVE = 0.35


@frozen
class RouteParameters:
    """What a way costs.

    Attributes:
        shut_clearance: from a place to the nearest point, below which nobody
            tries to pass [m], positive.
        tight_clearance: below which a way is tight: a metre of it costs
            `tight_cost` metres more [m], at least `shut_clearance`.
        tight_cost: [-], positive.
        comfort_clearance: from which a way costs only its length [m], at
            least `tight_clearance`.
        comfort_cost: what a metre costs more just above `tight_clearance`;
            the cost falls with the square of the clearance missing [-],
            positive.
        miss_cost: of a metre from the way's end to the target [-], positive.
        switch: a way that leads elsewhere has to cost less than this share of
            the way until now [-], in (0, 1].
    """

    shut_clearance: float = 0.22
    tight_clearance: float = 0.31
    tight_cost: float = 6.0
    comfort_clearance: float = 0.7
    comfort_cost: float = 2.0
    miss_cost: float = 3.0
    switch: float = 0.8

    def __post_init__(self) -> None:
        positive(self, *vars(self))
        within(self, "(0, 1]", "switch")
        for lower, upper in (
            ("shut_clearance", "tight_clearance"),
            ("tight_clearance", "comfort_clearance"),
        ):
            least, value = getattr(self, lower), getattr(self, upper)
            require(value >= least, upper, value, f"at least {lower}, {least}")


@dataclass(frozen=True, eq=False)
class Route:
    """A way.

    Attributes:
        places: p_WQ along it [m], (n, 2), from the start to its end.
        clearances: from there to the nearest point [m], (n,).
        miss: from its end to the target [m].
    """

    places: Array
    clearances: Array
    miss: float


def find_route(
    points: Array,
    start: Array,
    target: Array,
    tolerance: float,
    parameters: RouteParameters,
    *,
    tried: Array,
    last: Route | None = None,
) -> Route:
    """The cheapest way from a start to near a target.

    Args:
        points: p_WP of what is in the way [m], (n, 2).
        start: p_WS [m], (2,).
        target: p_WT [m], (2,).
        tolerance: how far from the target a way may end [m]. Where no such
            way is open, or the target is farther off than 60 m along an axis,
            the way ends about as near to the target as one can come.
        parameters: what a way costs.
        tried: places near which no way is to end [m], (m, 2).
        last: the way until now, if any: the robot stays on it where another
            one costs nearly the same.
    """
    lattice, clearance = _clearances(points, start, target)
    floor = Floor(
        lattice.places(),
        clearance,
        lattice_links(*lattice.shape),
        lattice.nearest,
    )
    return cheapest_way(
        floor, start, target, tolerance, parameters, tried=tried, last=last
    )


def cheapest_way(
    floor: "Floor",
    start: Array,
    target: Array,
    tolerance: float,
    parameters: RouteParameters,
    *,
    tried: Array,
    last: Route | None = None,
) -> Route:
    """The cheapest way over the places of a floor; see `find_route`."""
    places, clearance, links = floor.places, floor.clearance, floor.links
    cost = _place_costs(clearance, parameters)
    shut = np.isinf(cost)
    cost[shut & (lengths(places - start) < _LEAVE)] = 1 + parameters.tight_cost
    starts = cost.repeat(np.diff(links.row_starts))
    weights = links.lengths * (starts + cost.take(links.columns)) / 2
    graph = csr_array(
        (weights, links.columns, links.row_starts),
        shape=(cost.size, cost.size),
    )
    way, before = dijkstra(
        graph, indices=int(floor.nearest(start)), return_predecessors=True
    )
    miss = lengths(places - target)
    total = way + parameters.miss_cost * miss
    open_ends = np.isfinite(way) & ~shut
    for place in tried:
        open_ends &= lengths(places - place) > _TRIED
    if np.any(open_ends):
        nearest = float(miss[open_ends].min())
        open_ends &= miss <= max(tolerance, nearest + _AS_NEAR)
    end = int(np.argmin(np.where(open_ends, total, np.inf)))
    chain = [end]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    chain.reverse()
    route = Route(places[chain], clearance[chain], float(miss[end]))
    if last is None:
        return route
    here = int(np.argmin(lengths(last.places - start)))
    numbers = floor.nearest(last.places[here:])
    # Off the floor, several places have the same nearest one.
    numbers = numbers[np.insert(np.diff(numbers) != 0, 0, True)]
    rest = Route(places[numbers], clearance[numbers], float(miss[numbers[-1]]))
    steps = lengths(np.diff(rest.places, axis=0))
    rest_cost = (
        float(lengths(rest.places[:1] - start)[0])
        + float(steps @ (cost[numbers[1:]] + cost[numbers[:-1]]) / 2)
        + parameters.miss_cost * rest.miss
    )
    stays = (
        open_ends[numbers[-1]]
        and total[end] > parameters.switch * rest_cost
        and _leads_elsewhere(route, rest)
    )
    return rest if stays else route


def _leads_elsewhere(route: Route, other: Route) -> bool:
    """Whether a way passes things on another side than another way does."""
    apart = np.hypot(
        route.places[:, None, 0] - other.places[:, 0],
        route.places[:, None, 1] - other.places[:, 1],
    )
    return bool(apart.min(axis=1).max() > _ELSEWHERE)


def is_shut(route: Route, scan: Scan, parameters: RouteParameters) -> bool:
    """Whether a scan shows something on the way ahead of the robot."""
    here = int(np.argmin(lengths(route.places - scan.position)))
    ahead = route.places[here + _PASSED :: 2] - scan.position
    ahead = ahead[lengths(ahead) < scan.range_max]
    apart = np.hypot(
        ahead[:, None, 0] - scan.points[:, 0],
        ahead[:, None, 1] - scan.points[:, 1],
    )
    # The way was planned with cells, which are as much as this off.
    return bool(np.any(apart < parameters.shut_clearance - _CELL / 2))


def place_ahead(
    route: Route, position: Array, points: Array, lookahead: float
) -> tuple[Array, bool]:
    """The farthest place on a way that a robot can go to straight.

    Args:
        route: the way.
        position: p_WB of the robot [m], (2,).
        points: p_BP_W of what is in the way [m], (n, 2).
        lookahead: along the way, to the farthest place looked at [m].

    Returns:
        p_BQ_W, from the robot to that place [m], (2,), and whether it is the
        way's end.
    """
    places = route.places - position
    here = int(np.argmin(lengths(places)))
    along = lengths(np.diff(places[here:], axis=0)).cumsum()
    candidates = (
        here + 1 + np.nonzero((along >= _FIRST_AHEAD) & (along <= lookahead))[0]
    )
    if not candidates.size:
        return places[-1], True
    # No tighter than the way itself, which keeps clear of corners.
    clear = np.minimum.accumulate(np.minimum(route.clearances[here:], _WIDE))
    needed = np.maximum(clear[candidates - here] - _CUT, RADIUS)
    near = points[lengths(points) < lookahead + _WIDE]
    free = clearance_ahead(places[candidates], near) >= needed
    chosen = int(candidates[np.nonzero(free)[0][-1] if free.any() else 0])
    return places[chosen], chosen == len(places) - 1


@dataclass(frozen=True, eq=False)
class Floor:
    """Places that a way can lead over.

    Attributes:
        places: p_WQ [m], (n, 2).
        clearance: from there to the nearest thing [m], (n,).
        links: from each place to those beside it.
        nearest: gives the numbers (...) of the places that are nearest to
            others, (..., 2).
    """

    places: Array
    clearance: Array
    links: "Links"
    nearest: Callable[[Array], NDArray[np.int_]]


@dataclass(frozen=True, eq=False)
class _Lattice:
    """Places (ny, nx) of a lattice, numbered along x first."""

    origin: Array
    shape: tuple[int, int]

    def places(self) -> Array:
        ny, nx = self.shape
        x = self.origin[0] + SPACING * np.arange(nx)
        y = self.origin[1] + SPACING * np.arange(ny)
        return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)

    def nearest(self, places: Array) -> NDArray[np.int_]:
        """The numbers (...) of the places nearest to others, (..., 2)."""
        ny, nx = self.shape
        steps = np.rint((places - self.origin) / SPACING).astype(int)
        columns, rows = np.moveaxis(steps, -1, 0)
        numbers: NDArray[np.int_] = np.clip(rows, 0, ny - 1) * nx + np.clip(
            columns, 0, nx - 1
        )
        return numbers


@dataclass(frozen=True, eq=False)
class Links:
    """Links of places, as a sparse matrix's rows hold them.

    Attributes:
        row_starts: where each place's links begin, (n + 1,).
        rows: the place that each starts from, (k,).
        columns: the place that each leads to, (k,).
        lengths: of each [m], (k,).
    """

    row_starts: NDArray[np.int32]
    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    lengths: Array


@lru_cache(maxsize=8)
def lattice_links(ny: int, nx: int) -> Links:
    """The links of each place to the eight around it [m]."""
    numbers = np.pad(np.arange(ny * nx).reshape(ny, nx), 1, constant_values=-1)
    steps = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx]
    beside = np.stack(
        [
            numbers[1 + dy : 1 + dy + ny, 1 + dx : 1 + dx + nx].ravel()
            for dy, dx in steps
        ],
        axis=1,
    )
    there = beside >= 0
    distances = SPACING * np.hypot(*np.array(steps).T)
    count = there.sum(axis=1)
    return Links(
        row_starts=np.concatenate([[0], count.cumsum()]).astype(np.int32),
        rows=np.arange(ny * nx, dtype=np.int32).repeat(count),
        columns=beside[there].astype(np.int32),
        lengths=np.broadcast_to(distances, beside.shape)[there],
    )


def _clearances(
    points: Array, start: Array, target: Array
) -> tuple[_Lattice, Array]:
    """A lattice about all points and both ends, and its clearances [m].

    It reaches `_HORIZON` about the start at most, whatever lies beyond.
    """
    points = points[np.all(np.abs(points - start) < _HORIZON, axis=1)]
    end = np.clip(target, start - _HORIZON, start + _HORIZON)
    around = np.vstack([points, start, end])
    # In whole blocks: the lattice keeps its places, and mostly its shape.
    low = np.floor((around.min(axis=0) - _BESIDE) / _BLOCK) * _BLOCK
    high = around.max(axis=0) + _BESIDE
    blocks = np.ceil((high - low) / _BLOCK)
    nx, ny = np.rint(blocks * (_BLOCK / SPACING)).astype(int) + 1
    lattice = _Lattice(low, (int(ny), int(nx)))
    taken = np.zeros((2 * ny, 2 * nx), dtype=bool)
    column, row = np.rint((points - low) / _CELL).astype(int).T
    taken[row, column] = True
    if not points.size:
        return lattice, np.full(nx * ny, np.inf)
    distance = _CELL * distance_transform_edt(~taken)
    return lattice, distance[::2, ::2].ravel()


def _place_costs(clearance: Array, parameters: RouteParameters) -> Array:
    """What a metre costs at places of a clearance [m], (n,)."""
    missing = np.clip(
        (parameters.comfort_clearance - clearance)
        / max(parameters.comfort_clearance - parameters.tight_clearance, 1e-9),
        0.0,
        1.0,
    )
    cost: Array = 1 + parameters.comfort_cost * missing**2
    cost[clearance < parameters.tight_clearance] += parameters.tight_cost
    cost[clearance < parameters.shut_clearance] = np.inf
    return cost
