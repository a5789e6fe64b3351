"""The arm driver's law: inverse-dynamics PD, section 7.3.2.3.

In floats where it runs in every update: for six numbers numpy is slower.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import positive, positive_numbers, within
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array, clip_magnitude

# No-load speeds of XM430-W350 (five joints) and XL430-W250 at 12 V [rad/s].
_NO_LOAD_SPEED = (4.817, 4.817, 4.817, 4.817, 4.817, 6.388)


REFERENCE_SHARE = 0.8
"""Of the acceleration limit for the reference; the rest corrects errors."""


@frozen
class ArmDriveParameters:
    """How the arm follows a desired state.

    Attributes:
        rate: updates a second [Hz].
        k_p: gain of the joint error [1/s^2], (7.12).
        k_d: gain of its derivative [1/s], (7.12).
        no_load_speed: of each joint's motor [rad/s]: what is left of the
            stall torque falls linearly to none there.
    """

    rate: float = 100.0
    k_p: float = 400.0
    k_d: float = 40.0
    no_load_speed: tuple[float, ...] = _NO_LOAD_SPEED

    def __post_init__(self) -> None:
        within(self, "[20, 100]", "rate")
        positive(self, "k_p", "k_d")
        positive_numbers(self, 6, "no_load_speed")


def desired_acceleration(
    error: Iterable[float],
    error_rate: Iterable[float],
    limit: Iterable[float],
    parameters: ArmDriveParameters,
) -> list[float]:
    """Control input u = k_p e + k_d e' [rad/s^2] a joint, limited; (7.12)."""
    k_p, k_d = parameters.k_p, parameters.k_d
    limited = []
    for e, rate, most in zip(error, error_rate, limit, strict=True):
        u = k_p * e + k_d * rate
        limited.append(most if u > most else -most if u < -most else u)
    return limited


def limit_reference(
    reference: Array,
    desired: ArrayLike,
    step: float,
    speed_limit: Array,
    acceleration_limit: Array,
) -> Array:
    """A joint reference one step nearer to the desired state.

    A jump of the desired state becomes a motion that speeds up, cruises and
    brakes within the limits. A desired motion well within them is followed
    after a step or two; the nearer its acceleration comes to the limit, the
    more the reference lags behind it.

    Args:
        reference: joint positions and velocities [rad, rad/s], (2, n).
        desired: the same of the goal, (2, n).
        step: time between updates [s].
        speed_limit: [rad/s], (n,).
        acceleration_limit: [rad/s^2], (n,).

    Returns:
        The next reference, (2, n).
    """
    (q, v), (q_goal, v_goal) = reference, np.asarray(desired)
    error = q_goal - q
    room = acceleration_limit * step
    # The speed from which the limit can still brake within the error.
    brake = (
        np.sqrt(2 * acceleration_limit * np.abs(error) + room**2 / 4) - room / 2
    )
    catch_up = clip_magnitude(error / step, brake)
    wanted = clip_magnitude(v_goal + catch_up, speed_limit)
    v_next = v + clip_magnitude(wanted - v, room)
    return np.array([q + step * v_next, v_next])


def limit_torque(
    torque: Iterable[float],
    speed: Iterable[float],
    stall: Iterable[float],
    no_load_speed: Iterable[float],
) -> list[float]:
    """What the motors can give [N m] a joint, at joint speeds [rad/s].

    The limit is the stall torque at rest and falls linearly with speed in
    the direction of motion; against it a motor brakes with its stall torque.
    """
    limited = []
    for tau, v, limit, v_most in zip(
        torque, speed, stall, no_load_speed, strict=True
    ):
        if tau * v > 0:
            limit = max(limit * (1 - abs(v) / v_most), 0.0)
        limited.append(
            limit if tau > limit else -limit if tau < -limit else tau
        )
    return limited
