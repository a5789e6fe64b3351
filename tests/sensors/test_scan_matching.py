"""Scan matching against the true pose in a room, with odometry made wrong."""

import math

import numpy as np
import pytest

from drake_mobarm.sensors.lidar import cast_rays
from drake_mobarm.sensors.scan_matching import (
    ScanMatchingParameters,
    ScanMatchingState,
    compose,
    inverse,
    match,
)
from drake_mobarm.world.obstacles import outlines_to_segments
from helpers.shapes import rectangle

PARAMETERS = ScanMatchingParameters()
RANGE_MAX = 12.0
# A room of 6 m by 4 m with a cupboard and a pillar.
ROOM = outlines_to_segments(
    [
        rectangle(-3.2, -2.2, 3.2, -2.0),
        rectangle(-3.2, 2.0, 3.2, 2.2),
        rectangle(-3.2, -2.2, -3.0, 2.2),
        rectangle(3.0, -2.2, 3.2, 2.2),
        rectangle(1.5, 1.2, 2.5, 2.0),
        rectangle(-1.5, -0.9, -1.2, -0.6),
    ]
)
NOTHING = np.full(360, RANGE_MAX)


def seen(pose, rng):
    ranges = cast_rays(*ROOM, pose, 360) + rng.normal(0, 0.01, 360)
    return np.minimum(ranges, RANGE_MAX)


def measured(state, odometry):
    return np.array(compose(state.correction, odometry))


def drive(true_poses, odometry_poses, state=None, seed=0):
    """The measured poses along a drive."""
    rng = np.random.default_rng(seed)
    state = state or ScanMatchingState()
    poses = []
    for true, odometry in zip(true_poses, odometry_poses, strict=True):
        state = match(state, odometry, seen(true, rng), RANGE_MAX, PARAMETERS)
        poses.append(measured(state, odometry))
    return np.array(poses), state


def arc(count, speed=0.05, turn=0.02):
    yaw = turn * np.arange(count)
    x = -1 + speed * np.concatenate([[0], np.cos(yaw[:-1])]).cumsum()
    y = speed * np.concatenate([[0], np.sin(yaw[:-1])]).cumsum()
    return np.column_stack([x, y, yaw])


@pytest.mark.parametrize("seed", range(5))
def test_right_odometry_is_not_touched(seed):
    true = arc(60)
    poses, state = drive(true, true, seed=seed)
    np.testing.assert_array_equal(poses, true)
    assert state.correction == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    "slip", [(0.0, 0.0, 0.15), (0.0, 0.0, -0.15), (0.05, 0.0, 0.0)]
)
def test_wheels_that_slip_on_the_spot_move_nothing(slip, seed):
    # 2 s of slip: 3 rad of turning, or 1 m of rolling.
    steps = np.arange(21)[:, None]
    true = np.tile([0.5, 0.3, 0.4], (21, 1))
    poses, _ = drive(true, true + steps * slip, seed=seed)
    np.testing.assert_allclose(poses[:, :2], true[:, :2], atol=0.08)
    np.testing.assert_allclose(poses[:, 2], true[:, 2], atol=0.04)


def test_a_jump_of_odometry_is_taken_back():
    true = arc(40)
    odometry = true.copy()
    # Half a turn about W's origin: the frame itself has jumped.
    odometry[20:] = [compose((0.0, 0.0, math.pi), p) for p in true[20:]]
    poses, _ = drive(true, odometry)
    np.testing.assert_allclose(poses[-1], true[-1], atol=0.08)


def test_odometry_a_tenth_too_long_stays_within_a_decimetre():
    true = arc(60)
    odometry = true.copy()
    odometry[:, :2] = true[0, :2] + 1.1 * (true[:, :2] - true[0, :2])
    poses, _ = drive(true, odometry)
    error = np.hypot(*(poses - true)[:, :2].T)
    assert np.hypot(*(odometry - true)[-1, :2]) > 0.2
    assert error.max() < 0.1


def test_where_nothing_is_seen_odometry_is_believed():
    state = ScanMatchingState()
    for x in np.linspace(0, 2, 21):
        state = match(state, (x, 0, 0), NOTHING, RANGE_MAX, PARAMETERS)
        np.testing.assert_array_equal(measured(state, (x, 0, 0)), [x, 0, 0])


def test_after_a_scan_that_shows_nothing_odometry_is_believed_anew():
    rng = np.random.default_rng(3)
    true, odometry = (0.5, 0.3, 0.4), (0.8, 0.3, 0.4)
    state = ScanMatchingState()
    for pose, ranges in (
        (true, seen(true, rng)),
        (odometry, NOTHING),
        (odometry, seen(true, rng)),
        (odometry, seen(true, rng)),
    ):
        state = match(state, pose, ranges, RANGE_MAX, PARAMETERS)
    np.testing.assert_array_equal(measured(state, odometry), odometry)


def test_odometry_is_checked_after_its_angle_and_what_fits_is_kept():
    turning = np.column_stack([np.zeros((4, 2)), 0.2 * np.arange(4)])
    states = [drive(turning[:n], turning[:n])[1] for n in (1, 2, 3, 4)]
    # 0.4 rad is the first turn of more than 0.3 rad.
    yaws = [state.checked[2] for state in states]
    assert yaws == pytest.approx([0.0, 0.0, 0.4, 0.4])
    first, last = states[0].reference.data, states[-1].reference.data
    np.testing.assert_array_equal(first, last)


def test_where_a_scan_shows_other_things_it_is_the_new_reference():
    rng = np.random.default_rng(4)
    state = match(
        ScanMatchingState(),
        (0, 0, 0),
        seen((0, 0, 0), rng),
        RANGE_MAX,
        PARAMETERS,
    )
    # A fifth of the scan, 72 rays, meets something new at 1 m; it is taken
    # for new at the next check, 0.6 m on.
    for x in (0.3, 0.7):
        ranges = seen((x, 0, 0), rng)
        ranges[144:216] = 1.0
        before = state.reference
        state = match(state, (x, 0, 0), ranges, RANGE_MAX, PARAMETERS)
        assert (state.reference is before) == (x < 0.6)


def test_the_sides_of_things_are_filled_and_the_space_between_is_not():
    # A pillar 1 m ahead, before a wall 2 m ahead: rays meet the wall up to
    # 10 cm apart, and from its edge to the wall it is more than 1 m.
    sides = outlines_to_segments(
        [rectangle(1.0, -0.2, 1.1, 0.2), rectangle(2.0, -3.0, 2.1, 3.0)]
    )
    ranges = np.minimum(cast_rays(*sides, (0, 0, 0), 360), RANGE_MAX)
    state = match(ScanMatchingState(), (0, 0, 0), ranges, RANGE_MAX, PARAMETERS)
    x, y = state.reference.data.T
    off = np.minimum(np.abs(x - 1.0), np.abs(x - 2.0))
    np.testing.assert_allclose(off, 0, atol=1e-9)
    along = np.sort(y[np.abs(x - 2.0) < 0.01])
    # Only behind the pillar, 0.4 m to each side, is a gap.
    gaps = np.diff(along)
    assert np.count_nonzero(gaps > 0.1) == 1
    assert gaps.max() == pytest.approx(0.8, abs=0.1)
    assert np.sort(gaps)[-2] < 0.055


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_pose_that_is_not_finite_changes_nothing(bad):
    _, state = drive(arc(5), arc(5))
    rng = np.random.default_rng(1)
    after = match(
        state, (bad, 0, 0), seen((0, 0, 0), rng), RANGE_MAX, PARAMETERS
    )
    assert after is state


def test_missing_rays_are_left_out():
    rng = np.random.default_rng(2)
    true = (0.5, 0.3, 0.4)
    state = match(
        ScanMatchingState(), true, seen(true, rng), RANGE_MAX, PARAMETERS
    )
    ranges = seen(true, rng)
    ranges[::3] = math.nan
    state = match(state, (0.7, 0.3, 0.4), ranges, RANGE_MAX, PARAMETERS)
    np.testing.assert_allclose(
        measured(state, (0.7, 0.3, 0.4)), true, atol=0.03
    )


def test_a_pose_and_its_inverse_compose_to_nothing():
    pose = (1.0, -2.0, 2.5)
    np.testing.assert_allclose(compose(pose, inverse(pose)), 0, atol=1e-12)
    # By hand: a quarter turn at (1, 0) puts (2, 0) at (1, 2).
    np.testing.assert_allclose(
        compose((1, 0, math.pi / 2), (2, 0, 0.5)), [1, 2, math.pi / 2 + 0.5]
    )
