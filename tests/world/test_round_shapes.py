"""Round shapes: exact for contact, within 0.2 % for lidar and maps."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.spatial import ConvexHull

from drake_mobarm.world.obstacles import Obstacle, clearance
from drake_mobarm.world.sdf import load_world
from helpers.sdf import collision, model, saved, world

RADIUS = 0.5
SPHERE = f"<sphere><radius>{RADIUS}</radius></sphere>"
CAPSULE = f"<capsule><radius>{RADIUS}</radius><length>2</length></capsule>"
ELLIPSOID = "<ellipsoid><radii>0.5 0.8 0.3</radii></ellipsoid>"
BOUND = 0.002 * RADIUS


def load(folder, shape, pose="0 0 0 0 0 0"):
    return load_world(saved(folder, world(model(collision(shape, pose=pose)))))


def radii(outline, centre=(0.0, 0.0)):
    """The least and the greatest distance of an outline from its centre."""
    points = outline - centre
    side = np.roll(points, -1, axis=0) - points
    cross = points[:, 0] * side[:, 1] - points[:, 1] * side[:, 0]
    to_sides = cross / np.linalg.norm(side, axis=1)
    return to_sides.min(), np.linalg.norm(points, axis=1).max()


def heights():
    """Heights all over a ball of radius 1, densely at its poles."""
    near = 1 - np.geomspace(1e-6, 0.1, 60)
    return np.concatenate([np.linspace(-0.9, 0.9, 121), near, -near])


@pytest.mark.parametrize("tilt", ["0 0 0", "0.3 -0.2 0.1"])
def test_a_spheres_cut_is_a_circle_at_every_height(tmp_path, tilt):
    # A sphere is the same however it is turned; its corners are not.
    (ball,) = load(tmp_path, SPHERE, f"3 -2 1 {tilt}").obstacles
    bound = BOUND if tilt == "0 0 0" else 4 * BOUND
    for share in heights()[:121]:
        z = 1 + RADIUS * share
        low, high = radii(ball.outline(z, z), (3, -2))
        exact = RADIUS * np.sqrt(1 - share**2)
        assert exact - bound < low <= high < exact + bound


@pytest.mark.parametrize("shape", [SPHERE, CAPSULE])
def test_an_upright_ones_cut_is_a_circle_even_at_its_poles(tmp_path, shape):
    (found,) = load(tmp_path, shape).obstacles
    middle = 1.0 if shape == CAPSULE else 0.0
    for share in heights():
        z = RADIUS * share + np.copysign(middle, share)
        cut = found.outline(z, z)
        low, high = (0, 0) if cut is None else radii(cut)
        exact = RADIUS * np.sqrt(1 - share**2)
        assert exact - BOUND < low <= high < exact + BOUND


def test_between_two_heights_a_round_things_outline_is_its_widest(tmp_path):
    (ball,) = load(tmp_path, SPHERE).obstacles
    for low, high, widest in (
        (-0.1, 0.3, RADIUS),
        (0.3, 0.4, 0.4),
        (-0.4, -0.3, 0.4),
        (-2, 2, RADIUS),
    ):
        inner, outer = radii(ball.outline(low, high))
        assert widest - BOUND < inner <= outer < widest + BOUND
    assert ball.outline(0.51, 0.6) is None
    assert ball.outline(-0.6, -0.51) is None


def test_a_lying_capsules_outline_is_a_stadium(tmp_path):
    lying = load(tmp_path, CAPSULE, "0 0 0 0 1.57079633 0").obstacles
    (found,) = lying
    shape = found.outline(-1, 1)
    np.testing.assert_allclose(
        shape.max(axis=0), (1.5, 0.5), rtol=0, atol=BOUND
    )
    for centre in ((1, 0), (-1, 0)):
        # Around its ends, and nowhere nearer to them.
        assert np.linalg.norm(shape - centre, axis=1).min() > 0.5 - BOUND
    away = np.array([[0.3, 0.7], [1.9, 0.0], [1.6, 0.6]])
    exact = [0.2, 0.4, np.hypot(0.6, 0.6) - 0.5]
    np.testing.assert_allclose(
        clearance([shape], away), exact, rtol=0, atol=2 * BOUND
    )


def test_an_ellipsoids_outline_is_an_ellipse(tmp_path):
    (found,) = load(tmp_path, ELLIPSOID).obstacles
    for z in (0.0, 0.1, -0.2, 0.29):
        share = np.sqrt(1 - (z / 0.3) ** 2)
        low, high = radii(found.outline(z, z) / (0.5 * share, 0.8 * share))
        assert 1 - 0.002 / share < low <= high < 1 + 0.002 / share


@pytest.mark.parametrize("shape", [SPHERE, CAPSULE, ELLIPSOID])
def test_contact_has_the_exact_shape(tmp_path, shape):
    (exact,) = load(tmp_path, shape).geometries
    kind = shape[1 : shape.index(">")].capitalize()
    assert type(exact.shape()).__name__ == kind
    assert exact.proximity_properties() is not None


@pytest.mark.parametrize("shape", [SPHERE, CAPSULE, ELLIPSOID])
def test_no_corner_is_off_the_shape_wherever_it_lies(tmp_path, shape):
    pose = "1 2 3 0.4 -0.7 2"
    (found,) = load(tmp_path, shape, pose).obstacles
    X_WG = RigidTransform(RollPitchYaw(0.4, -0.7, 2), [1, 2, 3])
    p_GV = X_WG.inverse().multiply(found.corners.T).T
    hull = ConvexHull(p_GV)
    sides = p_GV[hull.simplices].mean(axis=1)
    for points in (p_GV, sides):
        if shape == ELLIPSOID:
            size = np.linalg.norm(points / (0.5, 0.8, 0.3), axis=1)
            off = np.abs(size - 1) * 0.3
        else:
            length = 2.0 if shape == CAPSULE else 0.0
            z = np.clip(points[:, 2], -length / 2, length / 2)
            axis = np.column_stack([0 * z, 0 * z, z])
            off = np.abs(np.linalg.norm(points - axis, axis=1) - RADIUS)
        assert off.max() < BOUND


def test_an_outline_by_edges_is_that_by_all_corners(tmp_path):
    (found,) = load(tmp_path, CAPSULE, "0 0 0 0.5 0.3 0").obstacles
    # Every chord is looked at where the edges are not known.
    slow = Obstacle("slow", found.corners[::4])
    fast = Obstacle(
        "fast",
        slow.corners,
        np.unique(
            np.sort(
                ConvexHull(slow.corners).simplices[:, [[0, 1], [1, 2], [2, 0]]]
            ).reshape(-1, 2),
            axis=0,
        ),
    )
    for low, high in ((0, 0), (-0.3, 0.2), (0.7, 0.7), (-5, 5)):
        one, other = (o.outline(low, high) for o in (slow, fast))
        gap = clearance([one], other).max() + clearance([other], one).max()
        assert gap < 1e-9
