"""What every planner is asked for, and what it answers."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from drake_mobarm.geometry import Array
from drake_mobarm.immutable import Immutable


class Forces(NamedTuple):
    """The forces at the robot [1/m], (2,) each, in W.

    Attributes:
        attraction: of the target.
        repulsion: of what is around.
        highway: weighted; 0 while it is not engaged.
    """

    attraction: Array
    repulsion: Array
    highway: Array

    @property
    def total(self) -> Array:
        """(3.8), with all that a planner adds."""
        total: Array = self.attraction + self.repulsion + self.highway
        return total


NO_FORCES = Forces(np.zeros(2), np.zeros(2), np.zeros(2))


@dataclass(frozen=True, eq=False)
class PlannerState(Immutable):
    """What a planner decided last, and what it remembers.

    Attributes:
        memory: of the planner's own kind.
        arrived: whether the robot is at the target.
        shut: p_WP of what shuts the way [m], (2,), once the planner gives up.
        forces: at the robot; zero for a planner that has none.
        paths: the corners p_WQ of each way that the robot is led along [m],
            (k, 2) each.
    """

    memory: Any = None
    arrived: bool = False
    shut: Array | None = None
    forces: Forces = field(default=NO_FORCES)
    paths: tuple[Array, ...] = ()


class PlannerLaw(Protocol):
    """A planner's law in plain numpy."""

    def initial_state(self) -> PlannerState:
        """The state before the first scan; it is never changed."""

    def update(
        self, state: PlannerState, pose_WB: Array, p_WT: Array, ranges: Array
    ) -> PlannerState:
        """The state after a scan.

        Args:
            state: before it; it is not changed.
            pose_WB: at the scan, [x, y, yaw] in m and rad, (3,).
            p_WT: the target as it is known now [m], (2,).
            ranges: [m], (rays,), in the order of `ray_angles`; NaN where
                missing.
        """

    def command(
        self, state: PlannerState, pose_WB: Array
    ) -> tuple[float, float]:
        """Speed [m/s] and turn rate [rad/s] for a pose, between scans, too."""
