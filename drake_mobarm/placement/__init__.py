"""Where to stand for a tool target (sections 4.3.1 to 4.3.3).

The names below are imported on first use, so that importing one of placement's
laws does not load pydrake.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from drake_mobarm.placement.best_stand import Stand, find_best_stand
    from drake_mobarm.placement.collision import Surroundings
    from drake_mobarm.placement.free_space import FreeSpace
    from drake_mobarm.placement.grid import (
        FreeGrid,
        grid_at,
        optimise_grid,
        plain_grid,
    )
    from drake_mobarm.placement.objective import (
        ObjectiveParameters,
        PlacementObjective,
    )
    from drake_mobarm.placement.objective_map import PlaceScores, score_places
    from drake_mobarm.placement.planner import (
        Placement,
        PlannerParameters,
        plan_stand,
    )
    from drake_mobarm.placement.problem import StandProblem, ToolTarget
    from drake_mobarm.placement.systems import RobotPoser, StandPlanner
else:
    _MODULES = {
        "FreeGrid": "grid",
        "FreeSpace": "free_space",
        "ObjectiveParameters": "objective",
        "PlaceScores": "objective_map",
        "Placement": "planner",
        "PlacementObjective": "objective",
        "PlannerParameters": "planner",
        "RobotPoser": "systems",
        "Stand": "best_stand",
        "StandPlanner": "systems",
        "StandProblem": "problem",
        "Surroundings": "collision",
        "ToolTarget": "problem",
        "find_best_stand": "best_stand",
        "grid_at": "grid",
        "optimise_grid": "grid",
        "plain_grid": "grid",
        "plan_stand": "planner",
        "score_places": "objective_map",
    }

    def __getattr__(name: str) -> object:
        """Imports a name of `__all__` on first use (PEP 562)."""
        if name not in _MODULES:
            raise AttributeError(
                f"module {__name__!r} has no attribute {name!r}"
            )
        return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)

    def __dir__() -> list[str]:
        """The module's names, those not yet imported among them."""
        return sorted({*globals(), *_MODULES})


__all__ = [
    "FreeGrid",
    "FreeSpace",
    "ObjectiveParameters",
    "PlaceScores",
    "Placement",
    "PlacementObjective",
    "PlannerParameters",
    "RobotPoser",
    "Stand",
    "StandPlanner",
    "StandProblem",
    "Surroundings",
    "ToolTarget",
    "find_best_stand",
    "grid_at",
    "optimise_grid",
    "plain_grid",
    "plan_stand",
    "score_places",
]
