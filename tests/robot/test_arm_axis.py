"""A point along an axis: solved with the sixth joint at 0."""

import numpy as np
import pytest

from drake_mobarm.robot import (
    WIDOWX_250,
    ArmKinematics,
)
from helpers.arms import (
    KINDS,
    WIDOWX,
    all_arms,
    apart,
    pose,
    random_q,
    regular,
    singular_q,
)

# Nothing here may warn, out of reach and singular poses included.
pytestmark = pytest.mark.filterwarnings("error")


def tip_and_approach(q):
    X_BT = pose(WIDOWX_250, q)
    return X_BT[..., :3, 3], X_BT[..., :3, 0]


@pytest.mark.parametrize("kind", ["regular", *KINDS])
def test_axis_solutions_put_tip_and_approach_where_they_have_to_be(kind):
    q = random_q(WIDOWX_250, 20_000) if kind == "regular" else singular_q(kind)
    p_BT, a_B = tip_and_approach(q)
    solutions = WIDOWX.inverse_axis(p_BT, a_B, limits=False)
    assert not np.isnan(solutions).any()
    assert (solutions[..., 5] == 0).all()
    tips, approaches = tip_and_approach(solutions.reshape(-1, 6))
    assert np.abs(tips - np.repeat(p_BT, 8, axis=0)).max() < 1e-8
    assert np.abs(approaches - np.repeat(a_B, 8, axis=0)).max() < 1e-8


def test_axis_solutions_have_the_arms_own_among_them():
    q = random_q(WIDOWX_250, 20_000)
    solutions = WIDOWX.inverse_axis(*tip_and_approach(q))
    q[:, 5] = 0.0
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    assert nearest[regular(WIDOWX_250, q)].max() < 1e-6
    there = solutions[~np.isnan(solutions).any(axis=-1)]
    assert (there >= WIDOWX_250.lower).all()
    assert (there <= WIDOWX_250.upper).all()


@all_arms
def test_any_arms_axis_solutions_are_right_and_have_its_own(parameters):
    q = random_q(parameters, 1000)
    X_BT = pose(parameters, q)
    solutions = ArmKinematics(parameters).inverse_axis(
        X_BT[:, :3, 3], X_BT[:, :3, 0], limits=False
    )
    there = ~np.isnan(solutions).any(axis=-1)
    reached = pose(parameters, solutions[there])
    target = X_BT[np.nonzero(there)[0]]
    # Tip and approach.
    assert np.abs((reached - target)[:, :3, [0, 3]]).max() < 1e-8
    assert (solutions[there][:, 5] == 0).all()
    q[:, 5] = 0
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    assert nearest[regular(parameters, q)].max() < 1e-6


def test_one_axis_serves_many_points():
    down = [0.0, 0.0, -1.0]
    points = np.array([[0.3, 0.0, 0.1], [0.2, 0.2, 0.05], [5.0, 0.0, 0.0]])
    solutions = WIDOWX.inverse_axis(points, down)
    assert solutions.shape == (3, 8, 6)
    for i in range(2):
        there = solutions[i][~np.isnan(solutions[i]).any(axis=-1)]
        assert len(there) > 0
        tips, approaches = tip_and_approach(there)
        np.testing.assert_allclose(
            tips, np.tile(points[i], (len(there), 1)), atol=1e-8
        )
        np.testing.assert_allclose(
            approaches, np.tile(down, (len(there), 1)), atol=1e-8
        )
    assert np.isnan(solutions[2]).all()
    assert WIDOWX.inverse_axis(np.zeros((0, 3)), down).shape == (0, 8, 6)
