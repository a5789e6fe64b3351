"""The map of the objective over places to stand: section 4.3.3.1."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.placement.problem import StandProblem
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.arm_parameters import JOINTS
from drake_mobarm.robot.arm_solver import SOLUTIONS
from drake_mobarm.robot.shape import ARM_BASE_HEIGHT


@dataclass(frozen=True, eq=False)
class PlaceScores:
    """The objective of each solution of the arm at each place.

    Attributes:
        places: p_WB of the base [m], (n, 2).
        q: joint positions [rad], (n, 8, 6); the first is the heading of the
            base plus the position of the waist, that is the angle of the arm
            about the vertical from the x axis of W. NaN where there is no
            solution.
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
        """The joint positions of `best` [rad], (n, 6), as in `q`, or NaN."""
        index = np.argmin(self._or_infinite(), axis=1)
        q: Array = self.q[np.arange(len(index)), index]
        return np.where(np.isnan(self.best)[:, None], np.nan, q)

    def _or_infinite(self) -> Array:
        return np.where(np.isnan(self.objective), np.inf, self.objective)


def score_places(problem: StandProblem, places: ArrayLike) -> PlaceScores:
    """Scores all solutions of the arm at each of some places to stand.

    Solutions that the motors cannot hold are left out, as 4.3.1.1 asks. Where
    the problem has surroundings, so are those that touch them or the robot
    itself; where it has a heading, those whose waist would be beyond its
    limits there. Without a heading the waist may be anywhere.

    Args:
        problem: what to solve. Whether the places are in its free space is
            not checked.
        places: p_WB of the base [m], (n, 2).

    Raises:
        ParameterError: the places have a wrong shape.
    """
    p_WB = np.asarray(places, dtype=float)
    if p_WB.ndim != 2 or p_WB.shape[1] != 2:
        raise ParameterError(f"places have shape {p_WB.shape}: valid is (n, 2)")
    target, arm = problem.target, problem.objective.arm
    q = np.full((len(p_WB), SOLUTIONS, JOINTS), np.nan)
    j = np.full((len(p_WB), SOLUTIONS), np.nan)
    p_BT = np.empty((len(p_WB), 3))  # (4.1), with the axes of B along W's.
    p_BT[:, :2] = target.p_WT[:2] - p_WB
    p_BT[:, 2] = target.p_WT[2] - ARM_BASE_HEIGHT
    near = np.linalg.norm(p_BT - arm.shoulder, axis=1) <= arm.reach
    q[near] = _free_waist(arm).inverse_axis(p_BT[near], target.a_W)
    if problem.heading is not None:
        _, beyond = waist_at(arm, q[..., 0], problem.heading)
        q[beyond] = np.nan
    solved = ~np.isnan(q[..., 0])
    if problem.surroundings is not None:
        place, solution = np.nonzero(solved)
        p_WA = np.column_stack(
            [p_WB[place], np.full(len(place), ARM_BASE_HEIGHT)]
        )
        hit = problem.surroundings.touched(arm, p_WA, q[place, solution])
        q[place[hit], solution[hit]] = np.nan
        solved[place[hit], solution[hit]] = False
    scores = problem.objective.scores(q[solved])
    j[solved] = np.where(scores.load <= 1, scores.objective, np.nan)
    q[~np.isfinite(j)] = np.nan
    return PlaceScores(p_WB, q, j)


def waist_at(
    arm: ArmKinematics, waist_W: ArrayLike, heading: ArrayLike
) -> tuple[Array, Array]:
    """The waist's position when the base stands at a heading.

    Args:
        arm: the arm.
        waist_W: heading of the base plus position of the waist [rad], as in
            `PlaceScores.q`, any shape.
        heading: of the base [rad], broadcast against `waist_W`.

    Returns:
        The position of the waist [rad], `waist_W` - `heading` but for whole
        turns, as near to the middle of its range as they bring it and clipped
        to its limits; and whether it was beyond them.
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
