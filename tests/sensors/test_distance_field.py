"""Distance fields by hand, by finite differences, and turned."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.geometry import rotation
from drake_mobarm.sensors.distance_field import DistanceField
from drake_mobarm.world.occupancy import OccupancyGrid
from helpers.shapes import rectangle

# Within the field, whose lower edge is at y = -1.4.
COORDINATE = st.floats(-1.39, 1.39)


def block(columns, rows, cell=0.1):
    """Centres of a block of cells whose lower left one is at W's origin."""
    x, y = np.meshgrid(cell * np.arange(columns), cell * np.arange(rows))
    return np.column_stack([x.ravel(), y.ravel()])


# A block of 6 by 4 cells, a cell by itself, and a wall one cell thick.
THINGS = np.vstack(
    [block(6, 4), [[-0.8, 0.5]], np.add(block(1, 9), (1.2, -0.4))]
)
FIELD = DistanceField.from_points(THINGS, 0.1)


def not_on_a_node_line(x, y):
    return min(abs(v / 0.05 - round(v / 0.05)) for v in (x, y)) > 1e-3


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        # A cell's surface is at its centre in the mean, 5 cm within its edge.
        ((0.0, 0.0), 0.0),
        ((0.3, 0.0), 0.3),
        ((0.0, -0.45), 0.45),
        # From its corner at (0.05, 0.05): 3, 4, 5, and 5 cm to the surface.
        ((0.35, 0.45), 0.55),
    ],
)
def test_distance_to_a_single_cell_is_worked_by_hand(point, expected):
    field = DistanceField.from_points([[0.0, 0.0]], 0.1)
    distance, _ = field.at(np.array([point]))
    assert distance == pytest.approx([expected], abs=1e-6)


def test_inside_of_things_the_distance_is_negative():
    # Across 5 rows: the middle is 25 cm within their edges, 20 cm within
    # their surface; the outermost centres are on it.
    field = DistanceField.from_points(block(20, 5), 0.1)
    distance, _ = field.at(np.array([[1.0, y] for y in (0, 0.1, 0.2, 0.4)]))
    np.testing.assert_allclose(distance, [0, -0.1, -0.2, 0], atol=1e-6)


@given(COORDINATE, COORDINATE)
def test_the_gradient_is_that_of_the_distance(x, y):
    # On a line between nodes there is none.
    assume(not_on_a_node_line(x, y))
    step = 1e-6
    moves = step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    distance, _ = FIELD.at(np.array([x, y]) + moves)
    _, gradient = FIELD.at(np.array([[x, y]]))
    expected = [distance[0] - distance[1], distance[2] - distance[3]]
    np.testing.assert_allclose(
        gradient[0], np.array(expected) / (2 * step), atol=1e-6
    )


def test_beside_a_straight_wall_the_gradient_is_its_normal():
    field = DistanceField.from_points(block(20, 5), 0.1)
    _, gradient = field.at(np.array([[1.01, 0.62], [1.01, 0.33], [1.0, -0.2]]))
    np.testing.assert_allclose(gradient, [[0, 1], [0, 1], [0, -1]], atol=1e-5)


@given(COORDINATE, COORDINATE, st.floats(-4, 4))
def test_a_turned_plan_has_a_turned_field(x, y, yaw):
    turn = rotation(yaw)
    turned = DistanceField.from_points(THINGS @ turn.T, 0.1, yaw)
    distance, gradient = turned.at(np.array([[x, y]]) @ turn.T)
    expected, slope = FIELD.at(np.array([[x, y]]))
    np.testing.assert_allclose(distance, expected, atol=1e-5)
    # Rounding may put a point on the other side of a node.
    if not_on_a_node_line(x, y):
        np.testing.assert_allclose(gradient, slope @ turn.T, atol=1e-4)


def test_beyond_the_field_nothing_is_near():
    points = np.array([[3.0, 0.0], [0.0, -9.0], [1e300, 0.0], [-2.5, 0.0]])
    distance, gradient = FIELD.at(points)
    assert np.isinf(distance).all()
    np.testing.assert_array_equal(gradient, 0)


def test_where_nothing_is_mapped_nothing_is_near():
    field = DistanceField.from_points(np.empty((0, 2)), 0.05)
    distance, gradient = field.at(np.array([[0.0, 0.0], [1.0, -2.0]]))
    assert np.isinf(distance).all()
    np.testing.assert_array_equal(gradient, 0)


def test_in_the_mean_a_wall_of_the_world_is_where_the_distance_is_0():
    off = []
    for shift in np.linspace(0, 0.05, 50, endpoint=False):
        # Another wall, which does not move, keeps the cells in place.
        walls = [rectangle(-3, -1, -2, 1), rectangle(shift, -1, 0.2 + shift, 1)]
        grid = OccupancyGrid.from_outlines(walls, 0.05)
        field = DistanceField.from_points(grid.centres()[grid.occupied], 0.05)
        distance, _ = field.at(np.array([[shift, 0.1], [0.2 + shift, 0.1]]))
        off.append(distance)
    # Up to half a cell, as a uniform distribution is.
    assert np.mean(off) == pytest.approx(0, abs=0.001)
    assert np.abs(off).max() <= 0.025 + 1e-6
    assert np.var(off) == pytest.approx(field.variance, rel=0.05)


@pytest.mark.parametrize(
    ("points", "resolution", "said"),
    [
        ([[0, math.nan]], 0.05, "points"),
        ([[0, math.inf]], 0.05, "points"),
        ([[0, 0]], 0.0, "resolution"),
        ([[0, 0]], math.nan, "resolution"),
        ([[0, 0], [1e5, 1e5]], 0.05, "points .* 6250000 cells of 0.05 m"),
    ],
)
def test_what_cannot_be_a_plan_is_refused(points, resolution, said):
    with pytest.raises(ParameterError, match=said):
        DistanceField.from_points(points, resolution)
