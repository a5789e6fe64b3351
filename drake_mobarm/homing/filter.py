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
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import at_least, not_negative, positive
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.homing.vector import vector_position
from drake_mobarm.immutable import Immutable
from drake_mobarm.sensors.beacon import (
    MIN_DISTANCE,
    BeaconNoise,
    distance_moments,
)


@dataclass(kw_only=True)
class FilterParameters:
    """Parameters of the filter; none is in the dissertation but 0.3 m.

    Attributes:
        angle_floor: least standard deviation of a bearing [rad], positive.
        distance_floor: least standard deviation of a distance [m], positive.
        drift: standard deviation of odometry after 1 m [m], growing with
            the root of the way, at least 0.
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
        p_WA: ArrayLike,
        bearing_W: float,
        distance: float,
    ) -> FilterState:
        """Takes in one reading.

        Args:
            state: before the reading; it is not changed.
            p_WA: the antenna's position by odometry [m], (2,).
            bearing_W: heading plus angle of arrival [rad].
            distance: from RSSI [m].

        Returns:
            The state after it: the same one where the reading is not finite
            or its distance is negative.
        """
        noise, parameters = self._noise, self._parameters
        p_WA = np.asarray(p_WA, dtype=float)
        finite = np.isfinite([*p_WA, bearing_W, distance]).all()
        if not finite or distance < 0:
            return state
        if state.position is None or state.covariance is None:
            return _start(p_WA, bearing_W, distance, noise, parameters)
        assert state.p_WA is not None
        moved = math.hypot(*(p_WA - state.p_WA))
        prior = state.covariance + np.eye(2) * parameters.drift**2 * moved
        predicted, slope, own = _predict(
            state.position, prior, p_WA, noise, parameters
        )
        innovation = np.array([bearing_W, distance]) - predicted
        innovation[0] = wrap_angle(innovation[0])
        precision = _inverse(slope @ prior @ slope.T + own)
        if innovation @ precision @ innovation > parameters.gate:
            if state.refused + 1 >= parameters.patience:
                return _start(p_WA, bearing_W, distance, noise, parameters)
            return replace(
                state, covariance=prior, p_WA=p_WA, refused=state.refused + 1
            )
        gain = prior @ slope.T @ precision
        # Joseph's form stays symmetric and positive.
        keep = np.eye(2) - gain @ slope
        return FilterState(
            position=state.position + gain @ innovation,
            covariance=keep @ prior @ keep.T + gain @ own @ gain.T,
            p_WA=p_WA,
        )

    def estimate(self, state: FilterState) -> Array | None:
        """The estimated target p_WT [m], (2,), or None before a reading."""
        return state.position

    def arrived(self, state: FilterState, p_WB: ArrayLike) -> bool:
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
        near = math.hypot(*(state.position - np.asarray(p_WB, dtype=float)))
        return (
            near <= self._parameters.arrival_distance
            and deviation(state) < self._parameters.arrival_deviation
        )


def deviation(state: FilterState) -> float:
    """The largest standard deviation of the estimate [m]; inf before one."""
    if state.covariance is None:
        return math.inf
    return math.sqrt(np.linalg.eigvalsh(state.covariance)[-1])


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
    position: Array,
    covariance: Array,
    p_WA: Array,
    noise: BeaconNoise,
    parameters: FilterParameters,
) -> tuple[Array, Array, Array]:
    """Mean, slope and own covariance of the reading that a belief predicts.

    The distance is linearised over the belief's whole width, by Gauss and
    Hermite's three points: a tangent is wrong where near readings clip.
    """
    dx, dy = position - p_WA
    d = max(math.hypot(dx, dy), MIN_DISTANCE)
    sight = np.array([dx, dy]) / d
    width = math.sqrt(max(float(sight @ covariance @ sight), 1e-8))
    points = d + width * math.sqrt(3) * np.array([-1.0, 0.0, 1.0])
    weights = np.array([1.0, 4.0, 1.0]) / 6
    moments = [distance_moments(abs(x), noise) for x in points]
    means, variances = np.array(moments).T
    mean = weights @ means
    rate = weights @ (means * (points - d)) / width**2
    predicted = np.array([math.atan2(dy, dx), mean])
    # A bearing's lever is as uncertain as the distance. With `d` alone, one
    # trial in some hundreds locks on to a wrong target near the antenna.
    lever = math.hypot(d, width)
    slope = np.array([[-sight[1] / lever, sight[0] / lever], rate * sight])
    own = np.diag(
        [
            _bearing_deviation(noise, parameters) ** 2,
            weights @ variances + parameters.distance_floor**2,
        ]
    )
    return predicted, slope, own


def _bearing_deviation(
    noise: BeaconNoise, parameters: FilterParameters
) -> float:
    """Of uniform noise, the half-width over the root of 3 [rad]."""
    return math.hypot(noise.angle / math.sqrt(3), parameters.angle_floor)


def _inverse(matrix: Array) -> Array:
    """Of a 2 x 2 matrix: ten times faster than np.linalg.inv."""
    (a, b), (c, d) = matrix.tolist()
    adjugate: Array = np.array([[d, -b], [-c, a]])
    inverse: Array = adjugate / (a * d - b * c)
    return inverse
