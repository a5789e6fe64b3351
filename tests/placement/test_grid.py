"""Grids counted by hand, and against squares tried one by one."""

import math

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.grid import grid_at, optimise_grid, plain_grid
from helpers.refusals import assert_refused
from helpers.shapes import rectangle


def hall(width, height, *holes, turned=0.0):
    """A hall from (0, 0) less rectangles (x_low, y_low, x_high, y_high)."""
    boxes = [shapely.box(*hole) for hole in holes]
    polygon = shapely.box(0, 0, width, height).difference(
        shapely.union_all(boxes)
    )
    return FreeSpace(
        shapely.affinity.rotate(polygon, turned, (0, 0), use_radians=True)
    )


def squares(grid):
    return shapely.polygons(grid.corners())


def lattice_in(polygon, size, low, high):
    """Squares of a lattice from `low` that a polygon covers, one by one."""
    x = np.arange(low[0], high[0], size)
    y = np.arange(low[1], high[1], size)
    x, y = (values.ravel() for values in np.meshgrid(x, y))
    candidates = shapely.box(x, y, x + size, y + size)
    covered = shapely.covers(polygon, candidates)
    return np.column_stack([x, y])[covered] + size / 2


@st.composite
def furnished(draw):
    """A hall of 3 m by 2 m with boxes on a raster of 5 cm."""
    boxes = []
    for _ in range(draw(st.integers(0, 6))):
        x, y = draw(st.integers(0, 55)), draw(st.integers(0, 35))
        w, h = draw(st.integers(1, 20)), draw(st.integers(1, 20))
        x, y, w, h = 0.05 * np.array([x, y, w, h])
        boxes.append(rectangle(x, y, x + w, y + h))
    try:
        return FreeSpace.from_outlines(
            boxes, 0.0, [0.025, 0.025], [[0, 0], [3, 2]]
        )
    except ParameterError:
        assume(False)


# Counted by hand


def test_empty_hall_of_whole_squares_is_covered_wholly():
    free = hall(3.0, 2.0)
    for grid in (
        plain_grid(free, 0.5),
        grid_at(free, 0.5, 0, 0),
        optimise_grid(free, 0.5, generations=2),
    ):
        assert len(grid.centres) == 24
        assert grid.coverage == pytest.approx(1.0)
        assert grid.free_area == pytest.approx(6.0)


def test_plain_grid_starts_at_the_left_and_the_lower_side():
    # In 1.1 m by 0.7 m there is room for 2 by 1 squares of 0.5 m.
    grid = plain_grid(hall(1.1, 0.7), 0.5)
    np.testing.assert_allclose(grid.centres, [[0.25, 0.25], [0.75, 0.25]])
    np.testing.assert_array_equal(grid.columns, [0, 1])
    assert (grid.orientation, grid.offset) == (0, 0)
    assert grid.coverage == pytest.approx(0.5 / 0.77)


@pytest.mark.parametrize(("offset", "left"), [(0.5, 0.25), (1, 0.5)])
def test_offset_moves_the_first_column_in_sizes(offset, left):
    grid = grid_at(hall(3.0, 2.0), 0.5, 0, offset)
    # From 0.25 m or 0.5 m on, five whole columns of four are left of 3 m.
    assert len(grid.centres) == 20
    np.testing.assert_allclose(
        np.unique(grid.centres[:, 0].round(9)),
        left + 0.25 + 0.5 * np.arange(5),
    )


def test_columns_along_x_are_as_many_as_the_hall_is_high():
    grid = grid_at(hall(3.0, 2.0), 0.5, math.pi / 2, 0)
    np.testing.assert_array_equal(np.bincount(grid.columns), [6, 6, 6, 6])


def test_turned_hall_is_covered_by_columns_turned_as_far():
    # In 4.1 m by 3.1 m there is room for 16 by 12 squares of 0.25 m.
    free = hall(4.1, 3.1, turned=math.radians(30))
    grid = grid_at(free, 0.25, math.radians(30), 0)
    assert len(grid.centres) == 16 * 12
    assert len(grid_at(free, 0.25, math.radians(60), 0).centres) < 180


def test_turned_hall_is_covered_by_the_search_and_not_by_the_plain_grid():
    free = hall(4.1, 3.1, turned=math.radians(30))
    best, plain = optimise_grid(free, 0.25), plain_grid(free, 0.25)
    assert best.coverage >= 0.99 * 192 * 0.25**2 / (4.1 * 3.1)
    assert plain.coverage < 0.82
    turned = math.degrees(best.orientation) % 90
    assert 28 < turned < 32


def test_search_looks_as_far_as_a_quarter_turn():
    free = hall(4.1, 3.1, turned=math.radians(75))
    best = optimise_grid(free, 0.25)
    assert best.coverage >= 0.99 * 192 * 0.25**2 / (4.1 * 3.1)
    assert 73 < math.degrees(best.orientation) < 77


def test_height_of_a_column_trades_one_stretch_against_two():
    # Two slabs leave column 0 three free stretches; a passage beside them, too
    # narrow for a column, joins these. By the height of the column's squares of
    # 1 m, modulo 1 m, one fits in [0, 1.5] from 0 to 0.5, in [1.7, 2.8] from
    # 0.7 to 0.8, and in [3.65, 4.8] from 0.65 to 0.8. So at 0.7 the upper two
    # have one each, and at no height do all three.
    free = hall(1.5, 4.8, (0, 1.5, 1, 1.7), (0, 2.8, 1, 3.65))
    grid = grid_at(free, 1.0, 0, 0)
    np.testing.assert_allclose(grid.centres, [[0.5, 2.2], [0.5, 4.2]])
    np.testing.assert_allclose(plain_grid(free, 1.0).centres, [[0.5, 0.5]])


def test_each_column_has_a_height_of_its_own():
    # Column 0 is free from 0.3 m to 1.3 m, column 1 from 0 to 1 m.
    free = hall(2, 1.3, (0, 0, 1, 0.3), (1, 1, 2, 1.3))
    np.testing.assert_allclose(
        grid_at(free, 1.0, 0, 0).centres, [[0.5, 0.8], [1.5, 0.5]]
    )


def test_search_finds_the_offset_past_a_step_at_the_left():
    # The step leaves 2.1 m of full height: two squares of 1 m, of which a
    # grid from the left side of the map finds one.
    free = hall(2.4, 1.0, (0, 0, 0.3, 0.9))
    assert len(plain_grid(free, 1.0).centres) == 1
    grid = optimise_grid(free, 1.0)
    assert len(grid.centres) == 2
    assert grid.coverage == pytest.approx(2 / (2.4 - 0.27))


@pytest.mark.parametrize(
    ("inner", "count"),
    [
        ((1, 1, 2, 2), 8),
        ((1, 1, 2 + 1e-6, 2), 7),
        ((1, 1 - 1e-6, 2, 2), 7),
        ((1 - 1e-6, 1 - 1e-6, 2, 2), 5),
        ((1 - 1e-12, 1 - 1e-12, 2 + 1e-12, 2 + 1e-12), 8),
    ],
)
def test_square_may_touch_an_obstacle_and_not_overlap_it(inner, count):
    # The middle of nine squares is taken; overlaps take its neighbours.
    assert len(plain_grid(hall(3, 3, inner), 1.0).centres) == count


@pytest.mark.parametrize("corner", [(0, 0), (0.99, 0), (0.99, 0.99), (0, 0.99)])
def test_square_with_a_centimetre_of_obstacle_in_a_corner_is_not_free(corner):
    x, y = 1 + np.array(corner)
    # In the middle one of nine, in reach of no other's centre.
    free = hall(3, 3, (x, y, x + 0.01, y + 0.01))
    grid = plain_grid(free, 1.0)
    assert len(grid.centres) == 8
    assert not (np.abs(grid.centres - 1.5) < 0.1).all(axis=1).any()


def test_obstacle_wholly_within_a_square_takes_it():
    grid = plain_grid(hall(3, 3, (1.2, 1.6, 1.21, 1.61)), 1.0)
    assert len(grid.centres) == 8


def test_pocket_closed_off_from_the_start_has_no_squares():
    wall = np.array([(1.9, 0.0), (2.1, 0.0), (2.1, 2.0), (1.9, 2.0)])
    bounds = [[0, 0], [4, 2]]
    left = FreeSpace.from_outlines([wall], 0.0, [0.5, 0.5], bounds)
    # 1.9 m of 0.5 m are three columns, of four squares each.
    grid = plain_grid(left, 0.5)
    assert len(grid.centres) == 12
    assert grid.centres[:, 0].max() < 1.9
    right = FreeSpace.from_outlines([wall], 0.0, [3.5, 0.5], bounds)
    assert plain_grid(right, 0.5).centres[:, 0].min() == pytest.approx(2.35)


@pytest.mark.parametrize("size", [2.5, 100.0])
def test_squares_larger_than_the_hall_make_an_empty_grid(size):
    free = hall(3.0, 2.0, (1, 1, 1.1, 1.1))
    for grid in (
        plain_grid(free, size),
        grid_at(free, size, 0.3, 0.7),
        optimise_grid(free, size, generations=2),
    ):
        assert grid.coverage == 0
        assert grid.centres.shape == (0, 2)
        assert grid.columns.shape == (0,)
        assert grid.corners().shape == (0, 4, 2)


def test_corners_run_counter_clockwise_around_their_centre():
    free = hall(4.1, 3.1, turned=math.radians(30))
    grid = grid_at(free, 0.25, math.radians(30), 0.5)
    corners = grid.corners()
    np.testing.assert_allclose(corners.mean(axis=1), grid.centres)
    side = np.roll(corners, -1, axis=1) - corners
    np.testing.assert_allclose(np.linalg.norm(side, axis=-1), 0.25)
    bearing = [math.cos(math.radians(30)), math.sin(math.radians(30))]
    np.testing.assert_allclose(
        side[:, 0], np.tile(0.25 * np.array(bearing), (len(side), 1))
    )
    np.testing.assert_allclose(shapely.area(squares(grid)), 0.25**2)
    assert shapely.is_ccw(shapely.get_exterior_ring(squares(grid))).all()


# By another method


@settings(max_examples=30, deadline=None)
@given(furnished(), st.integers(3, 16))
def test_plain_grid_is_every_lattice_square_that_the_free_space_covers(
    free, steps
):
    # All on a raster of 5 cm: overlaps are nothing, or far above rounding.
    size = 0.05 * steps
    low, high = np.reshape(free.polygon.bounds, (2, 2))
    expected = lattice_in(free.polygon.buffer(1e-7), size, low, high)
    grid = plain_grid(free, size)
    found = {tuple(centre) for centre in grid.centres.round(6) + 0.0}
    assert len(found) == len(grid.centres)
    assert found == {tuple(centre) for centre in expected.round(6) + 0.0}


@settings(max_examples=30, deadline=None)
@given(
    furnished(),
    st.floats(0.15, 0.9),
    st.floats(0, math.pi / 2),
    st.floats(0, 1),
)
def test_squares_are_within_the_free_space_and_apart(
    free, size, orientation, offset
):
    grid = grid_at(free, size, orientation, offset)
    room = free.polygon.buffer(1e-8)
    assert shapely.covers(room, squares(grid)).all()
    # On a raster: without one it may lose a square that touches others.
    together = shapely.union_all(squares(grid), grid_size=1e-9).area
    assert together == pytest.approx(len(grid.centres) * size**2, abs=1e-6)
    assert grid.coverage * free.area == pytest.approx(together, abs=1e-6)


@settings(max_examples=30, deadline=None)
@given(
    furnished(),
    st.floats(0.2, 0.9),
    st.floats(0, math.pi / 2),
    st.floats(0, 1),
)
def test_no_height_of_a_column_fits_more_squares(
    free, size, orientation, offset
):
    grid = grid_at(free, size, orientation, offset)
    turned = shapely.affinity.rotate(
        free.polygon, -orientation, (0, 0), use_radians=True
    )
    x_low, y_low, x_high, y_high = turned.bounds
    left = x_low + offset * size
    for column in range(math.floor((x_high - left) / size)):
        count = np.sum(grid.columns == column)
        for height in y_low + size * np.linspace(0, 1, 37):
            y = np.arange(height - size, y_high, size)
            x = left + column * size
            stack = shapely.box(x, y, x + size, y + size)
            # Less a hair: what overlaps by rounding is no square lost.
            stack = stack[shapely.covers(turned, stack)]
            assert len(stack) <= count


@settings(max_examples=15, deadline=None)
@given(furnished(), st.floats(0.2, 0.9), st.integers(0, 100))
def test_search_is_never_worse_than_the_plain_grid(free, size, seed):
    best = optimise_grid(free, size, seed, population=3, generations=2)
    assert best.coverage >= grid_at(free, size, 0, 0).coverage
    assert best.coverage >= plain_grid(free, size).coverage


@settings(max_examples=15, deadline=None)
@given(furnished(), st.floats(0.2, 0.9))
def test_result_of_the_search_is_the_grid_at_what_it_tells(free, size):
    best = optimise_grid(free, size, population=3, generations=2)
    again = grid_at(free, size, best.orientation, best.offset)
    np.testing.assert_array_equal(best.centres, again.centres)


def test_same_seed_finds_the_same_grid():
    free = hall(3.03, 2.07, (0.5, 0.7, 0.9, 1.1), turned=0.2)
    grids = [optimise_grid(free, 0.3, seed=5, generations=5) for _ in "ab"]
    np.testing.assert_array_equal(grids[0].centres, grids[1].centres)
    other = optimise_grid(free, 0.3, seed=6, generations=5)
    assert other.orientation != grids[0].orientation


# Bad input


@pytest.mark.parametrize("size", [0, -0.1, math.nan, math.inf])
@pytest.mark.parametrize("lay", [plain_grid, optimise_grid])
def test_size_that_is_no_length_is_refused(lay, size):
    assert_refused("size", lay, hall(1, 1), size)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("size", (math.nan, 0, 0)),
        ("orientation", (0.5, -0.1, 0)),
        ("orientation", (0.5, 1.6, 0)),
        ("orientation", (0.5, math.nan, 0)),
        ("offset", (0.5, 0, 1.1)),
        ("offset", (0.5, 0, math.nan)),
    ],
)
def test_place_of_columns_out_of_range_is_refused(name, values):
    assert_refused(name, grid_at, hall(1, 1), *values)


@pytest.mark.parametrize(
    ("name", "value"), [("population", 2), ("generations", -1)]
)
def test_search_of_no_size_is_refused(name, value):
    assert_refused(name, optimise_grid, hall(1, 1), 0.5, **{name: value})


def test_search_of_the_first_generation_alone_is_valid():
    assert optimise_grid(hall(1, 1), 0.5, generations=0).coverage == 1


def test_a_map_of_too_many_squares_is_refused_in_one_line():
    free = hall(300, 300)
    for make in (plain_grid, optimise_grid):
        with pytest.raises(ParameterError, match=r"size.*0\.3 m or more"):
            make(free, 0.1)
