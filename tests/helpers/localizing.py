"""A room, its floor plan, and drives in it, for tests of localization."""

import numpy as np

from drake_mobarm.robot.differential_drive import DifferentialDrive
from drake_mobarm.sensors.distance_field import DistanceField
from drake_mobarm.sensors.lidar import cast_rays
from drake_mobarm.sensors.localization import (
    LocalizationParameters,
    begin,
    localize,
)
from drake_mobarm.sensors.odometry import integrate_wheels
from drake_mobarm.sensors.scan_matching import compose
from drake_mobarm.world.obstacles import outlines_to_segments
from drake_mobarm.world.occupancy import OccupancyGrid
from helpers.shapes import rectangle

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
