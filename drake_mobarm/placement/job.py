"""Placement: choose where to stand for a tool target (4.3.1 to 4.3.3)."""

from collections.abc import Mapping
from dataclasses import field
from typing import Any, ClassVar

from drake_mobarm.checks import (
    finite_numbers,
    not_negative,
    one_of,
    require,
    within,
)
from drake_mobarm.frozen import frozen
from drake_mobarm.job import Job, Trace, Verdict
from drake_mobarm.placement.metrics import placement_metrics
from drake_mobarm.placement.objective import (
    ObjectiveParameters,
    PlacementObjective,
)
from drake_mobarm.placement.planner import Placement
from drake_mobarm.placement.problem import ToolTarget
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.world.meshes import MESHES
from drake_mobarm.world.places import Place

GRIDS = ("optimised", "plain")


@frozen
class PlacementParameters:
    """How a stand is chosen.

    Attributes:
        avoid_collisions: whether the arm keeps out of furniture and off the
            robot itself; the dissertation's map does not look.
        grid: `optimised` (4.3.3) or `plain` squares.
        grid_size: edge length of a square [m].
        replan_distance: how far the target has to move for a new plan [m].
        objective: what counts as a good place.
    """

    avoid_collisions: bool = True
    grid: str = "optimised"
    grid_size: float = 0.2
    replan_distance: float = 0.05
    objective: ObjectiveParameters = field(default_factory=ObjectiveParameters)

    def __post_init__(self) -> None:
        PlacementObjective(ArmKinematics(), self.objective)
        one_of(self, GRIDS, "grid")
        within(self, "[0.05, 2]", "grid_size")
        not_negative(self, "replan_distance")


@frozen
class PlacementScenario(PlacementParameters):
    """Choose where to stand for a tool target (4.3.1 to 4.3.3).

    Attributes:
        diagram: the diagram that this scenario is for.
        world: a shipped world's name or the path of an SDF.
        meshes: what becomes of a mesh in the world: `refuse` it, or put an
            oriented box (`boxes`) or the convex hull (`hulls`) in the place
            of each of its connected parts.
        start: X_WB of the base, [x, y, yaw] in m and rad; it can only stand
            where it can drive to from here.
        target: p_WT of the tool's tip [m], within 1000 m of W's origin.
        approach: the tool's x axis in W, a unit vector.
        heading: of the base at the stand [rad], one number; empty where it
            may choose.
    """

    diagram: str = "placement"
    world: str
    start: tuple[float, ...]
    target: tuple[float, ...]
    approach: tuple[float, ...]
    heading: tuple[float, ...] = ()
    meshes: str = "refuse"

    time_limit: ClassVar[float] = 1.0
    """The plan is there at once; nothing moves [s]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        finite_numbers(self, "[x, y, yaw] in m and rad", "start")
        one_of(self, MESHES, "meshes")
        ToolTarget(position=self.target, approach=self.approach)
        require(
            max(map(abs, self.target)) <= 1000,
            "target",
            self.target,
            "within 1000 m of W's origin",
        )
        require(
            len(self.heading) <= 1
            and all(-1e6 <= x <= 1e6 for x in self.heading),
            "heading",
            self.heading,
            "empty, or [yaw] in rad, each in [-1e6, 1e6]",
        )


def _places(scenario: PlacementScenario) -> list[Place]:
    return [Place("start", scenario.start, robot=True)]


def _judge(
    scenario: PlacementScenario, trace: Trace, outputs: Mapping[str, Any]
) -> Verdict:
    placement: Placement = outputs["placement"]
    found = placement.stand is not None
    return Verdict(found, placement.reason, placement_metrics(placement))


JOB = Job(
    name="placement",
    scenario=PlacementScenario,
    places=_places,
    judge=_judge,
)
