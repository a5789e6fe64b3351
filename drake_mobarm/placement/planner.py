"""The plan: the map of a grid and the best stand, for one target."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_mobarm.checks import not_negative, positive
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.immutable import Immutable
from drake_mobarm.placement.best_stand import Stand, find_best_stand
from drake_mobarm.placement.grid import FreeGrid
from drake_mobarm.placement.objective_map import score_places
from drake_mobarm.placement.problem import StandProblem, ToolTarget


@frozen
class PlannerParameters:
    """When a new plan is made.

    Attributes:
        replan_distance: distance of the estimated target from that of the
            last plan, on the floor plan, above which a new one is made [m].
        rate: how often the estimate is read [Hz].
        delay: time from the updates of the estimator to those of the planner
            [s].

    Raises:
        ParameterError: a value is out of its range.
    """

    replan_distance: float = 0.05
    rate: float = 10.0
    delay: float = 0.0

    def __post_init__(self) -> None:
        not_negative(self, "replan_distance", "delay")
        positive(self, "rate")


@dataclass(frozen=True, eq=False)
class Placement(Immutable):
    """Where to stand for a target.

    Attributes:
        grid: squares of the free space.
        target: of the tool; None before it is known.
        squares: indices into the grid of the attractive squares, those from
            whose centre the arm reaches the target, the best first, (n,).
        centres: p_WB at the centres of these squares [m], (n, 2).
        objective: j of (4.12) at these centres, (n,).
        stand: the best stand, no worse than the best square; None where the
            target is not reachable.
        reason: describes the stand, or says why there is none.
    """

    grid: FreeGrid
    target: ToolTarget | None
    squares: NDArray[np.int_]
    centres: Array
    objective: Array
    stand: Stand | None
    reason: str


def nothing_planned(grid: FreeGrid) -> Placement:
    """The placement before a target is known."""
    return Placement(
        grid,
        None,
        np.empty(0, dtype=int),
        np.empty((0, 2)),
        np.empty(0),
        None,
        "no target known yet",
    )


def plan_stand(problem: StandProblem, grid: FreeGrid) -> Placement:
    """Maps the objective over a grid and finds the best stand.

    Args:
        problem: what to solve.
        grid: squares of the problem's free space.
    """
    scored = score_places(problem, grid.centres)
    stand, reason = find_best_stand(problem, scored)
    best = scored.best
    squares = np.argsort(best, kind="stable")[: np.sum(~np.isnan(best))]
    return Placement(
        grid,
        problem.target,
        squares,
        grid.centres[squares],
        best[squares],
        stand,
        reason,
    )
