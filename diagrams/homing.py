"""Homing: an estimator, avoidance or none, a controller; on the station."""

from collections.abc import Mapping

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, System
from pydrake.systems.primitives import (
    ConstantVectorSource,
)

from drake_mobarm.diagrams.station import (
    STATION_BLOCKS,
    add_stowing_and_ending,
    build_station,
)
from drake_mobarm.diagrams.wiring import NO_BLOCKS, Wiring, split_blocks
from drake_mobarm.driving.systems import MapAvoidance, WaypointController
from drake_mobarm.homing.confirmed import ConfirmedHybrid
from drake_mobarm.homing.filter import FilterEstimator
from drake_mobarm.homing.hybrid import HybridEstimator
from drake_mobarm.homing.job import HomingParameters, HomingScenario
from drake_mobarm.homing.systems import (
    Lookout,
    ObstacleAvoidance,
    StraightToTarget,
    TargetEstimator,
)
from drake_mobarm.homing.view import HomingView
from drake_mobarm.job import spawn_seeds
from drake_mobarm.robot.shape import ANTENNA_POSITION
from drake_mobarm.sensors.beacon import Beacon
from drake_mobarm.sensors.rssi import BEACONS, RssiModel, calibrate
from drake_mobarm.signals import sizes
from drake_mobarm.station.parameters import PROCESSING_DELAY, StationParameters
from drake_mobarm.world.sdf import load_world

HOMING_BLOCKS = ("estimator", "avoidance", "lookout", "controller")
"""The blocks that a user may exchange, besides the station's."""


def build_job(
    parameters: HomingParameters,
    *,
    calibration: RssiModel,
    station: StationParameters,
    blocks: Mapping[str, System] = NO_BLOCKS,
) -> Diagram:
    """Wires homing without a robot.

    Args:
        parameters: how the robot homes.
        calibration: of the beacon's RSSI.
        station: what is known of the robot's sensors.
        blocks: systems in the places of some of `HOMING_BLOCKS`.

    Returns:
        A diagram with the inputs `measured_base_pose` (PlanarPose),
        `beacon_reading` (BeaconReading), `lidar_ranges` (rays) and, where the
        avoidance reads it, `measured_base_velocity` (BaseVelocity), and the
        outputs `estimated_target` (TargetEstimate), `waypoint`
        (Waypoint), `commanded_base_velocity` (BaseVelocity), `arrived` (1)
        and `given_up` (GivenUp).

    Raises:
        BlockError: a block's ports do not fit, or its name is unknown.
    """
    wiring = Wiring(blocks)

    def make_estimator() -> System:
        own = FilterEstimator(parameters.filter)
        law = (
            ConfirmedHybrid(HybridEstimator(parameters.hybrid), own)
            if parameters.estimator == "hybrid"
            else own
        )
        base = station.base_drive.base
        wheel = base.wheel_speed_limit
        (speed, _), (_, turn_rate) = (
            base.body_velocity(left, wheel) for left in (wheel, -wheel)
        )
        return TargetEstimator(
            law,
            calibration,
            np.array(ANTENNA_POSITION),
            station.beacon.rate,
            PROCESSING_DELAY,
            (speed, turn_rate),
        )

    def make_avoidance() -> System:
        if parameters.avoidance == "none":
            return StraightToTarget()
        if parameters.avoidance == "map":
            return MapAvoidance(parameters.map, station.lidar, PROCESSING_DELAY)
        return ObstacleAvoidance(
            parameters.rules, station.lidar, PROCESSING_DELAY
        )

    wiring.add(
        "estimator",
        make_estimator,
        {"arrived": 1} | sizes("estimated_target"),
    )
    avoidance = wiring.add("avoidance", make_avoidance, sizes("waypoint"))
    if avoidance.HasOutputPort("given_up"):
        wiring.offer("given_up", avoidance.GetOutputPort("given_up"))
    else:
        wiring.add_primitive(
            "never_gives_up", ConstantVectorSource(np.zeros(3)), "given_up"
        )
    wiring.rename("waypoint", "avoidance_waypoint")
    wiring.add(
        "lookout",
        lambda: Lookout(
            parameters.lookout, station.beacon, station.lidar, PROCESSING_DELAY
        ),
        sizes("waypoint"),
    )
    wiring.add(
        "controller",
        lambda: WaypointController(
            parameters.controller, station.base_drive.speed_limit
        ),
        sizes("commanded_base_velocity"),
    )
    wiring.export(
        "estimated_target",
        "waypoint",
        "commanded_base_velocity",
        "arrived",
        "given_up",
    )
    return wiring.build(
        "homing",
        inputs={"lidar_ranges": station.lidar.rays}
        | sizes(
            "measured_base_pose", "measured_base_velocity", "beacon_reading"
        ),
    )


def build(
    scenario: HomingScenario,
    *,
    seed: int = 0,
    meshcat: Meshcat | None = None,
    blocks: Mapping[str, System] = NO_BLOCKS,
) -> Diagram:
    """Wires homing on the station, with logs and, if asked, a view.

    Args:
        scenario: what to build.
        seed: of the run; here, of the samples that the beacon's calibration
            is fitted from. All other noise is seeded in the context.
        meshcat: where to draw the run, if anywhere.
        blocks: systems in the places of some of `HOMING_BLOCKS` or of the
            station's blocks.

    Returns:
        A diagram with the outputs `done` (1), which ends a run, `arrived` (1)
        and `given_up` (GivenUp), and a VectorLogSink for each signal of its
        trace.

    Raises:
        BlockError: a block's ports do not fit, or its name is unknown.
    """
    of_job, of_station = split_blocks(blocks, HOMING_BLOCKS, STATION_BLOCKS)
    calibration_seed, _ = spawn_seeds(seed)
    antenna = scenario.station.beacon
    calibration = calibrate(
        BEACONS[antenna.model],
        scenario.calibration_noise,
        np.random.default_rng(calibration_seed),
    )
    wiring = Wiring()
    wiring.add(
        "station",
        lambda: build_station(
            load_world(scenario.world, scenario.meshes),
            scenario.start,
            scenario.station,
            Beacon(position=scenario.beacon, noise=scenario.noise),
            of_station,
        ),
    )
    wiring.add(
        "job",
        lambda: build_job(
            scenario,
            calibration=calibration,
            station=scenario.station,
            blocks=of_job,
        ),
    )
    add_stowing_and_ending(wiring, scenario.station.stowed)
    wiring.export("done", "arrived", "given_up")
    wiring.log(
        "ground_truth",
        "measured_base_pose",
        "beacon_reading",
        "estimated_target",
        "waypoint",
        "commanded_base_velocity",
    )
    if meshcat is not None:
        wiring.add("view", lambda: HomingView(meshcat, scenario.beacon))
        wiring.add_visualizer(meshcat)
    return wiring.build("homing")
