"""The elements of the vectors that the systems exchange, by name."""

from typing import Any

from pydrake.common.containers import namedview

from drake_mobarm.joints import ARM_JOINTS


def size(elements: Any) -> int:
    """The number of elements of one of the named views below."""
    return len(elements.get_fields())


PlanarPose = namedview("PlanarPose", ["x", "y", "yaw"])
"""X_WB on the floor [m, m, rad]."""

BaseVelocity = namedview("BaseVelocity", ["v", "w"])
"""Forward and turning speed [m/s, rad/s]."""

WheelState = namedview(
    "WheelState", ["angle_left", "angle_right", "speed_left", "speed_right"]
)
"""Wheel joints [rad, rad, rad/s, rad/s]."""

ArmState = namedview(
    "ArmState",
    [
        *(f"{joint}_q" for joint in ARM_JOINTS),
        *(f"{joint}_v" for joint in ARM_JOINTS),
    ],
)
"""Arm joints: six positions [rad], then six velocities [rad/s]."""

BeaconReading = namedview("BeaconReading", ["angle", "rssi", "valid"])
"""Angle of arrival from the antenna's heading [rad], strength [dBm], and 1
where there is a reading (0: angle and rssi are NaN)."""

TargetEstimate = namedview("TargetEstimate", ["x", "y", "known"])
"""p_WT on the floor [m, m], and 1 once there is an estimate."""

Waypoint = namedview("Waypoint", ["x", "y", "speed_limit"])
"""Where to drive next, p_WQ [m, m], and how fast at most [m/s]; a negative
limit means: straight backwards. NaN for x and y: turn on the spot."""

GivenUp = namedview("GivenUp", ["given_up", "x", "y"])
"""1 once a robot sees no way on, and where the way is shut [m, m] (0 and 0
before)."""

BestStand = namedview(
    "BestStand",
    [
        "x",
        "y",
        "yaw",
        *(f"{joint}_q" for joint in ARM_JOINTS),
        "objective",
        "known",
    ],
)
"""Where to stand, X_WB [m, m, rad], the arm's joints there [rad], what it is
worth (4.12) [-], and 1 where there is such a place (0: the others are NaN)."""

NavigationForces = namedview(
    "NavigationForces",
    [
        f"{force}_{axis}"
        for force in ("attraction", "repulsion", "highway")
        for axis in "xy"
    ],
)
"""The forces of a potential field at the robot, in W [1/m]."""

GroundTruth = namedview(
    "GroundTruth", ["x", "y", "yaw", "v", "w", "touching", "contacts"]
)
"""True pose [m, m, rad] and velocity [m/s, rad/s] of the base, 1 while the
robot touches an obstacle, and how often it has."""

SIGNALS = {
    "commanded_base_velocity": BaseVelocity,
    "desired_arm_state": ArmState,
    "measured_base_pose": PlanarPose,
    "measured_base_velocity": BaseVelocity,
    "measured_wheel_state": WheelState,
    "measured_arm_state": ArmState,
    "beacon_reading": BeaconReading,
    "odometry_pose": PlanarPose,
    "estimated_target": TargetEstimate,
    "waypoint": Waypoint,
    "given_up": GivenUp,
    "best_stand": BestStand,
    "navigation_forces": NavigationForces,
    "ground_truth": GroundTruth,
}
"""The elements of each signal that has always the same ones, by its name."""


def sizes(*signals: str) -> dict[str, int]:
    """The numbers of elements of signals, by their names."""
    return {signal: size(SIGNALS[signal]) for signal in signals}


def element_names(signal: str, elements: int) -> list[str]:
    """Names of a signal's elements, or their numbers where they have none."""
    if signal in SIGNALS:
        return list(SIGNALS[signal].get_fields())
    return [str(index) for index in range(elements)]
