"""Proportional control of a differential drive to a target (section 2.3.2)."""

import math
from collections.abc import Sequence

from drake_mobarm.checks import positive, require, within
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import wrap_angle


@frozen
class ControllerParameters:
    """Gains; the dissertation gives no values.

    Attributes:
        linear_gain: speed per distance [1/s], positive. From a speed v a
            robot that can brake at a stops on the target where this is
            2 a / v or less: 1.97 for the station's base from 1 m/s.
        angular_gain: turn rate per heading error [1/s], positive.
        turn_deceleration: with which turning ends on the heading at the most
            [rad/s^2], positive; above what the base can do, it turns too far.
        alignment: the heading error [rad] at which driving stops and only
            turning is left, in (0, pi].
        search_turn_rate: turn rate while there is nowhere to drive to
            [rad/s], positive.
    """

    linear_gain: float = 1.5
    angular_gain: float = 3.0
    turn_deceleration: float = 1e6
    alignment: float = 0.8
    search_turn_rate: float = 0.5

    def __post_init__(self) -> None:
        positive(
            self,
            "linear_gain",
            "angular_gain",
            "turn_deceleration",
            "search_turn_rate",
        )
        within(self, "(0, pi]", "alignment")


def drive_to(
    pose_WB: Sequence[float],
    p_WT: Sequence[float],
    speed_limit: Sequence[float],
    parameters: ControllerParameters,
) -> tuple[float, float]:
    """The base velocity that drives to a target, forwards only.

    Speed falls with the heading error, to nothing at `alignment`, so that
    the robot turns in place towards a target beside or behind it.

    Args:
        pose_WB: the base's pose [x, y, yaw] in m and rad, (3,).
        p_WT: the target [m], (2,).
        speed_limit: of speed [m/s] and turn rate [rad/s], (2,), at least 0.
        parameters: gains.

    Returns:
        Speed [m/s], at least 0, and turn rate [rad/s], within the limits.

    Raises:
        ParameterError: a target or pose that is not finite, or a limit
            below 0.
    """
    require(all(map(math.isfinite, pose_WB)), "pose_WB", pose_WB, "finite")
    require(all(map(math.isfinite, p_WT)), "p_WT", p_WT, "finite")
    (x, y, yaw), (target_x, target_y) = pose_WB, p_WT
    top, limit = speed_limit
    require(top >= 0 and limit >= 0, "speed_limit", speed_limit, "at least 0")
    dx, dy = target_x - x, target_y - y
    distance = math.hypot(dx, dy)
    if distance == 0.0:
        return 0.0, 0.0  # No direction to turn to.
    error = float(wrap_angle(math.atan2(dy, dx) - yaw))
    rate = min(
        parameters.angular_gain * abs(error),
        math.sqrt(2 * parameters.turn_deceleration * abs(error)),
        limit,
    )
    turn = math.copysign(rate, error)
    # 1 when facing the target, 0 from `alignment` on, flat at both ends.
    facing = min(abs(error) / parameters.alignment, 1.0)
    ease = 0.5 * (1 + math.cos(math.pi * facing))
    return min(parameters.linear_gain * distance, top) * ease, turn
