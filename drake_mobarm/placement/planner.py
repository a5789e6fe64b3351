"""Everything there is to say about where to stand for one target."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_mobarm.geometry import Array
from drake_mobarm.immutable import Immutable
from drake_mobarm.placement.best_stand import Stand, find_best_stand
from drake_mobarm.placement.collision import Surroundings
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.grid import FreeGrid
from drake_mobarm.placement.objective import PlacementObjective
from drake_mobarm.placement.objective_map import ToolTarget, score_places


@dataclass(frozen=True)
class Placement(Immutable):
    """Where to stand for a target.

    Attributes:
        grid: the squares of the free space.
        target: of the tool; None before there is one.
        squares: numbers of the grid's attractive squares, from which the arm
            reaches the target, the best first, (n,).
        centres: of these squares in W [m], (n, 2).
        objective: j of (4.12) at these centres, (n,).
        stand: the best there is, no worse than the best square; None where
            there is none.
        reason: what the stand is, or why there is none.
    """

    grid: FreeGrid
    target: ToolTarget | None
    squares: NDArray[np.int_]
    centres: Array
    objective: Array
    stand: Stand | None
    reason: str


def nothing_planned(grid: FreeGrid) -> Placement:
    """What there is to say before a target is known."""
    return Placement(
        grid,
        None,
        np.empty(0, dtype=int),
        np.empty((0, 2)),
        np.empty(0),
        None,
        "no target known yet",
    )


def plan_stand(
    objective: PlacementObjective,
    target: ToolTarget,
    free: FreeSpace,
    grid: FreeGrid,
    heading: float | None = None,
    surroundings: Surroundings | None = None,
) -> Placement:
    """Maps the objective over a grid and finds the best stand.

    Args:
        objective: what counts.
        target: of the tool.
        free: where the base may be.
        grid: squares of that.
        heading: of the base [rad]; None where it may choose.
        surroundings: what the arm must not touch; None not to look.
    """
    scored = score_places(
        objective, target, grid.centres, heading, surroundings
    )
    stand, reason = find_best_stand(
        objective, target, free, scored, heading, surroundings
    )
    best = scored.best
    squares = np.argsort(best, kind="stable")[: np.sum(~np.isnan(best))]
    return Placement(
        grid,
        target,
        squares,
        grid.centres[squares],
        best[squares],
        stand,
        reason,
    )
