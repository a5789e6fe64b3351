"""Navigation: a target, a planner, and the pose they go by; on the station."""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, System
from pydrake.systems.primitives import (
    ConstantVectorSource,
)

from drake_mobarm.checks import require
from drake_mobarm.diagrams.station import (
    STATION_BLOCKS,
    add_stowing_and_ending,
    build_station,
)
from drake_mobarm.diagrams.wiring import NO_BLOCKS, Wiring, split_blocks
from drake_mobarm.driving.known_floor import KnownFloor
from drake_mobarm.exceptions import ScenarioError
from drake_mobarm.homing.filter import FilterEstimator, FilterParameters
from drake_mobarm.homing.systems import TargetEstimator
from drake_mobarm.job import spawn_seeds
from drake_mobarm.navigation.field_planner import (
    EscapePlanner,
    FieldPlanner,
    HighwayPlanner,
)
from drake_mobarm.navigation.highway import Highway, build_highway
from drake_mobarm.navigation.job import (
    NavigationParameters,
    NavigationScenario,
)
from drake_mobarm.navigation.map_planner import MapPlanner
from drake_mobarm.navigation.planner import PlannerLaw
from drake_mobarm.navigation.systems import NavigationPlanner
from drake_mobarm.navigation.view import NavigationView
from drake_mobarm.robot.shape import ANTENNA_POSITION, RADIUS
from drake_mobarm.sensors.beacon import Beacon
from drake_mobarm.sensors.distance_field import DistanceField
from drake_mobarm.sensors.rssi import BEACONS, RssiModel, calibrate
from drake_mobarm.sensors.systems import FloorPlanLocalization
from drake_mobarm.signals import sizes
from drake_mobarm.station.parameters import PROCESSING_DELAY, StationParameters
from drake_mobarm.world.floor_plan import FloorPlan, adaptive_grid_size
from drake_mobarm.world.floor_plan_files import (
    given_map,
    map_files,
    read_floor_plan,
)
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.sdf import load_world
from drake_mobarm.world.world import World

RASTER = 0.05
"""In which (3.1) counts the lines of a floor plan [m]."""

NAVIGATION_BLOCKS = ("localizer", "estimator", "planner")
"""The blocks that a user may exchange, besides the station's; "localizer" is
there with a corrected pose, "estimator" with a beacon."""


def build_job(
    parameters: NavigationParameters,
    *,
    station: StationParameters,
    plan: FloorPlan | None,
    seed: int = 0,
    calibration: RssiModel | None = None,
    blocks: Mapping[str, System] = NO_BLOCKS,
) -> Diagram:
    """Wires navigation without a robot.

    Args:
        parameters: how the robot finds its way.
        station: what is known of the robot's sensors.
        plan: the floor plan that it is given, if any.
        seed: of the highway's points.
        calibration: of the RSSI of the beacon that is the target; without
            one, the target is known.
        blocks: systems in the places of some of `NAVIGATION_BLOCKS`.

    Returns:
        A diagram with the inputs `measured_base_pose` (PlanarPose), or
        `odometry_pose` (PlanarPose) where it is to be corrected,
        `lidar_ranges` (rays), and `beacon_reading` (BeaconReading), or
        `estimated_target` (TargetEstimate) where the target is known; and the
        outputs `commanded_base_velocity` (BaseVelocity), `arrived` (1),
        `given_up` (GivenUp), `navigation_forces` (NavigationForces),
        `planned_paths` (abstract), `estimated_target` with a beacon, and
        `measured_base_pose` and `pose_covariance` (9) of a corrected pose.

    Raises:
        BlockError: a block's ports do not fit, or its name is unknown.
        ParameterError: the planner needs a floor plan, and there is none.
    """
    wiring = Wiring(blocks)
    inputs: dict[str, int | None] = {"lidar_ranges": station.lidar.rays}
    outputs = [
        "commanded_base_velocity",
        "arrived",
        "given_up",
        "navigation_forces",
        "planned_paths",
    ]
    if parameters.pose == "corrected":
        inputs |= sizes("odometry_pose")
        outputs += ["measured_base_pose", "pose_covariance"]
        wiring.add(
            "localizer",
            lambda: FloorPlanLocalization(
                parameters.localization,
                station.lidar,
                no_field() if plan is None else distance_field(plan),
                PROCESSING_DELAY / 2,
            ),
            {"pose_covariance": 9} | sizes("measured_base_pose"),
        )
    else:
        inputs |= sizes("measured_base_pose")
    if calibration is None:
        inputs |= sizes("estimated_target")
    else:
        inputs |= sizes("beacon_reading")
        outputs.append("estimated_target")
        model = calibration
        wiring.add(
            "estimator",
            lambda: TargetEstimator(
                FilterEstimator(FilterParameters()),
                model,
                np.array(ANTENNA_POSITION),
                station.beacon.rate,
                PROCESSING_DELAY,
            ),
            sizes("estimated_target"),
        )
    wiring.add(
        "planner",
        lambda: NavigationPlanner(
            make_law(parameters, station, plan, seed),
            station.lidar,
            PROCESSING_DELAY,
            station.base_drive.speed_limit,
        ),
        sizes("commanded_base_velocity", "given_up", "navigation_forces")
        | {"arrived": 1, "planned_paths": None},
    )
    wiring.export(*outputs)
    return wiring.build("navigation", inputs=inputs)


def make_law(
    parameters: NavigationParameters,
    station: StationParameters,
    plan: FloorPlan | None,
    seed: int,
) -> PlannerLaw:
    """The planner's law that a scenario asks for.

    Raises:
        ParameterError: it needs a floor plan, and there is none.
    """
    lidar, field = station.lidar, (parameters.potential, parameters.steering)
    if parameters.planner == "ours":
        return MapPlanner(
            parameters.map,
            parameters.controller,
            lidar,
            station.base_drive.speed_limit,
            parameters.arrival_distance,
            parameters.may_reverse,
            None if plan is None else known_floor(plan),
        )
    known = None
    if parameters.sees_plan and plan is not None:
        known = known_floor(plan)
    if parameters.planner == "apf":
        return FieldPlanner(*field, lidar, known=known)
    if parameters.planner == "apf_escape":
        return EscapePlanner(*field, lidar, parameters.escape, known=known)
    require(
        plan is not None,
        "floor_plan",
        "none",
        "given, world, or a map's path, where planner is apf_hw",
    )
    assert plan is not None
    grid, highway = make_highway(parameters, plan, seed)
    return HighwayPlanner(
        *field, lidar, highway, parameters.pull, grid, known=known
    )


def make_highway(
    parameters: NavigationParameters, plan: FloorPlan, seed: int
) -> tuple[OccupancyGrid, Highway]:
    """The squares of a floor plan, and the highway over them."""
    if parameters.grid_size:
        (size,) = parameters.grid_size
    else:
        size = adaptive_grid_size(plan.grid(RASTER, RADIUS))
    grid = plan.grid(size, RADIUS)
    rng = np.random.default_rng([seed, 3])
    return grid, build_highway(grid, parameters.highway, rng, parameters.points)


def no_field() -> DistanceField:
    """The distance field of a robot without a plan: it keeps odometry."""
    return DistanceField.from_points(np.empty((0, 2)), 0.05)


@lru_cache(maxsize=4)
def distance_field(plan: FloorPlan) -> DistanceField:
    """The distance field of a plan, worked out once."""
    return DistanceField.from_points(
        plan.points(), plan.resolution, plan.origin[2]
    )


@lru_cache(maxsize=4)
def known_floor(plan: FloorPlan) -> KnownFloor:
    """The floor of a plan, worked out once."""
    return KnownFloor(plan.grid(plan.resolution, 0.0))


def load_plan(scenario: NavigationScenario) -> FloorPlan | None:
    """The floor plan that a scenario gives the robot, if any.

    Raises:
        MapError: the map cannot be read.
        ScenarioError: the start is not on it.
    """
    if scenario.floor_plan == "none":
        return None
    world = load_world(scenario.world, scenario.meshes)
    file: Path | None = None
    if scenario.floor_plan == "given":
        file = given_map(world)
    elif scenario.floor_plan != "world":
        file = Path(scenario.floor_plan)
    if file is None:
        plan = _true_plan(world, (scenario.start[:2], scenario.target))
    else:
        plan = _read_plan(
            file, tuple(part.stat().st_mtime_ns for part in map_files(file))
        )
    row, column = plan.index(scenario.start[:2])
    rows, columns = plan.free.shape
    if not (0 <= row < rows and 0 <= column < columns):
        low, high = plan.corners().min(axis=0), plan.corners().max(axis=0)
        raise ScenarioError(
            f"start {list(scenario.start[:2])} is not on the floor plan "
            f"{scenario.floor_plan}, which reaches from "
            f"[{low[0]:.2f}, {low[1]:.2f}] to [{high[0]:.2f}, {high[1]:.2f}]"
        )
    return plan


@lru_cache(maxsize=8)
def _read_plan(file: Path, changed: tuple[int, ...]) -> FloorPlan:
    """The plan of a map as its files were when they last changed."""
    return read_floor_plan(file)


@lru_cache(maxsize=8)
def _true_plan(
    world: World, places: tuple[tuple[float, ...], ...]
) -> FloorPlan:
    """The plan of a world that shows all, and reaches beyond some places."""
    return FloorPlan.from_world(world, cover=places)


def build(
    scenario: NavigationScenario,
    *,
    seed: int = 0,
    meshcat: Meshcat | None = None,
    blocks: Mapping[str, System] = NO_BLOCKS,
) -> Diagram:
    """Wires navigation on the station, with logs and, if asked, a view.

    Args:
        scenario: what to build.
        seed: of the run; here, of the highway's points and of the samples
            that the beacon's calibration is fitted from. All other noise is
            seeded in the context.
        meshcat: where to draw the run, if anywhere.
        blocks: systems in the places of some of `NAVIGATION_BLOCKS` or of the
            station's blocks.

    Returns:
        A diagram with the outputs `done` (1), which ends a run, `arrived` (1)
        and `given_up` (GivenUp), and a VectorLogSink for each signal of its
        trace.

    Raises:
        BlockError: a block's ports do not fit, or its name is unknown.
        ParameterError: the planner needs a floor plan, and there is none.
        MapError: the floor plan cannot be read.
        ScenarioError: the start is not on the floor plan.
    """
    of_job, of_station = split_blocks(blocks, NAVIGATION_BLOCKS, STATION_BLOCKS)
    built_seed, _ = spawn_seeds(seed)
    hears = scenario.target_from == "beacon"
    antenna = scenario.station.beacon
    calibration = calibrate(
        BEACONS[antenna.model],
        scenario.calibration_noise,
        np.random.default_rng(built_seed),
    )
    plan = load_plan(scenario)
    wiring = Wiring()
    wiring.add(
        "station",
        lambda: build_station(
            load_world(scenario.world, scenario.meshes),
            scenario.start,
            scenario.station,
            Beacon(position=scenario.target, noise=scenario.noise)
            if hears
            else None,
            of_station,
        ),
    )
    corrected = scenario.pose == "corrected"
    if corrected:
        wiring.rename("measured_base_pose", "odometry_pose")
    if not hears:
        wiring.add_primitive(
            "target",
            ConstantVectorSource([*scenario.target, 1.0]),
            "estimated_target",
        )
    wiring.add(
        "job",
        lambda: build_job(
            scenario,
            station=scenario.station,
            plan=plan,
            seed=built_seed,
            calibration=calibration if hears else None,
            blocks=of_job,
        ),
    )
    add_stowing_and_ending(wiring, scenario.station.stowed)
    wiring.export("done", "arrived", "given_up")
    wiring.log(
        "ground_truth",
        "measured_base_pose",
        "estimated_target",
        "navigation_forces",
        "commanded_base_velocity",
        *(["odometry_pose", "pose_covariance"] if corrected else []),
    )
    if meshcat is not None:
        highway = None
        if scenario.planner == "apf_hw" and plan is not None:
            _, highway = make_highway(scenario, plan, built_seed)
        wiring.add(
            "view",
            lambda: NavigationView(
                meshcat, scenario.target, scenario.station.lidar, highway
            ),
        )
        wiring.add_visualizer(meshcat)
    return wiring.build("navigation")
