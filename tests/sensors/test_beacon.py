"""Readings of a beacon: Table 2.2, by hand, and their moments."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.sensors.beacon import (
    MIN_DISTANCE,
    NOISE_CONFIGURATIONS,
    Beacon,
    BeaconNoise,
    BeaconParameters,
    distance_moments,
    in_field_of_view,
    read_beacon,
)
from drake_mobarm.sensors.rssi import (
    RssiModel,
)
from helpers.refusals import assert_refused

UNIT = st.floats(0, 1, exclude_max=True)
MODEL = RssiModel(rssi_at_1m=-60.0, path_loss_exponent=2.0)
QUIET = [0.5, 0.5]


def read(pose, target, noise, uniform):
    angle, rssi = read_beacon(pose, target, noise, uniform, MODEL)
    return angle, MODEL.distance(rssi)


def test_noise_configurations_are_those_of_table_2_2():
    rows = {
        number: (
            round(math.degrees(noise.angle), 9),
            noise.relative_distance,
            noise.absolute_distance,
        )
        for number, noise in NOISE_CONFIGURATIONS.items()
    }
    assert rows == {
        1: (5, 0.05, 0),
        2: (5, 0.10, 0),
        3: (10, 0.10, 0),
        4: (10, 0.20, 0),
        5: (20, 0.20, 1),
    }


def test_reading_without_noise_is_the_exact_bearing_and_distance():
    # Facing +y, the target 3 m to the right and 4 m ahead.
    angle, distance = read([1, 2, math.pi / 2], [4, 6], BeaconNoise(), QUIET)
    assert angle == pytest.approx(-math.atan2(3, 4))
    assert distance == pytest.approx(5)


def test_extreme_random_numbers_give_the_ends_of_the_noise():
    noise = BeaconNoise(angle=0.3, relative_distance=0.2, absolute_distance=1.0)
    low = read([0, 0, 0], [10, 0], noise, [0, 0])
    assert low == pytest.approx((-0.3, 10 * 0.8 - 1))
    mixed = read([0, 0, 0], [10, 0], noise, [0.75, 0.25])
    # Half of the noise down: +-2 m and +-1 m make +-3 m.
    assert mixed == pytest.approx((0.15, 10 - 1.5))


def test_a_reading_is_never_nearer_than_the_least_distance():
    _, distance = read([0, 0, 0], [0.5, 0], NOISE_CONFIGURATIONS[5], [0.5, 0])
    assert distance == pytest.approx(MIN_DISTANCE)


@given(
    yaw=st.floats(-10, 10),
    bearing=st.floats(-3, 3),
    uniform=st.tuples(UNIT, UNIT),
)
def test_angles_stay_within_half_a_turn_and_their_noise(yaw, bearing, uniform):
    noise = NOISE_CONFIGURATIONS[4]
    target = [2 * math.cos(bearing), 2 * math.sin(bearing)]
    angle, distance = read([0, 0, yaw], target, noise, uniform)
    assert -math.pi <= angle <= math.pi
    off = math.remainder(angle + yaw - bearing, 2 * math.pi)
    assert abs(off) <= noise.angle + 1e-9
    assert 1.6 - 1e-9 <= distance <= 2.4 + 1e-9


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [
        (BeaconNoise, "angle", -0.1),
        (BeaconNoise, "angle", math.nan),
        (BeaconNoise, "relative_distance", 1.0),
        (BeaconNoise, "absolute_distance", math.inf),
        (BeaconParameters, "rate", 0.0),
        (BeaconParameters, "rate", 50.1),
        (BeaconParameters, "model", "beacon_3"),
        (BeaconParameters, "field_of_view", 0.0),
        (BeaconParameters, "field_of_view", 6.3),
        (BeaconParameters, "dropout", -0.1),
        (BeaconParameters, "dropout", 1.0),
    ],
)
def test_invalid_parameters_are_refused_by_name(kind, field, value):
    assert_refused(
        rf"{field} is {re.escape(repr(value))}", kind, **{field: value}
    )


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [
        (BeaconNoise, "angle", 3.14),
        (BeaconNoise, "relative_distance", 0.99),
        (BeaconParameters, "rate", 50.0),
        (BeaconParameters, "field_of_view", 2 * math.pi),
        (BeaconParameters, "dropout", 0.0),
        (BeaconParameters, "dropout", 0.99),
        (BeaconParameters, "outages", [[1.0, 1.0], [2.0, 5.0]]),
    ],
)
def test_parameters_at_the_ends_of_their_ranges_are_valid(kind, field, value):
    assert getattr(kind(**{field: value}), field) == value


@pytest.mark.parametrize("outage", [[2.0, 1.0], [1.0], [1.0, 2.0, 3.0]])
def test_outage_that_is_no_interval_is_refused(outage):
    with pytest.raises(ParameterError, match=r"^outages is .*from, until"):
        BeaconParameters(outages=[[0.0, 1.0], outage])


@pytest.mark.parametrize(
    ("position", "noise", "field"),
    [
        ([1.0], 5, "position"),
        ([1.0, 2.0, 3.0], 5, "position"),
        ([1.0, math.nan], 5, "position"),
        ([1.0, 2.0], 0, "noise"),
        ([1.0, 2.0], 6, "noise"),
    ],
)
def test_beacon_has_a_place_and_a_configuration_of_table_2_2(
    position, noise, field
):
    with pytest.raises(ParameterError, match=f"^{field} is "):
        Beacon(position=position, noise=noise)


def test_field_of_view_is_symmetric_closed_and_wraps():
    half = math.pi / 2
    assert in_field_of_view(half, half)
    assert in_field_of_view(-half, half)
    assert not in_field_of_view(half + 0.01, half)
    assert not in_field_of_view(-half - 0.01, half)
    assert in_field_of_view(2 * math.pi + 0.1, half)
    assert in_field_of_view(math.pi, math.pi)


@pytest.mark.parametrize("distance", [0.05, 0.1, 0.3, 0.8, 1.2, 5.0])
@pytest.mark.parametrize(
    "noise",
    [
        *NOISE_CONFIGURATIONS.values(),
        BeaconNoise(absolute_distance=1.0),
        BeaconNoise(relative_distance=0.3, absolute_distance=1e-7),
    ],
)
def test_distance_moments_are_those_of_the_clipped_noise(distance, noise):
    # The same integral by midpoints.
    u = (np.arange(200_000) + 0.5) / 100_000 - 1
    half = distance * noise.relative_distance + noise.absolute_distance
    reading = np.maximum(distance + u * half, MIN_DISTANCE)
    mean, variance, slope = distance_moments(distance, half)
    assert mean == pytest.approx(reading.mean(), abs=2e-5)
    assert variance == pytest.approx(reading.var(), abs=2e-5)
    # The mean rises by the share of readings that are not cut off.
    assert slope == pytest.approx((reading > MIN_DISTANCE).mean(), abs=2e-5)


@pytest.mark.parametrize("half_width", [1e-1, 1e-4, 1e-8, 2e-9])
def test_moments_of_a_little_noise_are_those_of_a_uniform_distance(half_width):
    mean, variance, slope = distance_moments(10.0, half_width)
    assert mean == 10.0
    assert slope == 1.0
    assert variance == pytest.approx(half_width**2 / 3, rel=1e-12)


def test_distances_that_are_all_cut_off_read_as_the_least_for_sure():
    assert distance_moments(0.03, 0.01) == (MIN_DISTANCE, 0.0, 0.0)
