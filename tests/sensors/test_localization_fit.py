"""One fit on a floor plan: by hand, by the textbook, and by Monte Carlo."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_mobarm.geometry import rotation, transform_points
from drake_mobarm.sensors.localization import (
    LocalizationParameters,
    LocalizationState,
    Scan,
    fit,
    predict,
    read_scan,
    residuals,
)
from helpers.localizing import (
    FIELD,
    NOTHING,
    PARAMETERS,
    RANGE_MAX,
    drive,
    localized,
    plan,
    seen,
)
from helpers.shapes import rectangle, turned

# Residuals


@given(
    st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3), st.integers(0, 10**6)
)
def test_derivatives_are_those_of_the_distances(x, y, yaw, seed):
    points = np.random.default_rng(seed).uniform(-1.5, 1.5, (8, 2))
    scan = Scan(points, np.zeros((8, 2)), np.ones(8))
    step, pose = 1e-6, np.array([x, y, yaw])
    _, derivatives = residuals(FIELD, scan, pose)
    node = (transform_points(pose, points) / 0.025) % 1
    inner = (np.abs(node - 0.5) < 0.49).all(axis=1)
    for axis, move in enumerate(step * np.eye(3)):
        after, _ = residuals(FIELD, scan, pose + move)
        before, _ = residuals(FIELD, scan, pose - move)
        np.testing.assert_allclose(
            derivatives[inner, axis],
            (after - before)[inner] / (2 * step),
            atol=1e-5,
        )


def test_along_a_slanting_wall_the_distance_counts_as_constant():
    angle = 0.3
    wall = turned(rectangle(-6, 1.0, 6, 1.2), angle)
    ranges = seen((0.0, 0.0, 0.0), outlines=[wall])
    field = plan([wall])
    scan = read_scan(ranges, RANGE_MAX, field, PARAMETERS)
    _, derivatives = residuals(field, scan, (0.0, 0.0, 0.0))
    along = derivatives[:, :2] @ rotation(angle)[:, 0]
    # But at the ends of the wall, where the next ray meets nothing.
    assert np.mean(np.abs(along) < 1e-6) > 0.9
    across = derivatives[:, :2] @ rotation(angle)[:, 1]
    assert np.median(across) == pytest.approx(-1, abs=0.1)


def test_rays_without_a_return_and_on_the_robot_are_left_out():
    ranges = np.full(360, 2.0)
    ranges[:6] = math.nan, math.inf, -1.0, 0.1, RANGE_MAX, 1e300
    scan = read_scan(ranges, RANGE_MAX, FIELD, PARAMETERS)
    assert len(scan.points) == 354
    np.testing.assert_allclose(np.hypot(*scan.points.T), 2.0)


def test_rays_that_meet_the_same_stretch_share_its_variance():
    # 360 rays at 2 m are 3.49 cm apart: 57.3 of them share 2 m of surface,
    # whose place has the variance of a cell, 0.05^2 / 12.
    ranges = np.full(360, 2.0)
    scan = read_scan(ranges, RANGE_MAX, FIELD, PARAMETERS)
    expected = 0.01**2 + 57.2958 * 0.05**2 / 12
    np.testing.assert_allclose(scan.variance, expected, rtol=1e-5)


# Fit and covariance


def corner_scan(noise=0.0, rng=None):
    """20 points on a wall at x = 2, and 30 on one at y = 2, seen from 0."""
    x_wall = np.column_stack([np.full(20, 2.0), np.linspace(-1, 1, 20)])
    y_wall = np.column_stack([np.linspace(-1.5, 1, 30), np.full(30, 2.0)])
    points = np.vstack([x_wall, y_wall])
    if rng is not None:
        points = points + rng.normal(0, noise, points.shape)
    return Scan(points, np.zeros_like(points), np.full(50, 0.02**2))


CORNER = plan([rectangle(2.0, -4, 2.2, 4), rectangle(-4, 2.0, 4, 2.2)])
NO_PRIOR = 1e-9 * np.eye(3)


def textbook_covariance():
    """Of x, y and yaw from distances to the two walls of a corner."""
    # A turn by a moves a point (p, q) by a (-q, p): the wall at x = 2 comes
    # nearer by x - a q, that at y = 2 by y + a p.
    q, p = np.linspace(-1, 1, 20), np.linspace(-1.5, 1, 30)
    rows = [[1, 0, -value] for value in q] + [[0, 1, value] for value in p]
    design = np.array(rows)
    return 0.02**2 * np.linalg.inv(design.T @ design)


def test_the_covariance_in_a_corner_is_the_textbooks():
    found = fit(CORNER, corner_scan(), (0.0, 0.0, 0.0), NO_PRIOR, [0.5] * 10)
    np.testing.assert_allclose(found.pose, 0, atol=1e-6)
    np.testing.assert_allclose(
        np.linalg.inv(found.information),
        textbook_covariance(),
        rtol=1e-4,
        atol=1e-12,
    )


def test_estimates_scatter_as_the_covariance_says():
    rng = np.random.default_rng(1)
    poses = np.array(
        [
            fit(
                CORNER,
                corner_scan(0.02, rng),
                (0.0, 0.0, 0.0),
                NO_PRIOR,
                # So large that all points weigh the same.
                [50.0] * 10,
            ).pose
            for _ in range(600)
        ]
    )
    expected = textbook_covariance()
    # 600 draws give a variance to 6 %: four of these.
    np.testing.assert_allclose(
        poses.var(axis=0), np.diag(expected), rtol=4 * math.sqrt(2 / 600)
    )
    # The mean, to a 24th of a deviation: five of these.
    np.testing.assert_allclose(
        poses.mean(axis=0) / np.sqrt(np.diag(expected)), 0, atol=5 / 24.5
    )


def test_a_prior_as_exact_as_the_scan_halves_the_step():
    information = np.linalg.inv(textbook_covariance())
    expected = (0.01, -0.01, 0.0)
    found = fit(CORNER, corner_scan(), expected, information, [50.0] * 10)
    np.testing.assert_allclose(found.pose, [0.005, -0.005, 0], atol=2e-5)
    np.testing.assert_allclose(
        found.information, 2 * information, rtol=1e-4, atol=1e-6
    )


def test_a_point_at_the_fit_distance_weighs_a_quarter():
    # Of a wall at x = 2; the other point is behind its surface by half of it.
    scan = Scan(
        np.array([[1.9, 0.5], [2.05, -0.5]]), np.zeros((2, 2)), np.ones(2)
    )
    strong = 1e9 * np.eye(3)
    field = plan([rectangle(2.0, -4, 2.4, 4)])
    found = fit(field, scan, (0.0, 0.0, 0.0), strong, [0.1])
    assert found.information[0, 0] - 1e9 == pytest.approx(0.5, rel=1e-4)
    assert found.share == 0


# Prediction


def test_the_covariance_grows_with_way_and_turn_as_worked_by_hand():
    state = LocalizationState(np.diag([1e-4, 1e-4, 4e-4]), odometry=(1, 2, 0))
    parameters = LocalizationParameters(
        odometry_move=0.1, odometry_turn=0.2, odometry_veer=0.3
    )
    after = predict(state, (3.0, 2.0, 0.5), parameters).covariance
    # 2 m along x: y = 2 yaw. At rest it grows by 0.5 mm and 0.5 mrad.
    rest = 0.0005**2
    expected = np.array(
        [
            [1e-4 + 2 * 0.01 + rest, 0, 0],
            [0, 1e-4 + 4 * 4e-4 + 2 * 0.01 + rest, 2 * 4e-4],
            [0, 2 * 4e-4, 4e-4 + 0.5 * 0.04 + 2 * 0.09 + rest],
        ]
    )
    np.testing.assert_allclose(after, expected, rtol=1e-12)


def test_where_nothing_is_mapped_odometry_is_kept():
    true, told = drive(30)
    poses, state = localized(true, told, field=NOTHING)
    np.testing.assert_array_equal(poses, told)
    assert state.covariance[0, 0] > 0.01**2 + 8 * 0.02**2


def test_where_nothing_is_seen_odometry_is_kept():
    true, told = drive(5)
    for value in (RANGE_MAX, math.nan, math.inf, 0.0):
        nothing = np.full(360, value)
        poses, _ = localized(true, told, change=lambda _, n=nothing: n)
        np.testing.assert_array_equal(poses, told)


def test_along_a_corridor_odometry_is_kept():
    walls = [rectangle(-30, 1, 30, 1.2), rectangle(-30, -1.2, 30, -1)]
    x = np.linspace(0, 10, 201)
    true = np.column_stack([x, 0 * x, 0 * x])
    told = np.column_stack([1.03 * x, 0.02 * x, 0 * x])
    poses, state = localized(true, told, walls, plan(walls))
    np.testing.assert_allclose(poses[:, 0], told[:, 0], atol=1e-3)
    np.testing.assert_allclose(poses[:, 1], 0, atol=0.005)
    # 10.3 m, the start, and 200 scans at rest: nothing was learnt.
    expected = 10.3 * 0.02**2 + 0.01**2 + 200 * 0.0005**2
    assert state.covariance[0, 0] == pytest.approx(expected, rel=0.01)
    assert state.covariance[1, 1] < 0.005**2


@pytest.mark.parametrize("angle", [0.1, 0.4, math.pi / 4])
def test_the_stairs_of_a_slanting_corridor_hold_nothing(angle):
    along, across = rotation(angle).T
    walls = [
        turned(rectangle(-20, 1, 20, 1.2), angle),
        turned(rectangle(-20, -1.2, 20, -1), angle),
    ]
    way = np.linspace(-4, 4, 161)
    yaw = np.full(161, angle)
    true = np.column_stack([way[:, None] * along, yaw])
    told = np.column_stack([(1.03 * way + 0.12)[:, None] * along, yaw])
    poses, state = localized(true, told, walls, plan(walls))
    off = poses[:, :2] - told[:, :2]
    np.testing.assert_allclose(off @ along, 0, atol=0.03)
    np.testing.assert_allclose(poses[:, :2] @ across, 0, atol=0.01)
    deviation = np.sqrt(along @ state.covariance[:2, :2] @ along)
    # After 8 m of which nothing is known it is sqrt(8) times 2 cm.
    assert deviation > 0.5 * math.sqrt(8) * 0.02
