"""Homing: the station, an estimator, avoidance or none, a controller."""

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_mobarm.diagrams.station import (
    ANTENNA_POSITION,
    PROCESSING_DELAY,
    build_station,
)
from drake_mobarm.drawing.stage import HomingView, add_visualizer
from drake_mobarm.homing.systems import (
    FilterEstimator,
    HomingController,
    HybridEstimator,
    ObstacleAvoidance,
    StraightToTarget,
    TargetEstimator,
)
from drake_mobarm.runtime.scenarios import HomingScenario
from drake_mobarm.sensors.beacon import NOISE_CONFIGURATIONS
from drake_mobarm.sensors.rssi import BEACONS, calibrate
from drake_mobarm.world.sdf import load_world

LOG_PERIOD = 0.05


def build(
    scenario: HomingScenario,
    calibration_seed: int = 0,
    meshcat: Meshcat | None = None,
) -> Diagram:
    """Wires the homing diagram.

    Args:
        scenario: what to build.
        calibration_seed: of the samples that the beacon's calibration is
            fitted from; all other noise is seeded in the context.
        meshcat: where to draw the run, if anywhere.

    Returns:
        A diagram with the output `done` (1), which ends a run, and a
        VectorLogSink for each signal of its trace.
    """
    builder = DiagramBuilder()
    station = builder.AddNamedSystem(
        "station",
        build_station(
            load_world(scenario.world),
            scenario.start,
            scenario.beacon,
            scenario.noise,
            scenario.station,
        ),
    )
    estimator = builder.AddNamedSystem(
        "estimator", make_estimator(scenario, calibration_seed)
    )
    guide = builder.AddNamedSystem("avoidance", make_guide(scenario))
    controller = builder.AddNamedSystem(
        "controller", HomingController(scenario.controller)
    )
    stow = builder.AddNamedSystem(
        "stow",
        ConstantVectorSource(
            np.concatenate([scenario.station.stowed, np.zeros(6)])
        ),
    )

    pose = station.GetOutputPort("measured_base_pose")
    velocity = station.GetOutputPort("measured_base_velocity")
    reading = station.GetOutputPort("beacon_reading")
    ranges = station.GetOutputPort("lidar_ranges")
    truth = station.GetOutputPort("ground_truth")
    target = estimator.GetOutputPort("estimated_target")
    arrived = estimator.GetOutputPort("arrived")
    waypoint = guide.GetOutputPort("waypoint")
    command = controller.GetOutputPort("commanded_base_velocity")

    builder.Connect(pose, estimator.GetInputPort("measured_base_pose"))
    builder.Connect(reading, estimator.GetInputPort("beacon_reading"))
    builder.Connect(target, guide.GetInputPort("estimated_target"))
    if scenario.avoidance == "rules":
        builder.Connect(pose, guide.GetInputPort("measured_base_pose"))
        builder.Connect(velocity, guide.GetInputPort("measured_base_velocity"))
        builder.Connect(ranges, guide.GetInputPort("lidar_ranges"))
    builder.Connect(pose, controller.GetInputPort("measured_base_pose"))
    builder.Connect(waypoint, controller.GetInputPort("waypoint"))
    builder.Connect(arrived, controller.GetInputPort("arrived"))
    builder.Connect(command, station.GetInputPort("commanded_base_velocity"))
    builder.Connect(
        stow.get_output_port(), station.GetInputPort("desired_arm_state")
    )
    builder.ExportOutput(arrived, "done")

    for port in (truth, pose, reading, target, waypoint, command):
        log = LogVectorOutput(port, builder, LOG_PERIOD)
        log.set_name(f"trace.{port.get_name()}")
    if meshcat is not None:
        view = builder.AddNamedSystem(
            "view", HomingView(meshcat, scenario.beacon)
        )
        builder.Connect(truth, view.GetInputPort("ground_truth"))
        builder.Connect(target, view.GetInputPort("estimated_target"))
        add_visualizer(builder, station.GetOutputPort("query_object"), meshcat)
    diagram: Diagram = builder.Build()
    diagram.set_name("homing")
    return diagram


def make_estimator(
    scenario: HomingScenario, calibration_seed: int
) -> TargetEstimator:
    """The estimator that the scenario names, with a calibrated beacon."""
    beacon = scenario.station.beacon
    calibration = calibrate(
        BEACONS[beacon.model],
        scenario.calibration_noise,
        np.random.default_rng(calibration_seed),
    )
    common = (
        calibration,
        np.array(ANTENNA_POSITION),
        beacon.rate,
        PROCESSING_DELAY,
    )
    if scenario.estimator == "hybrid":
        return HybridEstimator(scenario.hybrid, *common)
    noise = NOISE_CONFIGURATIONS[scenario.noise]
    return FilterEstimator(scenario.filter, noise, *common)


def make_guide(
    scenario: HomingScenario,
) -> ObstacleAvoidance | StraightToTarget:
    """The avoidance that the scenario names."""
    if scenario.avoidance == "none":
        return StraightToTarget()
    lidar = scenario.station.lidar
    return ObstacleAvoidance(
        scenario.rules, lidar.rays, lidar.rate, PROCESSING_DELAY
    )
