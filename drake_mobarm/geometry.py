"""Angles and planar poses, as arrays of any batch size."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

FARTHEST = 1e6
"""No robot is farther from the origin [m]; nor has it turned more [rad]."""


def wrap_angle(angle: ArrayLike) -> Any:
    """Wraps angles [rad] of any shape into [-pi, pi).

    A scalar in gives a scalar out.
    """
    if isinstance(angle, float):  # Ten times faster than an array of one.
        wrapped = (angle + math.pi) % (2 * math.pi) - math.pi
        # Rounding can bring the remainder up to a whole turn.
        return wrapped if wrapped < math.pi else -math.pi
    array = (np.asarray(angle, dtype=float) + np.pi) % (2 * np.pi) - np.pi
    return np.where(array < np.pi, array, -np.pi)[()]


def rotation(yaw: float) -> Array:
    """The planar rotation matrix R_AB, (2, 2), of a frame B at `yaw` [rad]."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s], [s, c]])


def is_pose(pose: Iterable[float]) -> bool:
    """Whether [x, y, yaw] in m and rad can be a robot's pose at all.

    It is finite, and no farther away than `FARTHEST` [m].
    """
    return all(abs(number) <= FARTHEST for number in pose)


def transform_points(pose: Iterable[float], p_BP: ArrayLike) -> Array:
    """Points given in a frame B, in the frame A of that frame's pose.

    Args:
        pose: X_AB as [x, y, yaw] in m and rad, (3,).
        p_BP: points [m], (..., 2).

    Returns:
        p_AP [m], (..., 2).
    """
    x, y, yaw = pose
    p_AP: Array = np.asarray(p_BP, dtype=float) @ rotation(yaw).T + (x, y)
    return p_AP


def clip_magnitude(values: Any, limit: Any) -> Any:
    """Values held within +-limit, elementwise.

    A float in gives a float out. For the few numbers of a control law np.clip
    takes four times as long.
    """
    if isinstance(values, float):
        return min(max(values, -limit), limit)
    return np.minimum(np.maximum(values, -np.asarray(limit)), limit)
