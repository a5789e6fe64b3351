"""The artificial potential field of sections 3.1 and 3.3.1, as forces.

A force is the negative gradient of its potential [-]. The target attracts:
quadratically from near, conically beyond. Squares that something stands in
repel, each up to its influence distance, which (3.2) makes smaller where two
things stand close together.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import KDTree

from drake_mobarm.checks import not_negative, one_of, positive
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.world.occupancy import OccupancyGrid

REPULSIONS = ("khatib", "gnron")

# A thing nearer than this repels no more strongly [m].
_NEAREST = 0.02
# Of so many squares, those of a scan, the distances of all pairs are worked out
# sooner than trees are built.
_FEW = 400


@frozen
class PotentialParameters:
    """Shape of the potential field.

    The dissertation gives no values; these are the best of some that were
    tried with `apf` and `apf_hw` on pairs of other seeds than its tables.

    Attributes:
        attraction_gain: of the quadratic potential [1/m^2], positive.
        conic_distance: from which on the attraction grows no more [m],
            positive.
        repulsion_gain: of Khatib's potential, for a square metre of obstacles
            [1], not negative.
        influence_distance: from which on squares repel [m], positive.
        repulsion: `khatib`, or `gnron`, which falls with the distance to the
            target (Ge and Cui 2000, n = 2).
        clearance: d_min of (3.2), the width between two things that is to be
            free of repulsion [m], not negative.
    """

    attraction_gain: float = 1.0
    conic_distance: float = 4.0
    repulsion_gain: float = 4.0
    influence_distance: float = 0.3
    repulsion: str = "khatib"
    clearance: float = 0.05

    def __post_init__(self) -> None:
        positive(
            self, "attraction_gain", "conic_distance", "influence_distance"
        )
        not_negative(self, "repulsion_gain", "clearance")
        one_of(self, REPULSIONS, "repulsion")


def attraction(
    position: Array, target: Array, parameters: PotentialParameters
) -> Array:
    """The force towards the target [1/m], (2,).

    Args:
        position: p_WB of the robot [m], (2,).
        target: p_WT [m], (2,).
        parameters: of the field.
    """
    way = target - position
    distance = float(np.hypot(*way))
    reach = min(1.0, parameters.conic_distance / max(distance, 1e-9))
    force: Array = parameters.attraction_gain * reach * way
    return force


def repulsion(
    squares: Array,
    influence: Array | float,
    area: float,
    way: Array,
    parameters: PotentialParameters,
    *,
    radius: float = 0.0,
) -> Array:
    """The force away from all squares [1/m], (2,).

    The potential of a square is Khatib's, 1/2 eta (1/d - 1/d_0)^2 up to the
    influence distance d_0 [19], scaled by the square's area; with `gnron` it
    is multiplied by the squared distance to the target, so that the target
    stays a minimum with obstacles beside it, and a part of the force points
    to the target.

    Args:
        squares: p_BS_W, from the robot to the centres of the squares that
            something stands in [m], (n, 2).
        influence: d_0 of each square [m], (n,), or of all.
        area: of a square [m^2].
        way: p_BT_W, from the robot to the target [m], (2,).
        parameters: of the field.
        radius: of the robot [m], taken off the distances; 0 where the squares
            have been grown by it.
    """
    if not squares.size:
        return np.zeros(2)
    distance = np.hypot(squares[:, 0], squares[:, 1])
    room = np.maximum(distance - radius, _NEAREST)
    # (3.2) can make an influence distance 0.
    inverse = np.maximum(1 / room - 1 / np.maximum(influence, 1e-9), 0.0)
    gain = parameters.repulsion_gain * area
    away = -squares / np.maximum(distance, 1e-9)[:, None]
    force: Array = gain * (inverse / room**2) @ away
    if parameters.repulsion == "gnron":
        force = float(way @ way) * force + gain * float(inverse @ inverse) * way
    return force


def influence_distances(
    squares: Array,
    clusters: NDArray[np.int_],
    parameters: PotentialParameters,
    *,
    radius: float = 0.0,
) -> Array:
    """The influence distance of each square (3.2) [m], (n,).

    d_new = d_c / 2 - d_min, with d_c the distance to the closest square of
    another cluster. It is never larger than the nominal distance, which stays
    where d_new is below 0: nobody can pass there.

    Args:
        squares: centres [m], (n, 2).
        clusters: the number of the cluster that each belongs to, (n,).
        parameters: of the field.
        radius: of the robot [m]: where the squares have not been grown by it,
            the distance between two things is less by twice as much.
    """
    nominal = parameters.influence_distance
    # Squares farther apart than this keep the nominal distance.
    reach = 2 * (nominal + parameters.clearance + radius) + 1e-9
    if len(squares) <= _FEW:
        apart = _apart(squares, clusters)
    else:
        apart = _apart_within(squares, clusters, reach)
    new = (apart - 2 * radius) / 2 - parameters.clearance
    distances: Array = np.where(new < 0, nominal, np.minimum(new, nominal))
    return distances


def _apart(squares: Array, clusters: NDArray[np.int_]) -> Array:
    """From each square to the closest one of another cluster [m], (n,)."""
    x, y = squares.T
    squared = np.square(x[:, None] - x) + np.square(y[:, None] - y)
    squared[clusters[:, None] == clusters] = np.inf
    apart: Array = np.sqrt(squared.min(axis=1, initial=np.inf))
    return apart


def _apart_within(
    squares: Array, clusters: NDArray[np.int_], reach: float
) -> Array:
    """The same of many squares; infinite beyond `reach` [m]."""
    apart = np.full(len(squares), np.inf)
    numbers = np.unique(clusters)
    if numbers.size > 1:
        for number in numbers:
            own = clusters == number
            apart[own], _ = KDTree(squares[~own]).query(
                squares[own], distance_upper_bound=reach
            )
    return apart


def grid_influence(
    grid: OccupancyGrid, parameters: PotentialParameters
) -> tuple[Array, Array]:
    """The squares of a map, and the lookup table of their influence (3.2).

    Args:
        grid: squares of the floor plan, grown by the robot's radius.
        parameters: of the field.

    Returns:
        Centres in W [m], (n, 2), and influence distances [m], (n,), of the
        squares that something stands in.
    """
    numbered, _ = ndimage.label(grid.occupied, structure=np.ones((3, 3)))
    squares = grid.centres()[grid.occupied]
    clusters = numbered[grid.occupied]
    return squares, influence_distances(squares, clusters, parameters)
