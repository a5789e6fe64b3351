"""Parameters and memory of the obstacle avoidance in `avoidance`."""

from dataclasses import dataclass, field

import numpy as np

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array
from drake_mobarm.immutable import Immutable


@dataclass(kw_only=True)
class AvoidanceParameters:
    """Sizes and patience of the rules; the dissertation gives no values.

    Attributes:
        radius: of the robot [m].
        margin: kept free around it [m].
        tight_margin: the same where there is no other way [m].
        range_max: the lidar's; a range as long means "no return" [m].
        max_speed: [m/s].
        deceleration: to stop before a seen thing [m/s^2].
        care_speed: right beside seen things [m/s].
        care_distance: gap to them from which there is no need [m].
        jump: of the free length that makes a gap [m].
        hysteresis: by how much a new gap's way must be shorter [m].
        blocked_cost: of a way that seen things block [m].
        slack_cost: of a way that bends away from the thing it passes [m].
        side_cost: of passing a thing on the other side than planned [m].
        turn_cost: of turning towards a gap [m/rad].
        smoothing: share of a new target estimate that is taken at once.
        patience: updates without a gain until a boundary is followed.
        boxed_updates: at one place until it counts as boxed in.
        gain: by how much a boundary's end must be nearer [m].
        lookahead: free length that counts as open along a boundary [m].
        first_leg: way along a boundary until turning back [m].
        stall_speed: a measured speed that counts as standing [m/s].
        stall_turn_rate: a measured turn rate that counts as standing [rad/s].
        stall_updates: updates of standing that make a stall.
        back_speed: of backing off [m/s].
        back_updates: updates of backing off.
    """

    radius: float = 0.27
    margin: float = 0.045
    tight_margin: float = 0.015
    range_max: float = 12.0
    max_speed: float = 1.0
    deceleration: float = 0.8
    care_speed: float = 0.4
    care_distance: float = 0.8
    jump: float = 0.4
    hysteresis: float = 0.6
    blocked_cost: float = 3.0
    slack_cost: float = 3.0
    side_cost: float = 2.0
    turn_cost: float = 0.4
    smoothing: float = 0.1
    patience: int = 50
    boxed_updates: int = 150
    gain: float = 0.3
    lookahead: float = 0.4
    first_leg: float = 10.0
    stall_speed: float = 0.03
    stall_turn_rate: float = 0.1
    stall_updates: int = 5
    back_speed: float = 0.2
    back_updates: int = 12

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            require(
                0 < value < np.inf,
                name,
                value,
                "finite and positive",
            )
        require(
            self.smoothing <= 1,
            "smoothing",
            self.smoothing,
            "in (0, 1]",
        )
        require(
            self.tight_margin <= self.margin,
            "tight_margin",
            self.tight_margin,
            "up to `margin`",
        )


def no_points() -> Array:
    """An empty list of points, (0, 2)."""
    return np.empty((0, 2))


@dataclass(frozen=True)
class AvoidanceState(Immutable):
    """What the rules decided, and the little that they remember.

    Attributes:
        waypoint: to drive to, in W [m], (2,).
        speed_limit: [m/s]; negative: back straight off at that speed.
        rule: the rule that decided.
        target: the smoothed target in W [m], (2,).
        gap: the gap headed for, in W [m], (2,).
        gap_side: of the thing it passes: +1 to the right, -1 to the left.
        ground: places visited in W [m], (n, 2), half a metre apart.
        phantoms: unseen things touched, in W [m], (n, 2).
        idle: updates without a gain.
        promise: the shortest way found since the last boundary [m].
        side: of the boundary: +1 to the right, -1 to the left, 0 for none.
        boundary: its point that limits the way, in W [m], (2,).
        exit: the place where a boundary is left for, in W [m], (2,).
        hit: where the last boundary was met, in W [m], (2,).
        hit_side: the side chosen there.
        repeats: how often it came back to that place.
        followed: way along the boundary [m].
        leg: way along it until turning back [m].
        tight: whether narrower gaps are tried.
        stalled: updates of standing.
        backing: updates of backing off that are left.
        previous: the last position in W [m], (2,).
        anchor: a place that it did not leave since, in W [m], (2,).
        stay: updates spent there.
    """

    waypoint: Array
    speed_limit: float
    rule: str = "wait"
    target: Array | None = None
    gap: Array | None = None
    gap_side: int = 0
    ground: Array = field(default_factory=no_points)
    phantoms: Array = field(default_factory=no_points)
    idle: int = 0
    promise: float = np.inf
    side: int = 0
    boundary: Array | None = None
    exit: Array | None = None
    hit: Array | None = None
    hit_side: int = 0
    repeats: int = 0
    followed: float = 0.0
    leg: float = np.inf
    tight: bool = False
    stalled: int = 0
    backing: int = 0
    previous: Array | None = None
    anchor: Array | None = None
    stay: int = 0


def initial_state() -> AvoidanceState:
    """Nothing remembered, standing still."""
    return AvoidanceState(np.zeros(2), 0.0)
