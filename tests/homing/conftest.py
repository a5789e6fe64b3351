"""What tests of homing share."""

import math

import pytest


@pytest.fixture(
    params=[
        ([math.nan, 0], 0.0, 1.0),
        ([0, 0], math.nan, 1.0),
        ([0, 0], 0.0, math.nan),
        ([0, 0], 0.0, math.inf),
        ([0, 0], 0.0, -1.0),
    ],
    ids=str,
)
def impossible_reading(request):
    """p_WA, bearing and distance for an estimator's law."""
    return request.param
