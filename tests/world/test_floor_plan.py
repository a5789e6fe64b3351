from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal

from drake_mobarm.exceptions import ParameterError, WorldError
from drake_mobarm.world import (
    FloorPlan,
    OccupancyGrid,
    World,
    adaptive_grid_size,
)
from drake_mobarm.world.obstacles import Obstacle, box_corners

X, O = True, False  # noqa: E741


def cells(*rows):
    """Which cells are `#`, and which are `?`."""
    text = np.array([list(row) for row in rows])
    return text == "#", text == "?"


def plan_of(*rows, resolution=1.0, origin=(0.0, 0.0, 0.0)):
    return FloorPlan(*cells(*rows), resolution, origin)


def world_of(*boxes):
    """A world of boxes (x_low, x_high, y_low, y_high), 1 m high."""
    obstacles = []
    for x_low, x_high, y_low, y_high in boxes:
        size = [x_high - x_low, y_high - y_low, 1]
        centre = [(x_low + x_high) / 2, (y_low + y_high) / 2, 0.5]
        obstacles.append(Obstacle("box", box_corners(np.array(size)) + centre))
    return World("boxes", Path("boxes.sdf"), tuple(obstacles), ())


def test_what_is_neither_occupied_nor_unknown_is_free():
    plan = plan_of("#?", "..")
    assert_array_equal(plan.free, [[O, O], [X, X]])


def test_points_are_centres_from_the_lower_left_corner():
    plan = plan_of("#.", "..", "..", resolution=0.5, origin=(10.0, 20.0, 0.0))
    # Half a cell from the left; two and a half rows of 0.5 m up.
    assert_allclose(plan.points(), [[10.25, 21.25]])


def test_points_turn_about_the_origin():
    plan = plan_of("..", "#.", resolution=2.0, origin=(1.0, 1.0, np.pi / 2))
    # p_P = (1, 1); a quarter turn makes it (-1, 1).
    assert_allclose(plan.points(), [[0.0, 2.0]], atol=1e-12)


def test_the_index_of_a_cells_centre_is_the_cell():
    plan = plan_of("...#", "....", resolution=0.1, origin=(-3.0, 5.0, 0.7))
    row, column = plan.index(plan.points())
    assert (row.tolist(), column.tolist()) == ([0], [3])


def test_the_grid_of_radius_zero_shows_the_cells():
    plan = plan_of("#..", "..?", resolution=0.5, origin=(1.0, 2.0, 0.0))
    grid = plan.grid(0.5, 0.0)
    assert_allclose(grid.origin, [1.25, 2.25])
    # Rows of a grid go up.
    assert_array_equal(grid.occupied, [[O, O, X], [X, O, O]])


def test_a_square_is_free_where_a_disc_can_stand():
    plan = plan_of(*["." * 9] * 4, "." * 4 + "#" + "." * 4, *["." * 9] * 4)
    free = ~plan.grid(1.0, 1.5).occupied
    expected = np.zeros((9, 9), dtype=bool)
    # The ring beyond the edge is one cell off the outermost cells: 1 < 1.5.
    expected[1:-1, 1:-1] = True
    # Centres 0, 1 and sqrt(2) m off the obstacle's are too near, 2 m are not.
    expected[3:6, 3:6] = False
    assert_array_equal(free, expected)


def test_a_disc_that_only_touches_a_cells_centre_can_stand():
    free = ~plan_of("....", "...#").grid(1.0, 1.0).occupied
    # All centres are 1 m off the ring's, or more.
    assert_array_equal(free, [[X, X, X, O], [X, X, X, X]])


def test_rounding_adds_no_squares():
    # 3 * 0.1 is a bit more than 0.3.
    grid = plan_of("...", "...", "...", resolution=0.1).grid(0.1, 0.0)
    assert grid.occupied.shape == (3, 3)


def test_unknown_cells_are_kept_clear_of_like_occupied_ones():
    rows = ["." * 7, "...#...", "." * 7]
    hidden = [row.replace("#", "?") for row in rows]
    assert_array_equal(
        plan_of(*rows).grid(0.5, 0.9).occupied,
        plan_of(*hidden).grid(0.5, 0.9).occupied,
    )


@given(
    kinds=arrays(
        np.uint8,
        st.tuples(st.integers(1, 6), st.integers(1, 6)),
        elements=st.integers(0, 2),
    ),
    yaw=st.floats(-4, 4),
    cell=st.floats(0.3, 2),
    radius=st.floats(0, 3),
)
def test_a_square_is_occupied_by_the_nearest_cell_that_is_not_free(
    kinds, yaw, cell, radius
):
    plan = FloorPlan(kinds == 1, kinds == 2, 1.0, (3.0, -2.0, yaw))
    grid = plan.grid(cell, radius)
    # All cells and two rings beyond them, in the plan's own frame.
    kinds = np.pad(kinds, 2, constant_values=1)
    row, column = np.indices(kinds.shape)
    up, right = len(kinds) - 2 - row - 0.5, column - 2 + 0.5
    c, s = np.cos(yaw), np.sin(yaw)
    x = 3 + c * right - s * up
    y = -2 + s * right + c * up
    at = grid.centres()[:, :, None, None]
    distance = np.hypot(at[..., 0] - x, at[..., 1] - y)
    blocked = kinds != 0
    near = (distance < radius) & blocked
    nearest = distance.reshape(*grid.occupied.shape, -1).argmin(axis=-1)
    expected = near.any(axis=(2, 3)) | blocked.ravel()[nearest]
    # Where rounding decides, either is right.
    sure = (abs(distance - radius) > 1e-9).all(axis=(2, 3))
    ordered = np.sort(distance.reshape(*grid.occupied.shape, -1))
    sure &= ordered[..., 1] - ordered[..., 0] > 1e-9
    assert_array_equal(grid.occupied[sure], expected[sure])


def test_squares_beyond_a_turned_plan_are_occupied():
    plan = plan_of(*["." * 10] * 10, origin=(0.0, 0.0, np.pi / 4))
    grid = plan.grid(1.0, 0.0)
    # A square of 10 m on its corner: |x| + |y - 7.07| < 7.07.
    x, y = np.moveaxis(grid.centres(), -1, 0)
    middle = 10 / np.sqrt(2)
    assert_array_equal(~grid.occupied, abs(x) + abs(y - middle) < middle)


def test_too_many_squares_are_refused():
    with pytest.raises(WorldError, match=r"1 m by 1 m has more .* of 0.0001"):
        plan_of(".").grid(1e-4, 0.0)


@pytest.mark.parametrize("size", [0.0, -1.0, float("nan"), 1e-5])
def test_a_size_that_cannot_be_is_refused(size):
    with pytest.raises(ParameterError, match="cell is"):
        plan_of(".").grid(size, 0.0)
    with pytest.raises(ParameterError, match="resolution is"):
        FloorPlan.from_world(world_of((0, 2, 0, 1)), size)


def test_a_worlds_plan_has_its_obstacles_in_a_free_metre():
    plan = FloorPlan.from_world(world_of((0, 2, 0, 1)), resolution=0.5)
    # Cell centres from (-1, -1): the box takes 0, 0.5, ... 2 and 0, 0.5, 1.
    assert plan.origin == (-1.25, -1.25, 0.0)
    expected = np.zeros((7, 9), dtype=bool)
    expected[2:5, 2:7] = True
    assert_array_equal(plan.occupied, expected)
    assert not plan.unknown.any()


WALLS = [(0, 6, 0, 0.2), (0, 6, 5.8, 6), (0, 0.2, 0, 6), (5.8, 6, 0, 6)]


def test_outside_the_walls_all_is_unknown():
    plan = FloorPlan.from_world(world_of(*WALLS, (2, 3, 2, 3)), 0.1)
    points = [[3.5, 3.5], [-0.5, 3.0], [3.0, 6.5], [0.1, 3.0], [2.5, 2.5]]
    found = plan.index(points)
    assert plan.free[found].tolist() == [X, O, O, O, O]
    assert plan.unknown[found].tolist() == [O, X, X, O, O]
    assert plan.occupied[found].tolist() == [O, O, O, X, X]


def test_walls_with_a_door_leave_all_known():
    walls = [*WALLS[:3], (5.8, 6, 0, 2), (5.8, 6, 3, 6)]
    assert not FloorPlan.from_world(world_of(*walls), 0.1).unknown.any()


def test_a_plan_reaches_a_metre_beyond_what_it_has_to_cover():
    world = world_of((0, 2, 0, 1))
    plan = FloorPlan.from_world(world, 0.5, cover=[[5.0, 0.5], [0.0, -3.0]])
    free = plan.free
    assert free[plan.index([[5.9, 0.5], [0.0, -3.9]])].all()
    assert plan.occupied[plan.index([[1.0, 0.5]])].all()
    near = FloorPlan.from_world(world, 0.5, cover=[[1.0, 0.5]])
    assert near.free.shape == (7, 9)


def test_walls_below_the_heights_make_no_inside():
    plan = FloorPlan.from_world(world_of(*WALLS), 0.1, (1.1, 2.0))
    assert plan.free.all()


def test_only_what_stands_between_the_heights_is_on_a_plan():
    world = world_of((0, 2, 0, 1))
    assert not FloorPlan.from_world(world, 0.5, (1.1, 2.0)).occupied.any()


def test_the_grid_size_is_the_root_of_the_mean_free_line():
    occupied = cells("..#.", "....")[0]
    grid = OccupancyGrid(np.zeros(2), 0.5, occupied)
    # Rows: 2, 1, 4; columns: 2, 2, 1, 2. 14 cells on 7 lines.
    assert adaptive_grid_size(grid) == pytest.approx(0.5 * np.sqrt(2))


def test_forty_free_cells_of_5_cm_on_the_mean_make_squares_of_32_cm():
    grid = OccupancyGrid(np.zeros(2), 0.05, np.zeros((40, 40), dtype=bool))
    assert adaptive_grid_size(grid) == pytest.approx(0.316, abs=5e-4)


def test_no_free_line_makes_no_grid_size():
    grid = OccupancyGrid(np.zeros(2), 0.05, np.ones((2, 2), dtype=bool))
    with pytest.raises(WorldError, match="nothing of the floor plan is free"):
        adaptive_grid_size(grid)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"resolution": 0.0}, "resolution is 0.0"),
        ({"resolution": float("nan")}, "resolution is nan"),
        ({"origin": (0.0, 0.0)}, "origin is"),
        ({"origin": (0.0, 0.0, float("inf"))}, "origin is"),
        ({"occupied": np.zeros((0, 3), dtype=bool)}, "shape of occupied is"),
        ({"unknown": np.zeros((2, 3), dtype=bool)}, "shape of unknown is"),
        ({"unknown": np.ones((2, 2), dtype=bool)}, "cells both .* is 1"),
    ],
)
def test_a_plan_that_cannot_be_is_refused(changes, said):
    with pytest.raises(ParameterError, match=said):
        replace(plan_of("#.", ".."), **changes)
