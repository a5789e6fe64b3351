"""The hybrid estimator with a witness of its arrivals."""

import numpy as np
import pytest

from drake_mobarm.homing.confirmed import ConfirmedHybrid
from drake_mobarm.homing.filter import FilterEstimator, FilterParameters
from drake_mobarm.homing.hybrid import HybridEstimator, HybridParameters
from helpers.beacon_readings import read

HYBRID = HybridEstimator(HybridParameters())
LAW = ConfirmedHybrid(HYBRID, FilterEstimator(FilterParameters()))
TARGET = np.array([5.0, 0.0])


def run(law, path, bearing, distance):
    state = law.initial_state()
    for reading in zip(path, bearing, distance, strict=True):
        state = law.update(state, *reading)
    return state


def straight(end):
    return np.linspace([0, 0], [5 - end, 0], 200)


def test_the_estimate_is_the_hybrids():
    path = straight(1.0)
    readings = read(3, path, 0, TARGET)
    state, own = run(LAW, path, *readings), run(HYBRID, path, *readings)
    np.testing.assert_array_equal(LAW.estimate(state), HYBRID.estimate(own))
    assert LAW.estimate(LAW.initial_state()) is None


class AlwaysThere(HybridEstimator):
    """Says that it has arrived, at a place of its own."""

    def __init__(self, p_WT):
        super().__init__(HybridParameters())
        self._p_WT = np.array(p_WT)

    def estimate(self, state):
        return self._p_WT

    def arrived(self, state, p_WB):
        return True


def confirmed(p_WT, path, readings):
    law = ConfirmedHybrid(
        AlwaysThere(p_WT), FilterEstimator(FilterParameters())
    )
    return law.arrived(run(law, path, *readings), [9, 9])


def half_turn_about(target):
    angle = np.linspace(0, np.pi, 60)
    return target + 0.2 * np.column_stack([-np.cos(angle), np.sin(angle)])


def test_nothing_is_confirmed_before_a_reading():
    assert not confirmed([0, 0], straight(1)[:0], ([], []))


@pytest.mark.parametrize("told", [0.2, 0.35])
def test_bearings_along_one_line_do_not_confirm_what_strength_tells(told):
    # Strength says all the time that the beacon is just ahead.
    path = straight(2.0)
    bearing, _ = read(1, path, 0, TARGET)
    distance = np.full(len(path), told)
    assert not confirmed([3 + told, 0], path, (bearing, distance))


def test_a_way_past_the_beacon_confirms_its_place_and_no_other():
    path = np.vstack([straight(0.2), half_turn_about(TARGET)])
    readings = read(1, path, 0, TARGET)
    assert confirmed(TARGET + 0.1, path, readings)
    assert confirmed(TARGET - 0.1, path, readings)
    assert not confirmed(TARGET + 0.3, path, readings)


def test_the_hybrids_own_conditions_are_still_needed():
    path = np.vstack([straight(0.2), half_turn_about(TARGET)])
    state = run(LAW, path, *read(1, path, 0, TARGET))
    assert LAW.arrived(state, LAW.estimate(state) + np.array([0.29, 0]))
    assert not LAW.arrived(state, LAW.estimate(state) + np.array([0.31, 0]))


def test_a_reading_that_is_not_possible_changes_nothing(impossible_reading):
    state = LAW.update(LAW.initial_state(), [0, 0], 0.3, 3.0)
    assert LAW.update(state, *impossible_reading) is state
