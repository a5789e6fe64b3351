"""Offline plans: steps and stopping rules by hand, and a trap."""

import math

import numpy as np
import pytest

from drake_mobarm.navigation.environments import ENVIRONMENTS
from drake_mobarm.navigation.highway import (
    Highway,
    HighwayParameters,
    build_highway,
)
from drake_mobarm.navigation.highway_force import HighwayForceParameters
from drake_mobarm.navigation.offline import (
    OFFLINE_POTENTIAL,
    MapField,
    OfflineParameters,
    plan,
)
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.world.occupancy import OccupancyGrid
from helpers.refusals import assert_refused

FLOOR = OccupancyGrid(np.array([-5.0, -5.0]), 0.1, np.zeros((101, 101), bool))
"""A free floor from -5 to 5 m."""


def towards(direction, strength):
    """The same force everywhere."""
    return lambda position: strength * np.array(direction, dtype=float)


def in_turn(*forces):
    """One force after the other, and round again; along x."""
    count = iter(range(10**6))
    return lambda position: np.array([forces[next(count) % len(forces)], 0.0])


# Steps


@pytest.mark.parametrize(
    ("strength", "step"),
    [(1e6, 0.05), (0.051, 0.05), (0.03, 0.03), (0.011, 0.011)],
)
def test_a_step_is_as_long_as_the_force_is_strong_up_to_its_limit(
    strength, step
):
    found = plan(towards([0.6, -0.8], strength), [1.0, 2.0], [9.0, 9.0])
    assert np.diff(found.path, axis=0) == pytest.approx(
        np.tile([0.6 * step, -0.8 * step], (2000, 1))
    )
    assert found.path[0] == pytest.approx([1.0, 2.0])


def test_a_step_is_never_shorter_than_the_shortest():
    parameters = OfflineParameters(weakest_force=1e-6, iterations=3)
    found = plan(towards([0, 1], 1e-5), [0, 0], [1, 1], parameters)
    assert found.path == pytest.approx(
        np.array([[0, 0], [0, 0.005], [0, 0.01], [0, 0.015]])
    )


def test_length_and_steps_are_those_of_the_path():
    parameters = OfflineParameters(iterations=4)
    found = plan(towards([1, 0], 0.02), [0, 0], [1, 1], parameters)
    assert found.steps == 4
    assert found.length == pytest.approx(0.08)


# Where it stops


def test_a_force_below_a_hundredth_stops_it():
    found = plan(towards([1, 0], 0.00999), [0.0, 0.0], [3.0, 4.0])
    assert found.steps == 0
    assert not found.success
    assert found.reason == "the force vanished, 5.00 m from the target"


def test_a_force_of_a_hundredth_does_not_stop_it():
    assert plan(towards([1, 0], 0.01), [0, 0], [9, 0]).steps == 2000


def test_two_reversals_do_not_stop_it_and_the_third_does():
    # Forth, back, forth, back: the third reversal comes before step 4.
    found = plan(in_turn(0.05, -0.05), [0.0, 0.0], [0.0, 2.0])
    assert found.steps == 3
    assert (
        found.reason == "the force kept turning round, 2.00 m from the target"
    )


def test_only_the_last_ten_changes_count():
    # Two reversals in any ten changes, for ever: at five steps' distance.
    five = [0.02] * 5 + [-0.02] * 5
    assert plan(in_turn(*five), [0, 0], [9, 0]).steps == 2000
    # At four steps' distance ten changes can hold three.
    four = [0.02] * 4 + [-0.02] * 4
    assert plan(in_turn(*four), [0, 0], [9, 0]).steps == 12


@pytest.mark.parametrize(
    ("turn", "steps"), [(math.pi - 0.31, 2000), (math.pi - 0.29, 3)]
)
def test_a_reversal_is_a_turn_of_more_than_half_a_turn_less_0_3_rad(
    turn, steps
):
    count = iter(range(10**6))

    def force(position):
        angle = turn * next(count)
        return 0.02 * np.array([math.cos(angle), math.sin(angle)])

    assert plan(force, [0, 0], [9, 0]).steps == steps


def test_it_stops_after_two_thousand_steps():
    found = plan(towards([1, 0], 1.0), [0.0, 0.0], [101.0, 0.0])
    assert found.steps == 2000
    assert found.reason == "2000 steps, 1.00 m from the target"


@pytest.mark.parametrize(("apart", "success"), [(0.299, True), (0.301, False)])
def test_it_succeeds_within_0_3_m_of_the_target(apart, success):
    found = plan(towards([1, 0], 0.0), [0.0, 0.0], [0.0, apart])
    assert found.success == success


# On maps


def test_on_a_free_floor_it_goes_straight_to_where_the_pull_vanishes():
    start, target = np.array([-3.0, -1.0]), np.array([1.0, 2.0])
    field = MapField(FLOOR, target, OFFLINE_POTENTIAL)
    found = plan(field.force, start, target)
    assert found.success
    # 5 m away: 0.05 m a step to 1 m, then 1/20 of the way; it vanishes, below
    # 0.01, from 0.2 m on: 80 steps, and 0.95^n < 0.2 from n = 32 on.
    assert found.steps in (112, 113)
    assert found.length == pytest.approx(5 - 0.95**32, abs=0.011)
    along = (found.path - start) @ [0.8, 0.6]
    across = (found.path - start) @ [-0.6, 0.8]
    assert across == pytest.approx(0, abs=1e-12)
    assert (np.diff(along) > 0).all()


@pytest.mark.parametrize(
    ("apart", "push"),
    [
        # 0.02 * 0.1^2 * (1/d - 1/0.4) / d^2.
        (0.2, 0.0002 * (5 - 2.5) / 0.04),
        (0.3, 0.0002 * (10 / 3 - 2.5) / 0.09),
        (0.41, 0.0),
    ],
)
def test_a_square_repels_by_its_area_up_to_its_influence(apart, push):
    occupied = FLOOR.occupied.copy()
    occupied[50, 60] = True  # At (1, 0).
    field = MapField(
        OccupancyGrid(FLOOR.origin, FLOOR.cell, occupied),
        [1 - apart, 3.0],
        OFFLINE_POTENTIAL,
    )
    force = field.force(np.array([1 - apart, 0.0]))
    np.testing.assert_allclose(force, [-push, 0.05], atol=1e-12)


def test_the_highway_does_not_pull_where_the_target_is_in_sight():
    rng = np.random.default_rng(0)
    highway = build_highway(FLOOR, HighwayParameters(), rng)
    place, target = np.array([-3.0, 1.0]), [2.0, 1.0]
    with_it = MapField(FLOOR, target, OFFLINE_POTENTIAL, highway)
    assert with_it.force(place) == pytest.approx([0.05, 0])


(TRAP,) = (e for e in ENVIRONMENTS if e.name == "U trap")


@pytest.fixture(scope="module")
def trap():
    """The trap's squares, of 0.15 m, and a highway on them."""
    grid = TRAP.grid(0.15, RADIUS)
    rng = np.random.default_rng(0)
    return grid, build_highway(grid, HighwayParameters(), rng)


@pytest.mark.parametrize("best_only", [False, True])
def test_a_highway_leads_out_of_a_trap_that_holds_without_it(trap, best_only):
    grid, highway = trap
    start, target = TRAP.starts[1], TRAP.targets[0]
    caught = plan(
        MapField(grid, target, OFFLINE_POTENTIAL).force, start, target
    )
    assert not caught.success
    # Inside the U: its back is at x = 2.6, its arms at y = 1.2 and 3.
    assert 1.5 < caught.path[-1, 0] < 2.6
    assert 1.2 < caught.path[-1, 1] < 3.0
    field = MapField(
        grid, target, OFFLINE_POTENTIAL, highway, best_only=best_only
    )
    led = plan(field.force, start, target)
    assert led.success
    # Round an arm's end, at x = 1.5, and a robot's radius off.
    assert led.path[:, 0].min() < 1.5


def test_a_weight_of_zero_is_no_highway(trap):
    grid, highway = trap
    place, target = np.array([2.0, 2.3]), TRAP.targets[0]
    without = MapField(grid, target, OFFLINE_POTENTIAL).force(place)
    off = MapField(
        grid,
        target,
        OFFLINE_POTENTIAL,
        highway,
        HighwayForceParameters(weight=0.0),
    )
    assert off.force(place) == pytest.approx(without)


def test_the_pull_of_the_highway_grows_with_its_weight(trap):
    grid, highway = trap
    place, target = np.array([2.0, 2.3]), TRAP.targets[0]

    def force(weight):
        pull = HighwayForceParameters(weight=weight)
        field = MapField(grid, target, OFFLINE_POTENTIAL, highway, pull)
        return field.force(place)

    assert np.hypot(*(force(10) - force(0))) > 0.1
    assert force(30) - force(0) == pytest.approx(3 * (force(10) - force(0)))


def twin_ways():
    """A box between start and target, and a highway past it on both sides."""
    occupied = np.zeros((41, 41), bool)
    occupied[15:26, 18:23] = True
    grid = OccupancyGrid(np.array([-2.0, -2.0]), 0.1, occupied)
    # Near points, corners and exits, the upper ones 2 cm nearer.
    points = np.array(
        [[-1, 1.18], [0, 1.18], [1, 1.18], [-1, -1.2], [0, -1.2], [1, -1.2]]
    )
    return grid, Highway.from_links(points, [[0, 1], [1, 2], [3, 4], [4, 5]])


def test_two_ways_cancel_where_all_paths_pull_and_not_where_the_best_does():
    grid, highway = twin_ways()
    place, target = np.array([-1.5, 0.0]), [1.5, 0.0]
    both = MapField(grid, target, OFFLINE_POTENTIAL, highway)
    best = MapField(grid, target, OFFLINE_POTENTIAL, highway, best_only=True)
    assert abs(both.force(place)[1]) < 0.1 * abs(best.force(place)[1])
    assert best.force(place)[1] > 0


def test_the_best_path_is_that_of_the_shortest_way_on_to_the_target():
    grid, _ = twin_ways()
    # The upper way ends 1.3 m before the target and is shorter as a whole.
    points = np.array(
        [[-1, 1.18], [1, 1.18], [-1, -1.9], [1, -1.9], [1.5, -0.3]]
    )
    highway = Highway.from_links(points, [[0, 1], [2, 3], [3, 4]])
    best = MapField(
        grid, [1.5, 0.0], OFFLINE_POTENTIAL, highway, best_only=True
    )
    assert best.force(np.array([-1.5, 0.0]))[1] > 0


# Parameters


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("shortest_step", 0.0),
        ("shortest_step", 0.06),
        ("longest_step", math.inf),
        ("weakest_force", -1.0),
        ("reversal", 0.0),
        ("reversals", -1),
        ("window", 0),
        ("iterations", 0),
        ("tolerance", math.nan),
    ],
)
def test_impossible_parameters_are_refused(field, value):
    named = "longest_step" if value == 0.06 else field
    assert_refused(named, OfflineParameters, **{field: value})
