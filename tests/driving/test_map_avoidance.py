"""Driving by a map, with a disc that rolls as it is told, in plain numpy."""

import math

import numpy as np
import pytest

from drake_mobarm.driving.map_avoidance import update
from drake_mobarm.driving.map_avoidance_state import (
    MapAvoidanceParameters,
    initial_state,
)
from drake_mobarm.driving.waypoint import ControllerParameters, drive_to
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.sensors.lidar import cast_rays
from drake_mobarm.world.obstacles import clearance, outlines_to_segments
from helpers.refusals import assert_refused
from helpers.shapes import rectangle

PARAMETERS = MapAvoidanceParameters()
CONTROLLER = ControllerParameters()
RANGE_MAX = 12.0
PERIOD = 0.1
FREE = np.full(360, RANGE_MAX)


class Drive:
    """A disc that rolls as the law tells it, and stands where it is stopped.

    Args:
        boxes: what the lidar sees.
        unseen: what it does not see.
    """

    def __init__(self, boxes, start, target, unseen=(), **parameters):
        self.sides = outlines_to_segments(list(boxes))
        self.solid = [*boxes, *unseen]
        self.pose = np.array(start, dtype=float)
        self.target = np.array(target, dtype=float)
        self.parameters = MapAvoidanceParameters(**parameters)
        self.state = initial_state()
        self.path = [self.pose[:2].copy()]
        self.time = 0.0
        self.touches = 0
        self.rng = np.random.default_rng(0)

    def step(self):
        ranges = cast_rays(*self.sides, self.pose, 360)
        ranges += self.rng.normal(0, 0.01, 360)
        self.state = update(
            self.state,
            self.pose,
            self.target,
            np.clip(ranges, 0, RANGE_MAX),
            RANGE_MAX,
            PERIOD,
            self.parameters,
        )
        limit = self.state.speed_limit
        v, w = limit, 0.0
        if limit >= 0:
            v, w = drive_to(
                self.pose,
                self.state.waypoint,
                (min(limit, 1.0), 2.0),
                CONTROLLER,
            )
        moved = self.pose + PERIOD * np.array(
            [v * math.cos(self.pose[2]), v * math.sin(self.pose[2]), w]
        )
        if clearance(self.solid, moved[:2]) < RADIUS:
            self.touches += 1
            moved[:2] = self.pose[:2]
        self.pose = moved
        self.path.append(moved[:2].copy())
        self.time += PERIOD

    def run(self, seconds):
        """Whether it is 0.3 m from the target within a time."""
        while self.time < seconds and self.state.shut is None:
            self.step()
            if math.dist(self.pose[:2], self.target) < 0.3:
                return True
        return False

    @property
    def length(self):
        return np.hypot(*np.diff(self.path, axis=0).T).sum()


def room(x_low, y_low, x_high, y_high):
    """Four walls, 0.2 m thick."""
    return [
        rectangle(x_low - 0.2, y_low - 0.2, x_high + 0.2, y_low),
        rectangle(x_low - 0.2, y_high, x_high + 0.2, y_high + 0.2),
        rectangle(x_low - 0.2, y_low, x_low, y_high),
        rectangle(x_high, y_low, x_high + 0.2, y_high),
    ]


def test_in_the_open_it_goes_straight_at_full_speed():
    drive = Drive([], (0, 0, 0), (6, 0))
    assert drive.run(9.0)
    assert drive.length < 6.1


def test_it_leaves_a_dead_end_that_is_open_behind_it():
    trap = [
        rectangle(3.0, -2.0, 3.2, 2.0),
        rectangle(-3.0, 2.0, 3.2, 2.2),
        rectangle(-3.0, -2.2, 3.2, -2.0),
    ]
    drive = Drive(trap, (1, 0, 0), (6, 0))
    assert drive.run(60)
    assert drive.touches == 0
    # Out at x = -3 and back: 4 + 2.5 + 9 + 2.5, and clearances.
    assert drive.length < 24


def test_it_finds_the_way_through_a_maze_without_a_touch():
    # Walls from side to side with doors at alternating ends.
    walls = [
        rectangle(-4.0, y, 3.0, y + 0.2)
        if number % 2
        else rectangle(-3.0, y, 4.0, y + 0.2)
        for number, y in enumerate((-3.0, -1.0, 1.0, 3.0))
    ]
    drive = Drive([*room(-4, -5, 4, 5), *walls], (0, -4, math.pi / 2), (0, 4))
    assert drive.run(120)
    assert drive.touches == 0
    # Five corridors: 3.5 m, three of 7 m, and 3.5 m; five steps of 2 m.
    assert drive.length < 1.35 * 38


def test_a_door_that_leaves_nine_centimetres_beside_it_is_passed():
    width = 2 * RADIUS + 0.18
    walls = [
        rectangle(2, -4, 2.2, -width / 2),
        rectangle(2, width / 2, 2.2, 4),
    ]
    drive = Drive([*room(-3, -4, 7, 4), *walls], (0, 1, 0), (5, -1))
    assert drive.run(40)
    assert drive.touches == 0


def test_what_it_does_not_see_is_touched_a_few_times_and_passed():
    # A board above the lidar's plane, 2 m long, right in the way.
    board = rectangle(2.0, -1.0, 2.6, 1.0)
    drive = Drive([], (0, 0.2, 0), (5, 0.2), unseen=[board])
    assert drive.run(60)
    # Each touch lasts half a second or less.
    assert drive.touches < 8 * 5
    assert len(drive.state.map.touched) >= 3


def test_a_target_behind_walls_is_given_up_with_what_shuts_it():
    shut = room(3, -1, 5, 1)
    drive = Drive([*room(-3, -4, 9, 4), *shut], (0, 0, 0), (4, 0))
    assert not drive.run(200)
    assert drive.state.activity in {"drive", "give up"}
    # The nearest wall of the closed room is hit on the line to the target.
    x, y = drive.state.shut
    assert 2.7 <= x <= 5.3
    assert -1.3 <= y <= 1.3
    drive.step()
    assert drive.state.activity == "give up"
    assert drive.state.speed_limit == 0


def test_a_way_that_opens_is_found():
    gate = rectangle(2, -1.2, 2.2, 1.2)
    walls = [rectangle(2, -4, 2.2, -1.2), rectangle(2, 1.2, 2.2, 4)]
    drive = Drive([*room(-3, -4, 7, 4), *walls, gate], (0, 0, 0), (5, 0))
    assert not drive.run(4.0)
    drive.sides = outlines_to_segments([*room(-3, -4, 7, 4), *walls])
    drive.solid = [*room(-3, -4, 7, 4), *walls]
    assert drive.run(40)


@pytest.mark.parametrize("rate", [0.05, 0.1, 0.2])
def test_seconds_are_counted_whatever_the_lidars_rate(rate):
    # A robot that is told to drive and stands: a touch after 0.5 s.
    state, time = initial_state(), 0.0
    while state.activity != "back":
        state = update(
            state, (0, 0, 0), (4, 0), FREE, RANGE_MAX, rate, PARAMETERS
        )
        time += rate
        assert time < 2
    assert time == pytest.approx(0.5, abs=2 * rate + 1e-9)


@pytest.mark.parametrize(
    ("pose", "target"),
    [
        ((math.nan, 0, 0), (4, 0)),
        ((0, 0, math.inf), (4, 0)),
        ((1e300, 0, 0), (4, 0)),
        ((0, 0, 0), (math.nan, 0)),
    ],
)
def test_what_makes_no_sense_halts_and_changes_no_map(pose, target):
    drive = Drive([rectangle(2, -1, 2.2, 1)], (0, 0, 0), (4, 0))
    for _ in range(5):
        drive.step()
    before = drive.state
    after = update(before, pose, target, FREE, RANGE_MAX, PERIOD, PARAMETERS)
    assert after.speed_limit == 0
    assert np.isfinite(after.waypoint).all()
    assert after.map is before.map
    assert after.target is before.target
    assert drive.run(30)


@pytest.mark.parametrize(("missing", "waits"), [(180, False), (181, True)])
def test_a_scan_of_which_less_than_half_is_there_is_not_trusted(missing, waits):
    ranges = FREE.copy()
    ranges[:missing] = math.nan
    state = update(
        initial_state(),
        (0, 0, 0),
        (4, 0),
        ranges,
        RANGE_MAX,
        PERIOD,
        PARAMETERS,
    )
    assert (state.activity == "wait") == waits


def test_an_update_changes_no_state():
    drive = Drive([rectangle(2, -1, 2.2, 1)], (0, 0, 0), (4, 0))
    drive.step()
    before, hits = drive.state, drive.state.map.hits.copy()
    drive.step()
    np.testing.assert_array_equal(before.map.hits, hits)
    assert drive.state is not before


def test_the_estimate_is_followed_in_a_second():
    state = update(
        initial_state(), (0, 0, 0), (4, 0), FREE, RANGE_MAX, PERIOD, PARAMETERS
    )
    state = update(
        state, (0, 0, 0), (5, -2), FREE, RANGE_MAX, PERIOD, PARAMETERS
    )
    np.testing.assert_allclose(state.target, [4.1, -0.2])


def test_the_estimate_is_as_good_as_from_the_nearest_place_until_it_moves():
    state, nearest = initial_state(), []
    # 4 m away, 1 m, 4 m again; then a tenth of 2 m across, in a period.
    for x, target in ((0, (4, 0)), (3, (4, 0)), (0, (4, 0)), (0, (4, 2))):
        state = update(
            state, (x, 0, 0), target, FREE, RANGE_MAX, PERIOD, PARAMETERS
        )
        nearest.append(state.closest)
    assert nearest == pytest.approx([4.0, 1.0, 1.0, 1.2])


@pytest.mark.parametrize(
    ("name", "value"),
    [("margin", 0.0), ("forgetting", 0), ("patience", math.nan)],
)
def test_a_parameter_out_of_range_is_named(name, value):
    assert_refused(name, MapAvoidanceParameters, **{name: value})
