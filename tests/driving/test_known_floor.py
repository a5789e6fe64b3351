"""Ways over a plan's floor, beside those among the same points without one."""

import math

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from drake_mobarm.driving.known_floor import KnownFloor
from drake_mobarm.driving.route import Route, RouteParameters, find_route
from drake_mobarm.world.occupancy import OccupancyGrid
from helpers.rolling import room
from helpers.shapes import rectangle

PARAMETERS = RouteParameters()
NOTHING = np.empty((0, 2))
STEP = 0.1 * math.sqrt(2)
HOUSE = [
    *room(-3, -3, 5, 4),
    # A wall with a wide door and a narrow one, a table, a board.
    rectangle(1.0, -3.0, 1.2, -1.6),
    rectangle(1.0, -0.5, 1.2, 2.6),
    rectangle(1.0, 3.3, 1.2, 4.0),
    rectangle(-1.8, 0.4, -0.4, 1.3),
    rectangle(3.0, 0.0, 3.1, 2.4),
]


def grid_of(outlines, shift=0.0):
    """Cells of 5 cm, their centres at whole multiples of it, and a shift."""
    corners = np.vstack(outlines)
    low, high = corners.min(axis=0), corners.max(axis=0)
    count = np.rint((high - low) / 0.05).astype(int) + 1
    grid = OccupancyGrid(low + shift, 0.05, np.zeros(count[::-1], dtype=bool))
    centres = grid.centres()
    for outline in outlines:
        low, high = outline.min(axis=0) - 1e-9, outline.max(axis=0) + 1e-9
        inside = (centres >= low) & (centres <= high)
        grid.occupied[inside.all(axis=-1)] = True
    return grid


def points_of(grid):
    return grid.centres()[grid.occupied]


def on_plan(known, start, target, points=NOTHING, **others):
    return known.find_route(
        np.array(points, dtype=float),
        np.array(start, dtype=float),
        np.array(target, dtype=float),
        0.2,
        PARAMETERS,
        **{"tried": NOTHING} | others,
    )


def among_points(points, start, target):
    return find_route(
        points,
        np.array(start, dtype=float),
        np.array(target, dtype=float),
        0.2,
        PARAMETERS,
        tried=NOTHING,
    )


def apart(one, other):
    """The largest distance from a place of one way to the other [m]."""
    distances = cdist(one.places, other.places)
    return max(distances.min(axis=0).max(), distances.min(axis=1).max())


def length(route):
    return np.hypot(*np.diff(route.places, axis=0).T).sum()


PAIRS = [
    ((-2.4, -2.3), (4.4, 3.4)),
    ((-2.4, 2.1), (4.3, 1.2)),
    ((0.3, 3.2), (2.1, 0.7)),
    ((4.4, -2.4), (-2.5, 0.6)),
    ((2.2, 0.8), (3.8, 1.1)),
]


@pytest.mark.parametrize("shift", [0.0, 0.02])
@pytest.mark.parametrize(("start", "target"), PAIRS)
def test_a_way_over_the_plan_is_that_among_its_points(start, target, shift):
    grid = grid_of(HOUSE, shift)
    known = on_plan(KnownFloor(grid), start, target)
    plain = among_points(points_of(grid), start, target)
    # With a shift the two lattices' places, and sorted points, differ.
    tolerance = 1e-9 if shift == 0 else STEP
    assert apart(known, plain) <= tolerance
    assert length(known) == pytest.approx(
        length(plain), abs=1e-9 if shift == 0 else 2 * STEP
    )
    assert known.clearances.min() == pytest.approx(
        plain.clearances.min(), abs=1e-9 if shift == 0 else STEP
    )
    assert known.miss <= 0.2


@pytest.mark.parametrize(("start", "target"), PAIRS)
def test_points_added_to_the_plan_are_as_good_as_on_it(start, target):
    # The board and the table are seen, and not on the plan.
    known = KnownFloor(grid_of(HOUSE[:-2]))
    seen = points_of(grid_of(HOUSE))
    added = known.unknown(seen)
    way = on_plan(known, start, target, added)
    plain = among_points(seen, start, target)
    assert apart(way, plain) <= STEP
    assert length(way) == pytest.approx(length(plain), abs=2 * STEP)


def test_points_in_a_door_shut_it():
    known = KnownFloor(grid_of(HOUSE))
    start, target = (0.0, -1.0), (2.0, -1.0)
    way = on_plan(known, start, target)
    assert length(way) < 2.5
    door = np.column_stack([np.full(23, 1.1), np.linspace(-1.6, -0.5, 23)])
    round_about = on_plan(known, start, target, door)
    # By the door at y = 2.95: 4 m up and as much down again.
    assert length(round_about) > 8
    assert round_about.places[:, 1].max() > 2.8
    # The plan itself stays as it was.
    assert apart(on_plan(known, start, target), way) == 0


def test_points_off_the_plan_change_no_way():
    known = KnownFloor(grid_of(HOUSE))
    far = np.array([(40.0, 0.0), (-30.0, 2.0), (1.0, 90.0)])
    for start, target in PAIRS:
        way, same = (on_plan(known, start, target, p) for p in (NOTHING, far))
        assert apart(way, same) == 0


def test_where_all_doors_are_shut_the_way_ends_as_near_as_it_comes():
    known = KnownFloor(grid_of([*HOUSE, rectangle(1.0, -1.6, 1.2, -0.5)]))
    narrow = np.column_stack([np.full(15, 1.1), np.linspace(2.6, 3.3, 15)])
    way = on_plan(known, (0.0, -1.0), (1.7, -1.0), narrow)
    # 0.22 m and more before the wall's face at x = 1.
    assert way.places[-1, 0] == pytest.approx(0.7, abs=0.15)
    assert way.miss == pytest.approx(math.dist(way.places[-1], (1.7, -1.0)))


@pytest.mark.parametrize(
    ("start", "is_on_it"),
    [
        ((-2.9, 0.0), True),
        ((-3.1, 0.0), True),  # In the wall, 0.15 m from free floor.
        ((-3.3, 0.0), True),
        ((-3.5, 0.0), False),
        ((30.0, 0.0), False),
    ],
)
def test_a_start_far_from_the_plans_floor_has_no_way(start, is_on_it):
    way = on_plan(KnownFloor(grid_of(HOUSE)), start, (0.0, 0.0))
    assert (way is not None) == is_on_it


def test_a_plan_without_free_floor_has_no_ways_and_no_edges():
    grid = OccupancyGrid(np.zeros(2), 0.05, np.full((20, 20), True))
    known = KnownFloor(grid)
    assert on_plan(known, (0.5, 0.5), (0.7, 0.5)) is None
    assert known.near(np.array([0.5, 0.5])).shape == (0, 2)


def test_no_way_ends_near_a_place_that_was_tried():
    known = KnownFloor(grid_of(HOUSE))
    target = np.array([4.0, -2.0])
    way = on_plan(known, (-2.0, -2.0), target, tried=target[None])
    assert math.dist(way.places[-1], target) > 0.3


def test_the_robot_stays_on_a_way_that_costs_about_as_much():
    # Either way round a board of 2 m, whose upper end is a little nearer.
    walls = room(-3, -4, 7, 4)
    known = KnownFloor(grid_of([*walls, rectangle(2.0, -1.1, 2.1, 0.9)]))
    start, target = (0.0, 0.0), (4.0, 0.0)
    free = on_plan(known, start, target)
    assert free.places[:, 1].max() > 0.9
    below = np.array([(0.0, 0.0), (2.0, -1.8), (4.0, 0.0)])
    last = Route(below, np.full(3, 0.7), 0.0)
    stays = on_plan(known, start, target, last=last)
    np.testing.assert_allclose(stays.places, below, atol=STEP)


def test_a_way_until_now_that_left_the_plan_is_compared_without_a_fault():
    known = KnownFloor(grid_of(HOUSE))
    # Its first places have the same nearest place on the plan.
    off = np.array([(-3.0, y) for y in (-9.0, -8.0, -7.0)] + [(0.0, -1.0)])
    last = Route(off, np.zeros(4), 0.0)
    with np.errstate(all="raise"):
        way = on_plan(known, (-2.9, -2.9), (0.0, -1.0), last=last)
    assert way.miss <= 0.2


# What the plan shows


def test_near_the_robot_are_the_plans_edges_within_three_metres():
    # A wall of 3 cells along x; only its faces are edges.
    grid = OccupancyGrid(np.zeros(2), 0.05, np.zeros((81, 201), dtype=bool))
    grid.occupied[39:42] = True
    known = KnownFloor(grid)
    place = np.array([2.0, 1.0])
    near = known.near(place)
    assert set(np.round(near[:, 1], 9)) == {1.95, 2.05}
    for y in (1.95, 2.05):
        # Half a chord of the circle of 3 m, in steps of 5 cm, from x = 0 on.
        half = math.sqrt(9 - (y - 1.0) ** 2)
        expected = np.arange(0, 2.0 + half, 0.05)
        found = np.sort(near[np.isclose(near[:, 1], y), 0])
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_far_from_all_edges_none_are_near():
    grid = OccupancyGrid(np.zeros(2), 0.05, np.zeros((200, 200), dtype=bool))
    grid.occupied[0] = True
    known = KnownFloor(grid)
    assert known.near(np.array([5.0, 3.1])).shape == (0, 2)
    assert len(known.near(np.array([5.0, 2.9]))) > 0


def test_where_the_plan_shows_a_thing_at_the_robots_place_no_edges_are_near():
    # The robot stands there: the plan is wrong.
    known = KnownFloor(grid_of(HOUSE))
    assert known.near(np.array([-1.0, 0.8])).shape == (0, 2)
    assert len(known.near(np.array([-1.0, 0.2]))) > 0


def test_seen_points_nearer_than_fifteen_centimetres_to_the_plan_are_known():
    grid = OccupancyGrid(np.zeros(2), 0.05, np.zeros((60, 60), dtype=bool))
    grid.occupied[20] = True  # At y = 1.
    known = KnownFloor(grid)
    points = np.array([(1.0, y) for y in (0.5, 0.8, 0.9, 1.0, 1.1, 1.2)])
    np.testing.assert_allclose(
        known.unknown(points), [(1.0, 0.5), (1.0, 0.8), (1.0, 1.2)]
    )


def test_no_points_are_not_unknown():
    assert KnownFloor(grid_of(HOUSE)).unknown(NOTHING).shape == (0, 2)


@pytest.mark.parametrize(
    ("place", "room"),
    [((0.0, -2.0), 1.0), ((-1.0, 0.0), 0.4), ((-1.0, 0.9), 0.0)],
)
def test_the_room_about_a_place_is_that_to_the_nearest_thing_on_the_plan(
    place, room
):
    # To the wall at x = 1, to the table's side at y = 0.4, and inside it.
    known = KnownFloor(grid_of(HOUSE))
    assert known.room(np.array(place)) == pytest.approx(room)
