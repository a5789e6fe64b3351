"""A guard around an estimator: it arrives only where bearings confirm it.

The conditions of section 2.3.1.3 compare two positions that both follow the
strength: where it is wrong, both may agree at a wrong place.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from drake_mobarm.geometry import Array
from drake_mobarm.homing.filter import FilterEstimator, FilterState
from drake_mobarm.homing.hybrid import HybridEstimator, HybridState
from drake_mobarm.immutable import Immutable


@dataclass(frozen=True, kw_only=True, eq=False)
class ConfirmedState(Immutable):
    """The states of the guarded estimator and of its witness."""

    guarded: HybridState
    witness: FilterState


class ConfirmedHybrid:
    """The hybrid estimator with the filter as a witness; a `TargetLaw`.

    The estimate is the hybrid's own. Only an arrival needs the witness.

    Args:
        hybrid: the estimator.
        witness: what has to confirm an arrival.
    """

    def __init__(
        self, hybrid: HybridEstimator, witness: FilterEstimator
    ) -> None:
        self._hybrid, self._witness = hybrid, witness

    def initial_state(self) -> ConfirmedState:
        """The state before the first reading."""
        return ConfirmedState(
            guarded=self._hybrid.initial_state(),
            witness=self._witness.initial_state(),
        )

    def update(
        self,
        state: ConfirmedState,
        p_WA: Array,
        bearing_W: float,
        distance: float,
    ) -> ConfirmedState:
        """The state after a reading, as `TargetLaw.update` has it."""
        guarded = self._hybrid.update(state.guarded, p_WA, bearing_W, distance)
        witness = self._witness.update(state.witness, p_WA, bearing_W, distance)
        if guarded is state.guarded and witness is state.witness:
            return state
        return ConfirmedState(guarded=guarded, witness=witness)

    def estimate(self, state: ConfirmedState) -> Array | None:
        """The hybrid's estimate p_WT [m], (2,), or None before a reading."""
        return self._hybrid.estimate(state.guarded)

    def arrived(self, state: ConfirmedState, p_WB: Iterable[float]) -> bool:
        """Whether the hybrid has arrived, and bearings confirm where.

        Args:
            state: of both.
            p_WB: the base's position by odometry [m], (2,).
        """
        p_WB = list(p_WB)
        p_WT: Any = self._hybrid.estimate(state.guarded)
        return self._hybrid.arrived(
            state.guarded, p_WB
        ) and self._witness.confirms(state.witness, p_WT)
