from .careful_speed import CareParameters as CareParameters
from .systems import WaypointController as WaypointController
from .waypoint import ControllerParameters as ControllerParameters
