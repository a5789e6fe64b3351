"""Highway points: (3.3) to (3.5) by hand, and replays of the choice."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from drake_mobarm.navigation.highway_points import (
    choose_adaptive_points,
    choose_random_points,
    free_centres,
    obstacle_density,
)
from helpers.plans import occupied_squares, plan, plan_of
from helpers.refusals import assert_refused


def rng(seed=0):
    return np.random.default_rng(seed)


def density_one_by_one(grid):
    """(3.3), counting squares from each one outwards."""
    ny, nx = grid.occupied.shape
    density = np.zeros((ny, nx))
    for row, column in np.argwhere(~grid.occupied):
        total = 0.0
        for line, at in (
            (grid.occupied[row], column),
            (grid.occupied[:, column], row),
        ):
            before = after = 0
            while at - before - 1 >= 0 and not line[at - before - 1]:
                before += 1
            while at + after + 1 < len(line) and not line[at + after + 1]:
                after += 1
            whole = before + after + 1
            total += (1 - abs(before - after) / whole) / whole
        density[row, column] = total
    return density


def assert_spaced(points, squares, spacing, start=1.0):
    """Each point keeps its square's spacing from those before it.

    All spacings shrink by 10 % whenever no square is left that keeps its own,
    and only then.
    """
    need = dict(zip(map(tuple, squares), spacing, strict=True))
    scale = start
    for i in range(1, len(points)):
        nearest = {
            square: min(math.dist(square, p) for p in points[:i])
            for square in need
        }
        while not any(
            nearest[s] > 0 and nearest[s] >= scale * need[s] - 1e-9
            for s in need
        ):
            scale *= 0.9
        chosen = tuple(points[i])
        assert nearest[chosen] > 0
        assert nearest[chosen] >= scale * need[chosen] - 1e-9
    return scale


# Density


def test_density_of_an_empty_room_of_three_by_three():
    # In the middle of a run of 3, 1/3; at its end |0 - 2|/3 is taken off,
    # (1/3)/3 = 1/9. Both directions are added.
    grid = plan("...", "...", "...")
    expected = np.array([[2, 4, 2], [4, 6, 4], [2, 4, 2]]) / 9
    np.testing.assert_allclose(obstacle_density(grid, 0), expected)


def test_density_of_a_corridor_one_square_wide():
    # Across it 1 everywhere; along it (1 - 4/5)/5, (1 - 2/5)/5, 1/5.
    density = obstacle_density(plan("#####", ".....", "#####"), 0)
    np.testing.assert_allclose(density[1], [1.04, 1.12, 1.2, 1.12, 1.04])
    assert not density[[0, 2]].any()


def test_obstacle_ends_the_runs_on_both_its_sides():
    # Two runs of 2 squares: |0 - 1|/2 is taken off, (1/2)/2; and 1 across.
    density = obstacle_density(plan("..#.."), 0)
    np.testing.assert_allclose(density, [[1.25, 1.25, 0, 1.25, 1.25]])


@given(occupied_squares())
def test_density_is_that_of_squares_counted_one_by_one(occupied):
    grid = plan_of(occupied)
    np.testing.assert_allclose(
        obstacle_density(grid, 0), density_one_by_one(grid)
    )


def test_blur_spreads_density_as_a_gaussian():
    # The single free square's density is 2, all around is occupied and 0: of
    # a blur by 1 square, (1 / (1 + 2 e^-0.5 + 2 e^-2 + ...))^2 of it stays.
    grid = plan("#" * 11, *["#" * 11] * 4, "#####.#####", *["#" * 11] * 5)
    kernel = sum(math.exp(-0.5 * k * k) for k in range(-4, 5))
    blurred = obstacle_density(grid, 1.0)
    assert blurred[5, 5] == pytest.approx(2 / kernel**2)
    assert np.count_nonzero(blurred) == 1


def test_blur_moves_density_to_the_squares_beside():
    sharp = obstacle_density(plan("..........", "....##....", ".........."), 0)
    grid = plan("..........", "....##....", "..........")
    blurred = obstacle_density(grid, 1.0)
    assert blurred.max() < sharp.max()
    assert not blurred[grid.occupied].any()
    assert (blurred[~grid.occupied] > 0).all()


# Random points


def test_random_points_are_centres_of_different_free_squares():
    grid = plan("..#", "#..", "...", cell=0.2, origin=(1.0, -2.0))
    points = choose_random_points(grid, 7, 5.0, rng())
    found = {tuple(p) for p in points.round(6)}
    free = {tuple(p) for p in free_centres(grid).round(6)}
    assert found == free
    assert len(points) == 7
    assert (1.0, -1.8) not in found


def test_second_point_is_farthest_where_the_distance_asked_for_is_large():
    # Distances in a corridor are whole metres: 100 m times 0.9^k falls below
    # one of them before it falls below the next.
    for seed in range(20):
        first, second = choose_random_points(
            plan("....."), 2, 100.0, rng(seed)
        )[:, 0]
        assert abs(second - first) == max(first, 4 - first)


@given(occupied_squares(), st.floats(0.1, 20), st.integers(0, 2**32))
def test_random_points_keep_their_distance_where_there_is_room(
    occupied, distance, seed
):
    grid = plan_of(occupied)
    squares = free_centres(grid)
    assume(len(squares))
    count = 1 + seed % len(squares)
    points = choose_random_points(grid, count, distance, rng(seed))
    assert len(points) == count
    spacing = np.full(len(squares), distance)
    assert_spaced(points.tolist(), squares.tolist(), spacing)


def test_distance_asked_for_holds_in_a_hall_with_room():
    points = choose_random_points(plan_of(np.zeros((30, 30))), 20, 4.0, rng())
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    assert apart[~np.eye(20, dtype=bool)].min() >= 4.0


def test_all_squares_are_as_likely():
    grid = plan("..#..")
    first = [
        choose_random_points(grid, 1, 1.0, g)[0, 0] for g in [rng()] * 4000
    ]
    share = [np.mean(np.array(first) == x) for x in (0, 1, 3, 4)]
    # Four standard deviations of 4000 draws.
    np.testing.assert_allclose(share, 0.25, atol=0.028)


def test_more_points_than_free_squares_are_refused():
    assert_refused("count", choose_random_points, plan(".#"), 2, 1.0, rng())


# Adaptive points


def test_number_of_adaptive_points_of_a_corridor():
    # 0.75 * (1.04 + 1.12 + 1.2 + 1.12 + 1.04) = 0.75 * 5.52 = 4.14.
    assert len(choose_adaptive_points(plan("....."), 0, rng())) == 4


def test_adaptive_points_are_at_least_one_and_at_most_the_free_squares():
    # Of an empty room of 3 by 3 (3.4) gives 0.75 * 30/9 = 2.5, of a single
    # square 0.75 * 2 = 1.5, which is rounded to 2.
    assert len(choose_adaptive_points(plan("#.#"), 0, rng())) == 1
    assert len(choose_adaptive_points(plan("#"), 0, rng())) == 0


def test_squares_are_drawn_with_their_density_as_probability():
    generator = rng(3)
    first = [
        choose_adaptive_points(plan("....."), 0, generator)[0, 0]
        for _ in range(4000)
    ]
    share = [np.mean(np.array(first) == x) for x in range(5)]
    expected = np.array([1.04, 1.12, 1.2, 1.12, 1.04]) / 5.52
    np.testing.assert_allclose(share, expected, atol=0.026)


@given(occupied_squares(), st.sampled_from([0.0, 0.8]), st.integers(0, 2**32))
def test_adaptive_points_keep_the_spacing_of_their_density(
    occupied, blur, seed
):
    grid = plan_of(occupied, cell=0.25)
    squares = free_centres(grid)
    assume(len(squares))
    density = obstacle_density(grid, blur)[~grid.occupied]
    points = choose_adaptive_points(grid, blur, rng(seed))
    # (3.5), one square at a time.
    spacing = [
        6 * 0.25 * len(points) / (len(squares) * value) for value in density
    ]
    assert_spaced(points.tolist(), squares.tolist(), spacing)


def test_same_seed_gives_the_same_points():
    grid = plan_of(rng(1).random((20, 20)) < 0.2)
    again = [choose_adaptive_points(grid, 1.0, rng(7)) for _ in range(2)]
    other = choose_adaptive_points(grid, 1.0, rng(8))
    np.testing.assert_array_equal(*again)
    assert not np.array_equal(again[0], other)
