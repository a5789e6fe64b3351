from . import signals as signals
from .diagrams.station import build_station as build_station
from .exceptions import MobarmError as MobarmError
from .placement.problem import ToolTarget as ToolTarget
from .robot.arm_kinematics import ArmKinematics as ArmKinematics
from .runtime.result import Result as Result
from .runtime.scenarios import changed as changed
from .runtime.scenarios import load_scenario as load_scenario
from .runtime.simulation import build_diagram as build_diagram
from .runtime.simulation import run as run
from .station.parameters import StationParameters as StationParameters
from .world.sdf import load_world as load_world
from .world.world import World as World

__version__: str
