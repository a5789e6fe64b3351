"""A recursive bearing-and-range filter for a static target, ours.

An extended Kalman filter on the target's position. It differs from the hybrid
of section 2.3.1.3 in that each reading is weighted by its noise: a bearing and
a distance both tell more from near by. Two things keep the filter from
trusting its distances too early: it starts in the middle of all distances that
the first reading allows, and it linearises the distance over the width of its
belief. Iterating the update was tried; in configuration 5 it made the error
larger.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from drake_mobarm.checks import at_least, not_negative, positive
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.homing.vector import vector_position
from drake_mobarm.immutable import Immutable
from drake_mobarm.sensors.beacon import (
    MIN_DISTANCE,
    BeaconNoise,
    distance_moments,
)

Pair = tuple[float, float]
Matrix = tuple[Pair, Pair]
"""Of 2 x 2 numbers, by rows."""

_IDENTITY = ((1.0, 0.0), (0.0, 1.0))


@frozen
class FilterParameters:
    """Parameters of the filter; none is in the dissertation but 0.3 m.

    Attributes:
        angle_floor: least standard deviation of a bearing [rad], positive.
        distance_floor: least standard deviation of a distance [m], positive.
        drift: standard deviation of odometry, which grows with the root of
            the way [m/sqrt(m)], at least 0.
        gate: squared Mahalanobis distance [-] beyond which a reading is
            refused, positive; 13.8 is 99.9 % for two numbers.
        patience: refused readings in a row [-] after which the filter starts
            again, at least 1.
        arrival_distance: robot to estimate [m], positive.
        arrival_deviation: largest standard deviation at arrival [m],
            positive.
    """

    angle_floor: float = 0.01
    distance_floor: float = 0.01
    drift: float = 0.005
    gate: float = 13.8
    patience: int = 20
    arrival_distance: float = 0.3
    arrival_deviation: float = 0.035

    def __post_init__(self) -> None:
        positive(
            self,
            "angle_floor",
            "distance_floor",
            "gate",
            "arrival_distance",
            "arrival_deviation",
        )
        not_negative(self, "drift")
        at_least(self, 1, "patience")


@dataclass(frozen=True, kw_only=True, eq=False)
class FilterState(Immutable):
    """The filter's belief; position and p_WA are None before a reading.

    Attributes:
        position: the estimated target p_WT [m], (2,).
        covariance: of it [m^2], (2, 2).
        p_WA: where the last reading was taken [m], (2,).
        refused: readings refused in a row [-].
    """

    position: Array | None = None
    covariance: Array | None = None
    p_WA: Array | None = None
    refused: int = 0


class FilterEstimator:
    """Estimates the target by the filter; a `TargetLaw`.

    Args:
        parameters: of the filter.
        noise: of the readings.
    """

    def __init__(
        self, parameters: FilterParameters, noise: BeaconNoise
    ) -> None:
        self._parameters = parameters
        self._noise = noise

    def initial_state(self) -> FilterState:
        """The state before the first reading."""
        return FilterState()

    def update(
        self,
        state: FilterState,
        p_WA: Iterable[float],
        bearing_W: float,
        distance: float,
    ) -> FilterState:
        """The state after a reading, as `TargetLaw.update` has it."""
        noise, parameters = self._noise, self._parameters
        x, y = map(float, p_WA)
        finite = all(map(math.isfinite, (x, y, bearing_W, distance)))
        if not finite or distance < 0:
            return state
        p_WA = np.array([x, y])
        if state.position is None or state.covariance is None:
            return _start(p_WA, bearing_W, distance, noise, parameters)
        assert state.p_WA is not None
        last_x, last_y = state.p_WA.tolist()
        drift = parameters.drift**2 * math.hypot(x - last_x, y - last_y)
        prior = _plus(state.covariance.tolist(), _IDENTITY, drift)
        position_x, position_y = state.position.tolist()
        predicted, slope, own = _predict(
            (position_x - x, position_y - y), prior, noise, parameters
        )
        innovation = (
            wrap_angle(bearing_W - predicted[0]),
            distance - predicted[1],
        )
        across = _times(prior, _transposed(slope))
        precision = _inverse(_plus(_times(slope, across), own))
        if _dot(innovation, _apply(precision, innovation)) > parameters.gate:
            if state.refused + 1 >= parameters.patience:
                return _start(p_WA, bearing_W, distance, noise, parameters)
            return replace(
                state,
                covariance=np.array(prior),
                p_WA=p_WA,
                refused=state.refused + 1,
            )
        gain = _times(across, precision)
        # Joseph's form stays symmetric and positive.
        keep = _plus(_IDENTITY, _times(gain, slope), -1.0)
        kept = _times(_times(keep, prior), _transposed(keep))
        noisy = _times(_times(gain, own), _transposed(gain))
        return FilterState(
            position=state.position + _apply(gain, innovation),
            covariance=np.array(_plus(kept, noisy)),
            p_WA=p_WA,
        )

    def estimate(self, state: FilterState) -> Array | None:
        """The estimated target p_WT [m], (2,), or None before a reading."""
        return state.position

    def arrived(self, state: FilterState, p_WB: Iterable[float]) -> bool:
        """Whether the robot is at a target that the filter is sure of.

        Args:
            state: of the filter.
            p_WB: the base's position by odometry [m], (2,).

        Returns:
            True where the base is within `arrival_distance` of the estimate,
            and the largest standard deviation is below `arrival_deviation`.
        """
        if state.position is None:
            return False
        x, y = state.position.tolist()
        base_x, base_y = p_WB
        return (
            math.hypot(x - base_x, y - base_y)
            <= self._parameters.arrival_distance
            and deviation(state) < self._parameters.arrival_deviation
        )


def deviation(state: FilterState) -> float:
    """The largest standard deviation of the estimate [m]; inf before one."""
    if state.covariance is None:
        return math.inf
    (xx, xy), (_, yy) = state.covariance.tolist()
    # The larger eigenvalue of a symmetric 2 x 2 matrix.
    return math.sqrt((xx + yy) / 2 + math.hypot((xx - yy) / 2, xy))


def _start(
    p_WA: Array,
    bearing_W: float,
    distance: float,
    noise: BeaconNoise,
    parameters: FilterParameters,
) -> FilterState:
    """A belief from one reading, as wide as the target may be far."""
    nearest = (distance - noise.absolute_distance) / (
        1 + noise.relative_distance
    )
    farthest = (distance + noise.absolute_distance) / (
        1 - noise.relative_distance
    )
    middle = (max(nearest, 0.0) + farthest) / 2
    along = farthest - middle + parameters.distance_floor
    across = farthest * _bearing_deviation(noise, parameters)
    c, s = math.cos(bearing_W), math.sin(bearing_W)
    axes = np.array([[c, -s], [s, c]])
    return FilterState(
        position=vector_position(p_WA, bearing_W, middle),
        covariance=axes @ np.diag([along**2, across**2]) @ axes.T,
        p_WA=p_WA,
    )


def _predict(
    p_AT: Pair,
    covariance: Matrix,
    noise: BeaconNoise,
    parameters: FilterParameters,
) -> tuple[Pair, Matrix, Matrix]:
    """Mean, slope and own covariance of the reading that a belief predicts.

    The distance is linearised over the belief's whole width, by Gauss and
    Hermite's three points: a tangent is wrong where near readings clip.
    """
    dx, dy = p_AT
    d = max(math.hypot(dx, dy), MIN_DISTANCE)
    sight = dx / d, dy / d
    width = math.sqrt(max(_dot(sight, _apply(covariance, sight)), 1e-8))
    offset = math.sqrt(3) * width
    (near, near_variance), (middle, middle_variance), (far, far_variance) = (
        distance_moments(abs(x), noise) for x in (d - offset, d, d + offset)
    )
    mean = (near + 4 * middle + far) / 6
    variance = (near_variance + 4 * middle_variance + far_variance) / 6
    rate = (far - near) / (2 * offset)
    # A bearing's lever is as uncertain as the distance. With `d` alone, one
    # trial in some hundreds locks on to a wrong target near the antenna.
    lever = math.hypot(d, width)
    slope = (
        (-sight[1] / lever, sight[0] / lever),
        (rate * sight[0], rate * sight[1]),
    )
    own = (
        (_bearing_deviation(noise, parameters) ** 2, 0.0),
        (0.0, variance + parameters.distance_floor**2),
    )
    return (math.atan2(dy, dx), mean), slope, own


def _bearing_deviation(
    noise: BeaconNoise, parameters: FilterParameters
) -> float:
    """Of uniform noise, the half-width over the root of 3 [rad]."""
    return math.hypot(noise.angle / math.sqrt(3), parameters.angle_floor)


# Products of two numbers and of 2 x 2 matrices: far faster than numpy's.


def _dot(u: Pair, v: Pair) -> float:
    return u[0] * v[0] + u[1] * v[1]


def _apply(matrix: Matrix, v: Pair) -> Pair:
    (a, b), (c, d) = matrix
    x, y = v
    return a * x + b * y, c * x + d * y


def _plus(left: Matrix, right: Matrix, factor: float = 1.0) -> Matrix:
    """Left + factor * right."""
    (a, b), (c, d) = left
    (e, f), (g, h) = right
    return (
        (a + factor * e, b + factor * f),
        (c + factor * g, d + factor * h),
    )


def _times(left: Matrix, right: Matrix) -> Matrix:
    (a, b), (c, d) = left
    (e, f), (g, h) = right
    return (a * e + b * g, a * f + b * h), (c * e + d * g, c * f + d * h)


def _transposed(matrix: Matrix) -> Matrix:
    (a, b), (c, d) = matrix
    return (a, c), (b, d)


def _inverse(matrix: Matrix) -> Matrix:
    (a, b), (c, d) = matrix
    determinant = a * d - b * c
    return (
        (d / determinant, -b / determinant),
        (-c / determinant, a / determinant),
    )
