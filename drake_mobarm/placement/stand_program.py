"""The best stand near a start, as a nonlinear program.

Over the base's place and the arm's joints together. The objective has a corner
wherever an element of the Jacobian changes sign (4.6), (4.7), and the best
stand often lies in one: each absolute value is therefore a variable of its
own, no smaller than the element and its negative, which leaves a smooth
program with the same minimum. All derivatives are exact.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.autodiffutils import (
    ExtractGradient,
    ExtractValue,
    InitializeAutoDiff,
)
from pydrake.solvers import MathematicalProgram, SnoptSolver, SolverOptions

from drake_mobarm.geometry import Array
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.objective import PlacementObjective
from drake_mobarm.placement.objective_map import (
    ToolTarget,
    waist_at,
)
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.shape import ARM_BASE_HEIGHT
from drake_mobarm.world.obstacles import signed_distance

MAX_MOVE = 0.15
"""How far the solver may go from a start along each axis [m]."""

FREE_JOINTS = 5
"""Those that the solver moves: the sixth stays at 0."""

# The solver keeps this far from limits and obstacles [rad, m], so that the
# closed form agrees that its place is one.
_MARGIN = 1e-6


class StandProgram:
    """Place, joints and absolute values of the Jacobian's elements.

    Args:
        objective: what counts.
        target: of the tool.
        free: where the base may be.
        start: p_WB [m], (2,).
        q_start: joint positions there [rad], (6,), the waist measured from
            W's x axis.
        heading: of the base [rad]; None where it may choose.
        keep_off: least distance of the base from the target on the floor plan
            [m].
    """

    def __init__(
        self,
        objective: PlacementObjective,
        target: ToolTarget,
        free: FreeSpace,
        start: Array,
        q_start: Array,
        heading: float | None,
        keep_off: float = 0.0,
    ) -> None:
        self._objective = objective
        self._target = target
        arm = objective.arm
        self._tangents = np.linalg.svd(target.a_W[None])[2][1:]
        self._q, self._J = np.empty(0), np.empty(0)
        # The sixth joint turns the tool about its approach: no variable.
        self._last_axis = np.abs(objective.attitude_axes @ target.a_W)
        elements, _ = self._elements(q_start)
        self._each_size = np.tile(np.eye(len(elements)), (2, 1))
        program = MathematicalProgram()
        self._place = program.NewContinuousVariables(2, "p_WB")
        joints = program.NewContinuousVariables(FREE_JOINTS, "q")
        sizes = program.NewContinuousVariables(len(elements), "size")

        cost = _differentiated(self.cost)
        program.AddCost(
            lambda x: cost(x)[0], vars=np.concatenate([joints, sizes])
        )
        zeros = np.zeros(5)
        program.AddConstraint(
            _differentiated(self.reach_error),
            zeros,
            zeros,
            vars=np.concatenate([self._place, joints]),
        )
        program.AddConstraint(
            _differentiated(self.size_excess),
            np.zeros(2 * len(sizes)),
            np.full(2 * len(sizes), np.inf),
            vars=np.concatenate([joints, sizes]),
        )
        low = arm.lower[:FREE_JOINTS] + _MARGIN
        high = arm.upper[:FREE_JOINTS] - _MARGIN
        # Past half a turn the closed form goes on at the other end.
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
            np.maximum(corners[0] + _MARGIN, start - MAX_MOVE),
            np.minimum(corners[1] - _MARGIN, start + MAX_MOVE),
            self._place,
        )
        for _, outline in free.obstacles_near(start, np.sqrt(2) * MAX_MOVE):
            program.AddConstraint(
                _differentiated(_distance_to(outline)),
                [_MARGIN],
                [np.inf],
                vars=self._place,
            )
        if keep_off:
            program.AddConstraint(
                _differentiated(self.distance_to_target),
                [keep_off + _MARGIN],
                [np.inf],
                vars=self._place,
            )
        program.SetInitialGuess(self._place, start)
        program.SetInitialGuess(joints, q_start[:FREE_JOINTS])
        program.SetInitialGuess(sizes, np.abs(elements))
        self._program = program

    def solve(self) -> Array:
        """The place that the solver ends at, optimal or not, (2,)."""
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
        """(4.12) of joints and sizes (5 + n,), and its gradient."""
        p = self._objective.parameters
        q, sizes = _all_joints(x[:FREE_JOINTS]), x[FREE_JOINTS:]
        gradient = np.zeros(len(x))
        arm = self._objective.arm
        det = arm.singularity_determinants(q)
        slope = arm.singularity_determinants_derivative(q)[:, :FREE_JOINTS]
        product = max(abs(float(det.prod())), 1e-12)
        sigma = p.singularity / product + 1
        sigma_slope = -(p.singularity / product) * (
            slope / np.where(det == 0, 1e-12, det)[:, None]
        ).sum(axis=0)
        value = 0.0
        # s of each axis is the sum of its row's sizes.
        s = sizes.reshape(2, 3, FREE_JOINTS).sum(axis=-1)
        s[1] += self._last_axis
        for k, weight in enumerate((p.position_weight, p.attitude_weight)):
            length = float(np.linalg.norm(s[k]))
            value += weight * sigma * length
            gradient[:FREE_JOINTS] += weight * length * sigma_slope
            part = weight * sigma * s[k] / max(length, 1e-12)
            at = FREE_JOINTS + k * 3 * FREE_JOINTS
            gradient[at : at + 3 * FREE_JOINTS] = np.repeat(part, FREE_JOINTS)
        torque, torque_slope = self._objective.torque_and_derivative(q)
        value += p.torque_weight * float(torque)
        gradient[:FREE_JOINTS] += p.torque_weight * torque_slope[:FREE_JOINTS]
        return np.array([value]), gradient[None]

    def reach_error(self, x: Array) -> tuple[Array, Array]:
        """How far place and joints (7,) miss the target: tip, then axis."""
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
        gradient = np.zeros((5, 2 + FREE_JOINTS))
        gradient[:2, :2] = np.eye(2)
        gradient[:3, 2:] = J[:3]
        gradient[3:, 2:] = self._tangents @ (X_BT[:3, 0] @ _turning(J[3:].T)).T
        return error, gradient

    def distance_to_target(self, x: Array) -> tuple[Array, Array]:
        """From the base's place (2,), on the floor plan [m]."""
        away = x - self._target.p_WT[:2]
        distance = float(np.linalg.norm(away))
        return np.array([distance]), away[None] / max(distance, 1e-12)

    def size_excess(self, x: Array) -> tuple[Array, Array]:
        """Sizes less, and plus, the elements that they stand for."""
        sizes = x[FREE_JOINTS:]
        elements, slope = self._elements(_all_joints(x[:FREE_JOINTS]))
        gradient = np.empty((2 * len(sizes), len(x)))
        gradient[:, :FREE_JOINTS] = np.vstack([-slope, slope])
        gradient[:, FREE_JOINTS:] = self._each_size
        return np.concatenate([sizes - elements, sizes + elements]), gradient

    def _jacobian(self, q: Array) -> Array:
        """Of the joints that move, (6, 5); two constraints ask for each q."""
        if not np.array_equal(q, self._q):
            self._q = q
            self._J = self._objective.arm.jacobian(q)[:, :FREE_JOINTS]
        return self._J

    def _elements(self, q: Array) -> tuple[Array, Array]:
        """Elements of (4.4), (4.5), row by row, and their derivatives.

        Returns:
            (30,) and (30, 5), over the joints that move.
        """
        n = FREE_JOINTS
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


def turns_freely(arm: ArmKinematics) -> NDArray[np.bool_]:
    """Which of the joints that move can be anywhere, (5,)."""
    span = (arm.upper - arm.lower)[:FREE_JOINTS]
    return np.asarray(span >= 2 * np.pi - _MARGIN)


# Of the cross product: e_i = LEVI_CIVITA[i, j, k] e_j x e_k.
_LEVI_CIVITA = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
        [[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    ]
)


def _turning(axes: Array) -> Array:
    """Matrices (n, 3, 3) from the right of which p gives axis x p, (n, 3).

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
    """A law that gives value and gradient, as the solver asks for it."""

    def evaluate(x: Any) -> Any:
        if x.dtype != object:
            return law(x)[0]
        value, gradient = law(ExtractValue(x).ravel())
        return InitializeAutoDiff(value, gradient @ ExtractGradient(x)).ravel()

    return evaluate
