"""Bearings that cross, by geometry."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from drake_mobarm.homing.parallax import intersect_bearings, update_parallax

COORDINATE = st.floats(-10, 10)
POINT = st.tuples(COORDINATE, COORDINATE).map(np.array)
ANGLE = st.floats(-2 * math.pi, 2 * math.pi)


def bearing(p_WA, p_WT):
    return math.atan2(p_WT[1] - p_WA[1], p_WT[0] - p_WA[0])


def apart(a, b):
    return abs(math.remainder(a - b, 2 * math.pi))


def test_bearings_of_a_right_isosceles_triangle_cross_at_its_tip():
    p_WT = intersect_bearings(
        [0, 0], math.radians(45), [2, 0], math.radians(135)
    )
    np.testing.assert_allclose(p_WT, [1, 1], atol=1e-12)


@settings(max_examples=50)
@given(POINT, POINT, POINT)
def test_exact_bearings_cross_at_the_target(p1, p2, p_WT):
    b1, b2 = bearing(p1, p_WT), bearing(p2, p_WT)
    assume(np.linalg.norm(p2 - p1) > 0.1)
    assume(0.1 < apart(b1, b2) < math.pi - 0.1)
    assume(min(np.linalg.norm(p_WT - p) for p in (p1, p2)) > 1e-3)
    np.testing.assert_allclose(
        intersect_bearings(p1, b1, p2, b2), p_WT, atol=1e-6
    )


@settings(max_examples=50)
@given(POINT, ANGLE, POINT, ANGLE)
def test_crossing_solves_the_linear_equations_of_both_lines(p1, b1, p2, b2):
    assume(np.linalg.norm(p2 - p1) > 0.1)
    assume(0.1 < apart(b1, b2) < math.pi - 0.1)
    directions = np.array(
        [[math.cos(b1), -math.cos(b2)], [math.sin(b1), -math.sin(b2)]]
    )
    d1, d2 = np.linalg.solve(directions, p2 - p1)
    assume(min(abs(d1), abs(d2)) > 1e-6)
    crossing = intersect_bearings(p1, b1, p2, b2)
    if d1 < 0 or d2 < 0:
        assert crossing is None  # It lies behind one of the two.
    else:
        expected = p1 + d1 * directions[:, 0]
        np.testing.assert_allclose(crossing, expected, atol=1e-6)


def test_parallel_and_opposite_bearings_do_not_cross():
    assert intersect_bearings([0, 0], 1.0, [0, 2], 1.0) is None
    assert intersect_bearings([0, 0], 1.0, [0, 2], 1.0 + math.pi) is None
    assert intersect_bearings([0, 0], 1.0, [0, 2], 0.9, min_angle=0.2) is None


def test_a_move_too_short_gives_no_crossing():
    near, far = [0.04, 0.0], [0.06, 0.0]
    assert intersect_bearings([0, 0], 1.0, near, 1.5) is None
    assert intersect_bearings([0, 0], 1.0, far, 1.5) is not None
    assert intersect_bearings([0, 0], 1.0, [0, 0], 1.5, min_move=0) is None


def test_update_moves_k_of_the_way_to_the_line():
    # The line of sight is the x axis; the old position is 2 m above it.
    p_WT = update_parallax([5, 2], [0, 0], 0.0, 0.8)
    np.testing.assert_allclose(p_WT, [5, 0.4])


@given(POINT, POINT, ANGLE, st.floats(0, 1))
def test_update_leaves_one_minus_k_of_the_offset_from_the_line(
    old, p_WA, angle, k
):
    along = np.array([math.cos(angle), math.sin(angle)])
    across = np.array([-along[1], along[0]])
    new = update_parallax(old, p_WA, angle, k)
    offset = (old - p_WA) @ across
    assert (new - p_WA) @ across == pytest.approx((1 - k) * offset, abs=1e-9)
    assert (new - old) @ along == pytest.approx(0, abs=1e-9)


def test_a_position_on_the_line_stays():
    np.testing.assert_allclose(
        update_parallax([3, 3], [1, 1], math.pi / 4, 0.8), [3, 3]
    )
    np.testing.assert_allclose(
        update_parallax([1, 1], [1, 1], 2.0, 0.8), [1, 1]
    )
