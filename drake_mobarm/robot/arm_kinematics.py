"""Closed-form kinematics and statics of six-joint arms: Appendix C, 7.3.2."""

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import require
from drake_mobarm.exceptions import ParameterError
from drake_mobarm.geometry import Array
from drake_mobarm.robot.arm_parameters import (
    JOINTS,
    WIDOWX_250,
    ArmParameters,
)
from drake_mobarm.robot.arm_solver import SOLUTIONS, ArmSolver
from drake_mobarm.robot.batches import (
    check_directions,
    check_poses,
    chunks,
    cross,
    flatten,
    numbers,
    refuse,
)

GRAVITY = 9.81
"""[m/s^2]"""

# Squares that overflow far out of reach need no warning: they, too, are out.
_FAR = np.errstate(over="ignore", invalid="ignore")


class ArmKinematics:
    """An arm with two parallel axes and a spherical wrist, on paper.

    Frames: B is the arm's base, z along the waist's axis. T is the tool's
    tip: x along the last joint's axis, which is the approach, and z along the
    x axis of DH frame 6.

    The two conventions of the wrist differ in alpha of the third row. With
    a quarter turn the fourth joint rolls the forearm (the WidowX 250, most
    industrial arms); with none its axis is parallel to the elbow's, as
    Appendix C has it.

    Args:
        parameters: the arm; `WIDOWX_250`, `APPENDIX_C` or your own.

    Raises:
        ParameterError: the DH rows are of an arm that this closed form does
            not solve.
    """

    def __init__(self, parameters: ArmParameters = WIDOWX_250) -> None:
        self.parameters = parameters
        self.lower = np.asarray(parameters.lower)
        self.upper = np.asarray(parameters.upper)
        self.torque_limit = np.asarray(parameters.torque_limit)
        self._solver = solver = ArmSolver(parameters)
        self._offset, self._d, self._a = solver.offset, solver.d, solver.a
        self._sin = solver.sin
        # Constant factors of det J11 [m^2] and det J22 [-].
        self._arm_volume = -self._sin[0] * solver.upper_arm * solver.forearm
        self._wrist_volume = self._sin[3] * self._sin[4]
        self._mass = np.asarray(parameters.mass)
        self._com = self._com_in_links(np.asarray(parameters.com))

    @property
    def shoulder(self) -> Array:
        """p_BS [m], (3,), where the waist's axis meets the shoulder's."""
        return np.array([0.0, 0.0, self._d[0]])

    @property
    def reach(self) -> float:
        """The tip is never farther from `shoulder` than this [m]."""
        return float(
            abs(self._a[0])
            + np.hypot(
                self._solver.upper_arm + self._solver.forearm, self._solver.side
            )
            + abs(self._d[5])
        )

    @property
    def hand(self) -> float:
        """From the wrist's centre to the tip, along the approach [m]."""
        return float(self._d[5])

    def forward(self, q: ArrayLike) -> Array:
        """Pose of the tool's tip, (7.10).

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            X_BT, (..., 4, 4); NaN where q is.
        """
        batch, rows = flatten(q, (JOINTS,), "q")
        X_BT = np.zeros((len(rows), 4, 4))
        X_BT[:, 3, 3] = 1.0
        for part in chunks(len(rows)):
            axes, points = self._chain(rows[part].T)
            x, y, z = axes[JOINTS]
            X_BT[part, :3, :] = np.stack(
                [z, -y, x, points[JOINTS]], axis=0
            ).transpose(2, 1, 0)
        return X_BT.reshape(*batch, 4, 4)

    def joint_positions(self, q: ArrayLike) -> Array:
        """Where the arm is.

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            In B [m], (..., 5, 3): the base, the shoulder, the elbow, the
            wrist's centre and the tip.
        """
        batch, rows = flatten(q, (JOINTS,), "q")
        corners = np.empty((len(rows), 5, 3))
        for part in chunks(len(rows)):
            _, points = self._chain(rows[part].T)
            for i, frame in enumerate((0, 1, 2, 4, 6)):
                corners[part, i] = points[frame].T
        return corners.reshape(*batch, 5, 3)

    def jacobian(self, q: ArrayLike) -> Array:
        """Geometric Jacobian at the tool's tip.

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            (..., 6, 6): rows v [m/rad], then w [-], in B; a column a joint.
        """
        batch, rows = flatten(q, (JOINTS,), "q")
        J = np.empty((len(rows), 6, JOINTS))
        for part in chunks(len(rows)):
            axes, points = self._chain(rows[part].T)
            columns = np.empty((6, JOINTS, len(rows[part])))
            for i in range(JOINTS):
                axis = axes[i][2]
                columns[:3, i] = cross(axis, points[JOINTS] - points[i])
                columns[3:, i] = axis
            J[part] = columns.transpose(2, 0, 1)
        return J.reshape(*batch, 6, JOINTS)

    def holding_torque(self, q: ArrayLike, payload: float = 0.0) -> Array:
        """Torques that hold the arm still: g(q) of (7.11).

        Args:
            q: joint positions [rad], (..., 6).
            payload: mass at the tool's tip [kg].

        Returns:
            [N m], (..., 6).

        Raises:
            ParameterError: the payload is negative or not finite.
        """
        _require_payload(payload)
        batch, rows = flatten(q, (JOINTS,), "q")
        torque = np.empty((len(rows), JOINTS))
        for part in chunks(len(rows)):
            axes, moments = self._load(rows[part].T, payload)
            torque[part] = _rise(axes, moments).T
        return torque.reshape(*batch, JOINTS)

    def holding_torque_and_derivative(
        self, q: ArrayLike, payload: float = 0.0
    ) -> tuple[Array, Array]:
        """`holding_torque`, and its derivative by the joints.

        Args:
            q: joint positions [rad], (..., 6).
            payload: mass at the tool's tip [kg].

        Returns:
            [N m], (..., 6), and [N m/rad], (..., 6, 6), symmetric: gradient
            and Hessian of the potential energy.

        Raises:
            ParameterError: the payload is negative or not finite.
        """
        _require_payload(payload)
        batch, rows = flatten(q, (JOINTS,), "q")
        torque = np.empty((len(rows), JOINTS))
        derivative = np.empty((len(rows), JOINTS, JOINTS))
        for part in chunks(len(rows)):
            axes, moments = self._load(rows[part].T, payload)
            torque[part] = _rise(axes, moments).T
            for j in range(JOINTS):
                # Joint j moves only what hangs on it.
                turned = cross(axes[j], moments[j])
                rise = _rise(axes[: j + 1], turned[None]).T
                derivative[part, : j + 1, j] = rise
                derivative[part, j, : j + 1] = rise
        return (
            torque.reshape(*batch, JOINTS),
            derivative.reshape(*batch, JOINTS, JOINTS),
        )

    @_FAR
    def inverse(self, X_BT: ArrayLike, *, limits: bool = True) -> Array:
        """All joint positions that take the tool to a pose, Appendix C.

        Where the arm is singular a joint that is free stays at a valid
        place: the waist anywhere, the forearm's roll at its DH zero.

        Args:
            X_BT: pose of the tool's tip, (..., 4, 4).
            limits: whether to leave out what is beyond the joints' limits.

        Returns:
            [rad], (..., 8, 6), NaN where there is none. In this order: waist
            towards the wrist's centre, then away from it; in each the elbow
            bent one way, then the other; in each the two wrists. An angle
            that may be given in several turns is the one nearest to the
            middle of its joint's range.

        Raises:
            ParameterError: a wrong shape, NaN, or not a pose.
        """
        batch, poses = flatten(X_BT, (4, 4), "X_BT")
        check_poses(poses)
        q = np.empty((len(poses), SOLUTIONS, JOINTS))
        for part in chunks(len(poses)):
            # Frame 6 has the tool's x axis as z, its y as -y, its z as x.
            tool = np.ascontiguousarray(poses[part, :3].transpose(2, 1, 0))
            x6, y6, z6, tip = tool[2], -tool[1], tool[0], tool[3]
            q[part] = self._solver.solve(
                tip - self._d[5] * z6, z6, x6, y6, limits
            )
        return q.reshape(*batch, SOLUTIONS, JOINTS)

    @_FAR
    def inverse_axis(
        self, p_BT: ArrayLike, a_B: ArrayLike, *, limits: bool = True
    ) -> Array:
        """All joint positions that take the tip to a point along an axis.

        As `inverse`, with the sixth joint, which turns the tool about its
        approach, left at 0.

        Args:
            p_BT: where the tip has to be [m], (..., 3).
            a_B: its approach, the tool's x axis, a unit vector, (..., 3).
            limits: whether to leave out what is beyond the joints' limits.

        Returns:
            [rad], (..., 8, 6), NaN where there is none.

        Raises:
            ParameterError: a wrong shape, NaN, or not a unit vector.
        """
        p, a = numbers(p_BT, (3,), "p_BT"), numbers(a_B, (3,), "a_B")
        try:
            p, a = np.broadcast_arrays(p, a)
        except ValueError:
            raise ParameterError(
                f"p_BT {p.shape} and a_B {a.shape} do not go together: valid "
                "is (..., 3) each"
            ) from None
        batch, points = flatten(p, (3,), "p_BT")
        _, axes = flatten(a, (3,), "a_B")
        refuse(np.any(~np.isfinite(points), axis=1), points, "p_BT", "finite")
        check_directions(axes, "a_B")
        q = np.empty((len(points), SOLUTIONS, JOINTS))
        for part in chunks(len(points)):
            z6 = np.ascontiguousarray(axes[part].T)
            tip = points[part].T
            q[part] = self._solver.solve(
                tip - self._d[5] * z6, z6, None, None, limits
            )
        return q.reshape(*batch, SOLUTIONS, JOINTS)

    def singularity_determinants(self, q: ArrayLike) -> Array:
        """Determinants of J11 and J22, (4.8), at the wrist's centre.

        There J12 = 0, and the product is the determinant of the whole
        Jacobian, at the wrist's centre as at the tip.

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            [m^3, -], (..., 2): zero where the arm, or the wrist, is singular.
        """
        batch, rows = flatten(q, (JOINTS,), "q")
        theta = (rows + self._offset).T
        elbow = theta[2] + self._solver.forearm_angle
        _, radius = self._wrist_radius(theta)
        arm = self._arm_volume * np.sin(elbow) * radius
        wrist = self._wrist_volume * np.sin(theta[4])
        return np.stack([arm, wrist], axis=-1).reshape(*batch, 2)

    def singularity_determinants_derivative(self, q: ArrayLike) -> Array:
        """Derivative of `singularity_determinants` by the joints.

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            [m^3/rad, 1/rad], (..., 2, 6).
        """
        batch, rows = flatten(q, (JOINTS,), "q")
        theta = (rows + self._offset).T
        elbow = theta[2] + self._solver.forearm_angle
        height, radius = self._wrist_radius(theta)
        forearm_height = self._solver.forearm * np.sin(theta[1] + elbow)
        derivative = np.zeros((len(rows), 2, JOINTS))
        derivative[:, 0, 1] = -self._arm_volume * np.sin(elbow) * height
        derivative[:, 0, 2] = self._arm_volume * (
            np.cos(elbow) * radius - np.sin(elbow) * forearm_height
        )
        derivative[:, 1, 4] = self._wrist_volume * np.cos(theta[4])
        return derivative.reshape(*batch, 2, JOINTS)

    def _wrist_radius(self, theta: Array) -> tuple[Array, Array]:
        """The wrist's centre in the arm's plane; theta as DH has it, (6, n).

        Returns:
            Its height over the shoulder, up or down as the plane is turned,
            and its signed distance from the waist's axis [m], (n,) each.
        """
        elbow = theta[1] + theta[2] + self._solver.forearm_angle
        a2, f = self._solver.upper_arm, self._solver.forearm
        return (
            a2 * np.sin(theta[1]) + f * np.sin(elbow),
            self._a[0] + a2 * np.cos(theta[1]) + f * np.cos(elbow),
        )

    def _load(self, q: Array, payload: float) -> tuple[Array, Array]:
        """What each joint carries; q is (6, n).

        Returns:
            Joint axes [-] and, from the joint's origin, the mass moments
            sum(m p) of all that it moves [kg m], (6, 3, n) each.
        """
        axes, points = self._chain(q)
        moments = np.empty((JOINTS, *points[0].shape))
        mass, moment = payload, payload * points[JOINTS]
        for i in reversed(range(JOINTS)):
            x, y, z = axes[i + 1]
            c = self._com[i]
            com = points[i + 1] + c[0] * x + c[1] * y + c[2] * z
            mass = mass + self._mass[i]
            moment = moment + self._mass[i] * com
            moments[i] = moment - mass * points[i]
        return np.stack([axes[i][2] for i in range(JOINTS)]), moments

    def _chain(self, q: Array) -> tuple[list[tuple[Array, ...]], list[Array]]:
        """Axes (x, y, z) and origins of DH frames 0 to 6; q is (6, n)."""
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

    def _com_in_links(self, p_BC: Array) -> Array:
        axes, points = self._chain(np.zeros((JOINTS, 1)))
        com = np.empty((JOINTS, 3))
        for i in range(JOINTS):
            R_BL = np.column_stack(axes[i + 1])
            com[i] = R_BL.T @ (p_BC[i] - points[i + 1][:, 0])
        return com


def _require_payload(payload: float) -> None:
    known = isinstance(payload, int | float | np.floating | np.integer)
    require(
        known and 0 <= payload < np.inf,
        "payload",
        payload,
        "a mass of 0 kg or more",
    )


def _rise(axes: Array, moments: Array) -> Array:
    """Gravity's share [N m], (k, n), in turning mass moments about axes."""
    turning = axes[:, 0] * moments[:, 1] - axes[:, 1] * moments[:, 0]
    return GRAVITY * turning
