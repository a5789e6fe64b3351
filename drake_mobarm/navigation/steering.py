"""From a force to the velocity of the base: (3.9) and (3.10)."""

import math

from drake_mobarm.checks import positive
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array, wrap_angle


@frozen
class SteeringParameters:
    """Gains; the dissertation gives no values.

    Attributes:
        linear_gain: k_l, speed for a unit force [m^2/s], positive.
        angular_gain: k_a, turn rate for a radian [1/s], positive.
    """

    linear_gain: float = 0.5
    angular_gain: float = 2.5

    def __post_init__(self) -> None:
        positive(self, "linear_gain", "angular_gain")


def steer(
    force: Array, yaw: float, parameters: SteeringParameters
) -> tuple[float, float]:
    """The velocity that a force asks for, (3.9) and (3.10).

    Args:
        force: in W [1/m], (2,).
        yaw: of the robot in W [rad].
        parameters: gains.

    Returns:
        Speed [m/s], 0 where the force points behind the robot, and turn rate
        [rad/s], both without limits; (0, 0) without a force.
    """
    size = math.hypot(*force)
    if size == 0.0:
        return 0.0, 0.0
    angle = float(wrap_angle(math.atan2(force[1], force[0]) - yaw))
    facing = max(2 / math.pi * (math.pi / 2 - abs(angle)), 0.0)
    return parameters.linear_gain * size * facing, (
        parameters.angular_gain * angle
    )
