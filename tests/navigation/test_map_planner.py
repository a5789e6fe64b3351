"""Our planner in small worlds, by floor plans right and wrong and without."""

import math

import numpy as np
import pytest

from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.sensors.lidar import LidarParameters
from helpers.planning import FREE, HOUSE, U, planner
from helpers.rolling import Rolling, room
from helpers.shapes import rectangle

# Open behind the robot, where two boards lead inwards.
BUG_TRAP = [
    *room(-6, -5, 8, 5),
    rectangle(3.0, -2.0, 3.2, 2.0),
    rectangle(-2.0, 2.0, 3.2, 2.2),
    rectangle(-2.0, -2.2, 3.2, -2.0),
    rectangle(-2.0, 0.45, -1.8, 2.2),
    rectangle(-2.0, -2.2, -1.8, -0.45),
    rectangle(-1.8, 0.45, 0.5, 0.6),
    rectangle(-1.8, -0.6, 0.5, -0.45),
]
# Two and a half turns of a corridor 1.2 m wide.
SPIRAL = [
    *room(-7, -7, 7, 7),
    rectangle(-4.0, -4.0, 4.0, -3.9),
    rectangle(3.9, -4.0, 4.0, 4.0),
    rectangle(-4.0, 3.9, 4.0, 4.0),
    rectangle(-4.0, -2.6, -3.9, 4.0),
    rectangle(-4.0, -2.7, 2.6, -2.6),
    rectangle(2.5, -2.7, 2.6, 2.6),
    rectangle(-2.6, 2.5, 2.6, 2.6),
    rectangle(-2.6, -1.2, -2.5, 2.6),
    rectangle(-2.6, -1.3, 1.2, -1.2),
    rectangle(1.1, -1.3, 1.2, 1.2),
    rectangle(-1.2, 1.1, 1.2, 1.2),
]
HALF = RADIUS + 0.02
NARROW = [
    *HOUSE,
    rectangle(1.0, -4.0, 3.0, -HALF),
    rectangle(1.0, HALF, 3.0, 4.0),
]


@pytest.mark.parametrize(
    ("start", "target"),
    [((0, 0, 0), (4, 1)), ((1, 2, 2.0), (1, -3)), ((0, 0, 0), (-5, 0))],
)
def test_in_the_open_it_goes_straight_to_the_target(start, target):
    drive = Rolling(planner(), [], start, target)
    assert drive.run(10)
    assert drive.distance < 0.3
    assert drive.length < math.dist(start[:2], target)


@pytest.mark.parametrize("knows", [False, True], ids=["seen", "planned"])
@pytest.mark.parametrize(
    ("world", "start", "target", "longest"),
    [
        # 1.9 m to a corner of the U's mouth, 2.2 m along it, 2.3 m on; and
        # what it drives in before it sees the U's end.
        ([*HOUSE, *U], (-1.0, 0.1, 0.0), (4.0, 0.0), 9.0),
        # Out at the back, 3 m and more, then 9 m along the trap and 3 m
        # inwards.
        (BUG_TRAP, (1.5, 1.0, 0.0), (6.0, 0.0), 20.0),
        # Sides of 1.9, 3.7, 5.2, 5.2, 6.6, 6.6, 8.5, 6.4 m and the end.
        (SPIRAL, (0.0, 0.0, 0.0), (-6.0, -6.0), 50.0),
        (NARROW, (0.0, 1.0, 0.0), (5.0, -1.0), 6.5),
    ],
    ids=["U", "bug trap", "spiral", "corridor"],
)
def test_what_traps_others_is_passed_without_a_touch(
    world, start, target, longest, knows
):
    drive = Rolling(planner(world if knows else None), world, start, target)
    assert drive.run(90)
    assert drive.distance < 0.3
    assert drive.touches == 0
    assert drive.length < longest


@pytest.mark.parametrize("knows", [False, True], ids=["seen", "planned"])
def test_a_target_that_moves_is_caught(knows):
    # At 0.2 m/s behind the U.
    world = [*HOUSE, *U]
    drive = Rolling(
        planner(world if knows else None),
        world,
        (-1.0, 0.0, 0.0),
        lambda time: (4.5, -2.0 + 0.2 * time),
    )
    assert drive.run(20)
    # It moves on by 0.02 m after the scan.
    assert drive.distance < 0.3 + 0.02
    assert drive.touches == 0


@pytest.mark.parametrize("knows", [False, True], ids=["seen", "planned"])
def test_a_target_that_jumps_is_followed(knows):
    drive = Rolling(
        planner(HOUSE if knows else None),
        HOUSE,
        (0.0, 0.0, 0.0),
        lambda time: (5.0, 0.0) if time < 4 else (-2.0, -3.0),
    )
    assert drive.run(20)
    assert math.dist(drive.pose[:2], (-2, -3)) < 0.3


def test_an_estimate_that_has_just_jumped_near_is_no_arrival():
    law = planner()
    state = law.update(
        law.initial_state(), np.zeros(3), np.array([3.0, 0.0]), FREE
    )
    near, scans = np.array([0.2, 0.0]), 0
    while not state.arrived and scans < 50:
        state = law.update(state, np.zeros(3), near, FREE)
        scans += 1
    # It is followed within a second: 2.8 m are 0.15 m after 2.8 of them.
    assert 25 <= scans <= 32


# Backwards and near


@pytest.mark.parametrize("knows", [False, True], ids=["seen", "planned"])
def test_to_a_target_behind_it_drives_backwards(knows):
    drive = Rolling(
        planner(HOUSE if knows else None), HOUSE, (0, 0, 0), (-2.5, 0)
    )
    assert drive.run(10)
    speeds, turns = np.array(drive.velocities).T
    assert speeds.min() < -0.8
    assert speeds.max() <= 0.0
    # It does not turn round.
    assert np.abs(turns).max() < 0.3
    assert abs(drive.pose[2]) < 0.1


def test_where_it_may_not_reverse_it_turns_round():
    drive = Rolling(planner(may_reverse=False), HOUSE, (0, 0, 0), (-2.5, 0.1))
    assert drive.run(10)
    assert np.array(drive.velocities)[:, 0].min() >= 0
    assert abs(drive.pose[2]) > 3.0


def test_with_an_odd_number_of_rays_it_does_not_reverse():
    # Half a turn would lie between two rays.
    lidar = LidarParameters(rays=361)
    law = planner(lidar=lidar)
    state = law.initial_state()
    for _ in range(3):
        state = law.update(
            state, np.zeros(3), np.array([-2.5, 0.1]), np.full(361, 12.0)
        )
    speed, turn = law.command(state, np.zeros(3))
    assert speed == 0.0
    assert abs(turn) > 1.0


def test_backwards_it_sees_what_is_behind_it():
    # Between the robot and the target behind it stands a box.
    box = rectangle(-1.6, -0.4, -1.2, 0.4)
    drive = Rolling(planner(), [*HOUSE, box], (0, 0, 0), (-2.5, 0))
    assert drive.run(15)
    assert drive.touches == 0
    assert np.array(drive.velocities)[:, 0].min() < -0.3


@pytest.mark.parametrize("angle", np.radians([0, 60, 90, 120, 180, -90]))
@pytest.mark.parametrize("distance", [0.32, 0.4, 0.49])
def test_a_target_nearer_than_half_a_metre_is_reached_without_circling(
    distance, angle
):
    target = distance * np.array([math.cos(angle), math.sin(angle)])
    drive = Rolling(planner(), HOUSE, (0, 0, 0), target)
    assert drive.run(4)
    assert drive.distance < 0.3
    assert drive.length < distance
    # A quarter turn and a little at most: driving backwards saves the rest.
    assert np.ptp(np.array(drive.path)[:, 2]) < math.pi / 2 + 0.3


@pytest.mark.parametrize("target", [(0, 0), (0.1, 0), (-0.05, 0.2)])
def test_a_robot_that_starts_at_its_target_stays_there(target):
    drive = Rolling(planner(), HOUSE, (0, 0, 0), target)
    drive.step()
    assert drive.state.arrived
    assert drive.velocities == [(0.0, 0.0)]


def test_having_arrived_it_stands():
    drive = Rolling(planner(), HOUSE, (0, 0, 0), (2, 0))
    assert drive.run(10)
    law, state = drive.law, drive.state
    for pose in (drive.pose, np.array([0.0, 3.0, 1.0])):
        assert law.command(state, pose) == (0.0, 0.0)


# What it does with what it cannot use


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize(
    ("pose", "target", "missing"),
    [
        ((0, 0, 0), (3, 0), 360),
        ((0, 0, 0), (3, 0), 181),
        ((math.nan, 0, 0), (3, 0), 0),
        ((0, 0, math.inf), (3, 0), 0),
        ((2e6, 0, 0), (3, 0), 0),
        ((0, 0, 0), (math.nan, 0), 0),
        ((0, 0, 0), (3, -math.inf), 0),
    ],
)
def test_the_robot_stands_without_a_usable_pose_target_and_scan(
    pose, target, missing, backwards
):
    law, state = planner(), planner().initial_state()
    place = np.array([-3.0 if backwards else 3.0, 0.0])
    for _ in range(3):
        state = law.update(state, np.zeros(3), place, FREE)
    speed, _ = law.command(state, np.zeros(3))
    assert speed == pytest.approx(-1.0 if backwards else 1.0)
    ranges = FREE.copy()
    ranges[:missing] = math.nan
    pose, target = np.array(pose, float), np.array(target, float)
    state = law.update(state, pose, target, ranges)
    assert law.command(state, pose) == (0.0, 0.0)
    assert not state.arrived
    # And goes on with the next scan that can be used.
    state = law.update(state, np.zeros(3), place, FREE)
    assert law.command(state, np.zeros(3))[0] == pytest.approx(speed)


def test_a_pose_that_makes_no_sense_between_scans_makes_it_stand():
    law = planner()
    state = law.update(
        law.initial_state(), np.zeros(3), np.array([3.0, 0.0]), FREE
    )
    for pose in ((math.nan, 0, 0), (0, math.inf, 0), (0, 0, -2e6)):
        assert law.command(state, np.array(pose)) == (0.0, 0.0)


def test_an_update_changes_no_state():
    drive = Rolling(planner(), [*HOUSE, *U], (-1, 0, 0), (4, 0))
    drive.step()
    before = drive.state
    hits = before.memory.avoidance.map.hits.copy()
    drive.step()
    np.testing.assert_array_equal(before.memory.avoidance.map.hits, hits)
    assert before.memory.avoidance.pose == (-1.0, 0.0, 0.0)


def test_the_way_is_told_from_the_robot_to_the_target():
    law = planner(HOUSE)
    state = law.update(
        law.initial_state(), np.zeros(3), np.array([4.0, 2.0]), FREE
    )
    (way,) = state.paths
    # Within a step of the lattice of 0.1 m.
    assert math.dist(way[0], (0, 0)) < 0.08
    assert math.dist(way[-1], (4, 2)) < 0.08
    np.testing.assert_array_equal(state.forces.total, [0, 0])
