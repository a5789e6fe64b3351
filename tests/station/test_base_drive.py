"""The base driver's ramps and torques, by hand and in closed loop."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.robot.differential_drive import DifferentialDrive
from drake_mobarm.station.base_drive import (
    BaseDriveParameters,
    drive_torques,
    limit_velocity,
    limit_wheel_torques,
    ramp,
    yield_to,
)
from helpers.bases import HAND_WORKED
from helpers.refusals import assert_refused

PARAMETERS = BaseDriveParameters()
STEP = 1 / 50
RADIUS, HALF_TRACK = 0.0985, 0.2022
ANY = st.tuples(*[st.floats(allow_nan=True, allow_infinity=True)] * 2)
COMMAND = st.tuples(st.floats(-4, 4), st.floats(-8, 8))
REFERENCE = st.tuples(st.floats(-1, 1), st.floats(-2, 2))


def rim_speeds(velocity):
    """Of the wheels [rad/s], written out."""
    v, w = velocity
    return np.array([v - w * HALF_TRACK, v + w * HALF_TRACK]) / RADIUS


# Speed


@given(ANY)
def test_limited_velocity_never_exceeds_a_limit(command):
    v, w = limited = limit_velocity(command, PARAMETERS)
    assert abs(v) <= 1.0
    assert abs(w) <= 2.0
    assert np.abs(rim_speeds(limited)).max() <= 10.15 * (1 + 1e-12)


@given(COMMAND)
def test_velocity_within_the_limits_is_not_touched(command):
    v, w = command
    if abs(v) <= 1 and abs(w) <= 2 and np.abs(rim_speeds(command)).max() < 10:
        np.testing.assert_array_equal(
            limit_velocity(command, PARAMETERS), command
        )


@given(REFERENCE)
def test_scaling_for_the_wheels_keeps_the_curvature(command):
    limited = limit_velocity(command, PARAMETERS)
    (v, w), (v_limited, w_limited) = command, limited
    assert v * w_limited == pytest.approx(w * v_limited, abs=1e-12)
    assert np.sign(v_limited) == np.sign(v)
    assert np.sign(w_limited) == np.sign(w)


@given(REFERENCE)
def test_velocity_is_scaled_no_more_than_needed(command):
    limited = limit_velocity(command, PARAMETERS)
    fastest = np.abs(rim_speeds(limited)).max()
    assert np.array_equal(limited, command) or math.isclose(fastest, 10.15)


def test_full_speed_in_a_full_turn_is_scaled_as_worked_by_hand():
    # The outer rim would move 1 + 2 * 0.2022 = 1.4044 m/s; it may move
    # 10.15 * 0.0985 = 0.999775 m/s.
    share = 0.999775 / 1.4044
    np.testing.assert_allclose(
        limit_velocity([5.0, -9.0], PARAMETERS), [share, -2 * share]
    )


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_command_that_is_not_finite_is_a_halt(bad):
    for command in ([bad, 0.5], [0.5, bad], [bad, bad]):
        np.testing.assert_array_equal(
            limit_velocity(command, PARAMETERS), [0, 0]
        )


# Acceleration


@given(REFERENCE, REFERENCE, st.floats(0.01, 0.1))
def test_ramp_never_exceeds_an_acceleration_limit(reference, target, step):
    change = np.subtract(ramp(reference, target, step, PARAMETERS), reference)
    dv, dw = np.abs(change) / step
    assert dv <= 1.0 + 1e-9
    assert dw <= 3.0 + 1e-9
    assert np.abs(rim_speeds(change)).max() / step <= 10.0 + 1e-9


@given(REFERENCE, REFERENCE)
def test_ramp_moves_towards_the_target_and_not_past_it(reference, target):
    reached = ramp(reference, target, STEP, PARAMETERS)
    assert np.all(reached >= np.minimum(reference, target) - 1e-12)
    assert np.all(reached <= np.maximum(reference, target) + 1e-12)


@given(REFERENCE, REFERENCE)
def test_ramp_ends_at_the_target(reference, target):
    # The slowest: 2 m/s at 0.6 m/s^2 or more, 4 rad/s at 1.9 or more.
    for _ in range(250):
        reference = ramp(reference, target, STEP, PARAMETERS)
    np.testing.assert_allclose(reference, target, atol=1e-12)


def test_ramps_from_rest_are_worked_by_hand():
    # Straight: the wheels' 10 rad/s^2 are 0.985 m/s^2. In place: 3 rad/s^2.
    np.testing.assert_allclose(
        ramp([0, 0], [1, 0], STEP, PARAMETERS), [0.0197, 0]
    )
    np.testing.assert_allclose(
        ramp([0, 0], [0, -2], STEP, PARAMETERS), [0, -0.06]
    )
    # Both: a rim would gain 1 + 3 * 0.2022 = 1.6066 m/s^2.
    share = 0.985 / 1.6066
    np.testing.assert_allclose(
        ramp([0, 0], [1, 2], STEP, PARAMETERS), [0.02 * share, 0.06 * share]
    )


def test_ramp_stays_at_the_target():
    np.testing.assert_array_equal(
        ramp([0.3, -0.4], [0.3, -0.4], STEP, PARAMETERS), [0.3, -0.4]
    )


# Torque


@given(REFERENCE, REFERENCE, st.tuples(st.floats(-9, 9), st.floats(-99, 99)))
def test_torques_are_within_the_motors_limit(reference, following, measured):
    torques = drive_torques(reference, following, measured, STEP, PARAMETERS)
    assert np.all(np.abs(torques) <= 6.0)


def test_base_at_rest_that_shall_rest_gets_no_torque():
    np.testing.assert_array_equal(
        drive_torques([0, 0], [0, 0], [0, 0], STEP, PARAMETERS), [0, 0]
    )


def test_feedforward_and_feedback_are_worked_by_hand():
    parameters = BaseDriveParameters(base=HAND_WORKED, gain=[2.0, 4.0])
    # Wanted next: 0.01 m/s more in 0.02 s. 32 kg, 0.5 m/s^2, 0.1 m, a half.
    np.testing.assert_allclose(
        drive_torques([0, 0], [0.01, 0], [0, 0], 0.02, parameters), [0.8, 0.8]
    )
    # 0.25 m/s short at a gain of 2/s: the same.
    np.testing.assert_allclose(
        drive_torques([0.25, 0], [0.25, 0], [0, 0], 0.02, parameters),
        [0.8, 0.8],
    )
    # 0.5 rad/s short at a gain of 4/s: 2 rad/s^2 of 1.08 kg m^2.
    np.testing.assert_allclose(
        drive_torques([0, 0.5], [0, 0.5], [0, 0], 0.02, parameters),
        [-0.54, 0.54],
    )


def closed_loop(command, truth, seconds, start=(0.0, 0.0)):
    """Speeds at each update of a base that obeys (7.6), (7.7).

    They are integrated by Runge and Kutta's method, the torques held.
    """
    lever = truth.body_mass * truth.com_offset
    r, b, inertia_wheel = truth.wheel_radius, truth.track, truth.wheel_inertia
    mass = truth.mass + 2 * inertia_wheel / r**2
    inertia = truth.inertia + b**2 * inertia_wheel / (2 * r**2)

    def rate(state, torques):
        v, w = state
        left, right = torques
        return np.array(
            [
                ((left + right) / r + lever * w * w) / mass,
                ((right - left) * b / (2 * r) - lever * w * v) / inertia,
            ]
        )

    state, reference = np.array(start), np.array(start)
    target = limit_velocity(command, PARAMETERS)
    speeds = [state]
    for _ in range(round(seconds / STEP)):
        reference = yield_to(reference, state, PARAMETERS)
        following = ramp(reference, target, STEP, PARAMETERS)
        torques = drive_torques(reference, following, state, STEP, PARAMETERS)
        reference = following
        k1 = rate(state, torques)
        k2 = rate(state + STEP / 2 * k1, torques)
        k3 = rate(state + STEP / 2 * k2, torques)
        k4 = rate(state + STEP * k3, torques)
        state = state + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        speeds.append(state)
    return np.array(speeds), target


def overshoot(speeds, target):
    """How far beyond the target, from rest [m/s, rad/s]."""
    beyond = (speeds - target) * np.sign(target)
    return np.maximum(beyond, 0).max(axis=0)


@settings(max_examples=20)
@given(COMMAND)
def test_closed_loop_reaches_the_command_without_overshoot(command):
    speeds, target = closed_loop(command, DifferentialDrive(), 3.0)
    np.testing.assert_allclose(speeds[-1], target, atol=1e-3)
    assert np.all(overshoot(speeds, target) <= 0.01 * np.abs(target) + 2e-3)


@settings(max_examples=20)
@given(st.floats(0.7, 1.4), st.floats(0.7, 1.4))
def test_closed_loop_forgives_a_wrong_mass_and_inertia(mass, inertia):
    base = DifferentialDrive()
    truth = DifferentialDrive(
        mass=mass * base.mass, inertia=inertia * base.inertia
    )
    speeds, target = closed_loop([0.5, 1.0], truth, 3.0)
    np.testing.assert_allclose(speeds[-1], target, atol=5e-3)
    assert np.all(overshoot(speeds, target) <= 0.06 * np.abs(target))


def test_full_speed_is_reached_in_the_time_that_the_wheels_take():
    speeds, _ = closed_loop([1.0, 0.0], DifferentialDrive(), 1.5)
    # 0.999775 m/s at 0.985 m/s^2: 1.015 s.
    reached = np.flatnonzero(speeds[:, 0] > 0.99)[0] * STEP
    assert 0.99 <= reached <= 1.06


def test_base_in_motion_halts_on_a_command_that_is_not_a_number():
    speeds, _ = closed_loop(
        [math.nan, 1.0], DifferentialDrive(), 2.0, start=(0.6, -1.0)
    )
    np.testing.assert_allclose(speeds[-1], 0, atol=1e-3)
    assert np.all(np.diff(speeds[:, 0]) <= 1e-3)


def test_base_that_was_pushed_returns_to_its_reference():
    # 0.2 m/s at a gain of 10/s, in steps of 0.02 s: 0.8 is left of it a step.
    measured, gaps = np.array([0.2, 0.0]), []
    base = DifferentialDrive(com_offset=0.0)
    parameters = BaseDriveParameters(base=base)
    mass = base.mass + 2 * base.wheel_inertia / base.wheel_radius**2
    for _ in range(5):
        gaps.append(measured[0])
        torques = drive_torques([0, 0], [0, 0], measured, STEP, parameters)
        measured[0] += STEP * sum(torques) / base.wheel_radius / mass
    np.testing.assert_allclose(gaps, 0.2 * 0.8 ** np.arange(5))


# Parameters


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rate", 9.0),
        ("rate", 101.0),
        ("gain", [1.0]),
        ("gain", [1.0, 0.0]),
        ("speed_limit", [math.nan, 1.0]),
        # 10.15 rad/s of wheels of 0.0985 m are 0.9998 m/s.
        ("speed_limit", [1.01, 1.0]),
        ("speed_limit", [1.0, 5.0]),
        ("acceleration_limit", [1.0, math.inf]),
        ("yield_error", [0.25, 0.0]),
    ],
)
def test_parameters_out_of_range_are_refused_by_name(name, value):
    assert_refused(name, BaseDriveParameters, **{name: value})


def test_turning_goes_before_driving_where_torque_is_short():
    base = DifferentialDrive()
    # 10 N m of drive each and 4 N m of turn: 6 is all that a wheel has.
    given = limit_wheel_torques([6.0, 14.0], [0.0, 0.0], base)
    np.testing.assert_allclose(given, [-2.0, 6.0])
    given = limit_wheel_torques([-30.0, 30.0], [0.0, 0.0], base)
    np.testing.assert_allclose(given, [-6.0, 6.0])
    given = limit_wheel_torques([1.0, -2.0], [0.0, 0.0], base)
    np.testing.assert_allclose(given, [1.0, -2.0])


def test_a_wheel_at_its_speed_limit_is_only_braked():
    base = DifferentialDrive()
    fast = [1.01, 0.0]  # Both wheels beyond 10.15 rad/s.
    given = limit_wheel_torques([2.0, -3.0], fast, base)
    np.testing.assert_allclose(given, [0.0, -3.0])
    # At the limit itself, 1 m/s / 0.125 m, the least torque counts.
    base = DifferentialDrive(wheel_radius=0.125, wheel_speed_limit=8.0)
    given = limit_wheel_torques(np.array([0.01, -0.01]), [1.0, 0.0], base)
    np.testing.assert_allclose(given, [0.0, -0.01])


def test_the_reference_yields_only_where_the_base_is_held():
    parameters = BaseDriveParameters()
    held = yield_to([1.0, 0.5], [0.2, 0.4], parameters)
    np.testing.assert_allclose(held, [0.2, 0.5])
    followed = yield_to([1.0, 0.5], [0.9, 0.4], parameters)
    np.testing.assert_allclose(followed, [1.0, 0.5])
