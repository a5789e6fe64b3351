"""What a run of each diagram is about: its stage, and how it is judged."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pydrake.geometry import Meshcat

from drake_mobarm.drawing.stage import look_at_run, look_at_target
from drake_mobarm.geometry import Array
from drake_mobarm.homing.metrics import homing_metrics, judge
from drake_mobarm.placement.metrics import placement_metrics
from drake_mobarm.placement.planner import Placement
from drake_mobarm.runtime.scenarios import HomingScenario, PlacementScenario

Verdict = tuple[bool, str, dict[str, float]]
"""Success, the reason, and the metrics."""


@dataclass(frozen=True)
class Task:
    """What a run needs to know of its diagram.

    Attributes:
        set_stage: sets light and camera for a scenario.
        judge: tells the verdict, from the scenario, the trace, and the
            diagram's outputs at the end, by name.
    """

    set_stage: Callable[[Meshcat, Any], None]
    judge: Callable[[Any, Mapping[str, Array], Mapping[str, Any]], Verdict]


def _stage_homing(meshcat: Meshcat, scenario: HomingScenario) -> None:
    look_at_run(meshcat, scenario.start, scenario.beacon)


def _judge_homing(
    scenario: HomingScenario,
    trace: Mapping[str, Array],
    outputs: Mapping[str, Any],
) -> Verdict:
    metrics = homing_metrics(trace, scenario.beacon)
    arrived = bool(outputs["done"][0] > 0.5)
    return *judge(metrics, arrived, scenario.time_limit), metrics


def _stage_placement(meshcat: Meshcat, scenario: PlacementScenario) -> None:
    look_at_target(meshcat, scenario.target, scenario.approach)


def _judge_placement(
    scenario: PlacementScenario,
    trace: Mapping[str, Array],
    outputs: Mapping[str, Any],
) -> Verdict:
    placement: Placement = outputs["placement"]
    found = placement.stand is not None
    return found, placement.reason, placement_metrics(placement)


TASKS = {
    "homing": Task(_stage_homing, _judge_homing),
    "placement": Task(_stage_placement, _judge_placement),
}
"""By the diagram's name."""
