"""Worlds as people have them, compared with a reader without Drake."""

from pathlib import Path

import numpy as np
import pytest

from drake_mobarm.diagrams.station import build_station
from drake_mobarm.robot.shape import LIDAR_HEIGHT
from drake_mobarm.station import StationParameters
from drake_mobarm.world.obstacles import inside, outlines
from drake_mobarm.world.sdf import load_world
from drake_mobarm.world.world import WORLDS
from helpers.plain_sdf import read_solids

FOLDER = Path(__file__).parent / "gazebo"
COUNTS = {"warehouse.world": 4, "office.sdf": 16, "courtyard.WORLD": 2}
GAZEBO = [FOLDER / name for name in COUNTS]
SHIPPED = sorted(WORLDS.glob("*.sdf"))
ALL = pytest.mark.parametrize(
    "path", GAZEBO + SHIPPED, ids=lambda path: path.name
)
# How far off the corners are that stand for round things of up to 0.5 m [m].
BOUND = 0.0011


def solids(path):
    """What the plain reader finds, over its floor."""
    found = read_solids(path)
    floors = [s.X_WG[2, 3] for s in found if s.tag == "plane"]
    for solid in found:
        solid.X_WG[2, 3] -= floors[0] if floors else 0.0
    return [s for s in found if s.tag != "plane"]


def key(name, corners):
    return name, *np.round(corners.mean(axis=0), 6)


@ALL
def test_every_obstacle_is_where_the_plain_reader_has_it(path):
    obstacles = sorted(
        load_world(str(path)).obstacles, key=lambda o: key(o.name, o.corners)
    )
    expected = sorted(
        solids(path), key=lambda s: key(s.name, s.X_WG[None, :3, 3])
    )
    assert len(obstacles) == len(expected)
    for obstacle, solid in zip(obstacles, expected, strict=True):
        assert obstacle.name == solid.name
        np.testing.assert_allclose(
            obstacle.corners.mean(axis=0), solid.X_WG[:3, 3], atol=1e-9
        )
        # Its corners are on the surface.
        assert solid.holds(obstacle.corners, BOUND).all()
        assert not solid.holds(obstacle.corners, -BOUND).any()


@pytest.mark.parametrize(("name", "count"), COUNTS.items())
def test_every_collision_but_the_floor_is_an_obstacle(name, count):
    assert len(load_world(str(FOLDER / name)).obstacles) == count


@ALL
@pytest.mark.parametrize("height", [0.02, LIDAR_HEIGHT, 0.45, 0.73, 1.9])
def test_every_slice_holds_the_points_that_the_plain_reader_has(path, height):
    shapes = outlines(load_world(str(path)).obstacles, height, height)
    expected = solids(path)
    rng = np.random.default_rng(0)
    points = [rng.uniform((-8, -8, height), (8, 8, height), (5000, 3))]
    for solid in expected:
        near = rng.uniform(-1, 1, (50, 3)) + solid.X_WG[:3, 3]
        near[:, 2] = height
        points.append(near)
    points = np.vstack(points)
    found = np.zeros(len(points), dtype=bool)
    for shape in shapes:
        found |= inside(shape, points[:, :2])
    least, most = np.zeros_like(found), np.zeros_like(found)
    for solid in expected:
        least |= solid.holds(points, -BOUND)
        most |= solid.holds(points, BOUND)
    assert not (least & ~found).any()
    assert not (found & ~most).any()
    assert least.any() or not expected


@pytest.mark.parametrize("path", GAZEBO, ids=lambda path: path.name)
def test_a_robot_can_be_put_into_it(path):
    world = load_world(str(path))
    station = build_station(world, [-3.0, -2.0, 0.0], StationParameters())
    inspector = station.GetSubsystemByName("scene_graph").model_inspector()
    names = [inspector.GetName(i) for i in inspector.GetAllGeometryIds()]
    put = [name for name in names if f"({world.name} " in name]
    assert len(put) >= len(world.geometries) > 0
