"""Occupancy and its regions, of boxes by hand and of the shipped worlds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.world.obstacles import inside, outlines
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.rooms import ROOMS
from drake_mobarm.world.sdf import load_world
from helpers.shapes import rectangle, turned

RADIUS = 0.28


def room(opening=0.0):
    """4 m by 4 m within walls of 0.2 m, a way out in its east wall."""
    half = opening / 2
    return [
        rectangle(-2.2, 2.0, 2.2, 2.2),
        rectangle(-2.2, -2.2, 2.2, -2.0),
        rectangle(-2.2, -2.0, -2.0, 2.0),
        rectangle(2.0, half, 2.2, 2.0),
        rectangle(2.0, -2.0, 2.2, -half),
    ]


def region_at(grid, radius, point):
    return grid.regions(radius)[grid.index(point)]


def world_grid(name):
    world = load_world(name)
    return OccupancyGrid.from_outlines(outlines(world.obstacles, *HEIGHTS))


def test_cells_deep_inside_are_occupied_and_cells_well_outside_are_free():
    grid = OccupancyGrid.from_outlines([rectangle(0, 0, 2, 1)], 0.1)
    centres = grid.centres()
    deep = np.all((centres >= 0) & (centres <= (2, 1)), axis=-1)
    near = np.all((centres > -0.1) & (centres < (2.1, 1.1)), axis=-1)
    assert grid.occupied[deep].all()
    assert not grid.occupied[~near].any()
    assert deep.sum() >= 20 * 10


def test_free_metre_is_left_around_the_outlines():
    grid = OccupancyGrid.from_outlines([rectangle(3, -1, 5, 4)], 0.05)
    centres = grid.centres()
    np.testing.assert_allclose(centres[0, 0], [2, -2])
    assert np.all(centres[-1, -1] >= (6 - 1e-9, 5 - 1e-9))


def test_grid_is_as_large_as_the_outlines_and_a_metre_around_them():
    # From (2, -2) to (6, 5) in cells of a quarter metre, both ends included.
    grid = OccupancyGrid.from_outlines([rectangle(3, -1, 5, 4)], 0.25)
    assert grid.occupied.shape == (29, 17)


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("y", [-3.0, 0.0, 3.0])
def test_thin_wall_leaves_no_hole_wherever_it_stands(y, angle):
    # A room of 6 m by 6 m; at y = -3 and 3 a wall of it runs over the origin.
    low, high, thin = y - 3, y + 3, 0.01
    walls = [
        rectangle(-3, high, 3, high + thin),
        rectangle(-3, low - thin, 3, low),
        rectangle(-3 - thin, low - thin, -3, high + thin),
        rectangle(3, low - thin, 3 + thin, high + thin),
    ]
    grid = OccupancyGrid.from_outlines(
        [turned(wall, angle) for wall in walls], 0.05
    )
    assert region_at(grid, 0.0, turned(np.array([0, y]), angle)) == 2


@given(st.floats(0.0, 1.5))
def test_cells_that_a_side_runs_through_are_occupied(angle):
    square = turned(rectangle(-0.5, -0.5, 0.5, 0.5), angle)
    grid = OccupancyGrid.from_outlines([square], 0.1)
    following = np.roll(square, -1, axis=0)
    for share in (0.0, 0.25, 0.5, 0.75):
        points = (1 - share) * square + share * following
        # A point halfway between two cells may belong to either.
        inward, outward = points * (1 - 1e-9), points * (1 + 1e-9)
        assert np.all(
            grid.occupied[grid.index(inward)]
            | grid.occupied[grid.index(outward)]
        )


@given(st.floats(0.0, 3.2), st.floats(0.001, 0.02))
def test_wall_thinner_than_a_cell_leaves_no_hole(angle, thickness):
    # Seen in the cells: a disc of no radius cannot slip through.
    ring = [
        turned(wall, angle)
        for wall in (
            rectangle(-1, 1, 1, 1 + thickness),
            rectangle(-1, -1 - thickness, 1, -1),
            rectangle(-1 - thickness, -1 - thickness, -1, 1 + thickness),
            rectangle(1, -1 - thickness, 1 + thickness, 1 + thickness),
        )
    ]
    grid = OccupancyGrid.from_outlines(ring, 0.05)
    assert region_at(grid, 0.0, (0, 0)) >= 2


@settings(max_examples=30)
@given(st.floats(0, 3.2), st.floats(0.1, 2), st.floats(0.1, 2))
def test_clearance_is_true_to_a_cell(angle, width, depth):
    cell = 0.05
    polygon = turned(rectangle(0, 0, width, depth), angle)
    grid = OccupancyGrid.from_outlines([polygon], cell)
    rng = np.random.default_rng(0)
    ny, nx = grid.occupied.shape
    rows, columns = rng.integers(ny, size=40), rng.integers(nx, size=40)
    share = np.linspace(0, 1, 401)[:, None]
    sides = np.vstack(
        [
            a * (1 - share) + b * share
            for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True)
        ]
    )
    for row, column in zip(rows, columns, strict=True):
        centre = grid.centres()[row, column]
        true = np.linalg.norm(sides - centre, axis=1).min()
        if inside(polygon, centre):
            true = 0.0
        assert abs(grid.clearance()[row, column] - true) <= cell


def test_empty_floor_has_endless_clearance_and_one_region():
    grid = OccupancyGrid.from_outlines([])
    assert not grid.occupied.any()
    assert np.all(np.isinf(grid.clearance()))
    assert np.all(grid.regions(RADIUS) == 1)


def test_cells_are_found_by_their_centres():
    grid = OccupancyGrid.from_outlines([rectangle(0, 0, 2, 1)], 0.1)
    rows, columns = grid.index(grid.centres())
    ny, nx = grid.occupied.shape
    np.testing.assert_array_equal(rows, np.mgrid[:ny, :nx][0])
    np.testing.assert_array_equal(columns, np.mgrid[:ny, :nx][1])


def test_point_belongs_to_the_cell_whose_centre_is_nearest():
    grid = OccupancyGrid.from_outlines([rectangle(0, 0, 2, 1)], 0.1)
    # The grid begins at (-1, -1).
    row, column = grid.index([0.26, -0.84])
    assert (row, column) == (2, 13)


def test_point_beyond_the_grid_is_clipped_to_its_edge():
    grid = OccupancyGrid.from_outlines([rectangle(0, 0, 2, 1)], 0.1)
    ny, nx = grid.occupied.shape
    assert grid.index([-50.0, 50.0]) == (ny - 1, 0)
    assert grid.index([50.0, -50.0]) == (0, nx - 1)


def test_closed_room_is_numbered_apart_from_outside():
    grid = OccupancyGrid.from_outlines(room())
    assert region_at(grid, RADIUS, (0, 0)) == 2
    assert region_at(grid, RADIUS, (-3.1, 0)) == 1
    assert grid.regions(RADIUS).max() == 2


def test_two_closed_rooms_are_numbered_apart():
    grid = OccupancyGrid.from_outlines([*room(), rectangle(-0.1, -2, 0.1, 2)])
    west, east = region_at(grid, RADIUS, [(-1, 0), (1, 0)])
    assert {west, east} == {2, 3}


@pytest.mark.parametrize(("opening", "region"), [(0.50, 2), (0.70, 1)])
def test_opening_narrower_than_the_disc_closes_it(opening, region):
    # The disc is 0.56 m wide.
    grid = OccupancyGrid.from_outlines(room(opening))
    assert region_at(grid, RADIUS, (0, 0)) == region


def test_where_the_disc_cannot_stand_is_numbered_zero():
    grid = OccupancyGrid.from_outlines(room())
    on_wall, near_wall = region_at(grid, RADIUS, [(2.1, 0), (1.8, 0)])
    assert on_wall == near_wall == 0
    assert region_at(grid, RADIUS, (1.6, 0)) == 2


def test_disc_that_fits_nowhere_inside_leaves_no_region_there():
    grid = OccupancyGrid.from_outlines(room())
    regions = grid.regions(2.1)
    inner = np.all(np.abs(grid.centres()) < 2, axis=-1)
    assert not regions[inner].any()


def test_edge_of_the_grid_is_outside_however_large_the_disc():
    regions = OccupancyGrid.from_outlines(room()).regions(5.0)
    edge = np.ones(regions.shape, dtype=bool)
    edge[1:-1, 1:-1] = False
    np.testing.assert_array_equal(regions, edge)


@pytest.mark.parametrize("turn", range(4))
def test_regions_do_not_depend_on_which_way_the_room_faces(turn):
    walls = [turned(wall, turn * math.pi / 2) for wall in room(0.7)]
    grid = OccupancyGrid.from_outlines(walls)
    assert region_at(grid, RADIUS, (0, 0)) == 1


# The shipped worlds


def test_small_house_is_closed():
    grid = world_grid("small_house")
    assert region_at(grid, RADIUS, (-3.0, 0.0)) >= 2
    assert region_at(grid, RADIUS, (0.0, 6.5)) == 1


def test_small_houses_rooms_are_connected():
    grid = world_grid("small_house")
    regions, centres = grid.regions(RADIUS), grid.centres()
    numbers = np.unique(regions[regions >= 2], return_counts=True)
    main = numbers[0][np.argmax(numbers[1])]
    for x_min, x_max, y_min, y_max in ROOMS.values():
        within = np.all(
            (centres > (x_min, y_min)) & (centres < (x_max, y_max)), axis=-1
        )
        standing = regions[within & (regions != 0)]
        # What is cut off, between furniture, is less than a tenth.
        assert np.mean(standing == main) > 0.9
        assert np.sum(standing == main) * grid.cell**2 > 10.0


def test_cafes_kitchen_is_reached_from_the_dining_area():
    grid = world_grid("cafe")
    dining, kitchen = region_at(grid, RADIUS, [(0, 0), (-1, 9.5)])
    assert dining == kitchen
    assert dining >= 2


def test_bookstore_is_closed():
    assert region_at(world_grid("bookstore"), RADIUS, (-2.5, 4.5)) >= 2
