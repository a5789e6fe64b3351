"""Free lengths of a disc between points, by hand and one by one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.driving.gaps import free_along, free_around, free_length


def test_free_length_is_that_of_a_disc() -> None:
    # A disc of 0.5 m meets a point 0.3 m aside 0.4 m before it.
    points = np.array([[2.0, 0.3], [1.0, 0.6], [-1.0, 0.0]])
    assert free_length(0.0, points, 0.5) == pytest.approx(1.6)


@settings(max_examples=30)
@given(st.integers(0, 1000))
def test_free_lengths_around_are_those_one_by_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-4, 4, (50, 2))
    around = free_around(0.3, 90, points, 0.33, 12.0)
    angles = 0.3 + 2 * np.pi * np.arange(90) / 90
    single = [min(free_length(float(a), points, 0.33), 12.0) for a in angles]
    np.testing.assert_allclose(around, single, atol=1e-3)


def test_free_along_finds_what_blocks_a_leg() -> None:
    points = np.array([[2.0, 0.1], [2.0, 1.4]])
    starts = np.array([[0.0, 0.0], [0.0, 3.0]])
    met = free_along(starts, np.array([4.0, 0.0]), points, 0.3)
    assert met[0] == pytest.approx(2.0, abs=0.01)
    assert 2.0 < met[1] < 3.0
    assert np.isinf(
        free_along(starts, np.array([4.0, 0.0]), points[:1] + 9, 0.3)
    ).all()
