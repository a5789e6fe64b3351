"""What Meshcat shows of homing: beacon, estimate, and the path driven."""

from collections.abc import Sequence

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_mobarm.drawing.stage import (
    BEACON,
    ESTIMATE,
    FRAMES_PER_SECOND,
    HIDDEN,
    draw_marker,
    draw_path_piece,
    frame_places,
    light_stage,
)
from drake_mobarm.homing.job import HomingScenario
from drake_mobarm.signals import GroundTruth, TargetEstimate, size

# The drawn path has a corner at least so often [m].
_SEGMENT = 0.10


def set_stage(meshcat: Meshcat, scenario: HomingScenario) -> None:
    """Even light, no grid, and start and beacon both well in view."""
    light_stage(meshcat)
    frame_places(meshcat, scenario.start[:2], scenario.beacon)


class HomingView(LeafSystem):
    """Draws the beacon, its estimate as it moves, and the path driven.

    .. pydrake_system::

        name: HomingView
        input_ports:
        - ground_truth
        - estimated_target

    - ground_truth (7): GroundTruth.
    - estimated_target (3): TargetEstimate in W.

    Args:
        meshcat: where to draw.
        beacon: p_WT of the beacon [m], (2,).
    """

    def __init__(self, meshcat: Meshcat, beacon: Sequence[float]) -> None:
        super().__init__()
        self._meshcat = meshcat
        self._truth = self.DeclareVectorInputPort(
            "ground_truth", size(GroundTruth)
        )
        self._target = self.DeclareVectorInputPort(
            "estimated_target", size(TargetEstimate)
        )
        # The last corner of the drawn path, and how many pieces it has.
        self._drawn = self.DeclareDiscreteState([np.nan, np.nan, 0.0])
        self.DeclarePeriodicDiscreteUpdateEvent(
            1 / FRAMES_PER_SECOND, 0.0, self._draw
        )
        draw_marker(meshcat, "beacon", BEACON, 0.07)
        meshcat.SetTransform("beacon", RigidTransform([*beacon, 0.0]))
        draw_marker(meshcat, "estimate", ESTIMATE, 0.09)
        meshcat.SetTransform("estimate", HIDDEN)

    def _draw(self, context: Context, state: DiscreteValues) -> None:
        time = context.get_time()
        target = TargetEstimate(self._target.Eval(context))
        if target.known > 0.5:
            X_WT = RigidTransform([target.x, target.y, 0.0])
        else:
            X_WT = HIDDEN
        self._meshcat.SetTransform("estimate", X_WT, time)
        drawn = context.get_discrete_state(self._drawn).value()
        here = GroundTruth(self._truth.Eval(context))[:2]
        way = here - drawn[:2]
        length = float(np.hypot(*way))
        if np.isnan(length):
            state.set_value(self._drawn, [*here, 0.0])
        elif length > _SEGMENT:
            draw_path_piece(
                self._meshcat,
                f"path/{int(drawn[2]):05d}",
                drawn[:2],
                here,
                time,
            )
            state.set_value(self._drawn, [*here, drawn[2] + 1])
