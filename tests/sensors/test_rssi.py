"""RSSI over distance, and the line that calibrates it, by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.sensors.beacon import MIN_DISTANCE
from drake_mobarm.sensors.rssi import (
    BEACONS,
    RssiModel,
    fit_rssi_model,
    sample_calibration,
)
from helpers.refusals import assert_refused

MODEL = RssiModel(rssi_at_1m=-60.0, path_loss_exponent=2.0)


def test_rssi_falls_by_twenty_decibels_a_decade_in_free_space():
    np.testing.assert_allclose(MODEL.rssi([0.1, 1, 10]), [-40, -60, -80])


@given(st.sampled_from(sorted(BEACONS)), st.floats(MIN_DISTANCE, 30))
def test_distance_is_the_inverse_of_rssi(name, distance):
    model = BEACONS[name]
    assert model.distance(model.rssi(distance)) == pytest.approx(distance)


def test_calibration_without_noise_recovers_the_model():
    model = BEACONS["beacon_2"]
    distances = np.linspace(0.5, 10, 20)
    rssi = sample_calibration(model, distances, 0, np.random.default_rng(0))
    fitted = fit_rssi_model(rssi, distances)
    assert fitted.rssi_at_1m == pytest.approx(-65)
    assert fitted.path_loss_exponent == pytest.approx(2.4)


def test_calibration_is_the_least_squares_line():
    # By hand: decades x = 0, 1, 2 and y = -60, -75, -102. The mean is -79 at
    # x = 1 and the slope (-102 + 60) / 2 = -21, so y(0) = -58.
    fitted = fit_rssi_model([-60, -75, -102], [1, 10, 100])
    assert fitted.rssi_at_1m == pytest.approx(-58)
    assert fitted.path_loss_exponent == pytest.approx(2.1)


def test_calibration_noise_has_the_given_deviation():
    rng = np.random.default_rng(1)
    rssi = sample_calibration(MODEL, np.ones(20000), 3.0, rng)
    assert rssi.mean() == pytest.approx(-60, abs=0.1)
    assert rssi.std() == pytest.approx(3, rel=0.03)


@pytest.mark.parametrize(
    ("rssi", "distance", "word"),
    [
        ([-60, -61], [1, 1], "distinct"),
        ([-60], [1], "distinct"),
        ([-60, math.nan], [1, 2], "rssi"),
        ([-60, -70], [1, math.inf], "distance"),
        ([-60, -70], [0, 1], "distance"),
        ([-60, -70, -80], [1, 2], "shape"),
        ([-70, -60], [1, 2], "path_loss_exponent"),
    ],
)
def test_calibration_refuses_data_that_cannot_be_fitted(rssi, distance, word):
    with pytest.raises(ParameterError, match=word):
        fit_rssi_model(rssi, distance)


@pytest.mark.parametrize(
    ("field", "value"),
    [("rssi_at_1m", math.nan), ("path_loss_exponent", 0.0)],
)
def test_invalid_parameters_are_refused_by_name(field, value):
    assert_refused(field, RssiModel, **{field: value})
