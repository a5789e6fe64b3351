"""Readings of a beacon along a path, by the words of Table 2.2."""

import numpy as np

from drake_mobarm.sensors.beacon import NOISE_CONFIGURATIONS


def read(configuration, path, seed, target):
    """Bearings [rad] and distances [m], (n,) each, from the places of a path.

    Both are uniform about the true ones; a distance is 0.05 m or more.
    """
    rng = np.random.default_rng(seed)
    noise = NOISE_CONFIGURATIONS[configuration]
    d = np.linalg.norm(target - path, axis=1)
    bearing = np.arctan2(*(target - path).T[::-1])
    n = len(path)
    bearing = bearing + noise.angle * rng.uniform(-1, 1, n)
    half = d * noise.relative_distance + noise.absolute_distance
    distance = d + half * rng.uniform(-1, 1, n)
    return bearing, np.maximum(distance, 0.05)


def columns(path, bearing, distance):
    """Readings as `homing.fit` has them, (n, 5)."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    return np.column_stack([path, bearing, distance, way])


def arc(n):
    """A quarter of a circle of 1.5 m about the origin, (n, 2)."""
    angle = np.linspace(0, np.pi / 2, n)
    return 1.5 * np.column_stack([np.cos(angle), np.sin(angle)])
