"""The floor: level planes, its height, its reach, and how far things may be."""

import numpy as np
import pytest

from drake_mobarm.exceptions import ScenarioError, WorldError
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.places import Place, check_places
from drake_mobarm.world.sdf import load_world
from helpers.sdf import (
    PLANE,
    collision,
    faults,
    line_of,
    model,
    saved,
    visual,
    world,
)
from helpers.shapes import rectangle


def ground(pose="0 0 0 0 0 0", plane=PLANE):
    return model(collision(plane, "ground"), "ground", pose)


def test_a_level_plane_is_the_floor_and_no_obstacle(tmp_path):
    text = world(ground(), model(collision()))
    found = load_world(saved(tmp_path, text))
    assert [o.name for o in found.obstacles] == ["wall"]
    assert [g.name() for g in found.geometries] == ["wall"]


def test_a_plane_without_a_normal_is_level(tmp_path):
    text = world(ground(plane="<plane><size>1 1</size></plane>"))
    assert load_world(saved(tmp_path, text)).obstacles == ()


@pytest.mark.parametrize("height", [-2.0, 0.25])
def test_a_world_is_moved_so_that_its_floor_is_at_zero(tmp_path, height):
    text = world(
        ground(f"7 8 {height} 0 0 1"),
        model(collision(pose="1 2 3 0 0 0") + visual()),
    )
    found = load_world(saved(tmp_path, text))
    (obstacle,) = found.obstacles
    np.testing.assert_allclose(
        obstacle.corners.mean(axis=0), (1, 2, 3 - height)
    )
    heights = sorted(g.pose().translation()[2] for g in found.geometries)
    np.testing.assert_allclose(heights, sorted([-height, 3 - height]))


def test_planes_at_one_height_are_one_floor(tmp_path):
    text = world(
        ground("0 0 1 0 0 0"),
        ground("5 0 1.0004 0 0 0").replace('"ground"', '"yard"'),
        model(collision(pose="0 0 4 0 0 0")),
    )
    (found,) = load_world(saved(tmp_path, text)).obstacles
    assert found.corners.mean(axis=0)[2] == pytest.approx(3, abs=1e-3)


def test_planes_at_two_heights_are_refused_by_their_names(tmp_path):
    text = world(
        ground("0 0 0.5 0 0 0"),
        ground("5 0 1 0 0 0").replace('"ground"', '"yard"'),
    )
    (fault,) = faults(saved(tmp_path, text))
    first = line_of(text, "<collision")
    assert fault == (
        f"line {line_of(text, '<collision', 1)}: collision 'yard' is a floor "
        f"at z = 1 m, and collision 'ground' of line {first} is one at 0.5 m"
    )


@pytest.mark.parametrize(
    ("pose", "normal"),
    [
        ("0 0 0 0 0 0", "1 0 0"),
        ("0 0 0 0.01 0 0", "0 0 1"),
        ("0 0 3 0 0 0", "0 0 -1"),
        ("0 0 3 3.14159265 0 0", "0 0 1"),
    ],
)
def test_a_plane_that_is_not_level_is_refused_by_its_name(
    tmp_path, pose, normal
):
    plane = PLANE.replace("0 0 1", normal)
    text = world(ground(pose, plane))
    (fault,) = faults(saved(tmp_path, text))
    assert fault.startswith(
        f"line {line_of(text, '<collision')}: collision 'ground' is a plane "
        "that is not level"
    )


def test_a_turned_plane_may_be_level(tmp_path):
    # Its normal is along x, which points up.
    plane = PLANE.replace("0 0 1", "1 0 0")
    text = world(
        ground("0 0 2 0 -1.57079633 0", plane),
        model(collision(pose="0 0 5 0 0 0")),
    )
    (found,) = load_world(saved(tmp_path, text)).obstacles
    assert found.corners.mean(axis=0)[2] == pytest.approx(3)


def test_a_plane_without_a_direction_is_refused(tmp_path):
    text = world(ground(plane=PLANE.replace("0 0 1", "0 0 0")))
    (fault,) = faults(saved(tmp_path, text))
    assert fault.startswith(f"line {line_of(text, '<plane')}: ")
    assert "has no normal" in fault


# How far things may be


@pytest.mark.parametrize(
    ("pose", "shape"),
    [
        ("10000 0 0 0 0 0", "<box><size>1 1 1</size></box>"),
        ("0 -1e5 0 0 0 0", "<box><size>1 1 1</size></box>"),
        ("0 0 2e4 0 0 0", "<box><size>1 1 1</size></box>"),
        ("0 0 0 0 0 0", "<box><size>1 30000 1</size></box>"),
        ("9990 0 0 0 0 0", "<sphere><radius>20</radius></sphere>"),
    ],
)
@pytest.mark.parametrize("kind", [collision, visual])
def test_what_is_beyond_10_km_is_refused_by_its_name(
    tmp_path, pose, shape, kind
):
    text = world(model(kind(shape, "far"), pose=pose))
    (fault,) = faults(saved(tmp_path, text))
    assert fault.endswith("'far' is further than 10 km from the origin")
    assert fault.startswith(f"line {line_of(text, 'far')}: ")


@pytest.mark.parametrize("value", [[1e300, 0], [0, -10001], [0, np.inf]])
def test_a_place_beyond_10_km_is_refused_by_its_name(value):
    with pytest.raises(ScenarioError) as caught:
        check_places(load_world("empty"), [Place("beacon", value)])
    assert str(caught.value) == (
        f"beacon {value} is further than 10 km from the origin"
    )


def test_a_place_is_checked_in_a_world_of_kilometres(tmp_path):
    text = world(
        model(
            collision("<box><size>20 1 1</size></box>", pose="0 5 0 0 0 0")
            + collision("<box><size>20 1 1</size></box>", pose="0 -5 0 0 0 0")
            + collision("<box><size>1 11 1</size></box>", pose="10 0 0 0 0 0")
            + collision("<box><size>1 11 1</size></box>", pose="-10 0 0 0 0 0")
        ),
        model(collision(), "tower", "9000 9000 0 0 0 0"),
    )
    found = load_world(saved(tmp_path, text))
    check_places(found, [Place("start", [3, 1, 0], robot=True)])
    with pytest.raises(ScenarioError, match="outside the walls"):
        check_places(found, [Place("start", [30, 1, 0], robot=True)])
    with pytest.raises(ScenarioError, match="inside an obstacle"):
        check_places(found, [Place("start", [9000, 9000, 0], robot=True)])


def test_a_grid_is_not_made_of_more_cells_than_memory_holds():
    far = [rectangle(0, 0, 1, 1), rectangle(1e6, 1e6, 1e6 + 1, 1e6 + 1)]
    with pytest.raises(WorldError) as caught:
        OccupancyGrid.from_outlines(far)
    assert str(caught.value) == (
        "a floor plan of 1e+06 m by 1e+06 m has more than 50000000 cells of "
        "0.05 m"
    )
    assert OccupancyGrid.from_outlines(far, cell=1000.0).occupied.sum() == 2
