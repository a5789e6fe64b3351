"""The robust fit against scipy, and what it finds of noise and gain."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize, minimize_scalar
from scipy.stats import t as student

from drake_mobarm.homing.fit import (
    Noise,
    first_fit,
    log_likelihoods,
    refine,
    slide,
)
from drake_mobarm.sensors.beacon import NOISE_CONFIGURATIONS
from helpers.beacon_readings import arc, columns, read

TARGET = np.array([3.0, 1.0])
WIDEST = Noise.of(NOISE_CONFIGURATIONS[5])


def fitted(readings, steps=60, prior=WIDEST, drift=0.0):
    fit = first_fit(readings, prior)
    for _ in range(steps):
        fit = refine(readings, fit, prior, drift)
    return fit


def test_the_first_fit_is_the_median_of_the_places_that_are_told():
    # Told are (1, 2), (2, 2) and (9, 0); each is 2 m or 9 m from its antenna.
    readings = np.array(
        [
            [1.0, 0.0, math.pi / 2, 2.0, 0.0],
            [0.0, 2.0, 0.0, 2.0, 0.0],
            [0.0, 0.0, 0.0, 9.0, 0.0],
        ]
    )
    np.testing.assert_allclose(first_fit(readings, WIDEST).target, [2, 2])


def test_noise_of_half_widths_has_a_third_of_their_squares_as_variance():
    noise = Noise.of(NOISE_CONFIGURATIONS[5])
    assert noise.bearing == pytest.approx(math.radians(20) ** 2 / 3)
    assert noise.relative == pytest.approx(0.04 / 3)
    assert noise.absolute == pytest.approx(1 / 3)


@pytest.mark.parametrize("configuration", [1, 3, 5])
def test_the_fit_is_the_most_likely_place_by_an_optimizer(configuration):
    path = arc(200)
    readings = columns(path, *read(configuration, path, 0, TARGET))
    fit = fitted(readings)

    def unlikeliness(x):
        # Student's t with 5 degrees, and the gain's own prior of 0.5.
        dx, dy = x[:2, None] - path.T
        turn = np.arctan2(dy, dx) - readings[:, 2]
        told = math.exp(x[2]) * np.hypot(dx, dy)
        noise = fit.noise
        angle = math.sqrt(noise.bearing + 0.01**2)
        distance = np.sqrt(noise.relative * told**2 + noise.absolute + 0.01**2)
        return (
            -student.logpdf(turn / angle, 5).sum()
            - student.logpdf((readings[:, 3] - told) / distance, 5).sum()
            + np.log(distance).sum()
            + (x[2] / 0.5) ** 2 / 2
        )

    best = minimize(unlikeliness, [*TARGET, 0.0], method="Nelder-Mead")
    assert best.success
    # The optimizer's noise shrinks where a place is near; the fit's does not.
    apart = np.linalg.norm(fit.target - best.x[:2])
    assert apart < 0.25 * fit.deviation
    assert fit.log_gain == pytest.approx(best.x[2], abs=0.02)


@pytest.mark.parametrize("prior", [1, 5])
@pytest.mark.parametrize("configuration", [1, 2, 3, 4, 5])
def test_the_noise_is_found_whatever_one_begins_with(configuration, prior):
    path = np.linspace([-4, 0], [2, 0], 300)  # 7.1 m to 1.4 m away.
    readings = columns(path, *read(configuration, path, 1, TARGET))
    fit = fitted(readings, prior=Noise.of(NOISE_CONFIGURATIONS[prior]))
    true = Noise.of(NOISE_CONFIGURATIONS[configuration])
    assert math.sqrt(fit.noise.bearing / true.bearing) == pytest.approx(
        1, abs=0.12
    )
    for d in (2.0, 5.0):
        half = 3 * (fit.noise.relative * d**2 + fit.noise.absolute)
        noise = NOISE_CONFIGURATIONS[configuration]
        assert math.sqrt(half) == pytest.approx(
            noise.distance_bound(d), rel=0.25
        )


@pytest.mark.parametrize("gain", [0.3, 3.0])
def test_distances_that_are_all_too_long_or_short_do_not_move_the_target(gain):
    path = arc(300)
    bearing, distance = read(2, path, 2, TARGET)
    fit = fitted(columns(path, bearing, gain * distance))
    np.testing.assert_allclose(fit.target, TARGET, atol=0.05)
    assert math.exp(fit.log_gain) == pytest.approx(gain, rel=0.05)


def test_a_few_wild_readings_hardly_move_the_target():
    path = arc(200)
    bearing, distance = read(2, path, 0, TARGET)
    before = fitted(columns(path, bearing, distance)).target
    bearing[::10] += 2.0
    distance[5::10] = 30.0
    after = fitted(columns(path, bearing, distance)).target
    # 2 rad at 2.2 m, a tenth of the readings: least squares moves by 0.4 m.
    assert np.linalg.norm(after - before) < 0.03


def test_the_deviation_is_honest():
    # The squared error over the variance is 1 on average where it is; along
    # the worse of two axes it is less.
    path = arc(60)
    ratios = []
    for seed in range(60):
        target = np.random.default_rng(seed).uniform(-4, 4, 2)
        if np.linalg.norm(target - path, axis=1).min() < 0.7:
            continue
        fit = fitted(columns(path, *read(3, path, seed, target)), 20)
        ratios.append(np.linalg.norm(fit.target - target) / fit.deviation)
    assert len(ratios) > 40
    assert 0.6 < np.sqrt(np.mean(np.square(ratios))) < 1.6


def test_the_axis_is_the_direction_of_sight_from_one_place():
    path = np.zeros((50, 2))
    target = 4 * np.array([math.cos(0.7), math.sin(0.7)])
    fit = fitted(columns(path, *read(1, path, 0, target)))
    assert fit.axis == pytest.approx(0.7, abs=0.02)


def test_old_places_count_less_by_the_drift_since():
    # Two exact readings disagree; the older was taken 100 m of way before.
    readings = np.array(
        [
            [0.0, 0.0, 0.0, 3.0, 0.0],
            [0.0, 0.2, 0.0, 3.0, 100.0],
        ]
    )
    fair = fitted(readings, drift=0.0).target[1]
    drifted = fitted(readings, drift=0.05).target[1]
    assert fair == pytest.approx(0.1, abs=0.02)
    assert drifted > fair + 0.01


def test_likelihoods_are_those_of_student():
    path = arc(30)
    readings = columns(path, *read(5, path, 3, TARGET))
    fit = fitted(readings)
    places = np.array([[3.0, 1.0], [3.2, 0.8]])
    by_bearings, _ = log_likelihoods(readings, fit, places, 0.0)
    expected = []
    for place in places:
        dx, dy = (place - path).T
        scale = np.sqrt(
            fit.noise.bearing + 0.01**2 + 0.02**2 / (dx**2 + dy**2 + 0.02**2)
        )
        turn = readings[:, 2] - np.arctan2(dy, dx)
        density = student.logpdf(turn / scale, 5) - np.log(scale)
        expected.append(density.sum())
    assert by_bearings[1] - by_bearings[0] == pytest.approx(
        expected[1] - expected[0]
    )


def test_a_place_is_as_likely_as_its_best_gain_makes_it():
    # Twice as far all the way: distances alone do not tell the two apart,
    # but for the gain's own prior.
    path = np.zeros((100, 2))
    readings = columns(path, *read(2, path, 0, np.array([3.0, 0.0])))
    fit = fitted(readings)
    places = np.array([[3.0, 0.0], [3.6, 0.0]])
    _, by_distances = log_likelihoods(readings, fit, places, 0.0)
    # A fifth more: ln(1.2)^2 / 2 / 0.5^2, and noise that grows a little.
    assert by_distances[0] - by_distances[1] == pytest.approx(0.066, abs=0.5)


def test_a_place_slides_to_the_best_one_of_its_line():
    path = arc(200)
    readings = columns(path, *read(1, path, 0, TARGET))
    fit = fitted(readings)
    across = np.array([0.6, 0.8])
    start = np.array([3.05, 0.98])

    def unlikeliness(step):
        places = (start + step * across)[None]
        return -log_likelihoods(readings, fit, places, 0.0)[0][0]

    best = minimize_scalar(unlikeliness, bounds=(-0.3, 0.3)).x
    place = start[None]
    for error in (0.35, 0.15, 0.06):
        place = slide(readings, fit, place, across, 0.0)
        moved = (place[0] - start) @ across
        np.testing.assert_allclose(place[0], start + moved * across)
        assert abs(moved - best) < error * abs(best)
