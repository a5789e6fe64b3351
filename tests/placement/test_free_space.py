"""Free space by hand, and against the clearance of sampled places."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.world.obstacles import clearance, outlines
from drake_mobarm.world.sdf import load_world
from helpers.refusals import assert_refused
from helpers.shapes import rectangle


def walls(x_low, y_low, x_high, y_high, thickness=0.1):
    """Four walls around a room of these inner sides."""
    t = thickness
    return [
        rectangle(x_low - t, y_low - t, x_low, y_high + t),
        rectangle(x_high, y_low - t, x_high + t, y_high + t),
        rectangle(x_low, y_low - t, x_high, y_low),
        rectangle(x_low, y_high, x_high, y_high + t),
    ]


def random_outlines(rng, count):
    """Convex outlines about (0, 0) to (4, 4), of 3 to 20 corners."""
    found = []
    for _ in range(count):
        points = rng.uniform(0, 4, 2) + rng.normal(
            scale=0.4, size=(rng.integers(3, 40), 2)
        )
        found.append(points[ConvexHull(points).vertices])
    return found


def along_sides(free, count=20):
    """Points on the edge of the free space, (count n, 2)."""
    start, end = free.sides()
    share = np.linspace(0, 1, count, endpoint=False)[:, None, None]
    return (start + share * (end - start)).reshape(-1, 2)


def two_rooms(door):
    """Two rooms of a 4 m by 2 m hall with a door at the height y = 1 m."""
    return [
        rectangle(1.9, 0, 2.1, 1 - door / 2),
        rectangle(1.9, 1 + door / 2, 2.1, 2),
    ]


HALL = ((0.0, 0.0), (4.0, 2.0))


# What is free


def test_empty_hall_is_free_to_its_bounds():
    free = FreeSpace.from_outlines([], 0.27, [1, 1], HALL)
    assert free.area == pytest.approx(8.0)
    np.testing.assert_array_equal(
        free.contains([[0.01, 0.01], [3.99, 1.99], [4.01, 1], [1, -0.01]]),
        [True, True, False, False],
    )


def test_box_takes_away_itself_its_sides_times_the_radius_and_the_corners():
    # A square of 1 m in a hall of 4 m by 3 m; its four quarter circles are
    # those of a polygon of 32 sides around the circle: 32 r^2 tan(pi/32).
    box = rectangle(1, 1, 2, 2)
    free = FreeSpace.from_outlines([box], 0.2, [0.5, 0.5], [[0, 0], [4, 3]])
    corners = 32 * 0.2**2 * math.tan(math.pi / 32)
    assert free.area == pytest.approx(12 - (1 + 4 * 0.2 + corners), abs=1e-7)


def test_wall_along_an_axis_is_free_up_to_just_the_radius():
    free = FreeSpace.from_outlines(walls(0, 0, 3, 2), 0.25, [1, 1])
    np.testing.assert_allclose(
        free.polygon.bounds, [0.25, 0.25, 2.75, 1.75], atol=2e-9
    )
    assert free.area == pytest.approx(2.5 * 1.5)


def test_door_wider_than_the_robot_leads_to_the_other_room():
    free = FreeSpace.from_outlines(two_rooms(0.5), 0.24, [1, 1], HALL)
    assert free.contains([3, 1])


def test_door_narrower_than_the_robot_closes_the_other_room_off():
    free = FreeSpace.from_outlines(two_rooms(0.5), 0.26, [1, 1], HALL)
    assert not free.contains([3, 1])
    # Up to the wall's offset, and into the opening less than to its middle.
    assert 1.64 * 2 < free.area < 2 * 2
    assert free.polygon.bounds[2] < 2


def test_outside_and_pockets_are_not_free_where_the_start_is_indoors():
    pocket = walls(2, 2, 3, 3)
    free = FreeSpace.from_outlines(
        [*walls(0, 0, 6, 6), *pocket], 0.2, [1, 1], [[-3, -3], [9, 9]]
    )
    np.testing.assert_array_equal(
        free.contains([[1, 1], [5, 5], [2.5, 2.5], [-2, 3]]),
        [True, True, False, False],
    )


def test_start_in_a_pocket_has_the_pocket_alone():
    outlines = [*walls(0, 0, 6, 6), *walls(2, 2, 3, 3)]
    free = FreeSpace.from_outlines(outlines, 0.2, [2.5, 2.5])
    assert free.area == pytest.approx(0.6**2)


def test_bounds_are_a_metre_around_outlines_and_start_unless_given():
    free = FreeSpace.from_outlines([rectangle(0, 0, 1, 1)], 0.1, [3, 0.5])
    assert free.polygon.bounds == pytest.approx((-1, -1, 4, 2))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.05, 1.0))
def test_nothing_within_the_radius_of_an_outline_is_free(seed, radius):
    rng = np.random.default_rng(seed)
    bodies = random_outlines(rng, rng.integers(1, 6))
    free = FreeSpace.from_outlines(bodies, radius, [9, 9], [[-9, -9], [10, 10]])
    # What is nearest is on the edge; that of the bounds is far away.
    room = clearance(bodies, along_sides(free))
    assert room.min() >= radius - 2e-9
    samples = rng.uniform(-2, 6, (2000, 2))
    near = clearance(bodies, samples) < radius - 2e-9
    assert not free.contains(samples[near]).any()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.05, 1.0))
def test_edge_is_at_most_half_a_percent_beyond_the_radius(seed, radius):
    rng = np.random.default_rng(seed)
    bodies = random_outlines(rng, rng.integers(1, 6))
    free = FreeSpace.from_outlines(bodies, radius, [9, 9], [[-9, -9], [10, 10]])
    edge = along_sides(free)
    inner = edge[np.abs(edge).max(axis=1) < 8.9]
    assert clearance(bodies, inner).max() <= 1.005 * radius


# The polygon


def test_contains_keeps_the_shape_of_its_points():
    free = FreeSpace.from_outlines([], 0.1, [1, 1], HALL)
    assert free.contains(np.ones((3, 5, 2))).shape == (3, 5)
    assert free.contains([1, 1]).shape == ()
    assert free.contains(np.empty((0, 2))).shape == (0,)


def test_sides_enclose_the_area_holes_the_other_way_round():
    boxes = [rectangle(1, 0.5, 1.5, 1), rectangle(2, 1, 3, 1.5)]
    free = FreeSpace.from_outlines(boxes, 0.1, [0.2, 0.2], HALL)
    (xa, ya), (xb, yb) = (points.T for points in free.sides())
    # Green's theorem; the hall's and the holes' orientations differ.
    assert abs(0.5 * np.sum(xa * yb - xb * ya)) == pytest.approx(free.area)
    ends = {tuple(point) for point in free.sides()[1]}
    assert {tuple(point) for point in free.sides()[0]} == ends


# Worlds


def test_free_space_of_a_house_is_indoors_and_clear_of_its_furniture():
    world, start = load_world("small_house"), [-8.0, -2.6]
    free = FreeSpace.of_world(world, start, 0.27, (0.01, 0.6))
    footprint = outlines(world.obstacles, 0.01, 0.6)
    inner = np.vstack(footprint)
    samples = np.random.default_rng(0).uniform(
        inner.min(axis=0) - 1, inner.max(axis=0) + 1, (3000, 2)
    )
    inside = samples[free.contains(samples)]
    assert clearance(footprint, inside).min() >= 0.27 - 2e-9
    assert free.contains(start)
    assert (inside.min(axis=0) > inner.min(axis=0)).all()
    assert (inside.max(axis=0) < inner.max(axis=0)).all()
    # Its walls are 18.6 m by 11 m inside; about half of it is furnished.
    assert 80 < free.area < 18.6 * 11


def test_robot_passes_under_what_is_higher_than_it():
    world, start = load_world("small_house"), [-8.0, -2.6]
    low = FreeSpace.of_world(world, start, 0.1, (0.01, 0.02))
    high = FreeSpace.of_world(world, start, 0.1, (0.01, 1.5))
    assert low.area > high.area + 1


# Bad input


@pytest.mark.parametrize("start", [[1.5, 1.5], [0.9, 1.5], [4.5, 1], [-1, 0]])
def test_start_that_is_not_free_is_refused_in_one_line(start):
    with pytest.raises(ParameterError, match=r"start is .*0\.2 m") as error:
        FreeSpace.from_outlines([rectangle(1, 1, 2, 2)], 0.2, start, HALL)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("radius", {"radius": -0.1}),
        ("radius", {"radius": math.nan}),
        ("start", {"start": [0, math.nan]}),
        ("start", {"start": [0, 0, 0]}),
        ("bounds", {"bounds": [[0, 0], [0, 1]]}),
        ("bounds", {"bounds": [[0, 0], [math.inf, 1]]}),
        ("bounds", {"bounds": [0, 0, 1, 1]}),
    ],
)
def test_value_that_makes_no_sense_is_refused_by_its_name(name, change):
    values = {"radius": 0.1, "start": [1, 1], "bounds": HALL} | change
    assert_refused(name, FreeSpace.from_outlines, [], **values)
