"""Brushes for Meshcat, live or recorded: light, markers, arrows, paths."""

from collections.abc import Sequence

import numpy as np
from pydrake.geometry import Cylinder, Meshcat, Rgba, Sphere
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from drake_mobarm.geometry import Array

FRAMES_PER_SECOND = 20.0
"""Of views, live and recorded."""

BEACON = Rgba(0.10, 0.60, 0.25)
ESTIMATE = Rgba(0.93, 0.45, 0.05)
PATH = Rgba(0.10, 0.35, 0.80)

HIDDEN = RigidTransform([0.0, 0.0, -10.0])
"""Where things are that are not to be seen."""

_ARROW = 0.3
_RIBBON = 0.06


def light_stage(meshcat: Meshcat) -> None:
    """Even light, and neither grid nor axes."""
    for path in ("/Grid", "/Axes", "/Lights/SpotLight"):
        meshcat.SetProperty(path, "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 1.1)
    meshcat.SetProperty("/Background", "top_color", [0.88, 0.90, 0.93])
    meshcat.SetProperty("/Background", "bottom_color", [0.97, 0.97, 0.98])


def frame_places(
    meshcat: Meshcat, start: Sequence[float], end: Sequence[float]
) -> None:
    """Sets the camera so that two places in W [m], (2,), are well in view."""
    a, b = np.array(start), np.array(end)
    middle = (a + b) / 2
    reach = max(float(np.abs(a - b).max()), 4.0)
    meshcat.SetCameraPose(
        [middle[0], middle[1] - 0.42 * reach, 0.62 * reach],
        [middle[0], middle[1] - 0.06 * reach, 0.0],
    )


def draw_arrow(
    meshcat: Meshcat, path: str, tip: Array, direction: Array
) -> None:
    """An arrow that ends at a point, shaft and ball."""
    X_WA = RigidTransform(RotationMatrix.MakeFromOneVector(direction, 2), tip)
    meshcat.SetObject(f"{path}/shaft", Cylinder(0.006, _ARROW), ESTIMATE)
    meshcat.SetTransform(
        f"{path}/shaft",
        X_WA @ RigidTransform([0, 0, -_ARROW / 2]),
    )
    meshcat.SetObject(f"{path}/ball", Sphere(0.018), ESTIMATE)
    meshcat.SetTransform(f"{path}/ball", X_WA)


def draw_marker(
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


def draw_path_piece(
    meshcat: Meshcat, path: str, start: Array, end: Array, time: float
) -> None:
    """A piece of a path on the floor that appears at a time.

    Args:
        meshcat: where to draw.
        path: of the piece in Meshcat's tree.
        start: in W [m], (2,).
        end: in W [m], (2,).
        time: of the recording [s].
    """
    way, middle = end - start, (end + start) / 2
    turn = RollPitchYaw(0, np.pi / 2, np.arctan2(way[1], way[0]))
    meshcat.SetObject(path, Cylinder(0.02, float(np.hypot(*way))), PATH)
    meshcat.SetTransform(path, RigidTransform(turn, [*middle, 0.02]))
    meshcat.SetProperty(path, "visible", False, 0.0)
    meshcat.SetProperty(path, "visible", True, time)


def draw_ribbon(
    meshcat: Meshcat, path: str, corners: Array, color: Rgba
) -> None:
    """A flat band on the floor along corners p_WQ in W [m], (k, 2)."""
    steps = np.diff(corners, axis=0)
    length = np.hypot(steps[:, 0], steps[:, 1])
    long = length > 0
    start, end = corners[:-1][long], corners[1:][long]
    side = _RIBBON / 2 * steps[long] / length[long, None] @ [[0, 1], [-1, 0]]
    if not len(side):
        return
    sheet = np.stack([start + side, start - side, end - side, end + side], 1)
    vertices = np.column_stack(
        [sheet.reshape(-1, 2), np.full(4 * len(side), 0.03)]
    )
    first = 4 * np.arange(len(side))[:, None, None]
    faces = (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    meshcat.SetTriangleMesh(path, vertices.T, faces.T, color)
