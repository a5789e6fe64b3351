"""Homing: find a beacon and drive to it (chapter 2)."""

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from drake_mobarm.checks import (
    check_seed,
    finite_numbers,
    one_of,
    within,
)
from drake_mobarm.driving.map_avoidance_state import MapAvoidanceParameters
from drake_mobarm.driving.waypoint import ControllerParameters
from drake_mobarm.frozen import frozen
from drake_mobarm.homing.avoidance import AvoidanceParameters
from drake_mobarm.homing.filter import FilterParameters
from drake_mobarm.homing.hybrid import HybridParameters
from drake_mobarm.homing.lookout import LookoutParameters
from drake_mobarm.homing.metrics import (
    count_dropped,
    homing_metrics,
    judge,
)
from drake_mobarm.job import Job, Trace, Verdict
from drake_mobarm.sensors.beacon import NOISE_CONFIGURATIONS
from drake_mobarm.sensors.rssi import BEACONS
from drake_mobarm.station.parameters import StationParameters
from drake_mobarm.world.meshes import MESHES
from drake_mobarm.world.places import Place

ESTIMATORS = ("hybrid", "filter")
AVOIDANCES = ("none", "rules", "map")


@frozen
class HomingParameters:
    """How the robot homes.

    Attributes:
        estimator: `hybrid` (the dissertation's) or `filter` (ours).
        avoidance: `map`, `rules`, or `none` to drive straight at the estimate.
        hybrid: parameters of that estimator.
        filter: parameters of that estimator.
        rules: parameters of the obstacle avoidance by rules.
        map: parameters of that by a map.
        lookout: when to turn back to a beacon out of the antenna's view.
        controller: parameters of the proportional controller.
    """

    estimator: str = "filter"
    avoidance: str = "map"
    hybrid: HybridParameters = field(default_factory=HybridParameters)
    filter: FilterParameters = field(default_factory=FilterParameters)
    rules: AvoidanceParameters = field(default_factory=AvoidanceParameters)
    map: MapAvoidanceParameters = field(default_factory=MapAvoidanceParameters)
    lookout: LookoutParameters = field(default_factory=LookoutParameters)
    controller: ControllerParameters = field(
        default_factory=ControllerParameters
    )

    def __post_init__(self) -> None:
        one_of(self, ESTIMATORS, "estimator")
        one_of(self, AVOIDANCES, "avoidance")


@frozen
class HomingScenario(HomingParameters):
    """Find a beacon and drive to it (chapter 2).

    Attributes:
        diagram: the diagram that this scenario is for.
        world: a shipped world's name or the path of an SDF.
        meshes: what becomes of a mesh in the world: `refuse` it, or put an
            oriented box (`boxes`) or the convex hull (`hulls`) in the place
            of each of its connected parts.
        start: X_WB of the base, [x, y, yaw] in m and rad.
        beacon: p_WT, where the beacon is [m], unknown to the robot.
        noise: of its readings, a configuration of Table 2.2.
        time_limit: after which the run ends without success [s].
        calibration_noise: standard deviation of the RSSI samples that the
            beacon's calibration is fitted from [dB].
        seed: of all noise.
        station: how the robot is simulated, sensed and driven.
    """

    diagram: str = "homing"
    world: str
    start: tuple[float, ...]
    beacon: tuple[float, ...]
    meshes: str = "refuse"
    noise: int = 5
    time_limit: float = 120.0
    calibration_noise: float = 1.0
    seed: int = 0
    station: StationParameters = field(default_factory=StationParameters)

    def __post_init__(self) -> None:
        super().__post_init__()
        finite_numbers(self, "[x, y, yaw] in m and rad", "start")
        finite_numbers(self, "[x, y] in m", "beacon")
        one_of(self, MESHES, "meshes")
        one_of(self, NOISE_CONFIGURATIONS, "noise")
        within(self, "(0, 3600]", "time_limit")
        within(self, "[0, 20)", "calibration_noise")
        check_seed(self.seed)


def _places(scenario: HomingScenario) -> list[Place]:
    return [
        Place("start", scenario.start, robot=True),
        Place("beacon", scenario.beacon),
    ]


def _judge(
    scenario: HomingScenario, trace: Trace, outputs: Mapping[str, Any]
) -> Verdict:
    metrics = homing_metrics(trace, scenario.beacon) | count_dropped(
        trace, BEACONS[scenario.station.beacon.model]
    )
    arrived = bool(outputs["arrived"][0] > 0.5)
    given_up, x, y = outputs["given_up"]
    shut = (x, y) if given_up > 0.5 else None
    verdict = judge(metrics, arrived, scenario.time_limit, shut)
    return Verdict(*verdict, metrics)


JOB = Job(name="homing", scenario=HomingScenario, places=_places, judge=_judge)
