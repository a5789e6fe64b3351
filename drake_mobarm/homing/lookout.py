"""Turning back to a beacon that is out of the antenna's view (section 2.5).

An antenna with a narrow field of view hears nothing of a beacon beside or
behind it. Far from the estimate that does not matter: the beacon does not
move, and the way to it may well lead around things. Near the estimate it does:

- drive: as the avoidance says.
- turn: on the spot towards the estimate, by the shorter side.
- search: on the spot, once around: the beacon is not where it is estimated.
- aside, then back: at the estimate, where the antenna has run over the beacon,
  the robot turns to another line and backs off along it, until the estimate is
  in front of it again. Where something is behind, it tries the next line. So it
  comes back from another side: bearings along one line alone do not tell where
  on it the beacon is.

From "drive" the robot begins to look where it has heard nothing for a while:
at the estimate at once, near it after a pause, elsewhere when it has heard
nothing for long. When it hears the beacon again, it drives on.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_mobarm.checks import positive
from drake_mobarm.driving.scan import Scan
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.immutable import Immutable
from drake_mobarm.robot.shape import RADIUS

# Within this angle [rad] a direction is faced.
_FACED = 0.1
# From one line to the next one at the estimate [rad].
_ASIDE = 1.0
# Without a reading until looking begins, and with all of them until it ends
# [s].
_PATIENCE, _HEARD = 0.25, 0.3
# Searching takes no longer than this [s]: a turn at 0.5 rad/s.
_SEARCH = 14.0
# Clearance kept beside the robot and free room behind it for backing off [m].
_MARGIN, _ROOM = 0.03, 0.15
# Nearer than this [m] the antenna, 0.2 m ahead of the centre, may be past the
# estimate wherever the robot turns.
_UNDER_ANTENNA = 0.3
# Turning aside takes no longer than this [s].
_LONGEST_TURN = 3.0


@frozen
class LookoutParameters:
    """When to look for the beacon, and how.

    Attributes:
        at: this near to the estimate the robot is at it [m].
        near: and this near it is near it [m].
        pause: of driving between two looks near the estimate [s].
        stale: without a reading, and without a look, elsewhere [s].
        back_speed: of backing off [m/s].
    """

    at: float = 0.5
    near: float = 1.0
    pause: float = 3.0
    stale: float = 10.0
    back_speed: float = 0.2

    def __post_init__(self) -> None:
        positive(
            self,
            "at",
            "near",
            "pause",
            "stale",
            "back_speed",
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class LookoutState(Immutable):
    """What the robot does about a beacon that it does not hear.

    Attributes:
        mode: one of "drive", "turn", "search", "aside", "back".
        since: how long it is in it [s].
        silent: how long it has heard nothing [s].
        heard: how long it has heard all readings [s].
        heading: to turn aside to [rad].
    """

    mode: str = "drive"
    since: float = 0.0
    silent: float = 0.0
    heard: float = 0.0
    heading: float = 0.0


def update(
    state: LookoutState,
    pose_WB: Sequence[float],
    p_WT: Sequence[float],
    is_heard: bool,
    is_free_behind: bool,
    period: float,
    parameters: LookoutParameters,
) -> LookoutState:
    """Takes in whether the beacon is heard, and decides what to do.

    Args:
        state: before; it is not changed.
        pose_WB: of the base [m, m, rad], (3,).
        p_WT: the estimated target [m], (2,).
        is_heard: whether there is a reading.
        is_free_behind: whether the robot can back off.
        period: since the last update [s].
        parameters: of it all.
    """
    state = replace(
        state,
        since=state.since + period,
        silent=0.0 if is_heard else state.silent + period,
        heard=state.heard + period if is_heard else 0.0,
    )
    x, y, yaw = pose_WB
    dx, dy = p_WT[0] - x, p_WT[1] - y
    goal = state.heading if state.mode == "aside" else math.atan2(dy, dx)
    mode = _next_mode(
        state,
        math.hypot(dx, dy),
        abs(float(wrap_angle(goal - yaw))) < _FACED,
        is_free_behind,
        parameters,
    )
    if mode == state.mode:
        return state
    return replace(state, mode=mode, since=0.0, heading=yaw + _ASIDE)


def is_free_behind(
    pose_WB: Sequence[float], ranges: Array, range_max: float
) -> bool:
    """Whether a lidar sees room to back off.

    Args:
        pose_WB: of the base [m, m, rad], (3,).
        ranges: [m], (rays,), in the order of `ray_angles`; NaN where missing.
        range_max: the lidar's longest range [m].
    """
    x, y, yaw = pose_WB
    if np.isnan(ranges).all():
        return False
    scan = Scan.from_ranges(
        np.array([x, y]), yaw, ranges, range_max, np.empty((0, 2))
    )
    return scan.free_length(yaw + math.pi, RADIUS + _MARGIN) > _ROOM


def waypoint(
    state: LookoutState,
    pose_WB: Sequence[float],
    p_WT: Sequence[float],
    parameters: LookoutParameters,
) -> tuple[float, float, float]:
    """Where to drive instead of where the avoidance says.

    Args:
        state: of the lookout.
        pose_WB: of the base [m, m, rad], (3,).
        p_WT: the estimated target [m], (2,).
        parameters: of the lookout.

    Returns:
        A waypoint [m, m] with its speed limit [m/s]. In "drive" it counts for
        nothing.
    """
    x, y, _ = pose_WB
    c, s = math.cos(state.heading), math.sin(state.heading)
    nowhere = (math.nan, math.nan, 0.0)
    return {
        "drive": nowhere,
        "turn": (p_WT[0], p_WT[1], 0.0),
        "search": nowhere,
        "aside": (x + c, y + s, 0.0),
        "back": (x, y, -parameters.back_speed),
    }[state.mode]


def _next_mode(
    state: LookoutState,
    distance: float,
    is_faced: bool,
    is_free_behind: bool,
    parameters: LookoutParameters,
) -> str:
    found = state.heard >= _HEARD
    at = distance < parameters.at
    if state.mode == "drive":
        if state.silent < _PATIENCE:
            return "drive"
        if at:
            return "aside"
        if distance < parameters.near:
            return "turn" if state.since >= parameters.pause else "drive"
        stale = min(state.since, state.silent) >= parameters.stale
        return "turn" if stale else "drive"
    if state.mode == "aside":
        turned = is_faced or state.since > _LONGEST_TURN
        return "back" if turned else "aside"
    if state.mode == "back":
        if at and is_free_behind:
            return "back"
        # Here no turning brings the beacon before the antenna.
        return "aside" if distance < _UNDER_ANTENNA else "turn"
    if found:
        return "drive"
    if state.mode == "turn":
        settled = is_faced and state.silent > _PATIENCE
        return "search" if settled and state.since > 0.5 else "turn"
    return "search" if state.since < _SEARCH else "drive"
