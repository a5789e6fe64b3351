"""The objective over places to stand: section 4.3.3.1."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import require
from drake_mobarm.exceptions import ParameterError
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.placement.collision import Surroundings
from drake_mobarm.placement.objective import PlacementObjective
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.arm_parameters import JOINTS
from drake_mobarm.robot.arm_solver import SOLUTIONS
from drake_mobarm.robot.batches import check_directions
from drake_mobarm.robot.shape import ARM_BASE_HEIGHT


@dataclass(frozen=True, kw_only=True)
class ToolTarget:
    """Where the tool's tip has to be, and how it has to come there.

    Appendix C takes a whole orientation; here the tool's roll about its
    approach is open, and the sixth joint stays at 0.

    Attributes:
        position: p_WT [m], (3,), not below the floor.
        approach: the tool's x axis in W, a unit vector, (3,).

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
                array = np.empty(0)
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


@dataclass(frozen=True)
class PlaceScores:
    """What each solution of the arm is worth at each place.

    Attributes:
        places: p_WB of the base [m], (n, 2).
        q: joint positions [rad], (n, 8, 6), the waist measured from W's x
            axis (the base's heading and the waist together); NaN where
            there is no solution.
        objective: j of (4.12), (n, 8), NaN where there is no solution.
    """

    places: Array
    q: Array
    objective: Array

    @property
    def best(self) -> Array:
        """The least objective at each place, (n,), NaN where there is none."""
        least = np.min(self._or_infinite(), axis=1, initial=np.inf)
        best: Array = np.where(np.isinf(least), np.nan, least)
        return best

    @property
    def best_q(self) -> Array:
        """The joints that give it [rad], (n, 6), NaN where there are none."""
        index = np.argmin(self._or_infinite(), axis=1)
        q: Array = self.q[np.arange(len(index)), index]
        return np.where(np.isnan(self.best)[:, None], np.nan, q)

    def _or_infinite(self) -> Array:
        return np.where(np.isnan(self.objective), np.inf, self.objective)


def score_places(
    objective: PlacementObjective,
    target: ToolTarget,
    places: ArrayLike,
    heading: float | None = None,
    surroundings: Surroundings | None = None,
) -> PlaceScores:
    """Scores places to stand, all solutions of the arm at each.

    Places farther than the arm reaches are not worked out. Solutions that the
    motors cannot hold are left out, as 4.3.1.1 asks.

    Args:
        objective: what counts.
        target: of the tool.
        places: p_WB of the base [m], (n, 2).
        heading: of the base [rad]; None where it may choose, and the waist
            may then be anywhere.
        surroundings: what the arm must not touch: solutions that do are left
            out; None for the dissertation's map, which does not look.

    Raises:
        ParameterError: a value is out of its range.
    """
    p_WB = np.asarray(places, dtype=float)
    if p_WB.ndim != 2 or p_WB.shape[1] != 2:
        raise ParameterError(f"places have shape {p_WB.shape}: valid is (n, 2)")
    if heading is not None:
        require(bool(np.isfinite(heading)), "heading", heading, "finite")
    arm = objective.arm
    q = np.full((len(p_WB), SOLUTIONS, JOINTS), np.nan)
    j = np.full((len(p_WB), SOLUTIONS), np.nan)
    p_BT = np.empty((len(p_WB), 3))  # (4.1), the base's axes along W's.
    p_BT[:, :2] = target.p_WT[:2] - p_WB
    p_BT[:, 2] = target.p_WT[2] - ARM_BASE_HEIGHT
    near = np.linalg.norm(p_BT - arm.shoulder, axis=1) <= arm.reach
    q[near] = _free_waist(arm).inverse_axis(p_BT[near], target.a_W)
    if heading is not None:
        q[waist_at(arm, q[..., 0], heading)[1]] = np.nan
    solved = ~np.isnan(q[..., 0])
    if surroundings is not None:
        place, solution = np.nonzero(solved)
        p_WA = np.column_stack(
            [p_WB[place], np.full(len(place), ARM_BASE_HEIGHT)]
        )
        hit = surroundings.touched(arm, p_WA, q[place, solution])
        q[place[hit], solution[hit]] = np.nan
        solved[place[hit], solution[hit]] = False
    scores = objective.scores(q[solved])
    held = scores.load <= 1
    j[solved] = np.where(held, scores.objective, np.nan)
    q[~np.isfinite(j)] = np.nan
    return PlaceScores(p_WB, q, j)


def waist_at(
    arm: ArmKinematics, waist_W: ArrayLike, heading: ArrayLike
) -> tuple[Array, Array]:
    """The waist's position when the base stands at a heading.

    Args:
        arm: whose waist.
        waist_W: the waist measured from W's x axis [rad], any shape.
        heading: of the base [rad], broadcast against it.

    Returns:
        Its position [rad], the turn nearest to the middle of its range, held
        within its limits; and whether it was beyond them.
    """
    low, high = float(arm.lower[0]), float(arm.upper[0])
    middle, half = (low + high) / 2, (high - low) / 2
    off = wrap_angle(np.asarray(waist_W) - heading - middle)
    beyond = np.asarray(np.abs(off) > half)
    return middle + np.clip(off, -half, half), beyond


def _free_waist(arm: ArmKinematics) -> ArmKinematics:
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[0], upper[0] = -np.pi, np.pi
    return ArmKinematics(replace(arm.parameters, lower=lower, upper=upper))
