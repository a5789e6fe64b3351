"""Peers that solve the arm's inverse kinematics, too: EAIK and Drake."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RotationMatrix
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.solvers import Solve

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot import WIDOWX_250
from drake_mobarm.robot.shape import URDF

try:
    from eaik.IK_DH import DhRobot
except ImportError:
    DhRobot = None

Array = NDArray[np.float64]

# What Drake's constraints leave free; it cannot hold an angle of zero.
POSITION_TOLERANCE = 1e-5
ANGLE_TOLERANCE = 1e-3
# Axes of the tool's frame in DH frame 6, which is EAIK's last.
X_6T = np.array([[0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1.0]])


class Eaik:
    """EAIK's solver for the same Denavit-Hartenberg rows."""

    def __init__(self) -> None:
        self.offset, d, a, alpha = np.asarray(WIDOWX_250.dh).T
        self.robot = DhRobot(alpha, a, d)

    @staticmethod
    def convert(X_BT: Array) -> list[Array]:
        """Poses as EAIK takes them, of DH frame 6."""
        return list(np.ascontiguousarray(X_BT @ X_6T.T))

    def gather(self, results: list[Any], *, approximate: bool = False) -> Array:
        """Solutions (n, 8, 6), NaN where there is none.

        Args:
            results: EAIK's.
            approximate: whether to keep what EAIK itself calls so.
        """
        count = np.array([len(result.Q) for result in results])
        rows = np.repeat(np.arange(len(results)), count)
        columns = np.arange(len(rows)) - np.repeat(
            np.cumsum(count) - count, count
        )
        solutions = np.concatenate([result.Q for result in results])
        if not approximate:
            poor = np.concatenate([result.is_LS for result in results])
            solutions[poor.astype(bool)] = np.nan
        q = np.full((len(results), 8, 6), np.nan)
        q[rows, columns] = solutions - self.offset
        return q


class DrakeSolver:
    """Drake's InverseKinematics on the plant, base and wheels held.

    Args:
        middle: of the joints' ranges [rad], (6,), where it starts.
    """

    def __init__(self, middle: Array) -> None:
        self.plant = MultibodyPlant(0.0)
        Parser(self.plant).AddModels(str(URDF))
        self.plant.WeldFrames(
            self.plant.world_frame(), self.plant.GetFrameByName("base")
        )
        self.plant.Finalize()
        self.base = self.plant.GetFrameByName("arm_base")
        self.tool = self.plant.GetFrameByName("tool")
        self.joints = [
            self.plant.GetJointByName(name).position_start()
            for name in ARM_JOINTS
        ]
        self.guess = np.zeros(self.plant.num_positions())
        self.guess[self.joints] = middle

    def solve(self, X_BT: Array) -> Array:
        """One solution, (1, 6), NaN if it finds none."""
        problem = InverseKinematics(self.plant)
        p_BT = X_BT[:3, 3]
        problem.AddPositionConstraint(
            frameB=self.tool,
            p_BQ=[0, 0, 0],
            frameA=self.base,
            p_AQ_lower=p_BT - POSITION_TOLERANCE,
            p_AQ_upper=p_BT + POSITION_TOLERANCE,
        )
        problem.AddOrientationConstraint(
            frameAbar=self.base,
            R_AbarA=RotationMatrix(X_BT[:3, :3]),
            frameBbar=self.tool,
            R_BbarB=RotationMatrix(),
            theta_bound=ANGLE_TOLERANCE,
        )
        wheels = np.delete(problem.q(), self.joints)
        problem.prog().AddBoundingBoxConstraint(0, 0, wheels)
        result = Solve(problem.prog(), self.guess)
        if not result.is_success():
            return np.full((1, 6), np.nan)
        q: Array = result.GetSolution(problem.q())[self.joints]
        return q[None]
