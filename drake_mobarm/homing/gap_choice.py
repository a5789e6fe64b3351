"""Which gap the rules of `avoidance` head for: the cheapest way to the target.

A way goes straight to the gap, and from there straight to the target.
"""

import numpy as np

from drake_mobarm.driving.gaps import Gaps, free_along
from drake_mobarm.driving.scan import lengths
from drake_mobarm.geometry import wrap_angle
from drake_mobarm.homing.avoidance_state import AvoidanceParameters, ChosenGap
from drake_mobarm.homing.situation import ESTIMATE_ERROR, Situation

# From this angle on [rad] a way bends away from the thing that it passes.
_BEND_AWAY = 0.1
# A gap seen this near to the last one [m], or within this share of its
# distance, is the same: its place moves with the robot.
_SAME_GAP = 0.5
_SAME_GAP_SHARE = 0.25
# A gap this near to the last one [m], with its thing on the other side, is
# likely to pass the same thing on its other side.
_SAME_THING = 1.5


def cheapest_gap(
    gaps: Gaps,
    last: ChosenGap | None,
    situation: Situation,
    parameters: AvoidanceParameters,
) -> tuple[int, float]:
    """Chooses a gap.

    A way costs its length, and more where seen things block it behind the
    gap, where it bends away from the thing passed, for turning, and through
    another gap than the last one.

    Args:
        gaps: at least one.
        last: the gap headed for until now, if any.
        situation: of this update.
        parameters: of the rules.

    Returns:
        The index of the gap, and the length of the way through it [m].
    """
    scan = situation.scan
    places = gaps.points()
    rest = lengths(situation.target - places)
    way = gaps.lengths + rest
    bend = gaps.sides * wrap_angle(situation.bearing - gaps.angles)
    cost = (
        way
        + parameters.turn_cost * np.abs(wrap_angle(gaps.angles - scan.yaw))
        + parameters.slack_cost * (bend > _BEND_AWAY)
    )
    met = free_along(places, situation.target, scan.points, parameters.radius)
    cost += parameters.blocked_cost * (met < rest - situation.tolerance)
    if last is not None:
        moved = lengths(places + scan.position - last.place)
        same_side = gaps.sides == last.side
        same = same_side & (
            moved < np.maximum(_SAME_GAP, _SAME_GAP_SHARE * gaps.lengths)
        )
        # Ways change with the estimate, which errs with its distance.
        cost -= same * (
            parameters.hysteresis + ESTIMATE_ERROR * situation.distance
        )
        # Seen end on, a thin wall seems as easily passed on its other side.
        cost += parameters.side_cost * (~same_side & (moved < _SAME_THING))
    best = int(cost.argmin())
    return best, float(way[best])
