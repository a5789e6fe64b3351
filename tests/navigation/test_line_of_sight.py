"""Lines of sight on small plans by hand, and against shapely's squares."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.navigation.line_of_sight import LineOfSight
from helpers.plans import occupied_squares, plan, plan_of


def sees(grid, start, end):
    return bool(LineOfSight(grid).clear(start, end))


def touches_by_shapely(grid, starts, ends):
    """Whether segments meet a closed occupied square or leave the grid."""
    centres = grid.centres()
    half = grid.cell / 2
    x, y = centres[grid.occupied].T
    squares = shapely.box(x - half, y - half, x + half, y + half)
    lines = shapely.linestrings(np.stack([starts, ends], axis=1))
    low, high = centres[0, 0] - half, centres[-1, -1] + half
    floor = shapely.box(*low, *high)
    hit = np.zeros(len(lines), dtype=bool)
    if len(squares):
        hit = shapely.intersects(lines[:, None], squares).any(axis=1)
    return hit | ~shapely.contains_properly(floor, lines)


# By hand


def test_line_is_free_over_free_squares_and_blocked_by_one_between():
    grid = plan("...", ".#.", "...")
    assert sees(grid, (0, 0), (2, 0))
    assert sees(grid, (0, 0), (0, 2))
    assert not sees(grid, (0, 1), (2, 1))
    assert not sees(grid, (1, 0), (1, 2))


def test_no_line_passes_the_corner_between_two_diagonal_obstacle_squares():
    assert not sees(plan(".#", "#."), (1, 0), (0, 1))
    assert not sees(plan("#.", ".#"), (0, 0), (1, 1))


def test_diagonal_neighbours_see_each_other_only_over_two_free_squares():
    assert sees(plan("..", ".."), (0, 0), (1, 1))
    assert not sees(plan("..", ".#"), (0, 0), (1, 1))
    assert not sees(plan("#.", ".."), (0, 0), (1, 1))


def test_knights_move_crosses_the_two_squares_between():
    # From (0, 0) to (2, 1) the line is at y = 0.5 where x = 1: it crosses
    # (1, 0) and (1, 1), and touches no other.
    assert sees(plan("#..", "..#"), (0, 0), (2, 1))
    assert not sees(plan("##.", "..."), (0, 0), (2, 1))
    assert not sees(plan("...", ".#."), (0, 0), (2, 1))


def test_what_lies_outside_the_grid_is_not_seen():
    grid = plan("..", "..")
    assert sees(grid, (0, 0), (1.4, 0))
    assert not sees(grid, (0, 0), (1.6, 0))
    assert not sees(grid, (0, 0), (np.nan, 0))
    assert not sees(grid, (0, 0), (np.inf, 0))


def test_line_along_a_side_of_an_occupied_square_touches_it():
    grid = plan("...", ".#.", "...")
    assert not sees(grid, (0, 1.5), (2, 1.5))
    assert not sees(grid, (1.5, 0), (1.5, 2))
    assert sees(grid, (0, 1.51), (2, 1.51))
    assert sees(grid, (1.51, 0), (1.51, 2))


def test_place_sees_itself_unless_it_is_occupied():
    grid = plan(".#")
    assert sees(grid, (0, 0), (0, 0))
    assert not sees(grid, (1, 0), (1, 0))


def test_places_are_in_metres_from_the_origin():
    grid = plan("...", ".#.", "...", cell=0.2, origin=(-3.0, 7.0))
    assert sees(grid, (-3.0, 7.0), (-2.6, 7.0))
    assert not sees(grid, (-3.0, 7.2), (-2.6, 7.2))


def test_links_are_the_pairs_in_sight_in_rising_order():
    # The pillar stands between 0 and 1, and between 2 and 3; the corners of
    # the plan see each other along its sides.
    grid = plan("...", ".#.", "...")
    points = [(0, 0), (2, 2), (0, 2), (2, 0)]
    links = LineOfSight(grid).links(points)
    assert links.tolist() == [[0, 2], [0, 3], [1, 2], [1, 3]]


def test_links_with_others_pair_points_with_those_only():
    grid = plan("...", ".#.", "...")
    links = LineOfSight(grid).links([(0, 0), (2, 2)], [(0, 0), (2, 0), (2, 2)])
    assert links.tolist() == [[0, 0], [0, 1], [1, 1], [1, 2]]


def test_no_points_have_no_links():
    assert LineOfSight(plan("..")).links(np.empty((0, 2))).shape == (0, 2)


def test_segments_of_any_batch_shape_are_tested_one_by_one():
    sight = LineOfSight(plan("...", ".#.", "..."))
    ends = np.array([[[2, 0], [2, 1]], [[2, 2], [0, 2]]])
    assert sight.clear((0, 0), ends).tolist() == [[True, False], [False, True]]


# For all plans


@given(occupied_squares(), st.integers(0, 2**32))
def test_links_between_centres_are_those_that_touch_no_square(occupied, seed):
    grid = plan_of(occupied)
    rng = np.random.default_rng(seed)
    size = occupied.shape[::-1]
    starts, ends = rng.integers(0, size, (2, 40, 2)).astype(float)
    clear = LineOfSight(grid).clear(starts, ends)
    np.testing.assert_array_equal(
        clear, ~touches_by_shapely(grid, starts, ends)
    )


@given(occupied_squares(), st.integers(0, 2**32))
def test_segments_between_any_places_are_clear_of_every_square(occupied, seed):
    grid = plan_of(occupied)
    rng = np.random.default_rng(seed)
    low, high = -0.7, np.array(occupied.shape[::-1]) - 0.3
    starts, ends = rng.uniform(low, high, (2, 40, 2))
    # A coordinate each that is the same: lines along the squares.
    ends[:5, 0], ends[5:10, 1] = starts[:5, 0], starts[5:10, 1]
    clear = LineOfSight(grid).clear(starts, ends)
    np.testing.assert_array_equal(
        clear, ~touches_by_shapely(grid, starts, ends)
    )


@settings(max_examples=10)
@given(st.integers(0, 2**32))
def test_long_lines_over_large_plans_are_clear_of_every_square(seed):
    rng = np.random.default_rng(seed)
    grid = plan_of(rng.random((300, 200)) < 0.01)
    starts = rng.integers(0, (200, 300), (100, 2)).astype(float)
    ends = starts + rng.integers(-60, 60, (100, 2))
    clear = LineOfSight(grid).clear(starts, ends)
    np.testing.assert_array_equal(
        clear, ~touches_by_shapely(grid, starts, ends)
    )


@pytest.mark.parametrize("pairs", [1, 10, 1000])
def test_links_do_not_depend_on_how_many_pairs_are_held_at_once(
    pairs, monkeypatch
):
    rng = np.random.default_rng(5)
    grid = plan_of(rng.random((30, 30)) < 0.05)
    points = rng.integers(0, 30, (40, 2)).astype(float)
    sight = LineOfSight(grid)
    expected = sight.links(points)
    module = "drake_mobarm.navigation.line_of_sight"
    monkeypatch.setattr(f"{module}._MOST_PAIRS", pairs)
    monkeypatch.setattr(f"{module}._BATCH", pairs)
    np.testing.assert_array_equal(sight.links(points), expected)
