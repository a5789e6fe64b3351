"""Driving as LeafSystems: the way over a map, and to a waypoint."""

import math
from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_mobarm.driving import map_avoidance
from drake_mobarm.driving.map_avoidance_state import (
    MapAvoidanceParameters,
    initial_state,
)
from drake_mobarm.driving.waypoint import ControllerParameters, drive_to
from drake_mobarm.geometry import is_pose
from drake_mobarm.sensors.lidar import LidarParameters
from drake_mobarm.signals import (
    BaseVelocity,
    PlanarPose,
    TargetEstimate,
    Waypoint,
    size,
)


class WaypointController(LeafSystem):
    """Drives to the waypoint by proportional control, and halts on arrival.

    Without a waypoint it turns on the spot, so that the robot's sensors look
    around. It stands still while the pose cannot be one.

    .. pydrake_system::

        name: WaypointController
        input_ports:
        - measured_base_pose
        - waypoint
        - arrived
        output_ports:
        - commanded_base_velocity

    - measured_base_pose (3): PlanarPose in W.
    - waypoint (3): Waypoint in W.
    - arrived (1): 1 to halt.
    - commanded_base_velocity (2): BaseVelocity in B.

    Direct feedthrough.

    Args:
        parameters: gains.
        speed_limit: the robot's [m/s, rad/s], (2,).
    """

    def __init__(
        self, parameters: ControllerParameters, speed_limit: Sequence[float]
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._speed_limit = tuple(speed_limit)
        self._pose = self.DeclareVectorInputPort(
            "measured_base_pose", size(PlanarPose)
        )
        self._waypoint = self.DeclareVectorInputPort("waypoint", size(Waypoint))
        self._arrived = self.DeclareVectorInputPort("arrived", 1)
        self.DeclareVectorOutputPort(
            "commanded_base_velocity", size(BaseVelocity), self._calc
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._command(context))

    def _command(self, context: Context) -> tuple[float, float]:
        pose = self._pose.Eval(context).tolist()
        if self._arrived.Eval(context)[0] > 0.5 or not is_pose(pose):
            return 0.0, 0.0
        x, y, limit = self._waypoint.Eval(context).tolist()
        if not (math.isfinite(x) and math.isfinite(y)):
            rate = self._parameters.search_turn_rate
            return 0.0, min(rate, self._speed_limit[1])
        speed, turn_rate = self._speed_limit
        if limit < 0:
            return max(limit, -speed), 0.0
        return drive_to(
            pose, (x, y), (min(limit, speed), turn_rate), self._parameters
        )


class MapAvoidance(LeafSystem):
    """Leads around obstacles to the target, by a map of what was seen.

    .. pydrake_system::

        name: MapAvoidance
        input_ports:
        - measured_base_pose
        - estimated_target
        - lidar_ranges
        output_ports:
        - waypoint
        - given_up

    - measured_base_pose (3): PlanarPose in W.
    - estimated_target (3): TargetEstimate in W.
    - lidar_ranges (rays): [m], as `ray_angles` orders them.
    - waypoint (3): Waypoint in W.
    - given_up (3): GivenUp, with the place of what shuts the way.

    No direct feedthrough.

    Args:
        parameters: how to drive.
        lidar: whose ranges these are.
        delay: after the lidar's samples [s].
    """

    def __init__(
        self,
        parameters: MapAvoidanceParameters,
        lidar: LidarParameters,
        delay: float,
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._range_max, self._period = lidar.range_max, 1 / lidar.rate
        self._pose = self.DeclareVectorInputPort(
            "measured_base_pose", size(PlanarPose)
        )
        self._target = self.DeclareVectorInputPort(
            "estimated_target", size(TargetEstimate)
        )
        self._ranges = self.DeclareVectorInputPort("lidar_ranges", lidar.rays)
        self._memory = self.DeclareAbstractState(Value(initial_state()))
        self._waypoint = self.DeclareDiscreteState([np.nan, np.nan, 0.0])
        self._given_up = self.DeclareDiscreteState(3)
        self.DeclareStateOutputPort("waypoint", self._waypoint)
        self.DeclareStateOutputPort("given_up", self._given_up)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / lidar.rate, delay, self._update
        )

    def _update(self, context: Context, state: State) -> None:
        target = TargetEstimate(self._target.Eval(context))
        if target.known < 0.5:
            return
        memory = map_avoidance.update(
            context.get_abstract_state(int(self._memory)).get_value(),
            self._pose.Eval(context),
            target[:2],
            self._ranges.Eval(context),
            self._range_max,
            self._period,
            self._parameters,
        )
        state.get_mutable_abstract_state(int(self._memory)).set_value(memory)
        discrete = state.get_mutable_discrete_state()
        discrete.set_value(
            self._waypoint, [*memory.waypoint, memory.speed_limit]
        )
        if memory.shut is not None:
            discrete.set_value(self._given_up, [1.0, *memory.shut])
