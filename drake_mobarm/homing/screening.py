"""Which poses and strengths an estimator may use: sensors fail at times."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

from drake_mobarm.geometry import is_pose, wrap_angle
from drake_mobarm.immutable import Immutable
from drake_mobarm.sensors.beacon import MIN_DISTANCE
from drake_mobarm.sensors.rssi import RssiModel

# A pose that is off by this much more than the robot can move and turn is a
# jump [m, rad]: less may be slip, or its correction.
_MOVE, _TURN = 0.5, 0.5
# A jump that lasts this long [s] is one for good.
_FOR_GOOD = 0.5
# A calibration may be wrong by this much [dB].
_TOLERANCE = 10.0
# No Bluetooth reaches farther [m].
_REACH = 1000.0


class PoseVerdict(Enum):
    """What to do with a pose: use it, drop it, or begin anew from it."""

    SOUND = "sound"
    DROPPED = "dropped"
    MOVED = "moved"


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseHistory(Immutable):
    """What is remembered of poses.

    Attributes:
        last: the last possible pose [m, m, rad]; None before one.
        age: how long ago that was [s].
        trusted: the last one before a jump; None where there is no doubt.
        doubt: how long ago that was [s].
    """

    last: Sequence[float] | None = None
    age: float = 0.0
    trusted: Sequence[float] | None = None
    doubt: float = 0.0


def screen_pose(
    history: PoseHistory,
    pose: Sequence[float],
    period: float,
    limits: tuple[float, float],
) -> tuple[PoseHistory, PoseVerdict]:
    """Judges the newest pose.

    A pose that jumps is dropped for a while. If it jumps back, nothing
    happened; if not, the robot's frame has moved for good.

    Args:
        history: of the poses before.
        pose: the newest one [m, m, rad].
        period: since the one before [s].
        limits: the robot's highest speed [m/s] and turn rate [rad/s].

    Returns:
        The history with it, and the verdict.
    """
    age, doubt = history.age + period, history.doubt + period
    if not is_pose(pose):
        history = replace(history, age=age, doubt=doubt)
        return history, PoseVerdict.DROPPED
    near = history.last is None or _reaches(history.last, pose, age, limits)
    if history.trusted is None:
        if near:
            return PoseHistory(last=pose), PoseVerdict.SOUND
        doubtful = PoseHistory(last=pose, trusted=history.last, doubt=age)
        return doubtful, PoseVerdict.DROPPED
    if not near and _reaches(history.trusted, pose, doubt, limits):
        return PoseHistory(last=pose), PoseVerdict.SOUND
    if near and doubt > _FOR_GOOD:
        return PoseHistory(last=pose), PoseVerdict.MOVED
    history = replace(history, last=pose, age=0.0, doubt=doubt)
    return history, PoseVerdict.DROPPED


def is_possible_strength(rssi: float, calibration: RssiModel) -> bool:
    """Whether a beacon can be heard with a strength [dBm].

    It cannot be louder than at the nearest distance, by some tolerance, nor
    fainter than where no receiver hears it.
    """
    loudest = float(calibration.rssi(MIN_DISTANCE)) + _TOLERANCE
    faintest = float(calibration.rssi(_REACH))
    return math.isfinite(rssi) and faintest <= rssi <= loudest


def _reaches(
    start: Sequence[float],
    end: Sequence[float],
    time: float,
    limits: tuple[float, float],
) -> bool:
    """Whether the robot can be at one pose so long after another."""
    speed, turn_rate = limits
    turn = abs(wrap_angle(float(end[2]) - float(start[2])))
    move = math.hypot(end[0] - start[0], end[1] - start[1])
    return (
        move <= speed * time + _MOVE
        and turn <= min(turn_rate * time, math.pi) + _TURN
    )
