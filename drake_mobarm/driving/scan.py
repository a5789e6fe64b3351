"""A lidar's scan as points around a robot, with how far it may go there."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from drake_mobarm.driving.gaps import free_length, unit
from drake_mobarm.geometry import Array
from drake_mobarm.sensors.lidar import ray_angles

# A range this near to the lidar's longest [m] is "no return": five times the
# noise of a range.
_NO_RETURN = 0.05


@dataclass(frozen=True, eq=False)
class Scan:
    """What the lidar sees now, as points relative to the robot's centre B.

    The points are in the robot's place but in W's axes (p_BP_W), so that
    directions are angles in W.

    Attributes:
        position: p_WB of the robot's centre [m], (2,).
        yaw: of the robot in W [rad].
        range_max: the longest range of the lidar [m].
        seen: p_BP_W of the points that the lidar sees [m], (n, 2).
        points: p_BP_W of all points to keep clear of [m], (n + m, 2): those
            seen, then those remembered.
    """

    position: Array
    yaw: float
    range_max: float
    seen: Array
    points: Array
    # Rules and careful speed ask for the same free lengths.
    _known: dict[tuple[float, float], float] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @classmethod
    def from_ranges(
        cls,
        position: Array,
        yaw: float,
        ranges: Array,
        range_max: float,
        remembered: Array,
    ) -> Self:
        """The scan that a lidar at the robot's centre reports.

        Args:
            position: p_WB of the robot's centre [m], (2,).
            yaw: of the robot in W [rad].
            ranges: [m], (rays,), in the order of `ray_angles`; NaN where a
                range is missing.
            range_max: the longest range of the lidar [m], which it reports
                where nothing is met.
            remembered: p_WP of points known from elsewhere [m], (m, 2).
        """
        distances = fill_missing(ranges)
        returned = distances < range_max - _NO_RETURN
        angles = yaw + ray_angles(ranges.size)[returned]
        seen = distances[returned, None] * unit(angles)
        points = np.concatenate([seen, remembered - position])
        return cls(position, yaw, range_max, seen, points)

    def free_length(self, angle: float, radius: float) -> float:
        """How far a disc can go before it meets a point [m].

        Args:
            angle: direction in W [rad].
            radius: of the disc [m].
        """
        asked = angle, radius
        if asked not in self._known:
            self._known[asked] = free_length(angle, self.points, radius)
        return self._known[asked]

    def clearance(self, radius: float, behind: float) -> float:
        """Distance from a disc at the centre to the nearest point seen [m].

        Args:
            radius: of the disc [m].
            behind: how far behind the centre a point still counts [m].
        """
        counted = self.seen[self.seen @ unit(self.yaw) > -behind]
        return float(lengths(counted).min(initial=np.inf)) - radius


def fill_missing(ranges: Array) -> Array:
    """Replaces missing ranges by interpolation between the rays beside them.

    Args:
        ranges: of a full turn [m], (rays,), NaN where missing.

    Returns:
        Ranges [m], (rays,).
    """
    missing = np.isnan(ranges)
    if not missing.any():
        return ranges
    ray = np.arange(ranges.size)
    return np.interp(ray, ray[~missing], ranges[~missing], period=ranges.size)


def length(vector: Array) -> float:
    """The length of a vector, (2,)."""
    return float(np.hypot(vector[0], vector[1]))


def lengths(vectors: Array) -> Array:
    """The lengths (n,) of vectors, (n, 2)."""
    hypotenuses: Array = np.hypot(vectors[:, 0], vectors[:, 1])
    return hypotenuses
