"""Offline planning with the potential field (section 3.3.3).

The map is known. A plan follows the total force from the start, point by
point, until one of the text's stopping rules holds. A plan takes some 30 ms.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_mobarm.checks import at_least, positive, require
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.navigation.highway import Highway
from drake_mobarm.navigation.highway_force import (
    HighwayForceParameters,
    choose_paths,
    exits,
    highway_force,
)
from drake_mobarm.navigation.line_of_sight import LineOfSight
from drake_mobarm.navigation.potential import (
    PotentialParameters,
    attraction,
    grid_influence,
    repulsion,
)
from drake_mobarm.world.occupancy import OccupancyGrid

Force = Callable[[Array], Array]
"""The force at a position p_WB [m], (2,): (2,)."""

OFFLINE_POTENTIAL = PotentialParameters(
    attraction_gain=0.05,
    conic_distance=1.0,
    repulsion_gain=0.02,
    influence_distance=0.4,
)
"""Weaker than the field that robots drive by. A step is as long as the force
is strong: so the attraction alone makes the longest step from 1 m on, and
vanishes, by the text's rule, 0.2 m from the target. The dissertation gives no
gains."""


@frozen
class OfflineParameters:
    """How a plan steps and when it stops; values of section 3.3.3.

    With these values no step is as short as the shortest one: a force that
    would ask for it stops the plan.

    Attributes:
        shortest_step: [m], positive.
        longest_step: [m], no less than `shortest_step`.
        weakest_force: a weaker force stops the plan, positive.
        reversal: a change of the force's direction from one step to the next
            that is larger than this is a reversal [rad], positive.
        reversals: more than so many reversals stop the plan.
        window: number of the last changes among which reversals count.
        iterations: after so many steps the plan stops.
        tolerance: a plan succeeds that ends within this distance of the
            target [m], positive.
    """

    shortest_step: float = 0.005
    longest_step: float = 0.05
    weakest_force: float = 1e-2
    reversal: float = math.pi - 0.3
    reversals: int = 2
    window: int = 10
    iterations: int = 2000
    tolerance: float = 0.3

    def __post_init__(self) -> None:
        positive(
            self,
            "shortest_step",
            "longest_step",
            "weakest_force",
            "reversal",
            "tolerance",
        )
        require(
            self.longest_step >= self.shortest_step,
            "longest_step",
            self.longest_step,
            f"shortest_step, {self.shortest_step:g}, or more",
        )
        at_least(self, 0, "reversals")
        at_least(self, 1, "window", "iterations")


@dataclass(frozen=True, eq=False)
class Plan:
    """A path, and how it ended.

    Attributes:
        path: from the start on [m], (steps + 1, 2).
        success: whether it ends near enough to the target.
        reason: which rule stopped it, and how far from the target.
    """

    path: Array
    success: bool
    reason: str

    @property
    def steps(self) -> int:
        """Number of steps."""
        return len(self.path) - 1

    @property
    def length(self) -> float:
        """Of the path [m]."""
        return float(np.hypot(*np.diff(self.path, axis=0).T).sum())


class MapField:
    """The total force (3.8) on a map, towards one target.

    The highway pulls only where the target is not in sight (3.3.2.2); sight
    is judged on the grid.

    Args:
        grid: squares of the map, occupied where the robot's centre must not
            be.
        target: p_WT [m], (2,).
        potential: shape of the field.
        highway: of the map; without one the field is the classic one.
        pull: how strongly the highway pulls.
        best_only: whether only that path pulls which makes the shortest way
            to the target, instead of one to each exit as in (3.7). Paths that
            lead round an obstacle on either side can cancel each other, and
            then the plan stops where they do.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        target: ArrayLike,
        potential: PotentialParameters,
        highway: Highway | None = None,
        pull: HighwayForceParameters | None = None,
        *,
        best_only: bool = False,
    ) -> None:
        self._target = np.asarray(target, dtype=float)
        self._potential = potential
        self._area = grid.cell**2
        self._squares, self._influence = grid_influence(grid, potential)
        self._sight = LineOfSight(grid)
        self._highway = highway
        self._pull = pull or HighwayForceParameters()
        self._best_only = best_only
        # What is looked for at each step: the target first.
        self._looked_for = self._target[None]
        if highway is not None:
            self._exits = exits(
                highway.points,
                self._target,
                self._sight.clear(highway.points, self._target),
                self._pull,
            )
            self._looked_for = np.vstack([self._target, highway.points])

    def force(self, position: Array) -> Array:
        """The total force at p_WB [m], (2,)."""
        way = self._target - position
        pull = attraction(position, self._target, self._potential)
        squares = self._squares - position
        near = np.hypot(squares[:, 0], squares[:, 1]) < self._influence
        push = repulsion(
            squares[near],
            self._influence[near],
            self._area,
            way,
            self._potential,
        )
        if self._highway is None:
            return pull + push
        seen = self._sight.clear(position, self._looked_for)
        if seen[0]:
            return pull + push
        along = self._along(self._highway, seen[1:], position, pull)
        return pull + push + self._pull.weight * along

    def _along(
        self,
        highway: Highway,
        seen: NDArray[np.bool_],
        position: Array,
        pull: Array,
    ) -> Array:
        """The highway's pull, not yet weighted."""
        paths = choose_paths(
            highway, position, np.flatnonzero(seen), self._exits
        )
        if self._best_only and paths:
            # From the robot along the path to the target.
            ends = highway.points[[path.points[-1] for path in paths]]
            last = np.hypot(*(self._target - ends).T)
            whole = [path.length for path in paths] + last
            paths = [paths[int(np.argmin(whole))]]
        return highway_force(highway.points, paths, position, seen, pull)


def plan(
    force: Force,
    start: ArrayLike,
    target: ArrayLike,
    parameters: OfflineParameters | None = None,
) -> Plan:
    """Follows a force from the start until a stopping rule holds.

    A step is as long as the force is strong, within the limits.

    Args:
        force: the total force at a position.
        start: p_WB at first [m], (2,).
        target: p_WT [m], (2,).
        parameters: steps and stopping rules.
    """
    parameters = parameters or OfflineParameters()
    position = np.asarray(start, dtype=float)
    path = [position]
    reversed_: deque[bool] = deque(maxlen=parameters.window)
    before: float | None = None
    stopped = f"{parameters.iterations} steps"
    for _ in range(parameters.iterations):
        pull = force(position)
        strength = math.hypot(*pull)
        if strength < parameters.weakest_force:
            stopped = "the force vanished"
            break
        direction = math.atan2(pull[1], pull[0])
        if before is not None:
            change = abs(wrap_angle(direction - before))
            reversed_.append(change > parameters.reversal)
        before = direction
        if sum(reversed_) > parameters.reversals:
            stopped = "the force kept turning round"
            break
        step = min(
            max(strength, parameters.shortest_step), parameters.longest_step
        )
        position = position + step / strength * pull
        path.append(position)
    apart = math.hypot(*(np.asarray(target, dtype=float) - position))
    return Plan(
        np.array(path),
        apart <= parameters.tolerance,
        f"{stopped}, {apart:.2f} m from the target",
    )
