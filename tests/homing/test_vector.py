"""Vector positions and their weights in time, by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_mobarm.homing.vector import (
    time_weights,
    vector_position,
    weighted_position,
)
from helpers.refusals import assert_refused

COORDINATE = st.floats(-20, 20)


def test_vector_position_lies_at_the_bearing_and_distance():
    # cos 120 deg = -1/2, sin 120 deg = sqrt(3)/2.
    p_WT = vector_position([1.0, 2.0], math.radians(120), 4.0)
    np.testing.assert_allclose(p_WT, [-1.0, 2.0 + 2 * math.sqrt(3)])


def test_newest_weight_is_one_and_weights_fall_by_e_every_tau():
    weights = time_weights(11, 5.0)
    np.testing.assert_allclose(
        weights[[0, 5, 10]], [1.0, 0.36787944, 0.13533528]
    )


def test_weighted_position_of_two_is_worked_by_hand():
    # tau = 1 / ln 2 gives weights 1 and 1/2.
    p_WT = weighted_position([[0.0, 3.0], [3.0, 0.0]], 1 / math.log(2))
    np.testing.assert_allclose(p_WT, [1.0, 2.0])


@given(
    st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1, max_size=20),
    st.floats(0.1, 100),
)
def test_weighted_position_stays_within_its_buffer(buffer, tau):
    p_WT = weighted_position(buffer, tau)
    assert np.all(p_WT >= np.min(buffer, axis=0) - 1e-9)
    assert np.all(p_WT <= np.max(buffer, axis=0) + 1e-9)


def test_weighted_position_tends_to_the_plain_mean_for_large_tau():
    buffer = np.random.default_rng(0).normal(size=(20, 2))
    np.testing.assert_allclose(
        weighted_position(buffer, 1e9), buffer.mean(axis=0), atol=1e-7
    )


def test_weighted_position_prefers_the_newest():
    assert weighted_position([[1.0, 0.0], [0.0, 0.0]], 3.0)[0] > 0.5


@pytest.mark.parametrize(
    ("n", "tau", "name"), [(0, 1.0, "n"), (3, 0.0, "tau"), (3, -1.0, "tau")]
)
def test_weights_refuse_what_is_out_of_range(n, tau, name):
    assert_refused(name, time_weights, n, tau)
