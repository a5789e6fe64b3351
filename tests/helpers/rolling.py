"""A disc that rolls as a planner's law tells it, in plain numpy."""

import math

import numpy as np

from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.sensors.lidar import LidarParameters, cast_rays
from drake_mobarm.world.obstacles import outlines_to_segments, signed_distance
from drake_mobarm.world.occupancy import OccupancyGrid
from helpers.shapes import rectangle

LIDAR = LidarParameters()
PERIOD = 1 / LIDAR.rate
# The station's limits [m/s, rad/s].
SPEED_LIMIT = (1.0, 2.0)


class Rolling:
    """A robot among outlines; it slides along what it touches.

    Args:
        law: of its planner.
        outlines: what is in its way, and seen by the lidar.
        unseen: what is in its way besides, and not in the lidar's plane.
        start: X_WB, [x, y, yaw] in m and rad.
        target: p_WT [m], or a function of the time [s] that gives it.
    """

    def __init__(self, law, outlines, start, target, unseen=()):
        self.law = law
        self.unseen = list(unseen)
        self.outlines = list(outlines)
        self.pose = np.array(start, dtype=float)
        self._target = target
        self.state = law.initial_state()
        self.time = 0.0
        self.path = [self.pose.copy()]
        self.velocities = []
        self.states = []
        self.touches = 0
        self._rng = np.random.default_rng(0)

    @property
    def target(self):
        where = self._target
        return np.array(where(self.time) if callable(where) else where, float)

    def scan(self):
        """The ranges that the lidar reports here [m]."""
        sides = outlines_to_segments(self.outlines)
        ranges = cast_rays(*sides, self.pose, LIDAR.rays)
        ranges += self._rng.normal(0, LIDAR.noise, LIDAR.rays)
        return np.clip(ranges, 0, LIDAR.range_max)

    def step(self, ranges=None):
        """One scan, and the time until the next one."""
        ranges = self.scan() if ranges is None else ranges
        self.state = self.law.update(self.state, self.pose, self.target, ranges)
        speed, turn = self.law.command(self.state, self.pose)
        top, turn_rate = SPEED_LIMIT
        speed = min(max(speed, -top), top)
        turn = min(max(turn, -turn_rate), turn_rate)
        x, y, yaw = self.pose
        moved = np.array(
            [
                x + PERIOD * speed * math.cos(yaw),
                y + PERIOD * speed * math.sin(yaw),
                yaw + PERIOD * turn,
            ]
        )
        self.touches += self._pushed_out(moved)
        self.pose = moved
        self.time += PERIOD
        self.path.append(moved.copy())
        self.velocities.append((speed, turn))
        self.states.append(self.state)

    def _pushed_out(self, moved):
        """Whether the robot touches something; it slides along that."""
        touches = False
        for outline in [*self.outlines, *self.unseen]:
            distance, away = signed_distance(outline, moved[:2])
            if distance[0] < RADIUS:
                touches = True
                moved[:2] += (RADIUS - distance[0]) * away[0]
        return touches

    def run(self, seconds):
        """Whether it arrives within a time; it stops where it gives up."""
        while self.time < seconds and self.state.shut is None:
            self.step()
            if self.state.arrived:
                return True
        return False

    @property
    def distance(self):
        """From the robot to the target [m]."""
        return math.dist(self.pose[:2], self.target)

    @property
    def length(self):
        """Of the way driven [m]."""
        places = np.array(self.path)[:, :2]
        return float(np.hypot(*np.diff(places, axis=0).T).sum())


def room(x_low, y_low, x_high, y_high):
    """Four walls about a floor, 0.2 m thick."""
    return [
        rectangle(x_low - 0.2, y_low - 0.2, x_high + 0.2, y_low),
        rectangle(x_low - 0.2, y_high, x_high + 0.2, y_high + 0.2),
        rectangle(x_low - 0.2, y_low, x_low, y_high),
        rectangle(x_high, y_low, x_high + 0.2, y_high),
    ]


def grown(outlines, radius=RADIUS, cell=0.05):
    """The squares where a disc cannot be among outlines."""
    plain = OccupancyGrid.from_outlines(list(outlines), cell)
    return OccupancyGrid(plain.origin, cell, plain.clearance() <= radius)
