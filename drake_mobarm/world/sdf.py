"""Worlds read from SDF by Drake's own parser: one truth for every reader."""

import math
import xml.etree.ElementTree as ElementTree
from functools import lru_cache
from pathlib import Path

import numpy as np
from pydrake.geometry import (
    Box,
    Cylinder,
    GeometryId,
    GeometryInstance,
    SceneGraph,
)
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    MultibodyPlant,
)
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import DiagramBuilder

from drake_mobarm.exceptions import WorldError
from drake_mobarm.geometry import Array
from drake_mobarm.world.obstacles import (
    Obstacle,
    box_corners,
    cylinder_corners,
)
from drake_mobarm.world.world import World

WORLDS = Path(__file__).resolve().parent.parent / "models" / "worlds"
"""The folder of the shipped worlds."""

_EXTENTS = {"box": {"size": 3}, "cylinder": {"radius": 1, "length": 1}}
"""What SDF calls the extents of the valid shapes, and how many numbers."""


def world_names() -> list[str]:
    """The shipped worlds' names."""
    return sorted(path.stem for path in WORLDS.glob("*.sdf"))


def find_world(name_or_path: str) -> Path:
    """The SDF file of a shipped world or a path.

    Raises:
        WorldError: there is no such world; it lists those there are.
    """
    if name_or_path in world_names():
        return WORLDS / f"{name_or_path}.sdf"
    path = Path(name_or_path)
    if path.suffix == ".sdf" and path.is_file():
        return path.resolve()
    raise WorldError(
        f"unknown world {name_or_path!r}: valid are "
        f"{', '.join(world_names())}, or the path of an .sdf file"
    )


def load_world(name_or_path: str) -> World:
    """Reads a world: an SDF of static boxes and cylinders.

    Raises:
        WorldError: no such world, or the file holds something else; it
            names the file and the element.
    """
    path = find_world(name_or_path)
    return _load(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=16)
def _load(path: Path, _modified: int) -> World:
    _check_shapes(path)
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    try:
        Parser(plant).AddModels(str(path))
        plant.Finalize()
    except RuntimeError as error:
        line = " ".join(str(error).split())
        raise WorldError(f"world {path}: {line}") from error
    obstacles, geometries = _read_geometries(plant, scene_graph, path)
    return World(path.stem, path, obstacles, geometries)


def _check_shapes(path: Path) -> None:
    """Names a wrong shape before Drake tries to load what it refers to."""
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise WorldError(f"world {path}: not valid XML: {error}") from error
    if root.tag != "sdf":
        raise WorldError(f"world {path}: the root is <{root.tag}>, not <sdf>")
    for owner in root.iter():
        if owner.tag not in ("collision", "visual"):
            continue
        name = f"world {path}: {owner.tag} {owner.get('name')!r}"
        shapes = owner.findall("geometry/*")
        if len(shapes) != 1 or shapes[0].tag not in _EXTENTS:
            found = ", ".join(shape.tag for shape in shapes) or "nothing"
            raise WorldError(
                f"{name} is a {found}; a world is made of box and cylinder"
            )
        # sdformat would put its own sizes in the place of such.
        for tag, count in _EXTENTS[shapes[0].tag].items():
            if not _is_positive(shapes[0].findtext(tag, ""), count):
                raise WorldError(
                    f"{name} needs a {tag} of {count} finite number(s) above 0"
                )


def _is_positive(text: str, count: int) -> bool:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        return False
    return len(numbers) == count and all(0 < x < math.inf for x in numbers)


def _read_geometries(
    plant: MultibodyPlant, scene_graph: SceneGraph, path: Path
) -> tuple[tuple[Obstacle, ...], tuple[GeometryInstance, ...]]:
    inspector = scene_graph.model_inspector()
    context = plant.CreateDefaultContext()
    obstacles, geometries = [], []
    for number in range(plant.num_bodies()):
        body = plant.get_body(BodyIndex(number))
        if not plant.IsAnchored(body):
            raise WorldError(
                f"world {path}: link {body.name()!r} can move; write "
                "<static>true</static> in its model"
            )
        X_WB = body.EvalPoseInWorld(context)
        frame = plant.GetBodyFrameIdOrThrow(body.index())
        for geometry in inspector.GetGeometries(frame):
            instance = inspector.CloneGeometryInstance(geometry)
            X_WG = X_WB @ instance.pose()
            name = instance.name().split("::")[-1]
            if not np.isfinite(X_WG.GetAsMatrix4()).all():
                raise WorldError(f"world {path}: {name!r} is not finite")
            instance.set_pose(X_WG)
            instance.set_name(name)
            geometries.append(instance)
            if instance.proximity_properties() is not None:
                corners = X_WG.multiply(_corners(instance.shape()).T).T
                obstacles.append(Obstacle(name, corners))
    return tuple(obstacles), tuple(geometries)


def _corners(shape: Box | Cylinder) -> Array:
    if isinstance(shape, Box):
        return box_corners(np.asarray(shape.size()))
    return cylinder_corners(shape.radius(), shape.length())


def add_world(plant: MultibodyPlant, world: World) -> list[GeometryId]:
    """Puts a world's geometries on the plant's world body.

    There they are anchored; on links of their own, even on welded ones, Drake
    would place each of them anew at every step.

    Returns:
        What can be touched.
    """
    touchable = []
    body = plant.world_body()
    for number, instance in enumerate(world.geometries):
        # Names of a file need not be unique, nor other than ours.
        name = f"{instance.name()} ({world.name} {number})"
        place = (instance.pose(), instance.shape(), name)
        proximity = instance.proximity_properties()
        if proximity is not None:
            touchable.append(
                plant.RegisterCollisionGeometry(body, *place, proximity)
            )
        illustration = instance.illustration_properties()
        if illustration is not None:
            visual = GeometryInstance(*place)
            visual.set_illustration_properties(illustration)
            plant.RegisterVisualGeometry(body, visual)
    return touchable
