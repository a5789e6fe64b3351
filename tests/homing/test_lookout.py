"""When the robot turns back to a beacon out of view, and how."""

import math

import numpy as np
import pytest

from drake_mobarm.homing.lookout import (
    LookoutParameters,
    LookoutState,
    is_free_behind,
    update,
    waypoint,
)
from helpers.refusals import assert_refused

PARAMETERS = LookoutParameters(near=1.0, at=0.5, pause=3.0, stale=10.0)
PERIOD = 0.05
FAR, NEAR, AT = (5.0, 0.0), (0.8, 0.0), (0.2, 0.0)


def watch(
    seconds,
    target,
    heard,
    state=None,
    pose=(0.0, 0.0, 0.0),
    free=True,
):
    """The states after so long at one pose."""
    state = state or LookoutState()
    for _ in range(round(seconds / PERIOD)):
        state = update(state, pose, target, heard, free, PERIOD, PARAMETERS)
    return state


def after(mode, **fields):
    return LookoutState(mode=mode, **fields)


def test_while_the_beacon_is_heard_the_robot_drives_on():
    for target in (FAR, NEAR, AT):
        assert watch(60, target, heard=True).mode == "drive"


@pytest.mark.parametrize(
    ("target", "seconds", "mode"),
    [(AT, 0.25, "aside"), (NEAR, 3.0, "turn"), (FAR, 10.0, "turn")],
)
def test_it_looks_at_once_at_the_estimate_and_later_elsewhere(
    target, seconds, mode
):
    behind = (0.0, 0.0, math.pi)
    quiet = watch(seconds - 0.1, target, heard=False, pose=behind)
    assert quiet.mode == "drive"
    late = watch(0.2, target, heard=False, state=quiet, pose=behind)
    assert late.mode == mode


def test_it_looks_near_the_estimate_once_in_a_pause():
    state = watch(3.1, NEAR, heard=False)
    state = watch(0.4, NEAR, heard=True, state=state)
    assert state.mode == "drive"
    # Led away again: it does not stop until the pause is over.
    state = watch(2.5, NEAR, heard=False, state=state)
    assert state.mode == "drive"
    assert watch(0.6, NEAR, heard=False, state=state).mode == "turn"


def test_a_few_lost_readings_are_no_reason_to_look():
    assert watch(0.2, AT, heard=False).mode == "drive"


@pytest.mark.parametrize("mode", ["turn", "search"])
def test_a_beacon_that_is_heard_again_ends_the_look(mode):
    state = watch(0.25, NEAR, True, after(mode), pose=(0, 0, 2.0))
    assert state.mode == mode
    assert watch(0.1, NEAR, True, state, pose=(0, 0, 2.0)).mode == "drive"


def test_an_estimate_that_is_faced_in_silence_starts_a_search_once_round():
    state = watch(1.0, NEAR, heard=False, state=after("turn"))
    assert state.mode == "search"
    state = watch(12.0, NEAR, heard=False, state=state)
    assert state.mode == "search"
    assert watch(3.0, NEAR, heard=False, state=state).mode == "drive"


def test_an_estimate_that_is_not_yet_faced_is_turned_to():
    state = watch(2.0, NEAR, False, after("turn"), pose=(0, 0, 2.0))
    assert state.mode == "turn"


def test_at_the_estimate_the_robot_backs_off_along_another_line():
    state = watch(0.3, AT, heard=False)
    assert state.mode == "aside"
    # A radian to the left.
    x, y, speed = waypoint(state, (0, 0, 0), AT, PARAMETERS)
    assert math.atan2(y, x) == pytest.approx(1.0, abs=0.01)
    assert speed == 0.0
    state = watch(0.1, AT, False, state, pose=(0, 0, 1.0))
    assert state.mode == "back"
    *_, speed = waypoint(state, (0, 0, 1.0), AT, PARAMETERS)
    assert speed == -PARAMETERS.back_speed
    # Heard or not, it backs off until the estimate is half a metre away.
    state = watch(1.0, AT, True, state, pose=(-0.2, 0, 1.0))
    assert state.mode == "back"
    assert watch(0.05, AT, True, state, pose=(-0.31, 0, 1)).mode == "turn"


def test_where_something_is_behind_another_line_is_tried():
    state = watch(0.05, AT, heard=False, state=after("back"), free=False)
    assert state.mode == "aside"
    assert state.heading == pytest.approx(1.0)
    # Farther from the estimate turning to it is enough.
    state = watch(0.05, (0.4, 0), False, after("back"), free=False)
    assert state.mode == "turn"


def test_turning_aside_ends_even_where_the_robot_cannot_turn():
    state = after("aside", heading=1.0)
    assert watch(3.1, AT, heard=False, state=state).mode == "back"


def test_what_each_mode_drives_to():
    pose, target = (1.0, 2.0, 0.3), (4.0, 5.0)

    def at(mode):
        return waypoint(after(mode, heading=0.0), pose, target, PARAMETERS)

    assert at("turn") == (4.0, 5.0, 0.0)
    assert at("aside") == (2.0, 2.0, 0.0)
    assert at("back") == (1.0, 2.0, -0.2)
    assert math.isnan(at("search")[0])


def ranges(**rays):
    """A scan of 360 rays that sees nothing but what is given, by degrees.

    Ray 0 is straight behind.
    """
    scan = np.full(360, 12.0)
    for degree, distance in rays.items():
        scan[int(degree[1:])] = distance
    return scan


@pytest.mark.parametrize(
    ("scan", "free"),
    [
        (ranges(), True),
        # The disc of 0.30 m meets it after 0.14 m, or 0.16 m.
        (ranges(_0=0.44), False),
        (ranges(_0=0.46), True),
        (ranges(_180=0.31), True),  # In front.
        (ranges(_90=0.31), True),  # Beside.
        (np.full(360, math.nan), False),
    ],
)
def test_room_to_back_off_is_what_the_lidar_sees(scan, free):
    for yaw in (0.0, 2.0):
        assert is_free_behind((3.0, 4.0, yaw), scan, 12.0) is free


@pytest.mark.parametrize(
    "field", ["at", "near", "pause", "stale", "back_speed"]
)
def test_invalid_parameters_are_refused_by_name(field):
    assert_refused(field, LookoutParameters, **{field: 0.0})
