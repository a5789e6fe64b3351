"""The filter estimator: what it finds, when it has arrived, what it refuses."""

import math

import numpy as np
import pytest
from scipy.optimize import least_squares

from drake_mobarm.homing.filter import FilterEstimator, FilterParameters
from helpers.beacon_readings import arc, read
from helpers.refusals import assert_refused

TARGET = np.array([3.0, 1.0])
PARAMETERS = FilterParameters()
LAW = FilterEstimator(PARAMETERS)


def run(path, bearing, distance, law=LAW, state=None):
    state = state or law.initial_state()
    for reading in zip(path, bearing, distance, strict=True):
        state = law.update(state, *reading)
    return state


def still(n):
    return np.zeros((n, 2))


def straight(n=200, end=0.0):
    """Along x from 5 m before the target (5, 0) to `end` before it."""
    return np.linspace([0, 0], [5 - end, 0], n)


def around(n=80, radius=0.2):
    """A circle about the target (5, 0)."""
    angle = np.linspace(0, 2 * np.pi, n)
    return [5, 0] + radius * np.column_stack([np.cos(angle), np.sin(angle)])


AHEAD = np.array([5.0, 0.0])


def test_nothing_is_known_before_a_reading():
    state = LAW.initial_state()
    assert LAW.estimate(state) is None
    assert not LAW.arrived(state, [0, 0])


def test_the_first_reading_puts_the_target_where_it_tells():
    state = LAW.update(LAW.initial_state(), [1, 0], math.pi / 2, 4.0)
    np.testing.assert_allclose(LAW.estimate(state), [1, 4], atol=0.1)
    # A gain of e^0.5 makes 0.5 * 4 m, noise (1 m + 0.2 * 4 m) / sqrt(3).
    assert state.fit.deviation == pytest.approx(math.hypot(2, 1.04), rel=0.1)


@pytest.mark.parametrize("distance", [0.0, 0.05])
def test_a_first_reading_at_no_distance_is_used(distance):
    state = LAW.update(LAW.initial_state(), [0, 0], 0.0, distance)
    assert np.linalg.norm(LAW.estimate(state)) < 1.0


def test_the_estimate_is_that_of_batch_least_squares():
    path = arc(200)
    ratios = []
    for seed in range(20):
        bearing, distance = read(2, path, seed, TARGET)

        def residuals(p_WT, bearing=bearing, distance=distance):
            dx, dy = (p_WT - path).T
            turn = np.arctan2(dy, dx) - bearing
            d = np.hypot(dx, dy)
            angle_sigma = math.radians(5) / math.sqrt(3)
            return np.concatenate(
                [
                    turn / angle_sigma,
                    (d - distance) / (0.1 * d / math.sqrt(3)),
                ]
            )

        batch = least_squares(residuals, TARGET).x
        state = run(path, bearing, distance)
        apart = np.linalg.norm(LAW.estimate(state) - batch)
        ratios.append(apart / state.fit.deviation)
        assert state.fit.deviation < 0.03
    # Least squares is told the noise, and that the gain is 1.
    assert np.sqrt(np.mean(np.square(ratios))) < 1.5
    assert np.max(ratios) < 3


@pytest.mark.parametrize("told", [0, 1, 2, 3, 4, 5])
@pytest.mark.parametrize("configuration", [1, 5])
def test_what_it_is_told_of_the_noise_hardly_matters(told, configuration):
    law = FilterEstimator(FilterParameters(told=told))
    path = np.vstack([straight(), around()])
    state = run(path, *read(configuration, path, 0, AHEAD), law)
    np.testing.assert_allclose(law.estimate(state), AHEAD, atol=0.04)
    assert law.arrived(state, [4.8, 0])


def test_near_readings_that_clip_do_not_bias_the_distance():
    # 0.3 m away, their mean is 0.44 m.
    target = np.array([0.3, 0.0])
    _, distance = read(5, still(1500), 1, target)
    assert distance.mean() > 0.42
    # Coming from 3 m away: it knows by then what clips.
    path = np.linspace([-3, 0.5], [0, 0], 200)
    path = np.vstack([path, still(100)])
    state = run(path, *read(5, path, 1, target))
    np.testing.assert_allclose(LAW.estimate(state), target, atol=0.06)


def test_a_wild_reading_moves_nothing():
    path = arc(100)
    state = run(path, *read(2, path, 0, TARGET))
    after = LAW.update(state, path[-1], 3.0, 0.1)
    before = LAW.estimate(state)
    np.testing.assert_allclose(LAW.estimate(after), before, atol=0.02)


def test_it_starts_again_from_readings_that_are_at_odds_with_all_before():
    path = arc(200)
    state = run(path, *read(2, path, 0, TARGET))
    elsewhere = np.array([-3.0, -2.0])
    bearing, distance = read(2, path, 1, elsewhere)
    n = PARAMETERS.patience
    state = run(path[: 2 * n], bearing[: 2 * n], distance[: 2 * n], state=state)
    # Forgotten are the 200 before, but for what was needed to notice.
    assert len(state.readings) < 3 * n
    np.testing.assert_allclose(LAW.estimate(state), elsewhere, atol=0.3)


def test_it_keeps_the_last_readings():
    law = FilterEstimator(FilterParameters(window=30))
    path = arc(50)
    bearing, distance = read(2, path, 0, TARGET)
    state = run(path, bearing, distance, law)
    np.testing.assert_array_equal(state.readings[:, 2], bearing[-30:])


def test_bearings_wrap():
    # The target is behind, where the bearing jumps by a turn.
    target = np.array([-5.0, 0.0])
    bearing, distance = read(3, still(200), 0, target)
    plain = run(still(200), bearing, distance)
    turns = 2 * np.pi * (np.arange(200) % 3 - 1)
    turned = run(still(200), bearing + turns, distance)
    np.testing.assert_allclose(LAW.estimate(plain), target, atol=0.15)
    np.testing.assert_allclose(LAW.estimate(turned), LAW.estimate(plain))


def test_exact_readings_find_the_target():
    path = arc(100)
    away = TARGET - path
    state = run(path, np.arctan2(*away.T[::-1]), np.hypot(*away.T))
    np.testing.assert_allclose(LAW.estimate(state), TARGET, atol=1e-3)


def test_a_reading_on_the_estimate_itself_stays_finite():
    path = np.linspace([0, 0], TARGET, 300)  # Right up to the target.
    bearing, distance = read(5, path, 3, TARGET)
    state = run(path, bearing, distance)
    state = LAW.update(state, LAW.estimate(state), 1.0, 0.05)
    assert np.isfinite(LAW.estimate(state)).all()
    assert math.isfinite(state.fit.deviation)


def test_a_circle_about_the_target_is_an_arrival_for_the_near():
    path = np.vstack([straight(end=0.2), around()])
    state = run(path, *read(3, path, 0, AHEAD))
    p_WT = LAW.estimate(state)
    assert LAW.arrived(state, p_WT - [0.29, 0])
    assert not LAW.arrived(state, p_WT - [0.31, 0])


def test_bearings_along_one_line_are_no_arrival():
    # They say that the target is ahead, and not where.
    path = straight(end=0.4)
    bearing, _ = read(3, path, 0, AHEAD)
    # Strength says all the time that it is 0.2 m ahead.
    state = run(path, bearing, np.full(len(path), 0.2))
    assert not LAW.arrived(state, path[-1])
    # And by a tenth of the true distance, which grows less with it.
    state = run(path, bearing, 0.1 * (5 - path[:, 0]))
    assert not LAW.arrived(state, path[-1])


def test_readings_from_one_place_are_no_arrival():
    # 0.2 m ahead of the antenna, it says: the bearings agree with any place.
    bearing, _ = read(1, still(300), 0, AHEAD)
    state = run(still(300), bearing, np.full(300, 0.2))
    assert not LAW.arrived(state, LAW.estimate(state))


def test_strength_that_stays_wrong_does_not_keep_it_from_arriving():
    path = np.vstack([straight(), around()])
    bearing, distance = read(3, path, 0, AHEAD)
    state = run(path, bearing, 0.1 * distance)
    np.testing.assert_allclose(LAW.estimate(state), AHEAD, atol=0.05)
    assert LAW.arrived(state, [4.9, 0])


def test_a_reading_that_is_not_possible_changes_nothing(
    impossible_reading,
):
    state = LAW.update(LAW.initial_state(), [0, 0], 0.3, 3.0)
    assert LAW.update(state, *impossible_reading) is state


def test_a_distance_that_no_radio_reaches_changes_nothing():
    state = LAW.update(LAW.initial_state(), [0, 0], 0.3, 3.0)
    assert LAW.update(state, [0, 0], 0.3, 1e17) is state


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("told", 6),
        ("window", 19),
        ("drift", -1.0),
        ("patience", 4),
        ("arrival_distance", math.inf),
        ("arrival_radius", 0.0),
        ("arrival_margin", math.nan),
    ],
)
def test_invalid_parameters_are_refused_by_name(field, value):
    assert_refused(field, FilterParameters, **{field: value})
