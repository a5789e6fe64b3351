"""Careful speed in hand-worked scenes."""

import math

import numpy as np
import pytest

from drake_mobarm.driving.careful_speed import CareParameters, careful_speed
from drake_mobarm.driving.scan import Scan
from helpers.refusals import assert_refused

CARE = CareParameters(deceleration=0.5, care_speed=0.4, care_gain=0.75)
NOTHING = np.empty((0, 2))


def scan_of(seen, remembered=NOTHING, yaw=0.0):
    seen = np.array(seen, dtype=float).reshape(-1, 2)
    return Scan(np.zeros(2), yaw, 12.0, seen, np.vstack([seen, remembered]))


def test_speed_has_no_limit_where_nothing_is_seen():
    assert careful_speed(scan_of([]), 0.3, 0.3, CARE) == math.inf


def test_speed_stops_before_what_is_on_the_way():
    # Known, not seen: 0.5 m ahead, less the radius and 3 cm while turning.
    scan = scan_of([], remembered=[[0.5, 0.0]])
    speed = careful_speed(scan, 0.0, 0.3, CARE)
    assert speed == pytest.approx(math.sqrt(2 * 0.5 * (0.5 - 0.3 - 0.03)))


def test_speed_stops_before_what_is_on_the_way_that_it_turns_to():
    # The robot looks along x, its way is along y: 0.5 m less the radius.
    ahead, opposite = ([[0.0, y]] for y in (0.5, -0.5))
    speed = careful_speed(scan_of([], ahead), math.pi / 2, 0.3, CARE)
    assert speed == pytest.approx(math.sqrt(2 * 0.5 * (0.5 - 0.3)))
    away = careful_speed(scan_of([], opposite), math.pi / 2, 0.3, CARE)
    assert away == math.inf


def test_speed_grows_with_the_clearance_beside():
    # 0.7 m aside, less 0.3 m: 0.4 m of clearance.
    assert careful_speed(
        scan_of([[0.0, 0.7]]), 0.0, 0.3, CARE
    ) == pytest.approx(0.7)
    assert careful_speed(
        scan_of([[0.0, 0.2]]), 0.0, 0.3, CARE
    ) == pytest.approx(0.4)


def test_things_behind_do_not_slow_the_robot_down():
    beside, behind = [[-0.09, 0.4]], [[-0.11, 0.4]]
    assert careful_speed(scan_of(beside), 0.0, 0.3, CARE) < 0.6
    assert careful_speed(scan_of(behind), 0.0, 0.3, CARE) == math.inf


@pytest.mark.parametrize("field", ["deceleration", "care_speed", "care_gain"])
def test_invalid_parameters_are_refused_by_name(field):
    valid = {
        "deceleration": 0.8,
        "care_speed": 0.4,
        "care_gain": 0.75,
    }
    assert_refused(field, CareParameters, **{**valid, field: 0.0})
