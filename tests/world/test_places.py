from pathlib import Path

import numpy as np
import pytest

from drake_mobarm.exceptions import ScenarioError
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.world.obstacles import Obstacle, box_corners
from drake_mobarm.world.places import Place, check_places
from drake_mobarm.world.world import World


def box(x_low, x_high, y_low, y_high, z_low=0.0, z_high=2.0):
    low, high = np.array([[x_low, y_low, z_low], [x_high, y_high, z_high]])
    return Obstacle("box", (low + high) / 2 + box_corners(high - low))


def world(*obstacles):
    return World("hut", Path("hut.sdf"), obstacles, ())


def walls(half, opening=0.0):
    """A square room of 2 `half` a side, a way out in its east wall."""
    out = half + 0.2
    return [
        box(-out, out, half, out),
        box(-out, out, -out, -half),
        box(-out, -half, -half, half),
        box(half, out, opening / 2, half),
        box(half, out, -half, -opening / 2),
    ]


def refusal(world, *places):
    try:
        check_places(world, places)
    except ScenarioError as error:
        return str(error)
    return None


@pytest.mark.parametrize("gap", [-0.01, 0.01])
def test_robot_needs_its_radius_of_free_floor(gap):
    # The box begins at x = 2.
    start = Place("start", [2.0 - RADIUS - gap, 0.0, 1.0], robot=True)
    said = refusal(world(box(2, 3, -5, 5)), start)
    assert (said is None) is (gap > 0)


def test_refusal_says_how_much_is_free_and_how_much_the_robot_needs():
    start = Place("start", [1.75, 0.0, 1.0], robot=True)
    assert refusal(world(box(2, 3, -5, 5)), start) == (
        "start [1.75, 0.0, 1.0] is inside an obstacle of hut: "
        "0.25 m are free around it, the robot needs 0.27 m"
    )


def test_a_point_needs_no_more_than_not_to_be_inside():
    block = world(box(2, 3, -5, 5))
    assert refusal(block, Place("beacon", [1.99, 0.0, 1.0])) is None
    assert refusal(block, Place("beacon", [2.01, 0.0, 1.0])) == (
        "beacon [2.01, 0.0, 1.0] is inside an obstacle of hut"
    )


@pytest.mark.parametrize(
    ("z_low", "z_high"), [(0.7, 2.0), (0.0, 0.005)], ids=["above", "below"]
)
def test_what_the_robot_passes_under_or_over_is_no_obstacle(z_low, z_high):
    shelf = world(box(-1, 1, -1, 1, z_low, z_high))
    assert refusal(shelf, Place("start", [0.0, 0.0], robot=True)) is None


def test_every_place_is_checked():
    block = world(box(2, 3, -5, 5))
    good, bad = Place("a", [0.0, 0.0]), Place("b", [2.5, 0.0])
    assert refusal(block, good, bad).startswith("b [2.5, 0.0]")


def test_where_walls_enclose_a_room_a_place_outside_is_refused():
    hut = world(*walls(2.0))
    assert refusal(hut, Place("start", [1.0, -1.0], robot=True)) is None
    assert refusal(
        hut, Place("a", [1.0, -1.0]), Place("start", [3.5, 0.0, 1.0], True)
    ) == ("start [3.5, 0.0] is outside the walls of hut")


def test_walls_with_a_way_out_enclose_nothing():
    assert refusal(world(*walls(2.0, 0.8)), Place("start", [3.5, 0.0])) is None


@pytest.mark.parametrize(("half", "is_room"), [(0.9, False), (1.1, True)])
def test_less_than_four_square_metres_are_no_room(half, is_room):
    # 3.24 and 4.84 square metres.
    said = refusal(world(*walls(half)), Place("start", [3.5, 0.0]))
    assert (said is not None) is is_room
