"""The true motion and the contacts of the robot, for metrics and views."""

import math
from collections.abc import Callable

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import ContactResults
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    LeafSystem,
)

from drake_mobarm.signals import BaseVelocity, GroundTruth, PlanarPose, size

# A touch counts as a new contact after so long without one [s].
_CONTACT_PAUSE = 0.5


class BaseTruth(LeafSystem):
    """Reads the base's true planar motion off the plant's state.

    .. pydrake_system::

        name: BaseTruth
        input_ports:
        - robot_state
        output_ports:
        - base_pose
        - base_velocity

    - robot_state (n): positions and velocities of the robot's model, its
      floating base first (quaternion, position).
    - base_pose (3): PlanarPose in W.
    - base_velocity (2): BaseVelocity in B.

    Direct feedthrough.
    """

    def __init__(self, num_positions: int, num_states: int) -> None:
        super().__init__()
        self._num_positions = num_positions
        self._state = self.DeclareVectorInputPort("robot_state", num_states)
        self.DeclareVectorOutputPort(
            "base_pose", size(PlanarPose), self._calc_pose
        )
        self.DeclareVectorOutputPort(
            "base_velocity", size(BaseVelocity), self._calc_velocity
        )

    def _calc_pose(self, context: Context, output: BasicVector) -> None:
        w, x, y, z, *rest = self._state.Eval(context).tolist()
        output.SetFromVector([rest[0], rest[1], _yaw(w, x, y, z)])

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        state = self._state.Eval(context).tolist()
        yaw = _yaw(*state[:4])
        first = self._num_positions  # w_WB, then v_WB
        w_z, v_x, v_y = state[first + 2 : first + 5]
        forward = v_x * math.cos(yaw) + v_y * math.sin(yaw)
        output.SetFromVector([forward, w_z])


def _yaw(w: float, x: float, y: float, z: float) -> float:
    """Of a quaternion: not by a formula for those of length one only.

    Drake lets the length wander.
    """
    return math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)


class GroundTruthMonitor(LeafSystem):
    """What metrics may know: true motion, and contacts with obstacles.

    A contact is a touch after at least half a second without one; wheels and
    casters on the ground do not count.

    .. pydrake_system::

        name: GroundTruthMonitor
        input_ports:
        - base_pose
        - base_velocity
        - contact_results
        output_ports:
        - ground_truth

    - base_pose (3): PlanarPose, true.
    - base_velocity (2): BaseVelocity, true.
    - contact_results: the plant's.
    - ground_truth (7): GroundTruth.

    Direct feedthrough.
    """

    def __init__(
        self, touches_obstacle: Callable[[ContactResults], bool], rate: float
    ) -> None:
        super().__init__()
        self._touches_obstacle = touches_obstacle
        self._pose = self.DeclareVectorInputPort("base_pose", size(PlanarPose))
        self._velocity = self.DeclareVectorInputPort(
            "base_velocity", size(BaseVelocity)
        )
        self._results = self.DeclareAbstractInputPort(
            "contact_results", AbstractValue.Make(ContactResults())
        )
        # touching, contacts, time of the last touch
        self.DeclareDiscreteState([0.0, 0.0, -np.inf])
        self.DeclareVectorOutputPort(
            "ground_truth", size(GroundTruth), self._calc_truth
        )
        self.DeclarePeriodicDiscreteUpdateEvent(1 / rate, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        touch = context.get_discrete_state_vector()
        if self._touches_obstacle(self._results.Eval(context)):
            time = context.get_time()
            is_new = time - touch[2] > _CONTACT_PAUSE
            state.set_value([1.0, touch[1] + is_new, time])
        elif touch[0]:
            state.set_value([0.0, touch[1], touch[2]])

    def _calc_truth(self, context: Context, output: BasicVector) -> None:
        touch = context.get_discrete_state_vector()
        output.SetFromVector(
            [
                *self._pose.Eval(context).tolist(),
                *self._velocity.Eval(context).tolist(),
                touch[0],
                touch[1],
            ]
        )
