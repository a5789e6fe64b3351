"""Target position from bearing and distance, averaged over time (2.1)-(2.5)."""

import math

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array


def vector_position(
    p_WA: ArrayLike, bearing_W: float, distance: float
) -> Array:
    """The target seen at a bearing and a distance, (2.1) and (2.2).

    Args:
        p_WA: the antenna's position [m], (2,).
        bearing_W: heading plus angle of arrival [rad].
        distance: from RSSI [m].

    Returns:
        p_WT [m], (2,).
    """
    direction = np.array([math.cos(bearing_W), math.sin(bearing_W)])
    return np.asarray(p_WA, dtype=float) + distance * direction


def time_weights(n: int, tau: float) -> Array:
    """Weights [-] of n positions, newest first, (n,), (2.3).

    Args:
        n: how many, at least 1.
        tau: decay [readings], positive: weights fall by e in so many.

    Raises:
        ParameterError: n or tau out of range.
    """
    require(n >= 1, "n", n, "at least 1")
    require(tau > 0, "tau", tau, "positive")
    return np.exp(-np.arange(n) / tau)


def weighted_position(buffer: ArrayLike, tau: float) -> Array:
    """The time-weighted mean of vector positions, (2.4) and (2.5).

    Args:
        buffer: positions [m], newest first, (n, 2): the last 20, or as many
            as there are at the start; n is at least 1.
        tau: decay [readings], positive.

    Returns:
        p_WT [m], (2,).
    """
    positions = np.asarray(buffer, dtype=float)
    weights = time_weights(len(positions), tau)
    return np.asarray(weights @ positions / weights.sum())
