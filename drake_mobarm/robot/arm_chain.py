"""Frames and mass moments of an arm's links, for batches of positions."""

import numpy as np

from drake_mobarm.geometry import Array
from drake_mobarm.robot.arm_parameters import JOINTS, ArmParameters
from drake_mobarm.robot.arm_solver import ArmSolver

GRAVITY = 9.81
"""[m/s^2]"""


class ArmChain:
    """The links from the base to the tool.

    Attributes:
        mass: of each link [kg], (6,).
        com: its centre of mass in the DH frame that moves with it [m], (6, 3).

    Args:
        parameters: the arm.
        solver: its lengths.
    """

    def __init__(self, parameters: ArmParameters, solver: ArmSolver) -> None:
        self._offset, self._d, self._a = solver.offset, solver.d, solver.a
        self._sin = solver.sin
        self.mass = np.asarray(parameters.mass)
        self.com = self._com_in_links(np.asarray(parameters.com))

    def frames(self, q: Array) -> tuple[list[tuple[Array, ...]], list[Array]]:
        """Axes (x, y, z) and origins of DH frames 0 to 6.

        Args:
            q: joint positions [rad], (6, n).

        Returns:
            In B: three axes a frame, and its origin [m], (3, n) each.
        """
        theta = q + self._offset[:, None]
        cosines, sines = np.cos(theta), np.sin(theta)
        n = q.shape[1]
        x, y, z = (
            np.repeat(np.eye(3)[:, i, None], n, axis=1) for i in range(3)
        )
        origin = np.zeros((3, n))
        axes: list[tuple[Array, ...]] = [(x, y, z)]
        points = [origin]
        for i in range(JOINTS):
            c, s = cosines[i], sines[i]
            x, y = c * x + s * y, c * y - s * x
            if self._d[i]:
                origin = origin + self._d[i] * z
            if self._a[i]:
                origin = origin + self._a[i] * x
            if self._sin[i]:  # A quarter turn about x.
                y, z = self._sin[i] * z, -self._sin[i] * y
            axes.append((x, y, z))
            points.append(origin)
        return axes, points

    def load(self, q: Array, payload: float) -> tuple[Array, Array]:
        """What each joint carries.

        Args:
            q: joint positions [rad], (6, n).
            payload: mass at the tool's tip [kg].

        Returns:
            Joint axes [-] and, from the joint's origin, the mass moments
            sum(m p) of all that it moves [kg m], (6, 3, n) each.
        """
        axes, points = self.frames(q)
        moments = np.empty((JOINTS, *points[0].shape))
        mass, moment = payload, payload * points[JOINTS]
        for i in reversed(range(JOINTS)):
            x, y, z = axes[i + 1]
            c = self.com[i]
            com = points[i + 1] + c[0] * x + c[1] * y + c[2] * z
            mass = mass + self.mass[i]
            moment = moment + self.mass[i] * com
            moments[i] = moment - mass * points[i]
        return np.stack([axes[i][2] for i in range(JOINTS)]), moments

    def _com_in_links(self, p_BC: Array) -> Array:
        axes, points = self.frames(np.zeros((JOINTS, 1)))
        com = np.empty((JOINTS, 3))
        for i in range(JOINTS):
            R_BL = np.column_stack(axes[i + 1])
            com[i] = R_BL.T @ (p_BC[i] - points[i + 1][:, 0])
        return com


def holding_torque(axes: Array, moments: Array) -> Array:
    """Torques [N m], (k, n), that hold mass moments against gravity.

    Args:
        axes: joint axes [-], (k, 3, n).
        moments: mass moments from those axes [kg m], (k, 3, n).
    """
    turning = axes[:, 0] * moments[:, 1] - axes[:, 1] * moments[:, 0]
    return GRAVITY * turning
