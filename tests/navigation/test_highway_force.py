"""Steps 1 to 4 of section 3.3.2.2 on a highway of four points, by hand."""

import math

import numpy as np
import pytest

from drake_mobarm.navigation.highway import Highway
from drake_mobarm.navigation.highway_force import (
    HighwayForceParameters,
    HighwayPath,
    choose_paths,
    exits,
    highway_force,
)
from drake_mobarm.navigation.planner import Forces
from helpers.refusals import assert_refused

# A rectangle 3 m by 4 m, without its side from 0 to 3.
#   3 (0, 4) -- 2 (3, 4)
#               |
#   0 (0, 0) -- 1 (3, 0)
HIGHWAY = Highway.from_links(
    [(0, 0), (3, 0), (3, 4), (0, 4)], [(0, 1), (1, 2), (2, 3)]
)
PULL = HighwayForceParameters(target_radius=2.0)
TARGET = np.array([3.0, 5.0])


@pytest.mark.parametrize(
    ("sees", "expected"),
    [
        # 1 m to point 2; 3.16 m to point 3; 5 m to point 1.
        ([True, True, True, True], [2]),
        ([False, False, True, False], [2]),
        ([False, True, False, True], [1, 3]),
        ([True, False, False, False], [0]),
        ([False] * 4, []),
    ],
)
def test_exits_are_near_the_target_and_see_it_or_else_all_that_see_it(
    sees, expected
):
    found = exits(HIGHWAY.points, TARGET, np.array(sees), PULL)
    assert found.tolist() == expected


def test_an_exit_may_be_as_far_off_as_the_radius():
    points = np.array([(0.0, 2.0), (0.0, 2.001), (0.0, -3.0)])
    found = exits(points, np.zeros(2), np.full(3, True), PULL)
    assert found.tolist() == [0]


def test_there_is_one_path_to_each_exit_and_it_is_the_shortest():
    # From (0, 1): 1 m to point 0, hypot(3, 1) to point 1.
    paths = choose_paths(
        HIGHWAY, np.array([0.0, 1.0]), np.array([0, 1]), np.array([0, 2, 3])
    )
    assert [path.points.tolist() for path in paths] == [
        [0],
        [1, 2],
        [1, 2, 3],
    ]
    # By point 0 it would be 1 + 3 + 4 m to point 2.
    to_1 = math.hypot(3, 1)
    assert [path.length for path in paths] == pytest.approx(
        [1.0, to_1 + 4, to_1 + 4 + 3]
    )


def test_an_exit_that_no_path_leads_to_has_none():
    parted = Highway.from_links(HIGHWAY.points, [(0, 1), (2, 3)])
    paths = choose_paths(
        parted, np.array([0.0, -1.0]), np.array([0]), np.array([1, 2])
    )
    assert [path.points.tolist() for path in paths] == [[0, 1]]


@pytest.mark.parametrize(("entries", "targets"), [([], [1]), ([1], [])])
def test_without_entry_or_exit_there_is_no_path(entries, targets):
    entries, targets = (np.array(x, dtype=int) for x in (entries, targets))
    assert choose_paths(HIGHWAY, np.zeros(2), entries, targets) == []


@pytest.mark.parametrize(
    ("length", "weight"),
    [(5.0, 2.0), (0.5, 20.0), (0.1, 100 / 3), (0.0, 100 / 3)],
)
def test_a_paths_weight_is_ten_over_its_length_from_thirty_centimetres_on(
    length, weight
):
    path = HighwayPath(np.array([0]), length)
    assert path.weight == pytest.approx(weight)


def test_each_visible_point_of_a_path_pulls_by_its_distance():
    # From (1, 1) points 0, 1 and 2 of a path of 20 m are in sight, 3 is not:
    # 10/20 * |(0, 2)| / (1 * 3) * ((-1, -1) + (2, -1) + (2, 3)).
    path = HighwayPath(np.array([0, 1, 2, 3]), 20.0)
    force = highway_force(
        HIGHWAY.points,
        [path],
        np.array([1.0, 1.0]),
        np.array([True, True, True, False]),
        np.array([0.0, 2.0]),
    )
    np.testing.assert_allclose(force, 0.5 * 2 / 3 * np.array([3.0, 1.0]))


def test_the_pull_of_several_paths_is_shared_by_their_number():
    # Path a, 10 m: point 1 at (2, -1). Path b, 4 m: 1 and 2, (2, -1), (2, 3).
    # With |F_att| = 5: 1 * 5/2 * (2, -1) + 2.5 * 5/(2 * 2) * (4, 2).
    paths = [
        HighwayPath(np.array([1]), 10.0),
        HighwayPath(np.array([1, 2]), 4.0),
    ]
    force = highway_force(
        HIGHWAY.points,
        paths,
        np.array([1.0, 1.0]),
        np.full(4, True),
        np.array([-3.0, 4.0]),
    )
    np.testing.assert_allclose(force, [5 + 12.5, -2.5 + 6.25])


def test_a_path_out_of_sight_does_not_pull():
    force = highway_force(
        HIGHWAY.points,
        [HighwayPath(np.array([2, 3]), 5.0)],
        np.zeros(2),
        np.array([True, True, False, False]),
        np.array([1.0, 0.0]),
    )
    np.testing.assert_array_equal(force, [0, 0])


def test_without_paths_nothing_pulls():
    force = highway_force(
        HIGHWAY.points, [], np.zeros(2), np.full(4, True), np.ones(2)
    )
    np.testing.assert_array_equal(force, [0, 0])


def test_the_total_force_is_the_sum_of_all_three():
    forces = Forces(
        np.array([1.0, 2.0]), np.array([-0.5, 4.0]), np.array([30.0, -10.0])
    )
    np.testing.assert_array_equal(forces.total, [30.5, -4.0])


@pytest.mark.parametrize(
    ("name", "value"), [("weight", -1.0), ("target_radius", 0.0)]
)
def test_a_parameter_out_of_range_is_named(name, value):
    assert_refused(name, HighwayForceParameters, **{name: value})
