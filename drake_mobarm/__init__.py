"""A mobile arm that does a whole job, as Drake systems."""

from importlib.metadata import version as _version
from typing import TYPE_CHECKING

from drake_mobarm.lazy import lazy_names

if TYPE_CHECKING:
    from drake_mobarm import signals
    from drake_mobarm.diagrams.station import build_station
    from drake_mobarm.exceptions import MobarmError
    from drake_mobarm.placement.objective_map import ToolTarget
    from drake_mobarm.robot.arm_kinematics import ArmKinematics
    from drake_mobarm.runtime.result import Result
    from drake_mobarm.runtime.scenarios import load_scenario
    from drake_mobarm.runtime.simulation import build_diagram, run
    from drake_mobarm.station.parameters import StationParameters
    from drake_mobarm.world.sdf import load_world
    from drake_mobarm.world.world import World

__version__ = _version("drake_mobarm")

__all__ = [
    "ArmKinematics",
    "MobarmError",
    "Result",
    "StationParameters",
    "ToolTarget",
    "World",
    "__version__",
    "build_diagram",
    "build_station",
    "load_scenario",
    "load_world",
    "run",
    "signals",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "ArmKinematics": "drake_mobarm.robot.arm_kinematics",
        "MobarmError": "drake_mobarm.exceptions",
        "Result": "drake_mobarm.runtime.result",
        "StationParameters": "drake_mobarm.station.parameters",
        "ToolTarget": "drake_mobarm.placement.objective_map",
        "World": "drake_mobarm.world.world",
        "build_diagram": "drake_mobarm.runtime.simulation",
        "build_station": "drake_mobarm.diagrams.station",
        "load_scenario": "drake_mobarm.runtime.scenarios",
        "load_world": "drake_mobarm.world.sdf",
        "run": "drake_mobarm.runtime.simulation",
        "signals": "drake_mobarm.signals",
    },
)
