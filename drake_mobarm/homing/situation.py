"""What the rules of `avoidance` decide on, and how they drive somewhere."""

from dataclasses import dataclass, replace

import numpy as np

from drake_mobarm.driving.careful_speed import careful_speed
from drake_mobarm.driving.gaps import free_around
from drake_mobarm.driving.scan import Scan, length
from drake_mobarm.geometry import Array
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    AvoidanceState,
    Follow,
    Leave,
    Seek,
)
from drake_mobarm.sensors.lidar import ray_angles

ESTIMATE_ERROR = 0.15
"""How far the target's estimate may be off, as a share of its distance."""

AHEAD = 1.2
"""Waypoints this far ahead [m] do not slow the robot down."""

# How near to the estimate [m] a way has to end, beside ESTIMATE_ERROR: the
# estimate may lie inside the thing that carries the beacon.
_NEAR_ENOUGH = 0.25
# This near to the target [m] a corridor may be tight: things may stand right
# beside it.
_NEAR_TARGET = 1.5
# Directions looked at for gaps and along boundaries: every 2 degrees.
_DIRECTIONS = 180


@dataclass(frozen=True, eq=False)
class Situation:
    """What the rules decide on in one update.

    Attributes:
        scan: what the lidar sees, with the unseen things that were touched.
        target: p_BT_W, relative to the robot and in W's axes [m], (2,).
        distance: to the target [m].
        bearing: of the target in W [rad].
        radius: of the disc about the robot that has to stay free [m].
        tight_radius: the same where there is no other way [m].
        tolerance: how near to the estimate a way has to end [m].
    """

    scan: Scan
    target: Array
    distance: float
    bearing: float
    radius: float
    tight_radius: float
    tolerance: float

    def target_is_free(self) -> bool:
        """Whether the corridor to the target is free, or near enough to it."""
        needed = self.distance - self.tolerance
        if self.scan.free_length(self.bearing, self.radius) >= needed:
            return True
        return (
            self.distance < _NEAR_TARGET
            and self.scan.free_length(self.bearing, self.tight_radius) >= needed
        )


@dataclass(frozen=True, eq=False)
class FreeAround:
    """How far the robot can go along directions of a full turn.

    Attributes:
        angles: the directions in W, counter-clockwise [rad], (n,).
        lengths: free lengths along them [m], (n,), at most the lidar's range.
    """

    angles: Array
    lengths: Array


def look(
    state: AvoidanceState,
    position: Array,
    yaw: float,
    ranges: Array,
    range_max: float,
    parameters: AvoidanceParameters,
) -> Situation:
    """The situation that a scan shows.

    Args:
        state: with a target, and the unseen things that were touched.
        position: p_WB [m], (2,).
        yaw: of the base in W [rad].
        ranges: [m], (rays,), in the order of `ray_angles`.
        range_max: the lidar's longest range [m].
        parameters: of the rules.
    """
    assert state.target is not None
    target = state.target - position
    distance = length(target)
    margin = parameters.tight_margin if state.tight else parameters.margin
    return Situation(
        scan=Scan.from_ranges(position, yaw, ranges, range_max, state.touched),
        target=target,
        distance=distance,
        bearing=float(np.arctan2(target[1], target[0])),
        radius=parameters.radius + margin,
        tight_radius=parameters.radius + parameters.tight_margin,
        tolerance=min(_NEAR_ENOUGH + ESTIMATE_ERROR * distance, distance),
    )


def look_around(situation: Situation) -> FreeAround:
    """The free lengths all around the robot."""
    scan = situation.scan
    return FreeAround(
        scan.yaw + ray_angles(_DIRECTIONS),
        free_around(
            scan.yaw - np.pi,
            _DIRECTIONS,
            scan.points,
            situation.radius,
            scan.range_max,
        ),
    )


def drive(
    state: AvoidanceState,
    situation: Situation,
    way: Array,
    parameters: AvoidanceParameters,
    *,
    rule: str,
    mode: Seek | Follow | Leave,
) -> AvoidanceState:
    """Sets the waypoint, and a careful speed on the way to it.

    Args:
        state: of the rules.
        situation: of this update.
        way: p_BQ_W, from the robot to the waypoint [m], (2,).
        parameters: of the rules.
        rule: the name of the rule that chose the way.
        mode: the state from now on.
    """
    scan = situation.scan
    return replace(
        state,
        rule=rule,
        mode=mode,
        waypoint=scan.position + way,
        speed_limit=careful_speed(
            scan,
            float(np.arctan2(way[1], way[0])),
            situation.tight_radius,
            parameters.care,
        ),
    )
