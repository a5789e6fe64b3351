"""Against Drake, products of 4x4 matrices, and the formulas as printed."""

import itertools
import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    JacobianWrtVariable,
    SpatialInertia,
    UnitInertia,
    default_model_instance,
)

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.robot import (
    APPENDIX_C,
    WIDOWX_250,
    ArmKinematics,
    ArmParameters,
)
from drake_mobarm.robot.batches import CHUNK
from drake_mobarm.signals import ARM_JOINTS
from drake_mobarm.world.sdf import MODELS

# Nothing here may warn, out of reach and singular poses included.
pytestmark = pytest.mark.filterwarnings("error")

PI = math.pi
TURN = 2 * PI
WIDOWX = ArmKinematics()
# Elbow angle of the straight arm: the dog-leg of 0.04975 m and 0.25 m.
STRAIGHT = -math.atan2(0.25, 0.04975)

FREE = {
    "lower": [-PI] * 6,
    "upper": [PI] * 6,
    "torque_limit": [100.0] * 6,
    "mass": [9.0, 17.4, 4.8, 0.82, 0.34, 0.09],
    "com": np.linspace(-0.3, 0.4, 18).reshape(6, 3),
}
# Public figures: a lateral offset, and a forearm that is off its axis.
PUMA_560 = ArmParameters(
    dh=[
        [0.0, 0.6718, 0.0, PI / 2],
        [0.0, 0.0, 0.4318, 0.0],
        [0.0, 0.15005, 0.0203, -PI / 2],
        [0.0, 0.4318, 0.0, PI / 2],
        [0.0, 0.0, 0.0, -PI / 2],
        [0.0, 0.05625, 0.0, 0.0],
    ],
    **FREE,
)
# As arms in factories are: the shoulder's axis does not meet the waist's.
INDUSTRIAL = ArmParameters(
    dh=[
        [0.3, 0.45, 0.15, -PI / 2],
        [-PI / 2, 0.0, 0.6, 0.0],
        [0.0, 0.0, 0.12, -PI / 2],
        [0.0, 0.64, 0.0, PI / 2],
        [0.0, 0.0, 0.0, -PI / 2],
        [-0.7, 0.1, 0.0, 0.0],
    ],
    **FREE,
)
ARMS = {
    "widowx": WIDOWX_250,
    "appendix_c": APPENDIX_C,
    "puma": PUMA_560,
    "industrial": INDUSTRIAL,
}
# Every way in which the axes of such an arm may turn, other figures in each.
TURNS = list(itertools.product([-1, 1], [-1, 0, 1], [-1, 1], [-1, 1]))


def turned(index):
    first, third, fourth, fifth = TURNS[index]
    rng = np.random.default_rng(index)
    dh = np.zeros((6, 4))
    dh[:, 0] = rng.uniform(-3, 3, 6)
    dh[:, 1] = rng.uniform(-0.1, 0.2, 6)
    dh[3, 1] = 0.4
    dh[4, 1] = 0
    dh[:3, 2] = rng.uniform([-0.1, 0.3, 0.1], [0.1, 0.5, 0.2])
    dh[:, 3] = np.array([first, 0, third, fourth, fifth, 0]) * PI / 2
    return ArmParameters(dh=dh, **FREE)


arms = pytest.mark.parametrize(
    "parameters", ARMS.values(), ids=list(ARMS), scope="module"
)
all_arms = pytest.mark.parametrize(
    "parameters",
    [*ARMS.values(), *map(turned, range(len(TURNS)))],
    ids=[*ARMS, *(f"turns{''.join(f'{x:+d}' for x in t)}" for t in TURNS)],
)

# Oracles, (n, 6) in


def frames(parameters, q):
    """DH frames 0 to 6, (7, n, 4, 4), each by one product of matrices."""
    q = np.asarray(q, dtype=float)
    chain = [np.broadcast_to(np.eye(4), (len(q), 4, 4))]
    for (offset, d, a, alpha), angle in zip(parameters.dh, q.T, strict=True):
        c, s = np.cos(angle + offset), np.sin(angle + offset)
        ca, sa = np.cos(alpha), np.sin(alpha)
        zero, one = np.zeros_like(c), np.ones_like(c)
        A = [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [zero, sa * one, ca * one, d * one],
            [zero, zero, zero, one],
        ]
        chain.append(chain[-1] @ np.moveaxis(np.array(A), 2, 0))
    return np.array(chain)


# Axes of the tool's frame in frame 6: x = z6, y = -y6, z = x6.
X_6T = np.array([[0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])


def pose(parameters, q):
    return frames(parameters, q)[6] @ X_6T


def jacobian_at(parameters, q, frame):
    """Of the origin of a DH frame, axis by axis."""
    X = frames(parameters, q)
    axes = X[:6, :, :3, 2]
    levers = X[frame, None, :, :3, 3] - X[:6, :, :3, 3]
    return np.concatenate([np.cross(axes, levers), axes], axis=2).transpose(
        1, 2, 0
    )


def regular(parameters, q):
    """Where arm and wrist are away from their singularities."""
    J = jacobian_at(parameters, q, 5)
    arm, wrist = J[:, :3, :3], J[:, 3:, 3:]
    return (np.abs(np.linalg.det(arm)) > 2e-4) & (
        np.abs(np.linalg.det(wrist)) > 1e-3
    )


def apart(q, other):
    """Largest difference of any joint, modulo a turn."""
    return np.abs((q - other + PI) % TURN - PI).max(axis=-1)


def check_poses(parameters, solutions, X_BT, tolerance=1e-8):
    """Whole rows of NaN or right poses. Returns how many for each pose."""
    nan = np.isnan(solutions)
    there = ~nan.any(axis=-1)
    np.testing.assert_array_equal(there, ~nan.all(axis=-1))
    index = np.nonzero(there)[0]
    reached = pose(parameters, solutions[there])
    assert np.abs(reached - X_BT[index]).max(initial=0.0) < tolerance
    return there.sum(axis=1)


def random_q(parameters, n, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(parameters.lower, parameters.upper, (n, 6))


def small(rng, n, least=-16.0, most=-1.0):
    """Log-uniform, of either sign; a tenth of it zero."""
    size = 10 ** rng.uniform(least, most, n) * rng.choice([-1, 1], n)
    return np.where(rng.random(n) < 0.1, 0.0, size)


# Against the plant


def add_robot(payload):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(MODELS / "mobile_arm.urdf"))
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


# Inverse: away from singularities


@pytest.mark.parametrize(("limits", "n"), [(True, 30_000), (False, 100_000)])
def test_all_solutions_reach_the_pose_and_one_is_the_arms_own(limits, n):
    q = random_q(WIDOWX_250, n, seed=2)
    X_BT = pose(WIDOWX_250, q)
    solutions = WIDOWX.inverse(X_BT, limits=limits)
    count = check_poses(WIDOWX_250, solutions, X_BT)
    away = regular(WIDOWX_250, q)
    assert away.mean() > 0.95
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    assert nearest[away].max() < 1e-6
    if limits:
        within = (solutions >= WIDOWX_250.lower) & (
            solutions <= WIDOWX_250.upper
        )
        assert (within | np.isnan(solutions)).all()
    else:
        assert (count[away] == 8).all()


@all_arms
def test_any_arms_solutions_reach_the_pose_and_one_is_its_own(parameters):
    q = random_q(parameters, 3000)
    X_BT = pose(parameters, q)
    solutions = ArmKinematics(parameters).inverse(X_BT, limits=False)
    count = check_poses(parameters, solutions, X_BT)
    away = regular(parameters, q)
    assert away.mean() > 0.9
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    assert nearest[away].max() < 1e-6
    # The side away from the wrist's centre may be too far for a shoulder
    # that is off the waist's axis.
    assert set(count[away]) <= ({4, 8} if parameters.dh[0, 2] else {8})


@arms
def test_solutions_differ(parameters):
    q = random_q(parameters, 5000)
    q = q[regular(parameters, q)]
    solutions = ArmKinematics(parameters).inverse(
        pose(parameters, q), limits=False
    )
    for i, j in itertools.combinations(range(8), 2):
        difference = apart(solutions[:, i], solutions[:, j])
        assert np.nanmin(difference) > 1e-4


def test_limits_leave_out_what_is_beyond_them_and_nothing_else():
    X_BT = pose(WIDOWX_250, random_q(WIDOWX_250, 20_000))
    every = WIDOWX.inverse(X_BT, limits=False)
    within = ((every > WIDOWX_250.lower) & (every < WIDOWX_250.upper)).all(-1)
    assert 0.3 < within.mean() < 0.7
    expected = np.where(within[..., None], every, np.nan)
    np.testing.assert_allclose(WIDOWX.inverse(X_BT), expected, atol=1e-15)


def test_order_is_waist_then_elbow_then_wrist():
    q = random_q(WIDOWX_250, 2000)
    q = q[regular(WIDOWX_250, q)]
    X_BT = pose(WIDOWX_250, q)
    s = WIDOWX.inverse(X_BT, limits=False).reshape(-1, 2, 2, 2, 6)
    p_BW = X_BT[:, :3, 3] - 0.158575 * X_BT[:, :3, 0]
    side = np.cos(s[..., 0]) * p_BW[:, 0].reshape(-1, 1, 1, 1)
    side += np.sin(s[..., 0]) * p_BW[:, 1].reshape(-1, 1, 1, 1)
    assert (side[:, 0] > 0).all()
    assert (side[:, 1] < 0).all()
    bend = np.sin(s[..., 2] - STRAIGHT)
    assert (bend[:, :, 0] > 0).all()
    assert (bend[:, :, 1] < 0).all()
    np.testing.assert_array_equal(s[..., 0, :3], s[..., 1, :3])
    first, second = s[..., 0, 3:], s[..., 1, 3:]
    assert apart(first * [1, -1, 1] + [PI, 0, PI], second).max() < 1e-9
    assert np.abs(np.sin(first[..., 1])).min() > 5e-4


def test_turn_is_the_one_nearest_to_the_middle_of_the_range():
    shifted = replace(
        WIDOWX_250,
        lower=[0, -9.0, -9.0, -2 * TURN, -9.0, 1.0],
        upper=[TURN, 8.0, 8.0, 2 * TURN, 9.0, 1.0 + TURN],
    )
    middle = np.array([PI, -0.5, -0.5, 0, 0, 1 + PI])
    X_BT = pose(WIDOWX_250, random_q(WIDOWX_250, 2000))
    arm = ArmKinematics(shifted)
    for limits in (False, True):
        solutions = arm.inverse(X_BT, limits=limits)
        assert not np.isnan(solutions).any()
        assert np.abs(solutions - middle).max() <= PI + 1e-12
        check_poses(shifted, solutions, X_BT)


ANGLES = st.tuples(*[st.floats(-PI, PI)] * 6)


@settings(max_examples=100)
@given(ANGLES)
@pytest.mark.parametrize("parameters", [WIDOWX_250, APPENDIX_C])
def test_there_and_back_from_any_joint_angles(parameters, q):
    X_BT = pose(parameters, [q])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        solutions = ArmKinematics(parameters).inverse(X_BT, limits=False)
    assert check_poses(parameters, solutions, X_BT) == 8
    if regular(parameters, [q])[0]:
        assert apart(solutions[0], np.array(q)).min() < 1e-6


@pytest.mark.parametrize(
    "values",
    [
        *([[lo, up, 0.0]] for lo, up in ((-PI, PI),)),
        [[-PI / 2, 0.0, PI / 2]],
        [[-PI, -PI / 2, PI]],
    ],
    ids=["half turns", "quarters", "more quarters"],
)
def test_square_angles_are_solved(values):
    q = np.array(list(itertools.product(values[0], repeat=6)))
    X_BT = pose(WIDOWX_250, q)
    solutions = WIDOWX.inverse(X_BT, limits=False)
    assert (check_poses(WIDOWX_250, solutions, X_BT) == 8).all()
    away = regular(WIDOWX_250, q)
    assert apart(solutions, q[:, None]).min(axis=1)[away].max(initial=0) < 1e-6


def test_joints_at_their_limits_are_solved_within_them():
    rng = np.random.default_rng(3)
    corners = list(
        itertools.product(*zip(WIDOWX_250.lower, WIDOWX_250.upper, strict=True))
    )
    edges = np.where(
        rng.random((5000, 6)) < 0.5,
        np.array(corners)[rng.integers(64, size=5000)],
        random_q(WIDOWX_250, 5000),
    )
    q = np.concatenate([corners, edges])
    X_BT = pose(WIDOWX_250, q)
    solutions = WIDOWX.inverse(X_BT)
    assert (check_poses(WIDOWX_250, solutions, X_BT) > 0).all()
    away = regular(WIDOWX_250, q)
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    assert nearest[away].max() < 1e-6
    there = solutions[~np.isnan(solutions).any(axis=-1)]
    assert (there >= WIDOWX_250.lower).all()
    assert (there <= WIDOWX_250.upper).all()


def test_limits_that_rounding_would_pass_are_kept():
    # (lower + upper) / 2 + (upper - lower) / 2 is often not upper.
    rng = np.random.default_rng(4)
    for _ in range(100):
        lower, upper = rng.uniform(-3, -1, 6), rng.uniform(1, 3, 6)
        parameters = replace(WIDOWX_250, lower=lower, upper=upper)
        q = np.array([lower, upper])
        solutions = ArmKinematics(parameters).inverse(pose(parameters, q))
        there = solutions[~np.isnan(solutions).any(axis=-1)]
        assert len(there) >= 2
        assert (there >= lower).all()
        assert (there <= upper).all()


# Inverse: at and near singularities


def waist_singular(q, radius, sign):
    """Sets the shoulder so that the wrist's centre is at a radius.

    With the links of the URDF in the plane: the dog-leg turned by the
    shoulder, the forearm by shoulder and elbow.
    """
    forward = 0.04975 + 0.25 * np.cos(q[:, 2])
    up = 0.25 - 0.25 * np.sin(q[:, 2])
    lean = np.arccos(np.clip(radius / np.hypot(forward, up), -1, 1))
    q[:, 1] = np.arctan2(up, forward) + sign * lean


def singular_q(kind, n=10_000, parameters=WIDOWX_250):
    rng = np.random.default_rng(5)
    q = rng.uniform(parameters.lower, parameters.upper, (n, 6))
    straight = STRAIGHT if parameters is WIDOWX_250 else 0.0
    if kind == "threshold":
        q[:, 4] = small(rng, n, -13, -9)
    if kind in ("wrist", "wrist and elbow", "all"):
        q[:, 4] = small(rng, n)
    if kind in ("elbow", "wrist and elbow", "all"):
        q[:, 2] = straight + small(rng, n)
    if kind == "folded":
        q[:, 2] = straight + PI + small(rng, n)
    if kind in ("waist", "waist and wrist", "all"):
        waist_singular(q, small(rng, n), rng.choice([-1, 1], n))
    if kind == "waist and wrist":
        q[:, 4] = small(rng, n)
    if kind == "upright":
        q[:, 2], q[:, 4] = straight, 0.0  # All at once, the tool straight up.
        waist_singular(q, np.zeros(n), -1)
    return q


KINDS = [
    *("wrist", "threshold", "elbow", "folded", "waist", "upright"),
    *("wrist and elbow", "waist and wrist", "all"),
]


@pytest.mark.parametrize("kind", KINDS)
def test_near_a_singularity_every_solution_reaches_the_pose(kind):
    q = singular_q(kind)
    X_BT = pose(WIDOWX_250, q)
    every = WIDOWX.inverse(X_BT, limits=False)
    assert (check_poses(WIDOWX_250, every, X_BT) == 8).all()
    assert not regular(WIDOWX_250, q).all()
    check_poses(WIDOWX_250, WIDOWX.inverse(X_BT), X_BT)


@pytest.mark.parametrize(
    "kind", ["wrist", "threshold", "elbow", "wrist and elbow"]
)
def test_singular_wrist_or_elbow_leaves_a_solution_within_limits(kind):
    q = singular_q(kind)
    X_BT = pose(WIDOWX_250, q)
    assert (check_poses(WIDOWX_250, WIDOWX.inverse(X_BT), X_BT) > 0).all()


@pytest.mark.parametrize("kind", ["wrist", "elbow", "wrist and elbow"])
def test_arm_of_appendix_c_is_solved_where_it_is_singular(kind):
    q = singular_q(kind, parameters=APPENDIX_C)
    X_BT = pose(APPENDIX_C, q)
    solutions = ArmKinematics(APPENDIX_C).inverse(X_BT)
    assert (check_poses(APPENDIX_C, solutions, X_BT) == 8).all()


def test_free_joints_stay_where_the_docstring_says():
    q = singular_q("wrist")
    q = q[q[:, 4] == 0]
    assert len(q) > 500
    # The wrist is straight in one of its two solutions with the own elbow.
    solutions = WIDOWX.inverse(pose(WIDOWX_250, q), limits=False)
    own = apart(solutions[..., :3], q[:, None, :3]) < 1e-6
    assert (own.sum(axis=1) >= 2).all()
    rolls = np.sort(np.abs(solutions[..., 3][own]).reshape(-1, 2), axis=1)
    np.testing.assert_allclose(rolls, np.tile([0, PI], (len(q), 1)), atol=1e-12)


def test_determinants_vanish_where_the_arm_is_singular():
    for kind, column in (("wrist", 1), ("elbow", 0), ("waist", 0)):
        q = singular_q(kind)
        exact = {
            "wrist": q[:, 4] == 0,
            "elbow": q[:, 2] == STRAIGHT,
            "waist": np.hypot(*(frames(WIDOWX_250, q)[5, :, :2, 3]).T) < 1e-15,
        }[kind]
        assert exact.sum() > 500
        determinants = WIDOWX.singularity_determinants(q)
        assert np.abs(determinants[exact, column]).max() < 1e-15
        other = WIDOWX.singularity_determinants(random_q(WIDOWX_250, 100))
        assert np.median(np.abs(other[:, column])) > 1e-3


def test_folded_arm_with_equal_links_is_solved():
    # Then the wrist's centre may lie at the shoulder itself.
    dh = np.array(APPENDIX_C.dh)
    dh[1, 2] = dh[2, 2] = 1.0
    parameters = replace(APPENDIX_C, dh=dh)
    rng = np.random.default_rng(6)
    q = random_q(parameters, 10_000)
    q[:, 2] = PI + small(rng, len(q), -12, -3)
    X_BT = pose(parameters, q)
    solutions = ArmKinematics(parameters).inverse(X_BT, limits=False)
    assert (check_poses(parameters, solutions, X_BT, 1e-10) == 8).all()


@pytest.mark.parametrize("side", [1e-9, 1e-5, 0.15])
def test_wrist_cannot_come_nearer_to_the_waist_than_its_offset(side):
    dh = np.array(PUMA_560.dh)
    dh[2, 1] = side
    parameters = replace(PUMA_560, dh=dh)
    kinematics = ArmKinematics(parameters)
    rng = np.random.default_rng(7)
    # Directions and heights are of no matter: the tool points anywhere.
    X_BT = pose(parameters, random_q(parameters, 2000))
    heading = rng.uniform(-PI, PI, 2000)
    for ratio, reached in ((1 + 1e-6, True), (1 - 1e-14, True), (0.1, None)):
        p_BW = np.column_stack(
            [
                ratio * side * np.cos(heading),
                ratio * side * np.sin(heading),
                rng.uniform(0.5, 0.8, 2000),
            ]
        )
        X_BT[:, :3, 3] = p_BW + 0.05625 * X_BT[:, :3, 0]
        count = check_poses(
            parameters, kinematics.inverse(X_BT, limits=False), X_BT
        )
        if reached:
            assert (count == 8).mean() > 0.9
        elif side > 1e-8:
            assert (count == 0).all()


# Poses as callers have them


def test_poses_of_single_precision_are_solved():
    q = random_q(WIDOWX_250, 5000)
    rough = pose(WIDOWX_250, q).astype(np.float32)
    solutions = WIDOWX.inverse(rough, limits=False)
    exact = np.array(rough, dtype=float)
    assert (check_poses(WIDOWX_250, solutions, exact, 1e-6) > 0).mean() > 0.99
    U, _, Vt = np.linalg.svd(exact[:, :3, :3])
    exact[:, :3, :3] = U @ Vt
    solutions = WIDOWX.inverse(exact, limits=False)
    count = check_poses(WIDOWX_250, solutions, exact)
    assert (count[regular(WIDOWX_250, q)] == 8).all()


def test_tools_along_the_axes_are_solved_wherever_they_are():
    rotations = []
    for axes in itertools.permutations(np.eye(3)):
        for signs in itertools.product([-1, 1], repeat=3):
            R = np.array(axes) * np.reshape(signs, (3, 1))
            if np.linalg.det(R) > 0:
                rotations.append(R)
    assert len(rotations) == 24
    steps = np.arange(-4, 5) / 8
    positions = np.array(list(itertools.product(steps, steps, steps)))
    X_BT = np.zeros((24, len(positions), 4, 4))
    X_BT[..., :3, :3] = np.array(rotations)[:, None]
    X_BT[..., :3, 3] = positions
    X_BT[..., 3, 3] = 1
    X_BT = X_BT.reshape(-1, 4, 4)
    count = check_poses(WIDOWX_250, WIDOWX.inverse(X_BT, limits=False), X_BT)
    # 0.5049 m: upper arm and forearm. 0.0049 m: one folded on the other.
    p_SW = X_BT[:, :3, 3] - 0.158575 * X_BT[:, :3, 0] - [0, 0, 0.11065]
    distance = np.linalg.norm(p_SW, axis=1)
    reached = (distance < 0.504902) & (distance > 0.004903)
    assert 0.1 < reached.mean() < 0.9
    np.testing.assert_array_equal(count, np.where(reached, 8, 0))


@pytest.mark.parametrize(
    "n", [0, 1, 2, *(m * CHUNK + k for m in (1, 2) for k in (-1, 0, 1))]
)
def test_batch_is_its_poses_one_by_one(n):
    q = random_q(WIDOWX_250, n)
    X_BT = pose(WIDOWX_250, q)
    solutions = WIDOWX.inverse(X_BT)
    assert solutions.shape == (n, 8, 6)
    some = {i for i in (0, 1, n // 2, CHUNK - 1, CHUNK, n - 1) if 0 <= i < n}
    for i in some:
        alone = WIDOWX.inverse(X_BT[i])
        assert alone.shape == (8, 6)
        np.testing.assert_allclose(solutions[i], alone, atol=1e-9)
    # Every row is there, and in its place.
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    away = regular(WIDOWX_250, q)
    assert nearest[away].max(initial=0.0) < 1e-6
    np.testing.assert_allclose(WIDOWX.forward(q), X_BT, atol=1e-12)
    np.testing.assert_allclose(
        WIDOWX.jacobian(q), jacobian_at(WIDOWX_250, q, 6), atol=1e-12
    )


def test_results_have_the_shape_of_the_batch():
    q = random_q(WIDOWX_250, 6).reshape(2, 3, 6)
    X_BT = pose(WIDOWX_250, q.reshape(6, 6)).reshape(2, 3, 4, 4)
    for array, shape in (
        (WIDOWX.forward(q), (4, 4)),
        (WIDOWX.jacobian(q), (6, 6)),
        (WIDOWX.holding_torque(q, 0.1), (6,)),
        (WIDOWX.singularity_determinants(q), (2,)),
        (WIDOWX.inverse(X_BT), (8, 6)),
        (WIDOWX.inverse_axis(X_BT[..., :3, 3], X_BT[..., :3, 0]), (8, 6)),
    ):
        assert array.shape == (2, 3, *shape)
    one = q[1, 2]
    for method in (
        WIDOWX.forward,
        WIDOWX.jacobian,
        WIDOWX.holding_torque,
        WIDOWX.singularity_determinants,
    ):
        np.testing.assert_allclose(method(q)[1, 2], method(one), atol=1e-15)
        assert len(method(np.zeros((0, 6)))) == 0
    np.testing.assert_allclose(WIDOWX.forward(q), X_BT, atol=1e-12)
    alone = WIDOWX.inverse(X_BT[1, 2])
    np.testing.assert_allclose(WIDOWX.inverse(X_BT)[1, 2], alone, atol=1e-9)


def test_inputs_are_left_as_they_are():
    X_BT = pose(WIDOWX_250, random_q(WIDOWX_250, 5))
    before = X_BT.copy()
    WIDOWX.inverse(X_BT)
    WIDOWX.inverse_axis(X_BT[:, :3, 3], X_BT[:, :3, 0])
    np.testing.assert_array_equal(X_BT, before)


# A point along an axis


def tip_and_approach(q):
    X_BT = pose(WIDOWX_250, q)
    return X_BT[..., :3, 3], X_BT[..., :3, 0]


@pytest.mark.parametrize("kind", ["regular", *KINDS])
def test_axis_solutions_put_tip_and_approach_where_they_have_to_be(kind):
    q = random_q(WIDOWX_250, 20_000) if kind == "regular" else singular_q(kind)
    p_BT, a_B = tip_and_approach(q)
    solutions = WIDOWX.inverse_axis(p_BT, a_B, limits=False)
    assert not np.isnan(solutions).any()
    assert (solutions[..., 5] == 0).all()
    tips, approaches = tip_and_approach(solutions.reshape(-1, 6))
    assert np.abs(tips - np.repeat(p_BT, 8, axis=0)).max() < 1e-8
    assert np.abs(approaches - np.repeat(a_B, 8, axis=0)).max() < 1e-8


def test_axis_solutions_have_the_arms_own_among_them():
    q = random_q(WIDOWX_250, 20_000)
    solutions = WIDOWX.inverse_axis(*tip_and_approach(q))
    q[:, 5] = 0.0
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    assert nearest[regular(WIDOWX_250, q)].max() < 1e-6
    there = solutions[~np.isnan(solutions).any(axis=-1)]
    assert (there >= WIDOWX_250.lower).all()
    assert (there <= WIDOWX_250.upper).all()


@all_arms
def test_any_arms_axis_solutions_are_right_and_have_its_own(parameters):
    q = random_q(parameters, 1000)
    X_BT = pose(parameters, q)
    solutions = ArmKinematics(parameters).inverse_axis(
        X_BT[:, :3, 3], X_BT[:, :3, 0], limits=False
    )
    there = ~np.isnan(solutions).any(axis=-1)
    reached = pose(parameters, solutions[there])
    target = X_BT[np.nonzero(there)[0]]
    # Tip and approach.
    assert np.abs((reached - target)[:, :3, [0, 3]]).max() < 1e-8
    assert (solutions[there][:, 5] == 0).all()
    q[:, 5] = 0
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    assert nearest[regular(parameters, q)].max() < 1e-6


def test_one_axis_serves_many_points():
    down = [0.0, 0.0, -1.0]
    points = np.array([[0.3, 0.0, 0.1], [0.2, 0.2, 0.05], [5.0, 0.0, 0.0]])
    solutions = WIDOWX.inverse_axis(points, down)
    assert solutions.shape == (3, 8, 6)
    for i in range(2):
        there = solutions[i][~np.isnan(solutions[i]).any(axis=-1)]
        assert len(there) > 0
        tips, approaches = tip_and_approach(there)
        np.testing.assert_allclose(
            tips, np.tile(points[i], (len(there), 1)), atol=1e-8
        )
        np.testing.assert_allclose(
            approaches, np.tile(down, (len(there), 1)), atol=1e-8
        )
    assert np.isnan(solutions[2]).all()
    assert WIDOWX.inverse_axis(np.zeros((0, 3)), down).shape == (0, 8, 6)


# Appendix C as printed


def atan2(x, y):
    """With the order of arguments that Appendix C has."""
    return math.atan2(y, x)


def appendix_c(X_BT):
    """The printed formulas; corrected are misprints and a sign."""
    d_1, d_2, d_6 = 0.11065, 0.0, 0.158575
    a_2, a_3 = math.hypot(0.04975, 0.25), 0.25
    R = X_BT[:3, :3] @ X_6T[:3, :3].T
    (r_11, r_12, r_13), (r_21, r_22, r_23), (_, _, r_33) = R
    x_w, y_w, z_w = X_BT[:3, 3] - d_6 * R[:, 2]
    D = (x_w**2 + y_w**2 - d_2**2 + (z_w - d_1) ** 2 - a_2**2 - a_3**2) / (
        2 * a_2 * a_3
    )
    solutions = []
    for q_1, toward in (
        (atan2(x_w, y_w), 1),
        # The radial distance of the second is negative: printed it is not.
        (PI + atan2(x_w, y_w), -1),
    ):
        radial = toward * math.sqrt(x_w**2 + y_w**2 - d_2**2)
        for bend in (1, -1):
            q_3 = atan2(D, bend * math.sqrt(1 - D**2))
            q_2 = atan2(radial, z_w - d_1) - atan2(
                a_2 + a_3 * math.cos(q_3), a_3 * math.sin(q_3)
            )
            c_1, s_1 = math.cos(q_1), math.sin(q_1)
            c_23, s_23 = math.cos(q_2 + q_3), math.sin(q_2 + q_3)
            along = c_1 * c_23 * r_13 + s_1 * c_23 * r_23 + s_23 * r_33
            across = -c_1 * s_23 * r_13 - s_1 * s_23 * r_23 + c_23 * r_33
            cosine = s_1 * r_13 - c_1 * r_23
            sine = math.sqrt(1 - cosine**2)
            solutions.append(
                [
                    *(q_1, q_2, q_3, atan2(along, across)),
                    atan2(cosine, sine),
                    atan2(-s_1 * r_11 + c_1 * r_21, s_1 * r_12 - c_1 * r_22),
                ]
            )
            solutions.append(
                [
                    *(q_1, q_2, q_3, atan2(-along, -across)),
                    atan2(cosine, -sine),
                    atan2(s_1 * r_11 - c_1 * r_21, -s_1 * r_12 + c_1 * r_22),
                ]
            )
    return np.array(solutions)


def test_solutions_are_those_that_appendix_c_prints():
    q = random_q(APPENDIX_C, 1100)
    q = q[regular(APPENDIX_C, q)][:1000]
    assert len(q) == 1000
    X_BT = pose(APPENDIX_C, q)
    solutions = ArmKinematics(APPENDIX_C).inverse(X_BT)
    for ours, target in zip(solutions, X_BT, strict=True):
        distance = apart(ours[:, None], appendix_c(target)[None])
        # One of the printed for each of ours, and the other way round.
        assert distance.min(axis=0).max() < 1e-8
        assert distance.min(axis=1).max() < 1e-8


def test_arm_of_appendix_c_is_stretched_forward_and_points_right():
    length = math.hypot(0.04975, 0.25) + 0.25
    X_BT = ArmKinematics(APPENDIX_C).forward(np.zeros(6))
    np.testing.assert_allclose(
        X_BT[:3, 3], [length, -0.158575, 0.11065], atol=1e-12
    )
    np.testing.assert_allclose(X_BT[:3, 0], [0, -1, 0], atol=1e-12)


# Bad input


@pytest.mark.parametrize(
    "p_BT",
    [
        [0.7, 0, 0.11],
        [0, 0, 0.8],
        [10, 10, 10],
        [1e10, 0, 0],
        [0, -1e160, 0],
        [1e308, -1e308, 1e308],
    ],
)
def test_pose_out_of_reach_has_no_solution(p_BT):
    X_BT = np.eye(4)
    X_BT[:3, 3] = p_BT
    for limits in (True, False):
        assert np.isnan(WIDOWX.inverse(X_BT, limits=limits)).all()
        solutions = WIDOWX.inverse_axis(p_BT, [1, 0, 0], limits=limits)
        assert solutions.shape == (8, 6)
        assert np.isnan(solutions).all()


def test_batch_may_mix_poses_within_and_out_of_reach():
    q = np.array([[0.3, 0.4, 0.5, 0.6, 0.7, 0.8]])
    near, far = pose(WIDOWX_250, q)[0], np.eye(4)
    far[0, 3] = 1e200
    solutions = WIDOWX.inverse([far, near, far])
    assert np.isnan(solutions[[0, 2]]).all()
    assert np.nanmin(apart(solutions[1], q)) < 1e-9


def test_joints_that_are_nan_give_nan():
    q = np.zeros((2, 6))
    q[1] = np.nan
    for method in (WIDOWX.jacobian, WIDOWX.holding_torque):
        result = method(q)
        assert np.isfinite(result[0]).all()
        assert np.isnan(result[1]).any()
    X_BT = WIDOWX.forward(q)
    assert np.isfinite(X_BT[0]).all()
    assert np.isnan(X_BT[1, :3]).all()


def spoilt(**entries):
    X_BT = np.eye(4)
    for where, value in entries.items():
        X_BT[int(where[1]), int(where[2])] = value
    return X_BT


def refused(name, call, *arguments, **keywords):
    with pytest.raises(ParameterError, match=rf"^{name}\b") as caught:
        call(*arguments, **keywords)
    assert "\n" not in str(caught.value)
    assert "valid is" in str(caught.value)


@pytest.mark.parametrize(
    "X_BT",
    [
        np.eye(3),
        np.zeros((2, 3, 4)),
        np.zeros(0),
        5.0,
        None,
        "X",
        [["x"] * 4] * 4,
        [[1, 2], [3]],
        np.zeros((4, 4)),
        2 * np.eye(4),
        np.diag([1.1, 1.1, 1.1, 1]),
        np.diag([2, 0.5, 1, 1]),
        np.diag([1, 1, -1, 1]),
        np.diag([-1, -1, -1, 1]),
        np.diag([1, 1, 1 + 1e-5, 1]),
        np.diag([1, 1, 1, 0.5]),
        # A left-over of x and y that are not square, and their product.
        spoilt(_01=0.6, _11=0.8, _22=0.8),
        spoilt(_01=0.3),
        spoilt(_12=1e-5),
        spoilt(_00=np.nan),
        spoilt(_00=np.inf),
        spoilt(_11=1e200),
        spoilt(_03=np.nan),
        spoilt(_23=np.inf),
        spoilt(_31=np.nan),
        spoilt(_30=0.1),
        [np.eye(4), spoilt(_22=np.nan)],
    ],
)
def test_what_is_not_a_pose_is_refused(X_BT):
    refused("X_BT", WIDOWX.inverse, X_BT)


def test_first_pose_that_is_wrong_is_named():
    batch = np.tile(np.eye(4), (2, 3, 1, 1))
    batch[1, 1, 0, 0] = np.nan
    refused(r"X_BT\[4\] is \[\[nan, 0.0", WIDOWX.inverse, batch)


@pytest.mark.parametrize(
    ("p_BT", "a_B", "name"),
    [
        ([0, 0, 0.3], [0, 0, 0], "a_B"),
        ([0, 0, 0.3], [0, 0, 1.1], "a_B"),
        ([0, 0, 0.3], [1, 1, 0], "a_B"),
        ([0, 0, 0.3], [np.nan, 0, 1], "a_B"),
        ([0, 0, 0.3], [np.inf, 0, 0], "a_B"),
        ([0, 0, 0.3], [1e200, 0, 0], "a_B"),
        ([0, 0, 0.3], [1, 0], "a_B"),
        ([0, 0, 0.3], "up", "a_B"),
        ([np.nan, 0, 0.3], [1, 0, 0], "p_BT"),
        ([np.inf, 0, 0.3], [1, 0, 0], "p_BT"),
        ([0, 0.3], [1, 0, 0], "p_BT"),
        (0.3, [1, 0, 0], "p_BT"),
        ("here", [1, 0, 0], "p_BT"),
        ([[0, 0], [0]], [1, 0, 0], "p_BT"),
        (np.zeros((2, 3)), np.zeros((4, 3)), "p_BT"),
    ],
)
def test_what_is_not_a_point_and_an_axis_is_refused(p_BT, a_B, name):
    refused(name, WIDOWX.inverse_axis, p_BT, a_B)


@pytest.mark.parametrize(
    "q", [0.0, [0.0] * 5, np.zeros((6, 2)), "joints", ["a"] * 6, None]
)
def test_what_is_not_six_joints_is_refused(q):
    for method in (
        WIDOWX.forward,
        WIDOWX.jacobian,
        WIDOWX.holding_torque,
        WIDOWX.singularity_determinants,
    ):
        refused("q", method, q)


@pytest.mark.parametrize("payload", [-0.1, np.nan, np.inf])
def test_payload_out_of_range_is_refused(payload):
    refused("payload", WIDOWX.holding_torque, np.zeros(6), payload)


@pytest.mark.parametrize(
    ("row", "column", "value", "name"),
    [
        *((row, 3, 0.3, f"alpha {row + 1}") for row in range(6)),
        (0, 3, 0.0, "alpha 1"),
        (1, 3, PI / 2, "alpha 2"),
        (2, 3, PI, "alpha 3"),
        (3, 3, 0.0, "alpha 4"),
        (4, 3, PI, "alpha 5"),
        (5, 3, PI / 2, "alpha 6"),
        (4, 1, 0.01, "d 5"),
        (3, 2, 0.01, "a 4"),
        (4, 2, 0.01, "a 5"),
        (5, 2, 0.01, "a 6"),
        (1, 2, 0.0, ""),
        (3, 1, 0.0, ""),
    ],
)
def test_arm_that_this_form_does_not_solve_is_refused(row, column, value, name):
    dh = np.array(WIDOWX_250.dh)
    dh[row, column] = value
    parameters = replace(WIDOWX_250, dh=dh)
    refused(f"dh: {name}" if name else "dh", ArmKinematics, parameters)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("dh", np.zeros((6, 3))),
        ("dh", np.zeros((5, 4))),
        ("dh", "table"),
        ("dh", [[1], [2, 3]]),
        ("dh", np.full((6, 4), np.nan)),
        ("lower", [0.0] * 5),
        ("lower", None),
        ("lower", WIDOWX_250.upper),
        ("lower", [*WIDOWX_250.lower[:5], 4.0]),
        ("upper", [np.inf] * 6),
        ("torque_limit", [0.0] * 6),
        ("torque_limit", np.ones((6, 1))),
        ("mass", [-0.1] * 6),
        ("mass", 1.0),
        ("com", np.zeros((3, 6))),
        ("com", [["x"] * 3] * 6),
    ],
)
def test_parameters_out_of_range_are_refused(name, value):
    refused(name, replace, WIDOWX_250, **{name: value})


def test_parameters_cannot_be_changed_afterwards():
    table = np.array(WIDOWX_250.dh)
    parameters = replace(WIDOWX_250, dh=table)
    table[0, 1] = 9.0
    assert parameters.dh[0, 1] == 0.11065
    with pytest.raises(ValueError, match="read-only"):
        parameters.dh[0, 1] = 1.0
