"""The station: the robot as a user would meet it, in a building.

Plant, sensors and two drivers. All that leaves it is what a real robot would
tell, but for the port `ground_truth`, which only metrics and views may read,
and `query_object`, for drawing.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.common import RandomDistribution
from pydrake.systems.framework import Diagram, System
from pydrake.systems.primitives import (
    ConstantVectorSource,
    MatrixGain,
    Multiplexer,
    RandomSource,
)

from drake_mobarm.checks import require
from drake_mobarm.diagrams.wiring import NO_BLOCKS, Wiring
from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot.shape import ANTENNA_POSITION, LIDAR_HEIGHT
from drake_mobarm.sensors.beacon import Beacon
from drake_mobarm.sensors.systems import (
    BeaconSensor,
    Lidar,
    Odometry,
    ScanMatching,
)
from drake_mobarm.signals import sizes
from drake_mobarm.station.ground_truth import BaseTruth, GroundTruthMonitor
from drake_mobarm.station.parameters import PROCESSING_DELAY, StationParameters
from drake_mobarm.station.plant import (
    ROBOT,
    add_plant,
    obstacle_touch_test,
    select_joints,
)
from drake_mobarm.station.systems import ArmDriver, BaseDriver
from drake_mobarm.world.obstacles import outlines, outlines_to_segments
from drake_mobarm.world.world import World

STATION_BLOCKS = (
    "odometry",
    "localization",
    "lidar",
    "beacon",
    "base_driver",
    "arm_driver",
)
"""The station's blocks that a user may exchange; "localization" is there with
scan matching."""

_ODOMETRY_RATE = 100.0  # Samples of the wheels' encoders a second [Hz].


def build_station(
    world: World,
    start: Sequence[float],
    parameters: StationParameters,
    beacon: Beacon | None = None,
    blocks: Mapping[str, System] = NO_BLOCKS,
) -> Diagram:
    """Wires the station.

    Args:
        world: the building.
        start: X_WB of the base, [x, y, yaw] in m and rad.
        parameters: how it is simulated, sensed and driven.
        beacon: what the antenna array hears, if anything.
        blocks: systems in the places of some of `STATION_BLOCKS`.

    Returns:
        A diagram with the inputs `commanded_base_velocity` (BaseVelocity) and
        `desired_arm_state` (ArmState), and the outputs `measured_base_pose`
        (PlanarPose), `measured_base_velocity` (BaseVelocity),
        `measured_wheel_state` (WheelState), `measured_arm_state` (ArmState),
        `lidar_ranges` (rays), `beacon_reading` (BeaconReading; only with a
        beacon), `ground_truth` (GroundTruth) and `query_object` for drawing.

    Raises:
        ParameterError: world or start are not valid.
        BlockError: a block's ports do not fit, or its name is unknown.
    """
    require(isinstance(world, World), "world", world, "what load_world gives")
    pose = np.asarray(start, dtype=float)
    require(
        pose.shape == (3,) and bool(np.isfinite(pose).all()),
        "start",
        start,
        "[x, y, yaw], finite, in m and rad",
    )
    wiring = Wiring(blocks)
    plant, scene_graph = add_plant(
        wiring.builder, world, start, parameters.time_step, parameters.stowed
    )
    robot = plant.GetModelInstanceByName(ROBOT)
    wiring.offer("robot_state", plant.get_state_output_port(robot))
    wiring.offer("contact_results", plant.get_contact_results_output_port())
    wiring.offer("query_object", scene_graph.get_query_output_port())
    for name, joints in (
        ("wheel", ("wheel_left", "wheel_right")),
        ("arm", ARM_JOINTS),
    ):
        wiring.add_primitive(
            f"{name}_encoders",
            MatrixGain(select_joints(plant, joints)),
            f"measured_{name}_state",
            ["robot_state"],
        )
    num_states = plant.num_multibody_states(robot)
    wiring.add("base_truth", lambda: BaseTruth(num_states))
    wiring.add(
        "ground_truth",
        lambda: GroundTruthMonitor(
            plant.num_positions(robot),
            num_states,
            obstacle_touch_test(plant),
            rate=1 / parameters.time_step,
        ),
    )
    wiring.add(
        "odometry",
        lambda: Odometry(
            parameters.odometry,
            parameters.base_drive.base,
            start,
            _ODOMETRY_RATE,
        ),
        sizes("measured_base_pose", "measured_base_velocity"),
    )
    lidar, antenna = parameters.lidar, parameters.beacon
    sides = outlines_to_segments(
        outlines(world.obstacles, LIDAR_HEIGHT, LIDAR_HEIGHT)
    )
    wiring.add(
        "lidar", lambda: Lidar(lidar, *sides), {"lidar_ranges": lidar.rays}
    )
    if parameters.localization == "scan_matching":
        wiring.rename("measured_base_pose", "odometry_pose")
        wiring.add(
            "localization",
            lambda: ScanMatching(
                parameters.scan_matching, lidar, PROCESSING_DELAY / 2
            ),
            sizes("measured_base_pose"),
        )
    if beacon is not None:
        wiring.add(
            "beacon",
            lambda: BeaconSensor(antenna, beacon, np.array(ANTENNA_POSITION)),
            sizes("beacon_reading"),
        )
    wiring.add_primitive(
        "lidar_noise",
        RandomSource(RandomDistribution.kGaussian, lidar.rays, 1 / lidar.rate),
        "lidar_noise",
    )
    if beacon is not None:
        wiring.add_primitive(
            "beacon_noise",
            RandomSource(RandomDistribution.kUniform, 3, 1 / antenna.rate),
            "beacon_noise",
        )
    wiring.add(
        "base_driver",
        lambda: BaseDriver(parameters.base_drive),
        {"wheel_torque": 2},
    )
    wiring.add(
        "arm_driver",
        lambda: ArmDriver(parameters.arm_drive, parameters.stowed),
        {"arm_torque": len(ARM_JOINTS)},
    )
    wiring.add_primitive(
        "torques",
        Multiplexer([2, len(ARM_JOINTS)]),
        "actuation",
        ["wheel_torque", "arm_torque"],
    )
    wiring.builder.Connect(
        wiring.signal("actuation"), plant.get_actuation_input_port(robot)
    )
    wiring.export(
        "measured_base_pose",
        "measured_base_velocity",
        "measured_wheel_state",
        "measured_arm_state",
        "lidar_ranges",
        *(["beacon_reading"] if beacon is not None else []),
        "ground_truth",
        "query_object",
    )
    return wiring.build(
        "station",
        inputs=sizes("commanded_base_velocity", "desired_arm_state"),
    )


def add_stowing_and_ending(wiring: Wiring, stowed: Sequence[float]) -> None:
    """Holds the arm stowed, and ends a run at arrival or on giving up.

    Args:
        wiring: it has the signals `arrived` (1) and `given_up` (GivenUp), and
            gets `desired_arm_state` (ArmState) and `done` (1).
        stowed: the arm's joints [rad], (6,).
    """
    wiring.add_primitive(
        "stow",
        ConstantVectorSource([*stowed, *np.zeros(6)]),
        "desired_arm_state",
    )
    wiring.add_primitive(
        "endings", Multiplexer([1, 3]), "endings", ["arrived", "given_up"]
    )
    wiring.add_primitive(
        "ending", MatrixGain([[1.0, 1.0, 0.0, 0.0]]), "done", ["endings"]
    )
