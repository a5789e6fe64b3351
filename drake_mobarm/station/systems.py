"""The station's two drivers as LeafSystems."""

from typing import Any

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot.shape import URDF
from drake_mobarm.signals import ArmState, BaseVelocity, WheelState, size
from drake_mobarm.station.arm_drive import (
    REFERENCE_SHARE,
    ArmDriveParameters,
    desired_acceleration,
    limit_reference,
    limit_torque,
)
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
        self._reference = self.DeclareDiscreteState(2)
        self._torque = self.DeclareDiscreteState(2)
        self.DeclareStateOutputPort("wheel_torque", self._torque)
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
        self, parameters: ArmDriveParameters, initial_q: list[float]
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._step = 1 / parameters.rate
        self._model = _ArmModel()
        self._desired = self.DeclareVectorInputPort(
            "desired_arm_state", size(ArmState)
        )
        self._measured = self.DeclareVectorInputPort(
            "measured_arm_state", size(ArmState)
        )
        self._reference = self.DeclareDiscreteState(
            np.concatenate([initial_q, np.zeros(6)])
        )
        self._torque = self.DeclareDiscreteState(6)
        self.DeclareStateOutputPort("arm_torque", self._torque)
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
            measured[6:].tolist(),
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


class _ArmModel:
    """The arm on a base that stands still, for (7.13), and its limits.

    Its context is scratch: what is read of it is written right before, so it
    keeps nothing between updates. It is not for two threads at once.
    """

    def __init__(self) -> None:
        self._plant = MultibodyPlant(0.0)
        Parser(self._plant).AddModels(str(URDF))
        self._plant.WeldFrames(
            self._plant.world_frame(), self._plant.GetFrameByName("base")
        )
        self._plant.Finalize()
        self._context = self._plant.CreateDefaultContext()
        joints = [self._plant.GetJointByName(name) for name in ARM_JOINTS]
        first = joints[0].velocity_start()
        self._arm = slice(first, first + len(joints))
        # Wheels stand still; base and wheels have as many speeds as angles.
        self._state = np.zeros((2, self._plant.num_velocities()))
        self._u = np.zeros(self._plant.num_velocities())
        self._forces = MultibodyForces(self._plant)
        self.stall_torque = [
            self._plant.GetJointActuatorByName(name).effort_limit()
            for name in ARM_JOINTS
        ]
        self.speed_limit = np.array(
            [joint.velocity_upper_limits()[0] for joint in joints]
        )
        self.acceleration_limit = [
            float(joint.acceleration_upper_limits()[0]) for joint in joints
        ]
        self._lower = np.array(
            [joint.position_lower_limits()[0] for joint in joints]
        )
        self._upper = np.array(
            [joint.position_upper_limits()[0] for joint in joints]
        )

    def within_limits(self, desired: Any) -> Any:
        """A desired state (2, 6) with its positions in the joints' limits."""
        return np.array(
            [np.clip(desired[0], self._lower, self._upper), desired[1]]
        )

    def inverse_dynamics(self, state: Any, u: list[float]) -> list[float]:
        """Tau = D(q) u + C(q, v) v + g(q) [N m], (7.13), at a state (12,)."""
        self._state[:, self._arm] = state.reshape(2, 6)
        self._u[self._arm] = u
        self._plant.SetPositionsAndVelocities(
            self._context, self._state.ravel()
        )
        self._plant.CalcForceElementsContribution(self._context, self._forces)
        tau = self._plant.CalcInverseDynamics(
            self._context, self._u, self._forces
        )
        torque: list[float] = tau[self._arm].tolist()
        return torque
