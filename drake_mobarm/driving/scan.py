"""What is around a robot with a lidar, and driving carefully in it."""

from dataclasses import dataclass, replace

import numpy as np

from drake_mobarm.driving.gaps import (
    fill_missing,
    free_length,
    unit,
)
from drake_mobarm.geometry import Array
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    AvoidanceState,
)
from drake_mobarm.sensors.lidar import ray_angles


@dataclass(frozen=True)
class View:
    """What is around the robot now, relative to its centre, in W's axes."""

    position: Array
    yaw: float
    seen: Array
    points: Array
    target: Array
    distance: float
    bearing: float
    radius: float
    tight_radius: float
    tolerance: float


def look(
    state: AvoidanceState,
    position: Array,
    yaw: float,
    scan: Array,
    parameters: AvoidanceParameters,
) -> View:
    """The view of a scan.

    Args:
        state: with the target and what was felt and not seen.
        position: p_WB [m], (2,).
        yaw: of the base [rad].
        scan: ranges [m], (rays,), in the order of `ray_angles`.
        parameters: of the rules.
    """
    distances = fill_missing(scan)
    returned = distances < parameters.range_max - 0.05
    angles = yaw + ray_angles(scan.size)[returned]
    seen = distances[returned, None] * unit(angles)
    assert state.target is not None
    target = state.target - position
    distance = length(target)
    margin = parameters.tight_margin if state.tight else parameters.margin
    return View(
        position=position,
        yaw=yaw,
        seen=seen,
        points=np.vstack([seen, state.phantoms - position]),
        target=target,
        distance=distance,
        bearing=float(np.arctan2(target[1], target[0])),
        radius=parameters.radius + margin,
        tight_radius=parameters.radius + parameters.tight_margin,
        # The estimate errs more from afar, and may then lie inside things.
        tolerance=min(0.25 + 0.15 * distance, distance),
    )


def drive(
    state: AvoidanceState,
    view: View,
    way: Array,
    parameters: AvoidanceParameters,
) -> AvoidanceState:
    """Sets the waypoint, and a speed to stop from before what is seen."""
    bearing = float(np.arctan2(way[1], way[0]))
    room = min(
        free_ahead(view, bearing, view.tight_radius),
        free_ahead(view, view.yaw, view.tight_radius) - 0.03,
    )
    stopping = np.sqrt(2 * parameters.deceleration * max(room, 0.0))
    return replace(
        state,
        waypoint=view.position + way,
        speed_limit=min(float(stopping), _careful_speed(view, parameters)),
    )


def _careful_speed(view: View, parameters: AvoidanceParameters) -> float:
    """Slower beside things: they may reach farther out than is seen."""
    ahead = view.seen[view.seen @ unit(view.yaw) > -0.1]
    gap = float(lengths(ahead).min(initial=np.inf)) - view.tight_radius
    share = min(max(gap / parameters.care_distance, 0.0), 1.0)
    return parameters.care_speed + share * (
        parameters.max_speed - parameters.care_speed
    )


def free_ahead(view: View, angle: float, radius: float) -> float:
    """How far [m] a disc of a radius [m] can go at an angle in W [rad]."""
    return free_length(angle, view.points, radius)


def length(vector: Array) -> float:
    """Of a vector (2,)."""
    return float(np.hypot(vector[0], vector[1]))


def lengths(vectors: Array) -> Array:
    """Of vectors (n, 2), (n,)."""
    hypotenuses: Array = np.hypot(vectors[:, 0], vectors[:, 1])
    return hypotenuses
