"""The base driver's law: section 7.3.1.4, feedback and feed-forward.

There the acceleration fed forward is the one that reaches the velocity of the
next trajectory point, 0.2 s away. Commands here may change at any time: a
reference ramps to them within the limits, and its acceleration is fed forward.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import positive_numbers, within
from drake_mobarm.geometry import Array, clip_magnitude
from drake_mobarm.robot.differential_drive import DifferentialDrive


@dataclass(kw_only=True)
class BaseDriveParameters:
    """How the base follows a commanded velocity.

    Attributes:
        rate: updates a second [Hz]; 50 in section 7.3.1.5.
        gain: of the velocity feedback (v, w) [1/s].
        speed_limit: largest abs(v), abs(w) [m/s, rad/s].
        acceleration_limit: of v and w [m/s^2, rad/s^2].
        yield_error: difference of measured and reference (v, w) at which
            the reference is given up [m/s, rad/s].
        base: the base's figures.
    """

    rate: float = 50.0
    gain: list[float] = field(default_factory=lambda: [10.0, 10.0])
    speed_limit: list[float] = field(default_factory=lambda: [1.0, 2.0])
    acceleration_limit: list[float] = field(default_factory=lambda: [1.0, 3.0])
    yield_error: list[float] = field(default_factory=lambda: [0.25, 1.0])
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


def limit_velocity(
    command: ArrayLike, parameters: BaseDriveParameters
) -> Array:
    """The nearest velocity (v, w), (2,), that the wheels can turn.

    First v and w are limited each; then, where a wheel would be too fast,
    both are scaled alike, which keeps the curvature of what is left. A
    command that is not finite becomes a halt.
    """
    velocity = np.asarray(command, dtype=float)
    if not np.isfinite(velocity).all():
        return np.zeros(2)
    velocity = clip_magnitude(velocity, parameters.speed_limit)
    fastest = np.abs(parameters.base.wheel_speeds(velocity)).max()
    limited: Array = velocity * min(
        1.0, parameters.base.wheel_speed_limit / max(fastest, 1e-12)
    )
    return limited


def ramp(
    reference: ArrayLike,
    target: ArrayLike,
    step: float,
    parameters: BaseDriveParameters,
) -> Array:
    """The reference velocity (v, w), (2,), one step nearer to a target.

    Held to the acceleration limits of the base and of its wheels, the latter
    by scaling both changes alike.
    """
    reference = np.asarray(reference, dtype=float)
    room = step * np.asarray(parameters.acceleration_limit)
    change = clip_magnitude(np.asarray(target) - reference, room)
    base = parameters.base
    fastest = np.abs(base.wheel_speeds(change)).max() / step
    ramped: Array = reference + change * min(
        1.0, base.wheel_acceleration_limit / max(fastest, 1e-12)
    )
    return ramped


def yield_to(
    reference: ArrayLike, measured: ArrayLike, parameters: BaseDriveParameters
) -> Array:
    """The reference velocity, given up where the base cannot follow it.

    A base that is held by something would otherwise push with all its torque
    while its reference runs away from it.
    """
    reference, measured = np.asarray(reference), np.asarray(measured)
    held = np.abs(reference - measured) > np.asarray(parameters.yield_error)
    return np.where(held, measured, reference)


def drive_torques(
    reference: ArrayLike,
    next_reference: ArrayLike,
    measured: ArrayLike,
    step: float,
    parameters: BaseDriveParameters,
) -> Array:
    """Wheel torques that bring the base to the next reference velocity.

    The acceleration that reaches it by the next step is fed forward, the
    velocity error is fed back, and (7.6), (7.7) turn the sum into torques.

    Args:
        reference: (v, w) wanted now [m/s, rad/s], (2,).
        next_reference: (v, w) wanted a step later, (2,).
        measured: (v, w) from the encoders, (2,).
        step: time between updates [s].
        parameters: gains and limits.

    Returns:
        Left, right torque [N m], (2,), within the motors' limit.
    """
    reference = np.asarray(reference, dtype=float)
    feedforward = (np.asarray(next_reference) - reference) / step
    error = reference - np.asarray(measured)
    acceleration = feedforward + np.asarray(parameters.gain) * error
    torques = parameters.base.wheel_torques(measured, acceleration)
    return limit_wheel_torques(torques, measured, parameters.base)


def limit_wheel_torques(
    torques: Array, measured: ArrayLike, base: DifferentialDrive
) -> Array:
    """What the wheels' motors give [N m], (2,), of the torques asked for.

    Turning goes first: a robot that leans on something can still turn away
    from it. A wheel at its speed limit gets no torque that would spin it up.
    """
    limit = base.wheel_torque_limit
    left, right = torques
    turn = min(max((right - left) / 2, -limit), limit)
    room = limit - abs(turn)
    drive = min(max((right + left) / 2, -room), room)
    given = np.array([drive - turn, drive + turn])
    speeds = base.wheel_speeds(measured)
    too_fast = np.abs(speeds) >= base.wheel_speed_limit
    return np.where(too_fast & (given * speeds > 0), 0.0, given)
