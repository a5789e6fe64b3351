"""Boundaries for the rules of `avoidance`: meeting, following, leaving them."""

from dataclasses import replace

import numpy as np

from drake_mobarm.driving.gaps import blocking_point, unit
from drake_mobarm.driving.scan import length, lengths
from drake_mobarm.geometry import Array
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    AvoidanceState,
    Follow,
    Meeting,
)
from drake_mobarm.homing.situation import (
    AHEAD,
    FreeAround,
    Situation,
    drive,
)

# A boundary met this near to the last meeting [m] is met at the same place,
# for which the first side did not help, or is at least the same boundary.
_SAME_PLACE = 1.0
_SAME_BOUNDARY = 2.0
# The robot is once round where it comes this near to the meeting [m], after at
# least this way along the boundary [m].
_ROUND_CLOSED = 0.5
_LEAST_ROUND = 3.0
# A gain need not be more than this share of the way left to the target.
_LARGEST_GAIN = 0.5


def meet(last: Meeting | None, position: Array, side: int) -> Meeting:
    """Meets a boundary.

    Args:
        last: the last meeting, if any.
        position: p_WB [m], (2,).
        side: to follow the boundary on, unless it is met where it was met
            last: +1 with the boundary to the right, -1 to the left.
    """
    if last is None:
        return Meeting(position, side)
    moved = length(last.place - position)
    if moved < _SAME_PLACE:
        side = -last.side  # That side did not help.
    repeats = last.repeats + 1 if moved < _SAME_BOUNDARY else 0
    return Meeting(position, side, repeats)


def find_exit(
    state: AvoidanceState,
    meeting: Meeting,
    situation: Situation,
    around: FreeAround,
    parameters: AvoidanceParameters,
) -> Array | None:
    """The place to leave a boundary for.

    Args:
        state: with the places visited.
        meeting: with this boundary.
        situation: of this update.
        around: free lengths around the robot.
        parameters: of the rules.

    Returns:
        p_WQ [m], (2,), of all free places the nearest to the target, or None
        where that is no gain over the places visited.
    """
    position, target = situation.scan.position, situation.target
    towards = unit(around.angles)
    along = np.clip(towards @ target, 0.0, around.lengths)
    ends = along[:, None] * towards
    distances = lengths(target - ends)
    best = int(np.argmin(distances))
    nearest = lengths(state.visited - position - target).min()
    # A pocket that it came back to is not worth a small gain once more.
    gain = min(parameters.gain * 2**meeting.repeats, _LARGEST_GAIN * nearest)
    if distances[best] < nearest - gain:
        found: Array = position + ends[best]
        return found
    return None


def is_once_round(
    mode: Follow,
    meeting: Meeting,
    situation: Situation,
    parameters: AvoidanceParameters,
) -> bool:
    """Whether the robot is back where it met the boundary."""
    # After turning back it meets that place on the way, too.
    has_turned = np.isinf(mode.leg)
    least = _LEAST_ROUND + (parameters.first_leg if has_turned else 0.0)
    away = length(meeting.place - situation.scan.position)
    return away < _ROUND_CLOSED and mode.followed > least


def follow(
    state: AvoidanceState,
    mode: Follow,
    situation: Situation,
    around: FreeAround,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Rule "follow": sweeps from the boundary to the first open direction."""
    if mode.followed > mode.leg:
        mode = replace(mode, side=-mode.side, followed=0.0, leg=np.inf)
    scan, angles, free = situation.scan, around.angles, around.lengths
    start = situation.bearing
    if mode.edge is not None:
        edge = mode.edge - scan.position
        start = float(np.arctan2(edge[1], edge[0]))
    order = np.argsort(mode.side * (angles - start) % (2 * np.pi))
    enough = min(parameters.lookahead, float(free.max()))
    opened = int(np.argmax(free[order] >= enough))
    if opened or mode.edge is None:
        blocked = float(angles[order[opened - 1]])
        met = blocking_point(blocked, scan.points, situation.radius)
        if met is not None:
            mode = replace(mode, edge=scan.position + met)
    way = order[opened]
    return drive(
        state,
        situation,
        min(free[way], AHEAD) * unit(angles[way]),
        parameters,
        rule="follow",
        mode=mode,
    )
