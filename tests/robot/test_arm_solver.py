"""There and back, away from singularities and at square angles."""

import itertools
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.robot import (
    APPENDIX_C,
    WIDOWX_250,
    ArmKinematics,
)
from drake_mobarm.robot.batches import CHUNK
from helpers.arms import (
    PI,
    STRAIGHT,
    TURN,
    WIDOWX,
    all_arms,
    apart,
    arms,
    check_poses,
    jacobian_at,
    pose,
    random_q,
    regular,
)

# Nothing here may warn, out of reach and singular poses included.
pytestmark = pytest.mark.filterwarnings("error")


@pytest.mark.parametrize(("limits", "n"), [(True, 30_000), (False, 100_000)])
def test_all_solutions_reach_the_pose_and_one_is_the_arms_own(limits, n):
    q = random_q(WIDOWX_250, n, seed=2)
    X_BT = pose(WIDOWX_250, q)
    solutions = WIDOWX.inverse(X_BT, limits=limits)
    count = check_poses(WIDOWX_250, solutions, X_BT)
    away = regular(WIDOWX_250, q)
    assert away.mean() > 0.95
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    assert nearest[away].max() < 1e-6
    if limits:
        within = (solutions >= WIDOWX_250.lower) & (
            solutions <= WIDOWX_250.upper
        )
        assert (within | np.isnan(solutions)).all()
    else:
        assert (count[away] == 8).all()


@all_arms
def test_any_arms_solutions_reach_the_pose_and_one_is_its_own(parameters):
    q = random_q(parameters, 3000)
    X_BT = pose(parameters, q)
    solutions = ArmKinematics(parameters).inverse(X_BT, limits=False)
    count = check_poses(parameters, solutions, X_BT)
    away = regular(parameters, q)
    assert away.mean() > 0.9
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    assert nearest[away].max() < 1e-6
    # The side away from the wrist's centre may be too far for a shoulder
    # that is off the waist's axis.
    assert set(count[away]) <= ({4, 8} if parameters.dh[0, 2] else {8})


@arms
def test_solutions_differ(parameters):
    q = random_q(parameters, 5000)
    q = q[regular(parameters, q)]
    solutions = ArmKinematics(parameters).inverse(
        pose(parameters, q), limits=False
    )
    for i, j in itertools.combinations(range(8), 2):
        difference = apart(solutions[:, i], solutions[:, j])
        assert np.nanmin(difference) > 1e-4


def test_limits_leave_out_what_is_beyond_them_and_nothing_else():
    X_BT = pose(WIDOWX_250, random_q(WIDOWX_250, 20_000))
    every = WIDOWX.inverse(X_BT, limits=False)
    within = ((every > WIDOWX_250.lower) & (every < WIDOWX_250.upper)).all(-1)
    assert 0.3 < within.mean() < 0.7
    expected = np.where(within[..., None], every, np.nan)
    np.testing.assert_allclose(WIDOWX.inverse(X_BT), expected, atol=1e-15)


def test_order_is_waist_then_elbow_then_wrist():
    q = random_q(WIDOWX_250, 2000)
    q = q[regular(WIDOWX_250, q)]
    X_BT = pose(WIDOWX_250, q)
    s = WIDOWX.inverse(X_BT, limits=False).reshape(-1, 2, 2, 2, 6)
    p_BW = X_BT[:, :3, 3] - 0.158575 * X_BT[:, :3, 0]
    side = np.cos(s[..., 0]) * p_BW[:, 0].reshape(-1, 1, 1, 1)
    side += np.sin(s[..., 0]) * p_BW[:, 1].reshape(-1, 1, 1, 1)
    assert (side[:, 0] > 0).all()
    assert (side[:, 1] < 0).all()
    bend = np.sin(s[..., 2] - STRAIGHT)
    assert (bend[:, :, 0] > 0).all()
    assert (bend[:, :, 1] < 0).all()
    np.testing.assert_array_equal(s[..., 0, :3], s[..., 1, :3])
    first, second = s[..., 0, 3:], s[..., 1, 3:]
    assert apart(first * [1, -1, 1] + [PI, 0, PI], second).max() < 1e-9
    assert np.abs(np.sin(first[..., 1])).min() > 5e-4


def test_turn_is_the_one_nearest_to_the_middle_of_the_range():
    shifted = replace(
        WIDOWX_250,
        lower=[0, -9.0, -9.0, -2 * TURN, -9.0, 1.0],
        upper=[TURN, 8.0, 8.0, 2 * TURN, 9.0, 1.0 + TURN],
    )
    middle = np.array([PI, -0.5, -0.5, 0, 0, 1 + PI])
    X_BT = pose(WIDOWX_250, random_q(WIDOWX_250, 2000))
    arm = ArmKinematics(shifted)
    for limits in (False, True):
        solutions = arm.inverse(X_BT, limits=limits)
        assert not np.isnan(solutions).any()
        assert np.abs(solutions - middle).max() <= PI + 1e-12
        check_poses(shifted, solutions, X_BT)


ANGLES = st.tuples(*[st.floats(-PI, PI)] * 6)


@settings(max_examples=100)
@given(ANGLES)
@pytest.mark.parametrize("parameters", [WIDOWX_250, APPENDIX_C])
def test_there_and_back_from_any_joint_angles(parameters, q):
    X_BT = pose(parameters, [q])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        solutions = ArmKinematics(parameters).inverse(X_BT, limits=False)
    assert check_poses(parameters, solutions, X_BT) == 8
    if regular(parameters, [q])[0]:
        assert apart(solutions[0], np.array(q)).min() < 1e-6


@pytest.mark.parametrize(
    "values",
    [
        *([[lo, up, 0.0]] for lo, up in ((-PI, PI),)),
        [[-PI / 2, 0.0, PI / 2]],
        [[-PI, -PI / 2, PI]],
    ],
    ids=["half turns", "quarters", "more quarters"],
)
def test_square_angles_are_solved(values):
    q = np.array(list(itertools.product(values[0], repeat=6)))
    X_BT = pose(WIDOWX_250, q)
    solutions = WIDOWX.inverse(X_BT, limits=False)
    assert (check_poses(WIDOWX_250, solutions, X_BT) == 8).all()
    away = regular(WIDOWX_250, q)
    assert apart(solutions, q[:, None]).min(axis=1)[away].max(initial=0) < 1e-6


def test_joints_at_their_limits_are_solved_within_them():
    rng = np.random.default_rng(3)
    corners = list(
        itertools.product(*zip(WIDOWX_250.lower, WIDOWX_250.upper, strict=True))
    )
    edges = np.where(
        rng.random((5000, 6)) < 0.5,
        np.array(corners)[rng.integers(64, size=5000)],
        random_q(WIDOWX_250, 5000),
    )
    q = np.concatenate([corners, edges])
    X_BT = pose(WIDOWX_250, q)
    solutions = WIDOWX.inverse(X_BT)
    assert (check_poses(WIDOWX_250, solutions, X_BT) > 0).all()
    away = regular(WIDOWX_250, q)
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    assert nearest[away].max() < 1e-6
    there = solutions[~np.isnan(solutions).any(axis=-1)]
    assert (there >= WIDOWX_250.lower).all()
    assert (there <= WIDOWX_250.upper).all()


def test_limits_that_rounding_would_pass_are_kept():
    # (lower + upper) / 2 + (upper - lower) / 2 is often not upper.
    rng = np.random.default_rng(4)
    for _ in range(100):
        lower, upper = rng.uniform(-3, -1, 6), rng.uniform(1, 3, 6)
        parameters = replace(WIDOWX_250, lower=lower, upper=upper)
        q = np.array([lower, upper])
        solutions = ArmKinematics(parameters).inverse(pose(parameters, q))
        there = solutions[~np.isnan(solutions).any(axis=-1)]
        assert len(there) >= 2
        assert (there >= lower).all()
        assert (there <= upper).all()


# Poses as callers have them


def test_poses_of_single_precision_are_solved():
    q = random_q(WIDOWX_250, 5000)
    rough = pose(WIDOWX_250, q).astype(np.float32)
    solutions = WIDOWX.inverse(rough, limits=False)
    exact = np.array(rough, dtype=float)
    assert (check_poses(WIDOWX_250, solutions, exact, 1e-6) > 0).mean() > 0.99
    U, _, Vt = np.linalg.svd(exact[:, :3, :3])
    exact[:, :3, :3] = U @ Vt
    solutions = WIDOWX.inverse(exact, limits=False)
    count = check_poses(WIDOWX_250, solutions, exact)
    assert (count[regular(WIDOWX_250, q)] == 8).all()


def test_tools_along_the_axes_are_solved_wherever_they_are():
    rotations = []
    for axes in itertools.permutations(np.eye(3)):
        for signs in itertools.product([-1, 1], repeat=3):
            R = np.array(axes) * np.reshape(signs, (3, 1))
            if np.linalg.det(R) > 0:
                rotations.append(R)
    assert len(rotations) == 24
    steps = np.arange(-4, 5) / 8
    positions = np.array(list(itertools.product(steps, steps, steps)))
    X_BT = np.zeros((24, len(positions), 4, 4))
    X_BT[..., :3, :3] = np.array(rotations)[:, None]
    X_BT[..., :3, 3] = positions
    X_BT[..., 3, 3] = 1
    X_BT = X_BT.reshape(-1, 4, 4)
    count = check_poses(WIDOWX_250, WIDOWX.inverse(X_BT, limits=False), X_BT)
    # 0.5049 m: upper arm and forearm. 0.0049 m: one folded on the other.
    p_SW = X_BT[:, :3, 3] - 0.158575 * X_BT[:, :3, 0] - [0, 0, 0.11065]
    distance = np.linalg.norm(p_SW, axis=1)
    reached = (distance < 0.504902) & (distance > 0.004903)
    assert 0.1 < reached.mean() < 0.9
    np.testing.assert_array_equal(count, np.where(reached, 8, 0))


@pytest.mark.parametrize(
    "n", [0, 1, 2, *(m * CHUNK + k for m in (1, 2) for k in (-1, 0, 1))]
)
def test_batch_is_its_poses_one_by_one(n):
    q = random_q(WIDOWX_250, n)
    X_BT = pose(WIDOWX_250, q)
    solutions = WIDOWX.inverse(X_BT)
    assert solutions.shape == (n, 8, 6)
    some = {i for i in (0, 1, n // 2, CHUNK - 1, CHUNK, n - 1) if 0 <= i < n}
    for i in some:
        alone = WIDOWX.inverse(X_BT[i])
        assert alone.shape == (8, 6)
        np.testing.assert_allclose(solutions[i], alone, atol=1e-9)
    # Every row is there, and in its place.
    nearest = np.nanmin(apart(solutions, q[:, None]), axis=1)
    away = regular(WIDOWX_250, q)
    assert nearest[away].max(initial=0.0) < 1e-6
    np.testing.assert_allclose(WIDOWX.forward(q), X_BT, atol=1e-12)
    np.testing.assert_allclose(
        WIDOWX.jacobian(q), jacobian_at(WIDOWX_250, q, 6), atol=1e-12
    )


def test_results_have_the_shape_of_the_batch():
    q = random_q(WIDOWX_250, 6).reshape(2, 3, 6)
    X_BT = pose(WIDOWX_250, q.reshape(6, 6)).reshape(2, 3, 4, 4)
    for array, shape in (
        (WIDOWX.forward(q), (4, 4)),
        (WIDOWX.jacobian(q), (6, 6)),
        (WIDOWX.holding_torque(q, 0.1), (6,)),
        (WIDOWX.singularity_determinants(q), (2,)),
        (WIDOWX.inverse(X_BT), (8, 6)),
        (WIDOWX.inverse_axis(X_BT[..., :3, 3], X_BT[..., :3, 0]), (8, 6)),
    ):
        assert array.shape == (2, 3, *shape)
    one = q[1, 2]
    for method in (
        WIDOWX.forward,
        WIDOWX.jacobian,
        WIDOWX.holding_torque,
        WIDOWX.singularity_determinants,
    ):
        np.testing.assert_allclose(method(q)[1, 2], method(one), atol=1e-15)
        assert len(method(np.zeros((0, 6)))) == 0
    np.testing.assert_allclose(WIDOWX.forward(q), X_BT, atol=1e-12)
    alone = WIDOWX.inverse(X_BT[1, 2])
    np.testing.assert_allclose(WIDOWX.inverse(X_BT)[1, 2], alone, atol=1e-9)


def test_inputs_are_left_as_they_are():
    X_BT = pose(WIDOWX_250, random_q(WIDOWX_250, 5))
    before = X_BT.copy()
    WIDOWX.inverse(X_BT)
    WIDOWX.inverse_axis(X_BT[:, :3, 3], X_BT[:, :3, 0])
    np.testing.assert_array_equal(X_BT, before)
