"""Rays against rooms by hand, and one by one against slow ones."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.sensors.lidar import (
    LidarParameters,
    cast_rays,
    ray_angles,
    read_lidar,
)
from drake_mobarm.world.obstacles import outlines_to_segments
from helpers.refusals import assert_refused
from helpers.shapes import convex_polygon, rectangle

NOTHING = np.empty((0, 2))


def square_room(half):
    """Four walls about the origin, their inner faces at +-half."""
    far = half + 0.5
    return outlines_to_segments(
        [
            rectangle(-far, half, far, far),
            rectangle(-far, -far, far, -half),
            rectangle(half, -half, far, half),
            rectangle(-far, -half, -half, half),
        ]
    )


def scene(rng):
    """Polygons around a sensor at (1, -2), which is in none of them."""
    centres = []
    for _ in range(rng.integers(1, 8)):
        bearing, far = rng.uniform(0, 2 * np.pi), rng.uniform(1.0, 6.0)
        centres.append((1 + far * np.cos(bearing), -2 + far * np.sin(bearing)))
    return [
        convex_polygon(rng, rng.integers(3, 8), centre, 0.9)
        for centre in centres
    ]


def nearest_along(polygons, p, angle):
    """Slow: along one ray, side by side, from both of its faces."""
    nearest = math.inf
    ux, uy = math.cos(angle), math.sin(angle)
    for polygon in polygons:
        for i in range(len(polygon)):
            (ax, ay), (bx, by) = polygon[i - 1], polygon[i]
            ahead_a, left_a = (
                (ax - p[0]) * ux + (ay - p[1]) * uy,
                (ay - p[1]) * ux - (ax - p[0]) * uy,
            )
            ahead_b, left_b = (
                (bx - p[0]) * ux + (by - p[1]) * uy,
                (by - p[1]) * ux - (bx - p[0]) * uy,
            )
            if (left_a > 0) == (left_b > 0):
                continue
            share = left_a / (left_a - left_b)
            ahead = ahead_a + share * (ahead_b - ahead_a)
            if ahead >= 0:
                nearest = min(nearest, ahead)
    return nearest


# The order of the rays


def test_rays_run_counter_clockwise_from_straight_behind():
    np.testing.assert_allclose(
        np.degrees(ray_angles(8)), [-180, -135, -90, -45, 0, 45, 90, 135]
    )


@pytest.mark.parametrize(
    ("obstacle", "ray", "distance"),
    [
        (rectangle(-4, -1, -3, 1), 0, 3.0),  # behind
        (rectangle(-1, -3, 1, -2), 2, 2.0),  # right
        (rectangle(5, -1, 6, 1), 4, 5.0),  # ahead
        (rectangle(-1, 0.5, 1, 2), 6, 0.5),  # left
    ],
)
def test_obstacle_beside_the_sensor_is_met_by_its_ray(obstacle, ray, distance):
    scan = cast_rays(*outlines_to_segments([obstacle]), [0, 0, 0], 8)
    assert scan[ray] == pytest.approx(distance)
    assert np.isinf(scan[(ray + 4) % 8])


# Distances


@pytest.mark.parametrize("yaw", [0.0, 0.3, -2.0, math.pi, 9.0])
def test_square_rooms_walls_are_as_far_as_the_secant_says(yaw):
    scan = cast_rays(*square_room(2.0), [0, 0, yaw], 360)
    angle = np.radians(np.arange(-180, 180)) + yaw
    np.testing.assert_allclose(
        scan, 2 / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
    )


def test_sensor_out_of_the_middle_is_worked_by_hand():
    scan = cast_rays(*square_room(2.0), [1.5, -0.5, 0.0], 8)
    s = math.sqrt(2)
    # Behind-right: the lower wall, 1.5 away; behind-left: the upper, 2.5.
    np.testing.assert_allclose(
        scan, [3.5, 1.5 * s, 1.5, 0.5 * s, 0.5, 0.5 * s, 2.5, 2.5 * s]
    )


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.floats(-10, 10))
def test_scan_equals_that_of_every_ray_with_every_side(seed, yaw):
    rng = np.random.default_rng(seed)
    polygons = scene(rng)
    pose, rays = (1.0, -2.0, yaw), int(rng.integers(8, 60))
    scan = cast_rays(*outlines_to_segments(polygons), pose, rays)
    for k in range(rays):
        angle = -math.pi + 2 * math.pi * k / rays + yaw
        # A corner may count or not: between what is met just beside it.
        around = [
            nearest_along(polygons, pose, angle + shift)
            for shift in (-1e-7, 0.0, 1e-7)
        ]
        assert min(around) - 1e-9 <= scan[k] <= max(around) + 1e-9


@given(st.integers(0, 10**6), st.integers(-80, 80))
def test_turning_by_whole_rays_shifts_the_scan(seed, shift):
    rng = np.random.default_rng(seed)
    sides = outlines_to_segments(scene(rng))
    start, rays = rng.uniform(-3, 3), 36
    turned = start + shift * 2 * np.pi / rays
    before = cast_rays(*sides, [1.0, -2.0, start], rays)
    after = cast_rays(*sides, [1.0, -2.0, turned], rays)
    np.testing.assert_allclose(after, np.roll(before, -shift), rtol=1e-6)


@given(st.integers(0, 10**6))
def test_scan_moves_and_turns_with_the_world(seed):
    rng = np.random.default_rng(seed)
    polygons = scene(rng)
    x, y, yaw = rng.uniform(-5, 5, 3)
    c, s = math.cos(yaw), math.sin(yaw)
    moved = [p @ np.array([[c, s], [-s, c]]) + (x, y) for p in polygons]
    pose = (c * 1 + s * 2 + x, s * 1 - c * 2 + y, 0.4 + yaw)
    np.testing.assert_allclose(
        cast_rays(*outlines_to_segments(moved), pose, 90),
        cast_rays(*outlines_to_segments(polygons), [1.0, -2.0, 0.4], 90),
        rtol=1e-6,
    )


@given(st.integers(0, 10**6))
def test_one_obstacle_more_never_lengthens_a_ray(seed):
    rng = np.random.default_rng(seed)
    polygons = scene(rng)
    fewer = cast_rays(*outlines_to_segments(polygons[1:]), [1, -2, 0], 90)
    more = cast_rays(*outlines_to_segments(polygons), [1, -2, 0], 90)
    assert np.all(more <= fewer)


def test_nearer_obstacle_hides_the_farther():
    sides = outlines_to_segments(
        [rectangle(3, -2, 4, 2), rectangle(1, -0.2, 2, 0.2)]
    )
    scan = cast_rays(*sides, [0, 0, 0], 360)
    assert scan[180] == pytest.approx(1.0)
    assert scan[180 + 15] == pytest.approx(3 / math.cos(math.radians(15)))


def test_obstacle_across_the_seam_behind_is_seen_on_both_sides():
    scan = cast_rays(
        *outlines_to_segments([rectangle(-3, -1, -2, 1)]), [0, 0, 0], 72
    )
    # 1 m in 2 m: 26.6 degrees, five rays of 5 degrees to each side.
    seen = np.flatnonzero(np.isfinite(scan))
    np.testing.assert_array_equal(seen, [0, 1, 2, 3, 4, 5, 67, 68, 69, 70, 71])


def test_nothing_is_seen_where_there_is_nothing():
    assert np.all(np.isinf(cast_rays(NOTHING, NOTHING, [0, 0, 0], 36)))


def test_sensor_within_an_obstacle_sees_through_its_back():
    sides = outlines_to_segments([rectangle(-1, -1, 1, 1)])
    assert np.all(np.isinf(cast_rays(*sides, [0.2, 0.1, 0.0], 36)))


def test_rays_along_a_wall_do_not_meet_its_face():
    # The sensor is in line with the lower face: the end face is met.
    scan = cast_rays(
        *outlines_to_segments([rectangle(1, 0, 3, 1)]), [0, 0, 0], 360
    )
    assert scan[181] == pytest.approx(1 / math.cos(math.radians(1)))
    assert np.isinf(scan[179])
    assert not np.isnan(scan).any()


def test_no_ray_slips_through_a_corner_that_points_at_the_sensor():
    slipped = 0
    for k in range(360):
        angle = math.radians(k - 180)
        c, s = math.cos(angle), math.sin(angle)
        diamond = np.array([(3, 0), (4, -1), (5, 0), (4, 1)])
        polygon = diamond @ np.array([[c, s], [-s, c]])
        scan = cast_rays(*outlines_to_segments([polygon]), [0, 0, 0], 360)
        slipped += np.isinf(scan[k])
    assert slipped == 0


# What the sensor reports


def test_reading_without_noise_is_the_distance_within_the_range():
    ranges = read_lidar(
        np.array([0.0, 3.0, 12.0, 12.5, np.inf]), np.full(5, 2.0), 12.0, 0.0
    )
    np.testing.assert_array_equal(ranges, [0, 3, 12, 12, 12])


def test_noise_is_added_in_proportion():
    ranges = read_lidar(
        np.array([5.0, 5.0, 5.0]), np.array([-1.0, 0.0, 2.5]), 12.0, 0.02
    )
    np.testing.assert_allclose(ranges, [4.98, 5.0, 5.05])


def test_noise_never_makes_a_return_of_what_is_beyond_the_range():
    ranges = read_lidar(
        np.array([12.001, np.inf]), np.array([-50.0, -50.0]), 12.0, 0.1
    )
    np.testing.assert_array_equal(ranges, [12, 12])


@given(
    st.lists(
        st.tuples(st.floats(0, allow_infinity=True), st.floats(-8, 8)),
        min_size=1,
    ),
    st.floats(0.1, 30),
    st.floats(0, 3),
)
def test_ranges_are_within_what_the_sensor_can_report(rays, range_max, noise):
    distance, gaussian = np.array(rays).T
    ranges = read_lidar(distance, gaussian, range_max, noise)
    assert np.all((ranges >= 0) & (ranges <= range_max))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rays", 7),
        ("rate", 0.0),
        ("rate", 101.0),
        ("range_max", 0.0),
        ("range_max", math.inf),
        ("noise", -0.01),
        ("noise", math.nan),
    ],
)
def test_parameters_out_of_range_are_refused_by_name(name, value):
    assert_refused(name, LidarParameters, **{name: value})


def test_eight_rays_are_enough():
    assert LidarParameters(rays=8).rays == 8
