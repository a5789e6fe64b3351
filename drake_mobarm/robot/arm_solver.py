"""Inverse kinematics in closed form, Appendix C, for batches of poses.

The first three joints put the wrist's centre into its place, the last three
are Euler angles of the rotation that remains. Two corrections of Appendix C:
the second solution of the waist has a negative radial distance, and an arm
whose forearm rolls has different wrist angles.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array
from drake_mobarm.robot.arm_parameters import JOINTS, ArmParameters
from drake_mobarm.robot.batches import OVERFLOW_IS_FAR

SOLUTIONS = 8

# Quarter turns that alpha of each DH row may be.
_TURNS = ((-1, 1), (0,), (-1, 0, 1), (-1, 1), (-1, 1), (0,))
# How far out of reach the wrist's centre may lie [m], and past a joint limit a
# solution [rad]: rounding takes poses there that the arm reaches.
_REACH_TOLERANCE = 1e-9
_LIMIT_TOLERANCE = 1e-9

STRAIGHT = 1e-12
"""Sine of the wrist's bend below which forearm and hand are in line."""


class ArmSolver:
    """The lengths of an arm, and the joint positions that reach a pose.

    Attributes:
        offset: of theta [rad], (6,).
        d: of the DH rows [m], (6,).
        a: of the DH rows [m], (6,).
        sin: sine of alpha of the DH rows, (6,): -1, 0 or 1.
        upper_arm: length [m].
        forearm: length, from the elbow's axis to the wrist's centre [m].
        forearm_angle: its direction in the arm's plane at theta_3 = 0 [rad].
        side: distance of the wrist's centre from the plane through the
            waist's axis [m].
        stretched: the largest squared distance from the shoulder to the
            wrist's centre, in the arm's plane [m^2].
        folded: the smallest one [m^2].
        lower: joint limits [rad], (6,).
        upper: joint limits [rad], (6,).
        middle: of the joints' ranges [rad], (6,).
        half: how far from the middle a solution may be [rad], (6,); infinite
            for a joint that turns all the way round.

    Args:
        parameters: the arm.

    Raises:
        ParameterError: the DH rows are of an arm that this closed form does
            not solve.
    """

    def __init__(self, parameters: ArmParameters) -> None:
        self.lower = np.asarray(parameters.lower)
        self.upper = np.asarray(parameters.upper)
        self.middle = (self.lower + self.upper) / 2
        self.half = (self.upper - self.lower) / 2 + _LIMIT_TOLERANCE
        self.half[self.half >= np.pi] = np.inf
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
        self.offset, self.d, self.a = offset, d, a
        self.sin = np.array([0, 1, 0, -1])[quarters.astype(int) % 4]
        rolls = self.sin[2] != 0
        forearm = np.array([a[2], -d[3] * self.sin[2]])
        self.upper_arm = float(a[1])
        self.forearm = float(np.hypot(*forearm))
        self.forearm_angle = float(np.arctan2(forearm[1], forearm[0]))
        self.side = float(d[1] + d[2] + (0.0 if rolls else d[3]))
        require(
            self.upper_arm > 0 and self.forearm > 0,
            "dh",
            [self.upper_arm, self.forearm],
            "an upper arm and a forearm longer than 0",
        )
        longest = self.upper_arm + self.forearm
        shortest = self.upper_arm - self.forearm
        self.stretched, self.folded = longest**2, shortest**2
        slack = 2 * _REACH_TOLERANCE
        self._least = (
            -slack * abs(self.side),
            -slack * longest,
            -slack * abs(shortest),
        )

    def reaches(self, squared: Any, short: Any, more: Any) -> Any:
        """Whether the arm reaches the wrist's centre.

        Args:
            squared: radial distance in the arm's plane, squared [m^2].
            short: `stretched` less the squared distance from the shoulder.
            more: the squared distance from the shoulder less `folded`.

        Returns:
            A bool for floats, an array of them for arrays.
        """
        least_squared, least_short, least_more = self._least
        return (
            (short >= least_short)
            & (more >= least_more)
            & (squared >= least_squared)
        )

    @OVERFLOW_IS_FAR
    def solve(
        self,
        wrist: Array,
        z6: Array,
        x6: Array | None,
        y6: Array | None,
        limits: bool,
    ) -> Array:
        """All solutions, in the order that `ArmKinematics.inverse` states.

        Args:
            wrist: the wrist's centre in B [m], (3, n).
            z6: z axis of DH frame 6 in B, (3, n).
            x6: its x axis, (3, n), or None: the sixth joint is then at 0.
            y6: its y axis, (3, n), or None, as x6.
            limits: whether to leave out what is beyond the joints' limits.

        Returns:
            [rad], (n, 8, 6), NaN where there is none.
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
            up = self.sin[0] * axis[2]
            across = self.sin[0] * (sin_1 * axis[0] - cos_1 * axis[1])[:, None]
            along = cos_23 * forward + sin_23 * up
            normal = cos_23 * up - sin_23 * forward
            if self.sin[2]:
                return along, self.sin[2] * across, -self.sin[2] * normal
            return along, normal, across

        s4, s5 = self.sin[3], self.sin[4]
        W13, W23, W33 = in_frame_3(z6)
        bend = np.sqrt(W13 * W13 + W23 * W23)
        straight = bend < STRAIGHT
        if straight.any():
            W13, W23 = np.where(straight, 1.0, W13), np.where(straight, 0, W23)
            scale = 1 / np.where(straight, 1.0, bend)
        else:
            scale = 1 / bend
        first[:, :, 3] = np.arctan2(W23, W13)
        first[:, :, 4] = np.arctan2(s5 * bend, -s4 * s5 * W33)
        flip = np.pi
        if x6 is None or y6 is None:
            first[:, :, 5] = self.offset[5]
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
        middle = self.middle[:, None]
        q -= self.offset[:, None] + middle
        q -= 2 * np.pi * np.rint(q / (2 * np.pi))
        good: NDArray[np.bool_] = np.repeat(reached, 4, axis=0)
        if limits:
            for i in np.flatnonzero(self.half < np.inf):
                good &= np.abs(q[:, i]) <= self.half[i]
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
        a2, f, side = self.upper_arm, self.forearm, self.side
        squared = x * x + y * y - side * side
        radial = np.sqrt(np.maximum(squared, 0.0))
        # Away from the wrist's centre the radial distance is negative.
        radial = np.stack([radial, -radial])
        theta[:, :, 0] = (
            np.arctan2(y, x) - np.arctan2(-self.sin[0] * side, radial)
        )[:, None]
        out = radial - self.a[0]
        up = self.sin[0] * (z - self.d[0])
        # Squared distances from the shoulder, short of the stretched arm's and
        # more than the folded one's: in their product the elbow's sine stays
        # exact where both links are as long and 1 - cosine^2 does not.
        distance = out * out + up * up
        short, more = self.stretched - distance, distance - self.folded
        reached = self.reaches(squared, short, more)
        sine = np.sqrt(np.maximum(short * more, 0.0)) / (2 * a2 * f)
        D = (more - short) / (4 * a2 * f)
        elbow = np.arctan2(sine, D)
        line = np.arctan2(up, out)
        lift = np.arctan2(f * sine, a2 + f * D)
        for k, sign in enumerate((1, -1)):
            theta[:, k, 1] = line - sign * lift
            theta[:, k, 2] = sign * elbow - self.forearm_angle
        return reached, theta[:, :, 1] + theta[:, :, 2]
