"""Parameters and memory of driving by a map, in `map_avoidance`."""

import math
from dataclasses import dataclass, field

import numpy as np

from drake_mobarm.checks import at_least, positive
from drake_mobarm.driving.careful_speed import CareParameters
from drake_mobarm.driving.route import Route, RouteParameters
from drake_mobarm.driving.seen_map import SeenMap
from drake_mobarm.driving.touch import Recovery, TouchParameters
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.immutable import Immutable

# A robot that has moved by less than this [m] and turned by less than this
# [rad] makes no progress.
_PROGRESS = 0.06
_PROGRESS_TURN = 0.3


@frozen
class MapAvoidanceParameters:
    """How a robot drives by a map of what it sees.

    All numbers are finite and positive.

    Attributes:
        margin: clearance kept around the robot [m].
        deceleration: to stop before a thing that is seen [m/s^2].
        care_speed: right beside things that are seen [m/s].
        care_gain: how much faster for each metre of clearance to them [1/s].
        lookahead: along the way, up to the farthest waypoint [m].
        smoothing_time: in which the target's estimate is followed [s].
        replan_time: after which a way is planned anew at the latest [s].
        patience: at the way's end, or without progress, until something else
            is tried [s].
        forgetting: how often all that was seen is forgotten before the robot
            gives up [-], at least 1; four times as often where something
            unseen was touched.
        route: what a way costs.
        touch: what to do on touching something unseen.
    """

    margin: float = 0.015
    deceleration: float = 0.8
    care_speed: float = 0.4
    care_gain: float = 0.75
    lookahead: float = 2.0
    smoothing_time: float = 1.0
    replan_time: float = 2.0
    patience: float = 2.0
    forgetting: int = 2
    route: RouteParameters = field(default_factory=RouteParameters)
    touch: TouchParameters = field(default_factory=TouchParameters)

    def __post_init__(self) -> None:
        positive(
            self,
            "margin",
            "deceleration",
            "care_speed",
            "care_gain",
            "lookahead",
            "smoothing_time",
            "replan_time",
            "patience",
        )
        at_least(self, 1, "forgetting")

    @property
    def care(self) -> CareParameters:
        """Those of the careful speed."""
        return CareParameters(
            deceleration=self.deceleration,
            care_speed=self.care_speed,
            care_gain=self.care_gain,
        )


@dataclass(frozen=True, eq=False)
class Plan:
    """The way that the robot is on.

    Attributes:
        route: the way.
        target: p_WT that it was planned for [m], (2,).
        age: since then [s].
    """

    route: Route
    target: Array
    age: float = 0.0


@dataclass(frozen=True)
class Halt:
    """How long the robot has made no progress.

    Attributes:
        pose: X_WB since when it has not, [x, y, yaw] in m and rad.
        time: since then [s].
    """

    pose: tuple[float, float, float]
    time: float = 0.0


def count_halt(
    halt: Halt | None,
    pose: tuple[float, float, float],
    at_end: bool,
    period: float,
) -> Halt:
    """Counts how long there was no progress; at a way's end it goes on.

    Args:
        halt: after the last scan; None before one.
        pose: X_WB, [x, y, yaw] in m and rad.
        at_end: whether the robot is at its way's end.
        period: since the last scan [s].
    """
    if halt is None:
        return Halt(pose)
    if (
        math.dist(halt.pose[:2], pose[:2]) > _PROGRESS
        or abs(wrap_angle(halt.pose[2] - pose[2])) > _PROGRESS_TURN
    ):
        return Halt(pose, halt.time + period if at_end else 0.0)
    return Halt(halt.pose, halt.time + period)


def no_places() -> Array:
    """An empty list of places, (0, 2)."""
    return np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class MapAvoidanceState(Immutable):
    """What the robot decided last, and what it remembers.

    Attributes:
        waypoint: p_WQ to drive to [m], (2,).
        speed_limit: [m/s]; negative: back straight off at that speed.
        activity: what it does: wait, drive, back or give up.
        map: what it has seen and touched.
        pose: X_WB at the last scan, [x, y, yaw] in m and rad.
        target: p_WT, the smoothed estimate [m], (2,).
        closest: how near the robot has been to it, and how far it has moved
            since [m]: the estimate is as good as from there.
        plan: the way to it; None where it has to be planned.
        recovery: from touching something unseen.
        halt: of no progress; None before one.
        tried: ends of ways at which nothing came of waiting [m], (n, 2).
        plan_is_wrong: whether no way over the plan of the building leads to
            the target, and the robot goes on without the plan.
        forgotten: how often all that was seen was forgotten [-].
        shut: p_WP of what shuts the last way [m], (2,), once it gives up.
    """

    waypoint: Array
    speed_limit: float = 0.0
    activity: str = "wait"
    map: SeenMap = field(default_factory=SeenMap)
    pose: tuple[float, float, float] | None = None
    target: Array | None = None
    closest: float = np.inf
    plan: Plan | None = None
    recovery: Recovery = field(default_factory=Recovery)
    halt: Halt | None = None
    tried: Array = field(default_factory=no_places)
    plan_is_wrong: bool = False
    forgotten: int = 0
    shut: Array | None = None


def initial_state() -> MapAvoidanceState:
    """Nothing seen, standing still."""
    return MapAvoidanceState(np.zeros(2))
