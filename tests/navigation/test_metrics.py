"""A run's figures and its verdict from traces made by hand."""

import itertools
import math

import numpy as np
import pytest
import shapely
from scipy.sparse import lil_array
from scipy.sparse.csgraph import dijkstra

from drake_mobarm.navigation.metrics import (
    FreeFloor,
    judge,
    navigation_metrics,
)
from drake_mobarm.robot.shape import RADIUS
from helpers.rolling import room
from helpers.shapes import rectangle

FAR = rectangle(50, 50, 51, 51)
OPEN = FreeFloor.from_outlines([FAR])


def trace(times, path, **columns):
    """Columns are others than x and y of the ground truth, by name."""
    path = np.asarray(path, dtype=float)
    truth = np.zeros((len(path), 7))
    truth[:, :2] = path
    names = ["x", "y", "yaw", "v", "w", "touching", "contacts"]
    measured = columns.pop("measured", None)
    estimates = columns.pop("estimates", [(0.0, 0.0, 1.0)] * len(path))
    for name, values in columns.items():
        truth[:, names.index(name)] = values
    if measured is None:
        measured = truth[:, :3]
    return {
        "t": np.asarray(times, dtype=float),
        "ground_truth": truth,
        "measured_base_pose": np.asarray(measured, dtype=float),
        "estimated_target": np.asarray(estimates, dtype=float),
    }


def metrics_of(run, target=(0.0, 0.0), footprint=(FAR,), floor=OPEN):
    return navigation_metrics(run, target, list(footprint), floor)


# Metrics


def test_metrics_of_a_right_angled_way_are_those_of_the_text():
    # 3 m along x, 4 m along y, in 10 s; the target is 1 m on.
    run = trace([0, 4, 10], [(51, 41), (54, 41), (54, 45)], contacts=[0, 2, 3])
    found = metrics_of(run, (54.0, 46.0))
    assert found == pytest.approx(
        found
        | {
            "time_to_target_s": 10.0,
            "final_position_error_m": 1.0,
            "net_velocity_m_per_s": 0.5,
            "path_efficiency": 5 / 7,
            "distance_travelled_m": 7.0,
            "contacts": 3.0,
            "time_in_contact_s": 0.0,
            # From (54, 45) to the corner (51, 50).
            "smallest_clearance_m": math.hypot(3, 5) - 0.27,
            "pose_error_m": 0.0,
            "yaw_error_rad": 0.0,
        }
    )
    assert set(found) == {
        "time_to_target_s",
        "final_position_error_m",
        "net_velocity_m_per_s",
        "path_efficiency",
        "distance_travelled_m",
        "length_over_shortest",
        "contacts",
        "time_in_contact_s",
        "smallest_clearance_m",
        "jerk_rms_m_per_s3",
        "pose_error_m",
        "yaw_error_rad",
    }


def test_a_robot_that_never_left_has_an_efficiency_of_one():
    found = metrics_of(trace([0, 3], [(50, 49.2)] * 2), (50.0, 48.7))
    assert found["path_efficiency"] == 1
    assert found["length_over_shortest"] == 1
    assert found["net_velocity_m_per_s"] == 0
    assert found["distance_travelled_m"] == 0
    assert found["final_position_error_m"] == 0.5


def test_a_way_back_to_the_start_has_no_efficiency():
    path = [(50, 49.2), (52, 49.2), (50, 49.2)]
    found = metrics_of(trace([0, 1, 2], path))
    assert found["path_efficiency"] == 0
    assert found["net_velocity_m_per_s"] == 0
    assert found["distance_travelled_m"] == 4


def test_time_in_contact_is_that_of_the_periods_that_end_touching():
    # Touching at 1 s and at 1.5 s: from 0 s to 1.5 s; and at 4 s, from 3 s on.
    run = trace([0, 1, 1.5, 3, 4], [(49, 49)] * 5, touching=[1, 1, 1, 0, 1])
    assert metrics_of(run)["time_in_contact_s"] == pytest.approx(2.5)


def test_the_smallest_clearance_is_from_the_robots_rim_on_its_whole_way():
    path = [(0, 0), (2, 0), (4, 3)]
    box = rectangle(2.5, -0.5, 3.5, 0.5)
    found = metrics_of(trace([0, 1, 2], path), footprint=[box, FAR])
    assert found["smallest_clearance_m"] == pytest.approx(0.5 - RADIUS)


def test_the_jerk_is_the_second_derivative_of_the_speed():
    # v = 2 t^2: 4 m/s^3 throughout, but for the four samples at the ends,
    # where differences are one-sided: np.gradient halves what is left there.
    times = np.arange(0, 200.05, 0.1)
    speed = 2 * times**2
    run = trace(times, np.zeros((len(times), 2)), v=speed)
    assert metrics_of(run)["jerk_rms_m_per_s3"] == pytest.approx(4, rel=2e-3)


def test_a_constant_acceleration_has_no_jerk():
    times = np.arange(0, 3, 0.1)
    run = trace(times, np.zeros((30, 2)), v=0.7 * times - 1)
    assert metrics_of(run)["jerk_rms_m_per_s3"] == pytest.approx(0, abs=1e-9)


def test_two_samples_have_no_jerk():
    run = trace([0, 1], [(0, 0)] * 2, v=[0, 5])
    assert metrics_of(run)["jerk_rms_m_per_s3"] == 0


def test_the_pose_error_is_that_at_the_end_and_the_yaws_is_wrapped():
    # Measured 3.1 rad, in truth -3.1 rad: 2 pi - 6.2 apart.
    run = trace(
        [0, 1],
        [(0, 0), (1, 1)],
        yaw=[0, -3.1],
        measured=[(9, 9, 0), (1.3, 0.6, 3.1)],
    )
    found = metrics_of(run)
    assert found["pose_error_m"] == pytest.approx(0.5)
    assert found["yaw_error_rad"] == pytest.approx(2 * math.pi - 6.2)


# The shortest way


def tangent_way(start, corner, end):
    """The shortest way of the disc round one corner, by hand.

    Two tangents to the circle of its radius about the corner, and an arc on
    the side where the angle between them is the larger one.
    """
    ways = [np.subtract(place, corner) for place in (start, end)]
    far = [math.hypot(*way) for way in ways]
    cosine = ways[0] @ ways[1] / (far[0] * far[1])
    arc = (
        2 * math.pi
        - math.acos(cosine)
        - sum(math.acos(RADIUS / d) for d in far)
    )
    return sum(math.sqrt(d**2 - RADIUS**2) for d in far) + RADIUS * arc


# An L of two corridors, 1.5 m wide; its inner corner is (3.5, 1.5).
L_CORRIDOR = [
    *room(0, 0, 5, 6),
    rectangle(0, 1.5, 3.5, 6),
]


@pytest.mark.parametrize(
    ("start", "end"), [((0.5, 0.5), (4.5, 5.5)), ((0.4, 1.1), (4.0, 5.0))]
)
def test_the_shortest_way_through_an_l_shaped_corridor_is_that_by_hand(
    start, end
):
    floor = FreeFloor.from_outlines(L_CORRIDOR)
    expected = tangent_way(start, (3.5, 1.5), end)
    # Squares of 5 cm: half a diagonal is 3.5 cm.
    assert floor.shortest_way(start, end) == pytest.approx(expected, abs=0.08)
    assert expected > math.dist(start, end) + 0.3


def taut_way(outlines, start, end):
    """The shortest way of the disc among outlines, by a visibility graph."""
    grown = shapely.union_all(
        [shapely.Polygon(o).buffer(RADIUS, quad_segs=12) for o in outlines]
    )
    corners = shapely.get_coordinates(grown)
    places = np.vstack([[start, end], corners])
    solid = grown.buffer(-1e-6)
    lengths = lil_array((len(places), len(places)))
    for i, j in itertools.combinations(range(len(places)), 2):
        line = shapely.LineString(places[[i, j]])
        if line.length > 0 and not solid.intersects(line):
            lengths[i, j] = line.length
    return dijkstra(lengths.tocsr(), directed=False, indices=0)[1]


def test_the_shortest_way_among_boxes_is_that_of_a_visibility_graph():
    boxes = [
        rectangle(1.0, -2.0, 1.4, 0.8),
        rectangle(2.2, 0.2, 2.6, 3.0),
        rectangle(3.2, -1.5, 4.4, -0.2),
    ]
    floor = FreeFloor.from_outlines(boxes)
    start = (0.0, 0.0)
    for end in ((3.2, 2.5), (1.8, -1.5), (2.9, -0.8)):
        expected = taut_way(boxes, start, end)
        found = floor.shortest_way(start, end)
        # Squares of 5 cm make each of two or three corners as much larger.
        assert found == pytest.approx(expected, abs=0.12)
        assert expected > 0.3 + math.dist(start, end)


def test_in_sight_the_shortest_way_is_straight():
    # Ends are squares' centres, up to half a diagonal off: 3.5 cm each.
    found = OPEN.shortest_way((50.0, 49.3), (51.9, 49.7))
    assert found == pytest.approx(math.hypot(1.9, 0.4), abs=0.071)


def test_within_a_square_the_shortest_way_is_the_distance():
    found = OPEN.shortest_way((49.0, 49.0), (49.01, 49.0))
    assert found == pytest.approx(0.01)


def test_into_a_closed_room_there_is_no_way():
    floor = FreeFloor.from_outlines(room(0, 0, 3, 3))
    assert floor.shortest_way((1, 1), (4, 1)) == math.inf
    assert floor.shortest_way((1, 1), (2, 1)) == pytest.approx(1.0, abs=0.071)


def test_a_door_narrower_than_the_robot_is_no_way():
    walls = [
        rectangle(1, 0, 1.2, 1.25),
        rectangle(1, 1.75, 1.2, 3),
    ]
    floor = FreeFloor.from_outlines([*room(0, 0, 3, 3), *walls])
    assert floor.shortest_way((0.5, 1.5), (2, 1.5)) == math.inf
    small = FreeFloor.from_outlines([*room(0, 0, 3, 3), *walls], radius=0.1)
    assert small.shortest_way((0.5, 1.5), (2, 1.5)) == pytest.approx(
        1.5, abs=0.08
    )


def test_a_place_beside_a_thing_counts_as_the_nearest_free_square():
    floor = FreeFloor.from_outlines(room(0, 0, 3, 3))
    # 0.1 m from the wall: as from 0.27 m, and a square.
    found = floor.shortest_way((0.1, 1.5), (2.5, 1.5))
    assert found == pytest.approx(2.5 - 0.27, abs=0.08)


def test_the_length_is_compared_with_the_shortest_way_to_where_it_ended():
    floor = FreeFloor.from_outlines(L_CORRIDOR)
    start, end = (0.5, 0.5), (4.5, 5.5)
    run = trace([0, 5, 9], [start, (4.5, 0.5), end])
    found = metrics_of(run, (4.5, 5.9), L_CORRIDOR, floor)
    shortest = tangent_way(start, (3.5, 1.5), end)
    assert found["length_over_shortest"] == pytest.approx(
        9 / shortest, rel=0.02
    )


def test_no_way_counts_as_shorter_than_the_shortest():
    # The straight way is as short as it gets, give or take the squares.
    path = [(49.01, 49.01), (51.27, 49.27)]
    found = metrics_of(trace([0, 2], path))
    assert 1.0 <= found["length_over_shortest"] < 1.04


def test_where_the_squares_show_no_way_the_straight_line_is_compared_with():
    floor = FreeFloor.from_outlines(room(0, 0, 3, 3))
    path = [(1.0, 1.0), (1.0, 4.0), (5.0, 4.0)]
    assert floor.shortest_way(path[0], path[-1]) == math.inf
    found = metrics_of(trace([0, 3, 7], path), floor=floor)
    assert found["length_over_shortest"] == pytest.approx(7 / 5)


# Verdicts


def verdict(
    path, *, arrived=False, shut=None, error=0.2, limit=60.0, **columns
):
    """Of a run that ends at its limit, a sample a second."""
    run = trace(np.arange(len(path)), path, **columns)
    return judge(
        {"final_position_error_m": error},
        run,
        [0.0, 0.0],
        arrived,
        limit,
        shut,
    )


DRIVING = [(0.1 * n, 2.0) for n in range(60)]
STANDING = [(min(0.5 * n, 5.0), 2.0) for n in range(60)]
OFF = [(1.2, 1.6, 1.0)] * 60


@pytest.mark.parametrize(
    ("error", "success", "reason"),
    [
        (0.2, True, "arrived at the target"),
        (0.999, True, "arrived at the target"),
        (1.0, False, "stopped 1.00 m from the target"),
        (2.5, False, "stopped 2.50 m from the target"),
    ],
)
def test_success_is_to_end_by_oneself_less_than_a_metre_away(
    error, success, reason
):
    found = verdict(DRIVING, arrived=True, error=error)
    assert found == (success, reason)


def test_near_the_target_is_no_success_unless_it_ends_there_by_itself():
    success, reason = verdict(DRIVING, error=0.1)
    assert not success
    assert reason == "time limit of 60 s reached at [5.90, 2.00]"


def test_an_error_that_is_not_a_number_is_no_success():
    assert not verdict(DRIVING, arrived=True, error=math.nan)[0]


def test_what_shuts_the_way_of_a_robot_that_gave_up_is_named():
    found = verdict(DRIVING, shut="door at [1.00, 2.00]", error=3.0)
    assert found == (
        False,
        "gave up: the way is shut by door at [1.00, 2.00]",
    )


def test_a_robot_that_has_not_moved_a_metre_in_fifteen_seconds_is_trapped():
    success, reason = verdict(STANDING)
    assert not success
    assert reason == "trapped at [5.00, 2.00]"


@pytest.mark.parametrize(("radius", "trapped"), [(0.45, True), (0.55, False)])
def test_driving_round_in_a_square_of_a_metre_is_a_trap(radius, trapped):
    angles = np.arange(60) * math.pi / 4
    path = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    _, reason = verdict(path)
    assert reason.startswith("trapped") is trapped


def test_a_trap_takes_longer_than_fifteen_seconds():
    _, reason = verdict([(1.0, 2.0)] * 10, limit=10.0)
    assert reason == "time limit of 10 s reached at [1.00, 2.00]"


@pytest.mark.parametrize(("touching", "held"), [(9, True), (6, False)])
def test_a_trapped_robot_that_mostly_touches_something_is_held_by_it(
    touching, held
):
    # Of the last fifteen samples.
    last = np.zeros(60)
    last[60 - touching :] = 1.0
    _, reason = verdict(STANDING, touching=last)
    what = "held by contact" if held else "trapped"
    assert reason == f"{what} at [5.00, 2.00]"


@pytest.mark.parametrize(
    ("others", "reason"),
    [
        ({"arrived": True, "error": 1.5}, "stopped 1.50 m from the target"),
        ({"shut": "door"}, "gave up: the way is shut by door"),
        ({}, "time limit of 60 s reached at [5.90, 2.00]"),
    ],
)
def test_an_estimate_more_than_a_metre_off_is_told(others, reason):
    success, told = verdict(DRIVING, estimates=OFF, **others)
    assert not success
    assert told == f"{reason}, the target's estimate 2.00 m off"


def test_a_target_that_was_never_known_is_told():
    unknown = [(math.nan, math.nan, 0.0)] * 60
    _, reason = verdict(STANDING, estimates=unknown)
    assert reason == "trapped at [5.00, 2.00], the target was never known"


def test_an_estimate_that_is_off_does_not_undo_a_success():
    found = verdict(DRIVING, arrived=True, error=0.9, estimates=OFF)
    assert found == (True, "arrived at the target")
