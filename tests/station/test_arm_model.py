"""The arm driver's model against a plant of the whole robot."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.multibody.tree import MultibodyForces

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.station.arm_model import ArmModel
from helpers.urdf import fixed_robot

MODEL = ArmModel()
SIX = st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6)


ROBOT = fixed_robot()


@settings(max_examples=50)
@given(SIX, SIX, SIX)
def test_torques_are_those_of_the_whole_robot_on_a_base_that_stands_still(
    q, v, u
):
    context = ROBOT.CreateDefaultContext()
    acceleration = np.zeros(ROBOT.num_velocities())
    joints = [ROBOT.GetJointByName(name) for name in ARM_JOINTS]
    for joint, angle, rate, change in zip(joints, q, v, u, strict=True):
        joint.set_angle(context, angle)
        joint.set_angular_rate(context, rate)
        acceleration[joint.velocity_start()] = change
    forces = MultibodyForces(ROBOT)
    ROBOT.CalcForceElementsContribution(context, forces)
    expected = ROBOT.CalcInverseDynamics(context, acceleration, forces)
    np.testing.assert_allclose(
        MODEL.inverse_dynamics(np.array([*q, *v]), u),
        expected[[joint.velocity_start() for joint in joints]],
        atol=1e-12,
    )


def test_positions_beyond_a_joints_limits_become_the_limits():
    desired = np.zeros((2, 6))
    desired[:, 0], desired[:, 2] = 9.0, -9.0
    waist = ROBOT.GetJointByName("waist").position_upper_limits()[0]
    elbow = ROBOT.GetJointByName("elbow").position_lower_limits()[0]
    limited = MODEL.within_limits(desired)
    np.testing.assert_array_equal(limited[0], [waist, 0, elbow, 0, 0, 0])
    np.testing.assert_array_equal(limited[1], desired[1])
