"""Which poses are used, dropped or begun anew from, and which strengths."""

import math

import pytest

from drake_mobarm.homing.screening import (
    PoseHistory,
    PoseVerdict,
    is_possible_strength,
    screen_pose,
)
from drake_mobarm.sensors.rssi import RssiModel

SOUND, DROPPED, MOVED = PoseVerdict
LIMITS = (1.0, 5.0)
PERIOD = 0.05
BAD = [
    (math.nan, 0.0, 0.0),
    (0.0, math.inf, 0.0),
    (1e300, 0.0, 0.0),
    (0.0, 0.0, -1e300),
]


def verdicts(poses):
    history, found = PoseHistory(), []
    for pose in poses:
        history, verdict = screen_pose(history, pose, PERIOD, LIMITS)
        found.append(verdict)
    return found


def test_poses_of_a_robot_that_drives_are_sound():
    # 1 m/s and 5 rad/s, all the time; the yaw is not wrapped.
    poses = [(0.05 * i, 0.0, 0.25 * i) for i in range(100)]
    assert set(verdicts(poses)) == {SOUND}


@pytest.mark.parametrize("bad", BAD)
def test_poses_that_cannot_be_one_are_dropped_and_nothing_else(bad):
    poses = [(0.0, 0.0, 0.0)] * 3 + [bad] * 4 + [(0.2, 0.0, 0.0)] * 3
    assert verdicts(poses) == [SOUND] * 3 + [DROPPED] * 4 + [SOUND] * 3


def test_a_pose_may_be_far_after_a_long_time_without_one():
    poses = [(0.0, 0.0, 0.0), *[BAD[0]] * 59, (3.2, 0.0, 2.0)]
    assert verdicts(poses)[-1] is SOUND
    poses[-1] = (3.8, 0.0, 2.0)  # 3 s at 1 m/s, and 0.5 m that may be slip.
    assert verdicts(poses)[-1] is DROPPED


@pytest.mark.parametrize("jump", [(5.0, 0.0, 0.0), (0.0, 0.0, math.pi)])
def test_a_jump_and_back_is_dropped_for_as_long(jump):
    here = (1.0, 2.0, 0.5)
    there = tuple(map(sum, zip(here, jump, strict=True)))
    poses = [here] * 3 + [there] * 4 + [here] * 3
    assert verdicts(poses) == [SOUND] * 3 + [DROPPED] * 4 + [SOUND] * 3


@pytest.mark.parametrize("jump", [(5.0, 0.0, 0.0), (0.0, 0.0, math.pi)])
def test_a_jump_for_good_is_begun_anew_from_after_half_a_second(jump):
    here = (1.0, 2.0, 0.5)
    there = tuple(map(sum, zip(here, jump, strict=True)))
    found = verdicts([here] * 3 + [there] * 15)
    # Doubt is 0.05 s at the jump, above 0.5 s 10 poses later.
    assert found == [SOUND] * 3 + [DROPPED] * 10 + [MOVED] + [SOUND] * 4


def test_what_slips_less_than_half_a_metre_is_no_jump():
    assert verdicts([(0, 0, 0), (0.5, 0, 0), (0.0, 0, 0)]) == [SOUND] * 3


def test_poses_that_jump_all_the_time_are_never_used():
    poses = [(0.0, 0.0, 0.0)] + [(3.0 * i, 0.0, 0.0) for i in range(1, 40)]
    assert set(verdicts(poses)[1:]) == {DROPPED}


@pytest.mark.parametrize(
    ("rssi", "possible"),
    [
        # -59 dBm at 1 m: -33 dBm at 0.05 m and 10 dB more; -119 at 1 km.
        (-60.0, True),
        (-23.1, True),
        (-22.8, False),
        (-118.9, True),
        (-119.1, False),
        (100.0, False),
        (-400.0, False),
        (math.nan, False),
        (math.inf, False),
    ],
)
def test_strengths_that_no_beacon_has_are_told(rssi, possible):
    assert is_possible_strength(rssi, RssiModel()) is possible
