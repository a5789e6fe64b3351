"""Closed-form kinematics and statics of six-joint arms: Appendix C, 7.3.2."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_mobarm.exceptions import ParameterError, require
from drake_mobarm.geometry import Array
from drake_mobarm.robot.arm_parameters import (
    JOINTS,
    WIDOWX_250,
    ArmParameters,
)

GRAVITY = 9.81
SOLUTIONS = 8

# Poses a batch is cut into: its arrays then stay in a core's cache.
_CHUNK = 2048
# Squares that overflow far out of reach need no warning: they, too, are out.
_FAR = np.errstate(over="ignore", invalid="ignore")
# What counts as a rotation or a unit vector.
_UNIT_TOLERANCE = 1e-6
# How far out of reach the wrist's centre may lie [m], and past a joint limit a
# solution [rad]: rounding takes poses there that the arm reaches.
_REACH_TOLERANCE = 1e-9
_LIMIT_TOLERANCE = 1e-9
# Sine of the wrist's bend below which forearm and hand turn about one line.
_STRAIGHT = 1e-12


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
        offset, d, a, alpha = np.asarray(parameters.dh).T
        quarters = np.rint(alpha / (np.pi / 2))
        for joint, valid in enumerate(_TURNS):
            require(
                abs(alpha[joint] - quarters[joint] * np.pi / 2) < 1e-9
                and quarters[joint] in valid,
                f"dh: alpha {joint + 1}",
                float(alpha[joint]),
                " or ".join(f"{x} pi/2" for x in valid),
            )
        for name, value in (
            ("d 5", d[4]),
            ("a 4", a[3]),
            ("a 5", a[4]),
            ("a 6", a[5]),
        ):
            require(
                value == 0, f"dh: {name}", float(value), "0: a spherical wrist"
            )
        self._offset, self._d, self._a = offset, d, a
        self._sin = np.array([0, 1, 0, -1])[quarters.astype(int) % 4]
        rolls = self._sin[2] != 0
        # The forearm in the arm's plane, from the elbow's axis to the wrist's
        # centre at theta_3 = 0, and the wrist centre's distance from the
        # plane through the waist's axis.
        forearm = np.array([a[2], -d[3] * self._sin[2]])
        self._upper_arm, self._forearm = a[1], float(np.hypot(*forearm))
        self._forearm_angle = float(np.arctan2(forearm[1], forearm[0]))
        self._side = d[1] + d[2] + (0.0 if rolls else d[3])
        require(
            self._upper_arm > 0 and self._forearm > 0,
            "dh",
            [float(self._upper_arm), self._forearm],
            "an upper arm and a forearm longer than 0",
        )
        # Constant factors of det J11 [m^2] and det J22 [-].
        self._arm_volume = -self._sin[0] * self._upper_arm * self._forearm
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
            + np.hypot(self._upper_arm + self._forearm, self._side)
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
        batch, rows = _flatten(q, (JOINTS,), "q")
        X_BT = np.zeros((len(rows), 4, 4))
        X_BT[:, 3, 3] = 1.0
        for part in _chunks(len(rows)):
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
        batch, rows = _flatten(q, (JOINTS,), "q")
        corners = np.empty((len(rows), 5, 3))
        for part in _chunks(len(rows)):
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
        batch, rows = _flatten(q, (JOINTS,), "q")
        J = np.empty((len(rows), 6, JOINTS))
        for part in _chunks(len(rows)):
            axes, points = self._chain(rows[part].T)
            columns = np.empty((6, JOINTS, len(rows[part])))
            for i in range(JOINTS):
                axis = axes[i][2]
                columns[:3, i] = _cross(axis, points[JOINTS] - points[i])
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
        batch, rows = _flatten(q, (JOINTS,), "q")
        torque = np.empty((len(rows), JOINTS))
        for part in _chunks(len(rows)):
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
        batch, rows = _flatten(q, (JOINTS,), "q")
        torque = np.empty((len(rows), JOINTS))
        derivative = np.empty((len(rows), JOINTS, JOINTS))
        for part in _chunks(len(rows)):
            axes, moments = self._load(rows[part].T, payload)
            torque[part] = _rise(axes, moments).T
            for j in range(JOINTS):
                # Joint j moves only what hangs on it.
                turned = _cross(axes[j], moments[j])
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
        batch, poses = _flatten(X_BT, (4, 4), "X_BT")
        _check_poses(poses)
        q = np.empty((len(poses), SOLUTIONS, JOINTS))
        for part in _chunks(len(poses)):
            # Frame 6 has the tool's x axis as z, its y as -y, its z as x.
            tool = np.ascontiguousarray(poses[part, :3].transpose(2, 1, 0))
            x6, y6, z6, tip = tool[2], -tool[1], tool[0], tool[3]
            q[part] = self._solve(tip - self._d[5] * z6, z6, x6, y6, limits)
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
        p, a = _numbers(p_BT, (3,), "p_BT"), _numbers(a_B, (3,), "a_B")
        try:
            p, a = np.broadcast_arrays(p, a)
        except ValueError:
            raise ParameterError(
                f"p_BT {p.shape} and a_B {a.shape} do not go together: valid "
                "is (..., 3) each"
            ) from None
        batch, points = _flatten(p, (3,), "p_BT")
        _, axes = _flatten(a, (3,), "a_B")
        _refuse(np.any(~np.isfinite(points), axis=1), points, "p_BT", "finite")
        check_directions(axes, "a_B")
        q = np.empty((len(points), SOLUTIONS, JOINTS))
        for part in _chunks(len(points)):
            z6 = np.ascontiguousarray(axes[part].T)
            tip = points[part].T
            q[part] = self._solve(tip - self._d[5] * z6, z6, None, None, limits)
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
        batch, rows = _flatten(q, (JOINTS,), "q")
        theta = (rows + self._offset).T
        elbow = theta[2] + self._forearm_angle
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
        batch, rows = _flatten(q, (JOINTS,), "q")
        theta = (rows + self._offset).T
        elbow = theta[2] + self._forearm_angle
        height, radius = self._wrist_radius(theta)
        forearm_height = self._forearm * np.sin(theta[1] + elbow)
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
        elbow = theta[1] + theta[2] + self._forearm_angle
        a2, f = self._upper_arm, self._forearm
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
        x, y, z = (np.repeat(np.eye(3)[:, i, None], n, axis=1) for i in _XYZ)
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

    def _solve(
        self,
        wrist: Array,
        z6: Array,
        x6: Array | None,
        y6: Array | None,
        limits: bool,
    ) -> Array:
        """Solutions (n, 8, 6) for the wrist's centre and frame 6's axes.

        All of them (3, n). Without x6 and y6 the sixth joint is at 0.
        """
        n = wrist.shape[1]
        theta = np.empty((2, 2, 2, JOINTS, n))
        first = theta[:, :, 0]
        reached, turn = self._solve_arm(wrist, first)
        sin_1, cos_1 = np.sin(first[:, 0, 0]), np.cos(first[:, 0, 0])
        sin_23, cos_23 = np.sin(turn), np.cos(turn)

        def in_frame_3(axis: Array) -> tuple[Array, Array, Array]:
            """A direction in B, (3, n), in frame 3.

            The parts are (2, 2, n), or (2, 1, n) where both elbows agree.
            """
            forward = (cos_1 * axis[0] + sin_1 * axis[1])[:, None]
            up = self._sin[0] * axis[2]
            across = self._sin[0] * (sin_1 * axis[0] - cos_1 * axis[1])[:, None]
            along = cos_23 * forward + sin_23 * up
            normal = cos_23 * up - sin_23 * forward
            if self._sin[2]:
                return along, self._sin[2] * across, -self._sin[2] * normal
            return along, normal, across

        s4, s5 = self._sin[3], self._sin[4]
        W13, W23, W33 = in_frame_3(z6)
        bend = np.sqrt(W13 * W13 + W23 * W23)
        straight = bend < _STRAIGHT
        if straight.any():
            W13, W23 = np.where(straight, 1.0, W13), np.where(straight, 0, W23)
            scale = 1 / np.where(straight, 1.0, bend)
        else:
            scale = 1 / bend
        first[:, :, 3] = np.arctan2(W23, W13)
        first[:, :, 4] = np.arctan2(s5 * bend, -s4 * s5 * W33)
        flip = np.pi
        if x6 is None or y6 is None:
            first[:, :, 5] = self._offset[5]
            flip = 0.0
        else:
            # From what the fourth joint leaves, not from the third row of W,
            # or near a straight wrist the two would not belong together.
            cos_4, sin_4 = W13 * scale, W23 * scale
            W11, W21, _ = in_frame_3(x6)
            W12, W22, _ = in_frame_3(y6)
            first[:, :, 5] = np.arctan2(
                s4 * s5 * (sin_4 * W11 - cos_4 * W21),
                s4 * s5 * (sin_4 * W12 - cos_4 * W22),
            )
        second = theta[:, :, 1]
        second[:, :, :3] = first[:, :, :3]
        second[:, :, 3] = first[:, :, 3] + np.pi
        second[:, :, 4] = -first[:, :, 4]
        second[:, :, 5] = first[:, :, 5] + flip

        q = theta.reshape(SOLUTIONS, JOINTS, n)
        middle = ((self.lower + self.upper) / 2)[:, None]
        q -= self._offset[:, None] + middle
        q -= 2 * np.pi * np.rint(q / (2 * np.pi))
        good: NDArray[np.bool_] = np.repeat(reached, 4, axis=0)
        if limits:
            half = ((self.upper - self.lower) / 2)[:, None]
            inside = np.abs(q) <= half + _LIMIT_TOLERANCE
            good = good & np.all(inside, axis=1)
        q += middle
        if limits:
            np.clip(q, self.lower[:, None], self.upper[:, None], out=q)
        np.copyto(q, np.nan, where=np.logical_not(good)[:, None, :])
        return q.transpose(2, 0, 1)

    def _solve_arm(self, wrist: Array, theta: Array) -> tuple[Array, Array]:
        """Fills in the first three angles, (2, 2, 6, n), as DH has them.

        Returns:
            Whether each side reaches the wrist's centre, (2, n), and theta_2
            + theta_3 for both elbows of each, (2, 2, n).
        """
        x, y, z = wrist
        a2, f, side = self._upper_arm, self._forearm, self._side
        squared = x * x + y * y - side * side
        radial = np.sqrt(np.maximum(squared, 0.0))
        # Away from the wrist's centre the radial distance is negative.
        radial = np.stack([radial, -radial])
        theta[:, :, 0] = (
            np.arctan2(y, x) - np.arctan2(-self._sin[0] * side, radial)
        )[:, None]
        out = radial - self._a[0]
        up = self._sin[0] * (z - self._d[0])
        # Squared distances from the shoulder, short of the stretched arm's and
        # more than the folded one's: in their product the elbow's sine stays
        # exact where both links are as long and 1 - cosine^2 does not.
        distance = out * out + up * up
        short, more = (a2 + f) ** 2 - distance, distance - (a2 - f) ** 2
        slack = 2 * _REACH_TOLERANCE
        reached = (
            (short >= -slack * (a2 + f))
            & (more >= -slack * abs(a2 - f))
            & (squared >= -slack * abs(side))
        )
        sine = np.sqrt(np.maximum(short * more, 0.0)) / (2 * a2 * f)
        D = (more - short) / (4 * a2 * f)
        elbow = np.arctan2(sine, D)
        line = np.arctan2(up, out)
        lift = np.arctan2(f * sine, a2 + f * D)
        for k, sign in enumerate((1, -1)):
            theta[:, k, 1] = line - sign * lift
            theta[:, k, 2] = sign * elbow - self._forearm_angle
        return reached, theta[:, :, 1] + theta[:, :, 2]


_XYZ = (0, 1, 2)
# Quarter turns that alpha of each row may be.
_TURNS = ((-1, 1), (0,), (-1, 0, 1), (-1, 1), (-1, 1), (0,))


def check_directions(directions: Array, name: str) -> None:
    """Refuses rows (n, 3) that are not unit vectors.

    Raises:
        ParameterError: naming the first such row.
    """
    length = np.linalg.norm(directions, axis=1)
    bad = ~(np.abs(length - 1) <= _UNIT_TOLERANCE)
    valid = "a unit vector"
    if bad.any():
        first = int(np.argmax(bad))
        if 0 < length[first] < np.inf:
            unit = np.round(directions[first] / length[first], 9)
            valid += f", here {unit.tolist()}"
    _refuse(bad, directions, name, valid)


def _chunks(n: int) -> list[slice]:
    return [slice(i, min(i + _CHUNK, n)) for i in range(0, n, _CHUNK)]


def _cross(a: Array, b: Array) -> Array:
    """Cross product along the first axis; np.cross takes ten times as long."""
    return np.stack(
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    )


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


def _flatten(
    values: ArrayLike, shape: tuple[int, ...], name: str
) -> tuple[tuple[int, ...], Array]:
    """The batch's shape, and its items in a row."""
    array = _numbers(values, shape, name)
    return array.shape[: -len(shape)], array.reshape(-1, *shape)


def _numbers(values: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    wanted = ", ".join(map(str, shape))
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(
            f"{name} is not an array of numbers: valid is (..., {wanted})"
        ) from None
    if array.shape[-len(shape) :] != shape:
        raise ParameterError(
            f"{name} has shape {array.shape}: valid is (..., {wanted})"
        )
    return array


def _refuse(
    bad: NDArray[np.bool_], values: Array, name: str, valid: str
) -> None:
    if bad.any():
        first = int(np.argmax(bad))
        where = f"{name}[{first}]" if len(values) > 1 else name
        raise ParameterError(
            f"{where} is {values[first].tolist()}: valid is {valid}"
        )


def _check_poses(poses: Array) -> None:
    x, y, z = (np.ascontiguousarray(poses[:, :3, i].T) for i in _XYZ)
    deviation = np.abs(_cross(x, y) - z).max(axis=0)
    for a, b, product in ((x, x, 1), (y, y, 1), (x, y, 0)):
        off = np.abs((a * b).sum(axis=0) - product)
        deviation = np.maximum(deviation, off)
    last_row = np.abs(poses[:, 3] - _LAST_ROW).max(axis=1)
    deviation = np.maximum(deviation, last_row)
    _refuse(
        ~(deviation <= _UNIT_TOLERANCE) | ~np.isfinite(poses[:, :3, 3]).all(1),
        poses,
        "X_BT",
        "a right-handed rotation, a finite position, last row 0, 0, 0, 1",
    )


_LAST_ROW = np.array([0.0, 0.0, 0.0, 1.0])
