"""One pose, in Python's floats, against the batch, which numpy computes."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.robot import APPENDIX_C, WIDOWX_250, ArmKinematics
from helpers.arms import (
    KINDS,
    PI,
    WIDOWX,
    all_arms,
    apart,
    pose,
    random_q,
    singular_q,
)

# Nothing here may warn, out of reach and singular poses included.
pytestmark = pytest.mark.filterwarnings("error")

ROUNDING = 1e-12
# The fourth and the sixth joint turn about nearly one line where the wrist's
# bend is small: there each is certain only up to what it moves, rounding over
# bend. Below a bend of 1e-12 the fourth is put to 0: rounding may decide that.
MOVED = 4e-12


def assert_same_solutions(arm, alone, batch, columns):
    """As far as columns of the tool's pose tell."""
    np.testing.assert_array_equal(np.isnan(alone), np.isnan(batch))
    there = ~np.isnan(batch).any(axis=-1)
    alone, batch = alone[there], batch[there]
    bend = np.abs(np.sin(batch[:, 4] + arm.parameters.dh[4, 0]))
    for i in range(6):
        off = apart(alone[:, [i]], batch[:, [i]])
        if i in (3, 5):
            assert (bend * off).max(initial=0) < MOVED
        else:
            assert off.max(initial=0) < ROUNDING
    off = (arm.forward(alone) - arm.forward(batch))[..., columns]
    assert np.abs(off).max(initial=0) < MOVED


def assert_one_by_one_is_the_batch(arm, X_BT, **keywords):
    alone = np.array([arm.inverse(X, **keywords) for X in X_BT])
    batch = arm.inverse(X_BT, **keywords)
    assert_same_solutions(arm, alone, batch, [0, 1, 2, 3])
    p_BT, a_B = X_BT[:, :3, 3], X_BT[:, :3, 0]
    alone = [
        arm.inverse_axis(p, a, **keywords)
        for p, a in zip(p_BT, a_B, strict=True)
    ]
    batch_axis = arm.inverse_axis(p_BT, a_B, **keywords)
    assert_same_solutions(arm, np.array(alone), batch_axis, [0, 3])
    return batch


@all_arms
def test_one_is_as_in_the_batch_wherever_the_joints_are(parameters):
    arm = ArmKinematics(parameters)
    q = np.concatenate([random_q(parameters, 200), np.zeros((1, 6))])
    for method in (
        arm.forward,
        arm.jacobian,
        arm.joint_positions,
        arm.holding_torque,
        lambda q: arm.holding_torque(q, 2.5),
    ):
        alone = np.array([method(one) for one in q])
        np.testing.assert_allclose(alone, method(q), rtol=0, atol=ROUNDING)


@all_arms
def test_one_is_solved_as_in_the_batch(parameters):
    X_BT = pose(parameters, random_q(parameters, 300, seed=8))
    # Near the arm's reach in, beyond and far beyond it.
    X_BT[100:, :3, 3] *= np.linspace(0.9, 3, 200)[:, None]
    arm = ArmKinematics(parameters)
    every = assert_one_by_one_is_the_batch(arm, X_BT, limits=False)
    solved = ~np.isnan(every).any(axis=(1, 2))
    assert 0.2 < solved.mean() < 0.9


@all_arms
def test_one_is_solved_within_limits_as_in_the_batch(parameters):
    # Joints that are limited each by themselves, and all together.
    rng = np.random.default_rng(9)
    X_BT = pose(parameters, random_q(parameters, 100, seed=10))
    for limited in (*range(6), slice(None)):
        lower, upper = np.full(6, -PI), np.full(6, PI)
        lower[limited] = rng.uniform(-3, -1.5)
        upper[limited] = rng.uniform(1.5, 3)
        arm = ArmKinematics(replace(parameters, lower=lower, upper=upper))
        within = assert_one_by_one_is_the_batch(arm, X_BT)
        every = arm.inverse(X_BT, limits=False)
        assert 0 < np.isfinite(within).sum() < np.isfinite(every).sum()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("limits", [True, False])
def test_near_a_singularity_one_is_solved_as_in_the_batch(kind, limits):
    X_BT = pose(WIDOWX_250, singular_q(kind, 1000))
    assert_one_by_one_is_the_batch(WIDOWX, X_BT, limits=limits)


@pytest.mark.parametrize("kind", ["wrist", "elbow", "wrist and elbow"])
def test_near_a_singularity_one_of_appendix_c_is_as_in_the_batch(kind):
    X_BT = pose(APPENDIX_C, singular_q(kind, 1000, APPENDIX_C))
    assert_one_by_one_is_the_batch(ArmKinematics(APPENDIX_C), X_BT)


@all_arms
def test_square_angles_one_by_one_are_solved_as_in_the_batch(parameters):
    # Exactly singular, and angles half a turn from the middle.
    squares = itertools.product([-PI, -PI / 2, 0.0, PI / 2], repeat=6)
    q = np.array(list(squares))[::23] - parameters.dh[:, 0]
    X_BT = pose(parameters, q)
    X_BT[:, :3, :3] = np.rint(X_BT[:, :3, :3])
    arm = ArmKinematics(parameters)
    assert_one_by_one_is_the_batch(arm, X_BT, limits=False)


def test_limits_beyond_a_turn_and_off_the_middle_are_as_in_the_batch():
    shifted = replace(
        WIDOWX_250,
        lower=[0, -9.0, -9.0, -4 * PI, -9.0, 1.0],
        upper=[2 * PI, 8.0, 8.0, 4 * PI, 9.0, 1.0 + 2 * PI],
    )
    X_BT = pose(WIDOWX_250, random_q(WIDOWX_250, 300))
    for limits in (True, False):
        assert_one_by_one_is_the_batch(
            ArmKinematics(shifted), X_BT, limits=limits
        )


def test_joints_two_turns_off_are_solved_where_they_are():
    lower, upper = np.full(6, -PI), np.full(6, PI)
    lower[[0, 3, 5]], upper[[0, 3, 5]] = [3, -5, 3], [9.2, 1.2, 9.2]
    lower[[0, 3]] += [2 * PI, -2 * PI]
    upper[[0, 3]] += [2 * PI, -2 * PI]
    arm = ArmKinematics(replace(WIDOWX_250, lower=lower, upper=upper))
    for q in np.random.default_rng(12).uniform(lower, upper, (50, 6)):
        solutions = arm.inverse(pose(WIDOWX_250, [q])[0])
        assert np.nanmin(np.abs(solutions - q).max(axis=1)) < 1e-6


def test_in_a_straight_wrist_the_fourth_joint_is_at_zero_or_half_a_turn():
    q = random_q(WIDOWX_250, 50)
    q[:, 4] = -WIDOWX_250.dh[4, 0]
    for X in pose(WIDOWX_250, q):
        solutions = WIDOWX.inverse(X, limits=False)
        straight = np.abs(np.sin(solutions[:, 4])) < 1e-12
        assert straight.any()
        fourth = solutions[straight, 3] + WIDOWX_250.dh[3, 0]
        np.testing.assert_allclose(np.sin(fourth), 0, atol=1e-12)


def test_limits_that_rounding_would_pass_are_kept_one_by_one():
    # (lower + upper) / 2 + (upper - lower) / 2 is often not upper.
    rng = np.random.default_rng(4)
    for _ in range(100):
        lower, upper = rng.uniform(-3, -1, 6), rng.uniform(1, 3, 6)
        arm = ArmKinematics(replace(WIDOWX_250, lower=lower, upper=upper))
        for q in (lower, upper):
            solutions = arm.inverse(pose(WIDOWX_250, [q])[0])
            there = solutions[~np.isnan(solutions).any(axis=-1)]
            assert len(there) >= 1
            assert (there >= lower).all()
            assert (there <= upper).all()


def test_batch_of_one_keeps_its_shape():
    q = random_q(WIDOWX_250, 1)
    X_BT = pose(WIDOWX_250, q)
    for method, argument, shape in (
        (WIDOWX.forward, q, (4, 4)),
        (WIDOWX.jacobian, q, (6, 6)),
        (WIDOWX.joint_positions, q, (5, 3)),
        (WIDOWX.holding_torque, q, (6,)),
        (WIDOWX.inverse, X_BT, (8, 6)),
    ):
        one = method(argument[0])
        assert one.shape == shape
        np.testing.assert_array_equal(method(argument), one[None])
        np.testing.assert_array_equal(method(argument[None]), one[None, None])
        np.testing.assert_array_equal(method(argument[0].tolist()), one)
        assert one.flags.c_contiguous
        assert one.flags.writeable
    p, a = X_BT[:, :3, 3], X_BT[:, :3, 0]
    one = WIDOWX.inverse_axis(p[0], a[0])
    assert one.shape == (8, 6)
    np.testing.assert_array_equal(WIDOWX.inverse_axis(p, a[0]), one[None])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_joints_that_are_not_finite_give_what_they_give_in_the_batch(value):
    for i in range(6):
        q = random_q(WIDOWX_250, 1)
        q[0, i] = value
        for method in (
            WIDOWX.forward,
            WIDOWX.jacobian,
            WIDOWX.joint_positions,
            WIDOWX.holding_torque,
        ):
            with np.errstate(invalid="ignore"):
                alone, batch = method(q[0]), method(np.tile(q, (2, 1)))[0]
            if method == WIDOWX.forward:
                assert np.isnan(alone[:3]).any()
            np.testing.assert_array_equal(np.isnan(alone), np.isnan(batch))
            np.testing.assert_allclose(alone, batch, rtol=0, atol=ROUNDING)


def refusal(call, *arguments):
    try:
        call(*arguments)
    except ParameterError as error:
        return re.sub(r"\[0\] is", " is", str(error))  # X_BT[0] in a batch.
    return None


def test_one_is_refused_where_the_batch_is_and_in_the_same_words():
    refused = []
    for k, X_BT in enumerate(pose(WIDOWX_250, random_q(WIDOWX_250, 20))):
        for row, column in itertools.product(range(4), repeat=2):
            for change in (3e-8, -1e-5, 0.5, 1e200, np.nan, np.inf):
                spoilt = X_BT.copy()
                spoilt[row, column] += change
                message = refusal(WIDOWX.inverse, spoilt)
                batch = refusal(WIDOWX.inverse, [spoilt, X_BT])
                assert message == batch, (k, row, column, change)
                refused.append(message is not None)
    # All but small changes, and changes of the position that are finite.
    assert np.mean(refused) == pytest.approx((13 * 5 + 3 * 2) / 96, abs=1e-12)


def test_one_axis_is_refused_where_the_batch_is_and_in_the_same_words():
    X_BT = pose(WIDOWX_250, random_q(WIDOWX_250, 20))
    refused = []
    for p, a in zip(X_BT[:, :3, 3], X_BT[:, :3, 0], strict=True):
        for scale in (1 + 9e-7, 1 - 9e-7, 1 + 2e-6, 1 - 2e-6, 0, 1e200, np.nan):
            message = refusal(WIDOWX.inverse_axis, p, scale * a)
            batch = refusal(WIDOWX.inverse_axis, [p, p], [scale * a, a])
            assert message == batch
            refused.append(message is not None)
    assert np.mean(refused) == pytest.approx(5 / 7)
