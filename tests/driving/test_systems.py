"""The controller of waypoints as a system: its modes, by hand."""

import math

import pytest

from drake_mobarm.driving.systems import WaypointController
from drake_mobarm.driving.waypoint import ControllerParameters

PARAMETERS = ControllerParameters(search_turn_rate=0.7)


def command(waypoint, arrived=0.0, pose=(1.0, 2.0, 0.0)):
    controller = WaypointController(PARAMETERS, (1.0, 2.0))
    context = controller.CreateDefaultContext()
    for name, value in (
        ("measured_base_pose", pose),
        ("waypoint", waypoint),
        ("arrived", [arrived]),
    ):
        controller.GetInputPort(name).FixValue(context, value)
    port = controller.GetOutputPort("commanded_base_velocity")
    return port.Eval(context).tolist()


@pytest.mark.parametrize("yaw", [0.0, 2.0, -3.0])
def test_a_negative_limit_drives_straight_back_at_that_speed(yaw):
    assert command([5.0, 2.0, -0.2], pose=(1.0, 2.0, yaw)) == [-0.2, 0.0]


@pytest.mark.parametrize("limit", [0.0, 0.4, math.inf])
def test_without_a_waypoint_the_robot_turns_to_search(limit):
    assert command([math.nan, math.nan, limit]) == [0.0, 0.7]


def test_a_waypoint_ahead_is_driven_to_within_its_limit():
    assert command([5.0, 2.0, math.inf]) == [1.0, 0.0]
    assert command([5.0, 2.0, 0.3]) == [0.3, 0.0]
    assert command([5.0, 2.0, 0.0]) == [0.0, 0.0]


@pytest.mark.parametrize("limit", [0.4, -0.2, math.nan])
def test_a_robot_that_has_arrived_halts_whatever_the_waypoint(limit):
    assert command([5.0, 2.0, limit], arrived=1.0) == [0.0, 0.0]
    assert command([math.nan, math.nan, limit], arrived=1.0) == [0.0, 0.0]
