"""The best stand near a start, as a nonlinear program.

Its variables are the place of the base and the joint positions. The objective
is not differentiable where an element of the Jacobian changes sign (4.6),
(4.7), and the best stand often lies there. The magnitude of each element is
therefore a variable, too, constrained to be no less than the element and its
negative: the program is then smooth and has the same minimum. All derivatives
are exact.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.autodiffutils import (
    ExtractGradient,
    ExtractValue,
    InitializeAutoDiff,
)
from pydrake.solvers import MathematicalProgram, SnoptSolver, SolverOptions

from drake_mobarm.geometry import Array
from drake_mobarm.placement.objective_map import waist_at
from drake_mobarm.placement.problem import (
    MARGIN,
    MAX_MOVE,
    SOLVED_JOINTS,
    StandProblem,
    turns_freely,
)
from drake_mobarm.robot.shape import ARM_BASE_HEIGHT
from drake_mobarm.world.obstacles import signed_distance


class StandProgram:
    """The program over place, joint positions and magnitudes.

    Collisions of the arm are not among its constraints; obstacles are, that
    the base has to keep away from, and the problem's least distance.

    Args:
        problem: what to solve.
        start: p_WB that the solver starts from [m], (2,).
        q_start: joint positions there [rad], (6,), as in `PlaceScores.q`.
    """

    def __init__(
        self, problem: StandProblem, start: Array, q_start: Array
    ) -> None:
        self._objective = objective = problem.objective
        self._target = target = problem.target
        arm, free, heading = objective.arm, problem.free, problem.heading
        self._tangents = np.linalg.svd(target.a_W[None])[2][1:]
        self._q, self._J = np.empty(0), np.empty(0)
        # The sixth joint, which is not varied, turns the tool about this.
        self._last_axis = np.abs(objective.attitude_axes @ target.a_W)
        elements, _ = self._elements(q_start)
        self._each_magnitude = np.tile(np.eye(len(elements)), (2, 1))
        program = MathematicalProgram()
        self._place = program.NewContinuousVariables(2, "p_WB")
        joints = program.NewContinuousVariables(SOLVED_JOINTS, "q")
        magnitudes = program.NewContinuousVariables(len(elements), "magnitude")

        cost = _differentiated(self.cost)
        program.AddCost(
            lambda x: cost(x)[0], vars=np.concatenate([joints, magnitudes])
        )
        zeros = np.zeros(5)
        program.AddConstraint(
            _differentiated(self.reach_error),
            zeros,
            zeros,
            vars=np.concatenate([self._place, joints]),
        )
        program.AddConstraint(
            _differentiated(self.magnitude_excess),
            np.zeros(2 * len(magnitudes)),
            np.full(2 * len(magnitudes), np.inf),
            vars=np.concatenate([joints, magnitudes]),
        )
        low = arm.lower[:SOLVED_JOINTS] + MARGIN
        high = arm.upper[:SOLVED_JOINTS] - MARGIN
        # What leaves such a range at one end enters it at the other.
        turns = turns_freely(arm)
        low[turns], high[turns] = -np.inf, np.inf
        if heading is None:
            low[0], high[0] = -np.inf, np.inf
        elif not turns[0]:
            waist, _ = waist_at(arm, q_start[0], heading)
            turn = q_start[0] - waist
            low[0], high[0] = low[0] + turn, high[0] + turn
        program.AddBoundingBoxConstraint(low, high, joints)
        corners = np.reshape(free.polygon.bounds, (2, 2))
        program.AddBoundingBoxConstraint(
            np.maximum(corners[0] + MARGIN, start - MAX_MOVE),
            np.minimum(corners[1] - MARGIN, start + MAX_MOVE),
            self._place,
        )
        for _, outline in free.obstacles_near(start, np.sqrt(2) * MAX_MOVE):
            program.AddConstraint(
                _differentiated(_distance_to(outline)),
                [MARGIN],
                [np.inf],
                vars=self._place,
            )
        least_distance = problem.least_distance
        if least_distance:
            program.AddConstraint(
                _differentiated(self.distance_to_target),
                [least_distance + MARGIN],
                [np.inf],
                vars=self._place,
            )
        program.SetInitialGuess(self._place, start)
        program.SetInitialGuess(joints, q_start[:SOLVED_JOINTS])
        program.SetInitialGuess(magnitudes, np.abs(elements))
        self._program = program

    def solve(self) -> Array:
        """The place p_WB that the solver ends at [m], (2,).

        It may be neither optimal nor feasible: score it.
        """
        options = SolverOptions()
        for name, value in (
            ("Major iterations limit", 100),
            ("Major optimality tolerance", 1e-5),
            ("Major feasibility tolerance", 1e-8),
        ):
            options.SetOption(SnoptSolver.id(), name, value)
        result = SnoptSolver().Solve(self._program, None, options)
        place: Array = result.GetSolution(self._place)
        return place

    def cost(self, x: Array) -> tuple[Array, Array]:
        """The objective (4.12), (1,), and its gradient.

        Args:
            x: joint positions [rad] and magnitudes, (5 + n,).
        """
        p = self._objective.parameters
        q, magnitudes = _all_joints(x[:SOLVED_JOINTS]), x[SOLVED_JOINTS:]
        gradient = np.zeros(len(x))
        arm = self._objective.arm
        det = arm.singularity_determinants(q)
        slope = arm.singularity_determinants_derivative(q)[:, :SOLVED_JOINTS]
        product = max(abs(float(det.prod())), 1e-12)
        sigma = p.singularity / product + 1
        sigma_slope = -(p.singularity / product) * (
            slope / np.where(det == 0, 1e-12, det)[:, None]
        ).sum(axis=0)
        value = 0.0
        # s of each axis is the sum over the magnitudes of its row.
        s = magnitudes.reshape(2, 3, SOLVED_JOINTS).sum(axis=-1)
        s[1] += self._last_axis
        for k, weight in enumerate((p.position_weight, p.attitude_weight)):
            length = float(np.linalg.norm(s[k]))
            value += weight * sigma * length
            gradient[:SOLVED_JOINTS] += weight * length * sigma_slope
            part = weight * sigma * s[k] / max(length, 1e-12)
            at = SOLVED_JOINTS + k * 3 * SOLVED_JOINTS
            gradient[at : at + 3 * SOLVED_JOINTS] = np.repeat(
                part, SOLVED_JOINTS
            )
        torque, torque_slope = self._objective.torque_and_derivative(q)
        value += p.torque_weight * float(torque)
        gradient[:SOLVED_JOINTS] += (
            p.torque_weight * torque_slope[:SOLVED_JOINTS]
        )
        return np.array([value]), gradient[None]

    def reach_error(self, x: Array) -> tuple[Array, Array]:
        """How far the tool is from the target, (5,), and the gradient.

        The first three are of the tip [m]; the other two are the components
        of the tool's x axis across the approach.

        Args:
            x: p_WB [m] and joint positions [rad], (7,).
        """
        q = _all_joints(x[2:])
        X_BT = self._objective.arm.forward(q)
        J = self._jacobian(q)
        base = np.array([x[0], x[1], ARM_BASE_HEIGHT])
        error = np.concatenate(
            [
                base + X_BT[:3, 3] - self._target.p_WT,
                self._tangents @ X_BT[:3, 0],
            ]
        )
        gradient = np.zeros((5, 2 + SOLVED_JOINTS))
        gradient[:2, :2] = np.eye(2)
        gradient[:3, 2:] = J[:3]
        gradient[3:, 2:] = self._tangents @ (X_BT[:3, 0] @ _turning(J[3:].T)).T
        return error, gradient

    def distance_to_target(self, x: Array) -> tuple[Array, Array]:
        """Distance to the target on the floor plan [m], and its gradient.

        Args:
            x: p_WB [m], (2,).
        """
        away = x - self._target.p_WT[:2]
        distance = float(np.linalg.norm(away))
        return np.array([distance]), away[None] / max(distance, 1e-12)

    def magnitude_excess(self, x: Array) -> tuple[Array, Array]:
        """Magnitudes less the elements, then plus them, and the gradient.

        Args:
            x: joint positions [rad] and magnitudes, (5 + n,).

        Returns:
            (2 n,), all 0 or more where the magnitudes are large enough, and
            (2 n, 5 + n).
        """
        magnitudes = x[SOLVED_JOINTS:]
        elements, slope = self._elements(_all_joints(x[:SOLVED_JOINTS]))
        gradient = np.empty((2 * len(magnitudes), len(x)))
        gradient[:, :SOLVED_JOINTS] = np.vstack([-slope, slope])
        gradient[:, SOLVED_JOINTS:] = self._each_magnitude
        excess = np.concatenate([magnitudes - elements, magnitudes + elements])
        return excess, gradient

    def _jacobian(self, q: Array) -> Array:
        """The Jacobian over the varied joints, (6, 5).

        It is kept for the next call: two constraints ask for each q.
        """
        if not np.array_equal(q, self._q):
            self._q = q
            self._J = self._objective.arm.jacobian(q)[:, :SOLVED_JOINTS]
        return self._J

    def _elements(self, q: Array) -> tuple[Array, Array]:
        """Elements of (4.4), (4.5), row by row, and their derivatives.

        Returns:
            (30,) and (30, 5), over the varied joints.
        """
        n = SOLVED_JOINTS
        J = self._jacobian(q)
        v, w = J[:3].T, J[3:].T
        # How joint j turns column i: the outer joint's axis on the inner one.
        turning = _turning(w)
        turned = v @ turning  # [outer, inner].
        inner = np.arange(n)[:, None, None] >= np.arange(n)[:, None]
        slope_v = np.where(inner, turned.transpose(1, 0, 2), turned)
        slope_w = np.where(inner, (w @ turning).transpose(1, 0, 2), 0.0)
        values, slopes = [], []
        for axes, part, slope in (
            (self._objective.position_axes, v, slope_v),
            (self._objective.attitude_axes, w, slope_w),
        ):
            values.append((axes @ part.T).ravel())
            slopes.append((axes @ slope.transpose(0, 2, 1)).transpose(1, 0, 2))
        return np.concatenate(values), np.concatenate(slopes).reshape(-1, n)


# Of the cross product: e_i = LEVI_CIVITA[i, j, k] e_j x e_k.
_LEVI_CIVITA = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
        [[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    ]
)


def _turning(axes: Array) -> Array:
    """Matrices M, (n, 3, 3), so that p M is the cross product axis x p.

    np.cross takes ten times as long.
    """
    matrices: Array = np.tensordot(axes, _LEVI_CIVITA, 1)
    return matrices


def _all_joints(q: Array) -> Array:
    return np.concatenate([q, [0.0]])


def _distance_to(
    outline: Array,
) -> Callable[[Array], tuple[Array, Array]]:
    return lambda x: signed_distance(outline, x)


def _differentiated(
    law: Callable[[Array], tuple[Array, Array]],
) -> Callable[[Any], Any]:
    """A law that returns value and gradient, in the form a program takes."""

    def evaluate(x: Any) -> Any:
        if x.dtype != object:
            return law(x)[0]
        value, gradient = law(ExtractValue(x).ravel())
        return InitializeAutoDiff(value, gradient @ ExtractGradient(x)).ravel()

    return evaluate
