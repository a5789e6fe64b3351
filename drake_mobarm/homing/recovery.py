"""Rule "back" of `avoidance`: touching what the lidar does not see."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from drake_mobarm.driving import touch
from drake_mobarm.driving.touch import Recovery
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    AvoidanceState,
    Follow,
    Leave,
    Seek,
)
from drake_mobarm.homing.situation import Situation

# The points remembered: of 30 touches.
_TOUCHED_POINTS = 90


def count_standing(
    state: AvoidanceState,
    situation: Situation,
    velocity: Iterable[float],
    period: float,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Counts the time for which the robot was to move and stood.

    Args:
        state: with the waypoint and the limit of the last update.
        situation: of this update.
        velocity: measured speed [m/s] and turn rate [rad/s], (2,).
        period: since the last update [s].
        parameters: of the rules.
    """
    recovery = touch.count_standing(
        state.recovery,
        situation.scan,
        state.waypoint,
        state.speed_limit,
        velocity,
        period,
        parameters.touch,
    )
    return replace(state, recovery=recovery)


def start_backing_off(
    state: AvoidanceState,
    situation: Situation,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Remembers what was touched, and drops the gap or exit headed for."""
    touched = touch.touched_points(
        situation.scan, state.touched, _passed_side(state)
    )
    mode = state.mode
    if isinstance(mode, Leave):
        mode = Seek()
    elif isinstance(mode, Seek):
        mode = replace(mode, gap=None)
    return replace(
        state,
        mode=mode,
        recovery=Recovery(backing=parameters.back_time),
        touched=np.vstack([state.touched, touched])[-_TOUCHED_POINTS:],
    )


def back_off(
    state: AvoidanceState,
    situation: Situation,
    period: float,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Backs straight off, or stops where something is seen behind."""
    recovery, speed_limit = touch.back_off(
        state.recovery,
        situation.scan,
        situation.tight_radius,
        period,
        parameters.touch,
    )
    return replace(
        state,
        rule="back" if speed_limit else "wait",
        speed_limit=speed_limit,
        recovery=recovery,
    )


def _passed_side(state: AvoidanceState) -> int:
    """Where the thing being passed is: +1 right, -1 left, 0 for none."""
    mode = state.mode
    if isinstance(mode, Follow):
        return mode.side
    if isinstance(mode, Seek) and mode.gap is not None:
        return mode.gap.side
    return 0
