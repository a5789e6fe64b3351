"""The arm driver's references and torques, by hand and in closed loop."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.station.arm_drive import (
    REFERENCE_SHARE,
    ArmDriveParameters,
    desired_acceleration,
    limit_reference,
    limit_torque,
)
from helpers.refusals import assert_refused

STEP = 0.01
SPEED, ACCELERATION = np.array([math.pi]), np.array([5.0])
ANGLE = st.floats(-3, 3)


def follow(reference, goals):
    """References after each goal (q, v), (n, 2), of one joint."""
    reference = np.array(reference, dtype=float).reshape(2, 1)
    passed = []
    for goal in goals:
        reference = limit_reference(
            reference,
            np.array(goal, dtype=float).reshape(2, 1),
            STEP,
            SPEED,
            ACCELERATION,
        )
        passed.append(reference[:, 0])
    return np.array(passed)


# Feedback


def test_desired_acceleration_is_worked_by_hand():
    u = desired_acceleration(
        np.array([0.1, -0.2]),
        np.array([-0.5, 0.0]),
        np.array([90.0, 90.0]),
        ArmDriveParameters(),
    )
    np.testing.assert_allclose(u, [20, -80])


def test_desired_acceleration_is_held_within_each_joints_limit():
    u = desired_acceleration(
        np.array([9.0, -9.0, 0.01]),
        np.zeros(3),
        np.array([5.0, 3.0, 5.0]),
        ArmDriveParameters(),
    )
    np.testing.assert_allclose(u, [5, -3, 4])


def test_gains_damp_an_error_critically():
    # e'' = -(400 e + 40 e'): e = e0 (1 + 20 t) exp(-20 t). The torque is
    # held for 1 ms here, so the step barely matters.
    error, rate, step = np.array([0.1]), np.array([0.0]), 1e-3
    for _ in range(200):
        (u,) = desired_acceleration(error, rate, [1e3], ArmDriveParameters())
        error, rate = error + step * rate - step**2 / 2 * u, rate - step * u
        assert error[0] > 0
    assert error[0] == pytest.approx(0.1 * 5 * math.exp(-4), rel=0.1)


@pytest.mark.parametrize("jump", [0.05, 1.0, 3.0])
def test_closed_loop_follows_a_jump_no_farther_behind_than_its_gain_says(jump):
    # A joint that inverse dynamics have made a double integrator.
    q, v = np.zeros(1), np.zeros(1)
    reference, goal = np.zeros((2, 1)), np.array([[jump], [0.0]])
    passed, lag = [], []
    for _ in range(350):
        (u,) = desired_acceleration(
            reference[0] - q,
            reference[1] - v,
            ACCELERATION,
            ArmDriveParameters(),
        )
        lag.append(abs(reference[0] - q).item())
        q, v = q + STEP * v + STEP**2 / 2 * u, v + STEP * u
        reference = limit_reference(
            reference, goal, STEP, SPEED, REFERENCE_SHARE * ACCELERATION
        )
        passed.append(q.item())
    assert passed[-1] == pytest.approx(jump, abs=1e-5)
    # Nothing is fed forward, so that it lags by 4 / 400 rad where the
    # reference speeds up, and by a step of delay at most half as much more;
    # braking, it passes the goal by as much.
    assert max(lag) <= 0.015
    assert max(passed) - jump <= 0.0125


# Reference


@given(
    ANGLE,
    st.floats(-math.pi, math.pi),
    st.lists(
        st.tuples(st.floats(-10, 10), st.floats(-10, 10)),
        min_size=1,
        max_size=30,
    ),
)
def test_reference_keeps_the_speed_and_acceleration_limits(q, v, goals):
    passed = follow([q, v], goals)
    speeds = np.concatenate([[v], passed[:, 1]])
    assert np.all(np.abs(speeds) <= math.pi + 1e-12)
    assert np.all(np.abs(np.diff(speeds)) <= 5 * STEP + 1e-12)


@given(ANGLE, st.lists(st.tuples(ANGLE, ANGLE), min_size=1, max_size=30))
def test_references_speed_is_that_of_its_position(q, goals):
    passed = follow([q, 0.0], goals)
    positions = np.concatenate([[q], passed[:, 0]])
    np.testing.assert_allclose(
        np.diff(positions) / STEP, passed[:, 1], atol=1e-9
    )


@settings(max_examples=30)
@given(ANGLE, ANGLE)
def test_jump_is_followed_to_the_goal_and_not_beyond(q, goal):
    # 6 rad at 3.14 rad/s, and 0.63 s more: 2.5 s. Rounding up to whole steps
    # passes the goal by an eighth of a step's change of speed.
    passed = follow([q, 0.0], [(goal, 0.0)] * 300)[:, 0]
    assert passed[-1] == pytest.approx(goal, abs=1e-6)
    beyond = (passed - goal) * np.sign(goal - q)
    assert beyond.max() <= 5 * STEP**2 / 8 * 1.01


@settings(max_examples=30)
@given(ANGLE, st.floats(-math.pi, math.pi), ANGLE)
def test_joint_in_motion_settles_on_the_goal(q, v, goal):
    passed = follow([q, v], [(goal, 0.0)] * 500)
    assert passed[-1, 0] == pytest.approx(goal, abs=1e-6)
    assert passed[-1, 1] == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(
    ("jump", "seconds"),
    [
        # Speeds up and brakes at once: 2 sqrt(jump / 5).
        (1.0, 2 * math.sqrt(1 / 5)),
        (0.05, 0.2),
        # Cruises: jump / pi + pi / 5.
        (3.0, 3 / math.pi + math.pi / 5),
    ],
)
def test_jump_takes_little_longer_than_the_limits_allow(jump, seconds):
    passed = follow([0.0, 0.0], [(jump, 0.0)] * 300)[:, 0]
    arrived = (np.flatnonzero(np.abs(passed - jump) < 1e-3)[0] + 1) * STEP
    # The last 1e-3 rad of braking would take 0.02 s.
    assert seconds - 0.03 <= arrived <= seconds + 3 * STEP


@settings(max_examples=30)
@given(st.floats(0.05, 2), st.floats(0.2, 1), st.floats(0, 2 * math.pi))
def test_feasible_motion_is_followed_closely(amplitude, share, phase):
    # A sine that takes a share of the limits, joined at its speed.
    frequency = share * min(
        0.95 * math.pi / amplitude, math.sqrt(0.9 * 5 / amplitude)
    )
    angle = frequency * STEP * np.arange(301) + phase
    q = amplitude * np.sin(angle)
    v = amplitude * frequency * np.cos(angle)
    goals = np.column_stack([q, v])
    passed = follow(goals[0], goals[:-1])
    # Within what the acceleration does in two steps.
    assert np.abs(passed[:, 0] - q[1:]).max() <= 2 * 5 * STEP**2
    assert np.abs(passed[:, 1] - v[1:]).max() <= 2 * 5 * STEP


def test_steady_motion_is_caught_up_with_and_then_followed_exactly():
    times = STEP * np.arange(400)
    goals = np.column_stack([1.0 + 0.5 * times, np.full(400, 0.5)])
    passed = follow([0.0, 0.0], goals)
    np.testing.assert_allclose(
        passed[-50:, 0], goals[-50:, 0] + 0.5 * STEP, atol=1e-9
    )
    np.testing.assert_allclose(passed[-50:, 1], 0.5, atol=1e-9)


def test_goal_that_is_kept_is_not_left():
    np.testing.assert_array_equal(
        follow([0.7, 0.0], [(0.7, 0.0)] * 5), [(0.7, 0.0)] * 5
    )


def test_joints_do_not_meddle_with_each_other():
    reference = np.array([[0.0, 1.0], [0.3, -0.2]])
    goal = np.array([[2.0, -1.0], [0.0, 0.1]])
    limits = np.array([1.0, 2.0]), np.array([5.0, 9.0])
    both = limit_reference(reference, goal, STEP, *limits)
    for i in range(2):
        alone = limit_reference(
            reference[:, [i]],
            goal[:, [i]],
            STEP,
            *(limit[[i]] for limit in limits),
        )
        np.testing.assert_array_equal(both[:, [i]], alone)


# Torque

STALL, NO_LOAD = [8.0], [4.0]


def limited(torque, speed):
    (given,) = limit_torque([torque], [speed], STALL, NO_LOAD)
    return given


@pytest.mark.parametrize(
    ("torque", "speed", "expected"),
    [
        (99.0, 0.0, 8.0),  # stall at rest
        (-99.0, 0.0, -8.0),
        (5.0, 0.0, 5.0),  # what is possible is not touched
        (99.0, 2.0, 4.0),  # half of it at half of the no-load speed
        (-99.0, -2.0, -4.0),
        (99.0, 4.0, 0.0),  # none at the no-load speed
        (-99.0, -4.0, 0.0),
        (99.0, 6.0, 0.0),  # nor beyond it
        (-99.0, 2.0, -8.0),  # full braking
        (99.0, -2.0, 8.0),
        (-99.0, 6.0, -8.0),
    ],
)
def test_torque_limit_is_worked_by_hand(torque, speed, expected):
    assert limited(torque, speed) == expected


@given(st.floats(-100, 100), st.floats(-20, 20))
def test_limited_torque_is_weaker_and_never_turned_round(torque, speed):
    got = limited(torque, speed)
    assert abs(got) <= min(abs(torque), 8.0)
    assert got * torque >= 0


@given(st.floats(-100, 100), st.floats(-20, 20))
def test_torque_limit_is_the_same_in_both_directions(torque, speed):
    assert limited(-torque, -speed) == -limited(torque, speed)


@given(st.floats(0, 100), st.floats(-20, 20), st.floats(0, 5))
def test_faster_motion_leaves_less_torque_to_drive_it(torque, speed, more):
    assert limited(torque, speed + more) <= limited(torque, speed)


# Parameters


def test_default_no_load_speeds_are_46_and_61_turns_a_minute():
    turns = np.array(ArmDriveParameters().no_load_speed) * 60 / (2 * math.pi)
    np.testing.assert_allclose(turns, [46] * 5 + [61], rtol=1e-3)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rate", 19.0),
        ("rate", 101.0),
        ("k_p", 0.0),
        ("k_d", math.inf),
        ("no_load_speed", [1.0] * 5),
        ("no_load_speed", [1.0] * 5 + [0.0]),
    ],
)
def test_parameters_out_of_range_are_refused_by_name(name, value):
    assert_refused(name, ArmDriveParameters, **{name: value})
