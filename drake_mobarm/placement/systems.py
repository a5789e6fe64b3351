"""Placement as LeafSystems."""

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_mobarm.geometry import Array
from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.placement.collision import Surroundings
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.grid import FreeGrid
from drake_mobarm.placement.objective import PlacementObjective
from drake_mobarm.placement.objective_map import ToolTarget
from drake_mobarm.placement.planner import (
    Placement,
    nothing_planned,
    plan_stand,
)
from drake_mobarm.signals import BestStand, TargetEstimate, size


class StandPlanner(LeafSystem):
    """Plans where to stand for a target, anew when its estimate has moved.

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
      values, the best stand, and what it is or why there is none.
    - best_stand (11): BestStand; NaN where there is none.
    - planned (1): 1 once there is a plan, be it that nothing is reachable.

    No direct feedthrough.

    Args:
        objective: what counts.
        height: of the target over the floor [m], which no beacon tells.
        approach: the tool's x axis in W, a unit vector, (3,).
        free: where the base may be.
        grid: squares of that.
        heading: of the base [rad]; None where it may choose.
        surroundings: what the arm must not touch; None not to look.
        threshold: how far the estimate has to move for a new plan [m].
        rate: looks at the estimate a second [Hz].
        delay: after the estimator's updates [s].

    Raises:
        ParameterError: height or approach make no sense.
    """

    def __init__(
        self,
        objective: PlacementObjective,
        height: float,
        approach: list[float],
        free: FreeSpace,
        grid: FreeGrid,
        heading: float | None,
        surroundings: Surroundings | None,
        threshold: float,
        rate: float,
        delay: float,
    ) -> None:
        super().__init__()
        self._objective = objective
        self._height, self._approach = height, approach
        self._free, self._grid = free, grid
        self._heading, self._surroundings = heading, surroundings
        self._threshold = threshold
        self._make_target(np.zeros(2))  # Raises now rather than later.
        self._target = self.DeclareVectorInputPort(
            "estimated_target", size(TargetEstimate)
        )
        self._plan = self.DeclareAbstractState(Value(nothing_planned(grid)))
        self.DeclareStateOutputPort("placement", self._plan)
        own = {self.abstract_state_ticket(self._plan)}
        self.DeclareVectorOutputPort(
            "best_stand", size(BestStand), self._tell_stand, own
        )
        self.DeclareVectorOutputPort("planned", 1, self._tell_planned, own)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / rate, delay, self._update
        )

    def _update(self, context: Context, state: State) -> None:
        estimate = TargetEstimate(self._target.Eval(context))
        place = estimate[:2]
        if estimate.known < 0.5 or not np.isfinite(place).all():
            return
        last = self._last_plan(context).target
        if (
            last is not None
            and np.hypot(*(place - last.p_WT[:2])) <= self._threshold
        ):
            return
        plan = plan_stand(
            self._objective,
            self._make_target(place),
            self._free,
            self._grid,
            self._heading,
            self._surroundings,
        )
        state.get_mutable_abstract_state(int(self._plan)).set_value(plan)

    def _make_target(self, place: Array) -> ToolTarget:
        return ToolTarget(
            position=[*place, self._height], approach=self._approach
        )

    def _last_plan(self, context: Context) -> Placement:
        plan: Placement = context.get_abstract_state(
            int(self._plan)
        ).get_value()
        return plan

    def _tell_stand(self, context: Context, output: BasicVector) -> None:
        stand = self._last_plan(context).stand
        view = BestStand(np.full(size(BestStand), np.nan))
        view.known = 0.0
        if stand is not None:
            objective = float(stand.scores.objective)
            view[:] = [*stand.pose, *stand.q, objective, 1.0]
        output.SetFromVector(view[:])

    def _tell_planned(self, context: Context, output: BasicVector) -> None:
        planned = self._last_plan(context).target is not None
        output.SetFromVector([float(planned)])


class RobotPoser(LeafSystem):
    """Puts the robot, as a plant has it, onto its stand, to be looked at.

    .. pydrake_system::

        name: RobotPoser
        input_ports:
        - best_stand
        output_ports:
        - robot_positions

    - best_stand (11): BestStand.
    - robot_positions (positions): generalised positions of the plant; its
      default ones while no stand is known.

    Direct feedthrough.

    Args:
        plant: with nothing in it that moves but the robot.
    """

    def __init__(self, plant: MultibodyPlant) -> None:
        super().__init__()
        self._plant = plant
        self._stand = self.DeclareVectorInputPort("best_stand", size(BestStand))
        self.DeclareVectorOutputPort(
            "robot_positions", plant.num_positions(), self._tell_positions
        )

    def _tell_positions(self, context: Context, output: BasicVector) -> None:
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
