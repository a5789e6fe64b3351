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

from drake_mobarm.signals import GroundTruth, PlanarPose, size

# A touch counts as a new contact after so long without one [s].
_CONTACT_PAUSE = 0.5


class BaseTruth(LeafSystem):
    """Reads the base's true pose off the plant's state, for the sensors.

    .. pydrake_system::

        name: BaseTruth
        input_ports:
        - robot_state
        output_ports:
        - base_pose

    - robot_state (n): positions and velocities of the robot's model, its
      floating base first (quaternion, position).
    - base_pose (3): PlanarPose in W.

    Direct feedthrough.
    """

    def __init__(self, num_states: int) -> None:
        super().__init__()
        self._state = self.DeclareVectorInputPort("robot_state", num_states)
        self.DeclareVectorOutputPort(
            "base_pose", size(PlanarPose), self._calc_pose
        )

    def _calc_pose(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(_pose(self._state.Eval(context).tolist()))


def _pose(state: list[float]) -> tuple[float, float, float]:
    """x, y [m] and yaw [rad] in W of a state that begins with a base's.

    Drake lets the quaternion's length wander: no formula for unit ones.
    """
    w, x, y, z, p_x, p_y = state[:6]
    yaw = math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return p_x, p_y, yaw


class GroundTruthMonitor(LeafSystem):
    """What metrics may know: true motion, and contacts with obstacles.

    A contact is a touch after at least half a second without one; wheels and
    casters on the ground do not count.

    .. pydrake_system::

        name: GroundTruthMonitor
        input_ports:
        - robot_state
        - contact_results
        output_ports:
        - ground_truth

    - robot_state (n): positions and velocities of the robot's model, its
      floating base first (quaternion, position; w_WB, v_WB).
    - contact_results: the plant's.
    - ground_truth (7): GroundTruth.

    Direct feedthrough.

    Args:
        num_positions: of the robot's model.
        num_states: of the robot's model.
        touches_obstacle: tells of contact results whether the robot touches
            an obstacle.
        rate: looks at contacts a second [Hz].
    """

    def __init__(
        self,
        num_positions: int,
        num_states: int,
        touches_obstacle: Callable[[ContactResults], bool],
        rate: float,
    ) -> None:
        super().__init__()
        self._num_positions = num_positions
        self._touches_obstacle = touches_obstacle
        self._state = self.DeclareVectorInputPort("robot_state", num_states)
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
        state = self._state.Eval(context).tolist()
        x, y, yaw = _pose(state)
        w_z, v_x, v_y = state[self._num_positions + 2 : self._num_positions + 5]
        forward = v_x * math.cos(yaw) + v_y * math.sin(yaw)
        touch = context.get_discrete_state_vector()
        output.SetFromVector([x, y, yaw, forward, w_z, touch[0], touch[1]])
