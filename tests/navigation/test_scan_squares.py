"""Squares, sight and obstacles of scans made by hand."""

import math

import numpy as np
import pytest

from drake_mobarm.navigation.scan_squares import ScanSquares, cluster
from drake_mobarm.robot.shape import RADIUS

RANGE_MAX = 12.0


def scan_of(ranges, yaw=0.0):
    return ScanSquares.from_ranges(
        yaw, np.array(ranges, dtype=float), RANGE_MAX
    )


def by_place(centres):
    return sorted(map(tuple, np.round(centres, 9).tolist()))


# Four rays: behind, right, ahead, left.


def test_each_return_is_a_square_in_its_direction():
    found = by_place(scan_of([1.05, 2.05, 3.05, 4.05]).centres)
    assert found == [(-1.05, 0.0), (0.0, -2.05), (0.0, 4.05), (3.05, 0.0)]


def test_directions_are_those_of_the_world_and_not_of_the_robot():
    # The robot looks along +y: its left is -x.
    found = by_place(scan_of([12, 12, 3.05, 4.05], math.pi / 2).centres)
    assert found == [(-4.05, 0.0), (0.0, 3.05)]


@pytest.mark.parametrize("nothing", [12.0, 11.96, math.inf])
def test_what_meets_nothing_makes_no_square(nothing):
    found = scan_of([nothing, 2.05, nothing, nothing])
    assert by_place(found.centres) == [(0.0, -2.05)]


def test_a_scan_that_meets_nothing_has_no_squares():
    assert scan_of(np.full(360, 12.0)).centres.shape == (0, 2)


def test_readings_in_one_square_are_one_square_in_their_middle():
    # Ahead at 1.05 m, and a degree to the left: both in the square from x = 1
    # and y = 0; a degree to the right is in the one below.
    ranges = np.full(360, 12.0)
    ranges[179:182] = 1.05
    c, s = math.cos(math.radians(1)), math.sin(math.radians(1))
    expected = [
        (1.05 * (1 + c) / 2, 1.05 * s / 2),
        (1.05 * c, -1.05 * s),
    ]
    np.testing.assert_allclose(
        by_place(scan_of(ranges).centres), sorted(expected), atol=1e-9
    )


def test_a_missing_reading_is_that_between_its_neighbours():
    scan = scan_of([1.0, 2.0, math.nan, 4.0])
    np.testing.assert_allclose(scan.ranges, [1.0, 2.0, 3.0, 4.0])
    assert (3.0, 0.0) in by_place(scan.centres)


def test_the_first_and_the_last_ray_are_neighbours():
    scan = scan_of([math.nan, 2.0, 5.0, 4.0])
    assert scan.ranges[0] == pytest.approx(3.0)


@pytest.mark.parametrize("yaw", [0.0, 0.4, -3.0])
@pytest.mark.parametrize(
    ("degrees", "reading"),
    [
        # Eight rays, 45 degrees apart; the nearest to a direction counts.
        (-180, 1),
        (-158, 1),
        (-157, 2),
        (-90, 3),
        (-22, 5),
        (22, 5),
        (23, 6),
        (157, 8),
        (158, 1),
        (180, 1),
    ],
)
def test_the_reading_in_a_direction_is_that_of_the_ray_nearest_to_it(
    degrees, reading, yaw
):
    scan = scan_of([1, 2, 3, 4, 5, 6, 7, 8], yaw)
    angle = yaw + math.radians(degrees)
    way = 0.3 * np.array([[math.cos(angle), math.sin(angle)]])
    assert scan.readings(way).tolist() == [reading]


def test_a_place_is_in_sight_where_the_reading_is_longer_than_the_way():
    scan = scan_of([1.0, 2.0, 3.0, 4.0])
    ways = np.array(
        [(2.99, 0), (3.0, 0), (3.01, 0), (0, 3.9), (0, -2.1), (-0.9, 0.1)]
    )
    assert scan.sees(ways).tolist() == [True, False, False, True, False, True]


def test_beyond_the_lidars_range_nothing_is_in_sight():
    scan = scan_of(np.full(360, 12.0))
    assert scan.sees(np.array([(11.9, 0.0), (12.1, 0.0)])).tolist() == [
        True,
        False,
    ]


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_what_is_known_counts_as_seen_where_it_is_nearer(yaw):
    # Ahead at 2 m, which is nearer than 3.05 m; to the left at 6 m, behind
    # what is met at 4.05 m; behind at 5 m, where nothing is met.
    c, s = math.cos(yaw), math.sin(yaw)
    known = np.array([(2, 0), (0, 6), (-5, 0)]) @ np.array([[c, s], [-s, c]])
    ranges = np.array([12.0, 2.05, 3.05, 4.05])
    scan = ScanSquares.from_ranges(yaw, ranges, RANGE_MAX, known)
    np.testing.assert_allclose(scan.ranges, [5.0, 2.05, 2.0, 4.05])
    assert len(scan.centres) == 4
    # The scan itself stays as it was.
    np.testing.assert_array_equal(ranges, [12.0, 2.05, 3.05, 4.05])


def test_no_ray_slips_between_the_cells_of_what_is_known():
    # Two straight walls of cells of 5 cm, 1 m away, one of them slanting.
    along = np.arange(-40, 41)
    level = np.column_stack([np.full(81, 1.0), 0.05 * along])
    stairs = np.column_stack([-1.4 + 0.05 * along, -0.05 * along])
    known = np.vstack([level, stairs])
    scan = ScanSquares.from_ranges(
        0.3, np.full(720, RANGE_MAX), RANGE_MAX, known, 0.05
    )
    for degrees in np.arange(-44, 45, 0.2):
        angle = math.radians(degrees)
        ahead = np.array([[1.2, 1.2 * math.tan(angle)]])
        assert not scan.sees(ahead)[0]
        assert scan.sees(ahead * 0.9 / 1.2)[0]
    for share in np.arange(0.1, 0.9, 0.01):
        # From (-1.4, 0) to (0, -1.4), and a fifth farther.
        behind = 1.2 * np.array([[-1.4 * share, -1.4 * (1 - share)]])
        assert not scan.sees(behind)[0]
        assert scan.sees(behind * 0.9 / 1.2)[0]


# Obstacles


def groups(squares, **gap):
    """The sets of squares, by number, of one obstacle each."""
    numbers = cluster(np.array(squares, dtype=float), **gap)
    return {
        frozenset(np.flatnonzero(numbers == n).tolist()) for n in set(numbers)
    }


def test_squares_that_the_robot_fits_between_are_of_two_obstacles():
    # A gap of two radii is 0.54 m.
    assert pytest.approx(0.54) == 2 * RADIUS
    assert groups([(0, 0), (0.53, 0)]) == {frozenset({0, 1})}
    assert groups([(0, 0), (0.55, 0)]) == {frozenset({0}), frozenset({1})}


def test_a_chain_of_squares_is_one_obstacle_in_any_order():
    squares = [(0, 0), (2.0, 0), (0.5, 0), (9, 9), (1.0, 0.2), (1.5, 0)]
    assert groups(squares) == {frozenset({0, 1, 2, 4, 5}), frozenset({3})}


def test_with_a_smaller_gap_obstacles_are_more():
    squares = [(0, 0), (0.2, 0), (0.5, 0)]
    assert groups(squares, gap=0.25) == {frozenset({0, 1}), frozenset({2})}


def test_no_squares_are_no_obstacles():
    assert cluster(np.empty((0, 2))).shape == (0,)
