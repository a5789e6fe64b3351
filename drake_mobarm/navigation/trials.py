"""The starts and targets of Tables 3.2 to 3.4."""

from typing import NamedTuple

import numpy as np

from drake_mobarm.world.rooms import ROOMS, reachable_floor, within_room

MIN_DISTANCE = 1.5
"""From start to target [m]: nearer would succeed without moving."""


class Pair(NamedTuple):
    """Where a trial begins, and where it is to end.

    Attributes:
        start: X_WB, [x, y, yaw] in m and rad.
        target: p_WT [m].
        seed: of the run.
    """

    start: list[float]
    target: list[float]
    seed: int


def make_pair(world: str, seed: int, index: int) -> Pair:
    """A start and a target, uniform over the reachable floor.

    In the small house each pair of rooms comes in turn.

    Args:
        world: name of a shipped world.
        seed: of the table.
        index: of the trial.
    """
    rng = np.random.default_rng([seed, 3, index])
    # Drake's parser is not for laws.
    from drake_mobarm.world.sdf import load_world

    floor = reachable_floor(load_world(world))
    floors = [floor, floor]
    if world == "small_house":
        rooms = [(a, b) for a in ROOMS for b in ROOMS]
        floors = [within_room(floor, r) for r in rooms[index % len(rooms)]]
    while True:
        start, target = (f[rng.integers(len(f))] for f in floors)
        if np.linalg.norm(start - target) >= MIN_DISTANCE:
            break
    yaw = float(rng.uniform(-np.pi, np.pi))
    return Pair(
        [*start.tolist(), yaw], target.tolist(), int(rng.integers(2**31))
    )
