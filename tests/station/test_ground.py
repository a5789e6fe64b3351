"""The ground under the robot: wherever it may start, in any world."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_mobarm.diagrams.station import build_station
from drake_mobarm.robot.shape import STOWED
from drake_mobarm.station import StationParameters
from drake_mobarm.world.sdf import load_world
from helpers.sdf import PLANE, collision, model, saved, world


def drive(loaded, start, seconds):
    """The station and its context after a drive ahead at 0.5 m/s."""
    station = build_station(loaded, list(start), StationParameters())
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    for port, value in (
        ("desired_arm_state", [*STOWED, *np.zeros(6)]),
        ("commanded_base_velocity", [0.5, 0.0]),
    ):
        station.GetInputPort(port).FixValue(context, value)
    simulator.AdvanceTo(seconds)
    return station, context


@pytest.mark.parametrize(
    "start", [(0.0, 0.0, 0.0), (150.0, 0.0, 2.0), (-9999.0, 9999.0, 1.0)]
)
def test_the_robot_drives_wherever_it_may_start(start):
    station, context = drive(load_world("empty"), start, 3.0)
    truth = station.GetOutputPort("ground_truth").Eval(context)
    moved = truth[:2] - start[:2]
    # It needs a moment to get up to speed.
    assert 1.2 < np.linalg.norm(moved) < 1.5
    ahead = [np.cos(start[2]), np.sin(start[2])]
    np.testing.assert_allclose(moved / np.linalg.norm(moved), ahead, atol=0.01)
    plant = station.GetSubsystemByName("plant")
    pose = plant.EvalBodyPoseInWorld(
        plant.GetMyContextFromRoot(context), plant.GetBodyByName("base")
    )
    assert abs(pose.translation()[2]) < 1e-3


def test_a_floor_that_is_not_at_zero_is_under_the_robot(tmp_path):
    # On a floor 3 m up, a wall whose face is 1.5 m ahead.
    text = world(
        model(collision(PLANE, "floor"), "floor", "0 0 3 0 0 0"),
        model(collision("<box><size>1 9 1</size></box>", pose="2 0 3.5 0 0 0")),
    )
    station, context = drive(load_world(saved(tmp_path, text)), (0, 0, 0), 6.0)
    ranges = station.GetOutputPort("lidar_ranges").Eval(context)
    x, *_, contact = station.GetOutputPort("ground_truth").Eval(context)
    assert contact == 1
    # It drove up to the wall, and its lidar sees it from there.
    assert x == pytest.approx(1.5 - 0.27, abs=0.01)
    assert np.min(ranges) == pytest.approx(0.27, abs=0.05)


CUBE = "".join(
    f"v {x} {y} {z}\n"
    for x in (-0.5, 0.5)
    for y in (-0.5, 0.5)
    for z in (-0.5, 0.5)
) + "".join(
    f"f {side}\n"
    for side in (
        "1 2 4 3",
        "5 7 8 6",
        "1 5 6 2",
        "3 4 8 7",
        "1 3 7 5",
        "2 6 8 4",
    )
)


@pytest.mark.parametrize(
    ("shape", "meshes"),
    [
        ("<sphere><radius>0.5</radius></sphere>", "refuse"),
        (
            "<capsule><radius>0.5</radius><length>1</length></capsule>",
            "refuse",
        ),
        ("<ellipsoid><radii>0.5 0.7 0.3</radii></ellipsoid>", "refuse"),
        (
            "<cylinder><radius>0.5</radius><length>1</length></cylinder>",
            "refuse",
        ),
        ("<mesh><uri>cube.obj</uri></mesh>", "boxes"),
        ("<mesh><uri>cube.obj</uri></mesh>", "hulls"),
    ],
)
def test_the_robot_touches_a_thing_where_its_lidar_sees_it(
    tmp_path, shape, meshes
):
    # Its widest part is at the height of the lidar, which is in the chassis.
    text = world(model(collision(shape, pose="2 0 0.2 0 0 0")))
    saved(tmp_path, CUBE, "cube.obj")
    loaded = load_world(saved(tmp_path, text), meshes)
    station, context = drive(loaded, (0, 0, 0), 6.0)
    ranges = station.GetOutputPort("lidar_ranges").Eval(context)
    x, *_, contact = station.GetOutputPort("ground_truth").Eval(context)
    assert contact == 1
    assert x == pytest.approx(1.5 - 0.27, abs=0.01)
    assert np.min(ranges) == pytest.approx(0.27, abs=0.05)
