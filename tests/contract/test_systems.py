"""What every LeafSystem of the library keeps, whatever it does."""

import importlib
import inspect
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from pydrake.common.value import Value
from pydrake.geometry import Meshcat
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import ContactResults, MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import LeafSystem, PortDataType

import drake_mobarm
from drake_mobarm import signals
from drake_mobarm.driving.systems import WaypointController
from drake_mobarm.driving.waypoint import ControllerParameters
from drake_mobarm.homing.avoidance import AvoidanceParameters
from drake_mobarm.homing.filter import FilterEstimator, FilterParameters
from drake_mobarm.homing.systems import (
    ObstacleAvoidance,
    StraightToTarget,
    TargetEstimator,
)
from drake_mobarm.homing.view import HomingView
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.grid import plain_grid
from drake_mobarm.placement.objective import (
    ObjectiveParameters,
    PlacementObjective,
)
from drake_mobarm.placement.planner import PlannerParameters, nothing_planned
from drake_mobarm.placement.problem import StandProblem, ToolTarget
from drake_mobarm.placement.systems import RobotPoser, StandPlanner
from drake_mobarm.placement.view import PlacementView
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.differential_drive import DifferentialDrive
from drake_mobarm.robot.shape import STOWED, URDF
from drake_mobarm.sensors.beacon import (
    NOISE_CONFIGURATIONS,
    Beacon,
    BeaconParameters,
)
from drake_mobarm.sensors.lidar import LidarParameters
from drake_mobarm.sensors.rssi import RssiModel
from drake_mobarm.sensors.systems import BeaconSensor, Lidar, Odometry
from drake_mobarm.station.arm_drive import ArmDriveParameters
from drake_mobarm.station.base_drive import BaseDriveParameters
from drake_mobarm.station.ground_truth import BaseTruth, GroundTruthMonitor
from drake_mobarm.station.systems import ArmDriver, BaseDriver

WALL = (np.array([[2.0, 1.0]]), np.array([[2.0, -1.0]]))
ANTENNA = np.array([0.2, 0.0])
ESTIMATOR = (RssiModel(), ANTENNA, 20.0, 0.01)
FREE = FreeSpace.from_outlines([], 0.27, [0.0, 0.0])
GRID = plain_grid(FREE, 0.5)


def make_plant():
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(URDF))
    plant.Finalize()
    return plant


MAKE = {
    ArmDriver: lambda: ArmDriver(ArmDriveParameters(), list(STOWED)),
    BaseDriver: lambda: BaseDriver(BaseDriveParameters()),
    BaseTruth: lambda: BaseTruth(15, 29),
    BeaconSensor: lambda: BeaconSensor(
        BeaconParameters(), Beacon(position=[3.0, 1.0]), ANTENNA
    ),
    GroundTruthMonitor: lambda: GroundTruthMonitor(lambda contact: True, 50.0),
    HomingView: lambda: HomingView(Meshcat(), [3.0, 1.0]),
    TargetEstimator: lambda: TargetEstimator(
        FilterEstimator(FilterParameters(), NOISE_CONFIGURATIONS[5]),
        *ESTIMATOR,
    ),
    WaypointController: lambda: WaypointController(ControllerParameters()),
    Lidar: lambda: Lidar(LidarParameters(), *WALL),
    ObstacleAvoidance: lambda: ObstacleAvoidance(
        AvoidanceParameters(), LidarParameters(), 0.01
    ),
    Odometry: lambda: Odometry(DifferentialDrive(), [1.0, 2.0, 0.3], 50.0),
    PlacementView: lambda: PlacementView(
        Meshcat(), [1.0, 0.0, 0.5], [1.0, 0.0, 0.0]
    ),
    RobotPoser: lambda: RobotPoser(make_plant()),
    StandPlanner: lambda: StandPlanner(
        StandProblem(
            objective=PlacementObjective(
                ArmKinematics(), ObjectiveParameters()
            ),
            target=ToolTarget(
                position=[0.0, 0.0, 0.5], approach=[0.0, 0.0, -1.0]
            ),
            free=FREE,
        ),
        GRID,
        PlannerParameters(delay=0.01),
    ),
    StraightToTarget: StraightToTarget,
}
ABSTRACT = {
    "contact_results": Value(ContactResults()),
    "placement": Value(nothing_planned(GRID)),
}
RAYS = 360
VIEWS = {
    name: signals.size(view)
    for name, view in vars(signals).items()
    if isinstance(view, type) and hasattr(view, "get_fields")
}


def library_systems():
    root = Path(drake_mobarm.__file__).parent
    files = [
        *root.glob("*/systems.py"),
        *root.glob("*/view.py"),
        root / "station" / "ground_truth.py",
    ]
    found = set()
    for file in files:
        name = ".".join(file.relative_to(root.parent).with_suffix("").parts)
        for _, kind in inspect.getmembers(importlib.import_module(name)):
            if (
                inspect.isclass(kind)
                and issubclass(kind, LeafSystem)
                and kind.__module__ == name
                and not kind.__name__.startswith("_")
            ):
                found.add(kind)
    return found


def documentation(kind):
    """The docstring that tells the ports: its own or its base's."""
    text = inspect.getdoc(kind)
    if ".. pydrake_system::" not in text:
        text = inspect.getdoc(TargetEstimator)
    return text


def documented_ports(kind):
    block = documentation(kind).split(".. pydrake_system::")[1]
    block = re.split(r"\n(?=\S)", block)[0]
    return yaml.safe_load(inspect.cleandoc(block))


def fix_inputs(system, context, rng):
    for index in range(system.num_input_ports()):
        port = system.get_input_port(index)
        if port.get_data_type() == PortDataType.kAbstractValued:
            port.FixValue(context, ABSTRACT[port.get_name()])
        elif port.get_name() == "robot_state":
            port.FixValue(context, [1.0, *rng.uniform(0, 1, port.size() - 1)])
        else:
            values = rng.uniform(0.1, 1.0, port.size())
            if port.get_name() in ("estimated_target", "beacon_reading"):
                values[2] = 1.0  # Known, valid: or nothing would happen.
            elif port.get_name() == "arrived":
                values[0] = 0.0
            port.FixValue(context, values)


def outputs(system, context):
    ports = map(system.get_output_port, range(system.num_output_ports()))
    return np.concatenate(
        [
            port.Eval(context)
            for port in ports
            if port.get_data_type() == PortDataType.kVectorValued
        ]
        or [np.zeros(0)]
    )


def test_every_system_is_in_this_contract():
    assert library_systems() == set(MAKE)


@pytest.mark.parametrize("kind", MAKE, ids=lambda kind: kind.__name__)
def test_the_documented_ports_are_the_real_ones(kind):
    system = MAKE[kind]()
    ports = documented_ports(kind)
    assert ports.get("input_ports", []) == [
        system.get_input_port(i).get_name()
        for i in range(system.num_input_ports())
    ]
    assert ports.get("output_ports", []) == [
        system.get_output_port(i).get_name()
        for i in range(system.num_output_ports())
    ]


@pytest.mark.parametrize("kind", MAKE, ids=lambda kind: kind.__name__)
def test_the_documented_sizes_are_the_real_ones(kind):
    system = MAKE[kind]()
    lines = {
        name: (size, text)
        for name, size, text in re.findall(
            r"^- (\w+) \((\w+)\):(.*)$", documentation(kind), re.M
        )
    }
    ports = [
        *map(system.get_input_port, range(system.num_input_ports())),
        *map(system.get_output_port, range(system.num_output_ports())),
    ]
    vectors = [
        p for p in ports if p.get_data_type() == PortDataType.kVectorValued
    ]
    assert {p.get_name() for p in vectors} == set(lines)
    for port in vectors:
        size, text = lines[port.get_name()]
        if size.isdigit():
            assert port.size() == int(size)
        elif size == "rays":
            assert port.size() == RAYS
        named = [
            VIEWS[word] for word in re.findall(r"\w+", text) if word in VIEWS
        ]
        assert all(port.size() == fields for fields in named[:1])


@pytest.mark.parametrize("kind", MAKE, ids=lambda kind: kind.__name__)
def test_feedthrough_is_as_documented(kind):
    system = MAKE[kind]()
    if system.num_output_ports() == 0:
        return
    promised_none = "No direct feedthrough." in documentation(kind)
    assert promised_none or "Direct feedthrough." in documentation(kind)
    assert system.HasAnyDirectFeedthrough() != promised_none


@pytest.mark.parametrize("kind", MAKE, ids=lambda kind: kind.__name__)
def test_the_same_context_gives_the_same_output(kind):
    system = MAKE[kind]()
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    fix_inputs(system, context, np.random.default_rng(0))
    simulator.AdvanceTo(0.3)
    once = outputs(system, context)
    system.SetDefaultContext(system.CreateDefaultContext())
    np.testing.assert_array_equal(outputs(system, context), once)
    np.testing.assert_array_equal(outputs(system, context.Clone()), once)


@pytest.mark.parametrize("kind", MAKE, ids=lambda kind: kind.__name__)
def test_two_contexts_never_meet(kind):
    system = MAKE[kind]()
    alone, beside = (Simulator(system) for _ in range(2))
    fix_inputs(system, alone.get_mutable_context(), np.random.default_rng(1))
    fix_inputs(system, beside.get_mutable_context(), np.random.default_rng(2))
    alone.AdvanceTo(0.313)
    expected = outputs(system, alone.get_context())
    assert not np.isnan(expected).any()
    again = Simulator(system)
    fix_inputs(system, again.get_mutable_context(), np.random.default_rng(1))
    for time in (0.053, 0.123, 0.203, 0.313):
        beside.AdvanceTo(time)
        again.AdvanceTo(time)
    np.testing.assert_array_equal(
        outputs(system, again.get_context()), expected
    )
