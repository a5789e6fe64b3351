"""How the rules of avoidance change their state, and what they remember."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.driving.touch import Recovery
from drake_mobarm.homing.avoidance import has_given_up, update
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    ChosenGap,
    Follow,
    Leave,
    Meeting,
    Seek,
    Stay,
    initial_state,
)

PARAMETERS = AvoidanceParameters()
RANGE_MAX = 12.0
FREE = np.full(360, RANGE_MAX)
# Half a metre all around: nowhere is a gap, or a place to leave for.
CLOSED = np.full(360, 0.5)
PLACE = np.array([5.0, 4.0])


def near(x, y):
    """A place relative to PLACE."""
    return np.add(PLACE, (x, y))


def wall(first, last, distance=2.0):
    """A thing so far away from one direction to another [degrees]."""
    ranges = FREE.copy()
    ranges[180 + np.arange(first, last + 1)] = distance
    return ranges


AHEAD = wall(-40, 40)


PERIOD = 0.1


def step(state, ranges, at=(0.0, 0.0), bearing=0.0, parameters=PARAMETERS):
    """One update at a place relative to PLACE; the robot moves.

    It looks towards the target, which is 6 m away from PLACE.
    """
    target = PLACE + 6 * np.array([math.cos(bearing), math.sin(bearing)])
    pose = [*np.add(PLACE, at), bearing]
    return update(
        state, pose, target, ranges, (0.2, 0.0), RANGE_MAX, PERIOD, parameters
    )


def state_of(**known):
    return replace(initial_state(), **known)


# What is remembered


def test_a_new_target_is_taken_in_by_its_smoothing():
    state = step(initial_state(), FREE)
    np.testing.assert_allclose(state.target, [11, 4])
    state = update(
        state,
        [*PLACE, 0],
        [12, 2],
        FREE,
        (0.2, 0),
        RANGE_MAX,
        PERIOD,
        PARAMETERS,
    )
    np.testing.assert_allclose(state.target, [11.1, 3.8])


def test_places_half_a_metre_apart_are_remembered():
    state = initial_state()
    for x in (0.0, 0.49, 0.51, 0.9, 1.02, 0.0):
        state = step(state, FREE, at=(x, 0.0))
    np.testing.assert_allclose(
        state.visited - PLACE, [[0, 0], [0.51, 0], [1.02, 0]], atol=1e-12
    )


def test_the_last_two_hundred_places_are_remembered():
    old = np.arange(400.0).reshape(200, 2) + 50
    state = step(state_of(visited=old), FREE)
    np.testing.assert_array_equal(state.visited, [*old[1:], PLACE])


def test_time_without_a_gain_is_counted_until_new_ground():
    state, counts = initial_state(), []
    for x in (0.0, 0.0, 0.1, 0.1, -0.6, -0.6):
        state = step(state, AHEAD, at=(x, 0.0))
        counts.append(state.mode.idle)
    assert counts == pytest.approx([0, 0.1, 0.2, 0.3, 0, 0.1])


@pytest.mark.parametrize(("shorter", "gains"), [(0.05, False), (0.15, True)])
def test_a_way_shorter_by_a_tenth_of_a_metre_is_a_gain(shorter, gains):
    state = step(initial_state(), AHEAD)
    way = state.mode.shortest_way
    # 2 m less 0.315 m, and 0.3 m past the edge, then to the target: longer
    # than straight on.
    assert 6 < way < 8
    mode = replace(state.mode, shortest_way=way + shorter, idle=0.7)
    state = step(replace(state, mode=mode), AHEAD)
    if gains:
        assert state.mode.shortest_way == pytest.approx(way)
        assert state.mode.idle == 0
    else:
        assert state.mode.shortest_way == way + shorter
        assert state.mode.idle == pytest.approx(0.8)


def test_the_way_along_a_boundary_is_added_up():
    mode = Follow(1, PLACE, leg=10.0, followed=1.0)
    state = state_of(mode=mode, meeting=Meeting(np.zeros(2), 1))
    state = step(state, CLOSED, at=(0.3, 0.4))
    assert state.rule == "follow"
    assert state.mode.followed == pytest.approx(1.5)
    np.testing.assert_allclose(state.mode.position, near(0.3, 0.4))


@pytest.mark.parametrize("period", [0.02, 0.25, 1.0])
def test_times_are_sums_of_the_lidars_periods(period):
    state = initial_state()
    for _ in range(3):
        state = update(
            state,
            [*PLACE, 0],
            near(6, 0),
            AHEAD,
            (0.2, 0),
            RANGE_MAX,
            period,
            PARAMETERS,
        )
    times = [state.stay.time, state.no_new_ground, state.mode.idle]
    assert times == pytest.approx([2 * period] * 3)


# Giving up


def gives_up(places, parameters=PARAMETERS):
    """After which of the updates at places the robot gives up, or None."""
    state = initial_state()
    for number, x in enumerate(places):
        state = step(state, FREE, at=(x, 0.0), parameters=parameters)
        if has_given_up(state, parameters):
            return number
    return None


@pytest.mark.parametrize("time", [40.0, 2.0])
def test_a_robot_that_stands_gives_up_after_its_time(time):
    parameters = AvoidanceParameters(give_up_time=time)
    updates = round(time / PERIOD)
    assert gives_up(np.zeros(updates + 1), parameters) is None
    assert gives_up(np.zeros(updates + 9), parameters) == updates + 1


@pytest.mark.parametrize("speed", [0.25, 0.5, 1.0])
def test_a_robot_on_new_ground_never_gives_up(speed):
    # Longer than the time to give up, on places half a metre apart.
    way = speed * PERIOD * np.arange(900)
    assert gives_up(way) is None


def test_time_near_earlier_places_is_counted_and_new_places_make_up_for_it():
    state = replace(state_of(known_ground=2.0), visited=PLACE[None])
    counts = []
    # The last place is near to itself alone, 0.74 m from the one before.
    for x in (0.51, 1.02, 0.6, 1.02, 1.25, 1.53):
        state = step(state, FREE, at=(x, 0.0))
        counts.append(state.known_ground)
    assert counts == pytest.approx([1.0, 0.0, 0.1, 0.2, 0.2, 0.0])


def test_a_robot_that_returns_from_a_dead_end_does_not_give_up():
    # 15 m in, 15 m out at 0.5 m/s, and on beyond the start.
    way = 0.05 * np.concatenate([np.arange(300), np.arange(300, -600, -1)])
    assert gives_up(way) is None


def test_a_little_new_ground_now_and_then_does_not_keep_it_from_giving_up():
    # To and fro over 3 m at 0.5 m/s: 12 s for a round, and each round 0.6 m
    # farther, which makes up for 1 s or 2 s. After the first way, 6 s, each
    # round is at least 8 s near places visited earlier: five such rounds.
    turns = np.ravel([(3.0 + 0.6 * n, 0.0) for n in range(12)])
    places, here = [], 0.0
    for turn in turns:
        count = round(abs(turn - here) / 0.05)
        places += list(np.linspace(here, turn, count, endpoint=False))
        here = turn
    number = gives_up(places)
    assert number is not None
    assert 40 < number * PERIOD < 85


# Waiting


def test_with_half_of_the_rays_the_scan_is_trusted_and_with_less_not():
    ranges = FREE.copy()
    ranges[:180] = math.nan
    assert step(initial_state(), ranges).rule == "target"
    ranges[180] = math.nan
    assert step(initial_state(), ranges).rule == "wait"


def test_waiting_looks_straight_ahead_and_forgets_to_have_stood():
    state = state_of(
        recovery=Recovery(standing=0.4, backing=0.2),
        rule="gap",
        speed_limit=0.5,
    )
    waiting = step(state, np.full(360, math.nan), bearing=2.0)
    assert (waiting.rule, waiting.speed_limit) == ("wait", 0.0)
    assert waiting.recovery == Recovery(standing=0, backing=0.2)
    np.testing.assert_allclose(
        waiting.waypoint, near(math.cos(2.0), math.sin(2.0))
    )


# From state to state


def test_a_robot_boxed_in_tries_its_other_margin_and_forgets_touches():
    parameters = AvoidanceParameters(boxed_time=0.3)
    state = state_of(touched=np.array([[60.0, 60.0]]))
    tight = []
    for _ in range(9):
        state = step(state, FREE, parameters=parameters)
        tight.append(state.tight)
        assert state.touched.size == (0 if any(tight) else 2)
    # At first the fifth update at one place, then every fourth one.
    assert tight == [False] * 4 + [True] * 4 + [False]


def test_a_robot_boxed_in_along_a_boundary_seeks_anew():
    state = state_of(
        mode=Follow(1, PLACE, leg=10.0),
        meeting=Meeting(near(9, 9), 1),
        stay=Stay(PLACE, time=PARAMETERS.boxed_time),
    )
    state = step(state, AHEAD)
    assert (state.rule, state.mode.idle) == ("gap", 0)
    assert state.tight


def test_a_robot_that_moves_seven_tenths_of_a_metre_is_not_boxed_in():
    state = initial_state()
    for x, time in [(0, 0), (0.69, 0.1), (0, 0.2), (0.71, 0), (1.4, 0.1)]:
        state = step(state, FREE, at=(x, 0.0))
        assert state.stay.time == pytest.approx(time)


def test_a_free_target_ends_the_search_for_gaps():
    gap = ChosenGap(near(1, 1), 1)
    state = state_of(mode=Seek(gap=gap, shortest_way=7.0, idle=9))
    mode = step(state, FREE).mode
    assert (mode.gap, mode.shortest_way, mode.idle) == (None, math.inf, 0)


def test_a_boundary_is_left_for_a_place_nearer_to_the_target():
    state = state_of(
        mode=Follow(1, PLACE, leg=10.0), meeting=Meeting(near(9, 9), 1)
    )
    state = step(state, AHEAD)
    assert state.rule == "leave"
    np.testing.assert_array_equal(state.mode.exit, state.waypoint)
    assert np.linalg.norm(state.mode.exit - near(6, 0)) < 6 - PARAMETERS.gain


def test_an_exit_is_headed_for_while_its_way_is_free():
    exit_place = near(0, 2)
    state = step(state_of(mode=Leave(exit_place)), AHEAD)
    assert state.rule == "leave"
    np.testing.assert_array_equal(state.mode.exit, exit_place)
    np.testing.assert_allclose(state.waypoint, exit_place)


@pytest.mark.parametrize(
    ("way", "side_range", "rule"),
    [
        (0.31, 12.0, "leave"),
        (0.29, 12.0, "gap"),  # It is reached.
        # The disc of 0.315 m is met after 1 m; 0.3 m beyond may be noise.
        (1.29, 1.315, "leave"),
        (1.31, 1.315, "gap"),
    ],
)
def test_an_exit_that_is_reached_or_blocked_is_visited(way, side_range, rule):
    ranges = AHEAD.copy()
    ranges[270] = side_range
    exit_place = near(0, way)
    state = step(state_of(mode=Leave(exit_place)), ranges)
    assert state.rule == rule
    visited = [PLACE, exit_place] if rule == "gap" else [PLACE]
    np.testing.assert_array_equal(state.visited, visited)


def test_a_boundary_without_gaps_is_followed_on_its_right():
    state = step(initial_state(), CLOSED)
    assert state.rule == "follow"
    assert (state.mode.side, state.mode.leg) == (1, PARAMETERS.first_leg)
    np.testing.assert_array_equal(state.meeting.place, PLACE)
    assert state.meeting.repeats == 0


def test_a_boundary_met_again_at_one_place_is_followed_on_the_other_side():
    last = Meeting(near(0.5, 0), side=1, repeats=1)
    state = step(state_of(meeting=last), CLOSED)
    assert (state.mode.side, state.meeting.side) == (-1, -1)
    assert state.meeting.repeats == 2


@pytest.mark.parametrize("bearing", [0.0, 2.0, -2.0])
@pytest.mark.parametrize("side", [-1, 1])
def test_out_of_patience_the_boundary_is_followed_towards_the_best_gap(
    bearing, side
):
    # The gap is 40 degrees to the left of the target, or to the right.
    ranges = wall(-90, 40) if side == 1 else wall(-40, 90)
    patience = PARAMETERS.patience
    for idle, rule in [
        (patience - PERIOD, "gap"),
        (patience, "follow"),
    ]:
        mode = Seek(shortest_way=0.0, idle=idle)
        state = state_of(mode=mode, visited=PLACE[None])
        state = step(state, ranges, bearing=bearing)
        assert state.rule == rule
    assert state.mode.side == side


@pytest.mark.parametrize(("leg", "followed"), [(10.0, 3.1), (math.inf, 13.1)])
def test_once_round_the_robot_tries_its_other_margin(leg, followed):
    mode = Follow(1, PLACE, leg, followed)
    state = state_of(
        mode=mode,
        meeting=Meeting(near(0.4, 0), side=1),
        touched=np.array([[60.0, 60.0]]),
    )
    state = step(state, CLOSED)
    assert state.tight
    assert state.touched.size == 0
    # There it meets the boundary again.
    assert (state.rule, state.mode.side) == ("follow", -1)
    assert state.mode.followed == 0
