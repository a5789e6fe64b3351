"""The URDF against published figures of the PMB-2 and the WidowX 250."""

import math

import numpy as np
import pytest
from pydrake.multibody.tree import BodyIndex

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot.shape import ANTENNA_POSITION, STOWED

PI = math.pi

# Parent and child, origin, axis, lower, upper, torque.
CHAIN = {
    "waist": (
        *("arm_base", "shoulder", (0, 0, 0.072), "z"),
        *(-3.141583, 3.141583, 4.1),
    ),
    "shoulder": (
        *("shoulder", "upper_arm", (0, 0, 0.03865), "y"),
        *(-1.884956, 1.989675, 8.2),
    ),
    "elbow": (
        *("upper_arm", "upper_forearm", (0.04975, 0, 0.25), "y"),
        *(-2.146755, 1.605703, 8.2),
    ),
    "forearm_roll": (
        *("upper_forearm", "lower_forearm", (0.175, 0, 0), "x"),
        *(-3.141583, 3.141583, 4.1),
    ),
    "wrist_angle": (
        *("lower_forearm", "wrist", (0.075, 0, 0), "y"),
        *(-1.745329, 2.146755, 4.1),
    ),
    "wrist_rotate": (
        *("wrist", "hand", (0.065, 0, 0), "x"),
        *(-3.141583, 3.141583, 1.5),
    ),
}

# Mass, centre of mass, ixx, iyy, izz, ixy, ixz, iyz about it.
INERTIAS = {
    "base": (
        *(28.266, (0, 0, 0.0985)),
        (0.4654, 0.4832, 0.5509, 0, 0, 0),
    ),
    "wheel_left": (1.824, (0, 0, 0), (0.005, 0.00839, 0.005, 0, 0, 0)),
    "wheel_right": (1.824, (0, 0, 0), (0.005, 0.00839, 0.005, 0, 0, 0)),
    "arm_base": (
        *(0.538736, (-0.0380446, 0.0006139, 0.0193354)),
        (6.921e-4, 2.115e-3, 2.524e-3, 1.635e-5, -4.642e-5, 6.998e-7),
    ),
    "shoulder": (
        *(0.480879, (0.0000223, 0.0000415, 0.0066287)),
        (5.557e-4, 3.790e-4, 5.889e-4, -2e-9, -1.2245e-6, -3.56e-7),
    ),
    "upper_arm": (
        *(0.430811, (0.0171605, 0, 0.191323)),
        (3.587e-3, 3.463e-3, 4.566e-4, 0, -4.272e-4, 0),
    ),
    "upper_forearm": (
        *(0.234589, (0.107963, 0.0001159, 0)),
        (3.971e-5, 8.878e-4, 8.880e-4, 2.353e-6, 0, 0),
    ),
    "lower_forearm": (
        *(0.220991, (0.0374395, 0.0052225, 0)),
        (6.369e-5, 1.677e-4, 1.834e-4, 2.292e-5, 0, 0),
    ),
    "wrist": (
        *(0.084957, (0.04236, -0.0000107, 0.010577)),
        (2.822e-5, 3.082e-5, 3.152e-5, -1.9e-8, -2.548e-6, 2e-9),
    ),
    "hand": (
        *(0.143916, (0.042983, 0, 0.006959)),
        (7.633e-5, 1.2690e-4, 1.5608e-4, 9.1e-7, 1.706e-5, 3.2e-7),
    ),
}


# Joints


@pytest.mark.parametrize("name", CHAIN)
def test_arm_joint_sits_and_turns_as_published(robot, name):
    parent, child, origin, axis, *_ = CHAIN[name]
    joint = robot.plant.GetJointByName(name)
    assert joint.parent_body().name() == parent
    assert joint.child_body().name() == child
    X_PJ = joint.frame_on_parent().GetFixedPoseInBodyFrame()
    np.testing.assert_allclose(X_PJ.translation(), origin, atol=1e-12)
    np.testing.assert_allclose(X_PJ.rotation().matrix(), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(
        joint.revolute_axis(), np.eye(3)["xyz".index(axis)]
    )


@pytest.mark.parametrize("name", CHAIN)
def test_arm_joint_has_the_published_limits(robot, name):
    *_, lower, upper, torque = CHAIN[name]
    joint = robot.plant.GetJointByName(name)
    assert joint.position_lower_limits()[0] == lower
    assert joint.position_upper_limits()[0] == upper
    for low, high, limit in (
        (joint.velocity_lower_limits(), joint.velocity_upper_limits(), PI),
        (
            joint.acceleration_lower_limits(),
            joint.acceleration_upper_limits(),
            5.0,
        ),
    ):
        assert high[0] == pytest.approx(limit, abs=1e-5)
        assert low[0] == -high[0]
    actuator = robot.plant.GetJointActuatorByName(name)
    assert actuator.effort_limit() == torque


def test_arms_joints_are_named_in_order_from_the_base():
    assert tuple(CHAIN) == ARM_JOINTS


@pytest.mark.parametrize("name", ARM_JOINTS)
def test_arms_rotors_have_the_assumed_inertia(robot, name):
    actuator = robot.plant.GetJointActuatorByName(name)
    reflected = (
        actuator.default_gear_ratio() ** 2 * actuator.default_rotor_inertia()
    )
    assert reflected == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize(
    ("name", "y"), [("wheel_left", 0.2022), ("wheel_right", -0.2022)]
)
def test_wheel_sits_on_the_axle_and_has_the_published_limits(robot, name, y):
    joint = robot.plant.GetJointByName(name)
    X_BW = joint.frame_on_parent().GetFixedPoseInBodyFrame()
    np.testing.assert_allclose(X_BW.translation(), [0, y, 0.0985])
    np.testing.assert_allclose(joint.revolute_axis(), [0, 1, 0])
    assert joint.velocity_upper_limits()[0] == 10.15
    assert joint.acceleration_upper_limits()[0] == 10.0
    assert robot.plant.GetJointActuatorByName(name).effort_limit() == 6.0


def test_only_wheels_and_arm_are_driven(robot):
    driven = {
        robot.plant.get_joint_actuator(i).name()
        for i in robot.plant.GetJointActuatorIndices()
    }
    assert driven == {"wheel_left", "wheel_right", *ARM_JOINTS}
    # Six speeds of the floating base, two wheels, six joints.
    assert robot.plant.num_velocities() == 14


def test_stowed_pose_is_within_the_joints_limits():
    for angle, (*_, lower, upper, _) in zip(
        STOWED, CHAIN.values(), strict=True
    ):
        assert lower < angle < upper


# Frames


def test_arms_base_stands_on_the_axles_midpoint(robot):
    X_BA = robot.frame("arm_base", "base")
    np.testing.assert_allclose(X_BA.translation(), [0, 0, 0.2965])
    np.testing.assert_allclose(X_BA.rotation().matrix(), np.eye(3))


def test_tip_of_the_straight_arm_is_where_it_was_published(robot):
    X_AT = robot.frame("tool", "arm_base")
    np.testing.assert_allclose(
        X_AT.translation(), [0.458325, 0, 0.36065], atol=1e-12
    )
    np.testing.assert_allclose(X_AT.rotation().matrix(), np.eye(3), atol=1e-12)


def test_tools_x_axis_is_the_direction_of_approach(robot):
    # The last joint turns about it and leaves the tip where it is.
    before = robot.frame("tool", "base", (0.3, -0.5, 0.4, 0.2, 0.6, 0.0))
    after = robot.frame("tool", "base", (0.3, -0.5, 0.4, 0.2, 0.6, 1.0))
    np.testing.assert_allclose(
        before.translation(), after.translation(), atol=1e-12
    )
    np.testing.assert_allclose(
        before.rotation().matrix()[:, 0],
        after.rotation().matrix()[:, 0],
        atol=1e-12,
    )
    # And the wrist, 0.158575 m behind, is on it.
    X_BW = robot.frame("wrist", "base", (0.3, -0.5, 0.4, 0.2, 0.6, 0.0))
    np.testing.assert_allclose(
        X_BW.translation() + 0.158575 * before.rotation().matrix()[:, 0],
        before.translation(),
        atol=1e-12,
    )


@pytest.mark.parametrize("seed", range(5))
def test_tip_is_where_the_published_chain_puts_it(robot, seed):
    q = np.random.default_rng(seed).uniform(-1.5, 1.5, 6)
    R, p = np.eye(3), np.zeros(3)
    for angle, (_, _, origin, axis, *_) in zip(q, CHAIN.values(), strict=True):
        p = p + R @ origin
        u = np.eye(3)["xyz".index(axis)]
        K = np.cross(np.eye(3), u)  # Rodrigues: [u]x.
        R = R @ (
            np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
        )
    p = p + R @ (0.043 + 0.023 + 0.027575, 0, 0)
    X_AT = robot.frame("tool", "arm_base", q)
    np.testing.assert_allclose(X_AT.translation(), p, atol=1e-12)
    np.testing.assert_allclose(X_AT.rotation().matrix(), R, atol=1e-12)


def test_lidar_scans_level_about_the_origin_at_20_cm(robot):
    X_BL = robot.frame("lidar", "base")
    np.testing.assert_allclose(X_BL.translation(), [0, 0, 0.2])
    np.testing.assert_allclose(X_BL.rotation().matrix(), np.eye(3))


def test_stations_antenna_is_the_models(robot):
    X_BA = robot.frame("antenna", "base")
    np.testing.assert_allclose(X_BA.translation()[:2], ANTENNA_POSITION)
    np.testing.assert_allclose(X_BA.rotation().matrix(), np.eye(3))


# Masses


@pytest.mark.parametrize("name", INERTIAS)
def test_link_has_the_published_mass_and_inertia(robot, name):
    mass, com, (ixx, iyy, izz, ixy, ixz, iyz) = INERTIAS[name]
    M = robot.plant.GetBodyByName(name).default_spatial_inertia()
    assert M.get_mass() == pytest.approx(mass)
    np.testing.assert_allclose(M.get_com(), com, atol=1e-9)
    # Huygens and Steiner: about the centre of mass, from about the origin.
    p = M.get_com()
    about_origin = M.CalcRotationalInertia().CopyToFullMatrix3()
    about_com = about_origin - mass * (p @ p * np.eye(3) - np.outer(p, p))
    np.testing.assert_allclose(
        about_com,
        [[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]],
        atol=1e-9,
    )


@pytest.mark.parametrize("name", INERTIAS)
def test_links_inertia_is_that_of_a_real_body(robot, name):
    # Some density gives it: the principal moments are positive and keep the
    # triangle's inequality.
    _, _, (ixx, iyy, izz, ixy, ixz, iyz) = INERTIAS[name]
    moments = np.linalg.eigvalsh(
        [[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]
    )
    assert moments[0] > 0
    assert moments[0] + moments[1] >= moments[2]
    M = robot.plant.GetBodyByName(name).default_spatial_inertia()
    assert M.IsPhysicallyValid()


def test_robots_mass_is_that_of_its_parts(robot):
    # 28.266 and two wheels; the arm with its base 2.134879 kg.
    total = robot.plant.CalcTotalMass(robot.pose(STOWED)[1])
    assert total == pytest.approx(28.266 + 2 * 1.824 + 2.134879, abs=1e-6)


def test_links_without_a_published_mass_have_none(robot):
    for number in range(1, robot.plant.num_bodies()):
        body = robot.plant.get_body(BodyIndex(number))
        if body.name() not in INERTIAS:
            assert body.default_mass() == 0
