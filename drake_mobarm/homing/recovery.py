"""Rule "back" of `avoidance`: touching what the lidar does not see."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from drake_mobarm.driving.gaps import unit
from drake_mobarm.driving.scan import length, lengths
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    AvoidanceState,
    Follow,
    Leave,
    Recovery,
    Seek,
)
from drake_mobarm.homing.situation import Situation

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
_TOUCH_ANGLE = 0.7
# It lies this far outside the robot [m], so that the robot can turn beside
# it, and is remembered as three points, this far from one to the next [m].
_TOUCH_DISTANCE = 0.06
_TOUCH_SPACING = 0.08
# A touch this near to a known one [m] would close nothing new.
_KNOWN_TOUCH = 0.15
# The points remembered: of 30 touches.
_TOUCHED_POINTS = 90


def count_standing(
    state: AvoidanceState,
    situation: Situation,
    velocity: Iterable[float],
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Counts the updates for which the robot was to move and stood.

    Args:
        state: with the waypoint and the limit of the last update.
        situation: of this update.
        velocity: measured speed [m/s] and turn rate [rad/s], (2,).
        parameters: of the rules.
    """
    speed, turn_rate = map(abs, velocity)
    way = state.waypoint - situation.scan.position
    error = wrap_angle(np.arctan2(way[1], way[0]) - situation.scan.yaw)
    to_move = state.speed_limit > _MOVING_LIMIT and length(way) > _MOVING_WAY
    turning = (
        abs(error) >= _TURNING_ERROR and turn_rate > parameters.stall_turn_rate
    )
    stands = to_move and speed < parameters.stall_speed and not turning
    count = state.recovery.standing
    # Counts down slowly: a robot that grazes a thing turns now and then.
    count = count + 1 if stands else max(count - 1, 0)
    if count == state.recovery.standing:
        return state
    return replace(state, recovery=replace(state.recovery, standing=count))


def has_stalled(state: AvoidanceState, parameters: AvoidanceParameters) -> bool:
    """Whether the robot has stood for long enough, and is not backing off."""
    recovery = state.recovery
    return (
        recovery.backing == 0 and recovery.standing >= parameters.stall_updates
    )


def start_backing_off(
    state: AvoidanceState,
    situation: Situation,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Remembers what was touched, and drops the gap or exit headed for."""
    touched = _touched(state, situation, parameters)
    mode = state.mode
    if isinstance(mode, Leave):
        mode = Seek()
    elif isinstance(mode, Seek):
        mode = replace(mode, gap=None)
    return replace(
        state,
        mode=mode,
        recovery=Recovery(backing=parameters.back_updates),
        touched=np.vstack([state.touched, touched])[-_TOUCHED_POINTS:],
    )


def back_off(
    state: AvoidanceState,
    situation: Situation,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Backs straight off, or stops where something is seen behind."""
    scan, recovery = situation.scan, state.recovery
    room = scan.free_length(scan.yaw + np.pi, situation.tight_radius)
    if room < _ROOM_BEHIND:
        return replace(
            state,
            rule="wait",
            speed_limit=0.0,
            recovery=replace(recovery, backing=0),
        )
    return replace(
        state,
        rule="back",
        speed_limit=-parameters.back_speed,
        recovery=replace(recovery, backing=recovery.backing - 1),
    )


def _touched(
    state: AvoidanceState,
    situation: Situation,
    parameters: AvoidanceParameters,
) -> Array:
    """Where in front something unseen was touched, p_WP [m], (3, 2)."""
    # Most likely a part of what is being passed: a seat, a table's board.
    position, yaw = situation.scan.position, situation.scan.yaw
    turn = _TOUCH_ANGLE * _passed_side(state)
    for angle in (yaw - turn, yaw, yaw + turn):
        place = (parameters.radius + _TOUCH_DISTANCE) * unit(angle)
        known = lengths(state.touched - position - place)
        if np.all(known > _KNOWN_TOUCH):
            break
    across = unit(angle + np.pi / 2)
    offsets = np.array([[-_TOUCH_SPACING], [0.0], [_TOUCH_SPACING]])
    touched: Array = position + place + offsets * across
    return touched


def _passed_side(state: AvoidanceState) -> int:
    """Where the thing being passed is: +1 right, -1 left, 0 for none."""
    mode = state.mode
    if isinstance(mode, Follow):
        return mode.side
    if isinstance(mode, Seek) and mode.gap is not None:
        return mode.gap.side
    return 0
