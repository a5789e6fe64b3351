"""The URDF's collision shapes: the robot's disc, its heights, its wheels."""

import math

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule, Cylinder, Sphere
from pydrake.multibody.tree import BodyIndex

from drake_mobarm.robot.shape import HEIGHTS, STOWED

ARM_LINKS = {
    *("shoulder", "upper_arm", "upper_forearm", "lower_forearm"),
    *("wrist", "hand"),
}


def collision_shapes(robot, q):
    """Body's name, shape and pose X_BG in the base of every geometry."""
    _, context = robot.pose(q)
    X_BW = robot.plant.GetBodyByName("base").EvalPoseInWorld(context).inverse()
    inspector = robot.scene_graph.model_inspector()
    for number in range(1, robot.plant.num_bodies()):
        body = robot.plant.get_body(BodyIndex(number))
        X_BL = X_BW @ body.EvalPoseInWorld(context)
        for geometry in robot.plant.GetCollisionGeometriesForBody(body):
            yield (
                body.name(),
                inspector.GetShape(geometry),
                X_BL @ inspector.GetPoseInFrame(geometry),
            )


def farthest_from_the_axis(shape, X_BG):
    """An upper bound of a shape's distance from the base's vertical."""
    if isinstance(shape, Box):
        points = 0.5 * shape.size() * np.array(list(np.ndindex(2, 2, 2)))
        points, rim = 2 * points - 0.5 * shape.size(), 0.0
    elif isinstance(shape, (Capsule, Cylinder)):
        points = np.array([[0, 0, -0.5], [0, 0, 0.5]]) * shape.length()
        rim = shape.radius()
    else:
        assert isinstance(shape, Sphere)
        points, rim = np.zeros((1, 3)), shape.radius()
    p_BP = X_BG.multiply(points.T)
    return np.hypot(p_BP[0], p_BP[1]).max() + rim


def test_stowed_arm_stays_within_the_bases_disc(robot):
    names = set()
    for name, shape, X_BG in collision_shapes(robot, STOWED):
        if not name.startswith(("wheel", "caster")):
            names.add(name)
            assert farthest_from_the_axis(shape, X_BG) <= 0.27
    assert names == {"base"} | ARM_LINKS


def test_stowed_robot_ends_below_what_is_looked_at_for_it(robot):
    tops = []
    for _, shape, X_BG in collision_shapes(robot, STOWED):
        x, y, z = X_BG.rotation().matrix()[2]
        if isinstance(shape, Box):
            half = 0.5 * np.abs([x, y, z]) @ shape.size()
        elif isinstance(shape, Sphere):
            half = shape.radius()
        elif isinstance(shape, Capsule):
            half = abs(z) * shape.length() / 2 + shape.radius()
        else:
            half = abs(z) * shape.length() / 2
            half += math.hypot(x, y) * shape.radius()
        tops.append(X_BG.translation()[2] + half)
    assert 0.5 < max(tops) < HEIGHTS[1]


def test_outstretched_arm_leaves_the_bases_disc(robot):
    assert any(
        farthest_from_the_axis(shape, X_BG) > 0.27
        for _, shape, X_BG in collision_shapes(robot, [0, 1.2, -1.2, 0, 0, 0])
    )


def test_stowed_robot_does_not_touch_itself(robot):
    root, _ = robot.pose(STOWED)
    query = robot.scene_graph.get_query_output_port().Eval(
        robot.scene_graph.GetMyContextFromRoot(root)
    )
    assert not query.HasCollisions()


def test_arm_that_reaches_into_the_base_touches_it(robot):
    root, _ = robot.pose([0, 1.9, 0.6, 0, 1.0, 0])
    query = robot.scene_graph.get_query_output_port().Eval(
        robot.scene_graph.GetMyContextFromRoot(root)
    )
    assert query.HasCollisions()


def test_wheels_touch_the_ground_and_casters_hover_a_millimetre_above(robot):
    lowest = {
        name: X_BG.translation()[2] - shape.radius()
        for name, shape, X_BG in collision_shapes(robot, STOWED)
        if name.startswith(("wheel", "caster"))
    }
    assert lowest == pytest.approx(
        {
            "wheel_left": 0.0,
            "wheel_right": 0.0,
            "caster_front": 0.001,
            "caster_rear": 0.001,
        },
        abs=1e-9,
    )


def test_chassis_is_a_disc_that_ends_under_the_arm(robot):
    (found,) = (
        (shape, X_BG)
        for name, shape, X_BG in collision_shapes(robot, STOWED)
        if name == "base"
    )
    shape, X_BG = found
    assert isinstance(shape, Cylinder)
    assert shape.radius() == 0.27
    np.testing.assert_allclose(X_BG.translation()[:2], 0, atol=1e-12)
    np.testing.assert_allclose(X_BG.rotation().matrix(), np.eye(3), atol=1e-12)
    top = X_BG.translation()[2] + shape.length() / 2
    assert top == pytest.approx(0.2965)
