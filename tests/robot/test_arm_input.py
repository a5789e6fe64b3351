"""What no arm can make sense of is refused in one clear line."""

from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.robot import (
    WIDOWX_250,
    ArmKinematics,
)
from helpers.arms import PI, WIDOWX, apart, pose
from helpers.refusals import assert_refused

# Nothing here may warn, out of reach and singular poses included.
pytestmark = pytest.mark.filterwarnings("error")


# Bad input


@pytest.mark.parametrize(
    "p_BT",
    [
        [0.7, 0, 0.11],
        [0, 0, 0.8],
        [10, 10, 10],
        [1e10, 0, 0],
        [0, -1e160, 0],
        [1e308, -1e308, 1e308],
    ],
)
def test_pose_out_of_reach_has_no_solution(p_BT):
    X_BT = np.eye(4)
    X_BT[:3, 3] = p_BT
    for limits in (True, False):
        assert np.isnan(WIDOWX.inverse(X_BT, limits=limits)).all()
        solutions = WIDOWX.inverse_axis(p_BT, [1, 0, 0], limits=limits)
        assert solutions.shape == (8, 6)
        assert np.isnan(solutions).all()


def test_batch_may_mix_poses_within_and_out_of_reach():
    q = np.array([[0.3, 0.4, 0.5, 0.6, 0.7, 0.8]])
    near, far = pose(WIDOWX_250, q)[0], np.eye(4)
    far[0, 3] = 1e200
    solutions = WIDOWX.inverse([far, near, far])
    assert np.isnan(solutions[[0, 2]]).all()
    assert np.nanmin(apart(solutions[1], q)) < 1e-9


def test_joints_that_are_nan_give_nan():
    q = np.zeros((2, 6))
    q[1] = np.nan
    for method in (WIDOWX.jacobian, WIDOWX.holding_torque):
        result = method(q)
        assert np.isfinite(result[0]).all()
        assert np.isnan(result[1]).any()
    X_BT = WIDOWX.forward(q)
    assert np.isfinite(X_BT[0]).all()
    assert np.isnan(X_BT[1, :3]).all()


def spoilt(**entries):
    X_BT = np.eye(4)
    for where, value in entries.items():
        X_BT[int(where[1]), int(where[2])] = value
    return X_BT


@pytest.mark.parametrize(
    "X_BT",
    [
        np.eye(3),
        np.zeros((2, 3, 4)),
        np.zeros(0),
        5.0,
        None,
        "X",
        [["x"] * 4] * 4,
        [[1, 2], [3]],
        np.zeros((4, 4)),
        2 * np.eye(4),
        np.diag([1.1, 1.1, 1.1, 1]),
        np.diag([2, 0.5, 1, 1]),
        np.diag([1, 1, -1, 1]),
        np.diag([-1, -1, -1, 1]),
        np.diag([1, 1, 1 + 1e-5, 1]),
        np.diag([1, 1, 1, 0.5]),
        # A left-over of x and y that are not square, and their product.
        spoilt(_01=0.6, _11=0.8, _22=0.8),
        spoilt(_01=0.3),
        spoilt(_12=1e-5),
        spoilt(_00=np.nan),
        spoilt(_00=np.inf),
        spoilt(_11=1e200),
        spoilt(_03=np.nan),
        spoilt(_23=np.inf),
        spoilt(_31=np.nan),
        spoilt(_30=0.1),
        [np.eye(4), spoilt(_22=np.nan)],
    ],
)
def test_what_is_not_a_pose_is_refused(X_BT):
    assert_refused("X_BT", WIDOWX.inverse, X_BT)


def test_first_pose_that_is_wrong_is_named():
    batch = np.tile(np.eye(4), (2, 3, 1, 1))
    batch[1, 1, 0, 0] = np.nan
    assert_refused(r"X_BT\[4\] is \[\[nan, 0.0", WIDOWX.inverse, batch)


@pytest.mark.parametrize(
    ("p_BT", "a_B", "name"),
    [
        ([0, 0, 0.3], [0, 0, 0], "a_B"),
        ([0, 0, 0.3], [0, 0, 1.1], "a_B"),
        ([0, 0, 0.3], [1, 1, 0], "a_B"),
        ([0, 0, 0.3], [np.nan, 0, 1], "a_B"),
        ([0, 0, 0.3], [np.inf, 0, 0], "a_B"),
        ([0, 0, 0.3], [1e200, 0, 0], "a_B"),
        ([0, 0, 0.3], [1, 0], "a_B"),
        ([0, 0, 0.3], "up", "a_B"),
        ([np.nan, 0, 0.3], [1, 0, 0], "p_BT"),
        ([np.inf, 0, 0.3], [1, 0, 0], "p_BT"),
        ([0, 0.3], [1, 0, 0], "p_BT"),
        (0.3, [1, 0, 0], "p_BT"),
        ("here", [1, 0, 0], "p_BT"),
        ([[0, 0], [0]], [1, 0, 0], "p_BT"),
        (np.zeros((2, 3)), np.zeros((4, 3)), "p_BT"),
    ],
)
def test_what_is_not_a_point_and_an_axis_is_refused(p_BT, a_B, name):
    assert_refused(name, WIDOWX.inverse_axis, p_BT, a_B)


@pytest.mark.parametrize(
    "q", [0.0, [0.0] * 5, np.zeros((6, 2)), "joints", ["a"] * 6, None]
)
def test_what_is_not_six_joints_is_refused(q):
    for method in (
        WIDOWX.forward,
        WIDOWX.jacobian,
        WIDOWX.holding_torque,
        WIDOWX.singularity_determinants,
    ):
        assert_refused("q", method, q)


@pytest.mark.parametrize("payload", [-0.1, np.nan, np.inf])
def test_payload_out_of_range_is_refused(payload):
    assert_refused("payload", WIDOWX.holding_torque, np.zeros(6), payload)


@pytest.mark.parametrize(
    ("row", "column", "value", "name"),
    [
        *((row, 3, 0.3, f"alpha {row + 1}") for row in range(6)),
        (0, 3, 0.0, "alpha 1"),
        (1, 3, PI / 2, "alpha 2"),
        (2, 3, PI, "alpha 3"),
        (3, 3, 0.0, "alpha 4"),
        (4, 3, PI, "alpha 5"),
        (5, 3, PI / 2, "alpha 6"),
        (4, 1, 0.01, "d 5"),
        (3, 2, 0.01, "a 4"),
        (4, 2, 0.01, "a 5"),
        (5, 2, 0.01, "a 6"),
        (1, 2, 0.0, ""),
        (3, 1, 0.0, ""),
    ],
)
def test_arm_that_this_form_does_not_solve_is_refused(row, column, value, name):
    dh = np.array(WIDOWX_250.dh)
    dh[row, column] = value
    parameters = replace(WIDOWX_250, dh=dh)
    assert_refused(f"dh: {name}" if name else "dh", ArmKinematics, parameters)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("dh", np.zeros((6, 3))),
        ("dh", np.zeros((5, 4))),
        ("dh", "table"),
        ("dh", [[1], [2, 3]]),
        ("dh", np.full((6, 4), np.nan)),
        ("lower", [0.0] * 5),
        ("lower", None),
        ("lower", WIDOWX_250.upper),
        ("lower", [*WIDOWX_250.lower[:5], 4.0]),
        ("upper", [np.inf] * 6),
        ("torque_limit", [0.0] * 6),
        ("torque_limit", np.ones((6, 1))),
        ("mass", [-0.1] * 6),
        ("mass", 1.0),
        ("com", np.zeros((3, 6))),
        ("com", [["x"] * 3] * 6),
    ],
)
def test_parameters_out_of_range_are_refused(name, value):
    assert_refused(name, replace, WIDOWX_250, **{name: value})


def test_parameters_cannot_be_changed_afterwards():
    table = np.array(WIDOWX_250.dh)
    parameters = replace(WIDOWX_250, dh=table)
    table[0, 1] = 9.0
    assert parameters.dh[0, 1] == 0.11065
    with pytest.raises(ValueError, match="read-only"):
        parameters.dh[0, 1] = 1.0
