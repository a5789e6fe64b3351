"""The planner's system: when it asks its law, and what it holds."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_mobarm.navigation.planner import Forces, PlannerState
from drake_mobarm.navigation.systems import NavigationPlanner
from drake_mobarm.sensors.lidar import LidarParameters

LIDAR = LidarParameters(rays=8)
DELAY = 0.005


class Told:
    """A law that is told what to answer, and counts what it is asked."""

    def __init__(self, **answer):
        self.answer = answer
        self.asked = []

    def initial_state(self):
        return PlannerState(memory=0)

    def update(self, state, pose_WB, p_WT, ranges):
        self.asked.append((pose_WB.copy(), p_WT.copy(), ranges.copy()))
        return replace(state, memory=state.memory + 1, **self.answer)

    def command(self, state, pose_WB):
        return 0.1 * state.memory, float(pose_WB[2])


def simulator_of(
    law, target=(4.0, 2.0, 1.0), pose=(1.0, 2.0, 0.3), limit=(9.0, 9.0)
):
    system = NavigationPlanner(law, LIDAR, DELAY, limit)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.GetInputPort("estimated_target").FixValue(context, target)
    system.GetInputPort("measured_base_pose").FixValue(context, pose)
    system.GetInputPort("lidar_ranges").FixValue(context, np.arange(1.0, 9.0))
    return simulator


def told(simulator, name):
    system = simulator.get_system()
    return system.GetOutputPort(name).Eval(simulator.get_context())


def test_the_law_is_asked_right_after_each_scan():
    law = Told()
    simulator = simulator_of(law)
    for time, count in ((0.004, 0), (0.006, 1), (0.104, 1), (0.106, 2)):
        simulator.AdvanceTo(time)
        assert len(law.asked) == count
    pose, target, ranges = law.asked[0]
    np.testing.assert_array_equal(pose, [1.0, 2.0, 0.3])
    np.testing.assert_array_equal(target, [4.0, 2.0])
    np.testing.assert_array_equal(ranges, np.arange(1.0, 9.0))


def test_the_velocity_follows_the_pose_between_scans():
    simulator = simulator_of(Told())
    simulator.AdvanceTo(0.05)
    np.testing.assert_allclose(
        told(simulator, "commanded_base_velocity"), [0.1, 0.3]
    )
    system, context = simulator.get_system(), simulator.get_mutable_context()
    port = system.GetInputPort("measured_base_pose")
    port.FixValue(context, [0.0, 0.0, -1.0])
    np.testing.assert_allclose(
        told(simulator, "commanded_base_velocity"), [0.1, -1.0]
    )


@pytest.mark.parametrize("yaw", [-3.0, 3.0])
def test_no_command_exceeds_the_robots_limits(yaw):
    simulator = simulator_of(Told(), pose=(0.0, 0.0, yaw), limit=(0.25, 2.0))
    simulator.AdvanceTo(0.55)  # The law would drive at 0.6 m/s by now.
    np.testing.assert_allclose(
        told(simulator, "commanded_base_velocity"), [0.25, np.sign(yaw) * 2.0]
    )


def test_a_target_that_was_lost_has_its_first_second_anew():
    simulator = simulator_of(Told(arrived=True))
    port = simulator.get_system().GetInputPort("estimated_target")
    simulator.AdvanceTo(0.95)
    port.FixValue(simulator.get_mutable_context(), [np.nan, np.nan, 0.0])
    simulator.AdvanceTo(1.05)
    port.FixValue(simulator.get_mutable_context(), [4.0, 2.0, 1.0])
    simulator.AdvanceTo(1.95)
    assert told(simulator, "arrived") == [0.0]
    simulator.AdvanceTo(2.25)
    assert told(simulator, "arrived") == [1.0]


def test_while_the_target_is_unknown_the_law_is_not_asked():
    law = Told(arrived=True)
    simulator = simulator_of(law, target=(np.nan, np.nan, 0.0))
    simulator.AdvanceTo(3.0)
    assert law.asked == []
    assert told(simulator, "arrived") == [0]
    assert told(simulator, "commanded_base_velocity")[0] == 0


def test_once_the_target_is_lost_the_robot_stands_until_it_is_known_again():
    law = Told()
    simulator = simulator_of(law)
    simulator.AdvanceTo(0.05)
    system, context = simulator.get_system(), simulator.get_mutable_context()
    port = system.GetInputPort("estimated_target")
    port.FixValue(context, [np.nan, np.nan, 0.0])
    np.testing.assert_array_equal(
        told(simulator, "commanded_base_velocity"), [0, 0]
    )
    simulator.AdvanceTo(0.15)
    assert len(law.asked) == 1
    port.FixValue(context, [4.0, 2.0, 1.0])
    simulator.AdvanceTo(0.25)
    # Asked twice: a tenth for each time.
    np.testing.assert_allclose(
        told(simulator, "commanded_base_velocity"), [0.2, 0.3]
    )


@pytest.mark.parametrize("value", [np.nan, -np.inf, -1.0, 0.0])
def test_a_range_that_is_none_is_missing_to_the_law(value):
    law = Told()
    simulator = simulator_of(law)
    system, context = simulator.get_system(), simulator.get_mutable_context()
    ranges = np.array([1.0, value, 3.0, np.inf, 5.0, 6.0, 7.0, 8.0])
    system.GetInputPort("lidar_ranges").FixValue(context, ranges)
    simulator.AdvanceTo(0.05)
    ranges[1] = np.nan
    np.testing.assert_array_equal(law.asked[0][2], ranges)


def test_in_the_first_second_of_a_known_target_nobody_has_arrived():
    simulator = simulator_of(Told(arrived=True), target=(0.0, 0.0, 0.0))
    simulator.AdvanceTo(2.0)
    # Known from now on.
    system, context = simulator.get_system(), simulator.get_mutable_context()
    system.GetInputPort("estimated_target").FixValue(context, [4, 2, 1])
    simulator.AdvanceTo(2.9)
    assert told(simulator, "arrived") == [0]
    simulator.AdvanceTo(3.2)
    assert told(simulator, "arrived") == [1]


def test_a_robot_that_has_arrived_stays_and_asks_no_more():
    law = Told(arrived=True)
    simulator = simulator_of(law)
    simulator.AdvanceTo(2.0)
    count = len(law.asked)
    # Ten scans in the first second, and one that counts.
    assert count == pytest.approx(11, abs=1)
    law.answer = {"arrived": False}
    simulator.AdvanceTo(4.0)
    assert len(law.asked) == count
    assert told(simulator, "arrived") == [1]


def test_what_shuts_the_way_is_told_and_stays_told():
    law = Told(shut=np.array([3.0, -1.0]))
    simulator = simulator_of(law)
    np.testing.assert_array_equal(told(simulator, "given_up"), [0, 0, 0])
    simulator.AdvanceTo(0.05)
    np.testing.assert_array_equal(told(simulator, "given_up"), [1, 3, -1])
    law.answer = {"shut": None}
    simulator.AdvanceTo(0.15)
    np.testing.assert_array_equal(told(simulator, "given_up"), [1, 3, -1])


def test_forces_and_ways_are_those_of_the_law():
    forces = Forces(*np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]))
    ways = (np.array([(0.0, 0.0), (1.0, 2.0)]), np.array([(3.0, 3.0)]))
    simulator = simulator_of(Told(forces=forces, paths=ways))
    assert told(simulator, "planned_paths") == ()
    simulator.AdvanceTo(0.05)
    np.testing.assert_array_equal(
        told(simulator, "navigation_forces"), [1, 2, 3, 4, 5, 6]
    )
    for found, way in zip(told(simulator, "planned_paths"), ways, strict=True):
        np.testing.assert_array_equal(found, way)
