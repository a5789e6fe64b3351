"""Leading a robot to a target by a map of what its lidar has seen.

In each update the scan goes into the map. The cheapest way over the map to
the target is planned anew where a scan shows the last one shut, where the
target's estimate has moved, and now and then. The robot heads for the
farthest place on the way that it can go to straight, at a careful speed. What
is not known counts as free, and each way that turns out to be shut adds to
the map: if a way exists, it is found.

A thing that the robot touches without seeing it is marked in the map, and
stays there. A robot that has come as near to the target as it can, and has
not arrived, tries other places about it. Where none is left, odometry may have
drifted: all that was seen is forgotten, then all that was touched, too. After
that the robot gives up, and names the place where the way is shut.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.driving.careful_speed import careful_speed
from drake_mobarm.driving.gaps import (
    blocking_point,
    clearance_ahead,
    unit,
)
from drake_mobarm.driving.known_floor import KnownFloor
from drake_mobarm.driving.map_avoidance_state import (
    MapAvoidanceParameters,
    MapAvoidanceState,
    Plan,
    count_halt,
    no_places,
)
from drake_mobarm.driving.route import Route, find_route, is_shut, place_ahead
from drake_mobarm.driving.scan import Scan, length, lengths
from drake_mobarm.driving.seen_map import SeenMap
from drake_mobarm.driving.touch import (
    Recovery,
    back_off,
    count_standing,
    has_stalled,
    touched_points,
)
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.robot.shape import RADIUS

# With more than this share of its rays missing, a scan is not to be trusted.
_MISSING_RAYS = 0.5
# Farther from W's origin than this [m] no pose makes sense.
_FARTHEST = 1e5
# How far the estimate may be off, at the target [m] and as a share of its
# distance: a way may end so far from it.
_NEAR_ENOUGH = 0.25
_ESTIMATE_ERROR = 0.15
# A place so near to the estimate [m] is worth a try: from there the target is
# seen from another side.
_WORTH_A_TRY = 0.6
# A target that has moved by this [m], or share of its distance, since the
# way was planned makes a new way.
_MOVED = 0.15
_MOVED_SHARE = 0.08
# A robot this far off its way [m] needs a new one.
_OFF_WAY = 0.6
# Waypoints this far ahead [m] do not slow the robot down.
_AHEAD = 1.2
# This near to the way's end [m] the robot is there.
_AT_END = 0.2
# Within this distance [m] a target is driven to directly where its corridor
# is free, up to as near to it as this [m].
_NEAR_TARGET = 1.5
_FREE_UP_TO = 0.2
# Where the robot may not be faster than this [m/s], the way is too narrow.
_PINCHED_SPEED = 0.03
# By this factor more often the robot forgets where it has touched something.
_TOUCHED_TRIES = 4
# In a tight place the robot tries these directions beside its way [rad], each
# radian of which counts as much as a piece of free way [m], and heads for a
# place this far ahead [m].
_OFFSETS = (0.0, *(side * 0.1 * n for n in range(1, 7) for side in (-1, 1)))
_OFFSET_COST = 0.05
_TIGHT_WAY = 0.6
# A place too narrow is at most this far ahead [m].
_PINCHED_AHEAD = 1.0


def update(
    state: MapAvoidanceState,
    pose_WB: ArrayLike,
    p_WT: ArrayLike,
    ranges: ArrayLike,
    range_max: float,
    period: float,
    parameters: MapAvoidanceParameters,
    known: KnownFloor | None = None,
) -> MapAvoidanceState:
    """Takes in one scan, and decides where to drive.

    Args:
        state: after the last scan; it is not changed.
        pose_WB: measured at the scan, [x, y, yaw] in m and rad, (3,).
        p_WT: the estimated target [m], (2,).
        ranges: [m], (rays,), in the order of `ray_angles`; NaN where missing.
        range_max: the lidar's longest range [m], which means "no return".
        period: from one scan to the next [s].
        parameters: how to drive.
        known: the floor that a plan of the building shows, if there is one.

    Returns:
        The state with the waypoint and speed limit to drive with. Where pose,
        target or scan cannot be used, the robot waits.
    """
    x, y, yaw = pose = tuple(np.asarray(pose_WB, dtype=float).tolist())
    estimate = np.asarray(p_WT, dtype=float)
    scanned = np.asarray(ranges, dtype=float)
    missing = np.count_nonzero(np.isnan(scanned)) / scanned.size
    usable = np.abs([x, y, yaw, *estimate]) < _FARTHEST
    if not usable.all() or missing > _MISSING_RAYS:
        return _wait(state, "wait")
    position = np.array([x, y])
    if state.plan_is_wrong:
        known = None
    # Where something was touched is a guess: the way avoids it, no more.
    remembered = no_places() if known is None else known.near(position)
    scan = Scan.from_ranges(position, yaw, scanned, range_max, remembered)
    moved = 0.0
    if state.target is not None:
        share = min(period / parameters.smoothing_time, 1.0)
        step = share * (estimate - state.target)
        estimate, moved = state.target + step, length(step)
    state = replace(
        state,
        map=state.map.with_scan(position, yaw, scanned, range_max),
        target=estimate,
        closest=min(state.closest + moved, length(estimate - position)),
        recovery=_recovery(state, pose, scan, period, parameters),
        pose=pose,
    )
    if has_stalled(state.recovery, parameters.touch):
        state = _with_touch(state, scan, parameters)
    if state.recovery.backs_off:
        return _back_off(state, scan, period, parameters)
    if state.shut is not None:
        return _wait(state, "give up")
    plan = _plan(state, scan, period, parameters, known)
    state = replace(state, plan=plan)
    return _drive(state, plan, scan, period, parameters, known)


def _wait(state: MapAvoidanceState, activity: str) -> MapAvoidanceState:
    recovery = replace(state.recovery, standing=0.0)
    waypoint = state.waypoint
    if state.pose is not None:
        # Straight ahead: no turning.
        waypoint = np.array(state.pose[:2]) + unit(state.pose[2])
    return replace(
        state,
        activity=activity,
        waypoint=waypoint,
        speed_limit=0.0,
        recovery=recovery,
    )


def _recovery(
    state: MapAvoidanceState,
    pose: tuple[float, ...],
    scan: Scan,
    period: float,
    parameters: MapAvoidanceParameters,
) -> Recovery:
    """Counts standing by the pose, not by the wheels: they may slip."""
    if state.pose is None:
        return state.recovery
    velocity = (
        math.dist(state.pose[:2], pose[:2]) / period,
        wrap_angle(pose[2] - state.pose[2]) / period,
    )
    return count_standing(
        state.recovery,
        scan,
        state.waypoint,
        state.speed_limit,
        velocity,
        period,
        parameters.touch,
    )


def _with_touch(
    state: MapAvoidanceState, scan: Scan, parameters: MapAvoidanceParameters
) -> MapAvoidanceState:
    """Marks what was touched, and begins to back off."""
    points = touched_points(scan, state.map.touched, _nearer_side(scan))
    return replace(
        state,
        map=state.map.with_touch(points),
        plan=None,
        halt=None,
        recovery=Recovery(backing=parameters.touch.back_time),
    )


def _back_off(
    state: MapAvoidanceState,
    scan: Scan,
    period: float,
    parameters: MapAvoidanceParameters,
) -> MapAvoidanceState:
    recovery, speed_limit = back_off(
        state.recovery,
        scan,
        RADIUS + parameters.margin,
        period,
        parameters.touch,
    )
    return replace(
        state, activity="back", recovery=recovery, speed_limit=speed_limit
    )


def _nearer_side(scan: Scan) -> int:
    """On which side the nearest thing ahead is seen: +1 right, -1 left."""
    ahead = scan.seen[scan.seen @ unit(scan.yaw) > 0]
    if not ahead.size:
        return 0
    nearest = ahead[np.argmin(lengths(ahead))]
    left = float(nearest @ unit(scan.yaw + np.pi / 2))
    return -1 if left > 0 else 1


def _plan(
    state: MapAvoidanceState,
    scan: Scan,
    period: float,
    parameters: MapAvoidanceParameters,
    known: KnownFloor | None,
) -> Plan:
    """The last plan where it still holds, or a new one."""
    target = state.target
    assert target is not None
    if state.plan is not None:
        plan = replace(state.plan, age=state.plan.age + period)
        if _holds(plan, target, scan, parameters):
            return plan
    tolerance = _NEAR_ENOUGH + _ESTIMATE_ERROR * state.closest
    last = None if state.plan is None else state.plan.route
    points, here, tried = state.map.points(), scan.position, state.tried
    cost = parameters.route
    route = None
    if known is not None:
        extra = known.unknown(points)
        route = known.find_route(
            extra, here, target, tolerance, cost, tried=tried, last=last
        )
    if route is None:
        route = find_route(
            points, here, target, tolerance, cost, tried=tried, last=last
        )
    return Plan(route, target)


def _holds(
    plan: Plan, target: Array, scan: Scan, parameters: MapAvoidanceParameters
) -> bool:
    moved = length(target - plan.target)
    distance = length(target - scan.position)
    return (
        plan.age <= parameters.replan_time
        and moved <= max(_MOVED, _MOVED_SHARE * distance)
        and lengths(plan.route.places - scan.position).min() <= _OFF_WAY
        and not is_shut(plan.route, scan, parameters.route)
    )


def _drive(
    state: MapAvoidanceState,
    plan: Plan,
    scan: Scan,
    period: float,
    parameters: MapAvoidanceParameters,
    known: KnownFloor | None,
) -> MapAvoidanceState:
    """Heads for the target or along the way, and sees whether it gets on."""
    route, radius = plan.route, RADIUS + parameters.margin
    at_end = length(route.places[-1] - scan.position) < _AT_END
    way = _way(state, route, at_end, scan, parameters)
    angle = math.atan2(way[1], way[0])
    limit = careful_speed(scan, angle, radius, parameters.care)
    if limit < _PINCHED_SPEED:
        # The lattice may lead past the middle of a tight place.
        angle = _freest(scan, angle)
        limit = careful_speed(scan, angle, RADIUS, parameters.care)
        way = _TIGHT_WAY * unit(angle)
    here = (*scan.position.tolist(), scan.yaw)
    halt = count_halt(state.halt, here, at_end, period)
    state = replace(
        state,
        activity="drive",
        waypoint=scan.position + way,
        speed_limit=limit,
        halt=halt,
    )
    if halt.time < parameters.patience:
        return state
    if at_end:
        return _try_another(state, route, parameters, known)
    if limit < _PINCHED_SPEED:
        if known is not None and known.room(scan.position) < RADIUS:
            # What the plan shows there cannot be: the robot is there.
            return replace(state, plan=None, halt=None, plan_is_wrong=True)
        # Too narrow for the robot: that place is shut from now on.
        room = min(scan.free_length(angle, radius), _PINCHED_AHEAD)
        place = scan.position + (room + RADIUS) * unit(angle)
        shut = state.map.with_touch(place[None])
        return replace(state, map=shut, plan=None, halt=None)
    return _with_touch(state, scan, parameters)


def _freest(scan: Scan, angle: float) -> float:
    """Of the directions about one [rad], that in which the robot fits best."""
    return max(
        (angle + offset for offset in _OFFSETS),
        key=lambda a: (
            min(scan.free_length(a, RADIUS), _TIGHT_WAY)
            - _OFFSET_COST * abs(a - angle)
        ),
    )


def _way(
    state: MapAvoidanceState,
    route: Route,
    at_end: bool,
    scan: Scan,
    parameters: MapAvoidanceParameters,
) -> Array:
    """p_BQ_W, from the robot to the next waypoint [m], (2,)."""
    assert state.target is not None
    to_target = state.target - scan.position
    distance = length(to_target)
    touched = state.map.touched - scan.position
    if distance < _NEAR_TARGET:
        free = scan.free_length(
            math.atan2(to_target[1], to_target[0]), RADIUS + parameters.margin
        )
        unseen = clearance_ahead(to_target[None], touched)[0]
        if at_end or (
            free >= distance - _FREE_UP_TO
            and unseen > parameters.route.shut_clearance
        ):
            return to_target
    points = np.vstack([scan.points, touched])
    way, is_end = place_ahead(
        route, scan.position, points, parameters.lookahead
    )
    if is_end:
        return way
    return way * max(1.0, _AHEAD / max(length(way), 1e-6))


def _try_another(
    state: MapAvoidanceState,
    route: Route,
    parameters: MapAvoidanceParameters,
    known: KnownFloor | None,
) -> MapAvoidanceState:
    """What to do at the end of a way where nothing came of waiting."""
    target, end = state.target, route.places[-1]
    assert target is not None
    state = replace(state, plan=None, halt=None)
    tolerance = _NEAR_ENOUGH + _ESTIMATE_ERROR * state.closest
    if route.miss <= max(tolerance, _WORTH_A_TRY):
        return replace(state, tried=np.vstack([state.tried, end]))
    if known is not None:
        return replace(state, tried=no_places(), plan_is_wrong=True)
    # Where something was touched is a guess, and worth more tries.
    tries = _TOUCHED_TRIES if len(state.map.touched) else 1
    if state.forgotten < tries * parameters.forgetting:
        touched = state.map.touched if state.forgotten == 0 else no_places()
        return replace(
            state,
            map=SeenMap(touched=touched),
            tried=no_places(),
            forgotten=state.forgotten + 1,
        )
    return replace(state, shut=_what_shuts(end, target, state.map))


def _what_shuts(end: Array, target: Array, seen: SeenMap) -> Array:
    """p_WP of the first thing from the end of a way to the target [m]."""
    way = target - end
    angle = math.atan2(way[1], way[0])
    met = blocking_point(angle, seen.points() - end, RADIUS)
    return target if met is None else end + met
