"""Finding a beacon and driving to it (chapter 2): laws and systems."""

from typing import TYPE_CHECKING

from drake_mobarm.lazy import attach

if TYPE_CHECKING:
    from drake_mobarm.homing.avoidance_state import AvoidanceParameters
    from drake_mobarm.homing.filter import FilterEstimator, FilterParameters
    from drake_mobarm.homing.hybrid import HybridEstimator, HybridParameters
    from drake_mobarm.homing.systems import (
        ObstacleAvoidance,
        StraightToTarget,
        TargetEstimator,
        TargetLaw,
    )
else:
    __getattr__, __dir__ = attach(
        __name__,
        {
            "AvoidanceParameters": "avoidance_state",
            "FilterEstimator": "filter",
            "FilterParameters": "filter",
            "HybridEstimator": "hybrid",
            "HybridParameters": "hybrid",
            "ObstacleAvoidance": "systems",
            "StraightToTarget": "systems",
            "TargetEstimator": "systems",
            "TargetLaw": "systems",
        },
    )

__all__ = [
    "AvoidanceParameters",
    "FilterEstimator",
    "FilterParameters",
    "HybridEstimator",
    "HybridParameters",
    "ObstacleAvoidance",
    "StraightToTarget",
    "TargetEstimator",
    "TargetLaw",
]
