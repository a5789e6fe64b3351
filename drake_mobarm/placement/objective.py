"""How good a place to work from is: sections 4.3.1 and 4.3.2."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array
from drake_mobarm.robot.arm_kinematics import ArmKinematics

# The torque score of a joint grows linearly from this near its limit [N m].
_LIMIT_MARGIN = 0.01
_WEIGHTS = "0, or 1e-6 to 1e6"


@dataclass(kw_only=True)
class ObjectiveParameters:
    """What counts, and how much.

    The dissertation gives no figures. These weights make the three parts of
    like size over the WidowX's workspace: over joint positions drawn evenly
    their medians are 0.7, 0.9 and 0.8.

    Attributes:
        torque_weight: w_t [1/(N m)], (4.12).
        position_weight: w_p [1/m], (4.12).
        attitude_weight: w_r [-], (4.12).
        torque_shape: a of each joint [N m], (4.2), its torque limit or more;
            empty for the torque limits themselves.
        singularity: b [m^3], (4.9).
        position_axes: roll, pitch, yaw in W of the axes along which the
            tip's sensitivity counts [rad].
        position_axis_weights: of those axes, relative to each other.
        attitude_axes: the same for the sensitivity of its attitude [rad].
        attitude_axis_weights: of those axes, relative to each other.
        payload: mass at the tool's tip [kg].
    """

    torque_weight: float = 1.0
    position_weight: float = 1.0
    attitude_weight: float = 0.25
    torque_shape: list[float] = field(default_factory=list)
    singularity: float = 0.001
    position_axes: list[float] = field(default_factory=lambda: [0.0] * 3)
    position_axis_weights: list[float] = field(
        default_factory=lambda: [1.0] * 3
    )
    attitude_axes: list[float] = field(default_factory=lambda: [0.0] * 3)
    attitude_axis_weights: list[float] = field(
        default_factory=lambda: [1.0] * 3
    )
    payload: float = 0.0

    def __post_init__(self) -> None:
        weights = ("torque_weight", "position_weight", "attitude_weight")
        for name in (*weights, "singularity", "payload"):
            value = getattr(self, name)
            require(_is_weight(value), name, value, _WEIGHTS)
        require(
            any(getattr(self, name) > 0 for name in weights),
            "torque_weight",
            self.torque_weight,
            "above 0 where position_weight and attitude_weight are 0",
        )
        for name in ("position_axes", "attitude_axes"):
            value = getattr(self, name)
            require(
                len(value) == 3 and bool(np.isfinite(value).all()),
                name,
                value,
                "[roll, pitch, yaw], finite, in rad",
            )
        for name in ("position_axis_weights", "attitude_axis_weights"):
            value = getattr(self, name)
            require(
                len(value) == 3
                and all(_is_weight(x) for x in value)
                and any(x > 0 for x in value),
                name,
                value,
                f"three numbers, not all 0, each {_WEIGHTS}",
            )
        require(
            all(0 < a < np.inf for a in self.torque_shape),
            "torque_shape",
            self.torque_shape,
            "one a joint, each its torque limit or more, or empty",
        )


@dataclass(frozen=True)
class Scores:
    """The parts of the objective, each of the batch's shape.

    Attributes:
        torque: T [N m], (4.3).
        position: S_p [m/rad], (4.10).
        attitude: S_r [-], (4.11).
        singularity: sigma [-], (4.9), which is in `position` and `attitude`.
        objective: j [-], (4.12).
        load: largest holding torque of a joint over its limit [-]; above 1
            the arm cannot hold itself.
    """

    torque: Array
    position: Array
    attitude: Array
    singularity: Array
    objective: Array
    load: Array


def torque_score(torque: ArrayLike, limit: ArrayLike, a: ArrayLike) -> Array:
    """How much a joint's holding torque counts [N m], (4.2).

    Args:
        torque: tau [N m], any shape.
        limit: r, the joint's torque limit [N m], broadcast against it.
        a: shape of the curve [N m], the limit or more.

    Returns:
        t, never negative: zero at rest, growing faster and faster up to the
        limit, and on by about 100 a for each N m: a large score, but no bar
        (`score_places` leaves out what the motors cannot hold).

    Raises:
        ParameterError: a is below the limit, where (4.2) would be negative
            and call a larger torque better.
    """
    size, r, a = (np.asarray(x, dtype=float) for x in (torque, limit, a))
    _require_shape(a, r)
    size = np.abs(size)
    t: Array = -size * (a / (np.minimum(size, r - _LIMIT_MARGIN) - r) + 1)
    return t


def torque_score_derivative(
    torque: ArrayLike, limit: ArrayLike, a: ArrayLike
) -> Array:
    """Derivative of `torque_score` by the torque [-].

    With a above the limit the score has a corner at zero; there this is 0.
    """
    tau, r, a = (np.asarray(x, dtype=float) for x in (torque, limit, a))
    size = np.abs(tau)
    room = r - np.minimum(size, r - _LIMIT_MARGIN)
    bend = np.where(size < r - _LIMIT_MARGIN, size / room**2, 0.0)
    slope: Array = np.sign(tau) * (a / room - 1 + a * bend)
    return slope


def sensitivities(J: ArrayLike, R_WA: ArrayLike, weights: ArrayLike) -> Array:
    """How far all joints together move the tip along axes: (4.4) to (4.7).

    Args:
        J: three rows of the Jacobian in W, (..., 3, n).
        R_WA: the axes, (3, 3), a column each.
        weights: of the axes, (3,), normalised here to length 1.

    Returns:
        s, (..., 3), one an axis: the sum over a row's absolute values.
    """
    return _row_sums(_axis_matrix(R_WA, weights), np.asarray(J))


def singularity_factor(determinants: ArrayLike, b: float) -> Array:
    """The factor sigma [-], (4.9), infinite at a singularity.

    Args:
        determinants: det J11, det J22 at the wrist's centre, (..., 2).
        b: how far from a singularity it counts [m^3].
    """
    product = np.abs(np.prod(np.asarray(determinants), axis=-1))
    with np.errstate(divide="ignore", invalid="ignore"):
        sigma: Array = np.where(b == 0, 1.0, b / product + 1)
    return sigma


class PlacementObjective:
    """The objective (4.12) of an arm's joint positions, and its derivative.

    The base stands with its axes along W's: for another heading, add it to
    the waist's position.

    Args:
        arm: whose joints.
        parameters: what counts.

    Raises:
        ParameterError: `torque_shape` does not fit the arm.
    """

    def __init__(
        self, arm: ArmKinematics, parameters: ObjectiveParameters
    ) -> None:
        self.arm = arm
        self.parameters = p = parameters
        a = np.array(p.torque_shape or arm.torque_limit)
        require(
            a.shape == arm.torque_limit.shape,
            "torque_shape",
            p.torque_shape,
            f"{len(arm.torque_limit)} numbers, or empty",
        )
        _require_shape(a, arm.torque_limit)
        self._a = a
        self.position_axes = _axis_matrix(
            _rotation(p.position_axes), p.position_axis_weights
        )
        self.attitude_axes = _axis_matrix(
            _rotation(p.attitude_axes), p.attitude_axis_weights
        )

    def scores(self, q: ArrayLike) -> Scores:
        """The parts of the objective; NaN where q is.

        Args:
            q: joint positions [rad], (..., 6).
        """
        p = self.parameters
        limit = self.arm.torque_limit
        tau = self.arm.holding_torque(q, p.payload)
        T = torque_score(tau, limit, self._a).sum(axis=-1)
        load = np.max(np.abs(tau) / limit, axis=-1)
        sigma = singularity_factor(
            self.arm.singularity_determinants(q), p.singularity
        )
        J = self.arm.jacobian(q)
        lengths = [
            np.linalg.norm(_row_sums(axes, rows), axis=-1)
            for axes, rows in (
                (self.position_axes, J[..., :3, :]),
                (self.attitude_axes, J[..., 3:, :]),
            )
        ]
        S_p, S_r = (sigma * length for length in lengths)
        j = p.torque_weight * T
        # At a singularity a score is infinite, which no weight of 0 undoes.
        for weight, score in (
            (p.position_weight, S_p),
            (p.attitude_weight, S_r),
        ):
            if weight:
                j = j + weight * score
        return Scores(T, S_p, S_r, sigma, j, load)

    def torque_and_derivative(self, q: ArrayLike) -> tuple[Array, Array]:
        """T [N m], (...), (4.3), and its derivative by the joints.

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            T [N m], (...), and [N m/rad], (..., 6).
        """
        tau, stiffness = self.arm.holding_torque_and_derivative(
            q, self.parameters.payload
        )
        limit = self.arm.torque_limit
        score = torque_score(tau, limit, self._a)
        slope = torque_score_derivative(tau, limit, self._a)
        return score.sum(axis=-1), (slope[..., None, :] @ stiffness)[..., 0, :]


def _is_weight(value: float) -> bool:
    return value == 0 or 1e-6 <= value <= 1e6


def _require_shape(a: Array, limit: Array) -> None:
    require(
        bool(np.all(a >= limit)),
        "torque_shape",
        np.asarray(a).tolist(),
        f"each its joint's torque limit or more, {np.asarray(limit).tolist()}",
    )


def _axis_matrix(R_WA: ArrayLike, weights: ArrayLike) -> Array:
    """diag(w) R_AW of (4.4), (4.5), w normalised."""
    w = np.asarray(weights, dtype=float)
    matrix: Array = (w / np.linalg.norm(w))[:, None] * np.transpose(R_WA)
    return matrix


def _row_sums(axes: Array, J: Array) -> Array:
    """(4.6), (4.7), of rows of a Jacobian (..., 3, n) along `axes` (3, 3)."""
    s: Array = np.abs(axes @ J).sum(axis=-1)
    return s


def _rotation(roll_pitch_yaw: list[float]) -> Array:
    (cr, cp, cy), (sr, sp, sy) = np.cos(roll_pitch_yaw), np.sin(roll_pitch_yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
