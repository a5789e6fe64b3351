"""Free lengths of a disc between points, by hand and one by one."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.driving.gaps import (
    blocking_point,
    find_gaps,
    free_along,
    free_around,
    free_length,
    unit,
)


def test_free_length_is_that_of_a_disc() -> None:
    # A disc of 0.5 m meets a point 0.3 m aside 0.4 m before it.
    points = np.array([[2.0, 0.3], [1.0, 0.6], [-1.0, 0.0]])
    assert free_length(0.0, points, 0.5) == pytest.approx(1.6)


@settings(max_examples=30)
@given(st.integers(0, 1000))
def test_free_lengths_around_are_those_one_by_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-4, 4, (50, 2))
    around = free_around(0.3, 90, points, 0.33, 12.0)
    angles = 0.3 + 2 * np.pi * np.arange(90) / 90
    single = [min(free_length(float(a), points, 0.33), 12.0) for a in angles]
    np.testing.assert_allclose(around, single, atol=1e-3)


def test_free_along_finds_what_blocks_a_leg() -> None:
    points = np.array([[2.0, 0.1], [2.0, 1.4]])
    starts = np.array([[0.0, 0.0], [0.0, 3.0]])
    met = free_along(starts, np.array([4.0, 0.0]), points, 0.3)
    assert met[0] == pytest.approx(2.0, abs=0.01)
    assert 2.0 < met[1] < 3.0
    assert np.isinf(
        free_along(starts, np.array([4.0, 0.0]), points[:1] + 9, 0.3)
    ).all()


NOTHING = np.empty((0, 2))
EIGHTHS = np.radians(np.arange(0, 360, 45))


def points(*places):
    return np.array(places, dtype=float)


def test_unit_vectors_are_cosine_and_sine():
    h = math.sqrt(0.5)
    np.testing.assert_allclose(
        unit(np.radians([0.0, 90.0, 225.0])),
        [[1, 0], [0, 1], [-h, -h]],
        atol=1e-12,
    )


# One direction


@pytest.mark.parametrize(
    ("point", "length"),
    [
        ((2.0, 0.0), 1.5),
        # A disc of 0.5 m meets a point 0.3 m aside 0.4 m before it.
        ((2.0, 0.3), 1.6),
        ((2.0, -0.3), 1.6),
        ((2.0, 0.499), 2.0 - math.sqrt(0.25 - 0.499**2)),
        ((2.0, 0.501), math.inf),
        ((-2.0, 0.0), math.inf),
        ((-0.6, 0.0), math.inf),
    ],
)
def test_disc_meets_a_point_where_its_edge_comes_to_it(point, length):
    turn = 0.7
    c, s = math.cos(turn), math.sin(turn)
    turned = points(point) @ [[c, s], [-s, c]]
    assert free_length(turn, turned, 0.5) == pytest.approx(length)
    met = blocking_point(turn, turned, 0.5)
    if math.isinf(length):
        assert met is None
    else:
        np.testing.assert_array_equal(met, turned[0])


def test_of_two_points_the_disc_meets_that_which_blocks_first():
    # The farther one straight ahead is met after 1.6 m, the nearer one, at
    # the disc's rim, after 1.9 m less 0.1 m.
    ahead, aside = (2.1, 0.0), (1.9, math.sqrt(0.24))
    both = points(aside, ahead)
    assert free_length(0.0, both, 0.5) == pytest.approx(1.6)
    np.testing.assert_array_equal(blocking_point(0.0, both, 0.5), ahead)


def test_nothing_blocks_where_there_is_nothing():
    assert free_length(1.0, NOTHING, 0.3) == math.inf
    assert blocking_point(1.0, NOTHING, 0.3) is None
    np.testing.assert_array_equal(
        free_around(1.0, 8, NOTHING, 0.3, 5.0), np.full(8, 5.0)
    )


def test_point_within_the_disc_blocks_motion_towards_it_only():
    # It counts as 98 % of its distance away: 0.2 m becomes 0.196 m.
    near = points((0.2, 0.0))
    assert free_length(0.0, near, 0.3) == pytest.approx(0.004)
    # Across 0.2 sin(80 degrees) = 0.197 m.
    assert free_length(math.radians(80), near, 0.3) == math.inf
    assert free_length(math.radians(75), near, 0.3) < 0.05
    assert free_length(math.radians(100), near, 0.3) == math.inf


# All around


@given(
    st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), max_size=20),
    st.floats(-4, 4),
    st.integers(4, 60),
)
def test_free_lengths_around_are_those_of_each_direction(places, start, count):
    seen = np.array(places, dtype=float).reshape(-1, 2)
    seen = seen[np.hypot(*seen.T) > 0.05]
    around = free_around(start, count, seen, 0.3, 2.5)
    angles = start + 2 * math.pi * np.arange(count) / count
    # At a point's very rim a disc may meet it or not: it meets it with a
    # slightly larger radius, and does not with a slightly smaller one.
    for angle, length in zip(angles, around, strict=True):
        smaller, larger = (
            min(free_length(float(angle), seen, r), 2.5)
            for r in (0.3 - 1e-5, 0.3 + 1e-5)
        )
        assert larger - 0.02 <= length <= smaller + 0.02


def test_directions_around_begin_at_the_start_and_run_counter_clockwise():
    around = free_around(-math.pi, 8, points((0.0, 2.0)), 0.5, 4.0)
    # Straight behind, then by the right: the sixth-next is along +y.
    np.testing.assert_allclose(around, [4, 4, 4, 4, 4, 4, 1.5, 4], atol=1e-5)


def test_horizon_is_the_longest_free_length():
    assert free_around(0.0, 4, points((9.0, 0.0)), 0.5, 4.0)[0] == 4.0


# From places to one end


def test_disc_on_its_way_to_an_end_meets_what_is_within_its_radius():
    starts, end = points((0, 0), (4, 3), (8, 0)), np.array([4.0, 0.0])
    on_first_way = points((3.0, 0.29), (2.0, -0.29), (1.0, 0.31))
    np.testing.assert_allclose(
        free_along(starts, end, on_first_way, 0.3), [2.0, np.inf, np.inf]
    )
    # Past the end, within the disc that has arrived there: 0.25 m beyond it
    # for the first, 0.25 m to the left of the second, 3.75 m for the third.
    at_end = points((4.25, 0.0))
    np.testing.assert_allclose(
        free_along(starts, end, at_end, 0.3), [4.25, 3.0, 3.75]
    )
    behind_end = points((4.35, 0.0))
    np.testing.assert_allclose(
        free_along(starts, end, behind_end, 0.3), [np.inf, np.inf, 3.65]
    )
    assert np.isinf(free_along(starts, end, NOTHING, 0.3)).all()


@pytest.mark.parametrize(("gap", "met"), [(0.29, True), (0.31, False)])
@pytest.mark.parametrize("side", [-1, 1])
def test_disc_on_an_oblique_way_meets_what_is_beside_it(gap, met, side):
    # Along (0.6, 0.8), a point halfway, off along (-0.8, 0.6).
    place = points((1.5, 2.0)) + side * gap * points((-0.8, 0.6))
    found = free_along(points((0, 0)), np.array([3.0, 4.0]), place, 0.3)
    assert found[0] == pytest.approx(2.5 if met else math.inf)


def test_disc_meets_what_is_beside_the_very_beginning_of_its_way():
    end, beside = np.array([4.0, 0.0]), points((0.3, 0.2))
    assert free_along(points((0, 0)), end, beside, 0.3)[0] == 0.3


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ((0.3, 0.2), 0.3),
        ((0.3, 0.35), math.inf),
        ((0.75, 0.0), 0.75),
        ((0.9, 0.0), math.inf),
        ((-0.4, 0.0), math.inf),
    ],
)
def test_disc_on_a_short_way_meets_nothing_before_or_past_it(point, distance):
    found = free_along(points((0, 0)), np.array([0.5, 0]), points(point), 0.3)
    assert found[0] == pytest.approx(distance)


# Gaps


def test_gaps_pass_the_edges_of_a_thing_on_either_side():
    # A thing 2 m away from 90 to 135 degrees; 5 m are free elsewhere.
    free = np.array([5.0, 5, 2, 2, 5, 5, 5, 5])
    gaps = find_gaps(EIGHTHS, free, jump=0.4, past=0.3)
    np.testing.assert_allclose(np.degrees(gaps.angles), [180, 45])
    np.testing.assert_allclose(gaps.lengths, [2.3, 2.3])
    np.testing.assert_array_equal(gaps.sides, [1, -1])
    h = 2.3 * math.sqrt(0.5)
    np.testing.assert_allclose(gaps.points(), [[-2.3, 0], [h, h]], atol=1e-12)


def test_gaps_are_found_across_the_end_of_the_list():
    # The thing is at 315 and 0 degrees.
    free = np.array([2.0, 5, 5, 5, 5, 5, 5, 2])
    gaps = find_gaps(EIGHTHS, free, jump=0.4, past=0.3)
    np.testing.assert_allclose(np.degrees(gaps.angles), [45, 270])
    np.testing.assert_array_equal(gaps.sides, [1, -1])


def test_gap_lies_no_farther_than_is_free_in_it():
    free = np.array([2.0, 2, 2.5, 2.5, 2.5, 2.5, 2, 2])
    gaps = find_gaps(EIGHTHS, free, jump=0.4, past=0.6)
    np.testing.assert_allclose(np.degrees(gaps.angles), [90, 225])
    np.testing.assert_allclose(gaps.lengths, [2.5, 2.5])


@pytest.mark.parametrize(("step", "count"), [(0.39, 0), (0.41, 2)])
def test_only_a_jump_of_the_least_size_makes_a_gap(step, count):
    free = 3.0 + step * (np.arange(8) > 3)
    assert find_gaps(EIGHTHS, free, jump=0.4, past=0.3).angles.size == count
