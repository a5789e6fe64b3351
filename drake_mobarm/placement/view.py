"""What Meshcat shows of placement: the target, and the squares in reach."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, LeafSystem, State

from drake_mobarm.drawing.stage import (
    FRAMES_PER_SECOND,
    draw_arrow,
    light_stage,
)
from drake_mobarm.placement.job import PlacementScenario
from drake_mobarm.placement.planner import Placement

# A little after each frame's plan, or a run may end before it shows [s].
_AFTER_PLAN = 0.01
# Squares fade from the best one's colour to that of one so many times worse.
_SHADED_UP_TO = 4.0
_RAMP_AT = (0.0, 0.35, 0.7, 1.0)
_RAMP = np.array(
    [
        [0.27, 0.00, 0.33],
        [0.19, 0.41, 0.56],
        [0.21, 0.72, 0.47],
        [0.99, 0.91, 0.14],
    ]
)


def set_stage(meshcat: Meshcat, scenario: PlacementScenario) -> None:
    """Even light, and the target from where the tool comes, a little aside."""
    light_stage(meshcat)
    p_WT, back = np.array(scenario.target), -np.array(scenario.approach[:2])
    level = np.hypot(*back)
    back = back / level if level > 0.1 else np.array([0.0, -1.0])
    aside = np.array([-back[1], back[0]])
    meshcat.SetCameraPose(
        p_WT + np.array([*(1.2 * back + 0.9 * aside), 0.8]),
        p_WT + np.array([*(0.25 * back), -0.15]),
    )


class PlacementView(LeafSystem):
    """Draws a tool target, and each new plan's attractive squares.

    .. pydrake_system::

        name: PlacementView
        input_ports:
        - placement

    - placement: abstract, Placement.

    Args:
        meshcat: where to draw.
        target: p_WT of the tool's tip [m], (3,).
        approach: the tool's x axis in W, a unit vector, (3,).
    """

    def __init__(
        self,
        meshcat: Meshcat,
        target: Sequence[float],
        approach: Sequence[float],
    ) -> None:
        super().__init__()
        self._meshcat = meshcat
        self._placement = self.DeclareAbstractInputPort(
            "placement", AbstractValue.Make(Placement)
        )
        self._drawn = self.DeclareAbstractState(Value("no target"))
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / FRAMES_PER_SECOND, _AFTER_PLAN, self._draw
        )
        draw_arrow(meshcat, "target", np.array(target), np.array(approach))

    def _draw(self, context: Context, state: State) -> None:
        placement: Placement = self._placement.Eval(context)
        label = str(placement.target)
        index = int(self._drawn)
        if context.get_abstract_state(index).get_value() == label:
            return
        state.get_mutable_abstract_state(index).set_value(label)
        corners = placement.grid.corners()[placement.squares]
        if not len(corners):
            self._meshcat.Delete("squares")
            return
        value = np.log(placement.objective)
        share = np.clip((value - value[0]) / np.log(_SHADED_UP_TO), 0, 1)
        colors = np.column_stack(
            [np.interp(share, _RAMP_AT, channel) for channel in _RAMP.T]
        )
        vertices = np.full((len(corners), 4, 3), 0.004)
        vertices[..., :2] = corners
        first = 4 * np.arange(len(corners))
        faces = np.concatenate(
            [[first, first + 1, first + 2], [first, first + 2, first + 3]],
            axis=1,
        )
        self._meshcat.SetTriangleColorMesh(
            "squares",
            vertices.reshape(-1, 3).T,
            faces,
            np.repeat(colors, 4, axis=0).T,
        )
