"""Driving among things: following a waypoint, careful speed, scans, gaps."""

from typing import TYPE_CHECKING

from drake_mobarm.lazy import attach

if TYPE_CHECKING:
    from drake_mobarm.driving.careful_speed import CareParameters
    from drake_mobarm.driving.systems import WaypointController
    from drake_mobarm.driving.waypoint import ControllerParameters
else:
    __getattr__, __dir__ = attach(
        __name__,
        {
            "CareParameters": "careful_speed",
            "ControllerParameters": "waypoint",
            "WaypointController": "systems",
        },
    )

__all__ = ["CareParameters", "ControllerParameters", "WaypointController"]
