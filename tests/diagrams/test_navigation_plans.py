"""Navigation by floor plans of all kinds, and what shuts a way."""

import numpy as np
import pytest

from drake_mobarm import load_scenario, run
from drake_mobarm.diagrams.navigation import (
    load_plan,
)
from drake_mobarm.exceptions import MobarmError, ScenarioError
from drake_mobarm.runtime.simulation import build_diagram
from drake_mobarm.world.floor_plan import FloorPlan
from drake_mobarm.world.floor_plan_files import write_floor_plan
from helpers import sdf

OPEN = ["world=empty", "start=[0, 0, 0]", "target=[2, 1]", "time_limit=12"]
KNOWN = "target_from=known"


def in_the_open(*overrides):
    return load_scenario("navigation", [*OPEN, *overrides])


def block(diagram, name):
    return diagram.GetSubsystemByName("job").GetSubsystemByName(name)


# Floor plans


def write_map(folder, *doors):
    """The path of a map: 6 m by 4 m, walls about it and across at x = 3 m.

    Args:
        folder: to write in.
        doors: the low and high y of each door in the wall across [m].
    """
    occupied = np.zeros((80, 120), dtype=bool)
    occupied[:2] = occupied[-2:] = True
    occupied[:, :2] = occupied[:, -2:] = True
    occupied[:, 60:62] = True
    for low, high in doors:
        # Row 0 is the image's top, at y = 4 m.
        occupied[80 - round(20 * high) : 80 - round(20 * low), 60:62] = False
    plan = FloorPlan(occupied, np.zeros_like(occupied), 0.05, (0.0, 0.0, 0.0))
    path = folder / "map.yaml"
    write_floor_plan(plan, path)
    return path


MAPPED = ["start=[1, 1, 0]", "target=[5, 1]", KNOWN, "time_limit=20"]


@pytest.mark.parametrize("planner", ["ours", "apf_hw"])
def test_a_map_alone_is_world_and_floor_plan(tmp_path, planner):
    path = write_map(tmp_path, (2.4, 3.6))
    result = run(
        load_scenario(
            "navigation", [*MAPPED, f"world={path}", f"planner={planner}"]
        ),
        seed=2,
    )
    assert result.success
    # Through the door: the highest place is between its posts.
    y = result.trace["ground_truth"][:, 1].max()
    assert 2.4 < y < 3.6
    # From (1, 1) to (3, 2.4), and down again to (5, 1), is 4.88 m at least.
    assert result.metrics["distance_travelled_m"] > 4.4


def test_a_map_is_the_floor_plan_of_another_world(tmp_path):
    # The world is empty: what keeps the robot from the straight way is the
    # plan alone.
    path = write_map(tmp_path, (2.4, 3.6))
    ways = {}
    for plan in ("none", path):
        scenario = load_scenario(
            "navigation", [*MAPPED, "world=empty", f"floor_plan={plan}"]
        )
        result = run(scenario, seed=2)
        assert result.success
        ways[plan] = result.trace["ground_truth"][:, 1].max()
    assert ways["none"] < 1.3
    assert 2.4 < ways[path] < 3.6


def test_plans_of_a_shipped_world_are_the_given_one_the_true_one_or_none():
    given, true, none = (
        load_plan(load_scenario("navigation", [f"floor_plan={plan}"]))
        for plan in ("given", "world", "none")
    )
    assert none is None
    # In the shipped plan loose things are missing.
    free = [
        np.count_nonzero(plan.free) * plan.resolution**2
        for plan in (given, true)
    ]
    assert free[0] > 20
    assert free[0] != pytest.approx(free[1], rel=0.001)


def test_a_highway_without_a_plan_is_refused_in_one_line():
    scenario = in_the_open("planner=apf_hw", "floor_plan=none")
    with pytest.raises(MobarmError) as caught:
        run(scenario)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("floor_plan is 'none'")
    assert "apf_hw" in message


def test_a_start_that_is_not_on_the_floor_plan_is_refused_in_one_line(tmp_path):
    # The map reaches from the origin to (6, 4).
    path = write_map(tmp_path, (2.4, 3.6))
    keys = ["world=empty", f"floor_plan={path}", "target=[5, 1]"]
    for start in ("[7, 1, 0]", "[1, -0.1, 0]"):
        scenario = load_scenario("navigation", [*keys, f"start={start}"])
        with pytest.raises(ScenarioError, match="is not on the floor") as error:
            build_diagram(scenario)
        assert "\n" not in str(error.value)
        assert str(path) in str(error.value)


@pytest.mark.parametrize("plan", ["map.yaml", "nowhere/map.yml"])
def test_a_plan_that_is_not_there_is_refused_in_one_line(plan):
    with pytest.raises(MobarmError, match=plan) as caught:
        run(in_the_open(f"floor_plan={plan}"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("planner", ["ours", "apf", "apf_escape"])
def test_the_other_planners_need_no_plan(planner):
    result = run(in_the_open(f"planner={planner}", "floor_plan=none", KNOWN))
    assert result.success


# What the verdict tells


def closet(folder, *, shut):
    """A house of 8 m by 5 m with a closet about (6, 2.5)."""
    walls = {
        "south wall": (4, 0, 8.2, 0.2),
        "north wall": (4, 5, 8.2, 0.2),
        "west wall": (0, 2.5, 0.2, 5.2),
        "east wall": (8, 2.5, 0.2, 5.2),
        "closet south": (6, 1.3, 2.2, 0.1),
        "closet north": (6, 3.7, 2.2, 0.1),
        "closet east": (7.1, 2.5, 0.1, 2.5),
    }
    if shut:
        walls["closet door"] = (4.9, 2.5, 0.1, 2.5)
    shapes = (
        sdf.collision(
            f"<box><size>{dx} {dy} 1</size></box>", name, f"{x} {y} 0.5 0 0 0"
        )
        for name, (x, y, dx, dy) in walls.items()
    )
    return sdf.saved(folder, sdf.world(sdf.model("".join(shapes))))


def test_what_shuts_the_room_of_the_target_is_named(tmp_path):
    scenario = load_scenario(
        "navigation",
        [
            f"world={closet(tmp_path, shut=True)}",
            "start=[2, 2.5, 0]",
            "target=[6, 2.5]",
            KNOWN,
        ],
    )
    result = run(scenario, seed=1)
    assert not result.success
    assert result.simulated_s < 60
    assert "gave up: the way is shut by" in result.reason
    assert "closet" in result.reason


def test_the_open_closet_is_entered(tmp_path):
    scenario = load_scenario(
        "navigation",
        [
            f"world={closet(tmp_path, shut=False)}",
            "start=[2, 1, 0]",
            "target=[6, 2.5]",
            KNOWN,
            "time_limit=20",
        ],
    )
    result = run(scenario, seed=1)
    assert result.success
    assert result.metrics["contacts"] == 0


def test_where_only_the_plan_pinches_the_robot_it_goes_on_without_the_plan():
    # Among chairs that are larger on the plan than they are.
    scenario = load_scenario(
        "navigation",
        [
            "world=bookstore",
            "start=[-0.4005, 4.5555, 1.8791937885060461]",
            "target=[-4.4005, 2.8555]",
            "time_limit=30",
        ],
    )
    result = run(scenario, seed=160418374)
    assert result.success
    assert result.metrics["contacts"] == 0
