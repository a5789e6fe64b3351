"""Odometry by hand: straight lines, arcs, and what it adds up to."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from drake_mobarm.robot.differential_drive import DifferentialDrive
from drake_mobarm.sensors.odometry import integrate_wheels

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
