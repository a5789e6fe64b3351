"""Which solutions of the arm would run into something: beyond 4.3.

The dissertation's map knows the arm only by its kinematics, and may put the
robot under a table that its arm goes through, or onto its own target. Here
links are rows of balls, which have to keep out of the furniture and of the
robot's own chassis. The floor needs no check: the chassis is in the way of
whatever would come down to it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from drake_mobarm.geometry import Array
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.arm_parameters import JOINTS
from drake_mobarm.world.obstacles import Obstacle

CHASSIS_RADIUS = 0.27
"""Of the robot's chassis [m]."""

CHASSIS_TOP = 0.2965
"""Its height over the floor [m]."""

LINK_RADIUS = 0.035
"""Of the balls along the arm's links [m]."""

TIP_LENGTH = 0.06
"""The last of the hand, which may touch what the tool works on [m]."""

# Balls along a link are at most this far apart [m].
_SPACING = 0.04


class Surroundings:
    """What the arm must not touch.

    Args:
        obstacles: convex ones, in W.
    """

    def __init__(self, obstacles: Sequence[Obstacle]) -> None:
        self._planes = [_planes(o.corners) for o in obstacles]
        self._boxes = np.array(
            [[o.corners.min(axis=0), o.corners.max(axis=0)] for o in obstacles]
        ).reshape(-1, 2, 3)

    def touched(
        self, arm: ArmKinematics, p_WA: ArrayLike, q: ArrayLike
    ) -> NDArray[np.bool_]:
        """Whether the arm would run into something.

        Args:
            arm: whose links.
            p_WA: of the arm's base, its axes along W's [m], (n, 3).
            q: joint positions [rad], (n, 6).
        """
        base = np.asarray(p_WA, dtype=float)
        balls_A, chassis, world = _balls(arm, q)
        balls = balls_A + base[:, None]
        # Above the chassis, or beside it.
        low = balls[..., 2] < CHASSIS_TOP + LINK_RADIUS
        near = np.hypot(balls_A[..., 0], balls_A[..., 1]) < (
            CHASSIS_RADIUS + LINK_RADIUS
        )
        hit = np.any(low & near & chassis, axis=1)
        # Only what comes near any ball, and only balls that come near it.
        points = balls[:, world]
        if not points.size:
            return np.asarray(hit)
        low_corner = points.min(axis=(0, 1)) - LINK_RADIUS
        high_corner = points.max(axis=(0, 1)) + LINK_RADIUS
        close = np.all(
            (self._boxes[:, 0] < high_corner)
            & (self._boxes[:, 1] > low_corner),
            axis=1,
        )
        for index in np.flatnonzero(close):
            low_side, high_side = self._boxes[index]
            inside = np.all(
                (points > low_side - LINK_RADIUS)
                & (points < high_side + LINK_RADIUS),
                axis=2,
            )
            row, ball = np.nonzero(inside & ~hit[:, None])
            normals, offsets = self._planes[index]
            depth = (points[row, ball] @ normals.T + offsets).max(axis=1)
            hit[row[depth < LINK_RADIUS]] = True
        return np.asarray(hit)


def _planes(corners: Array) -> tuple[Array, Array]:
    """Outward normals (k, 3) and offsets (k,) [m] of a convex body's sides."""
    equations = ConvexHull(corners).equations
    sides = np.unique(np.round(equations, 9), axis=0)
    return sides[:, :3], sides[:, 3]


def _balls(
    arm: ArmKinematics, q: ArrayLike
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Centres in A [m], (n, k, 3), and which mind the chassis, the world."""
    corners = arm.joint_positions(q)
    links = np.diff(arm.joint_positions(np.zeros(JOINTS)), axis=0)
    shares, starts = [], []
    for link in (1, 2, 3):
        length = float(np.linalg.norm(links[link]))
        count = int(np.ceil(length / _SPACING))
        shares.append(np.arange(1, count + 1) / count)
        starts.append(np.full(count, link))
    share, start = np.concatenate(shares), np.concatenate(starts)
    a, b = corners[:, start], corners[:, start + 1]
    balls = a + share[:, None] * (b - a)
    # The upper arm stands on the chassis.
    chassis = start > 1
    world = ~((start == 3) & ((1 - share) * arm.hand < TIP_LENGTH))
    return balls, chassis, world
