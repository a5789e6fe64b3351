"""Which joint positions make the arm touch something: beyond section 4.3.

The map of the dissertation considers the kinematics of the arm alone: its best
place may be under a table that the arm passes through, or on the target. Here
the links are rows of balls. No ball may touch an obstacle; those of forearm and
hand may not touch the chassis or the column of the waist, and those of the hand
not the upper arm. The floor is not checked, since the chassis is in the way of
an arm that reaches down to it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from drake_mobarm.geometry import Array
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.arm_parameters import JOINTS
from drake_mobarm.robot.shape import GRIPPER, LINK_RADIUS, RADIUS, WAIST_COLUMN
from drake_mobarm.world.obstacles import Obstacle

TIP_LENGTH = 0.06
"""Length of the end of the hand, which may touch what the tool works on [m]."""

# The index in `ArmKinematics.joint_positions` where each link begins.
_UPPER_ARM, _FOREARM, _HAND = 1, 2, 3
# The largest distance between neighbouring balls of a link [m].
_SPACING = 0.04


class Surroundings:
    """What the arm must not touch.

    Args:
        obstacles: convex obstacles, in W.
    """

    def __init__(self, obstacles: Sequence[Obstacle]) -> None:
        self._planes = [_planes(o.corners) for o in obstacles]
        self._boxes = np.array(
            [[o.corners.min(axis=0), o.corners.max(axis=0)] for o in obstacles]
        ).reshape(-1, 2, 3)

    def touched(
        self, arm: ArmKinematics, p_WA: ArrayLike, q: ArrayLike
    ) -> NDArray[np.bool_]:
        """Whether the arm touches an obstacle or the robot itself, (n,).

        Args:
            arm: the arm.
            p_WA: place of the base of the arm [m], (n, 3); its axes are along
                those of W.
            q: joint positions [rad], (n, 6).
        """
        base = np.asarray(p_WA, dtype=float)
        balls_A, link, world = _balls(arm, q)
        balls = balls_A + base[:, None]
        hit = _touches_itself(arm, q, balls_A, link)
        # Only obstacles near any of the balls, and only balls near an obstacle
        # are worked out.
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
    """Outward normals (k, 3) and offsets [m], (k,), of a convex body."""
    equations = ConvexHull(corners).equations
    sides = np.unique(np.round(equations, 9), axis=0)
    return sides[:, :3], sides[:, 3]


def _touches_itself(
    arm: ArmKinematics, q: ArrayLike, balls: Array, link: NDArray[np.int_]
) -> NDArray[np.bool_]:
    """Whether forearm or hand touch chassis, waist or upper arm, (n,)."""
    outwards = np.hypot(balls[..., 0], balls[..., 1])
    # The arm's base, where z is 0, stands on the chassis.
    to_chassis = np.hypot(
        np.maximum(outwards - RADIUS, 0), np.maximum(balls[..., 2], 0)
    )
    radius, height = WAIST_COLUMN
    to_column = np.hypot(
        np.maximum(outwards - radius, 0), np.maximum(balls[..., 2] - height, 0)
    )
    carried = link > _UPPER_ARM
    distance = np.minimum(to_chassis, to_column)
    hit = np.any((distance < LINK_RADIUS) & carried, axis=1)
    corners = arm.joint_positions(q)
    start, upper_arm = corners[:, 1, None], corners[:, 2] - corners[:, 1]
    to_ball = balls[:, link == _HAND] - start
    share = np.einsum("nki,ni->nk", to_ball, upper_arm) / np.sum(
        upper_arm**2, axis=1, keepdims=True
    )
    share = np.clip(share, 0, 1)[..., None]
    away = np.linalg.norm(to_ball - share * upper_arm[:, None], axis=2)
    hit |= np.any(away < 2 * LINK_RADIUS, axis=1)
    return np.asarray(hit)


def _balls(
    arm: ArmKinematics, q: ArrayLike
) -> tuple[Array, NDArray[np.int_], NDArray[np.bool_]]:
    """The balls that stand for the links.

    Returns:
        Their centres in the frame of the arm's base [m], (n, k, 3); the link
        of each, (k,); and whether it may not touch obstacles, (k,), as those
        at the end of the hand may.
    """
    corners = arm.joint_positions(q)
    links = np.diff(arm.joint_positions(np.zeros(JOINTS)), axis=0)
    shares, starts = [], []
    for link in (_UPPER_ARM, _FOREARM, _HAND):
        length = float(np.linalg.norm(links[link]))
        count = int(np.ceil(length / _SPACING))
        shares.append(np.arange(1, count + 1) / count)
        starts.append(np.full(count, link))
    share, start = np.concatenate(shares), np.concatenate(starts)
    a, b = corners[:, start], corners[:, start + 1]
    along, aside = GRIPPER
    X_AT = arm.forward(q)
    middle = corners[:, 3] + along * X_AT[:, :3, 0]
    sides = [middle + s * aside * X_AT[:, :3, 1] for s in (1, -1)]
    balls = np.concatenate(
        [a + share[:, None] * (b - a), np.stack(sides, axis=1)], axis=1
    )
    world = ~((start == _HAND) & ((1 - share) * arm.hand < TIP_LENGTH))
    return (
        balls,
        np.concatenate([start, [_HAND, _HAND]]),
        np.concatenate([world, [True, True]]),
    )
