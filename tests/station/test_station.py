"""The station in Drake: it stands, drives, touches, senses."""

from itertools import pairwise

import numpy as np
import pytest
from pydrake.common import RandomGenerator
from pydrake.systems.analysis import Simulator

from drake_mobarm.diagrams.station import build_station
from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot.shape import ANTENNA_POSITION, STOWED
from drake_mobarm.sensors.beacon import Beacon, BeaconParameters
from drake_mobarm.sensors.rssi import BEACONS
from drake_mobarm.signals import GroundTruth
from drake_mobarm.station.ground_truth import BaseTruth
from drake_mobarm.station.parameters import StationParameters
from drake_mobarm.world.sdf import load_world


class Driven:
    """A station with its inputs in hand."""

    def __init__(
        self,
        world="empty",
        start=(0.0, 0.0, 0.0),
        beacon=(3.0, 1.0),
        seed=1,
        parameters=None,
    ):
        self.station = build_station(
            load_world(world),
            list(start),
            StationParameters(**(parameters or {})),
            Beacon(position=list(beacon), noise=5),
        )
        self.simulator = Simulator(self.station)
        self.context = self.simulator.get_mutable_context()
        self.station.SetRandomContext(self.context, RandomGenerator(seed))
        self.arm(STOWED)
        self.drive(0, 0, 0)

    def arm(self, q):
        port = self.station.GetInputPort("desired_arm_state")
        port.FixValue(self.context, [*q, *np.zeros(6)])

    def drive(self, v, w, seconds):
        port = self.station.GetInputPort("commanded_base_velocity")
        port.FixValue(self.context, [v, w])
        self.simulator.AdvanceTo(self.context.get_time() + seconds)
        return self

    def read(self, name):
        return self.station.GetOutputPort(name).Eval(self.context).copy()

    @property
    def truth(self):
        return GroundTruth(self.read("ground_truth"))


def test_it_stands_still_for_a_minute():
    driven = Driven().drive(0, 0, 60.0)
    truth = driven.truth
    assert np.hypot(truth.x, truth.y) < 1e-3
    assert abs(truth.yaw) < 1e-4
    # Without drift: nothing moves in the second half minute.
    settled = driven.read("ground_truth")[:3]
    driven.drive(0, 0, 30.0)
    np.testing.assert_allclose(
        driven.read("ground_truth")[:3], settled, atol=1e-5
    )
    arm = driven.read("measured_arm_state")
    np.testing.assert_allclose(arm[:6], STOWED, atol=1e-3)
    np.testing.assert_allclose(arm[6:], 0, atol=1e-4)


def test_it_reaches_the_commanded_velocity_and_keeps_it():
    truth = Driven().drive(0.6, 0.8, 2.0).truth
    assert truth.v == pytest.approx(0.6, abs=0.01)
    assert truth.w == pytest.approx(0.8, abs=0.01)


def test_it_speeds_up_and_brakes_at_its_limit():
    driven = Driven().drive(1.0, 0, 0.5)
    # 1 m/s^2 is beyond the wheels' 10 rad/s^2 * 0.0985 m = 0.985 m/s^2.
    assert driven.truth.v == pytest.approx(0.985 * 0.5, abs=0.03)
    driven.drive(1.0, 0, 1.5)
    here = driven.truth.x
    driven.drive(0.0, 0, 2.0)
    assert driven.truth.x - here == pytest.approx(1.0 / (2 * 0.985), abs=0.03)
    assert driven.truth.v == pytest.approx(0, abs=1e-3)


def test_no_wheel_turns_faster_than_its_limit():
    driven = Driven().drive(5.0, 9.0, 3.0)
    speeds = driven.read("measured_wheel_state")[2:]
    assert np.abs(speeds).max() <= 10.15 * 1.01
    assert np.abs(speeds).max() >= 10.15 * 0.97


def test_odometry_drifts_by_no_more_than_2_mm_a_metre_where_wheels_roll():
    driven = Driven(start=(1.0, -2.0, 0.5))
    for v, w, seconds in ((0.8, 0.3, 3.0), (0, 1.5, 1.0), (1.0, -0.2, 3.0)):
        driven.drive(v, w, seconds)
    driven.drive(0, 0, 1.5)
    odometry = driven.read("measured_base_pose")
    truth = driven.read("ground_truth")[:3]
    # 6 m of way in curves at the acceleration limit.
    np.testing.assert_allclose(odometry[:2], truth[:2], atol=0.012)
    assert np.hypot(*(truth[:2] - [1.0, -2.0])) > 2.0


def drift_at_a_wall(localization):
    """Of the measured pose, after the wheels have slipped [m, m, rad]."""
    # Into the house's east wall at x = 9.3: the wheels can still turn.
    driven = Driven(
        "small_house",
        start=(8.2, 2.3, 0.0),
        beacon=(7, 2.3),
        parameters={"localization": localization},
    )
    driven.drive(1.0, 0.5, 6.0)
    assert driven.truth.contacts >= 1
    error = driven.read("measured_base_pose") - driven.read("ground_truth")[:3]
    return np.abs(error).max()


def test_odometry_drifts_where_wheels_slip():
    assert drift_at_a_wall("odometry") > 0.05


def test_scan_matching_holds_the_pose_where_wheels_slip():
    assert drift_at_a_wall("scan_matching") < 0.04


def test_ground_under_the_wheels_is_no_contact():
    assert Driven().drive(1.0, 0.5, 2.0).truth.contacts == 0


def test_one_touch_counts_once_however_long_it_lasts():
    driven = Driven("small_house", start=(8.2, 2.3, 0.0), beacon=(7, 2.3))
    truth = driven.drive(0.3, 0.0, 6.0).truth
    assert truth.contacts == 1
    assert truth.touching == 1
    truth = driven.drive(-0.3, 0.0, 2.0).truth
    assert truth.touching == 0
    truth = driven.drive(0.3, 0.0, 3.0).truth
    assert truth.contacts == 2


def test_the_arm_moves_within_its_limits_and_arrives():
    driven = Driven()
    goal = np.array([0.8, -0.8, 0.6, 0.4, 0.6, -0.7])
    driven.arm(goal)
    fastest = np.zeros(6)
    before = np.zeros(6)
    hardest = np.zeros(6)
    for _ in range(30):
        driven.drive(0, 0, 0.1)
        speed = driven.read("measured_arm_state")[6:]
        hardest = np.maximum(hardest, np.abs(speed - before) / 0.1)
        fastest = np.maximum(fastest, np.abs(speed))
        before = speed
    assert (fastest < np.pi).all()
    # 5 rad/s^2, but for what the base gives way.
    assert 4.0 < hardest.max() < 5.8
    np.testing.assert_allclose(
        driven.read("measured_arm_state")[:6], goal, atol=5e-3
    )


def test_driving_hardly_swings_the_arm():
    driven = Driven()
    swing = 0.0
    for _ in range(30):
        driven.drive(1.0, 1.0, 0.05)
        q = driven.read("measured_arm_state")[:6]
        swing = max(swing, np.abs(q - STOWED).max())
    assert swing < 0.02


def test_the_stretched_arm_is_held_against_gravity():
    driven = Driven()
    stretched = np.radians([0, 78.745, -78.745, 0, 0, 0])
    driven.arm(stretched)
    driven.drive(0, 0, 6.0)
    np.testing.assert_allclose(
        driven.read("measured_arm_state")[:6], stretched, atol=5e-3
    )
    truth = driven.truth
    assert np.hypot(truth.x, truth.y) < 5e-3  # And does not tip the base.


def test_a_broken_command_halts_the_base():
    driven = Driven().drive(0.5, 0.0, 1.0).drive(np.nan, 0.0, 1.5)
    assert driven.truth.v == pytest.approx(0, abs=1e-3)


def test_a_broken_arm_command_holds_the_arm():
    driven = Driven()
    driven.arm([np.nan] * 6)
    driven.drive(0, 0, 1.0)
    np.testing.assert_allclose(
        driven.read("measured_arm_state")[:6], STOWED, atol=1e-3
    )


def test_the_beacon_is_read_from_the_antenna():
    # Standing at (1, 2), looking along y: the antenna is at (1, 2.2).
    driven = Driven(start=(1.0, 2.0, np.pi / 2), beacon=(4.0, 2.2))
    readings = []
    for _ in range(400):
        driven.drive(0, 0, 0.05)
        readings.append(driven.read("beacon_reading"))
    angle, rssi, valid = np.array(readings[2:]).T
    assert (valid == 1).all()
    assert np.abs(angle + np.pi / 2).max() < np.radians(20.5)
    assert angle.mean() == pytest.approx(-np.pi / 2, abs=0.03)
    distance = BEACONS["beacon_1"].distance(rssi)
    assert distance.mean() == pytest.approx(3.0, abs=0.14)
    # Uniform within +-(1 m + 20 % of 3 m).
    assert distance.std() == pytest.approx(1.6 / np.sqrt(3), rel=0.1)
    assert np.abs(distance - 3.0).max() < 1.65
    assert ANTENNA_POSITION == (0.2, 0.0)


def hears(place, **antenna):
    driven = Driven(
        beacon=place, parameters={"beacon": BeaconParameters(**antenna)}
    )
    return driven.drive(0, 0, 0.2).read("beacon_reading")


def test_outside_its_field_of_view_the_antenna_hears_nothing():
    assert hears((-2.0, 0.5))[2] == 1
    assert hears((2.0, 0.5), field_of_view=np.pi)[2] == 1
    angle, rssi, valid = hears((-2.0, 0.5), field_of_view=np.pi)
    assert valid == 0
    assert np.isnan([angle, rssi]).all()


def test_in_an_outage_the_antenna_hears_nothing():
    assert hears((2.0, 0.5), outages=[[0.0, 1.0]])[2] == 0
    assert hears((2.0, 0.5), outages=[[1.0, 2.0]])[2] == 1


def test_dropout_loses_that_share_of_readings():
    driven = Driven(parameters={"beacon": BeaconParameters(dropout=0.3)})
    valid = []
    for _ in range(600):
        driven.drive(0, 0, 0.05)
        valid.append(driven.read("beacon_reading")[2])
    # Three standard deviations of a share of 600.
    assert np.mean(valid) == pytest.approx(0.7, abs=0.056)


def test_the_lidar_sees_the_rooms_walls():
    driven = Driven("small_house", start=(8.2, 2.3, 0.0), beacon=(7, 2.3))
    ranges = driven.drive(0, 0, 0.3).read("lidar_ranges")
    # Straight ahead the kitchen's east wall, whose face is at x = 9.3.
    assert ranges[180] == pytest.approx(9.3 - 8.2, abs=0.05)
    assert ranges.shape == (360,)


def test_noise_differs_between_seeds_only():
    def ranges(seed):
        return (
            Driven("small_house", (8.2, 2.3, 0.0), (7, 2.3), seed)
            .drive(0, 0, 0.3)
            .read("lidar_ranges")
        )

    np.testing.assert_array_equal(ranges(1), ranges(1))
    assert np.abs(ranges(1) - ranges(2)).max() > 0.005


def test_the_arm_ports_elements_are_named_by_its_joints():
    assert len(ARM_JOINTS) == 6
    assert ARM_JOINTS[0] == "waist"
    assert ARM_JOINTS[-1] == "wrist_rotate"


def test_the_true_pose_does_not_depend_on_the_quaternions_length():
    system = BaseTruth(29)
    context = system.CreateDefaultContext()
    turn = np.array([np.cos(0.6), 0.0, 0.0, np.sin(0.6)])
    for length in (0.9, 1.0, 1.1):
        state = np.zeros(29)
        state[:7] = [*(length * turn), 1.0, 2.0, 0.0]
        system.get_input_port().FixValue(context, state)
        pose = system.GetOutputPort("base_pose").Eval(context)
        np.testing.assert_allclose(pose, [1.0, 2.0, 1.2], atol=1e-12)


@pytest.mark.parametrize("face", [0.285, 0.31])
def test_robot_passes_a_wall_that_its_disc_does_not_reach(tmp_path, face):
    path = tmp_path / "wall.sdf"
    # Beside the disc of 0.27 m, along the whole way.
    path.write_text(
        '<sdf version="1.9"><model name="m"><static>true</static>'
        '<link name="l"><collision name="wall">'
        f"<pose>0 {face + 0.5} 0.5 0 0 0</pose>"
        "<geometry><box><size>8 1 1</size></box></geometry>"
        "</collision></link></model></sdf>"
    )
    truth = Driven(str(path)).drive(0.5, 0, 2.0).truth
    # 2 s at 0.5 m/s, less the 0.13 m of speeding up at 0.985 m/s^2.
    assert truth.x == pytest.approx(0.87, abs=0.03)
    assert truth.y == pytest.approx(0, abs=0.01)
    assert truth.yaw == pytest.approx(0, abs=0.02)


def test_lidar_noise_is_standard_normal_and_drawn_anew_for_each_scan():
    driven = Driven()
    source = driven.station.GetSubsystemByName("lidar_noise")
    context = source.GetMyContextFromRoot(driven.context)
    scans = []
    for _ in range(20):  # At 10 Hz.
        driven.drive(0, 0, 0.1)
        scans.append(source.get_output_port().Eval(context).copy())
    noise = np.array(scans)
    assert noise.shape == (20, 360)
    assert all((a != b).all() for a, b in pairwise(scans))
    # Of 7200 numbers: within four deviations of what is expected.
    assert abs(noise.mean()) < 4 / 7200**0.5
    assert noise.std() == pytest.approx(1, abs=4 / 14400**0.5)
    # 4.55 % of them are beyond two standard deviations.
    beyond = (np.abs(noise) > 2).mean()
    assert beyond == pytest.approx(0.0455, abs=4 * (0.0455 / 7200) ** 0.5)
