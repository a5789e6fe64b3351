"""Localization on a floor plan: by hand, by Monte Carlo, and in a room."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.systems.analysis import Simulator

from drake_mobarm.geometry import rotation, transform_points
from drake_mobarm.robot.differential_drive import DifferentialDrive
from drake_mobarm.sensors.distance_field import DistanceField
from drake_mobarm.sensors.lidar import LidarParameters, cast_rays
from drake_mobarm.sensors.localization import (
    LocalizationParameters,
    LocalizationState,
    Scan,
    begin,
    fit,
    localize,
    predict,
    read_scan,
    residuals,
)
from drake_mobarm.sensors.odometry import integrate_wheels
from drake_mobarm.sensors.scan_matching import compose, inverse
from drake_mobarm.sensors.systems import FloorPlanLocalization
from drake_mobarm.world.obstacles import outlines_to_segments
from drake_mobarm.world.occupancy import OccupancyGrid
from helpers.refusals import assert_refused
from helpers.shapes import rectangle, turned

PARAMETERS = LocalizationParameters()
RANGE_MAX = 12.0
START = (0.5, 0.3, 0.4)
# A room of 6 m by 4 m with a cupboard and a pillar. All sides are on the
# centres of cells of 5 cm, so that the plan has no error.
ROOM = [
    rectangle(-3.2, -2.2, 3.2, -2.0),
    rectangle(-3.2, 2.0, 3.2, 2.2),
    rectangle(-3.2, -2.2, -3.0, 2.2),
    rectangle(3.0, -2.2, 3.2, 2.2),
    rectangle(1.5, 1.2, 2.5, 2.0),
    rectangle(-1.5, -0.9, -1.2, -0.6),
]


def plan(outlines, cell=0.05):
    """The field of a plan that shows outlines."""
    grid = OccupancyGrid.from_outlines(outlines, cell)
    return DistanceField.from_points(grid.centres()[grid.occupied], cell)


FIELD = plan(ROOM)
NOTHING = DistanceField.from_points(np.empty((0, 2)), 0.05)


def seen(pose, rng=None, outlines=ROOM, rays=360):
    ranges = cast_rays(*outlines_to_segments(outlines), pose, rays)
    if rng is not None:
        ranges = ranges + rng.normal(0, 0.01, rays)
    return np.minimum(ranges, RANGE_MAX)


def estimated(state, odometry):
    return np.array(compose(state.correction, odometry))


def localized(true, odometry, outlines=ROOM, field=FIELD, change=None):
    """Estimated poses and the last state along a drive."""
    rng = np.random.default_rng(0)
    state, poses = begin(PARAMETERS), []
    for pose, told in zip(true, odometry, strict=True):
        ranges = seen(pose, rng, outlines)
        if change is not None:
            ranges = change(ranges)
        state = localize(state, told, ranges, RANGE_MAX, field, PARAMETERS)
        poses.append(estimated(state, told))
    return np.array(poses), state


def assert_near(poses, true, position, yaw):
    """Poses are as near to the true ones as said [m, rad]."""
    off = np.asarray(poses) - np.asarray(true)
    assert np.hypot(*off[:, :2].T).max() < position
    assert np.abs(off[:, 2]).max() < yaw


def drive(seconds, radius=0.01, track=-0.01):
    """True poses round the room, and odometry with such relative errors."""
    base = DifferentialDrive()
    believed = DifferentialDrive(
        wheel_radius=base.wheel_radius * (1 + radius),
        track=base.track * (1 + track),
    )
    true, told = [START], [START]
    for step in range(int(10 * seconds)):
        # To and fro, a loop of 0.7 m radius, then one the other way round.
        w = 0.4 if step // 157 % 2 else -0.4
        turn = [0.1 * speed for speed in base.wheel_speeds(0.28, w)]
        true.append(integrate_wheels(true[-1], turn, base))
        told.append(integrate_wheels(told[-1], turn, believed))
    return np.array(true), np.array(told)


# Residuals


@given(
    st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3), st.integers(0, 10**6)
)
def test_derivatives_are_those_of_the_distances(x, y, yaw, seed):
    points = np.random.default_rng(seed).uniform(-1.5, 1.5, (8, 2))
    scan = Scan(points, np.zeros((8, 2)), np.ones(8))
    step, pose = 1e-6, np.array([x, y, yaw])
    _, derivatives = residuals(FIELD, scan, pose)
    node = (transform_points(pose, points) / 0.025) % 1
    inner = (np.abs(node - 0.5) < 0.49).all(axis=1)
    for axis, move in enumerate(step * np.eye(3)):
        after, _ = residuals(FIELD, scan, pose + move)
        before, _ = residuals(FIELD, scan, pose - move)
        np.testing.assert_allclose(
            derivatives[inner, axis],
            (after - before)[inner] / (2 * step),
            atol=1e-5,
        )


def test_along_a_slanting_wall_the_distance_counts_as_constant():
    angle = 0.3
    wall = turned(rectangle(-6, 1.0, 6, 1.2), angle)
    ranges = seen((0.0, 0.0, 0.0), outlines=[wall])
    field = plan([wall])
    scan = read_scan(ranges, RANGE_MAX, field, PARAMETERS)
    _, derivatives = residuals(field, scan, (0.0, 0.0, 0.0))
    along = derivatives[:, :2] @ rotation(angle)[:, 0]
    # But at the ends of the wall, where the next ray meets nothing.
    assert np.mean(np.abs(along) < 1e-6) > 0.9
    across = derivatives[:, :2] @ rotation(angle)[:, 1]
    assert np.median(across) == pytest.approx(-1, abs=0.1)


def test_rays_without_a_return_and_on_the_robot_are_left_out():
    ranges = np.full(360, 2.0)
    ranges[:6] = math.nan, math.inf, -1.0, 0.1, RANGE_MAX, 1e300
    scan = read_scan(ranges, RANGE_MAX, FIELD, PARAMETERS)
    assert len(scan.points) == 354
    np.testing.assert_allclose(np.hypot(*scan.points.T), 2.0)


def test_rays_that_meet_the_same_stretch_share_its_variance():
    # 360 rays at 2 m are 3.49 cm apart: 57.3 of them share 2 m of surface,
    # whose place has the variance of a cell, 0.05^2 / 12.
    ranges = np.full(360, 2.0)
    scan = read_scan(ranges, RANGE_MAX, FIELD, PARAMETERS)
    expected = 0.01**2 + 57.2958 * 0.05**2 / 12
    np.testing.assert_allclose(scan.variance, expected, rtol=1e-5)


# Fit and covariance


def corner_scan(noise=0.0, rng=None):
    """20 points on a wall at x = 2, and 30 on one at y = 2, seen from 0."""
    x_wall = np.column_stack([np.full(20, 2.0), np.linspace(-1, 1, 20)])
    y_wall = np.column_stack([np.linspace(-1.5, 1, 30), np.full(30, 2.0)])
    points = np.vstack([x_wall, y_wall])
    if rng is not None:
        points = points + rng.normal(0, noise, points.shape)
    return Scan(points, np.zeros_like(points), np.full(50, 0.02**2))


CORNER = plan([rectangle(2.0, -4, 2.2, 4), rectangle(-4, 2.0, 4, 2.2)])
NO_PRIOR = 1e-9 * np.eye(3)


def textbook_covariance():
    """Of x, y and yaw from distances to the two walls of a corner."""
    # A turn by a moves a point (p, q) by a (-q, p): the wall at x = 2 comes
    # nearer by x - a q, that at y = 2 by y + a p.
    q, p = np.linspace(-1, 1, 20), np.linspace(-1.5, 1, 30)
    rows = [[1, 0, -value] for value in q] + [[0, 1, value] for value in p]
    design = np.array(rows)
    return 0.02**2 * np.linalg.inv(design.T @ design)


def test_the_covariance_in_a_corner_is_the_textbooks():
    found = fit(CORNER, corner_scan(), (0.0, 0.0, 0.0), NO_PRIOR, [0.5] * 10)
    np.testing.assert_allclose(found.pose, 0, atol=1e-6)
    np.testing.assert_allclose(
        np.linalg.inv(found.information),
        textbook_covariance(),
        rtol=1e-4,
        atol=1e-12,
    )


def test_estimates_scatter_as_the_covariance_says():
    rng = np.random.default_rng(1)
    poses = np.array(
        [
            fit(
                CORNER,
                corner_scan(0.02, rng),
                (0.0, 0.0, 0.0),
                NO_PRIOR,
                # So large that all points weigh the same.
                [50.0] * 10,
            ).pose
            for _ in range(600)
        ]
    )
    expected = textbook_covariance()
    # 600 draws give a variance to 6 %: four of these.
    np.testing.assert_allclose(
        poses.var(axis=0), np.diag(expected), rtol=4 * math.sqrt(2 / 600)
    )
    # The mean, to a 24th of a deviation: five of these.
    np.testing.assert_allclose(
        poses.mean(axis=0) / np.sqrt(np.diag(expected)), 0, atol=5 / 24.5
    )


def test_a_prior_as_exact_as_the_scan_halves_the_step():
    information = np.linalg.inv(textbook_covariance())
    expected = (0.01, -0.01, 0.0)
    found = fit(CORNER, corner_scan(), expected, information, [50.0] * 10)
    np.testing.assert_allclose(found.pose, [0.005, -0.005, 0], atol=2e-5)
    np.testing.assert_allclose(
        found.information, 2 * information, rtol=1e-4, atol=1e-6
    )


def test_a_point_at_the_fit_distance_weighs_a_quarter():
    # Of a wall at x = 2; the other point is behind its surface by half of it.
    scan = Scan(
        np.array([[1.9, 0.5], [2.05, -0.5]]), np.zeros((2, 2)), np.ones(2)
    )
    strong = 1e9 * np.eye(3)
    field = plan([rectangle(2.0, -4, 2.4, 4)])
    found = fit(field, scan, (0.0, 0.0, 0.0), strong, [0.1])
    assert found.information[0, 0] - 1e9 == pytest.approx(0.5, rel=1e-4)
    assert found.share == 0


# Prediction


def test_the_covariance_grows_with_way_and_turn_as_worked_by_hand():
    state = LocalizationState(np.diag([1e-4, 1e-4, 4e-4]), odometry=(1, 2, 0))
    parameters = LocalizationParameters(
        odometry_move=0.1, odometry_turn=0.2, odometry_veer=0.3
    )
    after = predict(state, (3.0, 2.0, 0.5), parameters).covariance
    # 2 m along x: y = 2 yaw. At rest it grows by 0.5 mm and 0.5 mrad.
    rest = 0.0005**2
    expected = np.array(
        [
            [1e-4 + 2 * 0.01 + rest, 0, 0],
            [0, 1e-4 + 4 * 4e-4 + 2 * 0.01 + rest, 2 * 4e-4],
            [0, 2 * 4e-4, 4e-4 + 0.5 * 0.04 + 2 * 0.09 + rest],
        ]
    )
    np.testing.assert_allclose(after, expected, rtol=1e-12)


def test_where_nothing_is_mapped_odometry_is_kept():
    true, told = drive(30)
    poses, state = localized(true, told, field=NOTHING)
    np.testing.assert_array_equal(poses, told)
    assert state.covariance[0, 0] > 0.01**2 + 8 * 0.02**2


def test_where_nothing_is_seen_odometry_is_kept():
    true, told = drive(5)
    for value in (RANGE_MAX, math.nan, math.inf, 0.0):
        nothing = np.full(360, value)
        poses, _ = localized(true, told, change=lambda _, n=nothing: n)
        np.testing.assert_array_equal(poses, told)


def test_along_a_corridor_odometry_is_kept():
    walls = [rectangle(-30, 1, 30, 1.2), rectangle(-30, -1.2, 30, -1)]
    x = np.linspace(0, 10, 201)
    true = np.column_stack([x, 0 * x, 0 * x])
    told = np.column_stack([1.03 * x, 0.02 * x, 0 * x])
    poses, state = localized(true, told, walls, plan(walls))
    np.testing.assert_allclose(poses[:, 0], told[:, 0], atol=1e-3)
    np.testing.assert_allclose(poses[:, 1], 0, atol=0.005)
    # 10.3 m, the start, and 200 scans at rest: nothing was learnt.
    expected = 10.3 * 0.02**2 + 0.01**2 + 200 * 0.0005**2
    assert state.covariance[0, 0] == pytest.approx(expected, rel=0.01)
    assert state.covariance[1, 1] < 0.005**2


@pytest.mark.parametrize("angle", [0.1, 0.4, math.pi / 4])
def test_the_stairs_of_a_slanting_corridor_hold_nothing(angle):
    along, across = rotation(angle).T
    walls = [
        turned(rectangle(-20, 1, 20, 1.2), angle),
        turned(rectangle(-20, -1.2, 20, -1), angle),
    ]
    way = np.linspace(-4, 4, 161)
    yaw = np.full(161, angle)
    true = np.column_stack([way[:, None] * along, yaw])
    told = np.column_stack([(1.03 * way + 0.12)[:, None] * along, yaw])
    poses, state = localized(true, told, walls, plan(walls))
    off = poses[:, :2] - told[:, :2]
    np.testing.assert_allclose(off @ along, 0, atol=0.03)
    np.testing.assert_allclose(poses[:, :2] @ across, 0, atol=0.01)
    deviation = np.sqrt(along @ state.covariance[:2, :2] @ along)
    # After 8 m of which nothing is known it is sqrt(8) times 2 cm.
    assert deviation > 0.5 * math.sqrt(8) * 0.02


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
