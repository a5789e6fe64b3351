"""Target position from bearings taken at different places (2.6)-(2.13)."""

import math

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.geometry import Array


def intersect_bearings(
    p_WA1: ArrayLike,
    bearing_W1: float,
    p_WA2: ArrayLike,
    bearing_W2: float,
    min_move: float = 0.05,
    min_angle: float = 0.02,
) -> Array | None:
    """Where two lines of sight cross, (2.6)-(2.9).

    Args:
        p_WA1: the antenna's position at the first reading [m], (2,).
        bearing_W1: heading plus angle of arrival there [rad].
        p_WA2: the same at the second reading [m], (2,).
        bearing_W2: the same at the second reading [rad].
        min_move: the least distance between the two places [m].
        min_angle: the least angle between the two lines [rad].

    Returns:
        p_WT [m], (2,), or None where the crossing is not to be trusted: a
        move too short, lines too close to parallel, or a crossing behind
        either of the two (the beacon is in front of its own bearing).
    """
    x1, y1 = np.asarray(p_WA1, dtype=float)
    x2, y2 = np.asarray(p_WA2, dtype=float)
    d_r = math.hypot(x2 - x1, y2 - y1)  # (2.9)
    crossing = math.sin(bearing_W2 - bearing_W1)
    if d_r < min_move or abs(crossing) < math.sin(min_angle):
        return None
    move = math.atan2(y2 - y1, x2 - x1)
    d_1 = -d_r * math.sin(move - bearing_W2) / crossing  # (2.8)
    # The same law with the readings' parts exchanged.
    d_2 = -d_r * math.sin(move - bearing_W1) / crossing
    if d_1 <= 0 or d_2 <= 0:
        return None
    return np.array(
        [
            x1 + d_1 * math.cos(bearing_W1),  # (2.6)
            y1 + d_1 * math.sin(bearing_W1),  # (2.7)
        ]
    )


def update_parallax(
    p_WT_old: ArrayLike, p_WA: ArrayLike, bearing_W: float, k: float
) -> Array:
    """Moves a position towards the newest line of sight, (2.10)-(2.13).

    Args:
        p_WT_old: the position after the previous update [m], (2,).
        p_WA: the antenna's position [m], (2,).
        bearing_W: heading plus angle of arrival [rad].
        k: the fraction of the way to go [-]; 1 ends on the line.

    Returns:
        p_WT [m], (2,). The line has no sides: a position behind the antenna
        is drawn to the line's backward half.
    """
    x_o, y_o = np.asarray(p_WT_old, dtype=float)
    x_a, y_a = np.asarray(p_WA, dtype=float)
    d_o = math.hypot(x_a - x_o, y_a - y_o)  # (2.13)
    d_e = d_o * math.sin(math.atan2(y_o - y_a, x_o - x_a) - bearing_W)  # (2.12)
    return np.array(
        [
            x_o + k * d_e * math.sin(bearing_W),  # (2.10)
            y_o - k * d_e * math.cos(bearing_W),  # (2.11)
        ]
    )
