"""The station's two drivers as LeafSystems."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_mobarm.signals import ArmState, BaseVelocity, WheelState, size
from drake_mobarm.station.arm_drive import (
    REFERENCE_SHARE,
    ArmDriveParameters,
    desired_acceleration,
    limit_reference,
    limit_torque,
)
from drake_mobarm.station.arm_model import ArmModel
from drake_mobarm.station.base_drive import (
    BaseDriveParameters,
    drive_torques,
    limit_velocity,
    ramp,
    yield_to,
)


class BaseDriver(LeafSystem):
    """Turns the wheels so that the base follows a commanded velocity.

    .. pydrake_system::

        name: BaseDriver
        input_ports:
        - commanded_base_velocity
        - measured_wheel_state
        output_ports:
        - wheel_torque

    - commanded_base_velocity (2): BaseVelocity [m/s, rad/s], in B.
    - measured_wheel_state (4): WheelState [rad, rad/s].
    - wheel_torque (2): left, right [N m], held between updates.

    No direct feedthrough.
    """

    def __init__(self, parameters: BaseDriveParameters) -> None:
        super().__init__()
        self._parameters = parameters
        self._step = 1 / parameters.rate
        self._command = self.DeclareVectorInputPort(
            "commanded_base_velocity", size(BaseVelocity)
        )
        self._wheels = self.DeclareVectorInputPort(
            "measured_wheel_state", size(WheelState)
        )
        reference = self.DeclareDiscreteState(2)
        torque = self.DeclareDiscreteState(2)
        self.DeclareStateOutputPort("wheel_torque", torque)
        # Whole numbers: Drake's own indices take longer to hand over.
        self._reference, self._torque = int(reference), int(torque)
        self.DeclarePeriodicDiscreteUpdateEvent(self._step, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        _, _, left, right = self._wheels.Eval(context).tolist()
        measured = self._parameters.base.body_velocity(left, right)
        reference = yield_to(
            context.get_discrete_state(self._reference).value().tolist(),
            measured,
            self._parameters,
        )
        target = limit_velocity(
            self._command.Eval(context).tolist(), self._parameters
        )
        following = ramp(reference, target, self._step, self._parameters)
        state.set_value(
            self._torque,
            drive_torques(
                reference, following, measured, self._step, self._parameters
            ),
        )
        state.set_value(self._reference, following)


class ArmDriver(LeafSystem):
    """Moves the arm's joints along a desired state by inverse dynamics.

    .. pydrake_system::

        name: ArmDriver
        input_ports:
        - desired_arm_state
        - measured_arm_state
        output_ports:
        - arm_torque

    - desired_arm_state (12): ArmState [rad, rad/s].
    - measured_arm_state (12): ArmState [rad, rad/s].
    - arm_torque (6): [N m], held between updates.

    No direct feedthrough.
    """

    def __init__(
        self, parameters: ArmDriveParameters, initial_q: Sequence[float]
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._step = 1 / parameters.rate
        self._model = ArmModel()
        self._desired = self.DeclareVectorInputPort(
            "desired_arm_state", size(ArmState)
        )
        self._measured = self.DeclareVectorInputPort(
            "measured_arm_state", size(ArmState)
        )
        reference = self.DeclareDiscreteState([*initial_q, *np.zeros(6)])
        torque = self.DeclareDiscreteState(6)
        self.DeclareStateOutputPort("arm_torque", torque)
        self._reference, self._torque = int(reference), int(torque)
        self.DeclarePeriodicDiscreteUpdateEvent(self._step, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        model = self._model
        measured = self._measured.Eval(context)
        desired = self._desired.Eval(context)
        reference = context.get_discrete_state(self._reference).value()
        error = (reference - measured).tolist()
        u = desired_acceleration(
            error[:6], error[6:], model.acceleration_limit, self._parameters
        )
        torque = limit_torque(
            model.inverse_dynamics(measured, u),
            measured.tolist()[6:],
            model.stall_torque,
            self._parameters.no_load_speed,
        )
        state.set_value(self._torque, torque)
        # Most of the time the arm is where it should be: nothing to do then.
        if (
            desired.tolist() != reference.tolist()
            and np.isfinite(desired).all()
        ):
            following = limit_reference(
                reference.reshape(2, 6),
                model.within_limits(desired.reshape(2, 6)),
                self._step,
                model.speed_limit,
                REFERENCE_SHARE * np.array(model.acceleration_limit),
            )
            state.set_value(self._reference, following.ravel())
