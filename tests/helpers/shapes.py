"""Outlines and boxes to put about a robot."""

import math

import numpy as np

from drake_mobarm.world.obstacles import Obstacle, box_corners


def rectangle(x_low, y_low, x_high, y_high):
    """An outline, (4, 2), counter-clockwise."""
    return np.array(
        [(x_low, y_low), (x_high, y_low), (x_high, y_high), (x_low, y_high)],
        dtype=float,
    )


def turned(points, angle):
    """Points turned about the origin."""
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def convex_polygon(rng, count, centre=(0.0, 0.0), size=1.0):
    """Points of an ellipse in order, with none of its halves left out."""
    angle = np.sort(rng.uniform(0, 2 * np.pi, count))
    while np.diff(angle, append=angle[0] + 2 * np.pi).max() > 0.9 * np.pi:
        angle = np.sort(rng.uniform(0, 2 * np.pi, count))
    axes = size * rng.uniform(0.3, 1, 2)
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * axes
    return turned(ring, rng.uniform(0, 6)) + centre


def box(low, high):
    """An obstacle along the axes, from its least corner to its greatest."""
    low, high = np.array(low), np.array(high)
    return Obstacle("box", box_corners(high - low) + (low + high) / 2)


def write_wall(folder):
    """The path of a world of one wall, 10 m long, its face at x = 3 m."""
    path = folder / "wall.sdf"
    path.write_text(
        '<sdf version="1.9"><model name="wall"><static>true</static>'
        '<link name="wall"><collision name="wall"><pose>4 0 1 0 0 0</pose>'
        "<geometry><box><size>2 10 2</size></box></geometry>"
        "</collision></link></model></sdf>"
    )
    return path
