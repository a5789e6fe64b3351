"""Rule-based obstacle avoidance with a lidar (section 2.3.2, experiment 2).

The dissertation names "a simple rule-based algorithm" and gives no rules.
These are TangentBug's idea (Kamon, Rimon, Rivlin 1998) for a round robot, a
fluctuating target, and things that its lidar does not see. The first rule
that applies decides:

====== ======================================== ==========================
rule   when                                     then
====== ======================================== ==========================
wait   no target, or most rays are missing      stand still
back   the wheels stall: something unseen       remember it, back off
target the corridor to the target is free       head for the target
leave  a boundary has been left for a place     head for it till there
follow no gain for `patience`, or no gap        follow the boundary
gap    otherwise                                head for the gap of the
                                                shortest way
====== ======================================== ==========================

The shortest way: to the gap, then straight to the target, dearer when seen
things block that second leg, when it bends away from the thing passed, by
turning, and for other gaps than the last one (hysteresis).

A gain is new ground, or a shorter way than any since the last boundary. The
boundary is kept on one side, until a free corridor leads nearer to the target
than the robot has ever been by `gain`, which doubles where it comes back to
the same boundary: each departure gains, so there are only finitely many.
After `first_leg` it turns back once; it takes the other side when it starts
where it started last; and once round without a departure, or boxed in, it
tries narrower gaps and forgets the unseen things.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.driving.gaps import (
    Gaps,
    blocking_point,
    find_gaps,
    free_along,
    free_around,
    unit,
)
from drake_mobarm.driving.scan import (
    View,
    drive,
    free_ahead,
    length,
    lengths,
    look,
)
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    AvoidanceState,
    initial_state,
    no_points,
)
from drake_mobarm.sensors.lidar import ray_angles

__all__ = [
    "AvoidanceParameters",
    "AvoidanceState",
    "initial_state",
    "update",
]

_DIRECTIONS = 180  # Looked at for gaps and along boundaries: every 2 deg.
_AHEAD = 1.2  # Waypoints this far ahead [m] do not slow the robot down.


def update(
    state: AvoidanceState,
    pose_WL: ArrayLike,
    p_WT: ArrayLike,
    ranges: ArrayLike,
    velocity: ArrayLike,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Applies the rules to one scan.

    Args:
        state: after the last scan.
        pose_WL: odometry [x, y, yaw] at the scan in m and rad, (3,).
        p_WT: the estimated target [m], (2,).
        ranges: [m], (rays,), in the order of `ray_angles`.
        velocity: measured speed [m/s] and turn rate [rad/s], (2,).
        parameters: of the rules.

    Returns:
        The state with the waypoint and speed limit to drive with.
    """
    x, y, yaw = np.asarray(pose_WL, dtype=float)
    position = np.array([x, y])
    estimate = np.asarray(p_WT, dtype=float)
    scan = np.asarray(ranges, dtype=float)
    if not np.isfinite(estimate).all() or np.isnan(scan).mean() > 0.5:
        return replace(
            state,
            waypoint=position + unit(yaw),  # Straight ahead: no turning.
            speed_limit=0.0,
            rule="wait",
            stalled=0,
        )
    state = _remember(state, position, estimate, parameters)
    view = look(state, position, yaw, scan, parameters)
    state = _count_stall(state, view, velocity, parameters)
    return _back_off(state, view, parameters) or _choose_way(
        state, view, parameters
    )


def _remember(
    state: AvoidanceState,
    position: Array,
    estimate: Array,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    target, followed = estimate, state.followed
    if state.target is not None:
        step = estimate - state.target
        target = state.target + parameters.smoothing * step
    if state.previous is not None:
        followed += length(position - state.previous)
    anchor, stay = state.anchor, state.stay + 1
    if anchor is None or length(position - anchor) > 0.7:
        anchor, stay = position, 0
    ground, idle = state.ground, state.idle + 1
    if np.all(lengths(ground - position) > 0.5):
        ground, idle = np.vstack([ground, position])[-200:], 0
    return replace(
        state,
        target=target,
        previous=position,
        ground=ground,
        followed=followed,
        idle=idle,
        anchor=anchor,
        stay=stay,
    )


def _count_stall(
    state: AvoidanceState,
    view: View,
    velocity: ArrayLike,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    speed, turn_rate = np.abs(np.asarray(velocity, dtype=float))
    way = state.waypoint - view.position
    turn = wrap_angle(np.arctan2(way[1], way[0]) - view.yaw)
    asked = state.speed_limit > 0.1 and length(way) > 0.2
    turning = abs(turn) >= 0.4 and turn_rate > parameters.stall_turn_rate
    standing = asked and speed < parameters.stall_speed and not turning
    # Counts down slowly: a grazing robot also turns now and then.
    stalled = state.stalled + 1 if standing else max(state.stalled - 1, 0)
    return replace(state, stalled=stalled)


def _back_off(
    state: AvoidanceState, view: View, parameters: AvoidanceParameters
) -> AvoidanceState | None:
    """Rule "back": after a stall, and until far enough from it."""
    if state.backing == 0 and state.stalled >= parameters.stall_updates:
        touched = _touched(state, view, parameters)
        state = replace(
            state,
            stalled=0,
            backing=parameters.back_updates,
            phantoms=np.vstack([state.phantoms, touched])[-90:],
            gap=None,
            exit=None,
        )
    if state.backing == 0:
        return None
    room = free_ahead(view, view.yaw + np.pi, view.tight_radius)
    if room < 0.05:
        return replace(state, backing=0, speed_limit=0.0, rule="wait")
    return replace(
        state,
        backing=state.backing - 1,
        rule="back",
        speed_limit=-parameters.back_speed,
    )


def _touched(
    state: AvoidanceState, view: View, parameters: AvoidanceParameters
) -> Array:
    """Where in front something unseen was touched, in W [m], (3, 2)."""
    # Most likely a part of what is being passed: a seat, a table's board.
    side = state.gap_side if state.rule == "gap" else state.side
    for angle in (view.yaw - 0.7 * side, view.yaw, view.yaw + 0.7 * side):
        place = (parameters.radius + 0.06) * unit(angle)
        known = lengths(state.phantoms - view.position - place)
        if np.all(known > 0.15):
            break
    across = unit(angle + np.pi / 2)
    width = np.array([[-0.08], [0.0], [0.08]])
    touched: Array = view.position + place + width * across
    return touched


def _choose_way(
    state: AvoidanceState, view: View, parameters: AvoidanceParameters
) -> AvoidanceState:
    if state.stay > parameters.boxed_updates:
        state = replace(
            state,
            stay=0,
            side=0,
            gap=None,
            exit=None,
            idle=0,
            tight=not state.tight,
            promise=np.inf,
            phantoms=no_points(),
        )
    if state.side == 0 and _target_is_free(view):
        return _head_for_target(state, view, parameters)
    if state.exit is not None:
        way = state.exit - view.position
        free_way = free_ahead(
            view, float(np.arctan2(way[1], way[0])), view.radius
        )
        if 0.3 < length(way) < free_way + 0.3:
            return drive(
                replace(state, rule="leave", idle=0), view, way, parameters
            )
        # Counts as visited even where it ends early: no exit is used twice.
        state = replace(
            state, exit=None, ground=np.vstack([state.ground, state.exit])
        )
    angles = view.yaw + ray_angles(_DIRECTIONS)
    free = free_around(
        view.yaw - np.pi,
        _DIRECTIONS,
        view.points,
        view.radius,
        parameters.range_max,
    )
    if state.side != 0:
        state = _leave_boundary(state, view, angles, free, parameters)
    if state.side == 0:
        if state.exit is not None:
            return drive(state, view, state.exit - view.position, parameters)
        gaps = find_gaps(angles, free, parameters.jump, past=0.3)
        chosen = _choose_gap(state, view, gaps, parameters)
        if isinstance(chosen, AvoidanceState):
            return chosen
        state = _meet_boundary(state, view, chosen, parameters)
    return _follow_boundary(state, view, angles, free, parameters)


def _target_is_free(view: View) -> bool:
    needed = view.distance - view.tolerance
    if free_ahead(view, view.bearing, view.radius) >= needed:
        return True
    # Things may stand right beside the target.
    near = view.distance < 1.5
    return near and free_ahead(view, view.bearing, view.tight_radius) >= needed


def _head_for_target(
    state: AvoidanceState, view: View, parameters: AvoidanceParameters
) -> AvoidanceState:
    """Rule "target"."""
    state = replace(state, rule="target", gap=None, exit=None, promise=np.inf)
    return drive(state, view, view.target, parameters)


def _choose_gap(
    state: AvoidanceState,
    view: View,
    gaps: Gaps,
    parameters: AvoidanceParameters,
) -> AvoidanceState | int:
    """Rule "gap", or the side to leave the obstacle on if there is no gain."""
    if gaps.angles.size == 0:
        return 1
    places = gaps.points()
    rest = lengths(view.target - places)
    way = gaps.lengths + rest
    bend = gaps.sides * wrap_angle(view.bearing - gaps.angles)
    cost = (
        way
        + parameters.turn_cost * np.abs(wrap_angle(gaps.angles - view.yaw))
        + parameters.slack_cost * (bend > 0.1)
    )
    met = free_along(places, view.target, view.points, parameters.radius)
    cost += parameters.blocked_cost * (met < rest - view.tolerance)
    if state.gap is not None:
        moved = lengths(places + view.position - state.gap)
        same_side = gaps.sides == state.gap_side
        # The target's error grows with its distance; the gap's place moves.
        same = same_side & (moved < np.maximum(0.5, 0.25 * gaps.lengths))
        cost -= same * (parameters.hysteresis + 0.15 * view.distance)
        # Seen end on, a thin wall seems as easily passed on its other side.
        cost += parameters.side_cost * (~same_side & (moved < 1.5))
    best = int(np.argmin(cost))
    promise, idle = state.promise, state.idle
    if way[best] < promise - 0.1:
        promise, idle = float(way[best]), 0
    if idle > parameters.patience:
        return 1 if wrap_angle(gaps.angles[best] - view.bearing) > 0 else -1
    angle = float(gaps.angles[best])
    ahead = min(free_ahead(view, angle, view.radius), _AHEAD)
    state = replace(
        state,
        rule="gap",
        gap=view.position + places[best],
        gap_side=int(gaps.sides[best]),
        promise=promise,
        idle=idle,
    )
    return drive(
        state, view, max(gaps.lengths[best], ahead) * unit(angle), parameters
    )


def _meet_boundary(
    state: AvoidanceState,
    view: View,
    side: int,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    repeats = 0
    if state.hit is not None and length(state.hit - view.position) < 1.0:
        side = -state.hit_side  # That side did not help.
    if state.hit is not None and length(state.hit - view.position) < 2.0:
        repeats = state.repeats + 1
    return replace(
        state,
        side=side,
        hit=view.position,
        hit_side=side,
        repeats=repeats,
        boundary=None,
        gap=None,
        followed=0.0,
        leg=parameters.first_leg,
    )


def _leave_boundary(
    state: AvoidanceState,
    view: View,
    angles: Array,
    free: Array,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    towards = unit(angles)
    along = np.clip(towards @ view.target, 0.0, free)
    ends = along[:, None] * towards
    distances = lengths(view.target - ends)
    best = int(np.argmin(distances))
    nearest = lengths(state.ground - view.position - view.target).min()
    # A pocket that it came back to is not worth a small gain once more.
    gain = min(parameters.gain * 2**state.repeats, 0.5 * nearest)
    left = replace(state, side=0, gap=None, promise=np.inf, idle=0)
    if distances[best] < nearest - gain:
        return replace(left, rule="leave", exit=view.position + ends[best])
    assert state.hit is not None
    # After turning back it meets that place on the way, too.
    least = 3.0 + (parameters.first_leg if np.isinf(state.leg) else 0.0)
    around = length(state.hit - view.position) < 0.5
    if around and state.followed > least:
        return replace(left, tight=not state.tight, phantoms=no_points())
    return state


def _follow_boundary(
    state: AvoidanceState,
    view: View,
    angles: Array,
    free: Array,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Rule "follow": sweeps from the boundary to the first open direction."""
    if state.followed > state.leg:
        state = replace(state, side=-state.side, followed=0.0, leg=np.inf)
    start = view.bearing
    if state.boundary is not None:
        edge = state.boundary - view.position
        start = float(np.arctan2(edge[1], edge[0]))
    order = np.argsort(state.side * (angles - start) % (2 * np.pi))
    enough = min(parameters.lookahead, float(free.max()))
    opened = int(np.argmax(free[order] >= enough))
    boundary = state.boundary
    if opened or boundary is None:
        edge_or_none = blocking_point(
            float(angles[order[opened - 1]]), view.points, view.radius
        )
        if edge_or_none is not None:
            boundary = view.position + edge_or_none
    way = order[opened]
    state = replace(state, rule="follow", boundary=boundary)
    return drive(
        state, view, min(free[way], _AHEAD) * unit(angles[way]), parameters
    )
