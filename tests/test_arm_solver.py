"""There and back, singular poses, and Appendix C as printed."""

import itertools
import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from arms import (
    PI,
    PUMA_560,
    STRAIGHT,
    TURN,
    WIDOWX,
    X_6T,
    all_arms,
    apart,
    arms,
    check_poses,
    frames,
    jacobian_at,
    pose,
    random_q,
    regular,
    small,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.robot import (
    APPENDIX_C,
    WIDOWX_250,
    ArmKinematics,
)
from drake_mobarm.robot.batches import CHUNK

# Nothing here may warn, out of reach and singular poses included.
pytestmark = pytest.mark.filterwarnings("error")


# Inverse: away from singularities


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


# Inverse: at and near singularities


def waist_singular(q, radius, sign):
    """Sets the shoulder so that the wrist's centre is at a radius.

    With the links of the URDF in the plane: the dog-leg turned by the
    shoulder, the forearm by shoulder and elbow.
    """
    forward = 0.04975 + 0.25 * np.cos(q[:, 2])
    up = 0.25 - 0.25 * np.sin(q[:, 2])
    lean = np.arccos(np.clip(radius / np.hypot(forward, up), -1, 1))
    q[:, 1] = np.arctan2(up, forward) + sign * lean


def singular_q(kind, n=10_000, parameters=WIDOWX_250):
    rng = np.random.default_rng(5)
    q = rng.uniform(parameters.lower, parameters.upper, (n, 6))
    straight = STRAIGHT if parameters is WIDOWX_250 else 0.0
    if kind == "threshold":
        q[:, 4] = small(rng, n, -13, -9)
    if kind in ("wrist", "wrist and elbow", "all"):
        q[:, 4] = small(rng, n)
    if kind in ("elbow", "wrist and elbow", "all"):
        q[:, 2] = straight + small(rng, n)
    if kind == "folded":
        q[:, 2] = straight + PI + small(rng, n)
    if kind in ("waist", "waist and wrist", "all"):
        waist_singular(q, small(rng, n), rng.choice([-1, 1], n))
    if kind == "waist and wrist":
        q[:, 4] = small(rng, n)
    if kind == "upright":
        q[:, 2], q[:, 4] = straight, 0.0  # All at once, the tool straight up.
        waist_singular(q, np.zeros(n), -1)
    return q


KINDS = [
    *("wrist", "threshold", "elbow", "folded", "waist", "upright"),
    *("wrist and elbow", "waist and wrist", "all"),
]


@pytest.mark.parametrize("kind", KINDS)
def test_near_a_singularity_every_solution_reaches_the_pose(kind):
    q = singular_q(kind)
    X_BT = pose(WIDOWX_250, q)
    every = WIDOWX.inverse(X_BT, limits=False)
    assert (check_poses(WIDOWX_250, every, X_BT) == 8).all()
    assert not regular(WIDOWX_250, q).all()
    check_poses(WIDOWX_250, WIDOWX.inverse(X_BT), X_BT)


@pytest.mark.parametrize(
    "kind", ["wrist", "threshold", "elbow", "wrist and elbow"]
)
def test_singular_wrist_or_elbow_leaves_a_solution_within_limits(kind):
    q = singular_q(kind)
    X_BT = pose(WIDOWX_250, q)
    assert (check_poses(WIDOWX_250, WIDOWX.inverse(X_BT), X_BT) > 0).all()


@pytest.mark.parametrize("kind", ["wrist", "elbow", "wrist and elbow"])
def test_arm_of_appendix_c_is_solved_where_it_is_singular(kind):
    q = singular_q(kind, parameters=APPENDIX_C)
    X_BT = pose(APPENDIX_C, q)
    solutions = ArmKinematics(APPENDIX_C).inverse(X_BT)
    assert (check_poses(APPENDIX_C, solutions, X_BT) == 8).all()


def test_free_joints_stay_where_the_docstring_says():
    q = singular_q("wrist")
    q = q[q[:, 4] == 0]
    assert len(q) > 500
    # The wrist is straight in one of its two solutions with the own elbow.
    solutions = WIDOWX.inverse(pose(WIDOWX_250, q), limits=False)
    own = apart(solutions[..., :3], q[:, None, :3]) < 1e-6
    assert (own.sum(axis=1) >= 2).all()
    rolls = np.sort(np.abs(solutions[..., 3][own]).reshape(-1, 2), axis=1)
    np.testing.assert_allclose(rolls, np.tile([0, PI], (len(q), 1)), atol=1e-12)


def test_determinants_vanish_where_the_arm_is_singular():
    for kind, column in (("wrist", 1), ("elbow", 0), ("waist", 0)):
        q = singular_q(kind)
        exact = {
            "wrist": q[:, 4] == 0,
            "elbow": q[:, 2] == STRAIGHT,
            "waist": np.hypot(*(frames(WIDOWX_250, q)[5, :, :2, 3]).T) < 1e-15,
        }[kind]
        assert exact.sum() > 500
        determinants = WIDOWX.singularity_determinants(q)
        assert np.abs(determinants[exact, column]).max() < 1e-15
        other = WIDOWX.singularity_determinants(random_q(WIDOWX_250, 100))
        assert np.median(np.abs(other[:, column])) > 1e-3


def test_folded_arm_with_equal_links_is_solved():
    # Then the wrist's centre may lie at the shoulder itself.
    dh = np.array(APPENDIX_C.dh)
    dh[1, 2] = dh[2, 2] = 1.0
    parameters = replace(APPENDIX_C, dh=dh)
    rng = np.random.default_rng(6)
    q = random_q(parameters, 10_000)
    q[:, 2] = PI + small(rng, len(q), -12, -3)
    X_BT = pose(parameters, q)
    solutions = ArmKinematics(parameters).inverse(X_BT, limits=False)
    assert (check_poses(parameters, solutions, X_BT, 1e-10) == 8).all()


@pytest.mark.parametrize("side", [1e-9, 1e-5, 0.15])
def test_wrist_cannot_come_nearer_to_the_waist_than_its_offset(side):
    dh = np.array(PUMA_560.dh)
    dh[2, 1] = side
    parameters = replace(PUMA_560, dh=dh)
    kinematics = ArmKinematics(parameters)
    rng = np.random.default_rng(7)
    # Directions and heights are of no matter: the tool points anywhere.
    X_BT = pose(parameters, random_q(parameters, 2000))
    heading = rng.uniform(-PI, PI, 2000)
    for ratio, reached in ((1 + 1e-6, True), (1 - 1e-14, True), (0.1, None)):
        p_BW = np.column_stack(
            [
                ratio * side * np.cos(heading),
                ratio * side * np.sin(heading),
                rng.uniform(0.5, 0.8, 2000),
            ]
        )
        X_BT[:, :3, 3] = p_BW + 0.05625 * X_BT[:, :3, 0]
        count = check_poses(
            parameters, kinematics.inverse(X_BT, limits=False), X_BT
        )
        if reached:
            assert (count == 8).mean() > 0.9
        elif side > 1e-8:
            assert (count == 0).all()


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


# A point along an axis


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


# Appendix C as printed


def atan2(x, y):
    """With the order of arguments that Appendix C has."""
    return math.atan2(y, x)


def appendix_c(X_BT):
    """The printed formulas; corrected are misprints and a sign."""
    d_1, d_2, d_6 = 0.11065, 0.0, 0.158575
    a_2, a_3 = math.hypot(0.04975, 0.25), 0.25
    R = X_BT[:3, :3] @ X_6T[:3, :3].T
    (r_11, r_12, r_13), (r_21, r_22, r_23), (_, _, r_33) = R
    x_w, y_w, z_w = X_BT[:3, 3] - d_6 * R[:, 2]
    D = (x_w**2 + y_w**2 - d_2**2 + (z_w - d_1) ** 2 - a_2**2 - a_3**2) / (
        2 * a_2 * a_3
    )
    solutions = []
    for q_1, toward in (
        (atan2(x_w, y_w), 1),
        # The radial distance of the second is negative: printed it is not.
        (PI + atan2(x_w, y_w), -1),
    ):
        radial = toward * math.sqrt(x_w**2 + y_w**2 - d_2**2)
        for bend in (1, -1):
            q_3 = atan2(D, bend * math.sqrt(1 - D**2))
            q_2 = atan2(radial, z_w - d_1) - atan2(
                a_2 + a_3 * math.cos(q_3), a_3 * math.sin(q_3)
            )
            c_1, s_1 = math.cos(q_1), math.sin(q_1)
            c_23, s_23 = math.cos(q_2 + q_3), math.sin(q_2 + q_3)
            along = c_1 * c_23 * r_13 + s_1 * c_23 * r_23 + s_23 * r_33
            across = -c_1 * s_23 * r_13 - s_1 * s_23 * r_23 + c_23 * r_33
            cosine = s_1 * r_13 - c_1 * r_23
            sine = math.sqrt(1 - cosine**2)
            solutions.append(
                [
                    *(q_1, q_2, q_3, atan2(along, across)),
                    atan2(cosine, sine),
                    atan2(-s_1 * r_11 + c_1 * r_21, s_1 * r_12 - c_1 * r_22),
                ]
            )
            solutions.append(
                [
                    *(q_1, q_2, q_3, atan2(-along, -across)),
                    atan2(cosine, -sine),
                    atan2(s_1 * r_11 - c_1 * r_21, -s_1 * r_12 + c_1 * r_22),
                ]
            )
    return np.array(solutions)


def test_solutions_are_those_that_appendix_c_prints():
    q = random_q(APPENDIX_C, 1100)
    q = q[regular(APPENDIX_C, q)][:1000]
    assert len(q) == 1000
    X_BT = pose(APPENDIX_C, q)
    solutions = ArmKinematics(APPENDIX_C).inverse(X_BT)
    for ours, target in zip(solutions, X_BT, strict=True):
        distance = apart(ours[:, None], appendix_c(target)[None])
        # One of the printed for each of ours, and the other way round.
        assert distance.min(axis=0).max() < 1e-8
        assert distance.min(axis=1).max() < 1e-8


def test_arm_of_appendix_c_is_stretched_forward_and_points_right():
    length = math.hypot(0.04975, 0.25) + 0.25
    X_BT = ArmKinematics(APPENDIX_C).forward(np.zeros(6))
    np.testing.assert_allclose(
        X_BT[:3, 3], [length, -0.158575, 0.11065], atol=1e-12
    )
    np.testing.assert_allclose(X_BT[:3, 0], [0, -1, 0], atol=1e-12)
