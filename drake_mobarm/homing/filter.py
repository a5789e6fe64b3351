"""Our estimator of a static target: a robust fit to the last readings.

It differs from the hybrid of section 2.3.1.3 in that each reading is weighted
by its noise, which it finds itself, and in when it tells an arrival: where no
other place explains the readings nearly as well, neither with the distances
nor by the bearings alone. A strength that is wrong, always or for a while, so
cannot make it arrive elsewhere.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from drake_mobarm.checks import at_least, not_negative, one_of, positive
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.homing.fit import (
    WAY,
    Fit,
    Noise,
    X,
    Y,
    first_fit,
    log_likelihoods,
    refine,
    slide,
)
from drake_mobarm.immutable import Immutable
from drake_mobarm.sensors.beacon import NOISE_CONFIGURATIONS

# Other places are tried this many times the arrival radius away, in so many
# directions: a wrong fit is often just before or far behind the target.
_RINGS = (1.0, 2.5, 6.0, 15.0)
_DIRECTIONS = 8
# They are tried while the antenna is this near to the estimate [m].
_TRIED_WITHIN = 0.55
# A place that is better by this [-] becomes the estimate.
_BETTER = 0.5
# Where strength and bearings disagree by more than a factor of 2, distances
# do not count.
_BELIEVED_LOG_GAIN = math.log(2)
# Bearings whose squared error is so many times their variance are at odds.
_SURPRISE = 9.0
# Another estimator's position this near [m] is the same place.
_SAME_PLACE = 0.25
# A distance that no Bluetooth reaches [m]: beyond it is no reading.
_FARTHEST = 1000.0


@frozen
class FilterParameters:
    """Parameters of the filter; none is in the dissertation but 0.3 m.

    Attributes:
        told: the noise to begin with, a configuration of Table 2.2, or 0 to
            tell nothing, which begins with the widest. The filter finds the
            true one within some readings.
        window: how many readings are kept [-].
        drift: standard deviation of odometry, which grows with the root of
            the way [m/sqrt(m)].
        patience: where the bearings of most of so many last readings [-] are
            at odds with all, the filter starts again from these.
        arrival_distance: from the robot to the estimate [m].
        arrival_radius: how far [m] from the estimate no place may explain
            the readings nearly as well.
        arrival_margin: by how much worse such a place has to do at least, in
            the logarithm of its likelihood [-]. 4.5 is three standard
            deviations.
    """

    told: int = 0
    window: int = 300
    drift: float = 0.005
    patience: int = 20
    arrival_distance: float = 0.3
    arrival_radius: float = 0.1
    arrival_margin: float = 4.5

    def __post_init__(self) -> None:
        one_of(self, (0, *NOISE_CONFIGURATIONS), "told")
        at_least(self, 20, "window")
        not_negative(self, "drift")
        at_least(self, 5, "patience")
        positive(self, "arrival_distance", "arrival_radius", "arrival_margin")


@dataclass(frozen=True, kw_only=True, eq=False)
class FilterState(Immutable):
    """The readings and what they tell; no fit before a reading.

    Attributes:
        readings: the last ones, newest last, (n, 5), with the columns of
            `homing.fit`.
        fit: to them.
        margins: by how much worse the best place of each ring about the
            estimate explains the readings, or the bearings alone where that
            is less [-], (rings,), the nearest ring first; None where the
            robot is too far away to ask.
    """

    readings: Array
    fit: Fit | None = None
    margins: Array | None = None


class FilterEstimator:
    """Estimates the target by a robust fit; a `TargetLaw`.

    Args:
        parameters: of the filter.
    """

    def __init__(self, parameters: FilterParameters) -> None:
        self._parameters = parameters
        self._prior = Noise.of(
            NOISE_CONFIGURATIONS[parameters.told or max(NOISE_CONFIGURATIONS)]
        )

    def initial_state(self) -> FilterState:
        """The state before the first reading."""
        return FilterState(readings=np.empty((0, 5)))

    def update(
        self,
        state: FilterState,
        p_WA: Iterable[float],
        bearing_W: float,
        distance: float,
    ) -> FilterState:
        """The state after a reading, as `TargetLaw.update` has it."""
        x, y = map(float, p_WA)
        finite = all(map(math.isfinite, (x, y, bearing_W)))
        if not finite or not 0 <= distance <= _FARTHEST:
            return state
        way = 0.0
        if state.fit is not None:
            last = state.readings[-1].tolist()
            way = last[WAY] + math.hypot(x - last[X], y - last[Y])
        reading = (x, y, bearing_W, distance, way)
        readings = np.vstack([state.readings, reading])
        readings = readings[-self._parameters.window :]
        if state.fit is None:
            return self._start(readings, self._prior)
        fit = self._refine(readings, state.fit)
        odd = fit.surprise[-self._parameters.patience :] > _SURPRISE
        if odd.size < len(readings) and 2 * np.count_nonzero(odd) > odd.size:
            return self._start(readings[-odd.size :][odd], fit.noise)
        return self._try_places(FilterState(readings=readings, fit=fit))

    def estimate(self, state: FilterState) -> Array | None:
        """The estimated target p_WT [m], (2,), or None before a reading."""
        return None if state.fit is None else state.fit.target

    def arrived(self, state: FilterState, p_WB: Iterable[float]) -> bool:
        """Whether the robot is at a target that the filter is sure of.

        Args:
            state: of the filter.
            p_WB: the base's position by odometry [m], (2,).

        Returns:
            True where the base is within `arrival_distance` of the estimate,
            and every place that is `arrival_radius` or more away from that
            explains the readings worse by `arrival_margin`.
        """
        if state.fit is None or state.margins is None:
            return False
        x, y = state.fit.target.tolist()
        base_x, base_y = p_WB
        return (
            math.hypot(x - base_x, y - base_y)
            <= self._parameters.arrival_distance
            and state.margins.min() > self._parameters.arrival_margin
        )

    def confirms(self, state: FilterState, p_WT: Array) -> bool:
        """Whether the readings allow no place far from a position.

        Args:
            state: of the filter.
            p_WT: the position [m], (2,).

        Returns:
            True where the estimate is within `_SAME_PLACE` of it, and every
            place that is twice as far from that explains the readings worse
            by `arrival_margin`.
        """
        if state.fit is None or state.margins is None:
            return False
        apart = state.fit.target - p_WT
        far = self._parameters.arrival_radius * np.array(_RINGS)
        margins = state.margins[far >= 2 * _SAME_PLACE]
        return (
            math.hypot(apart[0], apart[1]) <= _SAME_PLACE
            and margins.min() > self._parameters.arrival_margin
        )

    def _start(self, readings: Array, noise: Noise) -> FilterState:
        """Fits anew to some readings."""
        fit = first_fit(readings, noise)
        for _ in range(2):
            fit = self._refine(readings, fit)
        return FilterState(readings=readings, fit=fit)

    def _refine(self, readings: Array, fit: Fit) -> Fit:
        return refine(readings, fit, self._prior, self._parameters.drift)

    def _try_places(self, state: FilterState) -> FilterState:
        """Moves to a place that is better, or tells how much worse all are."""
        fit, drift = state.fit, self._parameters.drift
        assert fit is not None
        x, y = (fit.target - state.readings[-1, :2]).tolist()
        if math.hypot(x, y) > _TRIED_WITHIN:
            return state
        angles = fit.axis + np.arange(_DIRECTIONS) * (2 * np.pi / _DIRECTIONS)
        ring = np.column_stack([np.cos(angles), np.sin(angles)])
        radii = self._parameters.arrival_radius * np.array(_RINGS)
        places = np.vstack([[0.0, 0.0], *(radius * ring for radius in radii)])
        places += fit.target
        # Along the lines of sight fits go wrong most. There, far away, a
        # place has to lie on these lines to a hair to be a rival.
        along = slice(1, None, _DIRECTIONS // 2)
        across = np.array([-math.sin(fit.axis), math.cos(fit.axis)])
        places[along] = slide(state.readings, fit, places[along], across, drift)
        by_bearings, by_distances = log_likelihoods(
            state.readings, fit, places, drift
        )
        unseen = by_bearings[0] - by_bearings
        worse = unseen
        if abs(fit.log_gain) < _BELIEVED_LOG_GAIN:
            worse = unseen + by_distances[0] - by_distances
        best = int(np.argmin(worse))
        if worse[best] < -_BETTER:
            return replace(state, fit=replace(fit, target=places[best]))
        margins = np.minimum(worse, unseen)[1:].reshape(-1, _DIRECTIONS)
        return replace(state, margins=margins.min(axis=1))
