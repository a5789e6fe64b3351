"""Pairs of starts and targets, beside the buildings' own shapes."""

import math

import numpy as np
import pytest
import shapely

from drake_mobarm.navigation.trials import make_pair
from drake_mobarm.robot.shape import HEIGHTS, RADIUS
from drake_mobarm.world.obstacles import outlines
from drake_mobarm.world.rooms import ROOMS
from drake_mobarm.world.sdf import load_world

WORLDS = ["small_house", "bookstore", "cafe"]
COUNT = 48


def pairs(world, seed=0, count=COUNT):
    return [make_pair(world, seed, index) for index in range(count)]


@pytest.mark.parametrize("world", WORLDS)
def test_pairs_repeat_by_their_seed_and_index(world):
    first = pairs(world, seed=4, count=5)
    assert pairs(world, seed=4, count=5) == first
    others = pairs(world, seed=5, count=5)
    assert all(a != b for a in first for b in others)
    assert len({pair.seed for pair in first}) == 5


@pytest.mark.parametrize("world", WORLDS)
def test_both_places_are_on_free_floor_that_hangs_together(world):
    solid = shapely.union_all(
        [
            shapely.Polygon(outline)
            for outline in outlines(load_world(world).obstacles, *HEIGHTS)
        ]
    )
    # The raster's cells are up to half a diagonal, 3.5 cm, off.
    grown = solid.buffer(RADIUS - 0.036)
    floor = shapely.box(*grown.bounds).buffer(1.0).difference(grown)
    rooms = shapely.get_parts(floor)
    for start, target, _ in pairs(world):
        for place in (start[:2], target):
            assert solid.distance(shapely.Point(place)) >= RADIUS
        (room,) = (r for r in rooms if r.contains(shapely.Point(target)))
        assert room.contains(shapely.Point(start[:2]))
        # Not the ground outside the building.
        assert not room.intersects(floor.envelope.boundary)


@pytest.mark.parametrize("world", WORLDS)
def test_start_and_target_are_at_least_a_metre_and_a_half_apart(world):
    distances = [math.dist(p.start[:2], p.target) for p in pairs(world)]
    assert min(distances) >= 1.5
    # And mostly much farther.
    assert np.median(distances) > 3


def room_of(place):
    x, y, *_ = place
    (name,) = (
        name
        for name, (x_min, x_max, y_min, y_max) in ROOMS.items()
        if x_min <= x < x_max and y_min <= y < y_max
    )
    return name


def test_in_the_small_house_all_pairs_of_rooms_come_in_turn():
    met = [(room_of(p.start), room_of(p.target)) for p in pairs("small_house")]
    assert len(ROOMS) == 4
    assert len(set(met[:16])) == 16
    assert met[:16] == met[16:32] == met[32:]


@pytest.mark.parametrize("world", WORLDS)
def test_starts_look_in_all_directions(world):
    yaws = [pair.start[2] for pair in pairs(world)]
    assert min(yaws) >= -math.pi
    assert max(yaws) < math.pi
    quadrants = np.floor(np.array(yaws) / (math.pi / 2)).astype(int)
    assert np.bincount(quadrants + 2, minlength=4).min() >= 4
