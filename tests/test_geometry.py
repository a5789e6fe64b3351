"""Angles, rotations and frames in the plane, by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_mobarm.geometry import (
    clip_magnitude,
    rotation,
    transform_points,
    wrap_angle,
)

ANGLE = st.floats(-50, 50)
COORDINATE = st.floats(-20, 20)
POSE = st.tuples(COORDINATE, COORDINATE, ANGLE)


@given(ANGLE)
def test_wrapped_angle_points_the_same_way(angle):
    wrapped = wrap_angle(angle)
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-12)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-12)


@given(st.floats(-1e6, 1e6))
def test_wrapped_angle_is_within_half_a_turn(angle):
    assert -math.pi <= wrap_angle(angle) <= math.pi


@given(st.floats(-3.14, 3.14), st.integers(-20, 20))
def test_wrapping_takes_away_whole_turns(angle, turns):
    assert wrap_angle(angle + 2 * math.pi * turns) == pytest.approx(
        angle, abs=1e-12
    )


@pytest.mark.parametrize(
    ("angle", "expected"),
    [
        (0.0, 0.0),
        (math.pi, -math.pi),
        (-math.pi, -math.pi),
        (3 * math.pi / 2, -math.pi / 2),
        (-3 * math.pi / 2, math.pi / 2),
        (7.0, 7.0 - 2 * math.pi),
    ],
)
def test_half_a_turn_belongs_to_the_negative_side(angle, expected):
    assert wrap_angle(angle) == pytest.approx(expected, abs=1e-12)


def test_half_a_turn_is_left_out_next_to_it_too():
    assert wrap_angle(np.nextafter(-math.pi, -4.0)) < math.pi


def test_an_array_is_wrapped_element_by_element():
    quarter = math.pi / 2
    np.testing.assert_allclose(
        wrap_angle(np.array([[0.0, 3 * quarter], [-3 * quarter, 9.0]])),
        [[0.0, -quarter], [quarter, 9.0 - 2 * math.pi]],
        atol=1e-12,
    )
    # Half a turn, and the float next to it, whose remainder rounds up.
    edge = [math.pi, -math.pi, np.nextafter(-math.pi, -4.0)]
    np.testing.assert_array_equal(wrap_angle(edge), np.full(3, -math.pi))


def test_wrapping_keeps_the_shape_and_a_scalar_stays_a_scalar():
    assert wrap_angle(np.zeros((2, 3))).shape == (2, 3)
    assert np.ndim(wrap_angle(1.0)) == 0


def test_quarter_turn_takes_x_to_y_and_y_to_minus_x():
    np.testing.assert_allclose(
        rotation(math.pi / 2) @ [[1, 0], [0, 1]], [[0, -1], [1, 0]], atol=1e-15
    )


@given(ANGLE)
def test_rotation_is_orthonormal_and_right_handed(yaw):
    R = rotation(yaw)
    np.testing.assert_allclose(R @ R.T, np.eye(2), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)


@given(ANGLE, ANGLE)
def test_rotations_one_after_the_other_add_their_angles(a, b):
    np.testing.assert_allclose(
        rotation(a) @ rotation(b), rotation(a + b), atol=1e-12
    )


def test_point_is_turned_then_moved():
    # (2, 1) turned by 90 degrees is (-1, 2).
    p = transform_points([10.0, 20.0, math.pi / 2], [2.0, 1.0])
    np.testing.assert_allclose(p, [9.0, 22.0])


@given(POSE, st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1))
def test_points_agree_with_complex_numbers(pose, points):
    x, y, yaw = pose
    turn = complex(math.cos(yaw), math.sin(yaw))
    expected = [complex(*p) * turn + complex(x, y) for p in points]
    p = transform_points(pose, points)
    np.testing.assert_allclose(p[:, 0], np.real(expected), atol=1e-9)
    np.testing.assert_allclose(p[:, 1], np.imag(expected), atol=1e-9)


def test_points_keep_their_batch_shape():
    points = np.arange(24.0).reshape(3, 4, 2)
    moved = transform_points([1.0, 2.0, 0.5], points)
    assert moved.shape == (3, 4, 2)
    np.testing.assert_allclose(
        moved[2, 1], transform_points([1.0, 2.0, 0.5], points[2, 1])
    )


@given(
    st.lists(st.floats(-100, 100), min_size=3, max_size=3),
    st.lists(st.floats(0, 50), min_size=3, max_size=3),
)
def test_clipped_values_are_the_nearest_within_the_limits(values, limits):
    clipped = clip_magnitude(np.array(values), limits)
    for value, limit, got in zip(values, limits, clipped, strict=True):
        if abs(value) <= limit:
            assert got == value
        else:
            assert got == math.copysign(limit, value)


def test_one_limit_holds_for_all_values():
    np.testing.assert_array_equal(
        clip_magnitude(np.array([-3.0, 0.5, 9.0]), 2.0), [-2.0, 0.5, 2.0]
    )
