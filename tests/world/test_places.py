"""Places in a room of four walls, and in the open, by hand."""

from pathlib import Path

import pytest

from drake_mobarm.exceptions import ScenarioError
from drake_mobarm.world.places import Place, check_places
from drake_mobarm.world.world import World
from helpers.shapes import box


def wall(x_low, y_low, x_high, y_high):
    return box([x_low, y_low, 0], [x_high, y_high, 1])


def world_of(name, *obstacles):
    return World(name, Path(f"{name}.sdf"), obstacles, ())


def room(half, opening=0.0):
    """Four walls of 0.2 m, inside at +-half; a way out in the east one."""
    far = half + 0.2
    return world_of(
        "room",
        wall(-far, half, far, far),
        wall(-far, -far, far, -half),
        wall(-far, -half, -half, half),
        wall(half, opening / 2, far, half),
        wall(half, -half, far, -opening / 2),
    )


def check(world, *value, robot=False):
    check_places(world, [Place("beacon", list(value), robot)])


ROOM = room(2.0)


@pytest.mark.parametrize("robot", [True, False])
def test_a_place_in_the_middle_of_a_room_is_fine(robot):
    assert check(ROOM, 0.0, 0.0, robot=robot) is None


def test_a_point_may_be_nearer_to_a_wall_than_the_robot():
    # The robot's radius is 0.27 m; the wall's face is at 2 m.
    check(ROOM, 1.72, 0.0, robot=True)
    check(ROOM, 1.99, 0.0)
    with pytest.raises(ScenarioError, match=r"0\.260 m are free .* 0\.27 m"):
        check(ROOM, 1.74, 0.0, robot=True)
    with pytest.raises(ScenarioError):
        check(ROOM, 1.731, 0.0, robot=True)


def test_a_place_inside_an_obstacle_is_refused_with_its_name_and_the_worlds():
    with pytest.raises(ScenarioError) as caught:
        check(ROOM, 2.1, 0.0)
    assert str(caught.value) == (
        "beacon [2.1, 0.0] is inside an obstacle of room"
    )


def test_a_place_outside_the_walls_is_refused_with_its_name_and_the_worlds():
    with pytest.raises(ScenarioError) as caught:
        check(ROOM, 5.0, 0.0)
    assert str(caught.value) == (
        "beacon [5.0, 0.0] is outside the walls of room"
    )


def test_a_place_beyond_the_floor_plan_is_outside_the_walls():
    with pytest.raises(ScenarioError, match="outside the walls"):
        check(ROOM, 100.0, -300.0)


def test_nothing_is_outside_where_nothing_is_closed_off():
    check(room(2.0, opening=0.5), 5.0, 0.0, robot=True)
    check(world_of("empty"), 5.0, 0.0, robot=True)


@pytest.mark.parametrize(("half", "closed"), [(0.9, False), (1.1, True)])
def test_walls_have_to_close_off_4_square_metres(half, closed):
    # 1.8 m by 1.8 m are 3.2 m^2, 2.2 m by 2.2 m are 4.8 m^2.
    world = room(half)
    if closed:
        with pytest.raises(ScenarioError, match="outside the walls"):
            check(world, 4.0, 0.0)
    else:
        assert check(world, 4.0, 0.0) is None


def test_only_what_the_robot_can_meet_counts():
    # It is less than 0.75 m high.
    lamp = world_of("lit", box([-1, -1, 2.0], [1, 1, 2.2]))
    assert check(lamp, 0.0, 0.0, robot=True) is None


def test_a_places_further_numbers_are_not_looked_at():
    check(ROOM, 0.0, 0.0, 9.0, robot=True)
    with pytest.raises(ScenarioError, match=r"start \[5\.0, 0\.0\] is outside"):
        check_places(ROOM, [Place("start", [5.0, 0.0, 0.3], robot=True)])


def test_the_first_place_that_makes_no_sense_is_named():
    places = [
        Place("start", [0.0, 0.0, 0.0], robot=True),
        Place("target", [2.1, 0.0]),
        Place("beacon", [5.0, 0.0]),
    ]
    with pytest.raises(ScenarioError, match=r"^target"):
        check_places(ROOM, places)
    check_places(ROOM, places[:1])
