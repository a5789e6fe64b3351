"""Navigation as a LeafSystem."""

import math
from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_mobarm.geometry import clip_magnitude
from drake_mobarm.navigation.planner import PlannerLaw, PlannerState
from drake_mobarm.sensors.lidar import LidarParameters
from drake_mobarm.signals import (
    BaseVelocity,
    GivenUp,
    NavigationForces,
    PlanarPose,
    TargetEstimate,
    size,
)

# For so long after a target becomes known no robot is there [s].
_SETTLING = 1.0


class NavigationPlanner(LeafSystem):
    """Drives to the target by a planner's law.

    .. pydrake_system::

        name: NavigationPlanner
        input_ports:
        - measured_base_pose
        - estimated_target
        - lidar_ranges
        output_ports:
        - commanded_base_velocity
        - arrived
        - given_up
        - navigation_forces
        - planned_paths

    - measured_base_pose (3): PlanarPose in W.
    - estimated_target (3): TargetEstimate in W.
    - lidar_ranges (rays): [m], as `ray_angles` orders them. One that is NaN,
      negative or 0 is missing.
    - commanded_base_velocity (2): BaseVelocity in B; 0 while the target is
      not known.
    - arrived (1): 1 once the robot is at the target; it stays there. In the
      first second of a target's being known it is not: first estimates are
      far off.
    - given_up (3): GivenUp, with the place of what shuts the way.
    - navigation_forces (6): NavigationForces in W; 0 for a law without them.
    - planned_paths: abstract, a tuple of the corners p_WQ of each way that the
      robot is led along [m], (k, 2) each.

    Direct feedthrough.

    Args:
        law: of the planner.
        lidar: whose ranges these are.
        delay: after the lidar's samples [s].
        speed_limit: the robot's, which no command exceeds [m/s, rad/s], (2,).
    """

    def __init__(
        self,
        law: PlannerLaw,
        lidar: LidarParameters,
        delay: float,
        speed_limit: Sequence[float] = (math.inf, math.inf),
    ) -> None:
        super().__init__()
        self._law = law
        self._speed_limit = tuple(speed_limit)
        self._pose = self.DeclareVectorInputPort(
            "measured_base_pose", size(PlanarPose)
        )
        self._target = self.DeclareVectorInputPort(
            "estimated_target", size(TargetEstimate)
        )
        self._ranges = self.DeclareVectorInputPort("lidar_ranges", lidar.rays)
        memory = self.DeclareAbstractState(Value(law.initial_state()))
        self._memory = int(memory)
        self._period = 1 / lidar.rate
        # Since the target is known [s].
        self._known_for = self.DeclareDiscreteState(1)
        self._arrived = self.DeclareDiscreteState(1)
        self._given_up = self.DeclareDiscreteState(size(GivenUp))
        self._forces = self.DeclareDiscreteState(size(NavigationForces))
        self.DeclareVectorOutputPort(
            "commanded_base_velocity",
            size(BaseVelocity),
            self._calc_velocity,
            {
                self.input_port_ticket(self._pose.get_index()),
                self.input_port_ticket(self._target.get_index()),
                self.abstract_state_ticket(memory),
            },
        )
        self.DeclareStateOutputPort("arrived", self._arrived)
        self.DeclareStateOutputPort("given_up", self._given_up)
        self.DeclareStateOutputPort("navigation_forces", self._forces)
        self.DeclareAbstractOutputPort(
            "planned_paths",
            lambda: Value(()),
            self._calc_paths,
            {self.abstract_state_ticket(memory)},
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / lidar.rate, delay, self._update
        )

    def _state(self, context: Context) -> PlannerState:
        state: PlannerState = context.get_abstract_state(
            self._memory
        ).get_value()
        return state

    def _has_arrived(self, context: Context) -> bool:
        arrived = context.get_discrete_state(self._arrived).value()
        return bool(arrived[0] > 0.5)

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        if TargetEstimate(self._target.Eval(context)).known < 0.5:
            output.SetZero()
            return
        pose = self._pose.Eval(context)
        velocity = self._law.command(self._state(context), pose)
        output.SetFromVector(
            clip_magnitude(np.array(velocity), self._speed_limit)
        )

    def _calc_paths(self, context: Context, output: Value) -> None:
        output.set_value(self._state(context).paths)

    def _update(self, context: Context, state: State) -> None:
        target = TargetEstimate(self._target.Eval(context))
        memory = self._state(context)
        if self._has_arrived(context):
            return
        if target.known < 0.5:
            state.get_mutable_discrete_state().set_value(self._known_for, [0.0])
            return
        ranges = self._ranges.Eval(context)
        memory = self._law.update(
            memory,
            self._pose.Eval(context),
            np.array(target[:2]),
            # Drivers tell by -inf or 0, too, that there is no range.
            np.where(ranges > 0, ranges, np.nan),
        )
        state.get_mutable_abstract_state(self._memory).set_value(memory)
        discrete = state.get_mutable_discrete_state()
        known_for = context.get_discrete_state(self._known_for).value()
        known_for = known_for + self._period
        arrived = memory.arrived and known_for[0] > _SETTLING
        discrete.set_value(self._known_for, known_for)
        discrete.set_value(self._arrived, [float(arrived)])
        discrete.set_value(self._forces, np.concatenate(memory.forces))
        if memory.shut is not None:
            discrete.set_value(self._given_up, [1.0, *memory.shut])
