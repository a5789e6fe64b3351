"""The best stand near a target, by nonlinear programming.

The map knows the objective at squares' centres; from its best ones a
gradient-based solver goes on, over the base's place and the arm's joints
together. The objective has a corner wherever an element of the Jacobian
changes sign (4.6), (4.7), and the best stand often lies in one: each absolute
value is therefore a variable of its own, no smaller than the element and its
negative, which leaves a smooth program with the same minimum.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.autodiffutils import (
    ExtractGradient,
    ExtractValue,
    InitializeAutoDiff,
)
from pydrake.solvers import MathematicalProgram, SnoptSolver, SolverOptions

from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.objective import PlacementObjective, Scores
from drake_mobarm.placement.objective_map import (
    ARM_BASE_HEIGHT,
    PlaceScores,
    ToolTarget,
    score_places,
    waist_at,
)
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.world.obstacles import signed_distance

# Distance of the places that are tried besides the map's squares [m].
_SPACING = 0.025
# Starts with the arm bent the same way are at least this far apart [m].
_APART = 0.1
_STARTS = 3
# How far the solver may go from a start along each axis [m].
_MOVE = 0.15
# A start this much worse than the best one is not worth going on from.
_HOPELESS = 1.1
# The solver keeps this far from limits and obstacles [rad, m], so that the
# closed form agrees that its place is one.
_MARGIN = 1e-6
# Nearer than this to a limit or an obstacle [rad, m] is at it.
_ACTIVE = 1e-4
# The sixth joint stays at 0.
_FREE_JOINTS = 5
_JOINT_NAMES = (
    "waist",
    "shoulder",
    "elbow",
    "forearm roll",
    "wrist angle",
    "wrist rotation",
)


@dataclass(frozen=True)
class Stand:
    """Where to stand, and how the arm reaches its target from there.

    Attributes:
        pose: X_WB, [x, y, yaw] in m and rad, (3,).
        q: joint positions [rad], (6,).
        scores: of these joints.
        active: what keeps the stand from being better still, one line each;
            empty where nothing does.
    """

    pose: Array
    q: Array
    scores: Scores
    active: tuple[str, ...]


def find_best_stand(
    objective: PlacementObjective,
    target: ToolTarget,
    free: FreeSpace,
    squares: PlaceScores,
    heading: float | None = None,
) -> tuple[Stand | None, str]:
    """The place in free space with the least objective (4.12).

    Args:
        objective: what counts.
        target: of the tool.
        free: where the base may be.
        squares: the map, in free space.
        heading: of the base [rad]; None where it may choose: it then faces
            the target, as far as the waist's limits let it.

    Returns:
        The stand, never worse than the map's best square, and a line that
        says what it is; or None, and why nothing is reachable.
    """
    # Of the obstacles only those that a place within reach can be near.
    room = objective.arm.reach + _SPACING + free.clearance + np.sqrt(2) * _MOVE
    near = free.obstacles_near(target.p_WT[:2], room)
    free = replace(free, obstacles=tuple(near))
    lattice = _lattice(objective, target)
    around = score_places(objective, target, lattice, heading)
    inside = free.contains(lattice)
    tried = PlaceScores(
        np.vstack([squares.places, lattice[inside]]),
        np.concatenate([squares.q, around.q[inside]]),
        np.concatenate([squares.objective, around.objective[inside]]),
    )
    starts = _pick_starts(tried)
    if starts:
        best = starts[0]
    else:
        # Free space may still hold a place between the lattice's.
        best = None
        starts = _pick_starts(_near(around, free))
    for _, start, q_start in starts:
        found = _improve(objective, target, free, start, q_start, heading)
        if found is not None and (best is None or found[0] < best[0]):
            best = found
    if best is None:
        return None, _explain(objective, target, around)
    _, place, q = best
    return _make_stand(objective, target, free, place, q, heading)


def _lattice(objective: PlacementObjective, target: ToolTarget) -> Array:
    reach = objective.arm.reach
    steps = _SPACING * np.arange(-(reach // _SPACING), reach // _SPACING + 1)
    x, y = np.meshgrid(steps, steps)
    disc = np.hypot(x, y) <= reach
    return target.p_WT[:2] + np.column_stack([x[disc], y[disc]])


def _near(around: PlaceScores, free: FreeSpace) -> PlaceScores:
    """The places a step or less from free space."""
    near = free.distance(around.places) <= _SPACING
    return PlaceScores(
        around.places[near], around.q[near], around.objective[near]
    )


def _pick_starts(tried: PlaceScores) -> list[tuple[float, Array, Array]]:
    """The best of each way to bend the arm, and of places apart.

    The two wrists of one are as good as each other but for their limits.
    """
    value = np.where(np.isnan(tried.objective), np.inf, tried.objective)
    if np.isinf(value).all():
        return []
    order = np.argsort(value, axis=None, kind="stable")
    rows, branches = np.unravel_index(order, value.shape)
    best: list[tuple[float, Array, Array]] = []
    kept: list[tuple[Array, int]] = []
    limit = _HOPELESS * value[rows[0], branches[0]]
    for row, branch in zip(rows, branches, strict=True):
        if value[row, branch] > limit or len(best) == _STARTS:
            break
        place = tried.places[row]
        bend = branch // 2
        if all(b != bend or np.hypot(*(place - p)) >= _APART for p, b in kept):
            kept.append((place, bend))
            best.append(
                (float(value[row, branch]), place, tried.q[row, branch])
            )
    return best


def _improve(
    objective: PlacementObjective,
    target: ToolTarget,
    free: FreeSpace,
    start: Array,
    q_start: Array,
    heading: float | None,
) -> tuple[float, Array, Array] | None:
    """Objective, place and joints that the solver gets to, if they hold."""
    program = _StandProgram(objective, target, free, start, q_start, heading)
    place = program.solve()
    if not free.contains(place):
        return None
    scored = score_places(objective, target, place[None], heading)
    if np.isnan(scored.objective).all():
        return None
    return float(scored.best[0]), place, scored.best_q[0]


class _StandProgram:
    """Place, joints and absolute values of the Jacobian's elements."""

    def __init__(
        self,
        objective: PlacementObjective,
        target: ToolTarget,
        free: FreeSpace,
        start: Array,
        q_start: Array,
        heading: float | None,
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
        joints = program.NewContinuousVariables(_FREE_JOINTS, "q")
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
        low = arm.lower[:_FREE_JOINTS] + _MARGIN
        high = arm.upper[:_FREE_JOINTS] - _MARGIN
        # Past half a turn the closed form goes on at the other end.
        turns = _turns_freely(arm)
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
            np.maximum(corners[0] + _MARGIN, start - _MOVE),
            np.minimum(corners[1] - _MARGIN, start + _MOVE),
            self._place,
        )
        room = free.clearance + np.sqrt(2) * _MOVE
        for _, outline in free.obstacles_near(start, room):
            program.AddConstraint(
                _differentiated(_distance_to(outline)),
                [free.clearance + _MARGIN],
                [np.inf],
                vars=self._place,
            )
        program.SetInitialGuess(self._place, start)
        program.SetInitialGuess(joints, q_start[:_FREE_JOINTS])
        program.SetInitialGuess(sizes, np.abs(elements))
        self._program = program

    def solve(self) -> Array:
        """The place that the solver ends at, optimal or not, (2,)."""
        options = SolverOptions()
        for name, value in (
            ("Major iterations limit", 100),
            ("Major optimality tolerance", 1e-3),
            ("Major feasibility tolerance", 1e-8),
        ):
            options.SetOption(SnoptSolver.id(), name, value)
        result = SnoptSolver().Solve(self._program, None, options)
        place: Array = result.GetSolution(self._place)
        return place

    def cost(self, x: Array) -> tuple[Array, Array]:
        """(4.12) of joints and sizes (5 + n,), and its gradient."""
        p = self._objective.parameters
        q, sizes = _all_joints(x[:_FREE_JOINTS]), x[_FREE_JOINTS:]
        gradient = np.zeros(len(x))
        arm = self._objective.arm
        det = arm.singularity_determinants(q)
        slope = arm.singularity_determinants_derivative(q)[:, :_FREE_JOINTS]
        product = max(abs(float(det.prod())), 1e-12)
        sigma = p.singularity / product + 1
        sigma_slope = -(p.singularity / product) * (
            slope / np.where(det == 0, 1e-12, det)[:, None]
        ).sum(axis=0)
        value = 0.0
        # s of each axis is the sum of its row's sizes.
        s = sizes.reshape(2, 3, _FREE_JOINTS).sum(axis=-1)
        s[1] += self._last_axis
        for k, weight in enumerate((p.position_weight, p.attitude_weight)):
            length = float(np.linalg.norm(s[k]))
            value += weight * sigma * length
            gradient[:_FREE_JOINTS] += weight * length * sigma_slope
            part = weight * sigma * s[k] / max(length, 1e-12)
            at = _FREE_JOINTS + k * 3 * _FREE_JOINTS
            gradient[at : at + 3 * _FREE_JOINTS] = np.repeat(part, _FREE_JOINTS)
        torque, torque_slope = self._objective.torque_and_derivative(q)
        value += p.torque_weight * float(torque)
        gradient[:_FREE_JOINTS] += p.torque_weight * torque_slope[:_FREE_JOINTS]
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
        gradient = np.zeros((5, 2 + _FREE_JOINTS))
        gradient[:2, :2] = np.eye(2)
        gradient[:3, 2:] = J[:3]
        gradient[3:, 2:] = self._tangents @ (X_BT[:3, 0] @ _turning(J[3:].T)).T
        return error, gradient

    def size_excess(self, x: Array) -> tuple[Array, Array]:
        """Sizes less, and plus, the elements that they stand for."""
        sizes = x[_FREE_JOINTS:]
        elements, slope = self._elements(_all_joints(x[:_FREE_JOINTS]))
        gradient = np.empty((2 * len(sizes), len(x)))
        gradient[:, :_FREE_JOINTS] = np.vstack([-slope, slope])
        gradient[:, _FREE_JOINTS:] = self._each_size
        return np.concatenate([sizes - elements, sizes + elements]), gradient

    def _jacobian(self, q: Array) -> Array:
        """Of the joints that move, (6, 5); two constraints ask for each q."""
        if not np.array_equal(q, self._q):
            self._q = q
            self._J = self._objective.arm.jacobian(q)[:, :_FREE_JOINTS]
        return self._J

    def _elements(self, q: Array) -> tuple[Array, Array]:
        """Elements of (4.4), (4.5), row by row, and their derivatives.

        Returns:
            (30,) and (30, 5), over the joints that move.
        """
        n = _FREE_JOINTS
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


def _turns_freely(arm: ArmKinematics) -> NDArray[np.bool_]:
    """Which of the joints that move can be anywhere, (5,)."""
    span = (arm.upper - arm.lower)[:_FREE_JOINTS]
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


def _make_stand(
    objective: PlacementObjective,
    target: ToolTarget,
    free: FreeSpace,
    place: Array,
    q_W: Array,
    heading: float | None,
) -> tuple[Stand, str]:
    arm = objective.arm
    heading_given = heading is not None
    if heading is None:
        heading = float(np.arctan2(*(target.p_WT[:2] - place)[::-1]))
    waist, _ = waist_at(arm, q_W[0], heading)
    heading = float(wrap_angle(float(q_W[0] - waist)))
    q = np.concatenate([[waist], q_W[1:]])
    active = [
        f"the {_JOINT_NAMES[i]}'s {name} limit, {limit[i]:.3f} rad"
        for i in np.flatnonzero(~_turns_freely(arm))
        if i or heading_given
        for name, limit in (("lower", arm.lower), ("upper", arm.upper))
        if abs(q[i] - limit[i]) < _ACTIVE
    ]
    near = [
        f"{name}, {free.clearance:.2f} m away"
        for name, outline in free.obstacles_near(place, 2 * free.clearance)
        if signed_distance(outline, place)[0] < free.clearance + _ACTIVE
    ]
    active += near
    corners = np.reshape(free.polygon.bounds, (2, 2))
    if not near and np.abs(place - corners).min() < _ACTIVE:
        active.append("the edge of the map")
    scores = objective.scores(q_W)
    x, y = place
    line = (
        f"stand at ({x:.3f}, {y:.3f}) m, heading {np.rad2deg(heading):.0f} "
        f"deg, objective {float(scores.objective):.3f}, "
        + (f"held by {' and '.join(active)}" if active else "held by nothing")
    )
    return Stand(np.array([x, y, heading]), q, scores, tuple(active)), line


def _explain(
    objective: PlacementObjective, target: ToolTarget, around: PlaceScores
) -> str:
    """Why no place will do."""
    arm = objective.arm
    shoulder = ARM_BASE_HEIGHT + float(arm.shoulder[2])
    x, y, z = target.p_WT
    where = f"not reachable: the target at ({x:.2f}, {y:.2f}, {z:.2f}) m"
    if abs(z - shoulder) > arm.reach:
        side = "above" if z > shoulder else "below"
        return (
            f"{where} is {abs(z - shoulder):.2f} m {side} the shoulder, and "
            f"the arm reaches {arm.reach:.2f} m"
        )
    possible = int(np.sum(~np.isnan(around.best)))
    if not possible:
        approach = ", ".join(f"{a:.2f}" for a in target.a_W)
        rise = z - arm.hand * target.a_W[2] - shoulder
        side = "above" if rise > 0 else "below"
        return (
            f"{where} has no solution of the arm along ({approach}): the "
            f"wrist's centre would be {abs(rise):.2f} m {side} the shoulder, "
            f"and reaches {arm.reach - arm.hand:.2f} m"
        )
    return (
        f"{where} could be worked on from {possible} of "
        f"{len(around.places)} places around it, but none of them is free "
        "and open to the robot"
    )
