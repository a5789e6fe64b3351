"""The robot's figures are those of its URDF, read as plain XML."""

import xml.etree.ElementTree as ElementTree

import pytest

from drake_mobarm.robot import shape
from drake_mobarm.robot.arm_kinematics import ArmKinematics

ROBOT = ElementTree.parse(shape.URDF).getroot()


def numbers(element, name):
    return [float(x) for x in element.get(name).split()]


def collision(link):
    (found,) = ROBOT.findall(f"link[@name='{link}']/collision")
    return found


def joint_origin(name):
    origin = ROBOT.find(f"joint[@name='{name}']/origin")
    assert origin.get("rpy", "0 0 0") == "0 0 0"
    return numbers(origin, "xyz")


def frame(name):
    found = ROBOT.find(f"frame[@name='{name}']")
    assert found.get("link") == "base"
    assert found.get("rpy") == "0 0 0"
    return numbers(found, "xyz")


def chassis():
    """Radius, bottom and top of the chassis."""
    found = collision("base")
    cylinder = found.find("geometry/cylinder")
    x, y, z = numbers(found.find("origin"), "xyz")
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
    assert joint_origin("arm_base") == [0, 0, shape.ARM_BASE_HEIGHT]


def test_the_lidar_scans_at_its_height_over_the_origin():
    assert frame("lidar") == [0, 0, shape.LIDAR_HEIGHT]


def test_the_antenna_is_where_it_is_told_to_be():
    assert tuple(frame("antenna")[:2]) == shape.ANTENNA_POSITION


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
