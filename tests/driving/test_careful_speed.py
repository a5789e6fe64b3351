"""Careful speed and the scan that it looks at, by hand-worked scenes."""

import math

import numpy as np
import pytest

from drake_mobarm.driving.careful_speed import CareParameters, careful_speed
from drake_mobarm.driving.scan import Scan
from drake_mobarm.exceptions import ParameterError

CARE = CareParameters(
    max_speed=1.0, deceleration=0.5, care_speed=0.4, care_distance=0.8
)
NOTHING = np.empty((0, 2))


def scan_of(seen, remembered=NOTHING, yaw=0.0):
    seen = np.array(seen, dtype=float).reshape(-1, 2)
    return Scan(np.zeros(2), yaw, 12.0, seen, np.vstack([seen, remembered]))


def test_speed_is_the_highest_where_nothing_is_seen():
    assert careful_speed(scan_of([]), 0.3, 0.3, CARE) == 1.0


def test_speed_stops_before_what_is_on_the_way():
    # Known, not seen: 0.5 m ahead, less the radius and 3 cm while turning.
    scan = scan_of([], remembered=[[0.5, 0.0]])
    speed = careful_speed(scan, 0.0, 0.3, CARE)
    assert speed == pytest.approx(math.sqrt(2 * 0.5 * (0.5 - 0.3 - 0.03)))


def test_speed_grows_with_the_clearance_beside():
    # 0.7 m aside, less 0.3 m: half the care distance.
    assert careful_speed(
        scan_of([[0.0, 0.7]]), 0.0, 0.3, CARE
    ) == pytest.approx(0.7)
    assert careful_speed(
        scan_of([[0.0, 0.2]]), 0.0, 0.3, CARE
    ) == pytest.approx(0.4)


def test_things_behind_do_not_slow_the_robot_down():
    beside, behind = [[-0.09, 0.4]], [[-0.11, 0.4]]
    assert careful_speed(scan_of(beside), 0.0, 0.3, CARE) < 0.6
    assert careful_speed(scan_of(behind), 0.0, 0.3, CARE) == 1.0


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
    np.testing.assert_array_equal(scan.position, [1.0, 1.0])
    assert (scan.yaw, scan.range_max) == (math.pi / 2, 5.0)


@pytest.mark.parametrize(
    "field", ["max_speed", "deceleration", "care_speed", "care_distance"]
)
def test_invalid_parameters_are_refused_by_name(field):
    valid = {
        "max_speed": 1.0,
        "deceleration": 0.8,
        "care_speed": 0.4,
        "care_distance": 0.8,
    }
    with pytest.raises(ParameterError, match=field):
        CareParameters(**{**valid, field: 0.0})
