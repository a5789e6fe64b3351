"""A scan's returns about the robot, and the rays that it lacks."""

import math

import numpy as np

from drake_mobarm.driving.scan import Scan, fill_missing


def test_a_scan_places_its_returns_about_the_robot():
    # Four rays, straight behind first; the robot looks along W's y axis.
    ranges = np.array([5.0, 2.0, 3.0, np.nan])
    scan = Scan.from_ranges(
        np.array([1.0, 1.0]), math.pi / 2, ranges, 5.0, np.array([[4.0, 1.0]])
    )
    # To the right 2 m, ahead 3 m, left the mean of 3 m and 5 m.
    seen = [[2.0, 0.0], [0.0, 3.0], [-4.0, 0.0]]
    np.testing.assert_allclose(scan.seen, seen, atol=1e-12)
    np.testing.assert_allclose(scan.points, [*seen, [3.0, 0.0]], atol=1e-12)


def test_missing_ranges_are_interpolated_around_the_turn() -> None:
    ranges = np.array([np.nan, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(fill_missing(ranges), [3.0, 2.0, 3.0, 4.0])
