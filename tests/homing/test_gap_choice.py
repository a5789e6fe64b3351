"""Which gap is the cheapest, with every cost worked by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.driving.gaps import Gaps
from drake_mobarm.homing.avoidance_state import (
    AvoidanceParameters,
    ChosenGap,
    initial_state,
)
from drake_mobarm.homing.gap_choice import cheapest_gap
from drake_mobarm.homing.situation import look

PARAMETERS = AvoidanceParameters()
FREE = np.full(360, 12.0)
PLACE = np.array([2.0, 1.0])


def choose(other, yaw=0.0, last=None, ranges=FREE, left_side=1):
    """The gap chosen of two, and the length of the way through it.

    The target is 4 m along +x. The left gap is 3 m along +y, so that its way
    is 3 m + 5 m; the right one is `other` along -y. The thing that each
    passes is on its inner side, as `left_side` says of the left one.
    """
    state = replace(initial_state(), target=np.add(PLACE, [4, 0]))
    situation = look(state, PLACE, yaw, ranges, 12.0, PARAMETERS)
    gaps = Gaps(
        np.array([math.pi / 2, -math.pi / 2]),
        np.array([3.0, other]),
        np.array([left_side, -1.0]),
    )
    best, way = cheapest_gap(gaps, last, situation, PARAMETERS)
    expected = (8.0, other + math.hypot(other, 4))[best]
    assert way == pytest.approx(expected)
    return ("left", "right")[best]


def right_gap(way):
    """How far the right gap has to be for a way of this length [m]."""
    # x + sqrt(x^2 + 16) = way.
    return (way**2 - 16) / (2 * way)


@pytest.mark.parametrize(("way", "chosen"), [(7.9, "right"), (8.1, "left")])
def test_the_shorter_way_is_the_cheapest_where_all_else_is_equal(way, chosen):
    assert choose(right_gap(way)) == chosen


@pytest.mark.parametrize("more", [-0.1, 0.1])
def test_a_way_that_bends_away_from_its_thing_costs_three_metres(more):
    chosen = choose(right_gap(11 + more), left_side=-1)
    assert chosen == ("left" if more > 0 else "right")


@pytest.mark.parametrize(("bend", "chosen"), [(0.09, 0), (0.11, 1)])
def test_a_way_almost_straight_past_its_thing_costs_no_more(bend, chosen):
    # 3 m almost straight on are 4 m to the target; at 60 degrees to the left
    # 2 m, and from (1, sqrt 3) the root of 12 m: 1.5 m and a turn more.
    state = replace(initial_state(), target=np.add(PLACE, [4, 0]))
    situation = look(state, PLACE, 0.0, FREE, 12.0, PARAMETERS)
    gaps = Gaps(
        np.array([bend, math.pi / 3]), np.array([3.0, 2.0]), np.array([-1, 1.0])
    )
    best, way = cheapest_gap(gaps, None, situation, PARAMETERS)
    assert best == chosen
    straight = 3 + math.sqrt(9 + 16 - 24 * math.cos(bend))
    expected = (straight, 2 + math.sqrt(12))[best]
    assert way == pytest.approx(expected)


@pytest.mark.parametrize("more", [-0.1, 0.1])
def test_turning_costs_four_tenths_of_a_metre_a_radian(more):
    # The robot looks at the right gap: half a turn to the left one.
    chosen = choose(right_gap(8 + 0.4 * math.pi + more), yaw=-math.pi / 2)
    assert chosen == ("left" if more > 0 else "right")


@pytest.mark.parametrize(
    ("degrees", "cost"),
    [
        # 2.5 m and 4.3 m of 5 m along the second leg; the last 0.85 m, for
        # the estimate's error of 0.25 m and 15 % of 4 m, do not count.
        (37, 3.0),
        (7, 0.0),
    ],
)
@pytest.mark.parametrize("more", [-0.1, 0.1])
def test_a_way_blocked_behind_its_gap_costs_three_metres(degrees, cost, more):
    # The leg from (0, 3) to (4, 0): r sin + 0.75 r cos = 3.
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    ranges = FREE.copy()
    ranges[180 + degrees] = 3 / (s + 0.75 * c)
    chosen = choose(right_gap(8 + cost + more), ranges=ranges)
    assert chosen == ("left" if more > 0 else "right")


@pytest.mark.parametrize("more", [-0.1, 0.1])
def test_the_last_gap_is_kept_for_the_hysteresis_and_the_estimates_error(more):
    # 0.6 m, and 15 % of 4 m.
    other = right_gap(8 + 0.6 + 0.6 + more)
    last = ChosenGap(np.add(PLACE, [0, -other]), side=-1)
    chosen = choose(other, last=last)
    assert chosen == ("left" if more > 0 else "right")


@pytest.mark.parametrize(
    ("other", "moved", "kept"),
    [
        # Of 3.5 m, a quarter; the way of 8.82 m is 0.82 m longer.
        (3.5, 0.87, True),
        (3.5, 0.88, False),
    ],
)
@pytest.mark.parametrize("side", [-1, 1])
def test_a_gap_is_the_last_one_within_a_quarter_of_its_distance(
    other, moved, kept, side
):
    last = ChosenGap(np.add(PLACE, [moved, -other]), side)
    chosen = choose(other, last=last)
    assert chosen == ("right" if kept and side == -1 else "left")


@pytest.mark.parametrize(("moved", "cost"), [(1.4, 2.0), (1.6, 0.0)])
@pytest.mark.parametrize("more", [-0.1, 0.1])
def test_passing_the_last_thing_on_its_other_side_costs_two_metres(
    moved, cost, more
):
    last = ChosenGap(np.add(PLACE, [-moved, 3]), side=-1)
    chosen = choose(right_gap(8 + cost + more), last=last)
    assert chosen == ("left" if more > 0 else "right")
