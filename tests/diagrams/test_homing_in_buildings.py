"""Homing by a map, in contact: traps, overhangs, closed rooms, one limit."""

import numpy as np
import pytest

from drake_mobarm import load_scenario, run
from helpers.sdf import collision, model, world


def walls(x_low, y_low, x_high, y_high, name):
    """Four walls of 0.1 m about a room."""
    x, y = (x_low + x_high) / 2, (y_low + y_high) / 2
    wide, deep = x_high - x_low + 0.1, y_high - y_low + 0.1
    return "".join(
        collision(
            f"<box><size>{size_x} {size_y} 2</size></box>",
            f"{name}_{number}",
            f"{at_x} {at_y} 1 0 0 0",
        )
        for number, (at_x, at_y, size_x, size_y) in enumerate(
            (
                (x, y_low, wide, 0.1),
                (x, y_high, wide, 0.1),
                (x_low, y, 0.1, deep),
                (x_high, y, 0.1, deep),
            )
        )
    )


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_the_robot_leaves_the_corner_in_which_rules_go_round(yaw):
    scenario = load_scenario("homing", [f"start=[-7.5, 2, {yaw}]"])
    result = run(scenario, seed=2)
    assert result.success
    assert result.metrics["time_to_target_s"] < 45


def test_the_robot_remembers_the_seat_that_it_touched():
    # Behind a chair whose seat is above the lidar's plane.
    scenario = load_scenario(
        "homing", ["start=[-7.05, -2.65, 0]", "beacon=[-8.73, -4.92]"]
    )
    result = run(scenario, seed=3)
    assert result.success
    assert 1 <= result.metrics["contacts"] <= 4
    # The wheels slipped, and the estimate is still where the beacon is.
    assert result.metrics["goal_position_error_m"] < 0.1


def test_a_closed_room_is_given_up_with_the_place_of_its_wall(tmp_path):
    file = tmp_path / "closed.sdf"
    rooms = walls(-3, -3, 5, 3, "outer") + walls(1.5, -1, 3.5, 1, "inner")
    file.write_text(world(model(rooms)))
    scenario = load_scenario(
        "homing",
        [f"world={file}", "start=[-1, 0, 0]", "beacon=[2.5, 0]", "noise=1"],
    )
    result = run(scenario, seed=0)
    assert not result.success
    assert result.simulated_s < scenario.time_limit
    given_up, x, y = result.outputs["given_up"]
    assert given_up == 1
    # On the inner room's walls, 0.1 m thick.
    assert max(abs(x - 2.5), abs(y)) == pytest.approx(1.0, abs=0.2)
    assert result.reason == (
        f"gave up: no way on was found at [{x:.2f}, {y:.2f}]"
    )


@pytest.mark.parametrize("avoidance", ["none", "rules", "map"])
def test_the_robots_one_speed_limit_is_obeyed(avoidance):
    scenario = load_scenario(
        "homing",
        [
            "world=empty",
            "start=[0, 0, 0]",
            "beacon=[4, 1]",
            f"avoidance={avoidance}",
            "station.base_drive.speed_limit=[0.3, 0.5]",
            "time_limit=6",
        ],
    )
    trace = run(scenario, seed=0).trace
    commanded = np.abs(trace["commanded_base_velocity"]).max(axis=0)
    assert 0.299 < commanded[0] <= 0.3
    assert commanded[1] <= 0.5
    # The base overshoots its reference a little.
    assert np.abs(trace["ground_truth"][:, 3]).max() < 0.33
