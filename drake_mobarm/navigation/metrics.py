"""What Tables 3.2 to 3.4 report of a run, and what Nav2's benchmark names."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from drake_mobarm.driving.route import SPACING, lattice_links
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.navigation.line_of_sight import LineOfSight
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.world.obstacles import clearance
from drake_mobarm.world.occupancy import OccupancyGrid

SUCCESS_DISTANCE = 1.0
"""A run that ends by itself nearer than this to the target succeeded [m]."""

# A robot that has stayed within so small a square [m] for so long [s] is
# trapped.
_TRAP_SIZE, _TRAP_TIME = 1.0, 15.0


@dataclass(frozen=True, eq=False)
class FreeFloor:
    """Where a robot's disc can be, for the shortest ways there.

    Attributes:
        places: centres of free squares [m], (n, 2).
        graph: lengths from each to the eight around it [m], sparse (n, n).
        sight: over the squares.
    """

    places: Array
    graph: csr_array
    sight: LineOfSight

    @classmethod
    def from_outlines(
        cls, outlines: list[Array], radius: float = RADIUS
    ) -> "FreeFloor":
        """The floor about obstacles, in squares of 5 cm.

        Args:
            outlines: of all that can be touched [m], (k_i, 2).
            radius: of the robot [m].
        """
        plain = OccupancyGrid.from_outlines(outlines)
        grown = OccupancyGrid(
            plain.origin, plain.cell, plain.clearance() <= radius
        )
        free = ~grown.occupied.ravel()
        links = lattice_links(*grown.occupied.shape)
        number = np.cumsum(free) - 1
        kept = free[links.rows] & free[links.columns]
        ends = number[links.rows[kept]], number[links.columns[kept]]
        n = int(np.count_nonzero(free))
        lengths = links.lengths[kept] * (grown.cell / SPACING)
        return cls(
            grown.centres().reshape(-1, 2)[free],
            csr_array((lengths, ends), shape=(n, n)),
            LineOfSight(grown),
        )

    def shortest_way(self, start: ArrayLike, end: ArrayLike) -> float:
        """The length of the shortest way between two places [m].

        A way over the squares is drawn taut, which makes it about as short as
        they allow. A place nearer to things than the radius counts as that
        of the nearest free square.

        Args:
            start: p_WS [m], (2,).
            end: p_WE [m], (2,).

        Returns:
            The length, infinite where there is no way.
        """
        ends = np.array([start, end], dtype=float)
        first, last = KDTree(self.places).query(ends)[1].tolist()
        if first == last:
            return float(np.linalg.norm(ends[1] - ends[0]))
        _, before = dijkstra(
            self.graph, indices=first, return_predecessors=True
        )
        chain = [last]
        while before[chain[-1]] >= 0:
            chain.append(int(before[chain[-1]]))
        if chain[-1] != first:
            return float("inf")
        corners = self.places[chain]
        i, j = self._links(corners).T
        lengths = np.hypot(*(corners[i] - corners[j]).T)
        n = len(corners)
        taut = csr_array((lengths, (i, j)), shape=(n, n))
        return float(dijkstra(taut, directed=False, indices=0)[-1])

    def _links(self, corners: Array) -> NDArray[np.int_]:
        """Pairs in sight of each other, (k, 2); those in turn always are."""
        turn = np.arange(len(corners) - 1)
        steps = np.column_stack([turn, turn + 1])
        seen = self.sight.links(corners)
        return np.unique(np.vstack([steps, seen]), axis=0)


def navigation_metrics(
    trace: Mapping[str, Array],
    target: ArrayLike,
    footprint: list[Array],
    floor: FreeFloor,
) -> dict[str, float]:
    """The metrics of one run, up to its end: the robot may still roll then.

    Args:
        trace: `t` (n,) [s], `ground_truth` (n, 7), `measured_base_pose`
            (n, 3), named as in `signals`.
        target: true p_WT [m], (2,).
        footprint: outlines of all that the robot can touch [m], (k_i, 2).
        floor: among them.

    Returns:
        Time to the end, final position error (robot to target), net velocity
        (straight line from start to end over time), path efficiency (straight
        line over distance travelled; 1 for a robot that never left), distance
        travelled, that over the shortest way from the start to the end (at
        least 1, as squares make that way longer; over the straight line where
        the squares show no way), contacts with obstacles, time in contact, the
        smallest clearance, root mean square of the jerk, and the error of the
        measured pose at the end.
    """
    time, truth = trace["t"], trace["ground_truth"]
    position = truth[:, :2]
    straight = float(np.linalg.norm(position[-1] - position[0]))
    travelled = float(np.linalg.norm(np.diff(position, axis=0), axis=1).sum())
    end = float(time[-1])
    period = np.diff(time)
    held = truth[1:, 5] > 0.5
    error = trace["measured_base_pose"][-1] - truth[-1, :3]
    shortest = floor.shortest_way(position[0], position[-1])
    if not np.isfinite(shortest):
        # Through a gap that the squares do not resolve.
        shortest = straight
    return {
        "time_to_target_s": end,
        "final_position_error_m": float(
            np.linalg.norm(position[-1] - np.asarray(target))
        ),
        "net_velocity_m_per_s": straight / end if end > 0 else 0.0,
        "path_efficiency": straight / travelled if travelled > 0 else 1.0,
        "distance_travelled_m": travelled,
        "length_over_shortest": (
            max(travelled / shortest, 1.0) if shortest > 0 else 1.0
        ),
        "contacts": float(truth[-1, 6]),
        "time_in_contact_s": float(period[held].sum()),
        "smallest_clearance_m": float(
            clearance(footprint, position).min() - RADIUS
        ),
        "jerk_rms_m_per_s3": _jerk(time, truth[:, 3]),
        "pose_error_m": float(np.linalg.norm(error[:2])),
        "yaw_error_rad": float(abs(wrap_angle(error[2]))),
    }


def _jerk(time: Array, speed: Array) -> float:
    """Root mean square of the forward speed's second derivative [m/s^3]."""
    if len(time) < 3:
        return 0.0
    jerk = np.gradient(np.gradient(speed, time), time)
    return float(np.sqrt(np.mean(jerk**2)))


def judge(
    metrics: Mapping[str, float],
    trace: Mapping[str, Array],
    target: ArrayLike,
    arrived: bool,
    time_limit: float,
    shut: str | None = None,
) -> tuple[bool, str]:
    """Whether the robot did its job, and why or why not.

    Args:
        metrics: of the run.
        trace: of the run, as for `navigation_metrics`, with
            `estimated_target` (n, 3).
        target: true p_WT [m], (2,).
        arrived: whether it ended by itself at the target.
        time_limit: of the run [s].
        shut: what shuts the way, where the robot found none and gave up.
    """
    error = metrics["final_position_error_m"]
    if arrived and error < SUCCESS_DISTANCE:
        return True, "arrived at the target"
    off = float(
        np.linalg.norm(trace["estimated_target"][-1, :2] - np.asarray(target))
    )
    lost = ""
    if np.isnan(off):
        lost = ", the target was never known"
    elif off > SUCCESS_DISTANCE:
        lost = f", the target's estimate {off:.2f} m off"
    if arrived:
        return False, f"stopped {error:.2f} m from the target{lost}"
    if shut is not None:
        return False, f"gave up: the way is shut by {shut}{lost}"
    x, y = trace["ground_truth"][-1, :2]
    late = trace["t"] > trace["t"][-1] - _TRAP_TIME
    recent = trace["ground_truth"][late]
    extent = float(np.ptp(recent[:, :2], axis=0).max())
    what = f"time limit of {time_limit:g} s reached"
    if extent < _TRAP_SIZE and time_limit > _TRAP_TIME:
        held = np.mean(recent[:, 5] > 0.5) > 0.5
        what = "held by contact" if held else "trapped"
    return False, f"{what} at [{x:.2f}, {y:.2f}]{lost}"
