"""Outlines and clearances of bodies, by hand and against shapely."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from drake_mobarm.world.obstacles import (
    Obstacle,
    box_corners,
    clearance,
    cylinder_corners,
    inside,
    outline,
    outlines,
    outlines_to_segments,
    signed_distance,
)
from helpers.shapes import convex_polygon, rectangle

SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])


def about_x(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def about_y(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def about_z(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def area(polygon):
    """Positive where it runs counter-clockwise."""
    x, y = polygon.T
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


def assert_same_corners(polygon, expected):
    """The same corners, counter-clockwise, wherever the list begins."""
    expected = np.asarray(expected, dtype=float)
    assert len(polygon) == len(expected)
    assert area(polygon) > 0
    for corner in expected:
        assert np.linalg.norm(polygon - corner, axis=1).min() < 1e-9


def random_rotation(rng):
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q if np.linalg.det(Q) > 0 else -Q


# Bodies


def test_box_has_its_eight_corners_half_its_size_from_the_centre():
    corners = box_corners(np.array([2.0, 4.0, 6.0]))
    expected = {(x, y, z) for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)}
    assert {tuple(c) for c in corners} == expected


def test_cylinder_has_two_rings_at_its_ends_on_its_radius():
    corners = cylinder_corners(0.5, 3.0)
    np.testing.assert_allclose(np.hypot(*corners[:, :2].T), 0.5)
    np.testing.assert_allclose(
        np.sort(corners[:, 2]), np.repeat([-1.5, 1.5], len(corners) // 2)
    )


def test_outline_of_a_cylinder_is_within_0_3_percent_of_the_circle():
    polygon = outline(cylinder_corners(2.0, 1.0), -0.2, 0.2)
    middles = (polygon + np.roll(polygon, -1, axis=0)) / 2
    np.testing.assert_allclose(np.hypot(*polygon.T), 2.0)
    assert np.hypot(*middles.T).min() > 2.0 * (1 - 0.003)


# Outlines


def test_outline_of_an_upright_box_is_its_rectangle():
    corners = np.array([5.0, 6.0, 1.5]) + box_corners(np.array([2.0, 1.0, 3.0]))
    for low, high in [(0.2, 0.2), (0.0, 3.0), (0.1, 0.6), (-1.0, 9.0)]:
        assert_same_corners(
            outline(corners, low, high), rectangle(4, 5.5, 6, 6.5)
        )


def test_box_that_is_yawed_has_a_yawed_outline():
    corners = box_corners(np.array([2.0, 2.0, 1.0])) @ about_z(math.pi / 4).T
    r = math.sqrt(2)
    assert_same_corners(
        outline(corners, 0, 0), [(r, 0), (0, r), (-r, 0), (0, -r)]
    )


def test_base_of_a_pyramid_counts_where_it_lies_in_either_plane():
    base = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    up = np.array([*base, (0, 0, 1)], dtype=float)
    square = rectangle(-1, 1, -1, 1)
    assert_same_corners(outline(up, 0.0, 2.0), square)
    assert_same_corners(outline(up * (1, 1, -1), -2.0, 0.0), square)


def test_tetrahedron_is_cut_in_a_triangle():
    # Half way up to the tip over the origin, half of its base is left.
    base = np.array([(0, 0, 0), (2, 0, 0), (0, 4, 0)], dtype=float)
    polygon = outline(np.vstack([base, [(0, 0, 1)]]), 0.5, 0.5)
    assert_same_corners(polygon, base[:, :2] / 2)


@pytest.mark.parametrize(("low", "high"), [(1.6, 1.6), (1.51, 9), (-9, -1.51)])
def test_body_beyond_the_heights_has_no_outline(low, high):
    assert outline(box_corners(np.array([2.0, 1.0, 3.0])), low, high) is None


def test_lying_cylinder_cut_in_its_middle_is_a_rectangle():
    # Along z, then laid along x: 3 m by its diameter of 1 m.
    corners = cylinder_corners(0.5, 3.0) @ about_y(math.pi / 2).T
    assert_same_corners(
        outline(corners, 0.0, 0.0), rectangle(-1.5, -0.5, 1.5, 0.5)
    )


def test_lying_cylinder_cut_above_its_middle_is_a_narrower_rectangle():
    corners = cylinder_corners(0.5, 3.0) @ about_y(math.pi / 2).T
    polygon = outline(corners, 0.3, 0.3)
    # The chord of a circle of 0.5 at 0.3: half of it is 0.4.
    np.testing.assert_allclose(polygon.max(axis=0), [1.5, 0.4], atol=0.002)
    np.testing.assert_allclose(polygon.min(axis=0), [-1.5, -0.4], atol=0.002)


def test_lying_cylinder_cut_in_a_band_is_as_wide_as_its_widest():
    corners = cylinder_corners(0.5, 3.0) @ about_y(math.pi / 2).T
    polygon = outline(corners, -0.1, 0.4)
    np.testing.assert_allclose(polygon.max(axis=0), [1.5, 0.5], atol=1e-9)


def test_box_on_its_edge_is_cut_as_wide_as_its_slope_is_there():
    # A unit cube turned by 45 degrees about x: a rhombus seen along x, whose
    # half width at height z is sqrt(1/2) - abs(z).
    corners = box_corners(np.ones(3)) @ about_x(math.pi / 4).T
    half = math.sqrt(0.5) - 0.3
    for height in (-0.3, 0.3):
        assert_same_corners(
            outline(corners, height, height),
            rectangle(-0.5, -half, 0.5, half),
        )


def test_tilted_board_between_heights_covers_what_it_passes_over():
    # A thin board, 2 m long, risen by 30 degrees towards +x: it gains 0.577 m
    # a metre of floor.
    corners = box_corners(np.array([2.0, 1.0, 1e-6]))
    corners = corners @ about_y(-math.radians(30)).T
    polygon = outline(corners, 0.1, 0.2)
    slope = math.tan(math.radians(30))
    np.testing.assert_allclose(
        polygon.min(axis=0), [0.1 / slope, -0.5], atol=1e-5
    )
    np.testing.assert_allclose(
        polygon.max(axis=0), [0.2 / slope, 0.5], atol=1e-5
    )


@settings(max_examples=40)
@given(st.integers(0, 10**6))
def test_outline_is_the_shadow_of_what_is_between_the_heights(seed):
    rng = np.random.default_rng(seed)
    size, R = rng.uniform(0.2, 2, 3), random_rotation(rng)
    low, high = np.sort(rng.uniform(-0.3, 0.3, 2))
    polygon = outline(box_corners(size) @ R.T, low, high)
    assume(polygon is not None)
    # Points of the box between the heights, sampled: all are in the outline.
    points = rng.uniform(-0.5, 0.5, (4000, 3)) * size @ R.T
    points = points[(points[:, 2] >= low) & (points[:, 2] <= high), :2]
    assert inside(polygon * (1 + 1e-9), points).all()
    # And every corner of the outline is a point of the box at some height
    # between: the box on the corner's vertical, clipped by its three slabs.
    for corner in polygon:
        p, u = R.T @ [*corner, 0.0], R.T @ [0.0, 0.0, 1.0]
        ends = np.sort(
            [(-size / 2 - p) / u, (size / 2 - p) / u], axis=0
        )  # heights where the vertical enters and leaves each slab
        assert max(ends[0].max(), low) <= min(ends[1].min(), high) + 1e-6


@given(st.integers(0, 10**6))
def test_outline_runs_counter_clockwise(seed):
    rng = np.random.default_rng(seed)
    body = box_corners(rng.uniform(0.1, 2, 3)) @ random_rotation(rng).T
    assert area(outline(body, 0.0, 0.0)) > 0


def test_outlines_leave_out_bodies_that_are_not_met():
    low = Obstacle("low", box_corners(np.ones(3)))
    high = Obstacle("high", np.array([0, 0, 5]) + box_corners(np.ones(3)))
    found = outlines((high, low), 0.1, 0.4)
    assert len(found) == 1
    assert_same_corners(found[0], rectangle(-0.5, -0.5, 0.5, 0.5))


def test_sides_of_outlines_join_each_corner_to_the_next():
    triangle = np.array([[5.0, 5.0], [6.0, 5.0], [5.0, 6.0]])
    starts, ends = outlines_to_segments([SQUARE, triangle])
    np.testing.assert_array_equal(starts, np.vstack([SQUARE, triangle]))
    np.testing.assert_array_equal(
        ends,
        [(2, 0), (2, 1), (0, 1), (0, 0), (6, 5), (5, 6), (5, 5)],
    )


def test_no_outlines_have_no_sides():
    starts, ends = outlines_to_segments([])
    assert starts.shape == ends.shape == (0, 2)


# Inside and clearance


def test_inside_is_worked_by_hand_on_a_rectangle():
    points = np.array([[1, 0.5], [0.01, 0.99], [-0.01, 0.5], [1, 1.01], [3, 3]])
    np.testing.assert_array_equal(
        inside(SQUARE, points), [True, True, False, False, False]
    )


def test_corners_and_sides_are_inside():
    assert inside(SQUARE, np.vstack([SQUARE, [[1.0, 0.0]]])).all()


@given(st.integers(0, 10**6))
def test_inside_agrees_with_the_winding_number(seed):
    rng = np.random.default_rng(seed)
    polygon = convex_polygon(rng, 7)
    for point in rng.uniform(-1.2, 1.2, (20, 2)):
        d = polygon - point
        bearing = np.arctan2(d[:, 1], d[:, 0])
        turn = np.roll(bearing, -1) - bearing
        winding = np.sum(np.arctan2(np.sin(turn), np.cos(turn)))
        assert inside(polygon, point) == (winding > math.pi)


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((1.0, 0.5), 0.0),  # inside
        ((0.0, 1.0), 0.0),  # a corner
        ((-3.0, 0.5), 3.0),  # beside a side
        ((1.0, 1.25), 0.25),
        ((5.0, 5.0), 5.0),  # (3, 4) from a corner
        ((-0.6, -0.8), 1.0),
    ],
)
def test_clearance_is_worked_by_hand_around_a_rectangle(point, expected):
    assert clearance([SQUARE], np.array(point)) == pytest.approx(expected)


@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_clearance_is_the_distance_to_the_nearest_sampled_point(seed):
    rng = np.random.default_rng(seed)
    polygons = [
        convex_polygon(rng, int(rng.integers(3, 9)), rng.uniform(-3, 3, 2))
        for _ in range(4)
    ]
    share = np.linspace(0, 1, 201)[:, None]
    sides = np.vstack(
        [
            a * (1 - share) + b * share
            for polygon in polygons
            for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True)
        ]
    )
    points = rng.uniform(-4, 4, (30, 2))
    measured = clearance(polygons, points)
    for point, got in zip(points, measured, strict=True):
        if any(inside(polygon, point) for polygon in polygons):
            assert got == 0
        else:
            nearest = np.linalg.norm(sides - point, axis=1).min()
            assert nearest - 0.01 <= got <= nearest + 1e-12


@given(st.integers(0, 10**6))
def test_clearance_never_changes_faster_than_one_moves(seed):
    rng = np.random.default_rng(seed)
    polygons = [convex_polygon(rng, 5, rng.uniform(-2, 2, 2)) for _ in "ab"]
    p, q = rng.uniform(-4, 4, (2, 20, 2))
    change = np.abs(clearance(polygons, p) - clearance(polygons, q))
    assert np.all(change <= np.linalg.norm(p - q, axis=1) + 1e-12)


def test_clearance_without_outlines_is_infinite_and_keeps_the_shape():
    assert np.all(np.isinf(clearance([], np.zeros((2, 3, 2)))))
    assert clearance([SQUARE], np.zeros((2, 3, 2))).shape == (2, 3)


# Signed distance


@pytest.mark.parametrize(
    ("point", "distance", "gradient"),
    [
        ((1.0, 0.25), -0.25, (0, -1)),  # inside, nearest to the lower side
        ((0.125, 0.5), -0.125, (-1, 0)),
        ((-3.0, 0.5), 3.0, (-1, 0)),  # beside a side
        ((1.0, 1.25), 0.25, (0, 1)),
        ((5.0, 5.0), 5.0, (0.6, 0.8)),  # (3, 4) from a corner
        ((-0.6, -0.8), 1.0, (-0.6, -0.8)),
        ((1.0, 0.0), 0.0, (0, -1)),  # on a side
    ],
)
def test_signed_distance_is_worked_by_hand_around_a_rectangle(
    point, distance, gradient
):
    value, slope = signed_distance(SQUARE, np.array(point))
    np.testing.assert_allclose(value, [distance], atol=1e-15)
    np.testing.assert_allclose(slope, [gradient], atol=1e-15)


def test_signed_distance_is_zero_with_a_unit_gradient_at_a_corner():
    for corner in SQUARE:
        value, slope = signed_distance(SQUARE, corner)
        np.testing.assert_array_equal(value, [0.0])
        assert np.linalg.norm(slope) == pytest.approx(1)


@given(st.integers(0, 10**6))
def test_signed_distance_at_a_corner_is_zero_whatever_way_its_sides_lie(seed):
    # Rounding puts a corner now and then outside a side that ends in it.
    polygon = convex_polygon(np.random.default_rng(seed), 9)
    for corner in polygon:
        value, slope = signed_distance(polygon, corner)
        np.testing.assert_allclose(value, [0.0], atol=1e-15)
        assert slope.shape == (1, 2)
        assert np.linalg.norm(slope) == pytest.approx(1)


@given(st.integers(0, 10**6))
def test_signed_distance_is_shapelys_and_inside_minus_that_to_the_edge(seed):
    rng = np.random.default_rng(seed)
    polygon = convex_polygon(rng, int(rng.integers(3, 12)))
    shape = shapely.Polygon(polygon)
    for point in rng.uniform(-1.5, 1.5, (10, 2)):
        away = shapely.distance(shape, shapely.Point(point))
        depth = shapely.distance(shape.exterior, shapely.Point(point))
        (value,), _ = signed_distance(polygon, point)
        assert value == pytest.approx(away or -depth, abs=1e-12)


@given(st.integers(0, 10**6))
def test_gradient_of_signed_distance_is_that_of_central_differences(seed):
    rng = np.random.default_rng(seed)
    polygon = convex_polygon(rng, int(rng.integers(3, 12)))
    step = 1e-6
    for point in rng.uniform(-1.5, 1.5, (10, 2)):
        _, gradient = signed_distance(polygon, point)
        assert np.linalg.norm(gradient) == pytest.approx(1)
        around = [
            [signed_distance(polygon, point + s * e) for s in (step, -step)]
            for e in np.eye(2)
        ]
        if any(gradient[0] @ g[0] < 0.9 for pair in around for _, g in pair):
            continue  # A crease, where it has no gradient, is between them.
        difference = [(a[0] - b[0]) / (2 * step) for (a, _), (b, _) in around]
        np.testing.assert_allclose(gradient[0], difference, atol=1e-3)
