"""The pull of a highway, section 3.3.2.2: near points, exits, paths, forces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_mobarm.checks import not_negative, positive
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.navigation.highway import Highway

# A path counts as at least this long in (3.6) [m]: its weight would be
# infinite on the target.
_SHORTEST = 0.3


@frozen
class HighwayForceParameters:
    """How strongly a highway pulls.

    Attributes:
        weight: m of section 3.3.3 [-], not negative; 50 in section 3.3.4.
        target_radius: r_t, within which points are exits to the target [m],
            positive; the dissertation gives no value.
    """

    weight: float = 50.0
    target_radius: float = 2.0

    def __post_init__(self) -> None:
        not_negative(self, "weight")
        positive(self, "target_radius")


@dataclass(frozen=True, eq=False)
class HighwayPath:
    """A path of the highway that pulls.

    Attributes:
        points: the numbers of its points, from the entry to the exit, (k,).
        length: from the robot to the entry and along the path [m].
    """

    points: NDArray[np.int_]
    length: float

    @property
    def weight(self) -> float:
        """Of the path, (3.6) [1/m]."""
        return 10 / max(self.length, _SHORTEST)


def exits(
    points: Array,
    target: Array,
    sees_target: NDArray[np.bool_],
    parameters: HighwayForceParameters,
) -> NDArray[np.int_]:
    """Step 2: the numbers of the points from which the target is left to reach.

    Args:
        points: of the highway [m], (n, 2).
        target: p_WT [m], (2,).
        sees_target: which points have a line of sight to it, (n,).
        parameters: of the highway's pull.

    Returns:
        Those within `target_radius`, or else all that see the target.
    """
    apart = np.hypot(*(points - target).T)
    near = sees_target & (apart <= parameters.target_radius)
    return np.flatnonzero(near if near.any() else sees_target)


def choose_paths(
    highway: Highway,
    position: Array,
    entries: NDArray[np.int_],
    targets: NDArray[np.int_],
) -> list[HighwayPath]:
    """Step 3: for each exit the shortest path from one of the entries.

    Args:
        highway: the table of best paths.
        position: p_WB of the robot [m], (2,).
        entries: numbers of the near points, which the robot sees (step 1).
        targets: numbers of the exits (step 2).

    Returns:
        At most one path an exit: none where no path leads there.
    """
    if not entries.size or not targets.size:
        return []
    to_entry = np.hypot(*(highway.points[entries] - position).T)
    best, total = highway.best_entries(entries, to_entry, targets)
    return [
        HighwayPath(highway.path(int(entry), int(target)), float(length))
        for entry, target, length in zip(best, targets, total, strict=True)
        if np.isfinite(length)
    ]


def highway_force(
    points: Array,
    paths: list[HighwayPath],
    position: Array,
    seen: NDArray[np.bool_],
    attraction: Array,
) -> Array:
    """Step 4: the sum of (3.7) over all paths and their visible points, (2,).

    n_t counts the exits that a path leads to.

    Args:
        points: of the highway [m], (n, 2).
        paths: one an exit.
        position: p_WB of the robot [m], (2,).
        seen: which points the robot sees, (n,).
        attraction: F_att at the robot [1/m], (2,).

    Returns:
        The force [1/m], not yet weighted by m.
    """
    force = np.zeros(2)
    strength = float(np.hypot(*attraction))
    for path in paths:
        visible = path.points[seen[path.points]]
        if visible.size:
            pull = (points[visible] - position).sum(axis=0) / visible.size
            force += path.weight * strength / len(paths) * pull
    return force
