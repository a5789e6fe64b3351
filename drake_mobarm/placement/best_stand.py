"""The best stand for a target, from the map's best squares on.

Besides the map's squares a finer lattice of places is tried; steps on still
finer ones and a nonlinear program lead on from the best of them.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.placement.collision import Surroundings
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.objective import PlacementObjective, Scores
from drake_mobarm.placement.objective_map import (
    PlaceScores,
    ToolTarget,
    score_places,
    waist_at,
)
from drake_mobarm.placement.stand_program import (
    MAX_MOVE,
    StandProgram,
    turns_freely,
)
from drake_mobarm.robot.shape import (
    ARM_BASE_HEIGHT,
    CHASSIS_TOP,
    LINK_RADIUS,
    RADIUS,
)

# Distance of the places that are tried besides the map's squares [m].
_SPACING = 0.025
# Starts with the arm bent the same way are at least this far apart [m].
_APART = 0.1
_STARTS = 3
# Places this near to each other around a start [m], so many each way: first
# the one, then the other.
_FINE_SPACINGS = (0.01, 0.0025)
_FINE_STEPS = 2
# A start this much worse than the best one is not worth going on from.
_HOPELESS = 1.1
# Nearer than this to a limit or an obstacle [rad, m] is at it.
_ACTIVE = 1e-4
_JOINT_NAMES = (
    "waist",
    "shoulder",
    "elbow",
    "forearm roll",
    "wrist angle",
)

Candidate = tuple[float, Array, Array]
"""Objective, place (2,) and joints (6,), the waist measured from W."""


@dataclass(frozen=True)
class Stand:
    """Where to stand, and how the arm reaches its target from there.

    Attributes:
        pose: X_WB, [x, y, yaw] in m and rad, (3,).
        q: joint positions [rad], (6,).
        scores: of these joints.
        active: what keeps the stand from being better still, one line each;
            empty where nothing does.
    """

    pose: Array
    q: Array
    scores: Scores
    active: tuple[str, ...]


def find_best_stand(
    objective: PlacementObjective,
    target: ToolTarget,
    free: FreeSpace,
    squares: PlaceScores,
    heading: float | None = None,
    surroundings: Surroundings | None = None,
) -> tuple[Stand | None, str]:
    """The place in free space with the least objective (4.12).

    Args:
        objective: what counts.
        target: of the tool.
        free: where the base may be.
        squares: the map, in free space.
        heading: of the base [rad]; None where it may choose: it then faces
            the target, as far as the waist's limits let it.
        surroundings: what the arm must not touch, as for the map.

    Returns:
        The stand, never worse than the map's best square, and a line that
        says what it is; or None, and why nothing is reachable.
    """
    # Of the obstacles only those that a place within reach can be near.
    room = objective.arm.reach + _SPACING + np.sqrt(2) * MAX_MOVE
    near = free.obstacles_near(target.p_WT[:2], room)
    free = replace(free, obstacles=tuple(near))
    score = functools.partial(
        score_places,
        objective,
        target,
        heading=heading,
        surroundings=surroundings,
    )
    # Beside a target as low as the chassis, not on it.
    low = target.p_WT[2] < CHASSIS_TOP + LINK_RADIUS
    keep_off = 0.0
    if surroundings is not None and low:
        keep_off = RADIUS + LINK_RADIUS
    lattice = _lattice(objective, target)
    around = score(lattice)
    inside = free.contains(lattice)
    tried = PlaceScores(
        np.vstack([squares.places, lattice[inside]]),
        np.concatenate([squares.q, around.q[inside]]),
        np.concatenate([squares.objective, around.objective[inside]]),
    )
    starts = _pick_starts(tried)
    found = list(starts)
    # Free space may still hold a place between the lattice's.
    starts = starts or _pick_starts(_near(around, free))
    if starts:
        finer = _refine(starts, free, score)
        found += finer
        starts = finer or starts
    refused: list[Candidate] = []
    look_away = functools.partial(score, surroundings=None)
    for _, start, q_start in starts:
        program = StandProgram(
            objective, target, free, start, q_start, heading, keep_off
        )
        place = program.solve()[None]
        held = _hold(place, free, score)
        found += held
        if not held:
            refused += _hold(place, free, look_away)
    if not found:
        if surroundings is not None:
            around = score_places(objective, target, lattice, heading)
        return None, _explain(objective, target, around, inside)
    value, place, q = min(found, key=lambda candidate: candidate[0])
    stand = _make_stand(objective, target, free, place, q, heading, keep_off)
    # The solver knows nothing of links: what it found may have touched.
    if any(candidate[0] < value for candidate in refused):
        held_by = (*stand.active, "what the arm would touch nearer to its best")
        stand = replace(stand, active=held_by)
    return stand, _tell(stand)


def _lattice(objective: PlacementObjective, target: ToolTarget) -> Array:
    reach = objective.arm.reach
    steps = _SPACING * np.arange(-(reach // _SPACING), reach // _SPACING + 1)
    x, y = np.meshgrid(steps, steps)
    disc = np.hypot(x, y) <= reach
    return target.p_WT[:2] + np.column_stack([x[disc], y[disc]])


def _near(around: PlaceScores, free: FreeSpace) -> PlaceScores:
    """The places a step or less from free space."""
    near = free.distance(around.places) <= _SPACING
    return PlaceScores(
        around.places[near], around.q[near], around.objective[near]
    )


def _pick_starts(tried: PlaceScores) -> list[Candidate]:
    """The best of each way to bend the arm, and of places apart.

    The two wrists of one are as good as each other but for their limits.
    """
    value = np.where(np.isnan(tried.objective), np.inf, tried.objective)
    if np.isinf(value).all():
        return []
    order = np.argsort(value, axis=None, kind="stable")
    rows, branches = np.unravel_index(order, value.shape)
    best: list[Candidate] = []
    kept: list[tuple[Array, int]] = []
    limit = _HOPELESS * value[rows[0], branches[0]]
    for row, branch in zip(rows, branches, strict=True):
        if value[row, branch] > limit or len(best) == _STARTS:
            break
        place = tried.places[row]
        bend = branch // 2
        if all(b != bend or np.hypot(*(place - p)) >= _APART for p, b in kept):
            kept.append((place, bend))
            best.append(
                (float(value[row, branch]), place, tried.q[row, branch])
            )
    return best


def _refine(
    starts: list[Candidate],
    free: FreeSpace,
    score: Callable[[Array], PlaceScores],
) -> list[Candidate]:
    """Where steps on finer lattices lead from each start, if anywhere.

    Where the arm touches something the objective ends in a cliff, of which
    the solver knows nothing: these steps lead along it.
    """
    steps = np.arange(-_FINE_STEPS, _FINE_STEPS + 1)
    patch = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    refined = []
    for _, place, _ in starts:
        best: Candidate | None = None
        for spacing in _FINE_SPACINGS:
            while found := _hold(place + spacing * patch, free, score):
                if best is not None and found[0][0] >= best[0]:
                    break
                best = found[0]
                place = best[1]
        if best is not None:
            refined.append(best)
    return refined


def _hold(
    places: Array, free: FreeSpace, score: Callable[[Array], PlaceScores]
) -> list[Candidate]:
    """The best of places (n, 2) that are free and let the arm reach."""
    scored = score(places[free.contains(places)])
    if np.isnan(scored.objective).all():
        return []
    best = int(np.nanargmin(scored.best))
    return [
        (float(scored.best[best]), scored.places[best], scored.best_q[best])
    ]


def _make_stand(
    objective: PlacementObjective,
    target: ToolTarget,
    free: FreeSpace,
    place: Array,
    q_W: Array,
    heading: float | None,
    keep_off: float,
) -> Stand:
    arm = objective.arm
    heading_given = heading is not None
    if heading is None:
        heading = float(np.arctan2(*(target.p_WT[:2] - place)[::-1]))
    waist, _ = waist_at(arm, q_W[0], heading)
    heading = float(wrap_angle(float(q_W[0] - waist)))
    q = np.concatenate([[waist], q_W[1:]])
    active = [
        f"the {_JOINT_NAMES[i]}'s {name} limit, {limit[i]:.3f} rad"
        for i in np.flatnonzero(~turns_freely(arm))
        if i or heading_given
        for name, limit in (("lower", arm.lower), ("upper", arm.upper))
        if abs(q[i] - limit[i]) < _ACTIVE
    ]
    near = [
        f"{name}, {free.radius:.2f} m away"
        for name, _ in free.obstacles_near(place, _ACTIVE)
    ]
    active += near
    distance = float(np.hypot(*(target.p_WT[:2] - place)))
    if keep_off and distance < keep_off + _ACTIVE:
        active.append("the target, which is as low as the robot")
    corners = np.reshape(free.polygon.bounds, (2, 2))
    if not near and np.abs(place - corners).min() < _ACTIVE:
        active.append("the edge of the map")
    scores = objective.scores(q_W)
    return Stand(np.array([*place, heading]), q, scores, tuple(active))


def _tell(stand: Stand) -> str:
    x, y, yaw = stand.pose
    return (
        f"stand at ({x:.3f}, {y:.3f}) m, heading {np.rad2deg(yaw):.0f} deg, "
        f"objective {float(stand.scores.objective):.3f}, held by "
        + (" and ".join(stand.active) or "nothing")
    )


def _explain(
    objective: PlacementObjective,
    target: ToolTarget,
    around: PlaceScores,
    free: NDArray[np.bool_],
) -> str:
    """Why no place will do, from what the arm reaches by itself."""
    arm = objective.arm
    shoulder = ARM_BASE_HEIGHT + float(arm.shoulder[2])
    x, y, z = target.p_WT
    where = f"not reachable: the target at ({x:.2f}, {y:.2f}, {z:.2f}) m"
    if abs(z - shoulder) > arm.reach:
        side = "above" if z > shoulder else "below"
        return (
            f"{where} is {abs(z - shoulder):.2f} m {side} the shoulder, and "
            f"the arm reaches {arm.reach:.2f} m"
        )
    reached = ~np.isnan(around.best)
    possible = int(reached.sum())
    if not possible:
        approach = ", ".join(f"{a:.2f}" for a in target.a_W)
        rise = z - arm.hand * target.a_W[2] - shoulder
        side = "above" if rise > 0 else "below"
        beyond = abs(rise) > arm.reach - arm.hand
        return f"{where} has no solution of the arm along ({approach}): " + (
            f"the wrist's centre would be {abs(rise):.2f} m {side} the "
            f"shoulder, and reaches {arm.reach - arm.hand:.2f} m"
            if beyond
            else "none is within the joints' limits and torques"
        )
    usable = int(np.sum(reached & free))
    if usable:
        return (
            f"{where} has {usable} free places around it with a solution of "
            "the arm, but each runs into furniture or the robot itself"
        )
    return (
        f"{where} could be worked on from {possible} of "
        f"{len(around.places)} places around it, but none of them is free "
        "and open to the robot"
    )
