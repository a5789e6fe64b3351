"""Navigation: drive through a furnished building to a target (chapter 3)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from drake_mobarm.checks import (
    check_seed,
    finite_numbers,
    one_of,
    positive,
    require,
    within,
)
from drake_mobarm.driving.map_avoidance_state import MapAvoidanceParameters
from drake_mobarm.driving.waypoint import ControllerParameters
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.job import Job, Trace, Verdict
from drake_mobarm.navigation.escape import EscapeParameters
from drake_mobarm.navigation.highway import POINTS, HighwayParameters
from drake_mobarm.navigation.highway_force import HighwayForceParameters
from drake_mobarm.navigation.metrics import (
    FreeFloor,
    judge,
    navigation_metrics,
)
from drake_mobarm.navigation.potential import PotentialParameters
from drake_mobarm.navigation.steering import SteeringParameters
from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.sensors.beacon import NOISE_CONFIGURATIONS
from drake_mobarm.sensors.localization import LocalizationParameters
from drake_mobarm.station.parameters import StationParameters
from drake_mobarm.world.floor_plan_files import MAP_SUFFIXES
from drake_mobarm.world.meshes import MESHES
from drake_mobarm.world.obstacles import clearance
from drake_mobarm.world.places import Place
from drake_mobarm.world.world import World

PLANNERS = ("ours", "apf", "apf_escape", "apf_hw")
FLOOR_PLANS = ("given", "world", "none")
POSES = ("odometry", "corrected")
TARGETS = ("beacon", "known")


@frozen
class NavigationParameters:
    """How the robot finds its way.

    Attributes:
        planner: `ours`, or one of the dissertation's: the potential field
            alone (`apf`), with an escape force (`apf_escape`), or with highway
            (`apf_hw`).
        arrival_distance: from the target, at which `ours` is there [m]; the
            others arrive by their forces.
        may_reverse: whether `ours` may drive backwards where that saves
            turning; its antenna then has to hear behind it, too.
        map: how `ours` drives.
        controller: gains of its way to a waypoint.
        sees_plan: whether what is on the floor plan within 3 m counts as seen
            for the others; in the text what the lidar sees does alone.
        potential: shape of the field of the others.
        steering: from force to velocity.
        escape: the escape force of `apf_escape`.
        points: how the points of the highway are chosen: `adaptive`, by the
            obstacles' density, or `random`.
        pose: what the robot goes by: the station's `odometry`, or that
            `corrected` by matching the lidar's scan to the floor plan.
        localization: how it is corrected.
        grid_size: of the highway's squares [m], one number; empty for (3.1).
        highway: how its points are chosen.
        pull: how strongly it pulls.
    """

    planner: str = "ours"
    arrival_distance: float = 0.3
    may_reverse: bool = True
    map: MapAvoidanceParameters = field(default_factory=MapAvoidanceParameters)
    controller: ControllerParameters = field(
        default_factory=ControllerParameters
    )
    sees_plan: bool = False
    potential: PotentialParameters = field(default_factory=PotentialParameters)
    steering: SteeringParameters = field(default_factory=SteeringParameters)
    escape: EscapeParameters = field(default_factory=EscapeParameters)
    pose: str = "corrected"
    localization: LocalizationParameters = field(
        default_factory=LocalizationParameters
    )
    points: str = "adaptive"
    grid_size: tuple[float, ...] = ()
    highway: HighwayParameters = field(default_factory=HighwayParameters)
    pull: HighwayForceParameters = field(default_factory=HighwayForceParameters)

    def __post_init__(self) -> None:
        one_of(self, PLANNERS, "planner")
        one_of(self, POINTS, "points")
        one_of(self, POSES, "pose")
        positive(self, "arrival_distance")
        require(
            len(self.grid_size) <= 1
            and all(0.05 <= size <= 2 for size in self.grid_size),
            "grid_size",
            self.grid_size,
            "empty, or [size] in m, each in [0.05, 2]",
        )


@frozen
class NavigationScenario(NavigationParameters):
    """Drive through a furnished building to a target (chapter 3).

    Attributes:
        diagram: the diagram that this scenario is for.
        world: a shipped world's name or the path of an SDF.
        meshes: what becomes of a mesh in the world: `refuse` it, or put an
            oriented box (`boxes`) or the convex hull (`hulls`) in the place
            of each of its connected parts.
        floor_plan: of the robot: `given`, that of a shipped world, which
            differs from it, or made from any other world; `world`, made from
            the world, so that it shows all; `none`; or the path of a map's
            YAML file.
        start: X_WB of the base, [x, y, yaw] in m and rad.
        target: p_WT [m], (2,).
        target_from: how the robot knows it: by a `beacon` in its place, or it
            is `known` from the start.
        noise: of the beacon's readings, a configuration of Table 2.2.
        calibration_noise: standard deviation of the RSSI samples that the
            beacon's calibration is fitted from [dB].
        time_limit: after which the run ends without success [s].
        seed: of all noise, and of the highway's points.
        station: how the robot is simulated, sensed and driven.
    """

    diagram: str = "navigation"
    world: str
    start: tuple[float, ...]
    target: tuple[float, ...]
    meshes: str = "refuse"
    floor_plan: str = "given"
    target_from: str = "beacon"
    noise: int = 5
    calibration_noise: float = 1.0
    time_limit: float = 120.0
    seed: int = 0
    station: StationParameters = field(default_factory=StationParameters)

    def __post_init__(self) -> None:
        super().__post_init__()
        finite_numbers(self, "[x, y, yaw] in m and rad", "start")
        finite_numbers(self, "[x, y] in m", "target")
        one_of(self, MESHES, "meshes")
        one_of(self, TARGETS, "target_from")
        require(
            self.floor_plan in FLOOR_PLANS
            or self.floor_plan.lower().endswith(MAP_SUFFIXES),
            "floor_plan",
            self.floor_plan,
            f"{', '.join(FLOOR_PLANS)}, or the path of a map's YAML file",
        )
        one_of(self, NOISE_CONFIGURATIONS, "noise")
        within(self, "(0, 3600]", "time_limit")
        within(self, "[0, 20)", "calibration_noise")
        check_seed(self.seed)


def _places(scenario: NavigationScenario) -> list[Place]:
    return [
        Place("start", scenario.start, robot=True),
        Place("target", scenario.target, solid=True),
    ]


def _judge(
    scenario: NavigationScenario, trace: Trace, outputs: Mapping[str, Any]
) -> Verdict:
    # Drake's parser is not for laws.
    from drake_mobarm.world.sdf import load_world

    building = _building(load_world(scenario.world, scenario.meshes))
    metrics = navigation_metrics(
        trace, scenario.target, building.footprint, building.floor
    )
    arrived = bool(outputs["arrived"][0] > 0.5)
    given_up, x, y = outputs["given_up"]
    shut = None
    if given_up > 0.5:
        shut = f"{building.nearest((x, y))} at [{x:.2f}, {y:.2f}]"
    on = building.nearest(scenario.target, within=0.0)
    success, reason = judge(
        metrics, trace, scenario.target, arrived, scenario.time_limit, shut
    )
    if on is not None:
        reason += f"; the target is inside {on}"
    return Verdict(success, reason, metrics)


@dataclass(frozen=True, eq=False)
class _Building:
    """What can be touched in a world, and the floor among it."""

    names: list[str]
    footprint: list[Array]
    floor: FreeFloor

    def nearest(
        self, place: Sequence[float], within: float = math.inf
    ) -> str | None:
        """The name of the thing nearest to a place [m], if within so far."""
        point = np.array(place)
        apart = [float(clearance([o], point)) for o in self.footprint]
        if not apart or min(apart) > within:
            return None
        return self.names[int(np.argmin(apart))]


@lru_cache(maxsize=4)
def _building(world: World) -> _Building:
    found = [(o.name, o.outline(*HEIGHTS)) for o in world.obstacles]
    met = [(name, shape) for name, shape in found if shape is not None]
    footprint = [shape for _, shape in met]
    return _Building(
        [name for name, _ in met],
        footprint,
        FreeFloor.from_outlines(footprint),
    )


JOB = Job(
    name="navigation", scenario=NavigationScenario, places=_places, judge=_judge
)
