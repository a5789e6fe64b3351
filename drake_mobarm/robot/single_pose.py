"""The kinematics of one pose in Python's floats, fast enough for control.

For three numbers at a time numpy takes ten times as long as the arithmetic.
The equations are those of `ArmChain` and `ArmSolver`, in the same order; the
tests hold the two against each other.
"""

import math
from math import atan2, cos, sin, sqrt

from drake_mobarm.robot.arm_chain import GRAVITY, ArmChain
from drake_mobarm.robot.arm_parameters import JOINTS
from drake_mobarm.robot.arm_solver import SOLUTIONS, STRAIGHT, ArmSolver

_Vector = tuple[float, float, float]
_Frame = tuple[_Vector, _Vector, _Vector, _Vector]
_Range = tuple[float, float, float, float, float]

_PI, _TURN = math.pi, 2 * math.pi
# Axes x, y, z and origin of DH frame 0.
_BASE: _Frame = (
    (1.0, 0.0, 0.0),
    (0.0, 1.0, 0.0),
    (0.0, 0.0, 1.0),
    (0.0, 0.0, 0.0),
)
# Stands where there is no solution.
_NONE = [math.nan] * JOINTS


class SinglePose:
    """The kinematics of an arm, one pose at a time.

    Inputs have to be finite. Arrays are flat lists, row after row; their
    shapes are given as those of the arrays.

    Args:
        solver: the arm's lengths.
        chain: its links.
    """

    def __init__(self, solver: ArmSolver, chain: ArmChain) -> None:
        self._arm = solver
        offset, self._d, self._a, self._sin = (
            x.tolist() for x in (solver.offset, solver.d, solver.a, solver.sin)
        )
        self._dh_rows = list(
            zip(offset, self._d, self._a, self._sin, strict=True)
        )
        self._links = list(
            zip(chain.mass.tolist(), chain.com.tolist(), strict=True)
        )
        middle, half, lower, upper = (
            x.tolist()
            for x in (solver.middle, solver.half, solver.lower, solver.upper)
        )
        shift = [x + y for x, y in zip(offset, middle, strict=True)]
        self._limited: list[_Range] = list(
            zip(shift, middle, half, lower, upper, strict=True)
        )
        self._unlimited: list[_Range] = [
            (*joint[:2], math.inf, -math.inf, math.inf)
            for joint in self._limited
        ]

    def forward(self, q: list[float]) -> list[float]:
        """The tip's pose X_BT, (4, 4), of joint positions (6,) [rad]."""
        x, y, z, p = self._frames(q)[JOINTS]
        return [
            *(z[0], -y[0], x[0], p[0]),
            *(z[1], -y[1], x[1], p[1]),
            *(z[2], -y[2], x[2], p[2]),
            *(0.0, 0.0, 0.0, 1.0),
        ]

    def joint_positions(self, q: list[float]) -> list[float]:
        """Base, shoulder, elbow, wrist's centre and tip in B [m], (5, 3)."""
        frames = self._frames(q)
        return [x for i in (0, 1, 2, 4, 6) for x in frames[i][3]]

    def jacobian(self, q: list[float]) -> list[float]:
        """Geometric Jacobian at the tip, (6, 6): rows v [m/rad], then w."""
        frames = self._frames(q)
        tip_1, tip_2, tip_3 = frames[JOINTS][3]
        columns = []
        for _, _, (z1, z2, z3), (p1, p2, p3) in frames[:JOINTS]:
            r1, r2, r3 = tip_1 - p1, tip_2 - p2, tip_3 - p3
            v = z2 * r3 - z3 * r2, z3 * r1 - z1 * r3, z1 * r2 - z2 * r1
            columns.append((*v, z1, z2, z3))
        return [x for row in zip(*columns, strict=True) for x in row]

    def holding_torque(self, q: list[float], payload: float) -> list[float]:
        """Torques that hold the arm and a payload [kg] still, (6,) [N m]."""
        frames = self._frames(q)
        torque = [0.0] * JOINTS
        # Mass and mass moment, its x and y, of all that the joint moves.
        p = frames[JOINTS][3]
        mass, moment_1, moment_2 = payload, payload * p[0], payload * p[1]
        for i in reversed(range(JOINTS)):
            x, y, z, p = frames[i + 1]
            link, (c1, c2, c3) = self._links[i]
            mass += link
            moment_1 += link * (p[0] + c1 * x[0] + c2 * y[0] + c3 * z[0])
            moment_2 += link * (p[1] + c1 * x[1] + c2 * y[1] + c3 * z[1])
            _, _, axis, p = frames[i]
            torque[i] = GRAVITY * (
                axis[0] * (moment_2 - mass * p[1])
                - axis[1] * (moment_1 - mass * p[0])
            )
        return torque

    def inverse(self, X_BT: list[float], limits: bool) -> list[float]:
        """All solutions, (8, 6) [rad], of the tip's pose, (4, 4)."""
        x1, y1, z1, p1, x2, y2, z2, p2, x3, y3, z3, p3, *_ = X_BT
        # Frame 6 has the tool's x axis as z, its y as -y, its z as x.
        x6, y6, z6 = (z1, z2, z3), (-y1, -y2, -y3), (x1, x2, x3)
        return self._solve((p1, p2, p3), z6, (x6, y6), limits)

    def inverse_axis(
        self, p_BT: list[float], a_B: list[float], limits: bool
    ) -> list[float]:
        """All solutions, (8, 6) [rad], of tip [m] and approach, (3,) each."""
        (p1, p2, p3), (a1, a2, a3) = p_BT, a_B
        return self._solve((p1, p2, p3), (a1, a2, a3), (), limits)

    def _frames(self, q: list[float]) -> list[_Frame]:
        """Axes x, y, z and origins of DH frames 0 to 6, in B."""
        frames = [_BASE]
        (x1, x2, x3), (y1, y2, y3), (z1, z2, z3), (p1, p2, p3) = _BASE
        for angle, (offset, d, a, turn) in zip(q, self._dh_rows, strict=True):
            c, s = cos(angle + offset), sin(angle + offset)
            x1, y1 = c * x1 + s * y1, c * y1 - s * x1
            x2, y2 = c * x2 + s * y2, c * y2 - s * x2
            x3, y3 = c * x3 + s * y3, c * y3 - s * x3
            if d:
                p1, p2, p3 = p1 + d * z1, p2 + d * z2, p3 + d * z3
            if a:
                p1, p2, p3 = p1 + a * x1, p2 + a * x2, p3 + a * x3
            if turn:  # A quarter turn about x.
                y1, z1 = turn * z1, -turn * y1
                y2, z2 = turn * z2, -turn * y2
                y3, z3 = turn * z3, -turn * y3
            frames.append(
                ((x1, x2, x3), (y1, y2, y3), (z1, z2, z3), (p1, p2, p3))
            )
        return frames

    def _solve(
        self,
        tip: _Vector,
        z6: _Vector,
        x6_y6: tuple[_Vector, ...],
        limits: bool,
    ) -> list[float]:
        """`ArmSolver.solve`, which leaves branches beyond a limit early.

        Args:
            tip: p_BT [m].
            z6: z axis of DH frame 6 in B.
            x6_y6: its x and y axes; none where the sixth joint is at 0.
            limits: whether to leave out what is beyond the joints' limits.
        """
        arm, hand, sin_1 = self._arm, self._d[5], self._sin[0]
        a2, f, side = arm.upper_arm, arm.forearm, arm.side
        joints = self._limited if limits else self._unlimited
        x, y, z = (p - hand * axis for p, axis in zip(tip, z6, strict=True))
        squared = x * x + y * y - side * side
        toward = sqrt(max(squared, 0.0))
        up = sin_1 * (z - self._d[0])
        q: list[float] = []
        for radial in (toward, -toward):
            out = radial - self._a[0]
            distance = out * out + up * up
            short, more = arm.stretched - distance, distance - arm.folded
            theta_1 = atan2(y, x) - atan2(-sin_1 * side, radial)
            q_1 = _position(theta_1, joints[0])
            if q_1 is None or not arm.reaches(squared, short, more):
                q += _NONE * (SOLUTIONS // 2)
                continue
            c, s = cos(theta_1), sin(theta_1)
            in_plane = [
                (
                    c * axis[0] + s * axis[1],
                    sin_1 * axis[2],
                    sin_1 * (s * axis[0] - c * axis[1]),
                )
                for axis in (z6, *x6_y6)
            ]
            sine = sqrt(max(short * more, 0.0)) / (2 * a2 * f)
            cosine = (more - short) / (4 * a2 * f)
            elbow, line = atan2(sine, cosine), atan2(up, out)
            lift = atan2(f * sine, a2 + f * cosine)
            for sign in (1, -1):
                theta_2 = line - sign * lift
                theta_3 = sign * elbow - arm.forearm_angle
                q_2 = _position(theta_2, joints[1])
                q_3 = _position(theta_3, joints[2])
                if q_2 is None or q_3 is None:
                    q += _NONE * 2
                    continue
                for wrist in self._wrists(in_plane, theta_2 + theta_3):
                    q_4, q_5, q_6 = map(_position, wrist, joints[3:])
                    if q_4 is None or q_5 is None or q_6 is None:
                        q += _NONE
                    else:
                        q += (q_1, q_2, q_3, q_4, q_5, q_6)
        return q

    def _wrists(
        self, in_plane: list[_Vector], turn: float
    ) -> tuple[_Vector, _Vector]:
        """theta_4 to theta_6 of both wrists.

        Args:
            in_plane: axes z6, x6, y6, or z6 alone: forward in the arm's
                plane, up in it, across it.
            turn: theta_2 + theta_3 [rad].
        """
        c, s = cos(turn), sin(turn)
        _, _, sin_3, s4, s5, _ = self._sin
        in_frame_3 = []
        for forward, up, across in in_plane:
            along, normal = c * forward + s * up, c * up - s * forward
            in_frame_3.append(
                (along, sin_3 * across, -sin_3 * normal)
                if sin_3
                else (along, normal, across)
            )
        W13, W23, W33 = in_frame_3[0]
        bend = sqrt(W13 * W13 + W23 * W23)
        if bend < STRAIGHT:
            W13, W23, scale = 1.0, 0.0, 1.0
        else:
            scale = 1 / bend
        theta_4 = atan2(W23, W13)
        theta_5 = atan2(s5 * bend, -s4 * s5 * W33)
        theta_6, flip = self._dh_rows[5][0], 0.0
        if len(in_frame_3) > 1:
            cos_4, sin_4 = W13 * scale, W23 * scale
            (W11, W21, _), (W12, W22, _) = in_frame_3[1:]
            theta_6 = atan2(
                s4 * s5 * (sin_4 * W11 - cos_4 * W21),
                s4 * s5 * (sin_4 * W12 - cos_4 * W22),
            )
            flip = _PI
        return (
            (theta_4, theta_5, theta_6),
            (theta_4 + _PI, -theta_5, theta_6 + flip),
        )


def _position(theta: float, joint: _Range) -> float | None:
    """Of a joint, nearest to the middle of its range; None beyond a limit."""
    shift, middle, half, lower, upper = joint
    q = theta - shift
    if not -_PI <= q <= _PI:
        q -= _TURN * round(q / _TURN)
    if abs(q) > half:
        return None
    q += middle
    return lower if q < lower else upper if q > upper else q
