"""Highways: best paths by hand and against networkx, links, entries."""

import itertools
import math

import networkx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.navigation import highway as highway_module
from drake_mobarm.navigation.highway import (
    Highway,
    HighwayParameters,
    build_highway,
)
from drake_mobarm.navigation.highway_points import choose_random_points
from helpers.plans import plan, plan_of
from helpers.refusals import assert_refused

NONE = -9999  # As scipy marks that there is no point before.


def rng(seed=0):
    return np.random.default_rng(seed)


def square_with_a_diagonal():
    """Corners 0 to 3 of a square, all sides but that from 3 to 0, and 0-2."""
    return Highway.from_links(
        [(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1), (2, 1), (2, 3), (0, 2)]
    )


@st.composite
def highways(draw):
    """Up to 12 points in a square of 10 m, linked at random."""
    generator = rng(draw(st.integers(0, 2**32)))
    n = draw(st.integers(1, 12))
    pairs = [(i, j) for i in range(n) for j in range(i)]
    chosen = generator.random(len(pairs)) < draw(st.floats(0, 1))
    links = [pair for pair, taken in zip(pairs, chosen, strict=True) if taken]
    return Highway.from_links(generator.uniform(0, 10, (n, 2)), links)


def as_networkx(highway):
    graph = networkx.Graph()
    graph.add_nodes_from(range(len(highway.points)))
    for i, j in highway.links.tolist():
        apart = math.dist(highway.points[i], highway.points[j])
        graph.add_edge(i, j, weight=apart)
    return graph


# By hand


def test_best_path_table_of_a_square_with_a_diagonal():
    diagonal = math.sqrt(2)
    highway = square_with_a_diagonal()
    # From 0 to 3 the way is over the diagonal, since that side has no link.
    np.testing.assert_allclose(
        highway.length,
        [
            [0, 1, diagonal, 1 + diagonal],
            [1, 0, 1, 2],
            [diagonal, 1, 0, 1],
            [1 + diagonal, 2, 1, 0],
        ],
    )
    np.testing.assert_array_equal(
        highway.before,
        [[NONE, 0, 0, 2], [1, NONE, 1, 2], [2, 2, NONE, 2], [2, 2, 3, NONE]],
    )


def test_path_lists_the_points_from_the_first_to_the_last():
    highway = square_with_a_diagonal()
    assert highway.path(0, 3).tolist() == [0, 2, 3]
    assert highway.path(3, 1).tolist() == [3, 2, 1]
    assert highway.path(2, 2).tolist() == [2]


def test_points_without_a_way_between_them_have_no_path():
    highway = Highway.from_links([(0, 0), (1, 0), (5, 5)], [(0, 1)])
    assert np.isinf(highway.length[0, 2])
    assert highway.before[0, 2] == NONE
    assert highway.path(0, 2).size == 0
    assert highway.pieces == 2
    assert highway.piece_of[0] == highway.piece_of[1] != highway.piece_of[2]


def test_links_are_sorted_and_given_once():
    highway = Highway.from_links(np.eye(3, 2), [(2, 0), (0, 2), (1, 0)])
    assert highway.links.tolist() == [[0, 1], [0, 2]]


def test_points_in_one_place_are_no_way_apart():
    highway = Highway.from_links([(1, 1), (1, 1), (2, 1)], [(0, 1), (1, 2)])
    np.testing.assert_allclose(highway.length[0], [0, 0, 1])
    assert highway.pieces == 1


def test_highway_of_no_points_has_no_pieces():
    highway = Highway.from_links([], [])
    assert highway.pieces == 0
    assert highway.describe() == "points: 0, links: 0, pieces: 0"


def test_description_tells_where_the_pieces_are():
    highway = Highway.from_links([(5, 5.5), (0, 0.25), (1, 0)], [(1, 2)])
    assert highway.describe() == (
        "points: 3, links: 1, pieces: 2 (2 at (0.00, 0.25), 1 at (5.00, 5.50))"
    )


@pytest.mark.parametrize("link", [(0, 0), (0, 2), (-1, 1)])
def test_link_that_joins_no_two_points_is_refused(link):
    assert_refused("link", Highway.from_links, np.eye(2), [link])


def test_best_entry_is_where_approach_and_path_are_shortest_together():
    # A corridor 0 - 1 - 2 - 3 along x, 2 m between points. The robot stands
    # 3 m off point 0 and 0.5 m off point 1; point 3 is 4 m on from there.
    highway = Highway.from_links(
        [(0, 0), (2, 0), (4, 0), (6, 0), (9, 9)], [(0, 1), (1, 2), (2, 3)]
    )
    entries, total = highway.best_entries([0, 1], [3.0, 0.5], [3, 0, 4])
    assert entries[:2].tolist() == [1, 1]
    np.testing.assert_allclose(total, [4.5, 2.5, np.inf])


def test_best_entry_may_be_the_farther_one():
    highway = square_with_a_diagonal()
    entries, total = highway.best_entries([0, 2], [1.0, 1.5], [3])
    assert entries.tolist() == [2]
    np.testing.assert_allclose(total, [2.5])


def test_points_within_a_radius_are_found():
    highway = square_with_a_diagonal()
    assert highway.within((0, 0), 1.0).tolist() == [0, 1, 3]
    assert highway.within((3, 3), 1.0).size == 0


# Best paths of any highway


@given(highways())
def test_lengths_are_those_of_networkx(highway):
    expected = np.asarray(
        networkx.floyd_warshall_numpy(as_networkx(highway), weight="weight")
    )
    np.testing.assert_allclose(highway.length, expected)
    pieces = networkx.number_connected_components(as_networkx(highway))
    assert highway.pieces == pieces


@given(highways())
def test_paths_follow_links_and_are_as_long_as_the_table_says(highway):
    links = set(map(tuple, highway.links.tolist()))
    n = len(highway.points)
    for i in range(n):
        for j in range(n):
            path = highway.path(i, j).tolist()
            if np.isinf(highway.length[i, j]):
                assert path == []
                continue
            assert (path[0], path[-1]) == (i, j)
            steps = list(itertools.pairwise(path))
            assert all((min(s), max(s)) in links for s in steps)
            length = sum(
                math.dist(highway.points[a], highway.points[b])
                for a, b in steps
            )
            assert length == pytest.approx(highway.length[i, j])


@given(highways(), st.integers(0, 3))
def test_paths_are_the_same_without_the_whole_table(highway, kept):
    n = len(highway.points)
    rows = Highway(highway.points, highway.links)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(highway_module, "_WHOLE_TABLE", 0)
        patch.setattr(highway_module, "_KEPT", kept * n)
        for i in [*range(n), *range(n)]:
            length, before = rows.best_paths(i)
            np.testing.assert_array_equal(length, highway.length[i])
            np.testing.assert_array_equal(before, highway.before[i])


# Building


def test_points_of_an_empty_hall_all_see_each_other():
    highway = build_highway(
        plan_of(np.zeros((20, 20))),
        HighwayParameters(count=8),
        rng(),
        "random",
    )
    assert len(highway.points) == 8
    assert len(highway.links) == 28
    assert highway.pieces == 1


def test_random_points_are_those_chosen_by_count_and_distance():
    grid = plan_of(rng(1).random((12, 12)) < 0.1)
    parameters = HighwayParameters(
        count=9,
        min_distance=3.0,
        repair=False,
        smallest_region=0,
    )
    np.testing.assert_array_equal(
        build_highway(grid, parameters, rng(4), "random").points,
        choose_random_points(grid, 9, 3.0, rng(4)),
    )


@settings(max_examples=30)
@given(
    st.integers(0, 2**32),
    st.sampled_from(["adaptive", "random"]),
    st.booleans(),
)
def test_links_cross_no_obstacle_square(seed, points, repair):
    grid = plan_of(rng(seed).random((12, 12)) < 0.25, cell=0.25)
    parameters = HighwayParameters(count=20, repair=repair, smallest_region=0)
    highway = build_highway(grid, parameters, rng(seed), points)
    x, y = grid.centres()[grid.occupied].T
    half = grid.cell / 2
    obstacles = shapely.union_all(
        shapely.box(x - half, y - half, x + half, y + half)
    )
    lines = shapely.linestrings(highway.points[highway.links])
    assert not shapely.intersects(lines, obstacles).any()
    # All that are in sight are linked.
    linked = set(map(tuple, highway.links.tolist()))
    for i in range(len(highway.points)):
        for j in range(i):
            line = shapely.LineString(highway.points[[i, j]])
            assert ((j, i) in linked) != line.intersects(obstacles)


def test_parts_too_small_to_drive_in_have_no_points():
    # A closet of one square beside a hall of eight, of a quarter m^2 each.
    grid = plan("....#.", "....##", cell=0.5)
    for seed in range(10):
        highway = build_highway(grid, HighwayParameters(), rng(seed))
        assert highway.points[:, 0].max() < 2.0
        both = HighwayParameters(smallest_region=0.2)
        assert build_highway(grid, both, rng(seed)).pieces == 2


def test_floor_plan_without_room_is_refused():
    for grid in (plan("##", "##"), plan("#.", "##", cell=0.1)):
        with pytest.raises(ParameterError, match=r"no free region of 0\.5 m"):
            build_highway(grid, HighwayParameters(), rng())


def test_same_seed_gives_the_same_highway():
    grid = plan_of(rng(2).random((25, 25)) < 0.3)
    first, second = (
        build_highway(grid, HighwayParameters(), rng(6)) for _ in range(2)
    )
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.links, second.links)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("count", 0),
        ("min_distance", 0.0),
        ("blur", -1.0),
        ("repair", 2),
        ("smallest_region", -0.1),
    ],
)
def test_parameters_out_of_range_are_refused(field, value):
    assert_refused(field, HighwayParameters, **{field: value})
