"""The base driver's law: section 7.3.1.4, feedback and feed-forward.

There the acceleration fed forward is the one that reaches the velocity of the
next trajectory point, 0.2 s away. Commands here may change at any time: a
reference ramps to them within the limits, and its acceleration is fed forward.
"""

import math
from collections.abc import Sequence
from dataclasses import field

from drake_mobarm.checks import positive_numbers, require, within
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import clip_magnitude
from drake_mobarm.robot.differential_drive import DifferentialDrive

Pair = tuple[float, float]
"""v and w, or left and right, in floats: for two numbers numpy is slow."""

# Of limits that are told in round numbers.
_ROUNDING = 1.001


@frozen
class BaseDriveParameters:
    """How the base follows a commanded velocity.

    Attributes:
        rate: updates a second [Hz]; 50 in section 7.3.1.5.
        gain: of the velocity feedback (v, w) [1/s].
        speed_limit: the robot's: largest abs(v), abs(w) [m/s, rad/s], each
            of which its wheels have to be able to turn.
        acceleration_limit: of v and w [m/s^2, rad/s^2].
        yield_error: difference of measured and reference (v, w) at which
            the reference is given up [m/s, rad/s].
        base: the base's figures.
    """

    rate: float = 50.0
    gain: tuple[float, ...] = (10.0, 10.0)
    speed_limit: tuple[float, ...] = (1.0, 2.0)
    acceleration_limit: tuple[float, ...] = (1.0, 3.0)
    yield_error: tuple[float, ...] = (0.25, 1.0)
    base: DifferentialDrive = field(default_factory=DifferentialDrive)

    def __post_init__(self) -> None:
        within(self, "[10, 100]", "rate")
        positive_numbers(
            self,
            2,
            "gain",
            "speed_limit",
            "acceleration_limit",
            "yield_error",
        )
        wheel = self.base.wheel_speed_limit
        fastest = (
            self.base.body_velocity(wheel, wheel)[0],
            self.base.body_velocity(-wheel, wheel)[1],
        )
        require(
            all(
                limit <= _ROUNDING * most
                for limit, most in zip(self.speed_limit, fastest, strict=True)
            ),
            "speed_limit",
            self.speed_limit,
            f"up to what the wheels turn, {fastest[0]:.3f} m/s and "
            f"{fastest[1]:.3f} rad/s",
        )


def limit_velocity(
    command: Sequence[float], parameters: BaseDriveParameters
) -> Pair:
    """A command (v, w) [m/s, rad/s] cut to what the wheels can turn.

    First v and w are cut to their own limits; then, where a wheel would be
    too fast, both are scaled alike, which keeps the curvature of what the
    first step left. A command that is not finite becomes a halt.
    """
    if not all(map(math.isfinite, command)):
        return 0.0, 0.0
    v, w = map(clip_magnitude, command, parameters.speed_limit)
    base = parameters.base
    fastest = max(map(abs, base.wheel_speeds(v, w)))
    share = min(1.0, base.wheel_speed_limit / max(fastest, 1e-12))
    return share * v, share * w


def ramp(
    reference: Sequence[float],
    target: Sequence[float],
    step: float,
    parameters: BaseDriveParameters,
) -> Pair:
    """The reference velocity (v, w) one step nearer to a target.

    Held to the acceleration limits of the base and of its wheels, the latter
    by scaling both changes alike.
    """
    (v, w), (target_v, target_w) = reference, target
    limit_v, limit_w = parameters.acceleration_limit
    dv = clip_magnitude(target_v - v, step * limit_v)
    dw = clip_magnitude(target_w - w, step * limit_w)
    base = parameters.base
    fastest = max(map(abs, base.wheel_speeds(dv, dw))) / step
    share = min(1.0, base.wheel_acceleration_limit / max(fastest, 1e-12))
    return v + share * dv, w + share * dw


def yield_to(
    reference: Sequence[float],
    measured: Sequence[float],
    parameters: BaseDriveParameters,
) -> Pair:
    """The reference velocity (v, w), given up where the base is held.

    A base that is held by something would otherwise push with all its torque
    while its reference runs away from it.
    """
    (v, w), (measured_v, measured_w) = reference, measured
    error_v, error_w = parameters.yield_error
    return (
        measured_v if abs(v - measured_v) > error_v else v,
        measured_w if abs(w - measured_w) > error_w else w,
    )


def drive_torques(
    reference: Sequence[float],
    next_reference: Sequence[float],
    measured: Sequence[float],
    step: float,
    parameters: BaseDriveParameters,
) -> Pair:
    """Wheel torques that bring the base to the next reference velocity.

    The acceleration that reaches it by the next step is fed forward, the
    velocity error is fed back, and (7.6), (7.7) turn the sum into torques.

    Args:
        reference: (v, w) wanted now [m/s, rad/s].
        next_reference: (v, w) wanted a step later.
        measured: (v, w) from the encoders.
        step: time between updates [s].
        parameters: gains and limits.

    Returns:
        Left, right torque [N m], within the motors' limit.
    """
    (v, w), (next_v, next_w) = reference, next_reference
    measured_v, measured_w = measured
    gain_v, gain_w = parameters.gain
    acceleration = (
        (next_v - v) / step + gain_v * (v - measured_v),
        (next_w - w) / step + gain_w * (w - measured_w),
    )
    torques = parameters.base.wheel_torques(measured, acceleration)
    return limit_wheel_torques(torques, measured, parameters.base)


def limit_wheel_torques(
    torques: Sequence[float], measured: Sequence[float], base: DifferentialDrive
) -> Pair:
    """What the wheels' motors give, left and right, of torques asked for [N m].

    Turning goes first: a robot that leans on something can still turn away
    from it. A wheel at its speed limit gets no torque that would spin it up.
    """
    left, right = torques
    limit = base.wheel_torque_limit
    turn = clip_magnitude((right - left) / 2, limit)
    drive = clip_magnitude((right + left) / 2, limit - abs(turn))
    speed_left, speed_right = base.wheel_speeds(*measured)
    return (
        _limit_spin_up(drive - turn, speed_left, base.wheel_speed_limit),
        _limit_spin_up(drive + turn, speed_right, base.wheel_speed_limit),
    )


def _limit_spin_up(torque: float, speed: float, speed_limit: float) -> float:
    spins_up = abs(speed) >= speed_limit and torque * speed > 0
    return 0.0 if spins_up else torque
