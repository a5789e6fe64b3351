"""Odometry by hand: straight lines, arcs, and what it adds up to."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial
from scipy.integrate import solve_ivp

from drake_mobarm.robot.differential_drive import DifferentialDrive
from drake_mobarm.sensors.odometry import (
    OdometryParameters,
    count_ticks,
    integrate_wheels,
)
from drake_mobarm.sensors.systems import Odometry

# A radius of 0.1 m and a track of 0.4 m: v = 0.05 (r + l), w = 0.25 (r - l).
BASE = DifferentialDrive(wheel_radius=0.1, track=0.4)
POSE = st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-7, 7))
TURNED = st.tuples(st.floats(-30, 30), st.floats(-30, 30))


@pytest.mark.parametrize(
    ("pose", "turned", "expected"),
    [
        ((1, 2, 0), (10, 10), (2, 2, 0)),
        ((1, 2, math.pi / 2), (10, 10), (1, 3, math.pi / 2)),
        ((1, 2, 0), (-10, -10), (0, 2, 0)),
        # In place: a quarter turn to the left.
        ((1, 2, 0.3), (-math.pi, math.pi), (1, 2, 0.3 + math.pi / 2)),
        # About the left wheel: a circle of 0.2 m, a quarter of it.
        ((0, 0, 0), (0, 2 * math.pi), (0.2, 0.2, math.pi / 2)),
        # About the right wheel, half of it.
        ((0, 0, 0), (4 * math.pi, 0), (0, -0.4, -math.pi)),
        # A full circle of radius 1 m: the wheels roll 0.8 and 1.2 of it.
        (
            (3, 4, 1.0),
            (16 * math.pi, 24 * math.pi),
            (3, 4, 1.0 + 2 * math.pi),
        ),
    ],
)
def test_arc_is_worked_by_hand(pose, turned, expected):
    np.testing.assert_allclose(
        integrate_wheels(pose, turned, BASE), expected, atol=1e-12
    )


@settings(max_examples=40)
@given(POSE, TURNED)
def test_arc_equals_the_unicycles_integrated_motion(pose, turned):
    left, right = turned
    v, w = 0.1 * (right + left) / 2, 0.1 * (right - left) / 0.4
    solution = solve_ivp(
        lambda _, s: [v * math.cos(s[2]), v * math.sin(s[2]), w],
        (0, 1),
        pose,
        rtol=1e-9,
        atol=1e-10,
    )
    np.testing.assert_allclose(
        integrate_wheels(pose, turned, BASE), solution.y[:, -1], atol=1e-6
    )


@given(POSE, TURNED, st.floats(0, 1))
def test_arc_in_two_pieces_is_the_whole_arc(pose, turned, share):
    turned = np.array(turned)
    half_way = integrate_wheels(pose, share * turned, BASE)
    np.testing.assert_allclose(
        integrate_wheels(half_way, (1 - share) * turned, BASE),
        integrate_wheels(pose, turned, BASE),
        atol=1e-9,
    )


@given(POSE, TURNED)
def test_wheels_turned_back_bring_the_base_back(pose, turned):
    there = integrate_wheels(pose, turned, BASE)
    back = integrate_wheels(there, -np.array(turned), BASE)
    np.testing.assert_allclose(back, pose, atol=1e-9)


@given(POSE, TURNED)
def test_motion_is_the_same_in_the_base_wherever_it_starts(pose, turned):
    x, y, yaw = pose
    dx, dy, turn = integrate_wheels([0, 0, 0], turned, BASE)
    c, s = math.cos(yaw), math.sin(yaw)
    np.testing.assert_allclose(
        integrate_wheels(pose, turned, BASE),
        [x + c * dx - s * dy, y + s * dx + c * dy, yaw + turn],
        atol=1e-9,
    )


@given(st.floats(-1e-3, 1e-3).filter(lambda e: e != 0))
def test_almost_straight_arc_tends_to_the_straight_line(epsilon):
    arc = integrate_wheels([0, 0, 0], [10 - epsilon, 10 + epsilon], BASE)
    # The side step of an arc of 1 m that turns by a little.
    np.testing.assert_allclose(arc[0], 1, atol=1e-6)
    np.testing.assert_allclose(arc[1], 0.5 * epsilon / 2, atol=1e-9)


def test_yaw_is_not_wrapped():
    turned = np.array([-1, 1]) * 40 * math.pi
    assert integrate_wheels([0, 0, 0], turned, BASE)[2] == pytest.approx(
        20 * math.pi
    )


def told(turned, **faults):
    """Pose and velocity after the wheels turned by so much in 1 s [rad]."""
    builder = DiagramBuilder()
    ends = [0, 0, *turned], [*turned, *turned]
    wheels = builder.AddSystem(
        TrajectorySource(
            PiecewisePolynomial.FirstOrderHold([0, 1], np.transpose(ends))
        )
    )
    odometry = builder.AddSystem(
        Odometry(OdometryParameters(**faults), BASE, [1.0, 2.0, 0.0], 100.0)
    )
    builder.Connect(wheels.get_output_port(), odometry.get_input_port())
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(1.0)
    # What is sampled at 1 s is there after it.
    simulator.AdvanceTo(1.005)
    context = odometry.GetMyContextFromRoot(simulator.get_context())
    return [
        odometry.GetOutputPort(port).Eval(context)
        for port in ("measured_base_pose", "measured_base_velocity")
    ]


def test_without_faults_odometry_tells_how_the_base_moved():
    pose, velocity = told((10, 10))
    np.testing.assert_allclose(pose, [2, 2, 0], atol=1e-12)
    np.testing.assert_allclose(velocity, [1, 0], atol=1e-12)


def test_a_radius_believed_1_percent_too_large_reports_1_percent_too_far():
    pose, velocity = told((10, 10), radius_error=0.01)
    np.testing.assert_allclose(pose, [2.01, 2, 0], atol=1e-12)
    np.testing.assert_allclose(velocity, [1.01, 0], atol=1e-12)


def test_a_track_believed_a_quarter_too_large_reports_four_fifths_of_a_turn():
    # Each wheel 2 rad and 0.1 m: 0.4 m about the axle, over 0.4 m of track.
    pose, velocity = told((-2, 2), track_error=0.25)
    np.testing.assert_allclose(pose, [1, 2, 0.8], atol=1e-12)
    np.testing.assert_allclose(velocity, [0, 0.8], atol=1e-12)
    # Nothing changes on a straight line.
    np.testing.assert_allclose(
        told((10, 10), track_error=0.25)[0], [2, 2, 0], atol=1e-12
    )


def test_a_right_wheel_believed_larger_turns_a_straight_line_to_the_left():
    # 0.98 m and 1.02 m of the wheels: 1 m on an arc of 0.04 / 0.4 rad.
    pose, velocity = told((10, 10), radius_difference=0.04)
    yaw = 0.1
    np.testing.assert_allclose(
        pose,
        [1 + 10 * math.sin(yaw), 2 + 10 * (1 - math.cos(yaw)), yaw],
        atol=1e-9,
    )
    np.testing.assert_allclose(velocity, [1, 0.1], atol=1e-12)


def test_encoders_report_what_they_have_counted():
    # 10 ticks a turn are 0.6283 rad each: 3.1 rad are 4 ticks and a part.
    pose, velocity = told((3.1, 3.1), encoder_ticks=10)
    np.testing.assert_allclose(pose, [1 + 0.1 * 0.8 * math.pi, 2, 0])
    np.testing.assert_allclose(velocity, [0.31, 0])


@pytest.mark.parametrize(
    ("angle", "ticks", "expected"),
    [
        (0.0, 4, 0.0),
        (1.6, 4, math.pi / 2),
        (1.5, 4, 0.0),
        # Backwards, the first tick is at the start.
        (-0.1, 4, -math.pi / 2),
        (-0.1, 0, -0.1),
    ],
)
def test_ticks_are_counted_by_hand(angle, ticks, expected):
    assert count_ticks(angle, ticks) == pytest.approx(expected)


@given(st.floats(-1e3, 1e3), st.integers(1, 5000))
def test_a_counted_angle_is_less_than_a_tick_behind(angle, ticks):
    behind = angle - count_ticks(angle, ticks)
    assert -1e-9 <= behind <= 2 * math.pi / ticks + 1e-9


def test_what_is_counted_never_adds_up_to_more_than_a_tick():
    # 997 ticks a turn, two turns of each wheel in 100 samples.
    pose, _ = told((4 * math.pi, 4 * math.pi), encoder_ticks=997)
    exact = 1 + 0.1 * 4 * math.pi
    assert exact - 0.1 * 2 * math.pi / 997 - 1e-9 <= pose[0] <= exact + 1e-9
