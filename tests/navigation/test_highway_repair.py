"""A repaired highway is as whole as the floor, and out of no square's sight."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.navigation.highway import HighwayParameters, build_highway
from drake_mobarm.navigation.highway_points import free_centres
from drake_mobarm.navigation.highway_repair import cover_floor, join_pieces
from drake_mobarm.navigation.line_of_sight import LineOfSight
from helpers.plans import free_regions, occupied_squares, plan, plan_of


def rng(seed=0):
    return np.random.default_rng(seed)


def touches(grid, starts, ends):
    """Whether segments touch an occupied square, by shapely."""
    x, y = grid.centres()[grid.occupied].T
    half = grid.cell / 2
    boxes = shapely.box(x - half, y - half, x + half, y + half)
    lines = shapely.linestrings(np.stack(np.broadcast_arrays(starts, ends), -2))
    return shapely.intersects(lines, shapely.union_all(boxes))


# By hand


def test_point_at_the_bend_joins_the_ends_of_an_l():
    # Both arms are one square wide: only the bend sees both ends.
    grid = plan(".##", ".##", "...")
    added = join_pieces(
        grid,
        LineOfSight(grid),
        np.array([(0.0, 2.0), (2.0, 0.0)]),
        np.array([0, 1]),
    )
    np.testing.assert_allclose(added, [(0, 0)])


def test_pieces_in_parts_of_the_floor_without_a_way_between_stay_apart():
    grid = plan("..#..")
    points = np.array([(0.0, 0.0), (4.0, 0.0)])
    added = join_pieces(grid, LineOfSight(grid), points, np.array([0, 1]))
    assert added.shape == (0, 2)


def test_highway_in_one_piece_gets_no_points():
    grid = plan("....")
    points = np.array([(0.0, 0.0), (3.0, 0.0)])
    added = join_pieces(grid, LineOfSight(grid), points, np.array([0, 0]))
    assert added.shape == (0, 2)


def test_way_round_the_end_of_a_wall_keeps_away_from_it():
    # The wall ends at y = 5.5. At (6, 7) one point sees both; the shortest way
    # turns at (5, 6) and (7, 6), each in touch with the wall's end.
    grid = plan(*["." * 13] * 6, *["......#......"] * 6)
    added = join_pieces(
        grid,
        LineOfSight(grid),
        np.array([(2.0, 0.0), (10.0, 0.0)]),
        np.array([0, 1]),
    )
    np.testing.assert_allclose(added, [(6, 7)])


def test_three_pieces_are_joined_by_the_two_shorter_ways():
    # Rooms along a corridor with a bend before each: from the middle one it
    # is as far to either side, and no way leads from end to end again.
    grid = plan(
        ".#######.#######.",
        ".................",
    )
    points = np.array([(0.0, 1.0), (8.0, 1.0), (16.0, 1.0)])
    added = join_pieces(grid, LineOfSight(grid), points, np.arange(3))
    np.testing.assert_allclose(
        sorted(map(tuple, added)), [(0, 0), (8, 0), (8, 0), (16, 0)]
    )


def test_corner_out_of_sight_gets_a_point():
    # From (0, 2) the arm to the right is hidden, all but its first square.
    grid = plan(".###", ".###", "....")
    added = cover_floor(grid, LineOfSight(grid), np.array([(0.0, 2.0)]))
    assert len(added) == 1
    assert added[0][1] == 0


def test_floor_that_is_in_sight_needs_no_points():
    grid = plan("...", "...")
    added = cover_floor(grid, LineOfSight(grid), np.array([(1.0, 1.0)]))
    assert added.shape == (0, 2)


# On any plan


@settings(max_examples=60)
@given(
    st.integers(0, 2**32),
    st.floats(0.05, 0.6),
    st.sampled_from(["adaptive", "random"]),
)
def test_repaired_highway_has_one_piece_a_region(seed, share, points):
    grid = plan_of(rng(seed).random((15, 17)) < share)
    parameters = HighwayParameters(count=3, smallest_region=0, min_distance=1.0)
    highway = build_highway(grid, parameters, rng(seed), points)
    regions = free_regions(grid)
    assert highway.pieces == len(regions)
    # And each piece is in one region: its links are no way out.
    for piece in range(highway.pieces):
        squares = {
            tuple(p) for p in highway.points[highway.piece_of == piece].tolist()
        }
        assert sum(bool(squares & region) for region in regions) == 1
        assert any(squares <= region for region in regions)


@settings(max_examples=30)
@given(st.integers(0, 2**32), st.floats(0.05, 0.6))
def test_every_free_square_sees_a_point_of_a_repaired_highway(seed, share):
    grid = plan_of(rng(seed).random((12, 11)) < share, cell=0.25)
    parameters = HighwayParameters(smallest_region=0)
    points = build_highway(grid, parameters, rng(seed)).points
    squares = free_centres(grid)
    assert not touches(grid, squares[:, None], points[None]).all(axis=1).any()


@settings(max_examples=30)
@given(occupied_squares(12), st.integers(0, 2**32))
def test_added_points_are_centres_of_free_squares(occupied, seed):
    grid = plan_of(occupied)
    if occupied.all():
        return
    parameters = HighwayParameters(smallest_region=0)
    points = build_highway(grid, parameters, rng(seed)).points
    free = {tuple(p) for p in free_centres(grid).tolist()}
    found = [tuple(p) for p in points.tolist()]
    assert set(found) <= free


@pytest.mark.parametrize("seed", range(3))
def test_maze_of_corridors_becomes_one_piece(seed):
    # A maze by a random spanning tree of 12 by 12 rooms, one square each.
    generator = rng(seed)
    occupied = np.ones((25, 25), dtype=bool)
    occupied[1::2, 1::2] = False
    seen, stack = {(0, 0)}, [(0, 0)]
    while stack:
        r, c = stack[-1]
        ways = [
            (r + dr, c + dc)
            for dr, dc in ((0, 1), (1, 0), (0, -1), (-1, 0))
            if 0 <= r + dr < 12 and 0 <= c + dc < 12
            if (r + dr, c + dc) not in seen
        ]
        if not ways:
            stack.pop()
            continue
        nr, nc = ways[generator.integers(len(ways))]
        occupied[r + nr + 1, c + nc + 1] = False
        seen.add((nr, nc))
        stack.append((nr, nc))
    grid = plan_of(occupied)
    parameters = HighwayParameters(count=5)
    alone = HighwayParameters(count=5, repair=False)
    assert build_highway(grid, alone, rng(seed), "random").pieces > 1
    assert build_highway(grid, parameters, rng(seed), "random").pieces == 1
