"""The robot's figures are those of its URDF, read as plain XML."""

import numpy as np
import pytest

from drake_mobarm.robot import shape
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from helpers.urdf import ROBOT, collisions, joint_origin, numbers


def frame(name):
    found = ROBOT.find(f"frame[@name='{name}']")
    assert found.get("link") == "base"
    assert found.get("rpy") == "0 0 0"
    return tuple(numbers(found, "xyz"))


def chassis():
    """Radius, bottom and top of the chassis."""
    (x, y, z), cylinder = collisions("base")["chassis"]
    assert (x, y) == (0, 0)
    half = float(cylinder.get("length")) / 2
    return float(cylinder.get("radius")), z - half, z + half


def test_radius_and_top_are_the_chassis():
    radius, _, top = chassis()
    assert radius == shape.RADIUS
    assert top == pytest.approx(shape.CHASSIS_TOP, abs=1e-12)


def test_the_robot_can_touch_things_from_below_its_chassis_on():
    _, bottom, _ = chassis()
    assert 0 < shape.HEIGHTS[0] <= bottom


def test_the_arm_stands_on_the_chassis_over_the_origin():
    assert tuple(joint_origin("arm_base")) == (0, 0, shape.ARM_BASE_HEIGHT)


def test_the_lidar_scans_at_its_height_over_the_origin():
    assert frame("lidar") == (0, 0, shape.LIDAR_HEIGHT)


def test_the_antenna_is_where_it_is_told_to_be():
    assert frame("antenna")[:2] == shape.ANTENNA_POSITION


def test_the_rolling_bodies_are_those_whose_sphere_is_at_the_floor():
    low = set()
    for link in ROBOT.findall("link"):
        sphere = link.find("collision/geometry/sphere")
        origin = ROBOT.find(f"joint[@name='{link.get('name')}']/origin")
        if sphere is not None and origin is not None:
            z = numbers(origin, "xyz")[2]
            if abs(z - float(sphere.get("radius"))) < 0.002:
                low.add(link.get("name"))
    assert low == set(shape.ROLLING_BODIES)


def test_the_arm_can_be_stowed_within_its_limits():
    arm = ArmKinematics()
    assert (arm.lower < shape.STOWED).all()
    assert (arm.upper > shape.STOWED).all()


def test_the_balls_are_a_centimetre_thicker_than_the_models_thickest_link():
    radii = [
        float(body.get("radius"))
        for link in ROBOT.iter("link")
        if link.get("name") != "base"
        for body in link.findall("./collision/geometry/*")
        if body.tag.endswith("capsule")
    ]
    assert len(radii) == 4
    assert max(radii) + 0.01 == pytest.approx(shape.LINK_RADIUS, abs=1e-9)
    assert min(radii) > shape.LINK_RADIUS - 0.02


def test_the_waists_column_is_that_of_the_model():
    centre, cylinder = collisions("shoulder")["shoulder"]
    radius, height = shape.WAIST_COLUMN
    assert float(cylinder.get("radius")) == radius
    np.testing.assert_array_equal(centre[:2], 0.0)
    # The waist lifts the shoulder's frame over the arm's base.
    top = centre[2] + float(cylinder.get("length")) / 2
    top += joint_origin("waist")[2]
    assert top == pytest.approx(height, abs=1e-9)


def test_the_grippers_balls_cover_the_sides_of_the_models_gripper():
    centre, box_shape = collisions("hand")["gripper"]
    along, aside = shape.GRIPPER
    # From the wrist's centre; the hand's frame is at the last joint.
    middle = joint_origin("wrist_rotate") + centre
    assert middle[0] == pytest.approx(along, abs=1e-9)
    assert middle[1] == 0
    _, half_width, half_height = numbers(box_shape, "size") / 2
    # The farther edge of the side's face, from the ball's centre.
    edge = np.hypot(half_width - aside, half_height + abs(middle[2]))
    assert edge < shape.LINK_RADIUS
    assert half_width <= aside + shape.LINK_RADIUS
    assert half_width > aside + shape.LINK_RADIUS - 0.025
