import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal

from drake_mobarm.exceptions import MapError, WorldError
from drake_mobarm.robot.shape import HEIGHTS, LIDAR_HEIGHT
from drake_mobarm.world import (
    FloorPlan,
    floor_plan_of,
    load_world,
    write_floor_plan,
)
from drake_mobarm.world.floor_plan_world import cover_cells
from drake_mobarm.world.obstacles import clearance, outlines


def cells(*rows):
    return np.array([list(row) for row in rows]) == "#"


def saved(folder, occupied, unknown=None, **fields):
    """The path of a map."""
    if unknown is None:
        unknown = np.zeros_like(occupied)
    plan = FloorPlan(occupied, unknown, **{"resolution": 0.5} | fields)
    write_floor_plan(plan, folder / "home.yaml")
    return str(folder / "home.yaml")


@given(arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12))))
def test_rectangles_cover_exactly_the_cells(occupied):
    covered = np.zeros_like(occupied)
    for top, bottom, start, end in cover_cells(occupied):
        assert occupied[top:bottom, start:end].all()
        covered[top:bottom, start:end] = True
    assert_array_equal(covered, occupied)


def test_a_cross_is_two_rectangles():
    cross = cells(".#..", "####", ".#..")
    assert sorted(cover_cells(cross)) == [(0, 3, 1, 2), (1, 2, 0, 4)]


def test_a_rectangle_grows_the_way_that_adds_more():
    # By rows alone, or by columns alone, it would be one more.
    assert len(list(cover_cells(cells("##.", "###", ".##")))) == 2
    assert len(list(cover_cells(cells("##.", ".##", "##.")))) == 3


def test_a_room_is_four_walls():
    room = cells("######", "#....#", "#....#", "######")
    assert sorted(cover_cells(room)) == [
        (0, 1, 0, 6),
        (0, 4, 0, 1),
        (0, 4, 5, 6),
        (3, 4, 0, 6),
    ]


def test_a_maps_occupied_cells_are_the_world(tmp_path):
    path = saved(tmp_path, cells("..##", "...."), origin=(2.0, 1.0, 0.0))
    world = load_world(path)
    assert (world.name, str(world.path)) == ("home", path)
    (found,) = outlines(world.obstacles, *HEIGHTS)
    # Columns 2 and 3 of the upper row: 3 to 4 m, and 1.5 to 2 m.
    expected = [[3, 1.5], [3, 2], [4, 1.5], [4, 2]]
    assert_allclose(sorted(found.tolist()), expected, atol=1e-12)
    (seen,) = outlines(world.obstacles, LIDAR_HEIGHT, LIDAR_HEIGHT)
    assert_allclose(sorted(seen.tolist()), expected, atol=1e-12)
    (obstacle,) = world.obstacles
    assert obstacle.corners[:, 2].max() == pytest.approx(1.2)


def test_the_world_turns_with_the_maps_origin(tmp_path):
    path = saved(tmp_path, cells("..#", "..."), origin=(2.0, 1.0, np.pi / 2))
    (found,) = outlines(load_world(path).obstacles, *HEIGHTS)
    # p_P is 1 to 1.5 m, 0.5 to 1 m; a quarter turn makes (x, y) (-y, x).
    expected = [[1, 2], [1, 2.5], [1.5, 2], [1.5, 2.5]]
    assert_allclose(sorted(found.tolist()), expected, atol=1e-12)


def test_a_world_touches_the_centres_of_a_turned_maps_cells(tmp_path):
    rng = np.random.default_rng(0)
    path = saved(tmp_path, rng.random((20, 30)) < 0.3, origin=(3.0, -2.0, 0.4))
    world, plan = load_world(path), floor_plan_of(load_world(path))
    shapes = outlines(world.obstacles, *HEIGHTS)
    assert clearance(shapes, plan.points()).max() == 0
    free = FloorPlan(plan.free, plan.unknown, plan.resolution, plan.origin)
    # Half a cell of 0.5 m is between a free cell's centre and any wall.
    assert clearance(shapes, free.points()).min() > 0.25 - 1e-9


def test_unknown_cells_are_no_walls(tmp_path):
    unknown = cells("##.", "##.")
    path = saved(tmp_path, np.zeros((2, 3), bool), unknown)
    assert load_world(path).obstacles == ()


def test_a_maps_plan_is_the_map(tmp_path):
    occupied, unknown = cells("#..", "#.."), cells("...", "..#")
    plan = floor_plan_of(load_world(saved(tmp_path, occupied, unknown)))
    assert_array_equal(plan.occupied, occupied)
    assert_array_equal(plan.unknown, unknown)


def test_a_map_is_read_anew_when_its_image_has_changed(tmp_path):
    path = saved(tmp_path, cells("#..."))
    assert len(load_world(path).obstacles) == 1
    assert load_world(path) is load_world(path)
    (tmp_path / "new").mkdir()
    saved(tmp_path / "new", cells("#.#."))
    (tmp_path / "new" / "home.png").replace(tmp_path / "home.png")
    assert len(load_world(path).obstacles) == 2


def test_a_map_too_far_away_is_told(tmp_path):
    path = saved(tmp_path, cells("#."), origin=(9999.5, 0.0, 0.0))
    with pytest.raises(MapError, match=rf"map {path}: it reaches further"):
        load_world(path)


def test_a_map_of_noise_is_told(tmp_path):
    noise = np.random.default_rng(0).random((400, 400)) < 0.3
    path = saved(tmp_path, noise, resolution=0.05)
    with pytest.raises(MapError, match=rf"map {path}: .* more than 5000 boxes"):
        load_world(path)


def test_a_file_that_is_no_map_is_told(tmp_path):
    (tmp_path / "scenario.yaml").write_text("diagram: homing\n")
    with pytest.raises(MapError, match="image is missing"):
        load_world(str(tmp_path / "scenario.yaml"))
    with pytest.raises(WorldError, match=r"ends in .sdf, .world, .yaml, .yml"):
        load_world(str(tmp_path / "no.yaml"))


@pytest.mark.parametrize("name", ["bookstore", "cafe", "small_house"])
def test_a_typical_buildings_map_is_a_few_hundred_boxes(name):
    plan = floor_plan_of(load_world(name))
    assert len(list(cover_cells(plan.occupied))) < 400
