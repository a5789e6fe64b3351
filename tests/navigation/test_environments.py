"""The ten floor plans, by shapely; their clearance and grids, by hand."""

import itertools

import numpy as np
import pytest
import shapely

from drake_mobarm.navigation.environments import ENVIRONMENTS, Environment
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.world.floor_plan import adaptive_grid_size

BOX = Environment(
    name="a box in a room",
    size=(4.0, 3.0),
    obstacles=((1.0, 1.0, 2.0, 2.0),),
    starts=((0.5, 0.5),) * 4,
    targets=((3.5, 2.5),) * 3,
)


def free_space(environment, radius):
    """Where a disc's centre may be, by shapely's polygons."""
    width, depth = environment.size
    boxes = [shapely.box(*rectangle) for rectangle in environment.obstacles]
    # Chords of the round corners lie up to 1e-5 of the radius inside.
    grown = shapely.union_all(boxes).buffer(radius, quad_segs=256)
    floor = shapely.box(radius, radius, width - radius, depth - radius)
    return floor.difference(grown)


def by_name(environments=ENVIRONMENTS):
    return pytest.mark.parametrize(
        "environment", environments, ids=lambda environment: environment.name
    )


def test_there_are_ten_each_with_a_name_of_its_own():
    assert len({environment.name for environment in ENVIRONMENTS}) == 10


@by_name()
def test_all_pairs_are_free_and_connected_for_the_robot(environment):
    free = free_space(environment, RADIUS)
    parts = shapely.get_parts(free)
    places = shapely.points([*environment.starts, *environment.targets])
    inside = [part for part in parts if part.contains(places[0])]
    assert len(inside) == 1
    assert shapely.contains(inside[0], places).all()


@by_name()
def test_no_pair_is_met_twice_or_solved_before_it_begins(environment):
    pairs = set(itertools.product(environment.starts, environment.targets))
    assert len(pairs) == 12
    assert min(np.hypot(*np.subtract(*pair)) for pair in pairs) > 0.5


@by_name()
def test_obstacles_stand_on_the_floor(environment):
    floor = shapely.box(0, 0, *environment.size)
    boxes = shapely.box(*np.transpose(environment.obstacles))
    assert shapely.covers(floor, boxes).all()
    assert (shapely.area(boxes) > 0).all()


@pytest.mark.parametrize("factor", [0.4, 0.6, 0.8, 1.0])
@by_name()
def test_all_pairs_are_connected_on_grids_of_the_adaptive_size(
    environment, factor
):
    cell = factor * adaptive_grid_size(environment.grid(0.05, RADIUS))
    grid = environment.grid(cell, RADIUS)
    # Neighbours by a side only, as polygons that share an edge.
    squares = shapely.box(
        *np.moveaxis(grid.centres()[~grid.occupied] - cell / 2, -1, 0),
        *np.moveaxis(grid.centres()[~grid.occupied] + cell / 2, -1, 0),
    )
    area = shapely.union_all(squares, grid_size=1e-6)
    places = shapely.points([*environment.starts, *environment.targets])
    parts = shapely.get_parts(area)
    assert max(shapely.covers(part, places).sum() for part in parts) == 7


@by_name()
def test_clearance_is_the_distance_to_boxes_and_walls(environment):
    rng = np.random.default_rng(0)
    points = rng.uniform(0, environment.size, (300, 2))
    solid = shapely.union_all(
        [shapely.box(*rectangle) for rectangle in environment.obstacles]
    )
    walls = shapely.box(0, 0, *environment.size).exterior
    expected = shapely.distance(
        shapely.union_all([solid, walls]), shapely.points(points)
    )
    assert environment.clearance(points) == pytest.approx(expected, abs=1e-12)


def test_clearance_by_hand():
    points = [[0.5, 1.5], [0.7, 0.6], [1.5, 1.5], [3.9, 1.5], [-0.2, 1.0]]
    # By the box's side, its corner (3-4-5), inside it, by a wall, outside.
    assert BOX.clearance(points) == pytest.approx([0.5, 0.5, 0, 0.1, -0.2])


def test_clearance_of_a_bare_floor_is_that_of_its_walls():
    bare = Environment(
        name="bare",
        size=(4.0, 3.0),
        obstacles=(),
        starts=BOX.starts,
        targets=BOX.targets,
    )
    assert bare.clearance([[2.0, 1.5], [0.3, 2.0]]) == pytest.approx([1.5, 0.3])


def test_squares_are_occupied_where_a_disc_touches_something():
    grid = BOX.grid(0.5, 0.3)
    # Centres at -0.25, 0.25, 0.75, ...: those by a wall or the box are at
    # 0.25 from it, or at 0.25 from it along both axes, 0.354 from its corner.
    drawn = [
        "##########",
        "##########",
        "##.##...##",
        "######..##",
        "######..##",
        "##.##...##",
        "##########",
        "##########",
    ]
    expected = [[mark == "#" for mark in row] for row in drawn]
    assert (grid.occupied == expected).all()
    assert grid.origin == pytest.approx([-0.25, -0.25])
    assert grid.cell == 0.5


def test_walls_have_squares_however_large_the_squares_are():
    occupied = BOX.grid(1.0, 0.1).occupied
    assert occupied.shape == (5, 6)
    assert occupied[[0, -1]].all()
    assert occupied[:, [0, -1]].all()
    assert not occupied[1, 1]
