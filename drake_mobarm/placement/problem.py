"""The problem that placement solves: where to stand for one tool target."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array
from drake_mobarm.placement.collision import Surroundings
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.objective import PlacementObjective
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.batches import check_directions
from drake_mobarm.robot.shape import CHASSIS_TOP, LINK_RADIUS, RADIUS

SOLVED_JOINTS = 5
"""The joints that a solver varies; the sixth stays at 0."""

MAX_MOVE = 0.15
"""How far a solver may move the base from its start along each axis [m]."""

MARGIN = 1e-6
"""How far a solver stays from limits and obstacles [rad, m], so that the
closed-form kinematics agree that the arm reaches the target from there."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ToolTarget:
    """Where the tip of the tool has to be, and from where it has to come.

    Appendix C takes a whole orientation; here the roll of the tool about its
    approach is not prescribed, and the sixth joint stays at 0.

    Attributes:
        position: p_WT [m], (3,), not below the floor.
        approach: x axis of the tool in W, a unit vector, (3,).

    Raises:
        ParameterError: a value is out of its range.
    """

    position: ArrayLike
    approach: ArrayLike

    def __post_init__(self) -> None:
        for name, label in (
            ("position", "target position"),
            ("approach", "approach"),
        ):
            value = getattr(self, name)
            try:
                array = np.array(value, dtype=float)
            except (TypeError, ValueError):
                array = np.empty(0)  # Of no valid shape.
            require(
                array.shape == (3,) and bool(np.isfinite(array).all()),
                label,
                value,
                "three finite numbers",
            )
            object.__setattr__(self, name, array)
        require(
            self.p_WT[2] >= 0,
            "target position",
            self.p_WT.tolist(),
            "z of 0 or more: the floor is at 0 m",
        )
        check_directions(self.a_W[None], "approach")

    @property
    def p_WT(self) -> Array:
        """The position [m], (3,)."""
        return np.asarray(self.position)

    @property
    def a_W(self) -> Array:
        """The approach [-], (3,)."""
        return np.asarray(self.approach)


@dataclass(frozen=True, kw_only=True)
class StandProblem:
    """What is asked: the best place of the base for one target of the tool.

    Attributes:
        objective: what makes a place good, (4.12), and of which arm.
        target: of the tool.
        free: where the origin of the base can be.
        heading: yaw of the base in W [rad]; None where it may be any.
        surroundings: what the arm must not touch; None to ignore collisions,
            as the map of the dissertation does.

    Raises:
        ParameterError: the heading is not finite.
    """

    objective: PlacementObjective
    target: ToolTarget
    free: FreeSpace
    heading: float | None = None
    surroundings: Surroundings | None = None

    def __post_init__(self) -> None:
        require(
            self.heading is None or math.isfinite(self.heading),
            "heading",
            self.heading,
            "finite, in rad, or None",
        )

    @property
    def least_distance(self) -> float:
        """Least distance of the base from the target on the floor plan [m].

        Where the arm must not touch anything, the robot stands beside a
        target that is as low as its chassis, not on it.
        """
        low = self.target.p_WT[2] < CHASSIS_TOP + LINK_RADIUS
        if self.surroundings is None or not low:
            return 0.0
        return RADIUS + LINK_RADIUS

    def with_target_at(self, place: Array) -> "StandProblem":
        """The same problem for a target elsewhere, as high as this one.

        Args:
            place: p_WT on the floor plan [m], (2,).

        Raises:
            ParameterError: the place is not two finite numbers.
        """
        position = [*place, self.target.p_WT[2]]
        return replace(self, target=replace(self.target, position=position))

    def without_collisions(self) -> "StandProblem":
        """The same problem with an arm that may touch anything."""
        return replace(self, surroundings=None)


def turns_freely(arm: ArmKinematics) -> NDArray[np.bool_]:
    """Whether each joint but the sixth turns all the way round, (5,)."""
    span = (arm.upper - arm.lower)[:SOLVED_JOINTS]
    return np.asarray(span >= 2 * np.pi - MARGIN)
