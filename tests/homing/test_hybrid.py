"""The hybrid estimator by hand, and its arrival."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.homing.hybrid import (
    HybridEstimator,
    HybridParameters,
    HybridState,
    is_outlier,
    position_error,
)
from helpers.refusals import assert_refused

PARAMETERS = HybridParameters()
LAW = HybridEstimator(PARAMETERS)
COORDINATE = st.floats(-10, 10)
POINT = st.tuples(COORDINATE, COORDINATE).map(np.array)


def look(state, p_WA, p_WT, scale=1.0):
    """Takes in one reading: exact but for a scale of its distance."""
    dx, dy = np.subtract(p_WT, p_WA)
    bearing, distance = math.atan2(dy, dx), math.hypot(dx, dy) * scale
    return LAW.update(state, p_WA, bearing, distance)


def settled(parallax, vectors, reported=(0.0, 0.0)):
    return HybridState(
        vectors=np.array(vectors, dtype=float),
        first_p_WA=np.zeros(2),
        readings=len(vectors),
        parallax=np.array(parallax, dtype=float),
        vector=np.mean(vectors, axis=0),
        reported=np.array(reported, dtype=float),
    )


def test_the_defaults_are_the_dissertations():
    assert PARAMETERS.k == 0.8
    assert PARAMETERS.buffer == 20
    assert PARAMETERS.agreement == 0.3
    assert PARAMETERS.z_threshold == 1.645
    assert PARAMETERS.arrival_distance == 0.3


def test_a_buffer_of_three_is_enough():
    assert HybridParameters(buffer=3).buffer == 3


def test_nothing_is_known_before_a_reading():
    assert LAW.estimate(LAW.initial_state()) is None
    assert not LAW.arrived(LAW.initial_state(), [0, 0])


def test_the_first_reading_reports_its_vector_position():
    state = LAW.update(LAW.initial_state(), [1, 1], math.pi / 2, 3)
    np.testing.assert_allclose(LAW.estimate(state), [1, 4])
    assert state.parallax is None


def test_a_reading_at_no_distance_puts_the_target_at_the_antenna():
    state = LAW.update(LAW.initial_state(), [1, 2], 0.7, 0.0)
    np.testing.assert_allclose(LAW.estimate(state), [1, 2])


def test_before_parallax_starts_the_robot_has_not_arrived():
    state = LAW.update(LAW.initial_state(), [1, 1], math.pi / 2, 3)
    assert not LAW.arrived(state, [1, 4])


def test_parallax_starts_where_two_lines_of_sight_cross():
    # The distances are wrong by 10 %: only the lines' crossing is right.
    state = look(LAW.initial_state(), [0, 0], [2, 2], scale=1.1)
    state = look(state, [0.05, 0], [2, 2], scale=1.1)
    assert state.parallax is None  # The move is too short.
    state = look(state, [1, 0], [2, 2], scale=1.1)
    np.testing.assert_allclose(state.parallax, [2, 2])
    np.testing.assert_allclose(LAW.estimate(state), [2, 2])


def test_the_first_crossing_waits_for_the_least_move():
    law = HybridEstimator(HybridParameters(min_move=1.0))
    state = law.update(law.initial_state(), [0, 0], math.pi / 2, 2.0)
    for x, started in [(0.9, False), (1.1, True)]:
        bearing = math.atan2(2.0, -x)
        state = law.update(state, [x, 0], bearing, math.hypot(2.0, x))
        assert (state.parallax is not None) is started


def test_the_first_crossing_waits_for_the_least_angle():
    # From (1, 0) and then (-1, 0), (0, y) is seen an angle of 2 atan(1 / y)
    # apart: 0.51 rad from y = 3.8, and 0.46 from y = 4.3.
    for y, started in [(3.8, True), (4.3, False)]:
        law = HybridEstimator(HybridParameters(min_angle=0.5))
        state = law.initial_state()
        for x in (1, -1):
            state = law.update(
                state, [x, 0], math.atan2(y, -x), math.hypot(x, y)
            )
        assert (state.parallax is not None) is started


def test_without_a_crossing_parallax_starts_at_the_vector_position():
    state = LAW.initial_state()
    for i in range(20):
        assert state.parallax is None
        state = look(state, [0.1 * i, 0], [8, 0])  # Straight at the target.
    np.testing.assert_allclose(state.parallax, [8, 0])


def test_position_error_is_the_distance_over_the_mean_distance():
    # Apart 4 m; 3 and 5 m from the antenna. Then 1 m; 3 and 4 m.
    assert position_error([3, 0], [3, 4], [0, 0]) == pytest.approx(4 / 4)
    assert position_error([4, 3], [4, 4], [4, 0]) == pytest.approx(1 / 3.5)


def test_positions_that_are_the_same_have_no_error():
    assert position_error([1, 2], [1, 2], [4, 6]) == 0
    assert position_error([1, 2], [1, 2], [1, 2]) == 0


@given(POINT, POINT, POINT)
def test_position_error_is_symmetric_and_at_most_two(p, v, a):
    error = position_error(p, v, a)
    assert error == position_error(v, p, a)
    assert 0 <= error <= 2 + 1e-9  # The triangle inequality.


def test_positions_that_agree_report_parallax():
    # Both on the x axis, 5.0 and 5.5: error 0.5 / 5.25 < 0.3.
    state = settled([5, 0], [[5.5, 0]] * 19)
    state = LAW.update(state, [0, 0], 0.0, 5.5)
    np.testing.assert_allclose(LAW.estimate(state), [5, 0])


def test_positions_that_disagree_are_averaged_and_parallax_is_reset():
    # 4.0 and 8.0: error 4 / 6 > 0.3; the newest is where all others are.
    state = settled([4, 0], [[8, 0]] * 20)
    state = LAW.update(state, [0, 0], 0.0, 8.0)
    np.testing.assert_allclose(LAW.estimate(state), [6, 0])
    np.testing.assert_allclose(state.parallax, [6, 0])


def test_the_average_is_with_the_weighted_position_and_not_the_newest():
    # With hardly any decay the weighted position is the mean of the buffer:
    # 8.5 newest, then 7.5 and 8.5 in turn, of which the last one drops out.
    law = HybridEstimator(HybridParameters(tau=1e6))
    state = settled([4, 0], [[7.5, 0], [8.5, 0]] * 10)
    state = law.update(state, [0, 0], 0.0, 8.5)
    np.testing.assert_allclose(state.vector, [8, 0], atol=1e-4)
    np.testing.assert_allclose(law.estimate(state), [6, 0], atol=1e-4)
    np.testing.assert_allclose(state.parallax, [6, 0], atol=1e-4)


def test_an_outlier_is_not_averaged():
    vectors = [[8 + 0.1 * (-1) ** i, 0] for i in range(20)]
    state = LAW.update(settled([4, 0], vectors), [0, 0], 0.0, 9.0)
    np.testing.assert_allclose(LAW.estimate(state), [4, 0])
    np.testing.assert_allclose(state.parallax, [4, 0])
    assert len(state.vectors) == 20
    np.testing.assert_allclose(state.vectors[0], [9, 0])


def test_the_newest_position_is_not_tested_against_itself():
    # 1.7 sample deviations off 7, 8 and 9; only 1.1 off 7, 8, 9 and 9.7.
    state = settled([4, 0], [[7, 0], [8, 0], [9, 0]])
    state = LAW.update(state, [0, 0], 0.0, 9.7)
    np.testing.assert_allclose(LAW.estimate(state), [4, 0])


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("sign", [-1, 1])
def test_outlier_test_is_two_sided_on_each_axis(axis, sign):
    # -1, 0 and 1 have the sample deviation 1.
    previous = np.array([[-1.0, -1.0], [0.0, 0.0], [1.0, 1.0]])
    position = np.zeros(2)
    position[axis] = sign * 1.64
    assert not is_outlier(position, previous, 1.645)
    position[axis] = sign * 1.65
    assert is_outlier(position, previous, 1.645)
    assert not is_outlier(position, previous[:2], 1.645)


def test_buffer_keeps_the_last_twenty_newest_first():
    state = LAW.initial_state()
    for i in range(25):
        state = LAW.update(state, [0, 0], 0.0, 1.0 + i)
    np.testing.assert_allclose(state.vectors[:, 0], np.arange(25, 5, -1))


def test_arrival_needs_to_be_near():
    state = settled([1, 0], [[1, 0]], reported=[1, 0])
    assert LAW.arrived(state, [0.71, 0])
    assert not LAW.arrived(state, [0.69, 0])


def test_arrival_needs_parallax_and_vector_to_agree():
    apart = PARAMETERS.arrival_agreement
    near = settled([1, 0], [[1, 0.99 * apart]], reported=[1, 0])
    far = settled([1, 0], [[1, 1.01 * apart]], reported=[1, 0])
    assert LAW.arrived(near, [1, 0])
    assert not LAW.arrived(far, [1, 0])


def test_a_reading_that_is_not_possible_changes_nothing(
    impossible_reading,
):
    state = look(LAW.initial_state(), [0, 0], [3, 1])
    assert LAW.update(state, *impossible_reading) is state


def test_update_leaves_the_old_state_alone():
    before = settled([4, 0], [[8, 0]] * 20)
    copy = before.parallax.copy(), before.vectors.copy()
    LAW.update(before, [0, 0], 0.3, 8.0)
    np.testing.assert_array_equal(before.parallax, copy[0])
    np.testing.assert_array_equal(before.vectors, copy[1])


@settings(max_examples=40)
@given(POINT, st.floats(0.3, 3))
def test_exact_readings_find_the_target(p_WT, step):
    state = LAW.initial_state()
    for i in range(30):
        p_WA = [step * math.cos(i), step * math.sin(i)]
        state = look(state, p_WA, p_WT)
    np.testing.assert_allclose(LAW.estimate(state), p_WT, atol=1e-4)
    assert LAW.arrived(state, p_WT)


def test_a_wrong_parallax_position_is_pulled_to_the_vector_position():
    state = settled([2, 0], [[8, 0]] * 20)
    rng = np.random.default_rng(0)
    for _ in range(20):
        scale = 1 + rng.uniform(-0.1, 0.1)
        state = look(state, [0, 0], [8, 0], scale=scale)
    # Error below 0.3 means above 8 * 0.85 / 1.15 = 5.9, less the noise.
    assert LAW.estimate(state)[0] > 5.5


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("k", 0.0),
        ("k", 1.1),
        ("buffer", 2),
        ("tau", 0.0),
        ("agreement", -0.3),
        ("z_threshold", math.nan),
        ("arrival_distance", 0.0),
        ("arrival_agreement", math.inf),
        ("min_move", 0.0),
        ("min_angle", 2.0),
    ],
)
def test_invalid_parameters_are_refused_by_name(field, value):
    assert_refused(field, HybridParameters, **{field: value})
