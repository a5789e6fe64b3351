"""Odometry: the pose by the wheels' encoders, which drifts with slip.

What it believes of the wheels may be wrong, too: the radius, the track, and how
far they turned between two ticks of an encoder.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from drake_mobarm.checks import at_least, within
from drake_mobarm.frozen import frozen
from drake_mobarm.robot.differential_drive import DifferentialDrive


@frozen
class OdometryParameters:
    """How what odometry believes differs from the base's figures.

    The three relative errors are the systematic ones of a differential drive:
    of its scale, of its wheels' ratio and of its track.

    Attributes:
        radius_error: of both wheels' believed radius, relative [-]; 0.01
            reports 1 % too far.
        radius_difference: by which the right wheel is believed to be larger
            than the left, relative to their mean [-]; 0.01 reports a turn to
            the left on a straight line.
        track_error: of the believed track, relative [-]; 0.01 reports turns
            1 % too small.
        encoder_ticks: that a wheel's encoder counts in a turn; 0 for angles
            that are exact. The wheels' speeds are always exact.
    """

    radius_error: float = 0.0
    radius_difference: float = 0.0
    track_error: float = 0.0
    encoder_ticks: int = 0

    def __post_init__(self) -> None:
        within(
            self,
            "[-0.5, 0.5]",
            "radius_error",
            "radius_difference",
            "track_error",
        )
        at_least(self, 0, "encoder_ticks")


def believed_base(
    base: DifferentialDrive, parameters: OdometryParameters
) -> DifferentialDrive:
    """The base's figures as odometry believes them.

    Args:
        base: the true figures.
        parameters: how the believed ones differ.
    """
    return replace(
        base,
        wheel_radius=base.wheel_radius * (1 + parameters.radius_error),
        track=base.track * (1 + parameters.track_error),
    )


def count_ticks(angle: float, ticks: int) -> float:
    """A wheel's angle [rad] at the last tick of so many in a turn, or itself.

    Args:
        angle: since the start, where a tick is [rad].
        ticks: in a turn; 0 for an exact encoder.
    """
    if not ticks:
        return angle
    tick = 2 * math.pi / ticks
    return math.floor(angle / tick) * tick


def scale_wheels(
    wheels: Sequence[float], parameters: OdometryParameters
) -> tuple[float, float]:
    """Turns of two unequal wheels as those of two of their mean radius.

    Args:
        wheels: angles or speeds, left, right [rad] or [rad/s].
        parameters: by how much the wheels are believed to differ.

    Returns:
        Left, right [rad] or [rad/s]: with these, wheels of the mean radius
        roll as far as the unequal ones.
    """
    left, right = wheels
    half = parameters.radius_difference / 2
    return (1 - half) * left, (1 + half) * right


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
