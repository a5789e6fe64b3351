"""There and back, at and near singularities."""

from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.robot import (
    APPENDIX_C,
    WIDOWX_250,
    ArmKinematics,
)
from helpers.arms import (
    KINDS,
    PI,
    PUMA_560,
    STRAIGHT,
    WIDOWX,
    apart,
    check_poses,
    frames,
    pose,
    random_q,
    regular,
    singular_q,
    small,
)

# Nothing here may warn, out of reach and singular poses included.
pytestmark = pytest.mark.filterwarnings("error")


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
