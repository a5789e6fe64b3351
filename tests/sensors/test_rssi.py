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
    calibrate,
    calibration_samples,
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


def test_calibration_walk_stops_ten_times_at_each_of_twenty_places():
    rssi, distances = calibration_samples(MODEL, 0, np.random.default_rng(0))
    places, counts = np.unique(distances, return_counts=True)
    # From 0.5 m to 10 m, half a metre from one to the next.
    np.testing.assert_allclose(places, 0.5 * np.arange(1, 21))
    np.testing.assert_array_equal(counts, 10)
    np.testing.assert_allclose(rssi, -60 - 20 * np.log10(distances))


def test_calibrated_law_is_the_beacons_own_but_for_its_noise():
    law = calibrate(MODEL, 0.0, np.random.default_rng(0))
    assert law.rssi_at_1m == pytest.approx(-60)
    assert law.path_loss_exponent == pytest.approx(2)
    # By statistics: the slope's deviation is 3 dB over the 200 readings'
    # spread of 10 log10(distance), which is about 3.4 dB: 3 / 3.4 / 14.1.
    noisy = calibrate(MODEL, 3.0, np.random.default_rng(0))
    assert 0 < abs(noisy.path_loss_exponent - 2) < 4 * 0.062


@pytest.mark.parametrize("noise_db", [-0.1, math.nan])
def test_calibration_noise_that_is_negative_is_refused_by_name(noise_db):
    with pytest.raises(ParameterError, match=f"^noise_db is {noise_db}"):
        sample_calibration(MODEL, [1.0], noise_db, np.random.default_rng(0))
