"""A Bluetooth beacon seen by an antenna array: angle of arrival and RSSI.

RSSI stands for distance through a log-distance calibration (Figure 2.2). The
noise is uniform, as in Table 2.2. Nothing here draws random numbers by itself:
callers pass them in, so that a seed decides every reading.
"""

import math
from collections.abc import Iterable

import numpy as np

from drake_mobarm.checks import (
    finite_numbers,
    not_negative,
    one_of,
    require,
    within,
)
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.sensors.rssi import BEACONS, RssiModel

MIN_DISTANCE = 0.05
"""The nearest distance [m] that a reading can tell."""


@frozen
class BeaconNoise:
    """Half-widths of the uniform noise on a reading (Table 2.2).

    Attributes:
        angle: of the angle of arrival [rad], in [0, pi).
        relative_distance: of the distance, as its fraction [-], in [0, 1).
        absolute_distance: of the distance [m], added to the relative one.
    """

    angle: float = 0.0
    relative_distance: float = 0.0
    absolute_distance: float = 0.0

    def __post_init__(self) -> None:
        within(self, "[0, pi)", "angle")
        within(self, "[0, 1)", "relative_distance")
        not_negative(self, "absolute_distance")

    def distance_bound(self, distance: float) -> float:
        """Half-width [m] of the noise on a distance [m]: both parts added."""
        return distance * self.relative_distance + self.absolute_distance


def _table_2_2(degrees: float, relative: float, metres: float) -> BeaconNoise:
    return BeaconNoise(
        angle=math.radians(degrees),
        relative_distance=relative,
        absolute_distance=metres,
    )


NOISE_CONFIGURATIONS: dict[int, BeaconNoise] = {
    1: _table_2_2(5, 0.05, 0),
    2: _table_2_2(5, 0.10, 0),
    3: _table_2_2(10, 0.10, 0),
    4: _table_2_2(10, 0.20, 0),
    5: _table_2_2(20, 0.20, 1),
}
"""The sensor noise configurations of Table 2.2, by their numbers there."""


def read_beacon(
    pose_WA: Iterable[float],
    p_WT: Iterable[float],
    noise: BeaconNoise,
    uniform: Iterable[float],
    rssi_model: RssiModel,
) -> tuple[float, float]:
    """One reading of the target's beacon by the antenna.

    Angle and distance are uniform about the true ones, as Table 2.2's footnote
    has it; the distance is no less than MIN_DISTANCE, and read as RSSI.

    Args:
        pose_WA: the antenna's pose [x, y, yaw] in m and rad, (3,).
        p_WT: the target's position [m], (2,).
        noise: half-widths of the noise.
        uniform: random numbers in [0, 1), (2,): for angle and distance. 0.5
            means no error.
        rssi_model: the beacon's own law.

    Returns:
        Angle of arrival from the antenna's heading [rad], in [-pi, pi), and
        RSSI [dBm].
    """
    (x, y, yaw), (tx, ty), (u_angle, u_distance) = pose_WA, p_WT, uniform
    bearing = math.atan2(ty - y, tx - x)
    angle = wrap_angle(bearing - yaw + (2 * u_angle - 1) * noise.angle)
    distance = math.hypot(tx - x, ty - y)
    distance += (2 * u_distance - 1) * noise.distance_bound(distance)
    rssi = rssi_model.rssi(max(distance, MIN_DISTANCE))
    return float(angle), float(rssi)


def in_field_of_view(angle_true: float, half_width: float) -> bool:
    """Whether the array can read a beacon at this angle (section 2.5).

    Args:
        angle_true: angle of arrival without noise [rad], any turn.
        half_width: of the field of view [rad]: pi / 2 for the hardware, pi or
            more for a sensor that sees all around.
    """
    return bool(abs(wrap_angle(angle_true)) <= half_width)


def distance_moments(
    distance: Array, half_width: Array
) -> tuple[Array, Array, Array]:
    """What is read of distances with uniform noise, cut off at the nearest.

    Exact for `max(d + h u, MIN_DISTANCE)`, u uniform in [-1, 1): the
    expectation of a positive part is a difference of powers.

    Args:
        distance: true ones [m], of any shape.
        half_width: of the noise [m], positive, of the same shape.

    Returns:
        Mean [m], variance [m^2], and the slope of the mean over the
        distance [-], each of that shape.
    """
    excess = distance - MIN_DISTANCE
    share = np.minimum(np.maximum(excess / half_width, -1.0), 1.0) + 1
    first = half_width * share**2 / 4
    second = half_width**2 * share**3 / 6
    whole = excess >= half_width
    mean = MIN_DISTANCE + np.where(whole, excess, first)
    variance = np.where(whole, half_width**2 / 3, second - first**2)
    return mean, np.maximum(variance, 0.0), share / 2


@frozen
class Beacon:
    """A beacon in the world, and how noisily it is read.

    Attributes:
        position: p_WT [m], [x, y], at the antenna's height.
        noise: of its readings, a configuration of Table 2.2.
    """

    position: tuple[float, ...]
    noise: int = 5

    def __post_init__(self) -> None:
        finite_numbers(self, "[x, y] in m", "position")
        one_of(self, NOISE_CONFIGURATIONS, "noise")


@frozen
class BeaconParameters:
    """How the antenna array hears a beacon.

    Attributes:
        rate: readings a second [Hz], 0.1 to 50.
        model: which beacon it is calibrated for, of `BEACONS`.
        field_of_view: full width about the antenna's heading [rad] outside
            which there is no reading; 2 pi for all around, pi for today's
            hardware (section 2.5).
        dropout: chance that a reading is lost [-].
        outages: [from, until) [s] in which nothing is heard.
    """

    rate: float = 20.0
    model: str = "beacon_1"
    field_of_view: float = 2 * math.pi
    dropout: float = 0.0
    outages: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        within(self, "[0.1, 50]", "rate")
        one_of(self, BEACONS, "model")
        within(self, "(0, 2 pi]", "field_of_view")
        within(self, "[0, 1)", "dropout")
        for outage in self.outages:
            require(
                len(outage) == 2 and outage[0] <= outage[1],
                "outages",
                outage,
                "[from, until] in s",
            )
