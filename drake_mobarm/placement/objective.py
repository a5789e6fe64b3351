"""The objective: how well an arm can work as its joints are (4.3.1, 4.3.2)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import finite_numbers, positive_numbers, require
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.robot.arm_kinematics import ArmKinematics

# From this far below its limit a joint's torque score is linear [N m].
_LIMIT_MARGIN = 0.01
_WEIGHTS = "0, or 1e-6 to 1e6"


@frozen
class ObjectiveParameters:
    """Weights and other figures of the objective (4.12).

    The dissertation gives no figures. With the default weights the three
    parts are of similar magnitude for the WidowX: over joint positions drawn
    evenly their medians are 0.7, 0.9 and 0.8.

    Attributes:
        torque_weight: w_t [1/(N m)], (4.12).
        position_weight: w_p [1/m], (4.12).
        attitude_weight: w_r [-], (4.12).
        torque_shape: a of each joint [N m], (4.2), its torque limit or more;
            empty for the torque limits themselves.
        singularity: b [m^3], (4.9).
        position_axes: roll, pitch, yaw in W of the axes along which the
            sensitivity of the tip's position is measured [rad].
        position_axis_weights: of these axes, relative to each other.
        attitude_axes: roll, pitch, yaw in W of the axes about which the
            sensitivity of the tool's attitude is measured [rad].
        attitude_axis_weights: of these axes, relative to each other.
        payload: mass at the tip of the tool [kg].

    Raises:
        ParameterError: a value is out of its range.
    """

    torque_weight: float = 1.0
    position_weight: float = 1.0
    attitude_weight: float = 0.25
    torque_shape: tuple[float, ...] = ()
    singularity: float = 0.001
    position_axes: tuple[float, ...] = (0.0, 0.0, 0.0)
    position_axis_weights: tuple[float, ...] = (1.0, 1.0, 1.0)
    attitude_axes: tuple[float, ...] = (0.0, 0.0, 0.0)
    attitude_axis_weights: tuple[float, ...] = (1.0, 1.0, 1.0)
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
        finite_numbers(
            self, "[roll, pitch, yaw] in rad", "position_axes", "attitude_axes"
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
        # Their number and least values are checked where the arm is known.
        positive_numbers(self, len(self.torque_shape), "torque_shape")


@dataclass(frozen=True, eq=False)
class Scores:
    """The parts of the objective, each of the batch's shape.

    Attributes:
        torque: T [N m], (4.3).
        position: S_p [m/rad], (4.10).
        attitude: S_r [-], (4.11).
        singularity: sigma [-], (4.9), a factor of `position` and `attitude`.
        objective: j [-], (4.12).
        load: largest ratio of a joint's holding torque to its limit [-];
            above 1 the motors cannot hold the arm.
    """

    torque: Array
    position: Array
    attitude: Array
    singularity: Array
    objective: Array
    load: Array


def torque_score(torque: ArrayLike, limit: ArrayLike, a: ArrayLike) -> Array:
    """The score of a joint's holding torque [N m], (4.2).

    Args:
        torque: tau [N m], any shape.
        limit: r, the torque limit of the joint [N m], broadcast against
            `torque`.
        a: shape of the curve [N m], the limit or more.

    Returns:
        t, 0 or more: zero without torque, growing ever faster up to the limit,
        and beyond it linearly by about 100 a for each N m. A torque beyond the
        limit is no error here; `score_places` leaves it out.

    Raises:
        ParameterError: a is below the limit; (4.2) would then be negative for
            small torques and prefer a larger one.
    """
    tau, r, a = (np.asarray(x, dtype=float) for x in (torque, limit, a))
    _require_shape(a, r)
    tau = np.abs(tau)
    t: Array = -tau * (a / (np.minimum(tau, r - _LIMIT_MARGIN) - r) + 1)
    return t


def torque_score_derivative(
    torque: ArrayLike, limit: ArrayLike, a: ArrayLike
) -> Array:
    """The derivative of `torque_score` with respect to the torque [-].

    Where a is above the limit, the score is not differentiable at zero torque;
    the value there is 0.
    """
    tau, r, a = (np.asarray(x, dtype=float) for x in (torque, limit, a))
    magnitude = np.abs(tau)
    room = r - np.minimum(magnitude, r - _LIMIT_MARGIN)
    bend = np.where(magnitude < r - _LIMIT_MARGIN, magnitude / room**2, 0.0)
    slope: Array = np.sign(tau) * (a / room - 1 + a * bend)
    return slope


def sensitivities(J: ArrayLike, R_WA: ArrayLike, weights: ArrayLike) -> Array:
    """The sensitivity of the tool along some axes: (4.4) to (4.7).

    Args:
        J: rows of the Jacobian in W for the position [m/rad] or the attitude
            [-], (..., 3, n).
        R_WA: the axes, (3, 3), one in each column.
        weights: of the axes, (3,), normalised here to length 1.

    Returns:
        s, (..., 3), in the unit of J: for each axis the sum of the absolute
        values of the joints' elements.
    """
    return _row_sums(_axis_matrix(R_WA, weights), np.asarray(J))


def singularity_factor(determinants: ArrayLike, b: float) -> Array:
    """The factor sigma [-], (...), of (4.9), infinite at a singularity.

    Args:
        determinants: det J11 [m^3] and det J22 [-] at the wrist's centre,
            (..., 2).
        b: magnitude of their product at which sigma is 2 [m^3].
    """
    product = np.abs(np.prod(np.asarray(determinants), axis=-1))
    with np.errstate(divide="ignore", invalid="ignore"):
        sigma: Array = np.where(b == 0, 1.0, b / product + 1)
    return sigma


class PlacementObjective:
    """The objective (4.12) of joint positions of an arm.

    The axes of the base are along those of W; another heading is added to the
    position of the waist.

    Args:
        arm: the arm.
        parameters: weights and other figures.

    Raises:
        ParameterError: `torque_shape` does not fit the arm.

    Attributes:
        arm: the arm.
        parameters: weights and other figures.
        position_axes: diag(w) R_AW of (4.4), (3, 3).
        attitude_axes: diag(w) R_AW of (4.5), (3, 3).
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
        # At a singularity a score is infinite, and 0 times it would be NaN.
        for weight, score in (
            (p.position_weight, S_p),
            (p.attitude_weight, S_r),
        ):
            if weight:
                j = j + weight * score
        return Scores(T, S_p, S_r, sigma, j, load)

    def torque_and_derivative(self, q: ArrayLike) -> tuple[Array, Array]:
        """T of (4.3) and its derivative with respect to the joint positions.

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            T [N m], (...), and its derivative [N m/rad], (..., 6).
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
    """diag(w) R_AW of (4.4), (4.5), with w normalised, (3, 3)."""
    w = np.asarray(weights, dtype=float)
    matrix: Array = (w / np.linalg.norm(w))[:, None] * np.transpose(R_WA)
    return matrix


def _row_sums(axes: Array, J: Array) -> Array:
    """(4.6), (4.7): s, (..., 3), of rows J (..., 3, n) and axes (3, 3)."""
    s: Array = np.abs(axes @ J).sum(axis=-1)
    return s


def _rotation(roll_pitch_yaw: Sequence[float]) -> Array:
    (cr, cp, cy), (sr, sp, sy) = np.cos(roll_pitch_yaw), np.sin(roll_pitch_yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
