"""Placement as systems: the planner, and the robot posed on its stand."""

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.placement.grid import FreeGrid
from drake_mobarm.placement.planner import (
    Placement,
    PlannerParameters,
    nothing_planned,
    plan_stand,
)
from drake_mobarm.placement.problem import StandProblem
from drake_mobarm.signals import BestStand, TargetEstimate, size


class StandPlanner(LeafSystem):
    """Plans where to stand for a target, and anew when its estimate moves.

    .. pydrake_system::

        name: StandPlanner
        input_ports:
        - estimated_target
        output_ports:
        - placement
        - best_stand
        - planned

    - estimated_target (3): TargetEstimate in W.
    - placement: abstract, Placement: the attractive squares with their
      objective, the best stand, and its description or why there is none.
    - best_stand (11): BestStand; NaN where there is none.
    - planned (1): 1 once there is a plan, even one that finds the target out
      of reach; 0 before.

    No direct feedthrough.

    Args:
        problem: what to plan for. Every plan is for a target as high as the
            problem's, along the same approach, as no estimate tells these;
            its place on the floor plan is estimated, and not read from here.
        grid: squares of the problem's free space.
        parameters: when a new plan is made.
    """

    def __init__(
        self,
        problem: StandProblem,
        grid: FreeGrid,
        parameters: PlannerParameters,
    ) -> None:
        super().__init__()
        self._problem, self._grid = problem, grid
        self._replan_distance = parameters.replan_distance
        self._target = self.DeclareVectorInputPort(
            "estimated_target", size(TargetEstimate)
        )
        self._plan = self.DeclareAbstractState(Value(nothing_planned(grid)))
        self.DeclareStateOutputPort("placement", self._plan)
        own = {self.abstract_state_ticket(self._plan)}
        self.DeclareVectorOutputPort(
            "best_stand", size(BestStand), self._output_stand, own
        )
        self.DeclareVectorOutputPort("planned", 1, self._output_planned, own)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / parameters.rate, parameters.delay, self._update
        )

    def _update(self, context: Context, state: State) -> None:
        estimate = TargetEstimate(self._target.Eval(context))
        place = estimate[:2]
        if estimate.known < 0.5 or not np.isfinite(place).all():
            return
        last = self._last_plan(context).target
        if (
            last is not None
            and np.hypot(*(place - last.p_WT[:2])) <= self._replan_distance
        ):
            return
        plan = plan_stand(self._problem.with_target_at(place), self._grid)
        state.get_mutable_abstract_state(int(self._plan)).set_value(plan)

    def _last_plan(self, context: Context) -> Placement:
        plan: Placement = context.get_abstract_state(
            int(self._plan)
        ).get_value()
        return plan

    def _output_stand(self, context: Context, output: BasicVector) -> None:
        stand = self._last_plan(context).stand
        values = BestStand(np.full(size(BestStand), np.nan))
        values.known = 0.0
        if stand is not None:
            objective = float(stand.scores.objective)
            values[:] = [*stand.pose, *stand.q, objective, 1.0]
        output.SetFromVector(values[:])

    def _output_planned(self, context: Context, output: BasicVector) -> None:
        planned = self._last_plan(context).target is not None
        output.SetFromVector([float(planned)])


class RobotPoser(LeafSystem):
    """Turns a stand into positions of a plant, to draw the robot there.

    .. pydrake_system::

        name: RobotPoser
        input_ports:
        - best_stand
        output_ports:
        - robot_positions

    - best_stand (11): BestStand.
    - robot_positions (positions): generalised positions of the plant; the
      default ones while no stand is known.

    Direct feedthrough.

    Args:
        plant: a finalised plant with the robot, and nothing else that moves.
    """

    def __init__(self, plant: MultibodyPlant) -> None:
        super().__init__()
        self._plant = plant
        self._stand = self.DeclareVectorInputPort("best_stand", size(BestStand))
        self.DeclareVectorOutputPort(
            "robot_positions", plant.num_positions(), self._output_positions
        )

    def _output_positions(self, context: Context, output: BasicVector) -> None:
        stand = BestStand(self._stand.Eval(context))
        plant = self._plant
        own = plant.CreateDefaultContext()
        if stand.known > 0.5:
            plant.SetFloatingBaseBodyPoseInWorldFrame(
                own,
                plant.GetBodyByName("base"),
                RigidTransform(
                    RotationMatrix.MakeZRotation(stand.yaw),
                    [stand.x, stand.y, 0.0],
                ),
            )
            for name in ARM_JOINTS:
                joint = plant.GetJointByName(name)
                joint.set_angle(own, getattr(stand, f"{name}_q"))
        output.SetFromVector(plant.GetPositions(own))
