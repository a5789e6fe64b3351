"""The station: the robot as a user would meet it, in a building.

Plant, sensors and two drivers. All that leaves it is what a real robot would
tell, but for the one port `ground_truth`, which only metrics may read.

Sensors sample at whole multiples of their periods from time 0, odometry at
every hundredth of a second. Whoever reads them should do so half a hundredth
later (`PROCESSING_DELAY`): the odometry that it sees was then taken at the
same instant as the reading, if that has a period of whole hundredths.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from pydrake.common import RandomDistribution
from pydrake.geometry import (
    AddContactMaterial,
    Box,
    CollisionFilterDeclaration,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    CoulombFriction,
    MultibodyPlant,
    MultibodyPlantConfig,
    PointPairContactInfo,
)
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import MatrixGain, Multiplexer, RandomSource

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array
from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.sensors.beacon import BeaconParameters
from drake_mobarm.sensors.lidar import LidarParameters
from drake_mobarm.sensors.systems import (
    BaseTruth,
    BeaconSensor,
    GroundTruthMonitor,
    Lidar,
    Odometry,
)
from drake_mobarm.station.arm_drive import ArmDriveParameters
from drake_mobarm.station.base_drive import BaseDriveParameters
from drake_mobarm.station.systems import ArmDriver, BaseDriver
from drake_mobarm.world.obstacles import outlines, outlines_to_segments
from drake_mobarm.world.sdf import MODELS, World, add_world

ODOMETRY_RATE = 100.0
"""Samples of the wheels' encoders a second [Hz]."""

PROCESSING_DELAY = 0.005
"""How long after a sample a system should work on it [s]."""

STOWED = (0.0, -1.1, 1.55, 0.0, 0.5, 0.0)
"""Joint angles [rad] that keep the arm within the base's outline."""

ANTENNA_POSITION = (0.2, 0.0)
"""p_BA of the URDF's frame `antenna` on the floor plan [m]."""

_ROLLING = {"wheel_left", "wheel_right", "caster_front", "caster_rear"}
_GROUND_SIZE = 200.0
_GROUND_STIFFNESS = 1e8  # [N/m], as the wheels'


@dataclass(kw_only=True)
class StationParameters:
    """How the station is simulated, sensed and driven.

    Attributes:
        time_step: of the plant [s].
        stowed: the arm's joints at the start [rad], (6,).
        lidar: the scanner.
        beacon: the antenna array.
        base_drive: the base driver.
        arm_drive: the arm driver.
    """

    time_step: float = 0.01
    stowed: list[float] = field(default_factory=lambda: list(STOWED))
    lidar: LidarParameters = field(default_factory=LidarParameters)
    beacon: BeaconParameters = field(default_factory=BeaconParameters)
    base_drive: BaseDriveParameters = field(default_factory=BaseDriveParameters)
    arm_drive: ArmDriveParameters = field(default_factory=ArmDriveParameters)

    def __post_init__(self) -> None:
        require(
            0 < self.time_step <= 0.01,
            "time_step",
            self.time_step,
            "above 0, up to 0.01 s",
        )
        require(
            len(self.stowed) == 6 and bool(np.isfinite(self.stowed).all()),
            "stowed",
            self.stowed,
            "six finite joint angles",
        )


def build_station(
    world: World,
    start: list[float],
    beacon: list[float],
    noise: int,
    parameters: StationParameters,
) -> Diagram:
    """Wires the station.

    Args:
        world: the building.
        start: X_WB of the base, [x, y, yaw] in m and rad.
        beacon: p_WT of the beacon [m], at the antenna's height.
        noise: of the beacon's readings, a configuration of Table 2.2.
        parameters: everything else.

    Returns:
        A diagram with the inputs `commanded_base_velocity` (BaseVelocity) and
        `desired_arm_state` (ArmState), and the outputs `measured_base_pose`
        (PlanarPose), `measured_base_velocity` (BaseVelocity),
        `measured_wheel_state` (WheelState), `measured_arm_state` (ArmState),
        `lidar_ranges` (rays), `beacon_reading` (BeaconReading),
        `ground_truth` (GroundTruth) and `query_object` for drawing.
    """
    builder = DiagramBuilder()
    plant, scene_graph = add_plant(builder, world, start, parameters)
    robot = plant.GetModelInstanceByName("mobile_arm")
    positions = plant.num_positions(robot)
    states = plant.num_multibody_states(robot)

    wheel_state = builder.AddNamedSystem(
        "wheel_encoders",
        MatrixGain(_select_joints(plant, ("wheel_left", "wheel_right"))),
    )
    arm_state = builder.AddNamedSystem(
        "arm_encoders", MatrixGain(_select_joints(plant, ARM_JOINTS))
    )
    truth = builder.AddNamedSystem("base_truth", BaseTruth(positions, states))
    monitor = builder.AddNamedSystem(
        "ground_truth",
        GroundTruthMonitor(
            _obstacle_contact_test(plant), rate=1 / parameters.time_step
        ),
    )
    odometry = builder.AddNamedSystem(
        "odometry",
        Odometry(parameters.base_drive.base, start, rate=ODOMETRY_RATE),
    )
    lidar = builder.AddNamedSystem(
        "lidar", Lidar(parameters.lidar, *_sides_at_scan_height(plant, world))
    )
    antenna = builder.AddNamedSystem(
        "beacon",
        BeaconSensor(
            parameters.beacon,
            noise,
            np.array(ANTENNA_POSITION),
            np.array(beacon),
        ),
    )
    lidar_noise = builder.AddNamedSystem(
        "lidar_noise",
        RandomSource(
            RandomDistribution.kGaussian,
            parameters.lidar.rays,
            1 / parameters.lidar.rate,
        ),
    )
    beacon_noise = builder.AddNamedSystem(
        "beacon_noise",
        RandomSource(
            RandomDistribution.kUniform, 3, 1 / parameters.beacon.rate
        ),
    )
    base_driver = builder.AddNamedSystem(
        "base_driver", BaseDriver(parameters.base_drive)
    )
    arm_driver = builder.AddNamedSystem(
        "arm_driver", ArmDriver(parameters.arm_drive, parameters.stowed)
    )
    torques = builder.AddNamedSystem("torques", Multiplexer([2, 6]))

    robot_state = plant.get_state_output_port(robot)
    for reader in (wheel_state, arm_state, truth):
        builder.Connect(robot_state, reader.get_input_port())
    measured_wheels = wheel_state.get_output_port()
    measured_arm = arm_state.get_output_port()
    for sensor in (lidar, antenna, monitor):
        builder.Connect(
            truth.GetOutputPort("base_pose"), sensor.GetInputPort("base_pose")
        )
    builder.Connect(
        truth.GetOutputPort("base_velocity"),
        monitor.GetInputPort("base_velocity"),
    )
    builder.Connect(
        plant.get_contact_results_output_port(),
        monitor.GetInputPort("contact_results"),
    )
    builder.Connect(lidar_noise.get_output_port(), lidar.GetInputPort("noise"))
    builder.Connect(
        beacon_noise.get_output_port(), antenna.GetInputPort("noise")
    )
    for reader in (odometry, base_driver):
        builder.Connect(
            measured_wheels, reader.GetInputPort("measured_wheel_state")
        )
    builder.Connect(measured_arm, arm_driver.GetInputPort("measured_arm_state"))
    builder.Connect(base_driver.get_output_port(), torques.get_input_port(0))
    builder.Connect(arm_driver.get_output_port(), torques.get_input_port(1))
    builder.Connect(
        torques.get_output_port(), plant.get_actuation_input_port(robot)
    )

    builder.ExportInput(
        base_driver.GetInputPort("commanded_base_velocity"),
        "commanded_base_velocity",
    )
    builder.ExportInput(
        arm_driver.GetInputPort("desired_arm_state"), "desired_arm_state"
    )
    for port, name in (
        (odometry.GetOutputPort("measured_base_pose"), None),
        (odometry.GetOutputPort("measured_base_velocity"), None),
        (measured_wheels, "measured_wheel_state"),
        (measured_arm, "measured_arm_state"),
        (lidar.GetOutputPort("lidar_ranges"), None),
        (antenna.GetOutputPort("beacon_reading"), None),
        (monitor.GetOutputPort("ground_truth"), None),
        (scene_graph.get_query_output_port(), "query_object"),
    ):
        builder.ExportOutput(port, name or port.get_name())
    station: Diagram = builder.Build()
    station.set_name("station")
    return station


def add_plant(
    builder: DiagramBuilder,
    world: World,
    start: list[float],
    parameters: StationParameters,
) -> tuple[MultibodyPlant, SceneGraph]:
    """The robot in the world, standing at `start`, its arm stowed."""
    plant, scene_graph = AddMultibodyPlant(
        builder=builder,
        config=MultibodyPlantConfig(
            time_step=parameters.time_step,
            contact_model="point",
            discrete_contact_approximation="lagged",
            use_sampled_output_ports=False,
        ),
    )
    Parser(plant).AddModels(str(MODELS / "mobile_arm.urdf"))
    obstacles = add_world(plant, world)
    ground = ProximityProperties()
    AddContactMaterial(
        friction=CoulombFriction(1.0, 1.0),
        point_stiffness=_GROUND_STIFFNESS,
        properties=ground,
    )
    plant.RegisterCollisionGeometry(
        plant.world_body(),
        RigidTransform([0, 0, -_GROUND_SIZE / 2]),
        Box(_GROUND_SIZE, _GROUND_SIZE, _GROUND_SIZE),
        "ground",
        ground,
    )
    scene_graph.collision_filter_manager().Apply(
        CollisionFilterDeclaration().ExcludeBetween(
            _rolling_geometries(plant),
            GeometrySet(obstacles),
        )
    )
    plant.Finalize()
    place_robot(plant, start, parameters.stowed)
    return plant, scene_graph


def place_robot(
    plant: MultibodyPlant, start: list[float], joints: Sequence[float] = STOWED
) -> None:
    """Makes a place and arm joints the default ones of a plant's robot.

    Args:
        plant: finalized, with the robot in it.
        start: X_WB of the base, [x, y, yaw] in m and rad.
        joints: of the arm [rad], (6,).
    """
    x, y, yaw = start
    plant.SetDefaultFloatingBaseBodyPose(
        plant.GetBodyByName("base"),
        RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, 0.0]),
    )
    for name, q in zip(ARM_JOINTS, joints, strict=True):
        plant.GetJointByName(name).set_default_positions([q])


def _rolling_geometries(plant: MultibodyPlant) -> GeometrySet:
    return GeometrySet(
        [
            geometry
            for name in sorted(_ROLLING)
            for geometry in plant.GetCollisionGeometriesForBody(
                plant.GetBodyByName(name)
            )
        ]
    )


def _select_joints(plant: MultibodyPlant, names: tuple[str, ...]) -> Array:
    """Picks joint positions, then velocities, out of the robot's state."""
    joints = [plant.GetJointByName(name) for name in names]
    rows = [joint.position_start() for joint in joints] + [
        plant.num_positions() + joint.velocity_start() for joint in joints
    ]
    selection: Array = np.eye(plant.num_multibody_states())[rows]
    return selection


def _sides_at_scan_height(
    plant: MultibodyPlant, world: World
) -> tuple[Array, Array]:
    X_BL = plant.GetFrameByName("lidar").GetFixedPoseInBodyFrame()
    height = X_BL.translation()[2]
    return outlines_to_segments(outlines(world.obstacles, height, height))


def _obstacle_contact_test(
    plant: MultibodyPlant,
) -> Callable[[PointPairContactInfo], bool]:
    robot = plant.GetModelInstanceByName("mobile_arm")
    bodies = [plant.get_body(index) for index in plant.GetBodyIndices(robot)]
    rolling = {int(b.index()) for b in bodies if b.name() in _ROLLING}
    touchable = {int(b.index()) for b in bodies} - rolling

    def is_obstacle_contact(contact: PointPairContactInfo) -> bool:
        a, b = int(contact.bodyA_index()), int(contact.bodyB_index())
        if a in rolling or b in rolling:
            return False  # They meet nothing but the ground.
        return (a in touchable) != (b in touchable)

    return is_obstacle_contact
