"""The hybrid target estimator of section 2.3.1.3: parallax checked by vector.

Where the section is silent, this file decides:

- The first two readings usually come from one place, so the parallax position
  starts at the crossing of the first line of sight with the first later one
  that is `min_move` away and `min_angle` apart. Where a whole buffer does not
  give one, it starts at the vector position. Until then that is reported.
- The distances of (2.14) are the antenna's, where the readings are taken.
- The z-test takes the newest calculated position, before averaging, against
  the mean and sample deviation of the last 20 before it. With fewer than 3 of
  them nothing is an outlier. The average is with the time-weighted position.
- An outlier is ignored in that update only. It stays in the buffer: else a
  wrong buffer would refuse every right reading for ever.
- Arrival compares the parallax position, after its reset, with the vector's.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import positive, whole, within
from drake_mobarm.frozen import frozen
from drake_mobarm.geometry import Array
from drake_mobarm.homing.parallax import intersect_bearings, update_parallax
from drake_mobarm.homing.vector import vector_position, weighted_position
from drake_mobarm.immutable import Immutable


@frozen
class HybridParameters:
    """Parameters of the hybrid estimator.

    Attributes:
        k: fraction of the way to the newest line of sight [-]; the
            dissertation has 0.8.
        buffer: how many vector positions are kept [-]; the dissertation has
            20.
        tau: decay of their weights [readings]; the dissertation gives none,
            see `mobarm reproduce tau`.
        agreement: threshold of (2.14) [-]; the dissertation has 0.3.
        z_threshold: of the outlier test on each axis [-]; the dissertation
            has 1.645, for 90 %. As either axis may refuse a position, about
            a fifth of good ones is refused.
        arrival_distance: from the robot to the estimate [m]; the
            dissertation has 0.3.
        arrival_agreement: from the parallax to the vector position at arrival
            [m]; the dissertation gives none.
        min_move: least baseline of the first crossing [m]; ours.
        min_angle: least angle of the first crossing [rad]; ours.
    """

    k: float = 0.8
    buffer: int = 20
    tau: float = 6.0
    agreement: float = 0.3
    z_threshold: float = 1.645
    arrival_distance: float = 0.3
    arrival_agreement: float = 0.06
    min_move: float = 0.1
    min_angle: float = 0.1

    def __post_init__(self) -> None:
        within(self, "(0, 1]", "k")
        whole(self, 3, 10_000, "buffer")
        positive(
            self,
            "tau",
            "agreement",
            "z_threshold",
            "arrival_distance",
            "arrival_agreement",
            "min_move",
        )
        within(self, "(0, pi/2)", "min_angle")


@dataclass(frozen=True, kw_only=True, eq=False)
class HybridState(Immutable):
    """What the estimator remembers; every field is empty before a reading.

    Attributes:
        vectors: the last vector positions [m], newest first, (n, 2).
        first_p_WA: where the first reading was taken [m], (2,).
        first_bearing_W: the first line of sight [rad].
        readings: how many were used [-].
        parallax: the parallax position [m], (2,).
        vector: the time-weighted vector position [m], (2,).
        reported: the estimate [m], (2,).
    """

    vectors: Array
    first_p_WA: Array | None = None
    first_bearing_W: float = 0.0
    readings: int = 0
    parallax: Array | None = None
    vector: Array | None = None
    reported: Array | None = None


class HybridEstimator:
    """Estimates the target as section 2.3.1.3 does; a `TargetLaw`.

    Args:
        parameters: of the estimator.
    """

    def __init__(self, parameters: HybridParameters) -> None:
        self._parameters = parameters

    def initial_state(self) -> HybridState:
        """The state before the first reading."""
        return HybridState(vectors=np.empty((0, 2)))

    def update(
        self,
        state: HybridState,
        p_WA: ArrayLike,
        bearing_W: float,
        distance: float,
    ) -> HybridState:
        """The state after a reading, as `TargetLaw.update` has it."""
        parameters = self._parameters
        p_WA = np.asarray(p_WA, dtype=float)
        finite = np.isfinite([*p_WA, bearing_W, distance]).all()
        if not finite or distance < 0:
            return state
        newest = vector_position(p_WA, bearing_W, distance)
        vectors = np.vstack([newest, state.vectors])[: parameters.buffer]
        vector = weighted_position(vectors, parameters.tau)
        if state.first_p_WA is None:
            state = replace(state, first_p_WA=p_WA, first_bearing_W=bearing_W)
        reported = parallax = _next_parallax(
            state, p_WA, bearing_W, vector, parameters
        )
        if parallax is None:
            reported = vector
        elif position_error(
            parallax, vector, p_WA
        ) > parameters.agreement and not is_outlier(
            newest, state.vectors, parameters.z_threshold
        ):
            reported = parallax = (parallax + vector) / 2
        return replace(
            state,
            vectors=vectors,
            readings=state.readings + 1,
            parallax=parallax,
            vector=vector,
            reported=reported,
        )

    def estimate(self, state: HybridState) -> Array | None:
        """The reported target p_WT [m], (2,), or None before a reading."""
        return state.reported

    def arrived(self, state: HybridState, p_WB: ArrayLike) -> bool:
        """Whether the robot has arrived, by both conditions of 2.3.1.3.

        Args:
            state: of the estimator.
            p_WB: the base's position by odometry [m], (2,).

        Returns:
            True where the base is within `arrival_distance` of the estimate,
            and the parallax and vector positions within `arrival_agreement`.
        """
        if (
            state.reported is None
            or state.parallax is None
            or state.vector is None
        ):
            return False
        near = _length(state.reported - np.asarray(p_WB, dtype=float))
        apart = _length(state.parallax - state.vector)
        return (
            near <= self._parameters.arrival_distance
            and apart <= self._parameters.arrival_agreement
        )


def position_error(
    parallax: ArrayLike, vector: ArrayLike, p_WA: ArrayLike
) -> float:
    """How far two positions disagree, by their distance [-], (2.14).

    Args:
        parallax: the parallax position [m], (2,).
        vector: the vector position [m], (2,).
        p_WA: the antenna's position [m], (2,).
    """
    p, v, a = (np.asarray(x, dtype=float) for x in (parallax, vector, p_WA))
    apart = _length(p - v)
    if apart == 0.0:
        return 0.0  # Also where the antenna is on both: no 0 / 0.
    # Halving a sum of the least numbers would give 0.
    return 2 * (apart / (_length(p - a) + _length(v - a)))


def is_outlier(position: ArrayLike, previous: Array, threshold: float) -> bool:
    """A two-sided z-test on each axis; an outlier on either is one.

    Args:
        position: the newest vector position [m], (2,).
        previous: those before it [m], (n, 2); below 3 none is an outlier.
        threshold: of the deviation in standard deviations [-].
    """
    if len(previous) < 3:
        return False
    deviation = np.abs(np.asarray(position) - previous.mean(axis=0))
    # A product, not a quotient: previous positions may all be the same.
    return bool(np.any(deviation > threshold * previous.std(axis=0, ddof=1)))


def _next_parallax(
    state: HybridState,
    p_WA: Array,
    bearing_W: float,
    vector: Array,
    parameters: HybridParameters,
) -> Array | None:
    if state.parallax is not None:
        return update_parallax(state.parallax, p_WA, bearing_W, parameters.k)
    assert state.first_p_WA is not None
    crossing = intersect_bearings(
        state.first_p_WA,
        state.first_bearing_W,
        p_WA,
        bearing_W,
        parameters.min_move,
        parameters.min_angle,
    )
    if crossing is None and state.readings + 1 >= parameters.buffer:
        return vector
    return crossing


def _length(v: Array) -> float:
    return math.hypot(v[0], v[1])
