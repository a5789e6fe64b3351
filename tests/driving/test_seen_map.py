"""What a map keeps of scans: worked by hand, cell by cell."""

import math

import numpy as np
import pytest

from drake_mobarm.driving.seen_map import CELL, SeenMap
from drake_mobarm.sensors.lidar import cast_rays
from drake_mobarm.world.obstacles import outlines_to_segments
from helpers.shapes import rectangle

RANGE_MAX = 12.0
FREE = np.full(360, RANGE_MAX)
HERE = np.array([0.0, 0.0])


def scan(boxes, pose=(0.0, 0.0, 0.0)):
    sides = outlines_to_segments(boxes)
    return np.minimum(cast_rays(*sides, pose, 360), RANGE_MAX)


def with_scan(seen, ranges, pose=(0.0, 0.0, 0.0)):
    return seen.with_scan(np.array(pose[:2]), pose[2], ranges, RANGE_MAX)


def one_range(distance, ray=180):
    ranges = FREE.copy()
    ranges[ray] = distance
    return ranges


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5])
def test_a_return_is_a_point_in_its_cell(yaw):
    pose = (3.0, -40.0, yaw)
    (point,) = with_scan(SeenMap(), one_range(2.0), pose).points()
    met = np.array([3 + 2 * math.cos(yaw), -40 + 2 * math.sin(yaw)])
    assert np.abs(point - met).max() <= CELL / 2 + 1e-9


@pytest.mark.parametrize("distance", [RANGE_MAX, RANGE_MAX - 0.04, 0.2, 0.0])
def test_no_return_and_the_robot_itself_are_no_points(distance):
    assert len(with_scan(SeenMap(), one_range(distance)).points()) == 0


def test_a_missing_range_is_no_point_and_looks_through_nothing():
    wall = [rectangle(2.0, -1.0, 2.1, 1.0)]
    seen = with_scan(SeenMap(), scan(wall))
    before = seen.points()
    for _ in range(50):
        seen = with_scan(seen, np.full(360, math.nan))
    np.testing.assert_array_equal(seen.points(), before)


def test_the_map_grows_and_keeps_what_it_has():
    seen = with_scan(SeenMap(), one_range(2.0))
    seen = with_scan(seen, one_range(2.0), (60.0, 0.0, 0.0))
    seen = with_scan(seen, one_range(2.0), (-60.0, -30.0, 0.0))
    points = {tuple(np.round(p, 6)) for p in seen.points()}
    assert points == {(2.0, 0.0), (62.0, 0.0), (-58.0, -30.0)}


def test_a_thing_that_is_gone_is_forgotten_when_it_is_looked_through():
    box = [rectangle(1.5, -0.2, 1.7, 0.2)]
    wall = [rectangle(4.0, -3.0, 4.1, 3.0)]
    seen = SeenMap()
    for _ in range(20):
        seen = with_scan(seen, scan(box + wall))
    for _ in range(20):
        seen = with_scan(seen, scan(wall))
    assert np.all(seen.points()[:, 0] > 3.9)


def test_what_hides_behind_another_thing_stays():
    box = [rectangle(1.5, -0.5, 1.7, 0.5)]
    hidden = [rectangle(2.4, -0.1, 2.6, 0.1)]
    seen = SeenMap()
    for _ in range(5):
        seen = with_scan(seen, scan(hidden))
    kept = seen.points()
    for _ in range(50):
        seen = with_scan(seen, scan(box))
    points = {tuple(p) for p in np.round(seen.points(), 6)}
    assert {tuple(p) for p in np.round(kept, 6)} <= points


def test_a_thin_leg_stays_however_often_it_is_seen():
    # A leg of 3 cm before a wall, 2 m away, seen by one ray or two.
    room = [rectangle(2.0, 0.0, 2.03, 0.03), rectangle(5, -4, 5.1, 4)]
    rng = np.random.default_rng(0)
    seen = SeenMap()
    for _ in range(200):
        ranges = scan(room) + rng.normal(0, 0.01, 360)
        seen = with_scan(seen, np.minimum(ranges, RANGE_MAX))
        points = seen.points()
        assert np.any(points[:, 0] < 2.1)


def test_far_cells_are_not_looked_through_between_two_rays():
    # Beyond 360 / 2 pi cells, 2.86 m, rays are farther apart than cells.
    seen = with_scan(SeenMap(), one_range(4.0))
    for _ in range(50):
        seen = with_scan(seen, FREE)
    assert len(seen.points()) == 1


@pytest.mark.parametrize(("behind", "stays"), [(0.1, True), (0.2, False)])
def test_a_ray_looks_through_what_it_passes_by_15_centimetres(behind, stays):
    seen = with_scan(SeenMap(), one_range(2.0))
    farther = FREE.copy()
    farther[179:182] = 2.0 + behind
    for _ in range(20):
        seen = with_scan(seen, farther)
    points = {tuple(p) for p in np.round(seen.points(), 6)}
    assert ((2.0, 0.0) in points) == stays


@pytest.mark.parametrize("beside", [179, 181])
def test_one_ray_alone_looks_through_nothing(beside):
    seen = with_scan(SeenMap(), one_range(2.0))
    for _ in range(20):
        seen = with_scan(seen, one_range(1.0, ray=beside))
    points = {tuple(p) for p in np.round(seen.points(), 6)}
    assert (2.0, 0.0) in points


def test_touched_points_are_kept_whatever_is_seen():
    seen = SeenMap().with_touch(np.array([[0.33, 0.0]]))
    for _ in range(50):
        seen = with_scan(seen, FREE)
    np.testing.assert_array_equal(seen.points(), [[0.33, 0.0]])


def test_a_map_is_not_changed_by_a_scan():
    seen = with_scan(SeenMap(), one_range(2.0))
    before = seen.hits.copy()
    with_scan(seen, one_range(1.0))
    np.testing.assert_array_equal(seen.hits, before)


def test_a_jump_of_the_pose_begins_a_new_map():
    seen = with_scan(SeenMap(), one_range(2.0)).with_touch(
        np.array([[0.3, 0.0]])
    )
    seen = with_scan(seen, one_range(2.0), (9e4, -9e4, 0.0))
    np.testing.assert_allclose(seen.points(), [[9e4 + 2, -9e4], [0.3, 0.0]])
    assert seen.hits.size < 1e6


def test_what_is_seen_beyond_fifty_metres_is_not_mapped():
    seen = SeenMap().with_scan(HERE, 0.0, np.full(360, 60.0), 1e6)
    assert len(seen.points()) == 0
