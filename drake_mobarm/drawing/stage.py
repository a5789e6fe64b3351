"""What a run looks like in Meshcat, live or recorded."""

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import (
    Cylinder,
    Meshcat,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    State,
)

from drake_mobarm.geometry import Array
from drake_mobarm.placement.planner import Placement
from drake_mobarm.signals import GroundTruth, TargetEstimate, size

FRAMES_PER_SECOND = 20.0
_BEACON = Rgba(0.10, 0.60, 0.25)
_ESTIMATE = Rgba(0.93, 0.45, 0.05)
_PATH = Rgba(0.10, 0.35, 0.80)
_SEGMENT = 0.10
_ARROW = 0.3
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
_HIDDEN = RigidTransform([0.0, 0.0, -10.0])


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

    def __init__(self, meshcat: Meshcat, beacon: list[float]) -> None:
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
        _draw_marker(meshcat, "beacon", _BEACON, 0.07)
        meshcat.SetTransform("beacon", RigidTransform([*beacon, 0.0]))
        _draw_marker(meshcat, "estimate", _ESTIMATE, 0.09)
        meshcat.SetTransform("estimate", _HIDDEN)

    def _draw(self, context: Context, state) -> None:  # type: ignore[no-untyped-def]
        time = context.get_time()
        target = TargetEstimate(self._target.Eval(context))
        if target.known > 0.5:
            X_WT = RigidTransform([target.x, target.y, 0.0])
        else:
            X_WT = _HIDDEN
        self._meshcat.SetTransform("estimate", X_WT, time)
        drawn = context.get_discrete_state(self._drawn).value()
        here = GroundTruth(self._truth.Eval(context))[:2]
        way = here - drawn[:2]
        length = float(np.hypot(*way))
        if np.isnan(length):
            state.set_value(self._drawn, [*here, 0.0])
        elif length > _SEGMENT:
            path = f"path/{int(drawn[2]):05d}"
            middle = (here + drawn[:2]) / 2
            turn = RollPitchYaw(0, np.pi / 2, np.arctan2(way[1], way[0]))
            self._meshcat.SetObject(path, Cylinder(0.02, length), _PATH)
            self._meshcat.SetTransform(
                path, RigidTransform(turn, [*middle, 0.02])
            )
            self._meshcat.SetProperty(path, "visible", False, 0.0)
            self._meshcat.SetProperty(path, "visible", True, time)
            state.set_value(self._drawn, [*here, drawn[2] + 1])


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
        self, meshcat: Meshcat, target: list[float], approach: list[float]
    ) -> None:
        super().__init__()
        self._meshcat = meshcat
        self._placement = self.DeclareAbstractInputPort(
            "placement", AbstractValue.Make(Placement)
        )
        self._drawn = self.DeclareAbstractState(Value("no target"))
        # A little after each frame's plan, or a run may end before it shows.
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / FRAMES_PER_SECOND, _AFTER_PLAN, self._draw
        )
        _draw_arrow(meshcat, "target", np.array(target), np.array(approach))

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


def add_visualizer(
    builder: DiagramBuilder, query_object: OutputPort, meshcat: Meshcat
) -> None:
    """Adds Drake's own visualizer, at the rate of the recording."""
    builder.AddNamedSystem(
        "visualizer",
        visualizer := MeshcatVisualizer(
            meshcat,
            MeshcatVisualizerParams(
                publish_period=1 / FRAMES_PER_SECOND,
                show_hydroelastic=False,
            ),
        ),
    )
    builder.Connect(query_object, visualizer.query_object_input_port())


def look_at_run(
    meshcat: Meshcat, start: list[float], beacon: list[float]
) -> None:
    """Even light, no grid, and start and beacon both well in view."""
    _light_stage(meshcat)
    a, b = np.array(start[:2]), np.array(beacon)
    middle = (a + b) / 2
    reach = max(float(np.abs(a - b).max()), 4.0)
    meshcat.SetCameraPose(
        [middle[0], middle[1] - 0.42 * reach, 0.62 * reach],
        [middle[0], middle[1] - 0.06 * reach, 0.0],
    )


def look_at_target(
    meshcat: Meshcat, target: list[float], approach: list[float]
) -> None:
    """Even light, and the target from where the tool comes, a little aside.

    Args:
        meshcat: where to look.
        target: p_WT of the tool's tip [m], (3,).
        approach: the tool's x axis in W, a unit vector, (3,).
    """
    _light_stage(meshcat)
    p_WT, back = np.array(target), -np.array(approach[:2])
    level = np.hypot(*back)
    back = back / level if level > 0.1 else np.array([0.0, -1.0])
    aside = np.array([-back[1], back[0]])
    meshcat.SetCameraPose(
        p_WT + np.array([*(1.2 * back + 0.9 * aside), 0.8]),
        p_WT + np.array([*(0.25 * back), -0.15]),
    )


def _light_stage(meshcat: Meshcat) -> None:
    """Even light, and no grid."""
    for path in ("/Grid", "/Axes", "/Lights/SpotLight"):
        meshcat.SetProperty(path, "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 1.1)
    meshcat.SetProperty("/Background", "top_color", [0.88, 0.90, 0.93])
    meshcat.SetProperty("/Background", "bottom_color", [0.97, 0.97, 0.98])


def _draw_arrow(
    meshcat: Meshcat, path: str, tip: Array, direction: Array
) -> None:
    """An arrow that ends at a point, shaft and ball."""
    X_WA = RigidTransform(RotationMatrix.MakeFromOneVector(direction, 2), tip)
    meshcat.SetObject(f"{path}/shaft", Cylinder(0.006, _ARROW), _ESTIMATE)
    meshcat.SetTransform(
        f"{path}/shaft",
        X_WA @ RigidTransform([0, 0, -_ARROW / 2]),
    )
    meshcat.SetObject(f"{path}/ball", Sphere(0.018), _ESTIMATE)
    meshcat.SetTransform(f"{path}/ball", X_WA)


def _draw_marker(
    meshcat: Meshcat, path: str, color: Rgba, radius: float
) -> None:
    """A ball on a thin pole, to be seen over the furniture."""
    meshcat.SetObject(f"{path}/pole", Cylinder(0.012, 1.2), color)
    meshcat.SetTransform(f"{path}/pole", RigidTransform([0, 0, 0.6]))
    meshcat.SetObject(f"{path}/ball", Sphere(radius), color)
    meshcat.SetTransform(f"{path}/ball", RigidTransform([0, 0, 1.2]))
    disc = Rgba(color.r(), color.g(), color.b(), 0.35)
    meshcat.SetObject(f"{path}/disc", Cylinder(0.3, 0.01), disc)
    meshcat.SetTransform(f"{path}/disc", RigidTransform([0, 0, 0.01]))
