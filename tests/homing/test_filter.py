"""The filter estimator against least squares, by hand, and its arrival."""

import math

import numpy as np
import pytest
from scipy.optimize import least_squares

from drake_mobarm.homing.filter import (
    FilterEstimator,
    FilterParameters,
    FilterState,
    deviation,
)
from drake_mobarm.sensors.beacon import NOISE_CONFIGURATIONS, BeaconNoise
from helpers.refusals import assert_refused

TARGET = np.array([3.0, 1.0])
PARAMETERS = FilterParameters()
LAWS = {
    configuration: FilterEstimator(PARAMETERS, noise)
    for configuration, noise in NOISE_CONFIGURATIONS.items()
}
MILD, WORST = LAWS[2], LAWS[5]


def readings(configuration, path, seed, target=TARGET):
    """Bearing and distance of a target, by the words of Table 2.2."""
    rng = np.random.default_rng(seed)
    noise = NOISE_CONFIGURATIONS[configuration]
    d = np.linalg.norm(target - path, axis=1)
    bearing = np.arctan2(*(target - path).T[::-1])
    n = len(path)
    bearing = bearing + noise.angle * rng.uniform(-1, 1, n)
    half = d * noise.relative_distance + noise.absolute_distance
    distance = d + half * rng.uniform(-1, 1, n)
    return bearing, np.maximum(distance, 0.05)


def run(law, path, bearing, distance):
    state = law.initial_state()
    for reading in zip(path, bearing, distance, strict=True):
        state = law.update(state, *reading)
    return state


def arc(n):
    """A quarter of a circle of 1.5 m about the origin."""
    angle = np.linspace(0, np.pi / 2, n)
    return 1.5 * np.column_stack([np.cos(angle), np.sin(angle)])


def still(n):
    return np.zeros((n, 2))


def test_nothing_is_known_before_a_reading():
    state = WORST.initial_state()
    assert WORST.estimate(state) is None
    assert deviation(state) == math.inf
    assert not WORST.arrived(state, [0, 0])


def test_the_first_reading_puts_the_target_amid_all_that_may_be():
    # 4 m read: 3 / 1.2 = 2.5 m to 5 / 0.8 = 6.25 m, the middle 4.375 m.
    state = WORST.update(WORST.initial_state(), [1, 0], math.pi / 2, 4.0)
    np.testing.assert_allclose(WORST.estimate(state), [1, 4.375])
    assert deviation(state) >= 1.875


def test_the_first_belief_is_as_wide_as_the_reading_leaves_open():
    # Looking along y: half of 2.5 m to 6.25 m and the floor of 0.01 m along
    # it; across it 6.25 m times the bearing's deviation.
    state = WORST.update(WORST.initial_state(), [1, 0], math.pi / 2, 4.0)
    bearing = math.hypot(math.radians(20) / math.sqrt(3), 0.01)
    np.testing.assert_allclose(
        state.covariance,
        np.diag([(6.25 * bearing) ** 2, 1.885**2]),
        atol=1e-12,
    )


def test_a_first_reading_at_no_distance_is_used():
    state = WORST.update(WORST.initial_state(), [0, 0], 0.0, 0.0)
    np.testing.assert_allclose(WORST.estimate(state), [0.625, 0])


def test_an_update_is_that_of_the_information_form():
    # Without noise but the floors the distance is linear in the belief.
    law = FilterEstimator(
        FilterParameters(angle_floor=0.1, distance_floor=0.2), BeaconNoise()
    )
    prior = np.array([[0.04, 0.02], [0.02, 0.09]])
    state = law.update(
        FilterState(
            position=np.array([3.0, 0.0]), covariance=prior, p_WA=np.zeros(2)
        ),
        [0, 0],
        0.05,
        3.1,
    )
    lever = math.hypot(3.0, 0.2)
    H, weight = np.array([[0, 1 / lever], [1, 0]]), np.diag([100.0, 25.0])
    posterior = np.linalg.inv(np.linalg.inv(prior) + H.T @ weight @ H)
    np.testing.assert_allclose(state.covariance, posterior)
    np.testing.assert_allclose(
        law.estimate(state), [3, 0] + posterior @ H.T @ weight @ [0.05, 0.1]
    )


def test_a_first_reading_that_is_clipped_starts_no_nearer_than_nothing():
    # 0.05 m read: 0 m to 1.05 / 0.8 = 1.3125 m.
    state = WORST.update(WORST.initial_state(), [0, 0], 0.0, 0.05)
    np.testing.assert_allclose(WORST.estimate(state), [0.65625, 0])


@pytest.mark.parametrize("bearing", [0.0, 0.8])
@pytest.mark.parametrize("distance", [0.05, 0.5, 1.0])
def test_one_near_reading_leaves_a_wide_belief_no_surer_than_bayes(
    bearing, distance
):
    sigma = 0.5
    state = FilterState(
        position=np.array([0.4, 0.0]),
        covariance=np.eye(2) * sigma**2,
        p_WA=np.zeros(2),
    )
    after = WORST.update(state, [0, 0], bearing, distance)
    # Bayes' rule with this filter's two Gaussian noises, by random targets.
    rng = np.random.default_rng(0)
    targets = state.position + sigma * rng.normal(size=(40000, 2))
    d = np.linalg.norm(targets, axis=1)
    u = rng.uniform(-1, 1, (2, 40000))
    turn = np.arctan2(targets[:, 1], targets[:, 0]) - bearing
    turn = (turn + np.pi) % (2 * np.pi) - np.pi
    weights = np.exp(-1.5 * (turn / math.radians(20)) ** 2)
    seen = np.maximum(d * (1 + 0.2 * u[0]) + u[1], 0.05)
    weights *= np.abs(seen - distance) < 0.05
    exact = np.cov(targets.T, aweights=weights)
    assert np.trace(after.covariance) > np.trace(exact)


def test_the_estimate_is_that_of_batch_least_squares():
    path = arc(200)
    errors = []
    for seed in range(5):
        bearing, distance = readings(2, path, seed)

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
        state = run(MILD, path, bearing, distance)
        errors.append(np.linalg.norm(MILD.estimate(state) - batch))
    assert np.mean(errors) < 0.01
    assert np.max(errors) < 0.02


def test_deviation_falls_with_the_root_of_the_readings():
    # 5 m away: along 0.1 * 5 / sqrt(3 n) m, across 5 radians(5) / sqrt(3 n).
    n = 400
    target = np.array([5.0, 0.0])
    bearing, distance = readings(2, still(n), 0, target)
    state = run(MILD, still(n), bearing, distance)
    along, across = np.sqrt(np.diag(state.covariance))
    assert along == pytest.approx(0.5 / math.sqrt(3 * n), rel=0.1)
    assert across == pytest.approx(
        5 * math.radians(5) / math.sqrt(3 * n), rel=0.1
    )


@pytest.mark.parametrize("configuration", [1, 3, 5])
def test_the_deviation_is_honest(configuration):
    # The squared error over the covariance averages 2 where it is.
    law = LAWS[configuration]
    path = arc(40)
    errors = []
    for seed in range(45):
        rng = np.random.default_rng([seed, configuration])
        target = rng.uniform(-4, 4, 2)
        if np.linalg.norm(target - path, axis=1).min() < 0.5:
            continue
        state = run(law, path, *readings(configuration, path, seed, target))
        error = law.estimate(state) - target
        errors.append(error @ np.linalg.solve(state.covariance, error))
    assert len(errors) > 30
    assert 0.8 < np.mean(errors) < 3.5


def test_bearings_of_a_near_target_do_not_make_the_filter_too_sure():
    # Its distance is hardly known, so a bearing tells little across either.
    path = np.linspace([0, 0], [0.4, 0], 40)
    errors = []
    for seed in range(40):
        target = np.random.default_rng(seed).uniform(-1.3, 1.3, 2)
        state = run(WORST, path, *readings(5, path, seed, target))
        error = WORST.estimate(state) - target
        errors.append(error @ np.linalg.solve(state.covariance, error))
    assert np.mean(errors) < 7  # 2 if it were linear.


def test_near_readings_that_clip_do_not_bias_the_distance():
    # 0.3 m away, their mean is 0.44 m.
    target = np.array([0.3, 0.0])
    bearing, distance = readings(5, still(1500), 1, target)
    assert distance.mean() > 0.42
    state = run(WORST, still(1500), bearing, distance)
    assert WORST.estimate(state)[0] == pytest.approx(0.3, abs=0.04)


def test_a_wild_reading_moves_nothing():
    path = arc(100)
    state = run(MILD, path, *readings(2, path, 0))
    after = MILD.update(state, path[-1], 3.0, 0.1)
    np.testing.assert_array_equal(MILD.estimate(after), MILD.estimate(state))
    assert after.refused == 1


def test_a_filter_that_is_wrong_starts_again_when_it_is_out_of_patience():
    wrong = FilterState(
        position=np.array([-4.0, -4.0]),
        covariance=np.eye(2) * 1e-4,
        p_WA=np.zeros(2),
    )
    state = wrong
    for i in range(1, PARAMETERS.patience):
        state = MILD.update(state, [0, 0], 0.5, 3.0)
        assert state.refused == i
        np.testing.assert_array_equal(MILD.estimate(state), [-4, -4])
    state = MILD.update(state, [0, 0], 0.5, 3.0)
    assert state.refused == 0
    assert np.linalg.norm(MILD.estimate(state)) == pytest.approx(3, rel=0.02)
    assert math.atan2(*MILD.estimate(state)[::-1]) == pytest.approx(0.5)


def test_an_accepted_reading_restores_patience():
    path = arc(100)
    state = run(MILD, path, *readings(2, path, 0))
    state = MILD.update(state, path[-1], 3.0, 0.1)
    dx, dy = TARGET - path[-1]
    bearing, distance = math.atan2(dy, dx), math.hypot(dx, dy)
    assert MILD.update(state, path[-1], bearing, distance).refused == 0


def test_bearings_wrap():
    # The target is behind, where the bearing jumps by a turn.
    target = np.array([-5.0, 0.0])
    bearing, distance = readings(3, still(200), 0, target)
    law = LAWS[3]
    plain = run(law, still(200), bearing, distance)
    turns = 2 * np.pi * (np.arange(200) % 3 - 1)
    turned = run(law, still(200), bearing + turns, distance)
    np.testing.assert_allclose(law.estimate(plain), target, atol=0.15)
    np.testing.assert_allclose(law.estimate(turned), law.estimate(plain))


def test_driving_adds_the_drift_of_odometry():
    parameters = FilterParameters(drift=0.5, gate=1e-9)
    law = FilterEstimator(parameters, NOISE_CONFIGURATIONS[5])
    state = FilterState(
        position=np.array([3.0, 0.0]),
        covariance=np.zeros((2, 2)),
        p_WA=np.zeros(2),
    )
    # Refused, so that the drift is all that changes: 0.5^2 m^2/m * 4 m.
    after = law.update(state, [0, 4], 3.0, 0.5)
    np.testing.assert_allclose(after.covariance, np.eye(2))
    # And 3 m more, refused again.
    after = law.update(after, [0, 7], 3.0, 0.5)
    np.testing.assert_allclose(after.covariance, 1.75 * np.eye(2))


def test_exact_readings_without_noise_find_the_target():
    law = LAWS[1]
    path = arc(100)
    away = TARGET - path
    state = run(law, path, np.arctan2(*away.T[::-1]), np.hypot(*away.T))
    np.testing.assert_allclose(law.estimate(state), TARGET, atol=1e-3)


def test_a_reading_on_the_estimate_itself_stays_finite():
    state = FilterState(
        position=np.zeros(2), covariance=np.eye(2) * 1e-4, p_WA=np.zeros(2)
    )
    after = MILD.update(state, [0, 0], 1.0, 0.05)
    assert np.isfinite(MILD.estimate(after)).all()
    assert np.isfinite(after.covariance).all()


@pytest.mark.parametrize("configuration", [1, 5])
def test_covariance_stays_symmetric_and_positive(configuration):
    law = LAWS[configuration]
    path = np.linspace([0, 0], TARGET, 300)  # Right up to the target.
    state = run(law, path, *readings(configuration, path, 3))
    np.testing.assert_allclose(state.covariance, state.covariance.T)
    assert np.linalg.eigvalsh(state.covariance)[0] > 0


def test_arrival_needs_to_be_near_and_sure():
    limit = PARAMETERS.arrival_deviation

    def belief(sigma):
        return FilterState(
            position=np.array([1.0, 0.0]),
            covariance=np.diag([sigma**2, 1e-6]),
            p_WA=np.zeros(2),
        )

    assert WORST.arrived(belief(0.9 * limit), [0.71, 0])
    assert not WORST.arrived(belief(0.9 * limit), [0.69, 0])
    assert not WORST.arrived(belief(1.1 * limit), [0.71, 0])


def test_a_reading_that_is_not_possible_changes_nothing(
    impossible_reading,
):
    state = WORST.update(WORST.initial_state(), [0, 0], 0.3, 3.0)
    assert WORST.update(state, *impossible_reading) is state


def test_a_patience_of_one_reading_is_enough():
    assert FilterParameters(patience=1).patience == 1


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("angle_floor", 0.0),
        ("distance_floor", math.nan),
        ("drift", -1.0),
        ("gate", 0.0),
        ("patience", 0),
        ("arrival_distance", math.inf),
        ("arrival_deviation", 0.0),
    ],
)
def test_invalid_parameters_are_refused_by_name(field, value):
    assert_refused(field, FilterParameters, **{field: value})
