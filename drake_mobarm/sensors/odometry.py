"""Odometry: the pose by the wheels' encoders, which drifts with slip."""

import math
from collections.abc import Sequence

from drake_mobarm.robot.differential_drive import DifferentialDrive


def integrate_wheels(
    pose: Sequence[float], turned: Sequence[float], base: DifferentialDrive
) -> tuple[float, float, float]:
    """The pose after the wheels turned, along the arc that they describe.

    Args:
        pose: [x, y, yaw] in W [m, rad].
        turned: left, right [rad], since that pose.
        base: the base's figures.

    Returns:
        The new x, y, yaw; yaw is not wrapped.
    """
    x, y, yaw = pose
    forward, turn = base.body_velocity(*turned)
    half = turn / 2
    chord = forward * math.sin(half) / half if half else forward
    return (
        x + chord * math.cos(yaw + half),
        y + chord * math.sin(yaw + half),
        yaw + turn,
    )
