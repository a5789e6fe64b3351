"""Closed-form kinematics and statics of six-joint arms: Appendix C, 7.3.2."""

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import require
from drake_mobarm.exceptions import ParameterError
from drake_mobarm.geometry import Array
from drake_mobarm.robot.arm_chain import ArmChain, holding_torque
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
    is_direction,
    is_pose,
    lone,
    numbers,
    refuse,
)
from drake_mobarm.robot.single_pose import SinglePose


class ArmKinematics:
    """Kinematics and statics of a six-joint arm with a spherical wrist.

    The axes of its shoulder and elbow are parallel.

    Frames: B is the arm's base, with z along the waist's axis. T is the
    tool's tip, with x along the last joint's axis, which is the approach
    direction, and z along the x axis of DH frame 6.

    Two kinds of arms differ in alpha of the third DH row. Where it is a
    quarter turn the fourth joint rolls the forearm (the WidowX 250, most
    industrial arms); where it is 0 that joint's axis is parallel to the
    elbow's, as in Appendix C.

    A single pose is computed in Python's floats, a batch by numpy. The two
    may differ in the last bits. Near a singular wrist rounding moves the
    fourth and the sixth angle of `inverse` by more, against each other, so
    that the tool's pose stays the same.

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
        self._chain = ArmChain(parameters, solver)
        self._single = SinglePose(solver, self._chain)
        # Constant factors of det J11 [m^2] and det J22 [-].
        sin = solver.sin
        self._arm_factor = -sin[0] * solver.upper_arm * solver.forearm
        self._wrist_factor = sin[3] * sin[4]

    @property
    def shoulder(self) -> Array:
        """p_BS [m], (3,), on the waist's axis, as high as the shoulder's."""
        return np.array([0.0, 0.0, self._solver.d[0]])

    @property
    def reach(self) -> float:
        """No tip is farther from `shoulder` than this [m]."""
        arm = self._solver
        stretched = np.hypot(arm.upper_arm + arm.forearm, arm.side)
        return float(abs(arm.a[0]) + stretched + abs(arm.d[5]))

    @property
    def hand(self) -> float:
        """Length from the wrist's centre to the tip, along the approach [m]."""
        return float(self._solver.d[5])

    def forward(self, q: ArrayLike) -> Array:
        """Pose of the tool's tip, (7.10).

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            X_BT, (..., 4, 4); NaN where q is.
        """
        batch, rows = flatten(q, (JOINTS,), "q")
        if (one := lone(rows)) is not None:
            return np.array(self._single.forward(one)).reshape(*batch, 4, 4)
        X_BT = np.zeros((len(rows), 4, 4))
        X_BT[:, 3, 3] = 1.0
        for part in chunks(len(rows)):
            axes, points = self._chain.frames(rows[part].T)
            x, y, z = axes[JOINTS]
            X_BT[part, :3, :] = np.stack(
                [z, -y, x, points[JOINTS]], axis=0
            ).transpose(2, 1, 0)
        return X_BT.reshape(*batch, 4, 4)

    def joint_positions(self, q: ArrayLike) -> Array:
        """Positions of the joints, for drawing and collision checks.

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            p_BJ [m], (..., 5, 3): of the base, the shoulder, the elbow, the
            wrist's centre and the tip.
        """
        batch, rows = flatten(q, (JOINTS,), "q")
        if (one := lone(rows)) is not None:
            places = self._single.joint_positions(one)
            return np.array(places).reshape(*batch, 5, 3)
        corners = np.empty((len(rows), 5, 3))
        for part in chunks(len(rows)):
            _, points = self._chain.frames(rows[part].T)
            for i, frame in enumerate((0, 1, 2, 4, 6)):
                corners[part, i] = points[frame].T
        return corners.reshape(*batch, 5, 3)

    def jacobian(self, q: ArrayLike) -> Array:
        """Geometric Jacobian at the tool's tip.

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            (..., 6, 6): rows v [m/rad], then w [-], in B; one column for
            each joint.
        """
        batch, rows = flatten(q, (JOINTS,), "q")
        if (one := lone(rows)) is not None:
            elements = self._single.jacobian(one)
            return np.array(elements).reshape(*batch, 6, JOINTS)
        J = np.empty((len(rows), 6, JOINTS))
        for part in chunks(len(rows)):
            axes, points = self._chain.frames(rows[part].T)
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
        if (one := lone(rows)) is not None:
            carried = self._single.holding_torque(one, float(payload))
            return np.array(carried).reshape(*batch, JOINTS)
        torque = np.empty((len(rows), JOINTS))
        for part in chunks(len(rows)):
            axes, moments = self._chain.load(rows[part].T, payload)
            torque[part] = holding_torque(axes, moments).T
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
            axes, moments = self._chain.load(rows[part].T, payload)
            torque[part] = holding_torque(axes, moments).T
            for j in range(JOINTS):
                # Joint j moves only what hangs on it.
                turned = cross(axes[j], moments[j])
                rise = holding_torque(axes[: j + 1], turned[None]).T
                derivative[part, : j + 1, j] = rise
                derivative[part, j, : j + 1] = rise
        return (
            torque.reshape(*batch, JOINTS),
            derivative.reshape(*batch, JOINTS, JOINTS),
        )

    def inverse(self, X_BT: ArrayLike, *, limits: bool = True) -> Array:
        """All joint positions that take the tool to a pose, Appendix C.

        Where the arm is singular some joint is free, and gets one of its
        valid positions: the waist any of them, the fourth joint theta_4 = 0.

        Args:
            X_BT: pose of the tool's tip, (..., 4, 4).
            limits: whether to leave out what is beyond the joints' limits.

        Returns:
            [rad], (..., 8, 6), rows of NaN where there is no solution. The
            order: the waist towards the wrist's centre, then away from it;
            for each the elbow bent one way, then the other; for each the two
            wrists. Of the angles that differ by whole turns each is the one
            nearest to the middle of its joint's range.

        Raises:
            ParameterError: a wrong shape, NaN, or not a pose.
        """
        batch, poses = flatten(X_BT, (4, 4), "X_BT")
        one = lone(poses)
        if one is not None and is_pose(one):
            solutions = self._single.inverse(one, limits)
            return np.array(solutions).reshape(*batch, SOLUTIONS, JOINTS)
        check_poses(poses)
        q = np.empty((len(poses), SOLUTIONS, JOINTS))
        for part in chunks(len(poses)):
            # Frame 6 has the tool's x axis as z, its y as -y, its z as x.
            tool = np.ascontiguousarray(poses[part, :3].transpose(2, 1, 0))
            x6, y6, z6, tip = tool[2], -tool[1], tool[0], tool[3]
            q[part] = self._solver.solve(
                tip - self._solver.d[5] * z6, z6, x6, y6, limits
            )
        return q.reshape(*batch, SOLUTIONS, JOINTS)

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
        if p.shape != a.shape:
            try:
                p, a = np.broadcast_arrays(p, a)
            except ValueError:
                raise ParameterError(
                    f"p_BT {p.shape} and a_B {a.shape} do not go together: "
                    "valid is (..., 3) each"
                ) from None
        batch, points = flatten(p, (3,), "p_BT")
        _, axes = flatten(a, (3,), "a_B")
        point, axis = lone(points), lone(axes)
        if point is not None and axis is not None and is_direction(axis):
            solutions = self._single.inverse_axis(point, axis, limits)
            return np.array(solutions).reshape(*batch, SOLUTIONS, JOINTS)
        refuse(np.any(~np.isfinite(points), axis=1), points, "p_BT", "finite")
        check_directions(axes, "a_B")
        q = np.empty((len(points), SOLUTIONS, JOINTS))
        for part in chunks(len(points)):
            z6 = np.ascontiguousarray(axes[part].T)
            tip = points[part].T
            q[part] = self._solver.solve(
                tip - self._solver.d[5] * z6, z6, None, None, limits
            )
        return q.reshape(*batch, SOLUTIONS, JOINTS)

    def singularity_determinants(self, q: ArrayLike) -> Array:
        """Determinants of J11 and J22, (4.8), at the wrist's centre.

        There J12 = 0, so that their product is the determinant of the whole
        Jacobian, both at the wrist's centre and at the tip.

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            [m^3, -], (..., 2): zero where the arm, or the wrist, is singular.
        """
        batch, rows = flatten(q, (JOINTS,), "q")
        theta = (rows + self._solver.offset).T
        elbow = theta[2] + self._solver.forearm_angle
        _, radius = self._wrist_radius(theta)
        arm = self._arm_factor * np.sin(elbow) * radius
        wrist = self._wrist_factor * np.sin(theta[4])
        return np.stack([arm, wrist], axis=-1).reshape(*batch, 2)

    def singularity_determinants_derivative(self, q: ArrayLike) -> Array:
        """Derivative of `singularity_determinants` by the joints.

        Args:
            q: joint positions [rad], (..., 6).

        Returns:
            [m^3/rad, 1/rad], (..., 2, 6).
        """
        batch, rows = flatten(q, (JOINTS,), "q")
        theta = (rows + self._solver.offset).T
        elbow = theta[2] + self._solver.forearm_angle
        height, radius = self._wrist_radius(theta)
        forearm_height = self._solver.forearm * np.sin(theta[1] + elbow)
        derivative = np.zeros((len(rows), 2, JOINTS))
        derivative[:, 0, 1] = -self._arm_factor * np.sin(elbow) * height
        derivative[:, 0, 2] = self._arm_factor * (
            np.cos(elbow) * radius - np.sin(elbow) * forearm_height
        )
        derivative[:, 1, 4] = self._wrist_factor * np.cos(theta[4])
        return derivative.reshape(*batch, 2, JOINTS)

    def _wrist_radius(self, theta: Array) -> tuple[Array, Array]:
        """The wrist's centre in the arm's plane, from theta, (6, n).

        Returns:
            Its height over the shoulder, positive along the plane's second
            axis, and its signed distance from the waist's axis [m], (n,) each.
        """
        elbow = theta[1] + theta[2] + self._solver.forearm_angle
        a2, f = self._solver.upper_arm, self._solver.forearm
        return (
            a2 * np.sin(theta[1]) + f * np.sin(elbow),
            self._solver.a[0] + a2 * np.cos(theta[1]) + f * np.cos(elbow),
        )


def _require_payload(payload: float) -> None:
    known = isinstance(payload, int | float | np.floating | np.integer)
    require(
        known and 0 <= payload < np.inf,
        "payload",
        payload,
        "a mass of 0 kg or more",
    )
