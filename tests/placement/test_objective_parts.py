"""The parts of the objective and its parameters, worked by hand."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.placement.objective import (
    ObjectiveParameters,
    PlacementObjective,
    sensitivities,
    singularity_factor,
    torque_score,
    torque_score_derivative,
)
from helpers.refusals import assert_refused
from helpers.stands import ARM

pytestmark = pytest.mark.filterwarnings("error")


# (4.2): how much a torque counts


@pytest.mark.parametrize(
    ("tau", "expected"),
    [(0.0, 0.0), (1.0, 1 / 3), (2.0, 2.0), (3.0, 9.0), (3.5, 24.5)],
)
def test_torque_score_at_its_least_shape_is_worked_by_hand(tau, expected):
    # a = r = 4: t = tau^2 / (4 - tau).
    assert torque_score(tau, 4.0, 4.0) == pytest.approx(expected, abs=1e-15)


def test_torque_score_with_a_greater_shape_is_worked_by_hand():
    # a = 6, r = 4, tau = 1: -1 (6 / (1 - 4) + 1) = 1.
    assert torque_score(1.0, 4.0, 6.0) == pytest.approx(1.0)


@given(st.floats(0.02, 100), st.floats(0, 0.999))
def test_torque_score_is_tau_squared_over_the_room_left(r, share):
    tau = share * (r - 0.01)
    expected = tau**2 / (r - tau)
    # Of the formula as printed: the difference of two like numbers.
    assert torque_score(tau, r, r) == pytest.approx(
        expected, rel=1e-9, abs=1e-14 * r
    )


def test_torque_score_is_linear_above_a_hundredth_below_the_limit():
    # Room 0.01: t = tau (a / 0.01 - 1).
    tau = np.array([3.99, 4.0, 4.5, 40.0])
    np.testing.assert_allclose(torque_score(tau, 4.0, 4.0), 399 * tau)


def test_torque_score_has_no_step_where_it_becomes_linear():
    below, above = np.nextafter(3.99, [0, 9])
    assert torque_score(below, 4.0, 5.0) == pytest.approx(
        float(torque_score(above, 4.0, 5.0)), rel=1e-10
    )


@given(
    st.floats(-50, 50), st.floats(0.02, 10), st.floats(0, 10, allow_nan=False)
)
def test_torque_score_is_symmetric_and_never_negative(tau, r, more):
    score = torque_score(tau, r, r + more)
    assert score >= -1e-14 * abs(tau)
    assert score == torque_score(-tau, r, r + more)


@given(st.floats(0, 20), st.floats(0, 20), st.floats(0.02, 10))
def test_torque_score_is_never_less_for_a_larger_torque(one, other, r):
    low, high = sorted((one, other))
    t = torque_score([low, high], r, r)
    assert t[0] <= t[1] + 1e-12


@given(st.floats(-6, 6), st.floats(4, 9))
def test_derivative_of_the_torque_score_is_that_of_central_differences(tau, a):
    # Away from the corner at zero, which a > r makes, and that at the limit.
    assume(min(abs(tau), abs(abs(tau) - 3.99)) > 1e-3)
    slope = (
        torque_score(tau + 1e-7, 4.0, a) - torque_score(tau - 1e-7, 4.0, a)
    ) / 2e-7
    assert torque_score_derivative(tau, 4.0, a) == pytest.approx(
        float(slope), rel=1e-4, abs=1e-6
    )


def test_derivative_of_the_torque_score_is_zero_at_rest():
    np.testing.assert_array_equal(
        torque_score_derivative(np.zeros(2), 4.0, [4.0, 7.0]), 0
    )


def test_shape_below_the_limit_is_refused_by_name():
    # There (4.2) as printed calls a larger torque better.
    with pytest.raises(ParameterError, match=r"torque_shape is 3\.9: valid is"):
        torque_score(1.0, 4.0, 3.9)
    with pytest.raises(ParameterError, match="torque_shape"):
        torque_score(np.ones(2), np.array([4.0, 2.0]), np.array([4.0, 1.9]))


# (4.4) to (4.9)


def test_sensitivities_are_sums_of_each_rows_absolute_values():
    J = np.array([[1.0, -2.0, 0.5], [0.0, 0.25, -0.25], [3.0, 0.0, 0.0]])
    s = sensitivities(J, np.eye(3), [1, 1, 1])
    np.testing.assert_allclose(s, np.array([3.5, 0.5, 3.0]) / math.sqrt(3))


def test_sensitivities_along_turned_axes_are_worked_by_hand():
    # Axes at 45 degrees in the plane: columns of R_WA.
    h = math.sqrt(0.5)
    R_WA = np.array([[h, -h, 0], [h, h, 0], [0, 0, 1]])
    J = np.array([[1.0, 2.0], [1.0, 0.0], [0.0, -5.0]])
    # Along (h, h): 2h and 2h; along (-h, h): 0 and -2h; up: 0 and -5.
    expected = np.array([4 * h, 2 * h, 5.0]) / math.sqrt(3)
    np.testing.assert_allclose(sensitivities(J, R_WA, [1, 1, 1]), expected)


def test_weights_of_axes_count_relative_to_each_other_only():
    J = np.random.default_rng(0).normal(size=(3, 6))
    one = sensitivities(J, np.eye(3), [3, 0, 4])
    np.testing.assert_allclose(one, np.abs(J).sum(axis=1) * [0.6, 0, 0.8])
    np.testing.assert_allclose(one, sensitivities(J, np.eye(3), [0.75, 0, 1.0]))


def test_singularity_factor_is_worked_by_hand():
    # 0.001 / (0.02 0.5) + 1, whatever the signs.
    assert singularity_factor([0.02, 0.5], 0.001) == pytest.approx(1.1)
    assert singularity_factor([0.02, -0.5], 0.001) == pytest.approx(1.1)


def test_singularity_factor_is_infinite_at_a_singularity_of_arm_or_wrist():
    sigma = singularity_factor([[0.0, 0.5], [0.02, 0.0], [0, 0]], 0.001)
    np.testing.assert_array_equal(sigma, np.inf)


def test_singularity_factor_is_one_when_singularities_do_not_count():
    sigma = singularity_factor([[0.0, 0.5], [0.02, 0.3]], 0.0)
    np.testing.assert_array_equal(sigma, 1.0)


# Parameters


@pytest.mark.parametrize(
    ("field", "value"),
    [
        *(
            (name, bad)
            for name in (
                "torque_weight",
                "position_weight",
                "attitude_weight",
                "singularity",
                "payload",
            )
            for bad in (-0.1, math.nan, math.inf)
        ),
        *(
            (name, bad)
            for name in ("position_axes", "attitude_axes")
            for bad in ([], [0.0] * 2, [0.0] * 4, [0, 0, math.nan])
        ),
        *(
            (name, bad)
            for name in ("position_axis_weights", "attitude_axis_weights")
            for bad in (
                [],
                [1.0] * 2,
                [0.0] * 3,
                [1, 1, -1],
                [1, math.nan, 1],
                [1, math.inf, 1],
            )
        ),
        ("torque_shape", [5.0, 9.0, 9.0, 5.0, 5.0, math.nan]),
        ("torque_shape", [5.0, 9.0, 9.0, 5.0, 5.0, math.inf]),
        ("torque_shape", [5.0, 9.0, 9.0, 5.0, 5.0, -2.0]),
    ],
)
def test_parameter_out_of_its_range_is_refused_by_name(field, value):
    assert_refused(field, ObjectiveParameters, **{field: value})


@pytest.mark.parametrize("field", ["torque_weight", "singularity", "payload"])
def test_figures_of_the_objective_are_zero_or_from_1e_minus_6_to_1e6(field):
    for value in (0, 1e-6, 1e6):
        parameters = ObjectiveParameters(**{field: value})
        assert getattr(parameters, field) == value
    for value in (0.9e-6, 1e6 + 0.5):
        with pytest.raises(ParameterError, match=f"^{field} is {value}: "):
            ObjectiveParameters(**{field: value})


def test_weights_that_are_all_zero_are_refused():
    assert_refused(
        "torque_weight is 0",
        ObjectiveParameters,
        torque_weight=0.0,
        position_weight=0.0,
        attitude_weight=0.0,
    )


@pytest.mark.parametrize(
    "shape", [[9.0], [9.0] * 5, [9.0] * 7, [4.0, 9.0, 9.0, 9.0, 9.0, 9.0]]
)
def test_shape_that_does_not_fit_the_arm_is_refused(shape):
    parameters = ObjectiveParameters(torque_shape=shape)
    assert_refused("torque_shape", PlacementObjective, ARM, parameters)
