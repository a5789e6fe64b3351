"""Where the base is on a floor plan: odometry, held to it by the lidar.

An extended Kalman filter of the pose. Odometry moves it; then a scan is laid
over the plan's distance field, and the most probable pose is found by
Gauss-Newton steps. What the plan does not show weighs little, and a direction
that the scan says nothing about, such as that of a corridor, is left to
odometry.

Frames, as ROS has them: W is the floor plan's (`map`), O is odometry's
(`odom`), B is the base. Odometry gives X_OB; what is kept is X_WO, which
changes at a scan only.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import at_least, positive, within
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array, is_pose, rotation
from drake_mobarm.immutable import Immutable
from drake_mobarm.sensors.distance_field import DistanceField
from drake_mobarm.sensors.lidar import ray_angles
from drake_mobarm.sensors.scan_matching import Pose, compose, inverse

# A range this near to the lidar's longest [m] is "no return".
_NO_RETURN = 0.05
# Nearer than this [m] is the robot itself.
_NEAREST = 0.2
# Odometry's deviations from a scan to the next, even at rest [m, rad].
_AT_REST = (0.0005, 0.0005)
# A side is seen straight from points this far apart [m] on, which no point
# between them is farther from than that [m].
_SIDE, _STRAIGHT = 0.15, 0.04
# Of the information about the position, a direction has to have this share.
_LEAST_SEEN = 0.06
# So many steps, or until they are this small [m, rad].
_STEPS, _SMALL_STEP = 10, 1e-5
# Where fewer rays fit than this share of those that did, the pose is sought
# anew. One that this share more of all rays fits, and most of them, is right.
_SUSPECT, _BETTER, _MOST = 0.7, 0.15, 0.5
# Seeking takes longer than a fit: where it fails at so many scans, it is done
# at every one of as many only.
_SEEK_EACH = 5
# Where fewer fit than this share of those that did, none is believed.
_LOST = 0.4
# What did fit counts less by this factor from each scan to the next.
_FORGET = 0.99
# Seeking, rays are first drawn to surfaces this far away [m]; so many steps,
# from poses moved in B by as much, with a prior of these deviations.
_FAR, _FAR_STEPS = 0.6, 12
_MOVES: tuple[Pose, ...] = ((0.0, 0.0, 0.0), (0.6, 0.0, 0.0), (-0.6, 0.0, 0.0))
_ANYWHERE = (0.5, 0.5, 0.5)


@frozen
class LocalizationParameters:
    """How far odometry, lidar and floor plan are believed.

    Attributes:
        start_deviation: standard, of x, y [m] and yaw [rad] at the start,
            positive.
        odometry_move: standard deviation of odometry's x and y after 1 m
            [m], positive; it grows with the root of the way.
        odometry_turn: the same of its yaw after 1 rad of turning [rad].
        odometry_veer: the same of its yaw after 1 m [rad].
        range_deviation: standard, of a range [m], positive.
        surface_length: of the stretches of a surface along which the plan's
            error is the same [m], positive.
        fit_deviations: of the ray's end from the plan at which it weighs a
            quarter of one on it [-], positive. Inside of things, half of that.
        least_rays: that have to fit, or the scan says nothing.
        least_share: of the rays with a return that have to fit [-], in
            (0, 1].
    """

    start_deviation: float = 0.01
    odometry_move: float = 0.02
    odometry_turn: float = 0.02
    odometry_veer: float = 0.01
    range_deviation: float = 0.01
    surface_length: float = 2.0
    fit_deviations: float = 3.0
    least_rays: int = 30
    least_share: float = 0.2

    def __post_init__(self) -> None:
        at_least(self, 1, "least_rays")
        positive(self, *vars(self))
        within(self, "(0, 1]", "least_share")


@dataclass(frozen=True, eq=False)
class LocalizationState(Immutable):
    """What is known of the pose.

    Attributes:
        covariance: of x, y and yaw of X_WB at the last scan [m, rad], (3, 3).
        correction: X_WO as [x, y, yaw] in m and rad.
        odometry: X_OB at the last scan; None before one.
        share: of rays that fitted of late [-].
        suspect: scans in a row that fitted much less, and nowhere else.
    """

    covariance: Array
    correction: Pose = (0.0, 0.0, 0.0)
    odometry: Pose | None = None
    share: float = 1.0
    suspect: int = 0


class Scan(NamedTuple):
    """What a scan has met.

    Attributes:
        points: p_BP [m], (n, 2).
        normals: in B, of the straight sides that they are on, (n, 2); 0 where
            there is none.
        variance: of the points' distances to the plan [m^2], (n,).
    """

    points: Array
    normals: Array
    variance: Array


class Fit(NamedTuple):
    """Where a scan fits best.

    Attributes:
        pose: X_WB.
        information: about it, the inverse of its covariance, (3, 3).
        share: of the rays that fit [-].
    """

    pose: Pose
    information: Array
    share: float


def begin(parameters: LocalizationParameters) -> LocalizationState:
    """The state at the start, where odometry's frame is W."""
    return LocalizationState(np.eye(3) * parameters.start_deviation**2)


def localize(
    state: LocalizationState,
    pose_OB: Sequence[float],
    ranges: ArrayLike,
    range_max: float,
    field: DistanceField,
    parameters: LocalizationParameters,
) -> LocalizationState:
    """Takes in a scan.

    Args:
        state: after the last scan; it is not changed.
        pose_OB: odometry at the scan, [x, y, yaw] in m and rad, (3,).
        ranges: [m], (rays,), in the order of `ray_angles`; NaN where missing.
        range_max: the longest range of the lidar [m], which it reports where
            nothing is met.
        field: of the floor plan.
        parameters: how far each is believed.

    Returns:
        The state with the correction from now on; the same one where odometry
        gives no pose that can be.
    """
    x, y, yaw = map(float, pose_OB)
    odometry = (x, y, yaw)
    if not is_pose(odometry):
        return state
    last = compose(state.correction, state.odometry or odometry)
    state = predict(state, odometry, parameters)
    scan = read_scan(ranges, range_max, field, parameters)
    if field.is_empty or len(scan.points) < parameters.least_rays:
        return state
    pose = compose(state.correction, odometry)
    variance = parameters.range_deviation**2 + field.variance
    scale = parameters.fit_deviations * math.sqrt(variance)
    prior = _inverse(state.covariance)
    found = fit(field, scan, pose, prior, [scale] * _STEPS)
    suspect = state.suspect + 1 if found.share < _SUSPECT * state.share else 0
    if suspect and (suspect <= _SEEK_EACH or suspect % _SEEK_EACH == 0):
        starts = [last, *(compose(pose, move) for move in _MOVES)]
        anew = seek(field, scan, starts, scale)
        if anew.share > max(found.share + _BETTER, _MOST):
            found, suspect = anew, 0
    share = max(found.share, _FORGET * state.share)
    state = replace(state, share=share, suspect=suspect)
    few = found.share * len(scan.points) < parameters.least_rays
    if few or found.share < max(parameters.least_share, _LOST * share):
        return state
    return replace(
        state,
        correction=compose(found.pose, inverse(odometry)),
        covariance=_inverse(found.information),
    )


def predict(
    state: LocalizationState, odometry: Pose, parameters: LocalizationParameters
) -> LocalizationState:
    """The state after odometry has moved on.

    Args:
        state: at the last scan.
        odometry: X_OB now.
        parameters: of them, how far odometry is believed.
    """
    if state.odometry is None:
        return replace(state, odometry=odometry)
    last = compose(state.correction, state.odometry)
    x, y, yaw = compose(state.correction, odometry)
    # An error of the yaw turns the way since.
    moved = np.eye(3)
    moved[:2, 2] = last[1] - y, x - last[0]
    way, turned = math.dist((x, y), last[:2]), abs(yaw - last[2])
    position = way * parameters.odometry_move**2 + _AT_REST[0] ** 2
    heading = (
        turned * parameters.odometry_turn**2
        + way * parameters.odometry_veer**2
        + _AT_REST[1] ** 2
    )
    added = np.diag([position, position, heading])
    return replace(
        state,
        odometry=odometry,
        covariance=moved @ state.covariance @ moved.T + added,
    )


def read_scan(
    ranges: ArrayLike,
    range_max: float,
    field: DistanceField,
    parameters: LocalizationParameters,
) -> Scan:
    """The ends of the rays that have met something.

    All rays that meet the same stretch of a surface share the plan's error
    there: each of n such rays has n times its variance.

    Args:
        ranges: [m], (rays,), in the order of `ray_angles`; NaN where missing.
        range_max: the longest range of the lidar [m].
        field: of the floor plan.
        parameters: how exact ranges are, and how long a stretch is.
    """
    scanned = np.asarray(ranges, dtype=float)
    met = (scanned > _NEAREST) & (scanned < range_max - _NO_RETURN)
    distance, angle = scanned[met], ray_angles(scanned.size)[met]
    points = distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    apart = distance * (2 * np.pi / scanned.size)
    sharing = np.maximum(parameters.surface_length / apart, 1.0)
    variance = parameters.range_deviation**2 + sharing * field.variance
    # Far enough before and behind each point that noise turns the side little.
    number, step = np.arange(len(points)), np.ceil(_SIDE / apart).astype(int)
    ahead = points[(number + step) % max(len(points), 1)] - points
    behind = points[(number - step) % max(len(points), 1)] - points
    side = ahead - behind
    length = np.hypot(*side.T)
    area = np.abs(ahead[:, 0] * behind[:, 1] - ahead[:, 1] * behind[:, 0])
    straight = (length > _SIDE) & (area < _STRAIGHT * length)
    normals = np.zeros_like(points)
    turned = np.column_stack([-side[:, 1], side[:, 0]])
    normals[straight] = turned[straight] / length[straight, None]
    return Scan(points, normals, variance)


def residuals(
    field: DistanceField, scan: Scan, pose: ArrayLike
) -> tuple[Array, Array]:
    """Distances of a scan's points to the plan, and their derivatives.

    A plan's cells make stairs of a slanting wall. So along a side that the
    scan shows to be straight the distance counts as constant.

    Args:
        field: of the floor plan.
        scan: what was met.
        pose: X_WB, [x, y, yaw] in m and rad, (3,).

    Returns:
        [m], (n,), infinite beyond the field; and the derivatives by x, y and
        yaw [-, -, m], (n, 3), which are 0 there.
    """
    *p_WB, yaw = np.asarray(pose).tolist()
    R_WB = rotation(yaw)
    arm = scan.points @ R_WB.T
    distance, gradient = field.at(arm + np.array(p_WB))
    normals = scan.normals @ R_WB.T
    across = np.sum(normals * gradient, axis=1)[:, None] * normals
    is_on_side = np.hypot(*normals.T)[:, None] > 0
    gradient = np.where(is_on_side, across, gradient)
    by_yaw = gradient[:, 1] * arm[:, 0] - gradient[:, 0] * arm[:, 1]
    return distance, np.column_stack([gradient, by_yaw])


def fit(
    field: DistanceField,
    scan: Scan,
    pose: Pose,
    prior: Array,
    scales: Sequence[float],
) -> Fit:
    """The most probable pose, by Gauss-Newton steps.

    The weights are those of Geman and McClure, c^4 / (c^2 + d^2)^2.

    Args:
        field: of the floor plan.
        scan: what was met.
        pose: X_WB that is expected.
        prior: information about it, (3, 3).
        scales: c of each step [m]; the last ones may be left out.
    """
    expected = np.array(pose)
    estimate = expected
    for scale in scales:
        distance, jacobian = residuals(field, scan, estimate)
        # Legs under a table are deeper inside it than a wall's surface is.
        c = np.where(distance < 0, scale / 2, scale)
        weight = (c**2 / (c**2 + distance**2)) ** 2 / scan.variance
        weighted = jacobian * weight[:, None]
        near = np.isfinite(distance)
        seen = _seen(weighted.T @ jacobian)
        information = prior + seen @ weighted.T @ jacobian @ seen
        gradient = prior @ (estimate - expected)
        gradient += seen @ weighted[near].T @ distance[near]
        step = np.linalg.solve(information, gradient)
        estimate = estimate - step
        if scale == scales[-1] and np.abs(step).max() < _SMALL_STEP:
            break
    x, y, yaw = estimate.tolist()
    return Fit((x, y, yaw), information, float(np.mean(np.abs(distance) < c)))


def seek(
    field: DistanceField, scan: Scan, starts: Sequence[Pose], scale: float
) -> Fit:
    """Where most of a scan fits, near some poses that are hardly known.

    Args:
        field: of the floor plan.
        scan: what was met.
        starts: X_WB to seek from.
        scale: c of the last step [m].
    """
    prior = np.diag(np.power(_ANYWHERE, -2.0))
    scales = np.geomspace(_FAR, scale, _FAR_STEPS).tolist()
    fits = [fit(field, scan, start, prior, scales) for start in starts]
    return max(fits, key=lambda found: found.share)


def _seen(information: Array) -> Array:
    """The projection (3, 3) that leaves out a direction hardly seen."""
    shares, directions = np.linalg.eigh(information[:2, :2])
    projection = np.eye(3)
    if shares[0] < _LEAST_SEEN * shares.sum():
        direction = directions[:, 0]
        projection[:2, :2] -= np.outer(direction, direction)
    return projection


def _inverse(matrix: Array) -> Array:
    """The inverse of a covariance (3, 3), or of an information."""
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)
