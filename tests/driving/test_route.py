"""Ways over a lattice: their lengths and sides, worked out by hand."""

import math

import numpy as np
import pytest

from drake_mobarm.driving.route import (
    Route,
    RouteParameters,
    find_route,
    is_shut,
    place_ahead,
)
from drake_mobarm.driving.scan import Scan
from helpers.refusals import assert_refused

PARAMETERS = RouteParameters()
NOTHING = np.empty((0, 2))


def wall(start, end):
    """Points every 5 cm from one place to another."""
    count = round(math.dist(start, end) / 0.05) + 1
    return np.linspace(start, end, count)


def route_of(points, start, target, *, tolerance=0.2, tried=NOTHING, last=None):
    return find_route(
        np.vstack(points) if len(points) else NOTHING,
        np.array(start, dtype=float),
        np.array(target, dtype=float),
        tolerance,
        PARAMETERS,
        tried=tried,
        last=last,
    )


def way_length(route):
    return np.hypot(*np.diff(route.places, axis=0).T).sum()


@pytest.mark.parametrize("target", [(6, 0), (0, -6), (-4, 4), (103, 0.5)])
def test_in_the_open_the_way_is_straight(target):
    start = (0.0, 0.0) if target[0] < 50 else (98.0, 0.5)
    route = route_of([], start, target)
    straight = math.dist(start, target)
    assert way_length(route) == pytest.approx(straight, abs=0.3)
    assert np.all(np.isinf(route.clearances))
    assert route.miss <= 0.2


def test_the_way_goes_through_the_middle_of_a_door():
    # A wall at x = 2 with a door of 0.9 m about y = 1.
    points = [wall((2, -6), (2, 0.55)), wall((2, 1.45), (2, 6))]
    route = route_of(points, (0, 0), (4, 0))
    crossing = route.places[np.argmin(np.abs(route.places[:, 0] - 2))]
    assert crossing[1] == pytest.approx(1.0, abs=0.06)
    tightest = route.clearances.min()
    assert tightest == pytest.approx(0.45, abs=0.06)


@pytest.mark.parametrize(("width", "passes"), [(0.62, True), (0.36, False)])
def test_a_door_is_passed_unless_it_is_shut_to_a_disc(width, passes):
    points = [
        wall((2, -3), (2, -width / 2)),
        wall((2, width / 2), (2, 3)),
        wall((-3, -3), (5, -3)),
        wall((-3, 3), (5, 3)),
        wall((-3, -3), (-3, 3)),
        wall((5, -3), (5, 3)),
    ]
    route = route_of(points, (0, 0), (4, 0))
    assert (route.miss < 0.2) == passes
    if not passes:
        # As near as it comes, at the door's mouth.
        assert 1.7 < route.places[-1, 0] < 2.0


def test_of_two_ways_round_the_shorter_is_taken():
    # From (0, 0) to (4, 0) past y = 2 on top, or y = -3 below.
    points = [wall((2, -3), (2, 2))]
    route = route_of(points, (0, 0), (4, 0))
    assert route.places[:, 1].max() > 2
    assert route.places[:, 1].min() > -0.3
    # Two sides of (2, 2.5): comfortable clearance, in eight directions.
    assert 6.0 < way_length(route) < 8.0


def test_a_way_out_of_a_dead_end_first_leads_away():
    points = [
        wall((2, -1.5), (2, 1.5)),
        wall((-2, 1.5), (2, 1.5)),
        wall((-2, -1.5), (2, -1.5)),
    ]
    route = route_of(points, (1, 0), (5, 0))
    assert route.miss <= 0.2
    assert route.places[:, 0].min() < -2


def test_a_wide_way_is_preferred_to_a_tight_one_a_little_shorter():
    # Doors at y = 0.5, 0.6 m wide, and y = -1.5, 1.6 m wide.
    points = [
        wall((2, -9), (2, -2.3)),
        wall((2, -0.7), (2, 0.2)),
        wall((2, 0.8), (2, 9)),
    ]
    route = route_of(points, (0, 0), (4, 0))
    crossing = route.places[np.argmin(np.abs(route.places[:, 0] - 2))]
    assert crossing[1] == pytest.approx(-1.5, abs=0.7)


def test_a_robot_that_stands_too_near_to_a_thing_can_leave():
    points = [wall((-0.15, -1), (-0.15, 1))]
    route = route_of(points, (0, 0), (3, 0))
    assert route.miss <= 0.2


def test_no_way_ends_near_a_place_that_was_tried():
    tried = np.array([[4.0, 0.0]])
    route = route_of([], (0, 0), (4, 0), tolerance=0.5, tried=tried)
    end = route.places[-1]
    assert np.hypot(*(end - tried[0])) > 0.2
    assert np.hypot(*(end - [4, 0])) <= 0.5


def test_a_way_ends_before_a_wall_rather_than_go_round_it_for_little():
    # The target is 0.4 m behind a long wall; its estimate may be as much off.
    points = [wall((3, -20), (3, 20))]
    near = route_of(points, (0, 0), (3.4, 0), tolerance=0.8)
    assert near.places[-1, 0] < 3
    exact = route_of(points, (0, 0), (3.4, 0), tolerance=0.25)
    assert exact.places[-1, 0] > 3


def about(side):
    """A way round the wall of `fork` on a side."""
    return Route(
        places=np.array([[0.0, 0.0], [2.0, 2.7 * side], [4.0, 0.0]]),
        clearances=np.full(3, 0.7),
        miss=0.0,
    )


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(("longer", "stays"), [(0.3, True), (4.0, False)])
def test_the_robot_stays_on_its_way_unless_another_is_clearly_shorter(
    side, longer, stays
):
    # The wall reaches farther on the side of the way until now.
    low, high = sorted([-2.0 * side, (2.0 + longer) * side])
    points = [wall((2, low), (2, high))]
    last = route_of([*points, wall((2, -20 * side), (2, 0))], (0, 0), (4, 0))
    assert np.sign(last.places[:, 1].mean()) == side
    route = route_of(points, (0, 0), (4, 0), last=last)
    assert (np.sign(route.places[:, 1].mean()) == side) == stays


@pytest.mark.parametrize("side", [-1, 1])
def test_the_robot_does_not_stay_on_a_way_that_ends_at_a_place_tried(side):
    # Both ways are about as long, and the last one would be kept.
    low, high = sorted([-2.0 * side, 2.3 * side])
    points = [wall((2, low), (2, high))]
    last = route_of([*points, wall((2, -20 * side), (2, 0))], (0, 0), (4, 0))
    tried = last.places[-1:]
    route = route_of(
        points, (0, 0), (4, 0), tolerance=0.5, tried=tried, last=last
    )
    assert np.hypot(*(route.places[-1] - tried[0])) > 0.2


def test_the_robot_does_not_stay_on_a_way_that_ends_far_from_the_target():
    # 2 m from the target cost as much as 6 m of way: its own is no longer.
    points = [wall((2, -2), (2, 2.3))]
    last = route_of([*points, wall((2, -20), (2, 0))], (0, 0), (4, 0))
    route = route_of(points, (0, 0), (6, 0), tolerance=2.5, last=last)
    assert route.miss < 0.1


def test_a_way_along_the_last_one_follows_the_target():
    last = route_of([], (0, 0), (4, 0))
    route = route_of([], (0, 0), (4, 0.2), tolerance=0.6, last=last)
    assert route.miss < 0.06


def test_points_far_off_the_way_cost_nothing():
    far = [wall((0, 5), (4, 5))]
    route = route_of(far, (0, 0), (4, 0))
    assert way_length(route) == pytest.approx(4.0, abs=0.2)


# On the way


def scan_of(points):
    points = np.array(points, dtype=float)
    return Scan(np.zeros(2), 0.0, 12.0, points, points)


@pytest.mark.parametrize(("across", "shut"), [(0.1, True), (0.3, False)])
def test_a_thing_on_the_way_shuts_it(across, shut):
    route = route_of([], (0, 0), (6, 0))
    assert is_shut(route, scan_of([(3.0, across)]), PARAMETERS) == shut


def test_a_thing_that_is_passed_does_not_shut_the_way():
    route = route_of([], (-3, 0), (6, 0))
    assert not is_shut(route, scan_of([(-1.0, 0.0)]), PARAMETERS)


def test_a_thing_beside_the_robot_does_not_shut_the_way():
    # 0.18 m from the robot's centre, 0.33 m from the place 0.4 m ahead.
    route = route_of([], (0, 0), (6, 0))
    assert not is_shut(route, scan_of([(0.1, 0.15)]), PARAMETERS)


def test_the_place_ahead_lies_beyond_a_door_that_the_way_passes():
    # The door leaves 0.45 m, the way behind it more.
    points = np.vstack([wall((1, -3), (1, -0.45)), wall((1, 0.45), (1, 3))])
    route = route_of([points], (0, 0), (6, 0))
    place, _ = place_ahead(route, np.zeros(2), points, 2.0)
    np.testing.assert_allclose(place, [2.0, 0.0], atol=0.15)


def test_in_the_open_the_place_ahead_is_as_far_as_it_looks():
    route = route_of([], (0, 0), (6, 0))
    place, is_end = place_ahead(route, np.zeros(2), NOTHING, 2.0)
    np.testing.assert_allclose(place, [2.0, 0.0], atol=0.15)
    assert not is_end


def test_near_its_end_the_place_ahead_is_the_end():
    route = route_of([], (0, 0), (6, 0))
    place, is_end = place_ahead(route, np.array([5.0, 0.0]), NOTHING, 2.0)
    np.testing.assert_allclose(place, [1.0, 0.0], atol=0.15)
    assert is_end


def test_the_place_ahead_lies_before_a_corner_that_is_not_to_be_cut():
    points = wall((1.0, 0.3), (1.0, 6.0))
    route = route_of([points], (0.2, 3.0), (1.8, 3.0))
    assert route.places[:, 1].min() < 0.3
    start = np.array([0.2, 3.0])
    place, _ = place_ahead(route, start, points - start, 4.5)
    # Straight on it would pass through the wall at x = 1.
    assert place[0] + start[0] < 1.0


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("shut_clearance", 0.0),
        ("tight_clearance", 0.1),
        ("comfort_clearance", 0.2),
        ("comfort_cost", -1.0),
        ("switch", 1.5),
    ],
)
def test_a_parameter_out_of_range_is_named(name, value):
    assert_refused(name, RouteParameters, **{name: value})


def test_a_target_beyond_the_horizon_is_headed_for():
    route = route_of([], (3, 2), (1e5, 2))
    # 60 m and what the lattice adds.
    assert 60 < route.places[-1, 0] - 3 < 65
    np.testing.assert_allclose(route.places[:, 1], 2.0, atol=0.1)


def test_points_beyond_the_horizon_do_not_count():
    far = np.array([[1e5, -1e5], [-1e5, 3.0]])
    with_far, without = (
        route_of(points, (0, 0), (4, 1)) for points in ([far], [])
    )
    np.testing.assert_allclose(with_far.places, without.places)
