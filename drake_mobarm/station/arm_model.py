"""The arm without its base: what the arm driver's inverse dynamics need."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Joint,
    MultibodyForces,
    RevoluteJoint,
)

from drake_mobarm.geometry import Array
from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot.shape import URDF


class ArmModel:
    """The arm on a base that stands still, for (7.13), and its limits.

    Its context is scratch: what is read of it is written right before, so it
    keeps nothing between updates. It is not for two threads at once.

    Attributes:
        stall_torque: of each joint's motor [N m].
        speed_limit: of each joint [rad/s], (6,).
        acceleration_limit: of each joint [rad/s^2].
    """

    def __init__(self) -> None:
        robot = MultibodyPlant(0.0)
        Parser(robot).AddModels(str(URDF))
        robot.Finalize()
        joints = [robot.GetJointByName(name) for name in ARM_JOINTS]
        self._plant = _separate_arm(robot, joints)
        self._context = self._plant.CreateDefaultContext()
        self._forces = MultibodyForces(self._plant)
        self.stall_torque = [
            robot.GetJointActuatorByName(name).effort_limit()
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

    def within_limits(self, desired: Array) -> Array:
        """A desired state (2, 6) with its positions in the joints' limits."""
        return np.array(
            [np.clip(desired[0], self._lower, self._upper), desired[1]]
        )

    def inverse_dynamics(self, state: Array, u: Sequence[float]) -> list[float]:
        """Tau = D(q) u + C(q, v) v + g(q) [N m] a joint; (7.13).

        Args:
            state: positions, then velocities [rad, rad/s], (12,).
            u: accelerations [rad/s^2], (6,).
        """
        plant, context, forces = self._plant, self._context, self._forces
        plant.SetPositionsAndVelocities(context, state)
        plant.CalcForceElementsContribution(context, forces)
        tau: Any = plant.CalcInverseDynamics(context, u, forces)
        torque: list[float] = tau.tolist()
        return torque


def _separate_arm(
    robot: MultibodyPlant, joints: Sequence[Joint]
) -> MultibodyPlant:
    """The arm's links, standing on the world as on the robot's base.

    Each with all that is fixed to it as one body: half the robot's bodies.
    """
    context = robot.CreateDefaultContext()
    arm = MultibodyPlant(0.0)
    before, parent = robot.GetBodyByName("base"), arm.world_body()
    for joint in joints:
        link = joint.child_body()
        fixed = [body.index() for body in robot.GetBodiesWeldedTo(link)]
        child = arm.AddRigidBody(
            link.name(),
            robot.CalcSpatialInertia(context, link.body_frame(), fixed),
        )
        X_PF = joint.frame_on_parent().CalcPose(context, before.body_frame())
        hinge = arm.AddJoint(
            RevoluteJoint(
                name=joint.name(),
                frame_on_parent=arm.AddFrame(
                    FixedOffsetFrame(
                        f"{joint.name()}_place", parent.body_frame(), X_PF
                    )
                ),
                frame_on_child=child.body_frame(),
                axis=joint.revolute_axis(),
                damping=joint.default_damping(),
            )
        )
        motor = robot.GetJointActuatorByName(joint.name())
        copied = arm.AddJointActuator(joint.name(), hinge, motor.effort_limit())
        copied.set_default_rotor_inertia(motor.default_rotor_inertia())
        copied.set_default_gear_ratio(motor.default_gear_ratio())
        before, parent = link, child
    arm.Finalize()
    return arm
