"""Against Drake, products of 4x4 matrices and central differences."""

import math

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    JacobianWrtVariable,
    SpatialInertia,
    UnitInertia,
    default_model_instance,
)

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot import (
    WIDOWX_250,
    ArmKinematics,
)
from drake_mobarm.robot.shape import URDF
from helpers.arms import (
    PI,
    STRAIGHT,
    WIDOWX,
    all_arms,
    frames,
    jacobian_at,
    pose,
    random_q,
)

# Nothing here may warn, out of reach and singular poses included.
pytestmark = pytest.mark.filterwarnings("error")


# Against the plant


def add_robot(payload):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(URDF))
    if payload:
        body = plant.AddRigidBody(
            "payload",
            default_model_instance(),
            SpatialInertia(payload, [0, 0, 0], UnitInertia(0, 0, 0)),
        )
        plant.WeldFrames(
            plant.GetFrameByName("tool"), body.body_frame(), RigidTransform()
        )
    plant.Finalize()
    return plant, plant.CreateDefaultContext()


@pytest.fixture(scope="module")
def robot():
    return add_robot(0.0)


@pytest.fixture(scope="module")
def q_in_limits(robot):
    joints = [robot[0].GetJointByName(name) for name in ARM_JOINTS]
    return np.random.default_rng(1).uniform(
        [joint.position_lower_limits()[0] for joint in joints],
        [joint.position_upper_limits()[0] for joint in joints],
        (10_000, 6),
    )


def at_each(robot, q_in_limits, evaluate):
    plant, context = robot
    joints = [plant.GetJointByName(name) for name in ARM_JOINTS]
    positions = plant.GetPositions(context)
    where = [joint.position_start() for joint in joints]
    columns = [joint.velocity_start() for joint in joints]
    values = []
    for q in q_in_limits:
        positions[where] = q
        plant.SetPositions(context, positions)
        values.append(evaluate(plant, context, columns))
    return np.array(values)


def test_pose_is_that_of_the_plant(robot, q_in_limits):
    def X_BT(plant, context, columns):
        base, tool = map(plant.GetFrameByName, ("arm_base", "tool"))
        return plant.CalcRelativeTransform(context, base, tool).GetAsMatrix4()

    expected = at_each(robot, q_in_limits, X_BT)
    assert np.abs(WIDOWX.forward(q_in_limits) - expected).max() < 1e-9


def test_jacobian_is_that_of_the_plant(robot, q_in_limits):
    def J_BT(plant, context, columns):
        base, tool = map(plant.GetFrameByName, ("arm_base", "tool"))
        J = plant.CalcJacobianSpatialVelocity(
            context, JacobianWrtVariable.kV, tool, [0, 0, 0], base, base
        )
        return J[[3, 4, 5, 0, 1, 2]][:, columns]  # Drake: w first.

    expected = at_each(robot, q_in_limits, J_BT)
    assert np.abs(WIDOWX.jacobian(q_in_limits) - expected).max() < 1e-9


@pytest.mark.parametrize("payload", [0.0, 0.25])
def test_holding_torque_is_that_of_the_plant(payload, q_in_limits):
    robot = add_robot(payload)
    assert robot[0].gravity_field().gravity_vector()[2] == -9.81

    def torque(plant, context, columns):
        return -plant.CalcGravityGeneralizedForces(context)[columns]

    expected = at_each(robot, q_in_limits, torque)
    torques = WIDOWX.holding_torque(q_in_limits, payload)
    assert np.abs(torques - expected).max() < 1e-9


def test_limits_masses_and_centres_of_mass_are_those_of_the_plant(robot):
    plant = robot[0]
    context = plant.CreateDefaultContext()  # The arm at q = 0.
    base = plant.GetFrameByName("arm_base")
    for i, name in enumerate(ARM_JOINTS):
        joint = plant.GetJointByName(name)
        limits = WIDOWX_250.lower[i], WIDOWX_250.upper[i]
        expected = (
            joint.position_lower_limits()[0],
            joint.position_upper_limits()[0],
        )
        # The maker's half turns: the URDF's are 1e-5 short of them.
        slack = 2e-5 if name in ("waist", "forearm_roll", "wrist_rotate") else 0
        np.testing.assert_allclose(limits, expected, rtol=0, atol=slack)
        actuator = plant.GetJointActuatorByName(name)
        assert WIDOWX_250.torque_limit[i] == actuator.effort_limit()
        link = joint.child_body()
        assert WIDOWX_250.mass[i] == link.default_mass()
        X_BL = plant.CalcRelativeTransform(context, base, link.body_frame())
        p_BC = X_BL @ link.default_com()
        np.testing.assert_allclose(WIDOWX_250.com[i], p_BC, atol=1e-12)


def test_half_turn_joints_turn_by_half_a_turn():
    for i in (0, 3, 5):
        assert WIDOWX_250.lower[i] == -PI
        assert WIDOWX_250.upper[i] == PI


def test_stretched_arm_reaches_as_far_as_reach_says():
    # Upper arm, forearm, hand in one line, from the shoulder of the URDF.
    np.testing.assert_allclose(WIDOWX.shoulder, [0, 0, 0.072 + 0.03865])
    length = math.hypot(0.04975, 0.25) + 0.25 + 0.158575
    assert WIDOWX.reach == pytest.approx(length, abs=1e-12)
    tip = pose(WIDOWX_250, [[0.4, 0.2, STRAIGHT, 0.3, 0, 0]])[0, :3, 3]
    assert np.linalg.norm(tip - WIDOWX.shoulder) == pytest.approx(length)


# Any arm, against products of matrices


@all_arms
def test_pose_is_the_product_of_the_dh_matrices(parameters):
    q = random_q(parameters, 500)
    X_BT = ArmKinematics(parameters).forward(q)
    np.testing.assert_allclose(X_BT, pose(parameters, q), atol=1e-12)


@all_arms
def test_tip_is_never_farther_than_reach(parameters):
    kinematics = ArmKinematics(parameters)
    tips = pose(parameters, random_q(parameters, 5000))[:, :3, 3]
    distance = np.linalg.norm(tips - kinematics.shoulder, axis=1).max()
    assert 0.8 * kinematics.reach < distance < kinematics.reach


@all_arms
def test_jacobian_is_the_rate_of_the_pose(parameters):
    q = random_q(parameters, 100)
    J = ArmKinematics(parameters).jacobian(q)
    step = 1e-6
    for i in range(6):
        after = pose(parameters, q + step * np.eye(6)[i])
        before = pose(parameters, q - step * np.eye(6)[i])
        velocity = (after - before)[:, :3, 3] / (2 * step)
        np.testing.assert_allclose(J[:, :3, i], velocity, atol=1e-8)
        turn = after[:, :3, :3] @ before[:, :3, :3].transpose(0, 2, 1)
        turn = (turn - turn.transpose(0, 2, 1)) / 2
        rate = np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=1)
        np.testing.assert_allclose(J[:, 3:, i], rate / (2 * step), atol=1e-8)


@all_arms
@pytest.mark.parametrize("payload", [0.0, 2.5])
def test_holding_torque_is_the_slope_of_the_potential_energy(
    parameters, payload
):
    at_zero = frames(parameters, np.zeros((1, 6)))[1:, 0]
    p_BC = np.column_stack([parameters.com, np.ones(6)])
    p_LC = np.linalg.solve(at_zero, p_BC[:, :, None])[:, None]

    def energy(q):
        X = frames(parameters, q)
        heights = (X[1:] @ p_LC)[:, :, 2, 0]
        return 9.81 * (parameters.mass @ heights + payload * X[6, :, 2, 3])

    q = random_q(parameters, 50)
    step = 1e-5
    slope = [
        (energy(q + step * e) - energy(q - step * e)) / (2 * step)
        for e in np.eye(6)
    ]
    torque = ArmKinematics(parameters).holding_torque(q, payload)
    np.testing.assert_allclose(torque, np.transpose(slope), atol=1e-6)


@all_arms
def test_determinants_are_those_of_the_jacobians_blocks(parameters):
    q = random_q(parameters, 500)
    kinematics = ArmKinematics(parameters)
    determinants = kinematics.singularity_determinants(q)
    at_wrist = jacobian_at(parameters, q, 5)
    # (4.8): the wrist's joints do not move its centre.
    assert np.abs(at_wrist[:, :3, 3:]).max() < 1e-12
    arm, wrist = at_wrist[:, :3, :3], at_wrist[:, 3:, 3:]
    np.testing.assert_allclose(
        determinants[:, 0], np.linalg.det(arm), atol=1e-12
    )
    np.testing.assert_allclose(
        determinants[:, 1], np.linalg.det(wrist), atol=1e-12
    )
    at_tip = jacobian_at(parameters, q, 6)
    np.testing.assert_allclose(
        determinants.prod(axis=1), np.linalg.det(at_tip), atol=1e-12
    )


@all_arms
@pytest.mark.parametrize("payload", [0.0, 2.5])
def test_derivatives_are_the_central_differences(parameters, payload):
    arm = ArmKinematics(parameters)
    q = random_q(parameters, 50)
    torque, stiffness = arm.holding_torque_and_derivative(q, payload)
    np.testing.assert_allclose(
        torque, arm.holding_torque(q, payload), atol=1e-12
    )
    slopes = arm.singularity_determinants_derivative(q)
    step = 1e-5
    for i, e in enumerate(step * np.eye(6)):
        after = arm.holding_torque(q + e, payload)
        before = arm.holding_torque(q - e, payload)
        np.testing.assert_allclose(
            stiffness[:, :, i], (after - before) / (2 * step), atol=1e-6
        )
        after = arm.singularity_determinants(q + e)
        before = arm.singularity_determinants(q - e)
        np.testing.assert_allclose(
            slopes[:, :, i], (after - before) / (2 * step), atol=1e-9
        )


def test_drawn_joints_are_where_the_urdf_has_them():
    drawn = WIDOWX.joint_positions(np.zeros(6))
    forward = np.cumsum([0, 0, 0.04975, 0.25, WIDOWX.hand])
    up = [0, 0.11065, 0.36065, 0.36065, 0.36065]
    expected = np.column_stack([forward, np.zeros(5), up])
    np.testing.assert_allclose(drawn, expected, atol=1e-12)
    assert WIDOWX.hand == pytest.approx(0.065 + 0.093575)
