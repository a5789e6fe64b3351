"""Our planner: the cheapest way over the floor plan and all that was seen.

It drives as `driving.map_avoidance` does, knowing the floor plan from the
start: ways are planned over its floor, things that are on it and not in the
lidar's plane, such as table tops, are kept clear of, and what the lidar sees
besides is added. Where no way over the plan leads to the target, the robot
goes on without the plan.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from drake_mobarm.driving import map_avoidance
from drake_mobarm.driving.known_floor import KnownFloor
from drake_mobarm.driving.map_avoidance_state import (
    MapAvoidanceParameters,
    MapAvoidanceState,
    initial_state,
)
from drake_mobarm.driving.waypoint import ControllerParameters, drive_to
from drake_mobarm.geometry import Array, is_pose, wrap_angle
from drake_mobarm.immutable import Immutable
from drake_mobarm.navigation.planner import PlannerState
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.sensors.lidar import LidarParameters

# A robot whose way is more than this off its heading [rad] drives it with its
# other end ahead.
_OTHER_END = 2.0
# At the end of a way that leads this near to a target [m], closer than that
# [m], the robot is there if it cannot stand at the target itself.
_BESIDE = 0.9
_AT_END = 0.15

# For so long [s] the target's estimate may jump: there is no arrival while it
# is farther than this from what it was of late [m].
_SETTLING = 3.0
_STEADY = 0.15


@dataclass(frozen=True, eq=False)
class MapMemory(Immutable):
    """What the map planner remembers.

    Attributes:
        avoidance: of driving by a map, for a robot B' that is B, or B turned
            by half a turn while it drives backwards.
        backwards: whether it does.
        time: since the first scan [s].
    """

    avoidance: MapAvoidanceState = field(default_factory=initial_state)
    backwards: bool = False
    time: float = 0.0


class MapPlanner:
    """Leads over the floor plan and what the lidar sees.

    Args:
        parameters: how to drive.
        controller: gains of the way to a waypoint.
        lidar: whose ranges it reads.
        speed_limit: the robot's [m/s, rad/s], (2,).
        arrival_distance: from the target, within which the robot is there
            [m].
        may_reverse: whether it may drive backwards where that saves turning.
        known: the floor of the plan, if there is one.
    """

    def __init__(
        self,
        parameters: MapAvoidanceParameters,
        controller: ControllerParameters,
        lidar: LidarParameters,
        speed_limit: tuple[float, ...],
        arrival_distance: float,
        may_reverse: bool = False,
        known: KnownFloor | None = None,
    ) -> None:
        self._parameters, self._controller = parameters, controller
        self._range_max, self._period = lidar.range_max, 1 / lidar.rate
        self._speed_limit = speed_limit
        self._arrival_distance = arrival_distance
        # Half a turn has to be a whole number of rays.
        self._may_reverse = may_reverse and lidar.rays % 2 == 0
        self._known = known

    def initial_state(self) -> PlannerState:
        """Nothing seen, standing still."""
        return PlannerState(memory=MapMemory())

    def update(
        self, state: PlannerState, pose_WB: Array, p_WT: Array, ranges: Array
    ) -> PlannerState:
        """Where to drive after a scan; see `PlannerLaw`."""
        backwards = state.memory.backwards
        pose = _turned(pose_WB, backwards)
        if backwards:
            ranges = np.roll(ranges, ranges.size // 2)
        avoidance = map_avoidance.update(
            state.memory.avoidance,
            pose,
            p_WT,
            ranges,
            self._range_max,
            self._period,
            self._parameters,
            self._known,
        )
        if self._may_reverse and avoidance.speed_limit > 0:
            dx, dy = (avoidance.waypoint - pose[:2]).tolist()
            error = wrap_angle(math.atan2(dy, dx) - float(pose[2]))
            backwards ^= abs(error) > _OTHER_END
        distance = np.hypot(*(p_WT - pose[:2]))
        near = bool(distance < self._arrival_distance) or self._is_beside(
            avoidance, pose, p_WT
        )
        time = state.memory.time + self._period
        plan = avoidance.plan
        return replace(
            state,
            memory=MapMemory(avoidance, backwards, time),
            arrived=near and (time > _SETTLING or _is_steady(avoidance, p_WT)),
            shut=avoidance.shut,
            paths=() if plan is None else (plan.route.places,),
        )

    def command(
        self, state: PlannerState, pose_WB: Array
    ) -> tuple[float, float]:
        """The velocity that drives to the waypoint of the last scan."""
        avoidance, backwards = state.memory.avoidance, state.memory.backwards
        pose = _turned(pose_WB, backwards).tolist()
        if state.arrived or not is_pose(pose):
            return 0.0, 0.0
        forwards = -1.0 if backwards else 1.0
        top, turn_rate = self._speed_limit
        if avoidance.speed_limit < 0:
            return forwards * max(avoidance.speed_limit, -top), 0.0
        speed, turn = drive_to(
            pose,
            avoidance.waypoint.tolist(),
            (min(avoidance.speed_limit, top), turn_rate),
            self._controller,
        )
        return forwards * speed, turn

    def _is_beside(
        self, avoidance: MapAvoidanceState, pose: Array, p_WT: Array
    ) -> bool:
        """Whether it is as near as it gets to a target on or beside a thing."""
        # It waits where pose, target or scan cannot be used.
        if avoidance.plan is None or avoidance.activity == "wait":
            return False
        route = avoidance.plan.route
        at_end = np.hypot(*(route.places[-1] - pose[:2])) < _AT_END
        if not at_end or route.miss > _BESIDE:
            return False
        points = avoidance.map.points()
        room = np.hypot(*(points - p_WT).T).min(initial=np.inf)
        if self._known is not None and not avoidance.plan_is_wrong:
            room = min(room, self._known.room(p_WT))
        return bool(room < RADIUS)


def _turned(pose_WB: Array, backwards: bool) -> Array:
    """X_WB', [x, y, yaw] in m and rad, (3,)."""
    turned = np.array(pose_WB, dtype=float)
    turned[2] += math.pi if backwards else 0.0
    return turned


def _is_steady(avoidance: MapAvoidanceState, p_WT: Array) -> bool:
    """Whether an estimate is near to what it was of late."""
    if avoidance.target is None:
        return False
    return bool(np.hypot(*(p_WT - avoidance.target)) < _STEADY)
