"""Odometry: the pose that the wheels' encoders tell, slip and all."""

import math

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.geometry import Array
from drake_mobarm.robot.differential_drive import DifferentialDrive


def integrate_wheels(
    pose: ArrayLike, turned: ArrayLike, base: DifferentialDrive
) -> Array:
    """The pose after the wheels turned, along the arc that they describe.

    Args:
        pose: [x, y, yaw] in W [m, rad], (3,).
        turned: left, right [rad], (2,), since that pose.
        base: the base's figures.

    Returns:
        The new [x, y, yaw], (3,); yaw is not wrapped.
    """
    x, y, yaw = np.asarray(pose, dtype=float)
    forward, turn = base.body_velocity(turned)
    half = turn / 2
    chord = forward * math.sin(half) / half if half else forward
    return np.array(
        [
            x + chord * math.cos(yaw + half),
            y + chord * math.sin(yaw + half),
            yaw + turn,
        ]
    )
