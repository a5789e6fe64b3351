"""Driving as a LeafSystem: the controller that follows a waypoint."""

import math

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_mobarm.driving.waypoint import ControllerParameters, drive_to
from drake_mobarm.signals import BaseVelocity, PlanarPose, Waypoint, size


class WaypointController(LeafSystem):
    """Drives to the waypoint by proportional control, and halts on arrival.

    Without a waypoint it turns on the spot, so that the robot's sensors look
    around.

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
        parameters: gains and limits.
    """

    def __init__(self, parameters: ControllerParameters) -> None:
        super().__init__()
        self._parameters = parameters
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
        if self._arrived.Eval(context)[0] > 0.5:
            return 0.0, 0.0
        x, y, speed_limit = self._waypoint.Eval(context).tolist()
        if not (math.isfinite(x) and math.isfinite(y)):
            return 0.0, self._parameters.search_turn_rate
        if speed_limit < 0:
            return speed_limit, 0.0
        return drive_to(
            self._pose.Eval(context).tolist(),
            (x, y),
            self._parameters,
            speed_limit,
        )
