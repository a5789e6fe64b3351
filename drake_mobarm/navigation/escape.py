"""An escape force for the potential field: a stand-in for [39].

The equations of the original were not found; this is our reading of what the
dissertation says of it. Where the robot is caught in a local minimum, a force
along the obstacle's edge leads it on; near a target with obstacles beside it,
the attraction grows.
"""

from dataclasses import dataclass, replace

import numpy as np

from drake_mobarm.checks import at_least, positive
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.immutable import Immutable


@frozen
class EscapeParameters:
    """When a robot counts as caught, and how it escapes; values of our own.

    Attributes:
        updates: so many updates that move less than `caught_move` make a
            local minimum [-], at least 2.
        caught_move: [m], positive.
        caught_force: so does a total force below this share of the attraction
            [-], positive.
        gain: of the escape force, as a share of the attraction [-], positive.
        progress: nearer to the target by this, the escape ends [m], positive.
        longest: it ends after this at the latest [s], positive.
        goal_distance: within which the attraction grows beside obstacles [m],
            positive.
    """

    updates: int = 20
    caught_move: float = 0.05
    caught_force: float = 0.05
    gain: float = 1.5
    progress: float = 0.1
    longest: float = 10.0
    goal_distance: float = 1.0

    def __post_init__(self) -> None:
        at_least(self, 2, "updates")
        positive(
            self,
            "caught_move",
            "caught_force",
            "gain",
            "progress",
            "longest",
            "goal_distance",
        )


@dataclass(frozen=True, eq=False)
class EscapeState(Immutable):
    """What the escape remembers.

    Attributes:
        places: p_WB at the last updates [m], (n, 2), the oldest first.
        side: which way it leads round: +1 with the obstacle to the left, -1
            to the right, 0 while there is no escape.
        goal_distance: to the target at the escape's start [m].
        time: since then [s].
    """

    places: Array
    side: int = 0
    goal_distance: float = np.inf
    time: float = 0.0


NO_ESCAPE = EscapeState(np.empty((0, 2)))
"""Nothing has been noticed yet."""


def grown_attraction(
    attraction: Array,
    repulsion: Array,
    goal_distance: float,
    parameters: EscapeParameters,
) -> Array:
    """The attraction [1/m], (2,), that no repulsion near the target exceeds."""
    strength = float(np.hypot(*attraction))
    if goal_distance > parameters.goal_distance or strength == 0.0:
        return attraction
    grown: Array = attraction * (1 + float(np.hypot(*repulsion)) / strength)
    return grown


def update_escape(
    state: EscapeState,
    position: Array,
    attraction: Array,
    repulsion: Array,
    goal_distance: float,
    sees_goal: bool,
    room: tuple[float, float],
    period: float,
    parameters: EscapeParameters,
) -> EscapeState:
    """Notices a local minimum, and when it is left.

    Args:
        state: after the last update; it is not changed.
        position: p_WB [m], (2,).
        attraction: [1/m], (2,).
        repulsion: [1/m], (2,).
        goal_distance: from the robot to the target [m].
        sees_goal: whether the target is in sight.
        room: how far the lidar sees to the left and to the right of the
            repulsion's direction [m].
        period: since the last update [s].
        parameters: when, and how.
    """
    places = np.vstack([state.places, position])[-parameters.updates :]
    state = replace(state, places=places, time=state.time + period)
    if state.side:
        nearer = goal_distance < state.goal_distance - parameters.progress
        if nearer or sees_goal or state.time > parameters.longest:
            return EscapeState(places[-1:])
        return state
    moved = float(np.hypot(*(places[-1] - places[0])))
    strength = float(np.hypot(*attraction))
    total = float(np.hypot(*(attraction + repulsion)))
    stands = len(places) == parameters.updates and (
        moved < parameters.caught_move
    )
    balanced = total < parameters.caught_force * strength
    if not (stands or balanced) or not repulsion.any():
        return state
    left, right = room
    side = 1 if left >= right else -1
    return EscapeState(places[-1:], side, goal_distance)


def escape_force(
    state: EscapeState,
    attraction: Array,
    repulsion: Array,
    parameters: EscapeParameters,
) -> Array:
    """The force along the obstacle's edge [1/m], (2,); none without escape."""
    size = float(np.hypot(*repulsion))
    if not state.side or size == 0.0:
        return np.zeros(2)
    away = repulsion / size
    across = state.side * np.array([-away[1], away[0]])
    force: Array = parameters.gain * float(np.hypot(*attraction)) * across
    return force
