"""Odometry held to what the lidar sees: wheels slip, walls stand still.

A scan is laid over a reference scan, taken some way back. Where it does
not fit at the pose that odometry gives, the pose at which it fits best is
found by trimmed iterative closest points, from odometry's pose and from the
last one; the difference to odometry is kept. Where odometry fits, nothing is
changed: it drifts less than what matching would add up.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from drake_mobarm.checks import positive, within
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array, transform_points, wrap_angle
from drake_mobarm.immutable import Immutable
from drake_mobarm.sensors.lidar import ray_angles

Pose = tuple[float, float, float]
"""[x, y, yaw] in m and rad."""

# A range this near to the lidar's longest [m] is "no return".
_NO_RETURN = 0.05
# Nearer than this [m] is the robot itself.
_NEAREST = 0.2
# With fewer returns than this a scan says nothing about the pose.
_LEAST_POINTS = 40
# Neighbouring returns up to this far apart [m] are of one thing, whose side is
# filled with points this far apart [m].
_ONE_THING = 0.4
_SPACING = 0.05
# A corrected pose has to bring the points nearer by this factor.
_BETTER = 0.8
# From one scan to the next no robot moves or turns more than this [m, rad].
_JUMP = (0.6, 1.0)
# Pairs farther apart than this [m] are trimmed: first and last iteration.
_TRIM = (0.6, 0.12)
_ITERATIONS = 12


@frozen
class ScanMatchingParameters:
    """When odometry is believed, and when the lidar.

    Attributes:
        fit_distance: within which a point fits the reference [m], positive.
        fit_share: of points that fit at a right pose [-], in (0, 1].
        least_move: correction [m] from which odometry is corrected, positive.
        least_turn: the same for the yaw [rad], positive.
        check_move: after which odometry is checked even where it seems to fit
            [m], positive.
        check_turn: the same for turning [rad], positive.
        renew_share: of points that fit at a check [-] below which a new
            reference is taken, in (0, 1].
    """

    fit_distance: float = 0.08
    fit_share: float = 0.75
    least_move: float = 0.02
    least_turn: float = 0.01
    check_move: float = 0.6
    check_turn: float = 0.3
    renew_share: float = 0.9

    def __post_init__(self) -> None:
        positive(self, *vars(self))
        within(self, "(0, 1]", "fit_share", "renew_share")


@dataclass(frozen=True, eq=False)
class ScanMatchingState(Immutable):
    """What matching knows.

    Attributes:
        correction: X_WO of odometry's frame O, [x, y, yaw] in m and rad.
        pose: X_WB at the last scan; None before one.
        reference: of the sides that were seen; None before they were.
        checked: X_WB at the last check.
    """

    correction: Pose = (0.0, 0.0, 0.0)
    pose: Pose | None = None
    reference: KDTree | None = None
    checked: Pose = (0.0, 0.0, 0.0)


def match(
    state: ScanMatchingState,
    pose_OB: Sequence[float],
    ranges: ArrayLike,
    range_max: float,
    parameters: ScanMatchingParameters,
) -> ScanMatchingState:
    """Takes in a scan.

    Args:
        state: after the last scan; it is not changed.
        pose_OB: odometry at the scan, [x, y, yaw] in m and rad, (3,).
        ranges: [m], (rays,), in the order of `ray_angles`; NaN where missing.
        range_max: the longest range of the lidar [m], which it reports where
            nothing is met.
        parameters: when to believe what.

    Returns:
        The state with the correction from now on; the same one where pose or
        scan say nothing.
    """
    odometry = tuple(map(float, pose_OB))
    scanned = np.asarray(ranges, dtype=float)
    returned = (scanned > _NEAREST) & (scanned < range_max - _NO_RETURN)
    if not all(map(math.isfinite, odometry)):
        return state
    pose = compose(state.correction, odometry)
    if np.count_nonzero(returned) < _LEAST_POINTS:
        return replace(state, pose=pose, reference=None)
    angles = ray_angles(scanned.size)
    seen = scanned[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    points = seen[returned]
    if state.reference is None or state.pose is None:
        return _with_reference(replace(state, pose=pose), pose, seen, returned)
    reach = parameters.fit_distance
    fit = _fit(state.reference, points, pose, reach)
    moved = math.dist(pose[:2], state.checked[:2])
    turned = abs(wrap_angle(pose[2] - state.checked[2]))
    is_due = moved > parameters.check_move or turned > parameters.check_turn
    lost = fit.share < parameters.fit_share or _has_jumped(state.pose, pose)
    if lost or is_due:
        found, found_fit = min(
            (
                (candidate, _fit(state.reference, points, candidate, reach))
                for start in ((pose, state.pose) if lost else (pose,))
                for candidate in (align(state.reference, points, start),)
            ),
            key=lambda pair: pair[1].distance,
        )
        apart = math.dist(found[:2], pose[:2])
        angle = abs(wrap_angle(found[2] - pose[2]))
        if (
            found_fit.distance < _BETTER * fit.distance
            and found_fit.share >= min(parameters.fit_share, fit.share + 0.1)
            and (apart > parameters.least_move or angle > parameters.least_turn)
        ):
            pose, fit = found, found_fit
            state = replace(state, correction=compose(pose, inverse(odometry)))
    state = replace(state, pose=pose)
    if not is_due:
        return state
    # An old reference lets no small errors add up.
    if fit.share < parameters.renew_share:
        return _with_reference(state, pose, seen, returned)
    return replace(state, checked=pose)


def _has_jumped(last: Pose, pose: Pose) -> bool:
    """Whether odometry moved faster than any robot of this kind."""
    return (
        math.dist(last[:2], pose[:2]) > _JUMP[0]
        or abs(wrap_angle(pose[2] - last[2])) > _JUMP[1]
    )


def align(reference: KDTree, points: Array, pose: Pose) -> Pose:
    """The pose at which points lie on a reference, near a first guess.

    Args:
        reference: of points p_WR [m].
        points: p_BP [m], (n, 2).
        pose: the first guess of X_WB.
    """
    for trim in np.geomspace(*_TRIM, _ITERATIONS):
        placed = transform_points(pose, points)
        apart, nearest = reference.query(placed, distance_upper_bound=trim)
        near = np.isfinite(apart)
        if np.count_nonzero(near) < _LEAST_POINTS / 2:
            return pose
        a, b = placed[near], reference.data[nearest[near]]
        a_middle, b_middle = a.mean(axis=0), b.mean(axis=0)
        a, b = a - a_middle, b - b_middle
        turn = math.atan2(
            float(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])),
            float(np.sum(a * b)),
        )
        cos, sin = math.cos(turn), math.sin(turn)
        x, y = np.array([pose[0], pose[1]]) - a_middle
        pose = (
            float(b_middle[0] + cos * x - sin * y),
            float(b_middle[1] + sin * x + cos * y),
            pose[2] + turn,
        )
    return pose


def compose(pose_AB: Sequence[float], pose_BC: Sequence[float]) -> Pose:
    """X_AC of planar poses [x, y, yaw] in m and rad."""
    x, y, yaw = pose_AB
    cos, sin = math.cos(yaw), math.sin(yaw)
    return (
        x + cos * pose_BC[0] - sin * pose_BC[1],
        y + sin * pose_BC[0] + cos * pose_BC[1],
        yaw + pose_BC[2],
    )


def inverse(pose_AB: Sequence[float]) -> Pose:
    """X_BA of a planar pose [x, y, yaw] in m and rad."""
    x, y, yaw = pose_AB
    cos, sin = math.cos(yaw), math.sin(yaw)
    return (-cos * x - sin * y, sin * x - cos * y, -yaw)


class _Fit(NamedTuple):
    """How well points lie on a reference.

    Attributes:
        share: of the points that are near it [-].
        distance: to it, of the points in the mean; one that is not near
            counts as just near [m].
    """

    share: float
    distance: float


def _fit(reference: KDTree, points: Array, pose: Pose, near: float) -> _Fit:
    """How well points p_BP (n, 2) [m] lie on a reference at a pose."""
    apart, _ = reference.query(
        transform_points(pose, points), distance_upper_bound=near
    )
    return _Fit(
        float(np.mean(np.isfinite(apart))),
        float(np.mean(np.minimum(apart, near))),
    )


def _with_reference(
    state: ScanMatchingState,
    pose: Pose,
    seen: Array,
    returned: NDArray[np.bool_],
) -> ScanMatchingState:
    """The state with a scan as reference, its sides filled with points."""
    after = np.roll(seen, -1, axis=0)
    step = np.hypot(*(after - seen).T)
    is_side = returned & np.roll(returned, -1) & (step < _ONE_THING)
    (filled,) = is_side.nonzero()
    count = np.floor(step[filled] / _SPACING).astype(int)
    side = filled.repeat(count)
    number = np.arange(side.size) - (count.cumsum() - count).repeat(count) + 1
    share = (number / (count + 1).repeat(count))[:, None]
    between = seen[side] * (1 - share) + after[side] * share
    points = np.vstack([seen[returned], between])
    return replace(
        state,
        reference=KDTree(transform_points(pose, points)),
        checked=pose,
    )
