"""A robust fit of a target to many readings, of their noise and gain with it.

The target does not move, so that all readings of the last seconds tell of the
same place, and each step may weigh every one of them anew. Unknown are the
target's position, the gain of the distances (strength may tell all of them too
long or too short by one factor) and three variances of the noise. A reading's
errors have Student's t-distribution: a wild one hardly counts.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drake_mobarm.geometry import Array
from drake_mobarm.immutable import Immutable
from drake_mobarm.sensors.beacon import (
    BeaconNoise,
    distance_moments,
)

X, Y, BEARING, DISTANCE, WAY = range(5)
"""A reading's columns: the antenna's position p_WA [m, m], the bearing in W
[rad], the distance by strength [m], the way driven until then [m]."""

# Degrees of freedom of the t-distribution. With 5 an error of three standard
# deviations counts less than half, and bounded noise loses almost nothing.
_FREEDOM = 5.0
# Least standard deviations: of a bearing [rad], of a distance [m], and of the
# antenna's position [m], which bounds what a bearing from near by tells.
_ANGLE_FLOOR = 0.01
_DISTANCE_FLOOR = 0.01
_PLACE_FLOOR = 0.02
# The noise to begin with counts as so many readings.
_PRIOR_READINGS = 3.0
# These [m] stand for the distances of such readings.
_PRIOR_DISTANCES = np.array([0.5, 2.0, 6.0])
# Standard deviation of the gain's logarithm before any reading, and its limit.
_LOG_GAIN_DEVIATION = 0.5
_LOG_GAIN_LIMIT = 6.0
# Of a position before any reading [m]: it keeps every step solvable.
_FAR = 50.0
# The noise of distances moves this share of the way to its newest value.
_NOISE_STEP = 0.3
# Variance of a clipped distance, at least as a share of the unclipped one.
_CLIPPED_SHARE = 0.02


class Noise(NamedTuple):
    """Variances of readings.

    Attributes:
        bearing: of a bearing [rad^2].
        relative: of a distance, as a fraction of it [-].
        absolute: of a distance [m^2], added to the relative one.
    """

    bearing: float
    relative: float
    absolute: float

    @classmethod
    def of(cls, noise: BeaconNoise) -> "Noise":
        """Those of uniform noise of these half-widths."""
        return cls(
            noise.angle**2 / 3,
            noise.relative_distance**2 / 3,
            noise.absolute_distance**2 / 3,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit(Immutable):
    """What explains the readings best, as far as it is found.

    Attributes:
        target: p_WT [m], (2,).
        log_gain: logarithm of what strength tells over the true distance [-].
        noise: of the readings.
        deviation: largest standard deviation of the target [m].
        axis: the direction in W that bearings alone tell least about [rad].
        surprise: mean squared error of each reading's bearing over its
            variance, that of the target included [-], (n,).
    """

    target: Array
    log_gain: float
    noise: Noise
    deviation: float
    axis: float
    surprise: Array


def first_fit(readings: Array, noise: Noise) -> Fit:
    """Begins at the median of the places that the readings tell.

    Args:
        readings: at least one, (n, 5).
        noise: to begin with.
    """
    bearing = readings[:, BEARING]
    sight = np.column_stack([np.cos(bearing), np.sin(bearing)])
    places = readings[:, :2] + readings[:, DISTANCE, None] * sight
    return Fit(
        target=np.median(places, axis=0),
        log_gain=0.0,
        noise=noise,
        deviation=1.0,
        axis=float(bearing[-1]),
        surprise=np.zeros(len(readings)),
    )


def refine(readings: Array, fit: Fit, prior: Noise, drift: float) -> Fit:
    """One step of Gauss and Newton with weights and noise found anew.

    Args:
        readings: newest last, (n, 5).
        fit: from the step before.
        prior: the noise that one begins with.
        drift: of odometry [m/sqrt(m)].
    """
    bearing, read = readings[:, BEARING], readings[:, DISTANCE]
    dx, dy = (fit.target - readings[:, :2]).T
    squares = np.maximum(dx * dx + dy * dy, 1e-6)
    d = np.sqrt(squares)
    sight_x, sight_y = dx / d, dy / d
    drifted = drift**2 * (readings[-1, WAY] - readings[:, WAY])
    own = min(fit.deviation, 1.0) ** 2
    # A bearing's lever is as uncertain as the distance.
    levers = squares + own
    bearing_errors = _turn(bearing - np.arctan2(dy, dx))
    bearing_variance = fit.noise.bearing + _ANGLE_FLOOR**2 + drifted / levers
    gain = math.exp(fit.log_gain)
    told = gain * d
    unclipped = _distance_variance(told, fit.noise, drifted)
    mean, variance, slope = _moments(told, unclipped)
    errors = read - mean
    slope = slope * gain

    near = squares / levers
    bearing_squares = bearing_errors**2
    error_squares = errors**2
    # Weights of the t-distribution, over the variances.
    bearing_weights = _weights(near * bearing_squares / bearing_variance)
    weights = _weights(error_squares / variance)
    across = bearing_weights / (bearing_variance * levers)
    push = across * np.sqrt(levers) * bearing_errors
    along = weights / variance * slope
    pull = along * errors
    along = along * slope

    sight_xx, sight_yy = sight_x * sight_x, sight_y * sight_y
    sight_xy = sight_x * sight_y
    across_xx, across_yy = float(across @ sight_yy), float(across @ sight_xx)
    across_xy = -float(across @ sight_xy)
    xx = across_xx + along @ sight_xx + _FAR**-2
    yy = across_yy + along @ sight_yy + _FAR**-2
    xy = across_xy + along @ sight_xy
    x_gain, y_gain = along @ dx, along @ dy
    gain_gain = along @ squares + _LOG_GAIN_DEVIATION**-2
    covariance = np.linalg.inv(
        np.array(
            [
                [xx, xy, x_gain],
                [xy, yy, y_gain],
                [x_gain, y_gain, gain_gain],
            ]
        )
    )
    step_x, step_y, step_gain = (
        covariance
        @ (
            pull @ sight_x - push @ sight_y,
            pull @ sight_y + push @ sight_x,
            pull @ d - fit.log_gain / _LOG_GAIN_DEVIATION**2,
        )
    ).tolist()
    # A long step leaves where the slopes hold.
    share = min(
        1.0,
        max(0.5, 0.5 * float(d[-1])) / max(math.hypot(step_x, step_y), 1e-12),
    )
    log_gain = fit.log_gain + min(max(share * step_gain, -0.5), 0.5)
    return Fit(
        target=fit.target + share * np.array([step_x, step_y]),
        log_gain=min(max(log_gain, -_LOG_GAIN_LIMIT), _LOG_GAIN_LIMIT),
        noise=Noise(
            _bearing_noise(bearing_weights * bearing_squares, near, fit, prior),
            *_distance_noise(
                weights * error_squares * unclipped / variance,
                told,
                unclipped,
                fit.noise,
                prior,
            ),
        ),
        deviation=_largest_deviation(covariance),
        axis=math.atan2(-2 * across_xy, across_yy - across_xx) / 2,
        surprise=bearing_squares / (bearing_variance + own / levers),
    )


def log_likelihoods(
    readings: Array, fit: Fit, places: Array, drift: float
) -> tuple[Array, Array]:
    """How well places explain the readings, each with the gain best for it.

    Args:
        readings: newest last, (n, 5).
        fit: whose noise is taken for the readings'.
        places: p_WP [m], (m, 2).
        drift: of odometry [m/sqrt(m)].

    Returns:
        Logarithms, but for a constant, of the bearings and of the distances,
        (m,) each.
    """
    drifted = drift**2 * (readings[-1, WAY] - readings[:, WAY])
    read = readings[:, DISTANCE]
    dx, dy, squares = _from_antennas(readings, places)
    of_bearings = _log_density(
        _turn(readings[:, BEARING] - np.arctan2(dy, dx)),
        _bearing_variance(squares, fit.noise, drifted),
    )
    d = np.sqrt(squares)
    told = math.exp(fit.log_gain) * d
    weights = 1 / _distance_variance(told, fit.noise, drifted)
    # Least squares, with the prior of the gain as one more reading.
    gain = (weights * d) @ read + _LOG_GAIN_DEVIATION**-2
    gain /= (weights * squares).sum(axis=1) + _LOG_GAIN_DEVIATION**-2
    limit = math.exp(_LOG_GAIN_LIMIT)
    gain = np.minimum(np.maximum(gain, 1 / limit), limit)
    told = gain[:, None] * d
    mean, variance, _ = _moments(
        told, _distance_variance(told, fit.noise, drifted)
    )
    unlikely = (np.log(gain) / _LOG_GAIN_DEVIATION) ** 2 / 2
    return of_bearings, _log_density(read - mean, variance) - unlikely


def slide(
    readings: Array, fit: Fit, places: Array, across: Array, drift: float
) -> Array:
    """Moves places along a line to where they explain the bearings better.

    Args:
        readings: newest last, (n, 5).
        fit: whose noise is taken for the readings'.
        places: p_WP [m], (m, 2).
        across: unit vector of the line's direction, (2,).
        drift: of odometry [m/sqrt(m)].

    Returns:
        Places after a step of Gauss and Newton each, (m, 2).
    """
    drifted = drift**2 * (readings[-1, WAY] - readings[:, WAY])
    dx, dy, squares = _from_antennas(readings, places)
    errors = _turn(readings[:, BEARING] - np.arctan2(dy, dx))
    variance = _bearing_variance(squares, fit.noise, drifted)
    slope = (dx * across[1] - dy * across[0]) / squares
    weighted = slope * _weights(errors**2 / variance) / variance
    step = (weighted * errors).sum(axis=1) / (weighted * slope).sum(axis=1)
    moved: Array = places + step[:, None] * across
    return moved


def _from_antennas(
    readings: Array, places: Array
) -> tuple[Array, Array, Array]:
    """From each reading's antenna to each place: x, y, and their squares."""
    dx = places[:, :1] - readings[:, X]
    dy = places[:, 1:] - readings[:, Y]
    return dx, dy, np.maximum(dx * dx + dy * dy, 1e-6)


def _bearing_variance(squares: Array, noise: Noise, drifted: Array) -> Array:
    """Of a bearing [rad^2], by the squared distance of what is seen [m^2]."""
    variance: Array = (
        noise.bearing
        + _ANGLE_FLOOR**2
        + (drifted + _PLACE_FLOOR**2) / (squares + _PLACE_FLOOR**2)
    )
    return variance


def _turn(angle: Array) -> Array:
    """Angles [rad] as the shorter turn; faster than `wrap_angle`."""
    turned: Array = angle - 2 * np.pi * np.rint(angle / (2 * np.pi))
    return turned


def _weights(squares: Array) -> Array:
    """Of the t-distribution, by squared errors over their variances."""
    weights: Array = (_FREEDOM + 1) / (_FREEDOM + squares)
    return weights


def _log_density(errors: Array, variance: Array) -> Array:
    """Of the t-distribution, summed over the readings, the last axis."""
    squares = errors**2 / (_FREEDOM * variance)
    densities = (_FREEDOM + 1) * np.log1p(squares) + np.log(variance)
    logarithms: Array = -0.5 * densities.sum(axis=-1)
    return logarithms


def _distance_variance(told: Array, noise: Noise, drifted: Array) -> Array:
    """Of a distance before it is clipped [m^2]."""
    variance: Array = (
        noise.relative * told**2
        + (noise.absolute + _DISTANCE_FLOOR**2)
        + drifted
    )
    return variance


def _moments(told: Array, unclipped: Array) -> tuple[Array, Array, Array]:
    """Mean, variance and slope of the distances that are read."""
    mean, variance, slope = distance_moments(told, np.sqrt(3 * unclipped))
    return mean, np.maximum(variance, _CLIPPED_SHARE * unclipped), slope


def _bearing_noise(
    squares: Array, near: Array, fit: Fit, prior: Noise
) -> float:
    """The variance of bearings: the mean of their weighted squared errors.

    The prior counts less the smaller the noise is found to be than it.
    """
    count = _PRIOR_READINGS * min(1.0, fit.noise.bearing / prior.bearing) ** 2
    total = count * prior.bearing + float(near @ squares)
    return total / (count + float(near.sum()))


def _distance_noise(
    squares: Array, told: Array, variance: Array, noise: Noise, prior: Noise
) -> tuple[float, float]:
    """Relative and absolute variance: a line through the squared errors.

    Least squares of relative * told^2 + absolute, neither below 0. A squared
    error varies as the square of its own variance.
    """
    weights = variance**-2
    lengths = told**2
    tilted = weights * lengths
    own = _PRIOR_DISTANCES**2
    expected = prior.relative * own + prior.absolute
    found = noise.relative * own + noise.absolute
    own_weights = _PRIOR_READINGS / len(own) * np.maximum(expected, found) ** -2
    own_tilted = own_weights * own
    a = float(tilted @ lengths + own_tilted @ own)
    b = float(tilted.sum() + own_tilted.sum())
    c = float(weights.sum() + own_weights.sum())
    p = float(tilted @ squares + own_tilted @ expected)
    q = float(weights @ squares + own_weights @ expected)
    determinant = a * c - b * b
    relative = (p * c - q * b) / determinant
    absolute = (a * q - b * p) / determinant
    if relative < 0:
        relative, absolute = 0.0, q / c
    elif absolute < 0:
        relative, absolute = p / a, 0.0
    return (
        noise.relative + _NOISE_STEP * (relative - noise.relative),
        noise.absolute + _NOISE_STEP * (absolute - noise.absolute),
    )


def _largest_deviation(covariance: Array) -> float:
    """Of a position [m], by the larger eigenvalue of its covariance."""
    (xx, xy, _), (_, yy, _), _ = covariance.tolist()
    return math.sqrt((xx + yy) / 2 + math.hypot((xx - yy) / 2, xy))
