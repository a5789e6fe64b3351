"""What a run of each diagram is about: its stage, and how it is judged."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat

from drake_mobarm.geometry import Array
from drake_mobarm.homing.metrics import homing_metrics, judge
from drake_mobarm.placement.metrics import placement_metrics
from drake_mobarm.placement.planner import Placement
from drake_mobarm.scenario import HomingScenario, PlacementScenario
from drake_mobarm.visualization import light_stage, set_stage

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
    set_stage(meshcat, scenario.start, scenario.beacon)


def _judge_homing(
    scenario: HomingScenario,
    trace: Mapping[str, Array],
    outputs: Mapping[str, Any],
) -> Verdict:
    metrics = homing_metrics(trace, scenario.beacon)
    arrived = bool(outputs["done"][0] > 0.5)
    return *judge(metrics, arrived, scenario.time_limit), metrics


def _stage_placement(meshcat: Meshcat, scenario: PlacementScenario) -> None:
    # From where the tool comes, and a little aside, to see the arm.
    target = np.array(scenario.target)
    back = -np.array(scenario.approach[:2])
    level = np.hypot(*back)
    back = back / level if level > 0.1 else np.array([0.0, -1.0])
    aside = np.array([-back[1], back[0]])
    light_stage(meshcat)
    meshcat.SetCameraPose(
        target + np.array([*(1.2 * back + 0.9 * aside), 0.8]),
        target + np.array([*(0.25 * back), -0.15]),
    )


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
