"""Forces against finite differences of potentials, and (3.2) by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.navigation.potential import (
    PotentialParameters,
    attraction,
    grid_influence,
    influence_distances,
    repulsion,
)
from helpers.plans import plan
from helpers.refusals import assert_refused

# Nothing at its default, no two numbers alike.
ODD = PotentialParameters(
    attraction_gain=1.7,
    conic_distance=1.3,
    repulsion_gain=0.6,
    influence_distance=0.9,
    clearance=0.07,
)
GNRON = replace(ODD, repulsion="gnron")
TARGET = np.array([2.0, -1.0])
PLACES = [(0.3, 0.2), (-1.1, 0.4), (1.6, -0.8), (2.0, 1.9), (2.1, -1.0)]


def minus_gradient(potential, position, step=1e-6):
    steps = step * np.eye(2)
    return np.array(
        [
            (potential(position - s) - potential(position + s)) / (2 * step)
            for s in steps
        ]
    )


def attractive_potential(position):
    """Quadratic from near, conic beyond, smooth where they meet."""
    distance = math.dist(position, TARGET)
    k, c = ODD.attraction_gain, ODD.conic_distance
    if distance <= c:
        return k * distance**2 / 2
    return k * (c * distance - c**2 / 2)


@pytest.mark.parametrize("place", PLACES)
def test_attraction_is_minus_the_gradient_of_the_conic_quadratic_potential(
    place,
):
    position = np.array(place)
    np.testing.assert_allclose(
        attraction(position, TARGET, ODD),
        minus_gradient(attractive_potential, position),
        atol=1e-6,
    )


def test_attraction_grows_no_more_beyond_the_conic_distance():
    # 3-4-5 triangles: 1 m and 5 m and 50 m away.
    for size, expected in ((0.2, 1.7), (1.0, 1.7 * 1.3), (10.0, 1.7 * 1.3)):
        force = attraction(np.zeros(2), size * np.array([3.0, -4.0]), ODD)
        np.testing.assert_allclose(force, expected * np.array([0.6, -0.8]))


def test_on_the_target_nothing_attracts():
    np.testing.assert_array_equal(attraction(TARGET, TARGET, ODD), [0, 0])


def scattered_squares():
    """Centres in W with the influence distance of each [m]."""
    rng = np.random.default_rng(5)
    return rng.uniform(-1.5, 3.0, (40, 2)), rng.uniform(0.5, 0.9, 40)


AREA, ROBOT = 0.04, 0.21


def repulsive_potential(position, squares, influence):
    """Khatib's, summed over the squares, each times its area."""
    total = 0.0
    for square, d_0 in zip(squares, influence, strict=True):
        d = math.dist(position, square) - ROBOT
        if d <= d_0:
            total += AREA * ODD.repulsion_gain / 2 * (1 / d - 1 / d_0) ** 2
    return total


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("power", [0, 2])
def test_repulsion_is_minus_the_gradient_of_khatibs_or_gnrons_potential(
    place, power
):
    position = np.array(place)
    squares, influence = scattered_squares()
    apart = np.hypot(*(squares - position).T)
    kept = apart > ROBOT + 0.05  # Nearer ones are capped.
    squares, influence = squares[kept], influence[kept]

    def potential(p):
        # Ge and Cui's n = 2; Khatib's is that of n = 0.
        factor = math.dist(p, TARGET) ** power
        return factor * repulsive_potential(p, squares, influence)

    expected = minus_gradient(potential, position)
    force = repulsion(
        squares - position,
        influence,
        AREA,
        TARGET - position,
        GNRON if power else ODD,
        radius=ROBOT,
    )
    np.testing.assert_allclose(force, expected, rtol=1e-5, atol=1e-7)
    # Without anything to repel, the comparison would be empty.
    assert np.hypot(*expected) > 1e-3


def test_repulsion_of_one_square_is_khatibs_formula():
    # 0.5 m away, 0.25 m off the robot's rim: 4 - 1/0.9, over 0.0625.
    force = repulsion(
        np.array([[0.3, 0.4]]), 0.9, 0.01, TARGET, ODD, radius=0.25
    )
    size = 0.6 * 0.01 * (4 - 1 / 0.9) / 0.0625
    np.testing.assert_allclose(force, -size * np.array([0.6, 0.8]))


@pytest.mark.parametrize("distance", [0.91, 1.15, 5.0])
def test_beyond_its_influence_a_square_does_not_repel(distance):
    force = repulsion(
        np.array([[distance, 0.0]]), 0.9, 0.01, TARGET, GNRON, radius=0.0
    )
    np.testing.assert_array_equal(force, [0, 0])


def test_the_robots_radius_is_taken_off_the_distance():
    way = np.array([4.0, 1.0])
    grown, plain = (
        repulsion(np.array([[d, 0.0]]), 0.9, 0.01, way, ODD, radius=r)
        for d, r in ((0.4, 0.0), (0.67, 0.27))
    )
    np.testing.assert_allclose(plain, grown)
    assert grown[0] < 0


@pytest.mark.parametrize("parameters", [ODD, GNRON])
def test_repulsion_is_scaled_by_the_squares_area(parameters):
    squares, influence = scattered_squares()
    small, large = (
        repulsion(squares, influence, area, TARGET, parameters)
        for area in (0.01, 0.04)
    )
    assert np.hypot(*small) > 0
    np.testing.assert_allclose(large, 4 * small)


def test_a_wall_repels_the_same_whatever_the_size_of_its_squares():
    # 2 m by 1 m of wall, 0.3 m ahead; squares of 1 cm and of 2 cm.
    forces = []
    for size in (0.01, 0.02):
        x = np.arange(0.3 + size / 2, 1.3, size)
        y = np.arange(-1 + size / 2, 1, size)
        squares = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        forces.append(repulsion(squares, 0.9, size**2, TARGET, ODD))
    assert forces[0][0] < -0.1
    np.testing.assert_allclose(forces[1], forces[0], rtol=0.01, atol=1e-9)


def test_what_is_touched_repels_no_more_strongly_than_from_two_centimetres():
    near = [
        repulsion(np.array([[d, 0.0]]), 0.9, 0.01, TARGET, ODD, radius=0.27)
        for d in (0.1, 0.27, 0.29)
    ]
    np.testing.assert_allclose(near, [near[2]] * 3)
    size = 0.6 * 0.01 * (1 / 0.02 - 1 / 0.9) / 0.02**2
    np.testing.assert_allclose(near[2], [-size, 0])


def test_nothing_around_does_not_repel():
    none = repulsion(np.empty((0, 2)), 0.9, 0.01, TARGET, GNRON)
    np.testing.assert_array_equal(none, [0, 0])


# (3.2)


def two_walls(apart):
    """Squares of two walls, a row each, and their clusters."""
    x = np.arange(0, 2, 0.1)
    low = np.column_stack([x, np.zeros_like(x)])
    return np.vstack([low, low + np.array([0, apart])]), np.repeat(
        [0, 1], len(x)
    )


@pytest.mark.parametrize(
    ("apart", "radius", "expected"),
    [
        (1.0, 0.0, 0.43),  # 1 / 2 - 0.07.
        (1.0, 0.27, 0.16),  # (1 - 0.54) / 2 - 0.07.
        (0.2, 0.0, 0.03),
        (0.13, 0.0, 0.9),  # -0.005: the nominal distance stays.
        (0.6, 0.27, 0.9),  # -0.04.
        (1.93, 0.0, 0.895),
        (1.95, 0.0, 0.9),  # 0.905: never larger than the nominal one.
        (50.0, 0.27, 0.9),
    ],
)
def test_influence_between_two_walls_is_half_their_distance_less_the_clearance(
    apart, radius, expected
):
    distances = influence_distances(*two_walls(apart), ODD, radius=radius)
    np.testing.assert_allclose(distances, np.full(40, expected))


def test_each_square_looks_for_the_closest_square_of_any_other_cluster():
    squares = np.array([(0, 0), (0.1, 0), (1, 0), (1, 0.4), (1, 1.2)])
    clusters = np.array([7, 7, 3, 5, 5])
    # To (1, 0): 1.0, 0.9; from it: 0.4; from (1, 0.4): 0.4. From the last one,
    # 1.2 to (1, 0): 0.4 m to its own cluster's does not count.
    expected = np.array([1.0, 0.9, 0.4, 0.4, 1.2]) / 2 - 0.07
    np.testing.assert_allclose(
        influence_distances(squares, clusters, ODD), expected
    )


@pytest.mark.parametrize("count", [150, 900])
def test_influence_among_few_squares_and_among_many_is_that_by_the_rule(count):
    # 900 squares are more than are compared pair by pair.
    rng = np.random.default_rng(count)
    squares = rng.uniform(0, math.sqrt(count) / 2, (count, 2))
    clusters = rng.integers(0, count // 3, count)
    expected = []
    for square, cluster in zip(squares, clusters, strict=True):
        others = squares[clusters != cluster]
        new = np.hypot(*(others - square).T).min() / 2 - 0.07 - 0.05
        expected.append(0.9 if new < 0 else min(new, 0.9))
    assert 0 < np.mean(np.equal(expected, 0.9)) < 0.9
    np.testing.assert_allclose(
        influence_distances(squares, clusters, ODD, radius=0.05), expected
    )


def test_a_single_thing_keeps_the_nominal_influence():
    squares, _ = two_walls(0.5)
    single = np.zeros(len(squares), dtype=int)
    np.testing.assert_array_equal(
        influence_distances(squares, single, ODD), np.full(40, 0.9)
    )


def test_no_squares_have_no_influence_distances():
    none = influence_distances(np.empty((0, 2)), np.empty(0, dtype=int), ODD)
    assert none.shape == (0,)


def test_midway_between_two_walls_that_the_robot_fits_through_nothing_repels():
    squares, clusters = two_walls(1.0)
    influence = influence_distances(squares, clusters, ODD, radius=0.27)
    # Half of the clearance on either side of the middle is free of repulsion.
    for y, repels in ((0.5, False), (0.56, False), (0.6, True)):
        force = repulsion(
            squares - [1.0, y], influence, 0.01, TARGET, ODD, radius=0.27
        )
        assert bool(force.any()) is repels


def test_a_square_of_no_influence_does_not_repel():
    # 0.5 / 2 - 0.25 = 0, which is not below 0.
    squares = np.array([(0.0, 0.0), (0.5, 0.0)])
    parameters = replace(ODD, clearance=0.25)
    influence = influence_distances(squares, np.array([0, 1]), parameters)
    assert influence.tolist() == [0, 0]
    with np.errstate(all="raise"):
        force = repulsion(
            squares + 0.01, influence, 0.01, TARGET, parameters, radius=0.27
        )
    np.testing.assert_array_equal(force, [0, 0])


def test_on_a_map_squares_that_touch_at_a_corner_are_one_thing():
    grid = plan("#....#", ".#...#", cell=0.5, origin=(3.0, -1.0))
    parameters = replace(ODD, influence_distance=2.0, clearance=0.0)
    squares, influence = grid_influence(grid, parameters)
    found = dict(zip(map(tuple, squares), influence, strict=True))
    # The left thing and the right one are 2.5 m apart above and 2 m below.
    assert found == pytest.approx(
        {
            (3.0, -0.5): 1.25,
            (5.5, -0.5): math.hypot(2.0, 0.5) / 2,
            (3.5, -1.0): 1.0,
            (5.5, -1.0): 1.0,
        }
    )


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("attraction_gain", 0.0),
        ("conic_distance", -1.0),
        ("influence_distance", math.nan),
        ("repulsion_gain", -0.1),
        ("clearance", -0.01),
        ("repulsion", "gauss"),
    ],
)
def test_a_parameter_out_of_range_is_named(name, value):
    assert_refused(name, PotentialParameters, **{name: value})
