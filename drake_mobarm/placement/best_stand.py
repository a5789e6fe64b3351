"""The best stand for a target, searched from the best squares of the map.

Besides the squares, a finer lattice of places is scored. From the best places
of both, steps on still finer lattices and a nonlinear program lead on.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.placement.objective import Scores
from drake_mobarm.placement.objective_map import (
    PlaceScores,
    score_places,
    waist_at,
)
from drake_mobarm.placement.problem import (
    MAX_MOVE,
    StandProblem,
    turns_freely,
)
from drake_mobarm.robot.shape import ARM_BASE_HEIGHT

# Spacing of the lattice of places that are scored besides the squares [m].
_SPACING = 0.025
# At most so many starts; those of one bend of the arm are so far apart [m].
_STARTS = 3
_APART = 0.1
# A place whose objective is so many times the best one's is no start.
_HOPELESS = 1.1
# Spacings of the finer lattices around a start [m], one after the other, and
# how many places they have on each side of it.
_FINE_SPACINGS = (0.01, 0.0025)
_FINE_STEPS = 2
# A limit or an obstacle is active when it is nearer than this [rad, m].
_ACTIVE = 1e-4
_JOINT_NAMES = (
    "waist",
    "shoulder",
    "elbow",
    "forearm roll",
    "wrist angle",
)

Candidate = tuple[float, Array, Array]
"""Objective [-], place p_WB [m], (2,), and joint positions [rad], (6,), as in
`PlaceScores.q`."""


@dataclass(frozen=True, eq=False)
class Stand:
    """A pose of the base, and joint positions that reach the target from it.

    Attributes:
        pose: X_WB, [x, y, yaw] in m and rad, (3,).
        q: joint positions [rad], (6,).
        scores: the objective and its parts at `q`.
        active: the active constraints, which keep the stand from being better
            still, one line each; empty where there are none.
    """

    pose: Array
    q: Array
    scores: Scores
    active: tuple[str, ...]


def find_best_stand(
    problem: StandProblem, squares: PlaceScores
) -> tuple[Stand | None, str]:
    """Finds the place in free space with the least objective (4.12).

    Where the problem gives no heading, the base faces the target, as far as
    the limits of the waist allow.

    Args:
        problem: what to solve.
        squares: scores of the map's places, which are in the problem's free
            space; they are not worked out anew.

    Returns:
        The stand, never worse than the best of the squares, and a line that
        describes it; or None, and why the target is not reachable.
    """
    # Imported here, so that importing placement's laws loads no pydrake.
    from drake_mobarm.placement.stand_program import StandProgram

    problem = _with_obstacles_in_reach(problem)
    lattice = _lattice(problem)
    around = score_places(problem, lattice)
    inside = problem.free.contains(lattice)
    tried = PlaceScores(
        np.vstack([squares.places, lattice[inside]]),
        np.concatenate([squares.q, around.q[inside]]),
        np.concatenate([squares.objective, around.objective[inside]]),
    )
    starts = _pick_starts(tried)
    found = list(starts)
    # There may still be free space between the places of the lattice.
    starts = starts or _pick_starts(_next_to_free_space(problem, around))
    if starts:
        finer = _refine(problem, starts)
        found += finer
        starts = finer or starts
    # The solver does not know of links: at its place the arm may touch.
    touching: list[Candidate] = []
    blind = problem.without_collisions()
    for _, start, q_start in starts:
        place = StandProgram(problem, start, q_start).solve()[None]
        reached = _best_of(problem, place)
        found += reached
        if not reached:
            touching += _best_of(blind, place)
    if not found:
        if problem.surroundings is not None:
            around = score_places(blind, lattice)
        return None, _explain(problem, around, inside)
    value, place, q = min(found, key=lambda candidate: candidate[0])
    stand = _make_stand(problem, place, q)
    if any(candidate[0] < value for candidate in touching):
        touch = "what the arm would touch nearer to its best"
        stand = replace(stand, active=(*stand.active, touch))
    return stand, _describe(stand)


def _with_obstacles_in_reach(problem: StandProblem) -> StandProblem:
    """The problem with no obstacles but those that a stand can be next to."""
    reach = problem.objective.arm.reach + _SPACING + np.sqrt(2) * MAX_MOVE
    near = problem.free.obstacles_near(problem.target.p_WT[:2], reach)
    return replace(problem, free=replace(problem.free, obstacles=tuple(near)))


def _lattice(problem: StandProblem) -> Array:
    """Places around the target as far as the arm reaches, (n, 2)."""
    reach = problem.objective.arm.reach
    steps = _SPACING * np.arange(-(reach // _SPACING), reach // _SPACING + 1)
    x, y = np.meshgrid(steps, steps)
    disc = np.hypot(x, y) <= reach
    return problem.target.p_WT[:2] + np.column_stack([x[disc], y[disc]])


def _next_to_free_space(
    problem: StandProblem, around: PlaceScores
) -> PlaceScores:
    """The places that are at most the lattice's spacing from free space."""
    near = problem.free.distance(around.places) <= _SPACING
    return PlaceScores(
        around.places[near], around.q[near], around.objective[near]
    )


def _pick_starts(tried: PlaceScores) -> list[Candidate]:
    """Up to `_STARTS` of the best solutions, each another bend or place.

    The two solutions of the wrist for one bend of shoulder and elbow count as
    one: they differ by the limits of the joints only.
    """
    value = np.where(np.isnan(tried.objective), np.inf, tried.objective)
    if np.isinf(value).all():
        return []
    order = np.argsort(value, axis=None, kind="stable")
    rows, solutions = np.unravel_index(order, value.shape)
    best: list[Candidate] = []
    kept: list[tuple[Array, int]] = []
    limit = _HOPELESS * value[rows[0], solutions[0]]
    for row, solution in zip(rows, solutions, strict=True):
        if value[row, solution] > limit or len(best) == _STARTS:
            break
        place = tried.places[row]
        bend = solution // 2
        if all(b != bend or np.hypot(*(place - p)) >= _APART for p, b in kept):
            kept.append((place, bend))
            best.append(
                (float(value[row, solution]), place, tried.q[row, solution])
            )
    return best


def _refine(problem: StandProblem, starts: list[Candidate]) -> list[Candidate]:
    """The places that steps on finer lattices lead to from each start.

    Where the arm begins to touch something the objective is discontinuous,
    which the solver does not know; these steps lead along that edge.
    """
    steps = np.arange(-_FINE_STEPS, _FINE_STEPS + 1)
    patch = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    refined = []
    for _, place, _ in starts:
        best: Candidate | None = None
        for spacing in _FINE_SPACINGS:
            while found := _best_of(problem, place + spacing * patch):
                if best is not None and found[0][0] >= best[0]:
                    break
                best = found[0]
                place = best[1]
        if best is not None:
            refined.append(best)
    return refined


def _best_of(problem: StandProblem, places: Array) -> list[Candidate]:
    """The best of places (n, 2), or none if no free one reaches the target."""
    scored = score_places(problem, places[problem.free.contains(places)])
    if np.isnan(scored.objective).all():
        return []
    best = int(np.nanargmin(scored.best))
    return [
        (float(scored.best[best]), scored.places[best], scored.best_q[best])
    ]


def _make_stand(problem: StandProblem, place: Array, q_W: Array) -> Stand:
    """The stand at a place (2,) with joint positions as in `PlaceScores.q`."""
    arm, free = problem.objective.arm, problem.free
    to_target = problem.target.p_WT[:2] - place
    heading = problem.heading
    if heading is None:
        heading = float(np.arctan2(*to_target[::-1]))
    waist, _ = waist_at(arm, q_W[0], heading)
    heading = float(wrap_angle(float(q_W[0] - waist)))
    q = np.concatenate([[waist], q_W[1:]])
    active = [
        f"the {_JOINT_NAMES[i]}'s {name} limit, {limit[i]:.3f} rad"
        for i in np.flatnonzero(~turns_freely(arm))
        if i or problem.heading is not None
        for name, limit in (("lower", arm.lower), ("upper", arm.upper))
        if abs(q[i] - limit[i]) < _ACTIVE
    ]
    near = [
        f"{name}, {free.radius:.2f} m away"
        for name, _ in free.obstacles_near(place, _ACTIVE)
    ]
    active += near
    least = problem.least_distance
    if least and float(np.hypot(*to_target)) < least + _ACTIVE:
        active.append("the target, which is as low as the robot")
    corners = np.reshape(free.polygon.bounds, (2, 2))
    if not near and np.abs(place - corners).min() < _ACTIVE:
        active.append("the edge of the map")
    scores = problem.objective.scores(q_W)
    return Stand(np.array([*place, heading]), q, scores, tuple(active))


def _describe(stand: Stand) -> str:
    x, y, yaw = stand.pose
    return (
        f"stand at ({x:.3f}, {y:.3f}) m, heading {np.rad2deg(yaw):.0f} deg, "
        f"objective {float(stand.scores.objective):.3f}, held by "
        + (" and ".join(stand.active) or "nothing")
    )


def _explain(
    problem: StandProblem, around: PlaceScores, inside: NDArray[np.bool_]
) -> str:
    """Why there is no stand.

    Args:
        problem: the problem without a solution.
        around: places around the target, scored without collisions.
        inside: which of them are in free space, (n,).
    """
    arm, target = problem.objective.arm, problem.target
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
    usable = int(np.sum(reached & inside))
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
