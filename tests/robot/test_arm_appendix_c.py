"""Solutions are those of Appendix C as printed."""

import math

import numpy as np
import pytest

from drake_mobarm.robot import (
    APPENDIX_C,
    ArmKinematics,
)
from helpers.arms import (
    PI,
    X_6T,
    apart,
    pose,
    random_q,
    regular,
)

# Nothing here may warn, out of reach and singular poses included.
pytestmark = pytest.mark.filterwarnings("error")


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
