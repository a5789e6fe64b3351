"""Parameters and memory of the obstacle avoidance rules in `avoidance`."""

from dataclasses import dataclass, field

import numpy as np

from drake_mobarm.checks import positive, require
from drake_mobarm.driving.careful_speed import CareParameters
from drake_mobarm.driving.touch import Recovery, TouchParameters
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.immutable import Immutable
from drake_mobarm.robot.shape import RADIUS


@frozen
class AvoidanceParameters:
    """Parameters of the rules; the dissertation gives no values.

    All are finite and positive.

    Attributes:
        radius: of the robot [m].
        margin: clearance kept around it [m].
        tight_margin: clearance kept where there is no other way [m], up to
            `margin`.
        deceleration: to stop before a thing that is seen [m/s^2].
        care_speed: right beside things that are seen [m/s].
        care_gain: how much faster for each metre of clearance to them [1/s].
        jump: of the free length from one direction to the next that makes a
            gap [m].
        hysteresis: by how much the way through another gap has to be shorter
            [m].
        blocked_cost: of a way that seen things block behind the gap [m].
        slack_cost: of a way that bends away from the thing it passes [m].
        side_cost: of passing a thing on the other side than before [m].
        turn_cost: of turning towards a gap [m/rad].
        smoothing_time: in which the target's estimate is followed [s].
        patience: time without a gain until a boundary is followed [s].
        boxed_time: at one place until the robot counts as boxed in [s].
        give_up_time: without new ground, or near places visited earlier,
            until the robot gives up: it goes round and round [s].
        gain: by how much nearer to the target than ever before a boundary is
            left for [m].
        lookahead: free length that counts as open along a boundary [m].
        first_leg: way along a boundary until the robot turns back [m].
        stall_speed: measured speed below which the robot stands [m/s].
        stall_turn_rate: measured turn rate above which it turns [rad/s].
        stall_time: of standing that makes a stall [s].
        back_speed: of backing off [m/s].
        back_time: of backing off [s].
    """

    radius: float = RADIUS
    margin: float = 0.045
    tight_margin: float = 0.015
    deceleration: float = 0.8
    care_speed: float = 0.4
    care_gain: float = 0.75
    jump: float = 0.4
    hysteresis: float = 0.6
    blocked_cost: float = 3.0
    slack_cost: float = 3.0
    side_cost: float = 2.0
    turn_cost: float = 0.4
    smoothing_time: float = 1.0
    patience: float = 5.0
    boxed_time: float = 15.0
    give_up_time: float = 40.0
    gain: float = 0.3
    lookahead: float = 0.4
    first_leg: float = 10.0
    stall_speed: float = 0.03
    stall_turn_rate: float = 0.1
    stall_time: float = 0.5
    back_speed: float = 0.2
    back_time: float = 1.2

    def __post_init__(self) -> None:
        positive(self, *vars(self))
        require(
            self.tight_margin <= self.margin,
            "tight_margin",
            self.tight_margin,
            f"up to margin, {self.margin}",
        )

    @property
    def care(self) -> CareParameters:
        """Those of the careful speed."""
        return CareParameters(
            deceleration=self.deceleration,
            care_speed=self.care_speed,
            care_gain=self.care_gain,
        )

    @property
    def touch(self) -> TouchParameters:
        """Those of touching what is unseen."""
        return TouchParameters(
            stall_speed=self.stall_speed,
            stall_turn_rate=self.stall_turn_rate,
            stall_time=self.stall_time,
            back_speed=self.back_speed,
            back_time=self.back_time,
        )


def no_points() -> Array:
    """An empty list of points, (0, 2)."""
    return np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class ChosenGap:
    """The gap that the robot heads for.

    Attributes:
        place: p_WG, just past the edge of the thing that it passes [m], (2,).
        side: where that thing is: +1 to the right, -1 to the left.
    """

    place: Array
    side: int


@dataclass(frozen=True, eq=False)
class Seek:
    """State "seek": heading for the target, or for the best gap on the way.

    Attributes:
        gap: the gap headed for; None while heading for the target itself.
        shortest_way: to the target, of all found since the last boundary or
            since the target's corridor was free [m].
        idle: time without a gain [s]. New ground and a shorter way are
            gains.
    """

    gap: ChosenGap | None = None
    shortest_way: float = np.inf
    idle: float = 0.0


@dataclass(frozen=True, eq=False)
class Follow:
    """State "follow": following the boundary of an obstacle on one side.

    Attributes:
        side: where the boundary is: +1 to the right, -1 to the left.
        position: p_WB at the last update [m], (2,).
        leg: way along the boundary until the robot turns back [m]; infinite
            after it has.
        followed: way along the boundary, since turning back if it has [m].
        edge: p_WE, the boundary's point that limits the way [m], (2,); None
            before one is known.
    """

    side: int
    position: Array
    leg: float
    followed: float = 0.0
    edge: Array | None = None


@dataclass(frozen=True, eq=False)
class Leave:
    """State "leave": heading for a place near the target, off a boundary.

    Attributes:
        exit: p_WQ, that place [m], (2,).
    """

    exit: Array


@dataclass(frozen=True, eq=False)
class Meeting:
    """Where and how the last boundary was met.

    Attributes:
        place: p_WB there [m], (2,).
        side: on which side the boundary was followed first: +1 with the
            boundary to the right, -1 to the left.
        repeats: how often the robot has come back to the same boundary [-].
    """

    place: Array
    side: int
    repeats: int = 0


@dataclass(frozen=True, eq=False)
class Stay:
    """How long the robot has been at one place.

    Attributes:
        place: p_WB at the first update there [m], (2,).
        time: since then [s].
    """

    place: Array
    time: float = 0.0


@dataclass(frozen=True, eq=False)
class AvoidanceState(Immutable):
    """What the rules decided last, and what they remember.

    Attributes:
        waypoint: p_WQ to drive to [m], (2,).
        speed_limit: [m/s]; negative: back straight off at that speed.
        rule: the name of the rule that decided.
        mode: the state: seek, follow or leave, with its memory.
        recovery: from touching something unseen.
        stay: at one place; None before the first update.
        meeting: with the last boundary; None before the first.
        target: p_WT, the smoothed estimate [m], (2,).
        visited: p_WB of places visited [m], (n, 2).
        no_new_ground: time since the last of them [s].
        known_ground: time near places other than the last one, less what new
            places made up for [s].
        touched: p_WP of unseen things that were touched [m], (n, 2).
        tight: whether the clearance kept is `tight_margin`.
    """

    waypoint: Array
    speed_limit: float
    rule: str = "wait"
    mode: Seek | Follow | Leave = field(default_factory=Seek)
    recovery: Recovery = field(default_factory=Recovery)
    stay: Stay | None = None
    meeting: Meeting | None = None
    target: Array | None = None
    visited: Array = field(default_factory=no_points)
    no_new_ground: float = 0.0
    known_ground: float = 0.0
    touched: Array = field(default_factory=no_points)
    tight: bool = False


def initial_state() -> AvoidanceState:
    """Nothing remembered, standing still."""
    return AvoidanceState(np.zeros(2), 0.0)
