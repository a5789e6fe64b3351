"""The shipped floor plans are what their script draws."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy import ndimage

import drake_mobarm
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.world import (
    FloorPlan,
    adaptive_grid_size,
    floor_plan_of,
    load_world,
)

SCRIPT = (
    Path(drake_mobarm.__file__).parent.parent / "docs" / "draw_floor_plans.py"
)
NAMES = ("bookstore", "cafe", "small_house")


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location(SCRIPT.stem, SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def reached(plan, radius):
    """The largest area where a disc can move, as a grid of 5 cm."""
    grid = plan.grid(0.05, radius)
    numbered, _ = ndimage.label(~grid.occupied)
    sizes = np.bincount(numbered.ravel())[1:]
    return grid, numbered == np.argmax(sizes) + 1


@pytest.mark.parametrize("name", NAMES)
def test_a_committed_plan_is_what_the_script_draws(name, script):
    world = load_world(name)
    drawn, committed = script.floor_plan(world), floor_plan_of(world)
    assert_array_equal(committed.occupied, drawn.occupied)
    assert_array_equal(committed.unknown, drawn.unknown)
    assert committed.resolution == drawn.resolution
    assert committed.origin == drawn.origin


@pytest.mark.parametrize("name", NAMES)
def test_on_a_plan_the_robot_comes_within_half_a_metre_of_all(name):
    world = load_world(name)
    true, there = reached(FloorPlan.from_world(world), 0.28)
    given, found = reached(floor_plan_of(world), 0.28)
    points = true.centres()[there]
    share = found[given.index(points)].mean()
    assert share > 0.95
    far = ndimage.distance_transform_edt(~found) * given.cell
    assert far[given.index(points)].max() < 0.5


@pytest.mark.parametrize(
    ("name", "size"),
    [("small_house", 0.40), ("bookstore", 0.29), ("cafe", 0.49)],
)
def test_grid_sizes_are_those_of_an_independent_trial(name, size):
    grid = floor_plan_of(load_world(name)).grid(0.05, RADIUS)
    assert adaptive_grid_size(grid) == pytest.approx(size, abs=0.01)


@pytest.mark.parametrize("name", NAMES)
def test_a_plan_is_some_kilobytes(name):
    file = load_world(name).path.with_suffix(".png")
    assert file.stat().st_size < 8000
