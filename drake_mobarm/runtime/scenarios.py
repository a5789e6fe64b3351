"""Scenarios: what to simulate, read from YAML and checked before it runs."""

import contextlib
import dataclasses
import math
import typing
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import yaml
from pydrake.common.yaml import yaml_dump_typed

from drake_mobarm.checks import require
from drake_mobarm.diagrams.station import StationParameters
from drake_mobarm.driving.waypoint import ControllerParameters
from drake_mobarm.exceptions import ParameterError, ScenarioError
from drake_mobarm.homing.avoidance import AvoidanceParameters
from drake_mobarm.homing.filter import FilterParameters
from drake_mobarm.homing.hybrid import HybridParameters
from drake_mobarm.placement.objective import (
    ObjectiveParameters,
    PlacementObjective,
)
from drake_mobarm.placement.objective_map import ToolTarget
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.sensors.beacon import NOISE_CONFIGURATIONS
from drake_mobarm.world.obstacles import clearance, outlines
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.sdf import World, load_world

DIAGRAMS = Path(__file__).resolve().parent / "diagrams"
ESTIMATORS = ("hybrid", "filter")
AVOIDANCES = ("none", "rules")
GRIDS = ("optimised", "plain")
ROBOT_RADIUS = 0.27
ROBOT_HEIGHTS = (0.01, 0.6)
"""Between these heights [m] the robot, its arm stowed, can touch things."""

_ROOM_AREA = 4.0


@dataclass(kw_only=True)
class HomingScenario:
    """Find a beacon and drive to it (chapter 2).

    Attributes:
        diagram: the diagram that this scenario is for.
        world: a shipped world's name or the path of an SDF.
        start: X_WB of the base, [x, y, yaw] in m and rad.
        beacon: p_WT, where the beacon is [m], unknown to the robot.
        noise: of its readings, a configuration of Table 2.2.
        estimator: `hybrid` (the dissertation's) or `filter` (ours).
        avoidance: `rules`, or `none` to drive straight at the estimate.
        time_limit: after which the run ends without success [s].
        calibration_noise: standard deviation of the RSSI samples that the
            beacon's calibration is fitted from [dB].
        station: how the robot is simulated, sensed and driven.
        hybrid: parameters of that estimator.
        filter: parameters of that estimator.
        rules: parameters of the obstacle avoidance.
        controller: parameters of the proportional controller.
    """

    diagram: str = "homing"
    world: str = "empty"
    start: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    beacon: list[float] = field(default_factory=lambda: [5.0, 3.0])
    noise: int = 5
    estimator: str = "filter"
    avoidance: str = "none"
    time_limit: float = 120.0
    calibration_noise: float = 1.0
    station: StationParameters = field(default_factory=StationParameters)
    hybrid: HybridParameters = field(default_factory=HybridParameters)
    filter: FilterParameters = field(default_factory=FilterParameters)
    rules: AvoidanceParameters = field(default_factory=AvoidanceParameters)
    controller: ControllerParameters = field(
        default_factory=ControllerParameters
    )

    def __post_init__(self) -> None:
        _require_pose(self.start)
        require(
            len(self.beacon) == 2 and bool(np.isfinite(self.beacon).all()),
            "beacon",
            self.beacon,
            "[x, y], finite, in m",
        )
        require(
            self.noise in NOISE_CONFIGURATIONS,
            "noise",
            self.noise,
            "a configuration of Table 2.2: "
            + ", ".join(map(str, NOISE_CONFIGURATIONS)),
        )
        for name, valid in (
            ("estimator", ESTIMATORS),
            ("avoidance", AVOIDANCES),
        ):
            value = getattr(self, name)
            require(value in valid, name, value, " or ".join(valid))
        require(
            self.rules.range_max == self.station.lidar.range_max,
            "rules.range_max",
            self.rules.range_max,
            f"station.lidar.range_max, {self.station.lidar.range_max} m",
        )
        require(
            0 < self.time_limit <= 3600,
            "time_limit",
            self.time_limit,
            "above 0, up to 3600 s",
        )
        require(
            0 <= self.calibration_noise < 20,
            "calibration_noise",
            self.calibration_noise,
            "0 dB or more, below 20 dB",
        )


@dataclass(kw_only=True)
class PlacementScenario:
    """Choose where to stand for a tool target (4.3.1 to 4.3.3).

    Attributes:
        diagram: the diagram that this scenario is for.
        world: a shipped world's name or the path of an SDF.
        start: X_WB of the base, [x, y, yaw] in m and rad; it can only stand
            where it can drive to from here.
        target: p_WT of the tool's tip [m].
        approach: the tool's x axis in W, a unit vector.
        heading: of the base at the stand [rad], one number; empty where it
            may choose.
        avoid_collisions: whether the arm keeps out of furniture and off the
            robot itself; the dissertation's map does not look.
        grid: `optimised` (4.3.3) or `plain` squares.
        grid_size: edge length of a square [m].
        replan_distance: how far the target has to move for a new plan [m].
        objective: what counts as a good place.
    """

    diagram: str = "placement"
    world: str = "empty"
    start: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    target: list[float] = field(default_factory=lambda: [2.0, 1.0, 0.6])
    approach: list[float] = field(default_factory=lambda: [0.0, 0.0, -1.0])
    heading: list[float] = field(default_factory=list)
    avoid_collisions: bool = True
    grid: str = "optimised"
    grid_size: float = 0.2
    replan_distance: float = 0.05
    objective: ObjectiveParameters = field(default_factory=ObjectiveParameters)

    time_limit: ClassVar[float] = 1.0
    """The plan is there at once; nothing moves [s]."""

    def __post_init__(self) -> None:
        _require_pose(self.start)
        ToolTarget(position=self.target, approach=self.approach)
        require(
            max(map(abs, self.target)) <= 1000,
            "target",
            self.target,
            "within 1000 m of W's origin",
        )
        PlacementObjective(ArmKinematics(), self.objective)
        require(
            len(self.heading) <= 1 and bool(np.isfinite(self.heading).all()),
            "heading",
            self.heading,
            "[yaw], finite, in rad, or empty",
        )
        require(self.grid in GRIDS, "grid", self.grid, " or ".join(GRIDS))
        require(
            0.05 <= self.grid_size <= 2,
            "grid_size",
            self.grid_size,
            "0.05 to 2 m",
        )
        require(
            0 <= self.replan_distance < np.inf,
            "replan_distance",
            self.replan_distance,
            "0 m or more",
        )


Scenario = HomingScenario | PlacementScenario

SCENARIO_TYPES: dict[str, type[Any]] = {
    "homing": HomingScenario,
    "placement": PlacementScenario,
}
"""The scenario type of each diagram, by its name."""


def scenario_names() -> list[str]:
    """The shipped scenarios' names."""
    return sorted(path.stem for path in DIAGRAMS.glob("*.yaml"))


def load_scenario(name_or_path: str, overrides: Sequence[str] = ()) -> Scenario:
    """Reads a scenario and checks it.

    Args:
        name_or_path: a shipped scenario's name or the path of a YAML file.
        overrides: "key.path=value" each, the value in YAML.

    Returns:
        The scenario, of the type that its diagram needs.

    Raises:
        ScenarioError: there is no such scenario, it does not parse, or holds
            an unknown key or a wrong type.
        ParameterError: a value is out of its range.
        WorldError: the world cannot be used.
    """
    path = _find(name_or_path)
    values = _parse(path)
    for override in overrides:
        _override(values, override)
    kind = values.get("diagram")
    if not isinstance(kind, str) or kind not in SCENARIO_TYPES:
        raise ScenarioError(
            f"{path}: diagram is {kind!r}: valid is {', '.join(SCENARIO_TYPES)}"
        )
    scenario: Scenario = _make(SCENARIO_TYPES[kind], values, name_or_path, "")
    check_places(scenario, load_world(scenario.world))
    return scenario


def dump_scenario(scenario: Scenario) -> str:
    """The scenario as YAML, every default spelled out."""
    text: str = yaml_dump_typed(scenario)
    return text


def check_places(scenario: Scenario, world: World) -> None:
    """Refuses places where the run could not make sense.

    Raises:
        ScenarioError: the robot would start inside an obstacle or outside
            the walls, or the beacon is inside an obstacle or outside.
    """
    footprint = outlines(world.obstacles, *ROBOT_HEIGHTS)
    start = np.array(scenario.start[:2])
    room = float(clearance(footprint, start))
    if room <= ROBOT_RADIUS:
        raise ScenarioError(
            f"start {scenario.start} is inside an obstacle of {world.name}: "
            f"{room:.2f} m are free around it, the robot needs "
            f"{ROBOT_RADIUS} m"
        )
    places = {"start": start}
    if isinstance(scenario, HomingScenario):
        places["beacon"] = beacon = np.array(scenario.beacon)
        if float(clearance(footprint, beacon)) <= 0:
            raise ScenarioError(
                f"beacon {scenario.beacon} is inside an obstacle of "
                f"{world.name}"
            )
    # Walls are whatever closes off a room's worth of floor from outside.
    grid = OccupancyGrid.from_outlines(footprint)
    regions = grid.regions(0.0)
    indoors = np.sum(regions >= 2) * grid.cell**2 > _ROOM_AREA
    for name, place in places.items():
        if indoors and regions[grid.index(place)] == 1:
            raise ScenarioError(
                f"{name} {place.tolist()} is outside the walls of {world.name}"
            )


def _require_pose(start: list[float]) -> None:
    require(
        len(start) == 3 and bool(np.isfinite(start).all()),
        "start",
        start,
        "[x, y, yaw], finite, in m and rad",
    )


def _find(name_or_path: str) -> Path:
    if name_or_path in scenario_names():
        return DIAGRAMS / f"{name_or_path}.yaml"
    path = Path(name_or_path)
    if path.suffix in (".yaml", ".yml") and path.is_file():
        return path
    raise ScenarioError(
        f"unknown scenario {name_or_path!r}: valid are "
        f"{', '.join(scenario_names())}, or the path of a .yaml file"
    )


def _parse(path: Path) -> dict[str, Any]:
    try:
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
    except yaml.YAMLError as error:
        line = " ".join(str(error).split())
        raise ScenarioError(f"{path} does not parse: {line}") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path} cannot be read: {error}") from error
    if not isinstance(values, dict):
        raise ScenarioError(f"{path} does not hold keys and values")
    return values


def _override(values: dict[str, Any], override: str) -> None:
    name, separator, text = override.partition("=")
    if not separator or not name:
        raise ScenarioError(f"--set {override!r}: valid is key.path=value")
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ScenarioError(
            f"--set {name}: {text!r} does not parse as YAML"
        ) from error
    *parents, last = name.split(".")
    for parent in parents:
        values = values.setdefault(parent, {})
        if not isinstance(values, dict):
            raise ScenarioError(f"--set {name}: {parent} has no parts")
    values[last] = value


def _make(kind: type[Any], values: Any, where: str, prefix: str) -> Any:
    """A dataclass from a dict, which is checked all the way down.

    pydrake's yaml_load_typed sets values past the dataclasses' own checks,
    and does not say what the valid keys are.
    """
    if not isinstance(values, dict):
        raise ScenarioError(f"{where}: {prefix[:-1]} needs keys and values")
    kinds = typing.get_type_hints(kind)
    names = [f.name for f in dataclasses.fields(kind)]
    for key in values:
        if key not in names:
            raise ScenarioError(
                f"{where}: unknown key {prefix}{key}: valid are "
                f"{', '.join(prefix + name for name in names)}"
            )
    checked = {
        key: _check_value(kinds[key], value, where, f"{prefix}{key}")
        for key, value in values.items()
    }
    try:
        return kind(**checked)
    except ParameterError as error:
        raise ParameterError(f"{where}: {prefix}{error}") from error


def _check_value(kind: Any, value: Any, where: str, name: str) -> Any:
    """The value as `kind`; whole numbers are made float where wanted."""
    if dataclasses.is_dataclass(kind):
        assert isinstance(kind, type)
        return _make(kind, value, where, f"{name}.")
    if typing.get_origin(kind) is list:
        if not isinstance(value, list):
            raise ScenarioError(f"{where}: {name} is {value!r}, not a list")
        (item,) = typing.get_args(kind)
        return [
            _check_value(item, x, where, f"{name}[{i}]")
            for i, x in enumerate(value)
        ]
    if kind is float:
        # YAML 1.1 reads 1e-3 as text.
        if isinstance(value, str):
            with contextlib.suppress(ValueError):
                value = float(value)
        if isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if isinstance(value, float) and not math.isfinite(value):
            raise ScenarioError(
                f"{where}: {name} is {value}: it has to be finite"
            )
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise ScenarioError(
            f"{where}: {name} is {value!r}: it has to be of type "
            f"{kind.__name__}"
        )
    return value
