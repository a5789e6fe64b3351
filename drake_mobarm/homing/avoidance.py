"""Rule-based obstacle avoidance with a lidar (section 2.3.2, experiment 2).

The dissertation names "a simple rule-based algorithm" and gives no rules.
These are TangentBug's idea (Kamon, Rimon, Rivlin 1998) for a round robot, a
fluctuating target, and things that its lidar does not see. They are a machine
of three states:

- seek: head for the target, or for the gap of the shortest way to it.
- follow: follow the boundary of an obstacle on one side.
- leave: head from a boundary for a place nearer to the target.

In each update the lines of this table are tried from above. The first one that
holds and has a rule decides; one without a rule only changes the state.

======== ============================================ ======== ======
state    when                                         then     rule
======== ============================================ ======== ======
any      no target, or most rays are missing          the same wait
any      the robot stalls: it touches what is unseen  see (1)  back
any      it is boxed in: `boxed_time` at one place    seek (2)
not      the corridor to the target is free           seek     target
follow
leave    the exit is not reached and the way is free  leave    leave
leave    otherwise                                    seek
follow   a place nearer to the target by a gain is    leave    leave
         free to go to
follow   it is once round the boundary                seek (2)
seek     a gap is there, and the last gain is not     seek     gap
         older than `patience`
seek     otherwise                                    follow   follow
follow   always                                       follow   follow
======== ============================================ ======== ======

(1) Seek after leave, or else the same. Rule "back" holds for `back_time`;
where something is seen behind the robot, rule "wait" ends it.
(2) The robot tries the other one of its two margins, as narrower gaps may let
it pass, and forgets the unseen things that it touched.

The robot leaves a boundary only for an exit that is nearer to the target than
it has ever been, by `gain`, which doubles each time it comes back to the same
boundary: as every departure gains, there are only finitely many. On a boundary
the robot turns back once, after `first_leg`. Where it meets a boundary at the
place of the last meeting, it takes the other side.

A robot that has met no new ground for `give_up_time` goes round and round: it
has given up. So it has after that time near places visited earlier, even where
it finds a little new ground now and then: a new place makes up for a fortieth
of that time.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.driving.gaps import Gaps, find_gaps, unit
from drake_mobarm.driving.scan import length, lengths
from drake_mobarm.driving.touch import ROUNDING, has_stalled
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    AvoidanceState,
    ChosenGap,
    Follow,
    Leave,
    Seek,
    Stay,
    initial_state,
    no_points,
)
from drake_mobarm.homing.boundary import (
    find_exit,
    follow,
    is_once_round,
    meet,
)
from drake_mobarm.homing.gap_choice import cheapest_gap
from drake_mobarm.homing.recovery import (
    back_off,
    count_standing,
    start_backing_off,
)
from drake_mobarm.homing.situation import (
    AHEAD,
    FreeAround,
    Situation,
    drive,
    look,
    look_around,
)

__all__ = [
    "AvoidanceParameters",
    "AvoidanceState",
    "Follow",
    "Leave",
    "Seek",
    "has_given_up",
    "initial_state",
    "update",
]

# With more than this share of its rays missing, a scan is not to be trusted.
_MISSING_RAYS = 0.5
# Within this distance [m] the robot is at one place: more than its width, so
# that it does not leave a niche by turning about in it.
_ONE_PLACE = 0.7
# Places visited are remembered this far apart [m], about the robot's width,
# and so many of them: 100 m of way.
_VISITED_SPACING = 0.5
_VISITED_PLACES = 200
# The share of the time until the robot gives up that a new place makes up for:
# by default 1 s, in which it drives to the next one.
_NEW_PLACE = 1 / 40

# Gaps lie this far beyond the edge that they pass [m]: about the radius.
_PAST_EDGE = 0.3
# A way shorter by this [m] is a gain: less may be noise.
_SHORTER_WAY = 0.1

# An exit this near [m] is reached, and one as far beyond what is free is not
# yet blocked: the scan's noise may hide its last piece.
_EXIT_REACHED = 0.3


def update(
    state: AvoidanceState,
    pose_WL: ArrayLike,
    p_WT: ArrayLike,
    ranges: ArrayLike,
    velocity: Iterable[float],
    range_max: float,
    period: float,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Applies the rules to one scan.

    Args:
        state: after the last scan; it is not changed.
        pose_WL: odometry [x, y, yaw] at the scan in m and rad, (3,).
        p_WT: the estimated target [m], (2,).
        ranges: [m], (rays,), in the order of `ray_angles`; NaN where missing.
        velocity: measured speed [m/s] and turn rate [rad/s], (2,).
        range_max: the lidar's longest range [m], which means "no return".
        period: from one scan to the next [s].
        parameters: of the rules.

    Returns:
        The state with the waypoint and speed limit to drive with.
    """
    x, y, yaw = np.asarray(pose_WL, dtype=float)
    position = np.array([x, y])
    estimate = np.asarray(p_WT, dtype=float)
    scanned = np.asarray(ranges, dtype=float)
    missing = np.count_nonzero(np.isnan(scanned)) / scanned.size
    if not np.isfinite(estimate).all() or missing > _MISSING_RAYS:
        return _wait(state, position, yaw)
    state = _remember(state, position, estimate, period, parameters)
    situation = look(state, position, yaw, scanned, range_max, parameters)
    state = count_standing(state, situation, velocity, period, parameters)
    if has_stalled(state.recovery, parameters.touch):
        state = start_backing_off(state, situation, parameters)
    if state.recovery.backs_off:
        return back_off(state, situation, period, parameters)
    assert state.stay is not None
    if state.stay.time > parameters.boxed_time + ROUNDING:
        stay = replace(state.stay, time=0.0)
        state = _start_again(replace(state, stay=stay))
    return _choose_way(state, situation, parameters)


def has_given_up(
    state: AvoidanceState, parameters: AvoidanceParameters
) -> bool:
    """Whether the robot goes round and round."""
    longest = max(state.no_new_ground, state.known_ground)
    return longest > parameters.give_up_time + ROUNDING


def _wait(state: AvoidanceState, position: Array, yaw: float) -> AvoidanceState:
    """Rule "wait"."""
    return replace(
        state,
        rule="wait",
        waypoint=position + unit(yaw),  # Straight ahead: no turning.
        speed_limit=0.0,
        recovery=replace(state.recovery, standing=0.0),
    )


def _remember(
    state: AvoidanceState,
    position: Array,
    estimate: Array,
    period: float,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Takes in where the robot is and where the target is estimated."""
    target, visited, mode = estimate, state.visited, state.mode
    if state.target is not None:
        step = estimate - state.target
        share = min(period / parameters.smoothing_time, 1.0)
        target = state.target + share * step
    if state.stay is None or length(position - state.stay.place) > _ONE_PLACE:
        stay = Stay(position)
    else:
        stay = replace(state.stay, time=state.stay.time + period)
    apart = lengths(visited - position)
    is_new = bool((apart > _VISITED_SPACING).all())
    known_ground = state.known_ground
    if is_new:
        visited = np.vstack([visited, position])[-_VISITED_PLACES:]
        made_up = _NEW_PLACE * parameters.give_up_time
        known_ground = max(known_ground - made_up, 0.0)
    elif (apart[:-1] < _ONE_PLACE).any():
        known_ground += period
    if isinstance(mode, Seek):
        mode = replace(mode, idle=0.0 if is_new else mode.idle + period)
    elif isinstance(mode, Follow):
        followed = mode.followed + length(position - mode.position)
        mode = replace(mode, position=position, followed=followed)
    return replace(
        state,
        mode=mode,
        target=target,
        visited=visited,
        no_new_ground=0.0 if is_new else state.no_new_ground + period,
        known_ground=known_ground,
        stay=stay,
    )


def _start_again(state: AvoidanceState) -> AvoidanceState:
    """Seeks with the other margin, without the unseen things."""
    return replace(
        state, mode=Seek(), tight=not state.tight, touched=no_points()
    )


def _choose_way(
    state: AvoidanceState,
    situation: Situation,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """The table's lines from "the corridor to the target is free" on."""
    mode = state.mode
    if not isinstance(mode, Follow) and situation.target_is_free():
        return _head_for_target(state, situation, parameters)
    if isinstance(mode, Leave):
        if _is_ahead(mode.exit, situation):
            return _head_for_exit(state, mode.exit, situation, parameters)
        # It counts as visited even where it ends early: no exit is used twice.
        visited = np.vstack([state.visited, mode.exit])
        state, mode = replace(state, visited=visited), Seek()
    around = look_around(situation)
    if isinstance(mode, Follow):
        assert state.meeting is not None
        exit_place = find_exit(
            state, state.meeting, situation, around, parameters
        )
        if exit_place is not None:
            return _head_for_exit(state, exit_place, situation, parameters)
        if not is_once_round(mode, state.meeting, situation, parameters):
            return follow(state, mode, situation, around, parameters)
        state, mode = _start_again(state), Seek()
    gaps = find_gaps(
        around.angles, around.lengths, parameters.jump, past=_PAST_EDGE
    )
    if gaps.angles.size == 0:
        return _meet_boundary(state, 1, situation, around, parameters)
    best, way = cheapest_gap(gaps, mode.gap, situation, parameters)
    if way < mode.shortest_way - _SHORTER_WAY:
        mode = replace(mode, shortest_way=way, idle=0.0)
    if mode.idle > parameters.patience + ROUNDING:
        left = wrap_angle(gaps.angles[best] - situation.bearing) > 0
        return _meet_boundary(
            state, 1 if left else -1, situation, around, parameters
        )
    return _head_for_gap(state, mode, gaps, best, situation, parameters)


def _head_for_target(
    state: AvoidanceState,
    situation: Situation,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Rule "target"."""
    way = situation.target
    return drive(state, situation, way, parameters, rule="target", mode=Seek())


def _head_for_gap(
    state: AvoidanceState,
    mode: Seek,
    gaps: Gaps,
    best: int,
    situation: Situation,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Rule "gap"."""
    scan, angle = situation.scan, float(gaps.angles[best])
    place = scan.position + gaps.points()[best]
    gap = ChosenGap(place, side=int(gaps.sides[best]))
    ahead = min(scan.free_length(angle, situation.radius), AHEAD)
    way = max(gaps.lengths[best], ahead) * unit(angle)
    mode = replace(mode, gap=gap)
    return drive(state, situation, way, parameters, rule="gap", mode=mode)


def _head_for_exit(
    state: AvoidanceState,
    exit_place: Array,
    situation: Situation,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Rule "leave"."""
    way, mode = exit_place - situation.scan.position, Leave(exit_place)
    return drive(state, situation, way, parameters, rule="leave", mode=mode)


def _is_ahead(exit_place: Array, situation: Situation) -> bool:
    """Whether an exit is not reached, and the way to it is free."""
    way = exit_place - situation.scan.position
    angle = float(np.arctan2(way[1], way[0]))
    free = situation.scan.free_length(angle, situation.radius)
    return _EXIT_REACHED < length(way) < free + _EXIT_REACHED


def _meet_boundary(
    state: AvoidanceState,
    side: int,
    situation: Situation,
    around: FreeAround,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """From "seek" to "follow"."""
    position = situation.scan.position
    meeting = meet(state.meeting, position, side)
    mode = Follow(meeting.side, position, leg=parameters.first_leg)
    state = replace(state, meeting=meeting)
    return follow(state, mode, situation, around, parameters)
