"""Localization on a floor plan along drives in a room, and as a system."""

import math

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_mobarm.sensors.lidar import LidarParameters
from drake_mobarm.sensors.localization import (
    LocalizationParameters,
    LocalizationState,
    begin,
    localize,
    predict,
)
from drake_mobarm.sensors.scan_matching import compose, inverse
from drake_mobarm.sensors.systems import FloorPlanLocalization
from helpers.localizing import (
    FIELD,
    PARAMETERS,
    RANGE_MAX,
    ROOM,
    START,
    assert_near,
    drive,
    estimated,
    localized,
    plan,
    seen,
)
from helpers.refusals import assert_refused
from helpers.shapes import rectangle

# In the room


@pytest.mark.parametrize("errors", [(0.01, 0.01), (0.01, -0.01), (-0.01, 0.01)])
def test_wrong_wheels_do_not_matter_on_a_plan(errors):
    true, told = drive(60, *errors)
    poses, state = localized(true, told)
    assert_near(poses, true, 0.01, math.radians(0.3))
    # It is known, and not better than it is.
    assert 0.001 < math.sqrt(state.covariance[0, 0]) < 0.01


def test_sides_between_cell_centres_put_it_off_by_less_than_a_cell():
    shifted = [np.add(outline, (0.013, 0.021)) for outline in ROOM]
    true, told = drive(60)
    true, told = (np.add(x, (0.013, 0.021, 0)) for x in (true, told))
    poses, _ = localized(true, told, shifted, plan([*shifted, ROOM[0] - 0.5]))
    assert_near(poses, true, 0.03, math.radians(0.5))


def test_things_that_are_not_mapped_do_not_pull():
    true, told = drive(60)
    loose = [
        rectangle(-2.9, 0.5, -2.5, 1.2),
        rectangle(-1.6, 1.5, -0.7, 1.85),
        rectangle(1.8, -1.8, 2.6, -1.5),
        rectangle(-2.0, -1.9, -1.7, -1.6),
        rectangle(2.6, 0.0, 2.9, 0.6),
    ]
    poses, _ = localized(true, told, [*ROOM, *loose])
    assert_near(poses, true, 0.015, math.radians(0.4))


def test_legs_inside_of_a_solid_table_do_not_pull():
    true, told = drive(60)
    legs = [
        rectangle(x, y, x + 0.05, y + 0.05)
        for x in (-2.7, -2.05)
        for y in (0.6, 1.25)
    ]
    table = rectangle(-2.8, 0.5, -1.9, 1.4)
    poses, _ = localized(true, told, [*ROOM, *legs], plan([*ROOM, table]))
    assert_near(poses, true, 0.01, math.radians(0.3))


def test_a_box_before_the_lidar_does_not_matter():
    true, told = drive(60)

    def blocked(ranges):
        ranges = ranges.copy()
        ranges[110:250] = np.minimum(ranges[110:250], 0.4)
        return ranges

    poses, _ = localized(true, told, change=blocked)
    assert_near(poses, true, 0.015, math.radians(0.5))


def test_missing_rays_do_not_matter():
    true, told = drive(60)
    rng = np.random.default_rng(7)

    def holed(ranges):
        missing = rng.uniform(size=ranges.size) < 0.7
        return np.where(missing, math.nan, ranges)

    poses, _ = localized(true, told, change=holed)
    assert_near(poses, true, 0.01, math.radians(0.3))


@pytest.mark.parametrize(
    "slip",
    [(0.0, 0.0, 0.15), (0.0, 0.0, -0.05), (0.05, 0.0, 0.0), (0.1, 0.0, 0.0)],
)
def test_wheels_that_slip_on_the_spot_move_nothing_for_long(slip):
    told = [START]
    for _ in range(20):
        told.append(compose(told[-1], slip))
    told += [told[-1]] * 10
    true = np.tile(START, (31, 1))
    poses, _ = localized(true, told)
    # While it slips the deviation is a few scans' at most.
    assert_near(poses, true, 0.15, 0.05)
    assert_near(poses[25:], true[25:], 0.005, 0.003)


def test_a_jump_of_odometry_is_taken_back_at_once():
    true, told = drive(10)
    told[50:] = [compose((0.5, -0.3, 0.4), pose) for pose in told[50:]]
    poses, _ = localized(true, told)
    assert_near(poses, true, 0.01, math.radians(0.3))


def test_a_start_that_is_off_is_found():
    true, _ = drive(10, 0.0, 0.0)
    told = [compose((0.25, -0.2, 0.05), pose) for pose in true]
    poses, _ = localized(true, told)
    assert_near(poses[1:], true[1:], 0.01, math.radians(0.3))


def test_odometrys_frame_does_not_matter():
    true, told = drive(20)
    poses, _ = localized(true, told)
    frame = (3.0, -2.0, 2.0)
    state = LocalizationState(
        np.eye(3) * PARAMETERS.start_deviation**2, correction=frame
    )
    rng = np.random.default_rng(0)
    for pose, odometry, expected in zip(true, told, poses, strict=True):
        moved = compose(inverse(frame), odometry)
        state = localize(
            state, moved, seen(pose, rng), RANGE_MAX, FIELD, PARAMETERS
        )
        np.testing.assert_allclose(estimated(state, moved), expected, atol=1e-6)


# As a system


def test_the_system_tells_what_the_law_finds_and_composes_it_with_odometry():
    lidar = LidarParameters()
    parameters = LocalizationParameters(start_deviation=0.5)
    system = FloorPlanLocalization(parameters, lidar, FIELD, 0.005)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    told, ranges = compose((0.05, -0.04, 0.02), START), seen(START)
    system.GetInputPort("odometry_pose").FixValue(context, told)
    system.GetInputPort("lidar_ranges").FixValue(context, ranges)
    pose = system.GetOutputPort("measured_base_pose")
    covariance = system.GetOutputPort("pose_covariance")
    simulator.AdvanceTo(0.004)
    np.testing.assert_array_equal(pose.Eval(context), told)
    np.testing.assert_array_equal(
        covariance.Eval(context), (0.5**2 * np.eye(3)).ravel()
    )
    # At 5 ms it works on the scan of 0 s.
    simulator.AdvanceTo(0.006)
    state = localize(
        begin(parameters), told, ranges, RANGE_MAX, FIELD, parameters
    )
    np.testing.assert_allclose(pose.Eval(context), START, atol=0.005)
    np.testing.assert_array_equal(pose.Eval(context), estimated(state, told))
    # Then odometry moves on: 0.2 m straight ahead.
    moved = compose(told, (0.2, 0.0, 0.0))
    system.GetInputPort("odometry_pose").FixValue(context, moved)
    np.testing.assert_allclose(
        pose.Eval(context), compose(START, (0.2, 0.0, 0.0)), atol=0.005
    )
    np.testing.assert_array_equal(
        covariance.Eval(context).reshape(3, 3),
        predict(state, moved, parameters).covariance,
    )


# What it refuses to believe


def test_too_few_rays_change_nothing_but_the_covariance():
    state = localize(
        begin(PARAMETERS), START, seen(START), RANGE_MAX, FIELD, PARAMETERS
    )
    odometry = compose(START, (0.03, 0.0, 0.0))
    for fitting in (10, PARAMETERS.least_rays - 1):
        ranges = np.full(360, math.nan)
        ranges[::6][:fitting] = seen(START)[::6][:fitting]
        after = localize(state, odometry, ranges, RANGE_MAX, FIELD, PARAMETERS)
        assert after.correction == state.correction
        np.testing.assert_array_equal(
            after.covariance, predict(state, odometry, PARAMETERS).covariance
        )


def test_a_scan_of_another_place_is_not_believed():
    true, told = drive(5)
    _, state = localized(true, told)
    # A round room of 0.9 m about the robot: hardly any ray fits the plan.
    ranges = np.full(360, 0.9)
    after = localize(state, told[-1], ranges, RANGE_MAX, FIELD, PARAMETERS)
    assert after.correction == state.correction


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e300])
def test_a_pose_that_cannot_be_changes_nothing(bad):
    state = begin(PARAMETERS)
    after = localize(
        state, (bad, 0.0, 0.0), seen(START), RANGE_MAX, FIELD, PARAMETERS
    )
    assert after is state


@pytest.mark.parametrize("spike", [1.0, 50.0, 1e6])
def test_after_a_spike_of_odometry_it_is_found_again(spike):
    true, told = drive(10)
    told[40] += (spike, -spike, 1.0)
    poses, state = localized(true, told)
    assert_near(poses[45:], true[45:], 0.01, math.radians(0.3))
    assert np.isfinite(state.covariance).all()


@pytest.mark.parametrize(
    ("field", "value"),
    [
        *((name, 0.0) for name in vars(PARAMETERS) if name != "least_rays"),
        *((name, math.nan) for name in vars(PARAMETERS)),
        ("least_rays", 0),
        ("least_share", 1.1),
    ],
)
def test_parameters_out_of_their_range_are_refused(field, value):
    assert_refused(field, LocalizationParameters, **{field: value})
