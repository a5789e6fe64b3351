"""Touching what the lidar does not see: noticing it, and backing off.

A robot that is to move and stands has met something below or above the
lidar's plane. It backs off a little, and remembers where that thing must be.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from drake_mobarm.checks import positive
from drake_mobarm.driving.gaps import unit
from drake_mobarm.driving.scan import Scan, length
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.robot.shape import RADIUS

# The robot was to move where its last limit [m/s] and the way to its last
# waypoint [m] were longer than this: else it may stand by itself.
_MOVING_LIMIT = 0.1
_MOVING_WAY = 0.2
# From this heading error on [rad] the robot may turn instead of driving.
_TURNING_ERROR = 0.4

# The robot backs off while at least this is free behind it [m].
_ROOM_BEHIND = 0.05
# A touch is assumed straight ahead, or this far to the side of what is being
# passed [rad].
_TOUCH_ANGLES = np.array([0.7, 0.0, 0.35, -0.35, -0.7, 1.05, -1.05])
# It lies this far outside the robot [m], so that the robot can turn beside
# it, and is remembered as three points, this far from one to the next [m].
_TOUCH_DISTANCE = 0.02
_TOUCH_SPACING = 0.08
# A touch this near to a known one [m] would close nothing new.
_KNOWN_TOUCH = 0.08
# One this near [m] is of the same thing.
_SAME_THING = 0.5
ROUNDING = 1e-6
"""Times are sums of periods [s], whose rounding must not cost one."""


@frozen
class TouchParameters:
    """When a robot counts as touching something, and what it does then.

    All are finite and positive.

    Attributes:
        stall_speed: measured speed below which the robot stands [m/s].
        stall_turn_rate: measured turn rate above which it turns [rad/s].
        stall_time: of standing that makes a stall [s].
        back_speed: of backing off [m/s].
        back_time: of backing off [s].
    """

    stall_speed: float = 0.03
    stall_turn_rate: float = 0.1
    stall_time: float = 0.5
    back_speed: float = 0.2
    back_time: float = 1.2

    def __post_init__(self) -> None:
        positive(self, *vars(self))


@dataclass(frozen=True)
class Recovery:
    """Recovery from touching something that the lidar does not see.

    Attributes:
        standing: for how long the robot was to move and stood [s]; it falls
            as fast while the robot moves.
        backing: of backing off that is left [s].
    """

    standing: float = 0.0
    backing: float = 0.0

    @property
    def backs_off(self) -> bool:
        """Whether backing off is not over."""
        return self.backing > ROUNDING


def count_standing(
    recovery: Recovery,
    scan: Scan,
    waypoint: Array,
    speed_limit: float,
    velocity: Iterable[float],
    period: float,
    parameters: TouchParameters,
) -> Recovery:
    """Counts the time for which the robot was to move and stood.

    Args:
        recovery: before.
        scan: of now.
        waypoint: p_WQ, of the last update [m], (2,).
        speed_limit: of the last update [m/s].
        velocity: measured speed [m/s] and turn rate [rad/s], (2,).
        period: since the last update [s].
        parameters: when a robot stands.
    """
    speed, turn_rate = map(abs, velocity)
    way = waypoint - scan.position
    error = wrap_angle(math.atan2(way[1], way[0]) - scan.yaw)
    to_move = speed_limit > _MOVING_LIMIT and length(way) > _MOVING_WAY
    turning = (
        abs(error) >= _TURNING_ERROR and turn_rate > parameters.stall_turn_rate
    )
    stands = to_move and speed < parameters.stall_speed and not turning
    # Falls slowly: a robot that grazes a thing turns now and then.
    standing = max(recovery.standing + (period if stands else -period), 0.0)
    if standing == recovery.standing:
        return recovery
    return replace(recovery, standing=standing)


def has_stalled(recovery: Recovery, parameters: TouchParameters) -> bool:
    """Whether the robot has stood for long enough, and is not backing off."""
    long_enough = recovery.standing >= parameters.stall_time - ROUNDING
    return long_enough and not recovery.backs_off


def touched_points(scan: Scan, known: Array, side: int) -> Array:
    """Where in front of a stalled robot something unseen was touched.

    Args:
        scan: of now.
        known: p_WP of what was touched before [m], (n, 2).
        side: where the thing being passed is: +1 right, -1 left, 0 for none.

    Returns:
        p_WP [m], (3, 2).
    """
    turns = _TOUCH_ANGLES * (side or 1)
    angles = scan.yaw - turns
    places = scan.position + (RADIUS + _TOUCH_DISTANCE) * unit(angles)
    if known.size:
        nearest = lengths_between(places, known).min(axis=1)
        # A thing that was touched goes on beside that place.
        nearest[nearest < _KNOWN_TOUCH] = np.inf
        chosen = (
            int(np.argmin(nearest))
            if nearest.min() < _SAME_THING
            else (0 if side else 1)
        )
    else:
        # Most likely a part of what is being passed: a seat, a board.
        chosen = 0 if side else 1
    angle, place = float(angles[chosen]), places[chosen]
    across = unit(angle + np.pi / 2)
    offsets = np.array([[-_TOUCH_SPACING], [0.0], [_TOUCH_SPACING]])
    touched: Array = place + offsets * across
    return touched


def back_off(
    recovery: Recovery,
    scan: Scan,
    radius: float,
    period: float,
    parameters: TouchParameters,
) -> tuple[Recovery, float]:
    """Backs straight off, or stops where something is seen behind.

    Args:
        recovery: with a time of backing off.
        scan: of now.
        radius: of the disc about the robot that has to stay free [m].
        period: until the next update [s].
        parameters: how fast.

    Returns:
        The recovery after this update, and the speed limit [m/s]: negative,
        or 0 where backing off ends.
    """
    room = scan.free_length(scan.yaw + np.pi, radius)
    if room < _ROOM_BEHIND:
        return replace(recovery, backing=0.0), 0.0
    left = max(recovery.backing - period, 0.0)
    return replace(recovery, backing=left), -parameters.back_speed


def lengths_between(places: Array, points: Array) -> Array:
    """Distances [m], (m, n), of places (m, 2) to points (n, 2)."""
    apart: Array = np.hypot(
        places[:, None, 0] - points[:, 0], places[:, None, 1] - points[:, 1]
    )
    return apart
