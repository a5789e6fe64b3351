"""RSSI as a measure of distance: the log-distance law and its calibration."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import finite, positive, require
from drake_mobarm.exceptions import ParameterError
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array


@frozen
class RssiModel:
    """The log-distance law: rssi = rssi_at_1m - 10 n log10(distance / 1 m).

    Attributes:
        rssi_at_1m: RSSI at 1 m [dBm], finite.
        path_loss_exponent: n [-], positive; 2 in free space.
    """

    rssi_at_1m: float = -59.0
    path_loss_exponent: float = 2.0

    def __post_init__(self) -> None:
        finite(self, "rssi_at_1m")
        positive(self, "path_loss_exponent")

    def rssi(self, distance: ArrayLike) -> Any:
        """RSSI [dBm] at positive distances [m], of the same shape."""
        slope = 10 * self.path_loss_exponent
        return self.rssi_at_1m - slope * np.log10(distance)

    def distance(self, rssi: ArrayLike) -> Any:
        """Distances [m] of RSSI values [dBm], of the same shape."""
        slope = 10 * self.path_loss_exponent
        return 10 ** ((self.rssi_at_1m - np.asarray(rssi)) / slope)


BEACONS: dict[str, RssiModel] = {
    "beacon_1": RssiModel(rssi_at_1m=-59.0, path_loss_exponent=2.0),
    "beacon_2": RssiModel(rssi_at_1m=-65.0, path_loss_exponent=2.4),
}
"""Two beacons, as in Figure 2.2; the values are typical of BLE, not its own."""


def fit_rssi_model(rssi: ArrayLike, distance: ArrayLike) -> RssiModel:
    """Calibrates a beacon: least squares of RSSI against log10(distance).

    Args:
        rssi: readings [dBm], (n,).
        distance: where they were taken [m], (n,), positive.

    Raises:
        ParameterError: fewer than 2 distinct distances, values that are not
            finite or not positive, shapes that differ, or an RSSI that does
            not fall with distance.
    """
    y = np.asarray(rssi, dtype=float)
    d = np.asarray(distance, dtype=float)
    require(y.ndim == 1, "rssi.shape", y.shape, "(n,)")
    require(d.shape == y.shape, "distance.shape", d.shape, f"{y.shape}")
    require(bool(np.isfinite(y).all()), "rssi", y.tolist(), "finite")
    require(
        bool(np.all(np.isfinite(d) & (d > 0))),
        "distance",
        d.tolist(),
        "finite and positive",
    )
    if np.unique(d).size < 2:
        raise ParameterError("distance: at least 2 distinct values are needed")
    columns = np.column_stack([np.ones_like(d), -10 * np.log10(d)])
    (at_1m, exponent), *_ = np.linalg.lstsq(columns, y, rcond=None)
    return RssiModel(
        rssi_at_1m=float(at_1m), path_loss_exponent=float(exponent)
    )


def sample_calibration(
    model: RssiModel,
    distances: ArrayLike,
    noise_db: float,
    rng: np.random.Generator,
) -> Array:
    """RSSI [dBm], (n,), at distances [m], (n,), with Gaussian noise [dB]."""
    require(noise_db >= 0, "noise_db", noise_db, "at least 0")
    exact = np.asarray(model.rssi(distances), dtype=float)
    return exact + rng.normal(0.0, noise_db, exact.shape)


def calibrate(
    model: RssiModel, noise_db: float, rng: np.random.Generator
) -> RssiModel:
    """A beacon's law as fitted from `calibration_samples` of it."""
    return fit_rssi_model(*calibration_samples(model, noise_db, rng))


def calibration_samples(
    model: RssiModel, noise_db: float, rng: np.random.Generator
) -> tuple[Array, Array]:
    """RSSI [dBm] and distances [m], (200,) each: a walk away from a beacon.

    Ten readings at each of twenty places from 0.5 m to 10 m.
    """
    distances = np.repeat(np.linspace(0.5, 10.0, 20), 10)
    return sample_calibration(model, distances, noise_db, rng), distances
