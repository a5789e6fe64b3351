"""When a local minimum is noticed, which way leads out, and when it ends."""

import math

import numpy as np
import pytest

from drake_mobarm.navigation.escape import (
    NO_ESCAPE,
    EscapeParameters,
    EscapeState,
    escape_force,
    grown_attraction,
    update_escape,
)
from helpers.refusals import assert_refused

SHIPPED = EscapeParameters()
PULL, PUSH = np.array([1.0, 0.0]), np.array([-0.5, 0.1])


def step(
    state,
    position=(0.0, 0.0),
    *,
    pull=PULL,
    push=PUSH,
    distance=5.0,
    sees=False,
    room=(3.0, 2.0),
    period=0.1,
    parameters=SHIPPED,
):
    return update_escape(
        state,
        np.array(position, dtype=float),
        np.array(pull),
        np.array(push),
        distance,
        sees,
        room,
        period,
        parameters,
    )


def updates_until_escape(places, **others):
    """The number of the update that notices a minimum; None for none."""
    state = NO_ESCAPE
    for number, place in enumerate(places, start=1):
        state = step(state, place, **others)
        if state.side:
            return number
    return None


def test_a_robot_that_stands_for_twenty_updates_is_caught():
    assert updates_until_escape([(1.0, 2.0)] * 40) == 20


@pytest.mark.parametrize(("moved", "caught"), [(0.049, True), (0.051, False)])
def test_twenty_updates_that_move_less_than_five_centimetres_are_a_minimum(
    moved, caught
):
    # Nineteen steps lie between twenty places.
    x = moved / 19 * np.arange(40)
    places = np.column_stack([x, np.ones(40)])
    assert updates_until_escape(places) == (20 if caught else None)


def test_a_robot_that_drove_and_then_stands_is_caught_twenty_updates_later():
    places = [(0.1 * n, 0.0) for n in range(15)] + [(1.4, 0.0)] * 30
    # The fifteenth place is the first of twenty.
    assert updates_until_escape(places) == 34


@pytest.mark.parametrize(("share", "caught"), [(0.049, True), (0.051, False)])
def test_forces_that_balance_to_five_percent_are_a_minimum_at_once(
    share, caught
):
    pull = np.array([3.0, 4.0])
    state = step(NO_ESCAPE, pull=pull, push=-pull * (1 - share))
    assert bool(state.side) is caught


def test_what_does_not_repel_is_not_escaped_from():
    places = [(0.0, 0.0)] * 40
    assert updates_until_escape(places, push=(0.0, 0.0)) is None


@pytest.mark.parametrize(
    ("room", "side"),
    [((3.0, 2.0), 1), ((2.0, 3.0), -1), ((2.0, 2.0), 1), ((12.0, 0.3), 1)],
)
def test_the_escape_leads_to_the_side_on_which_there_is_more_room(room, side):
    state = step(NO_ESCAPE, push=(-1.0, 0.0), room=room)
    assert state.side == side


def caught(distance=5.0):
    """An escape that has just begun."""
    state = step(NO_ESCAPE, push=(-1.0, 0.0), distance=distance)
    assert state.side == 1
    assert state.goal_distance == distance
    assert state.time == 0
    return state


@pytest.mark.parametrize(
    ("distance", "ends"), [(4.89, True), (4.91, False), (6.0, False)]
)
def test_an_escape_ends_ten_centimetres_nearer_to_the_target(distance, ends):
    state = step(caught(), (0.5, 0.5), distance=distance)
    assert (state.side == 0) is ends


def test_an_escape_ends_in_sight_of_the_target():
    assert step(caught(), (0.5, 0.5), distance=6.0, sees=True).side == 0


@pytest.mark.parametrize("period", [0.1, 0.25])
def test_an_escape_ends_after_ten_seconds(period):
    state, count = caught(), 0
    while state.side:
        state = step(state, (0.5 * count, 0.0), period=period, push=(0.0, 1.0))
        count += 1
    # One update more than 10 s, give or take one by rounding.
    assert count * period == pytest.approx(10.0, abs=1.01 * period)
    assert count * period > 10.0 - 1e-9


def test_an_escape_keeps_its_side_whatever_is_seen_on_the_way():
    state = step(caught(), (0.5, 0.5), room=(0.3, 9.0), push=(0.3, 1.0))
    assert state.side == 1


def test_after_an_escape_twenty_updates_are_counted_anew():
    state = step(caught(), (0.5, 0.5), distance=4.0)
    assert len(state.places) == 1
    for _ in range(18):
        state = step(state, (0.5, 0.5), distance=4.0)
        assert state.side == 0
    assert step(state, (0.5, 0.5), distance=4.0).side != 0


def test_an_update_changes_no_state():
    before = caught()
    places = before.places.copy()
    step(before, (0.7, 0.7))
    np.testing.assert_array_equal(before.places, places)
    assert before.time == 0


# Forces


@pytest.mark.parametrize(
    ("side", "across"),
    # The obstacle is at +x and pushes to -x: with it to the left the robot
    # drives to -y, with it to the right to +y.
    [(1, (0.0, -1.0)), (-1, (0.0, 1.0))],
)
def test_the_escape_force_runs_along_the_obstacle(side, across):
    state = EscapeState(np.zeros((1, 2)), side, 5.0)
    force = escape_force(
        state, np.array([3.0, 4.0]), np.array([-0.2, 0.0]), SHIPPED
    )
    # 1.5 times the attraction, whatever the size of the repulsion.
    np.testing.assert_allclose(force, 7.5 * np.array(across), atol=1e-12)


@pytest.mark.parametrize("angle", [0.3, 2.0, -2.5])
def test_the_escape_force_is_square_to_the_repulsion(angle):
    push = np.array([math.cos(angle), math.sin(angle)])
    state = EscapeState(np.zeros((1, 2)), 1, 5.0)
    force = escape_force(state, np.array([0.8, 0.6]), push, SHIPPED)
    assert force @ push == pytest.approx(0, abs=1e-12)
    assert np.hypot(*force) == pytest.approx(1.5)


def test_without_an_escape_or_a_repulsion_there_is_no_escape_force():
    off = EscapeState(np.zeros((1, 2)), 0, 5.0)
    on = EscapeState(np.zeros((1, 2)), 1, 5.0)
    for state, push in ((off, PUSH), (on, np.zeros(2))):
        force = escape_force(state, PULL, push, SHIPPED)
        np.testing.assert_array_equal(force, [0, 0])


def test_near_the_target_the_attraction_grows_by_the_repulsion():
    # 5 towards the target, 13 of repulsion: 18, in the same direction.
    pull, push = np.array([3.0, -4.0]), np.array([-5.0, 12.0])
    grown = grown_attraction(pull, push, 0.99, SHIPPED)
    np.testing.assert_allclose(grown, 18 * np.array([0.6, -0.8]))


def test_far_from_the_target_the_attraction_stays():
    pull, push = np.array([3.0, -4.0]), np.array([-5.0, 12.0])
    stays = grown_attraction(pull, push, 1.01, SHIPPED)
    np.testing.assert_array_equal(stays, pull)


def test_on_the_target_nothing_attracts():
    none = grown_attraction(np.zeros(2), PUSH, 0.0, SHIPPED)
    np.testing.assert_array_equal(none, [0, 0])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("updates", 1),
        ("caught_move", 0.0),
        ("caught_force", -1.0),
        ("gain", 0.0),
        ("progress", math.nan),
        ("longest", 0.0),
        ("goal_distance", -1.0),
    ],
)
def test_a_parameter_out_of_range_is_named(name, value):
    assert_refused(name, EscapeParameters, **{name: value})
