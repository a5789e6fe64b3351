"""The speed at which a robot can stop before, and pass beside, what it sees."""

import math
from dataclasses import dataclass

from drake_mobarm.checks import positive
from drake_mobarm.driving.scan import Scan

# What the robot keeps free straight ahead while its heading is not yet that
# of its way [m]: it turns towards the way as it drives.
_TURNING_RESERVE = 0.03
# Things up to here behind the centre [m] count as beside the robot.
_BESIDE = 0.1


@dataclass(frozen=True, kw_only=True)
class CareParameters:
    """How fast to drive among things.

    Attributes:
        deceleration: to stop before a thing ahead [m/s^2], positive.
        care_speed: right beside things [m/s], positive.
        care_gain: how much faster for each metre of clearance beside [1/s],
            positive.
    """

    deceleration: float
    care_speed: float
    care_gain: float

    def __post_init__(self) -> None:
        positive(self, "deceleration", "care_speed", "care_gain")


def careful_speed(
    scan: Scan, angle: float, radius: float, parameters: CareParameters
) -> float:
    """The highest speed that is careful enough [m/s], infinite in the open.

    Args:
        scan: what is around the robot.
        angle: direction in W that the robot is to drive in [rad].
        radius: of the disc about the robot that has to stay free [m].
        parameters: how fast to drive among things.
    """
    room = min(
        scan.free_length(angle, radius),
        scan.free_length(scan.yaw, radius) - _TURNING_RESERVE,
    )
    stopping = math.sqrt(2 * parameters.deceleration * max(room, 0.0))
    return min(stopping, _speed_beside(scan, radius, parameters))


def _speed_beside(
    scan: Scan, radius: float, parameters: CareParameters
) -> float:
    """Slower beside things: they may reach farther out than is seen."""
    clearance = scan.clearance(radius, behind=_BESIDE)
    return parameters.care_speed + parameters.care_gain * max(clearance, 0.0)
