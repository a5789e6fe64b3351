"""Worlds read from SDF by Drake's own parser: one truth for every reader."""

import os
import re
import tempfile
from dataclasses import replace
from pathlib import Path

from pydrake.geometry import GeometryId, GeometryInstance
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    MultibodyPlant,
)
from pydrake.systems.framework import DiagramBuilder

from drake_mobarm.exceptions import MapError, WorldError
from drake_mobarm.world.clean_copy import CleanCopy
from drake_mobarm.world.floor_plan_files import (
    MAP_SUFFIXES,
    map_files,
    read_floor_plan,
)
from drake_mobarm.world.floor_plan_world import floor_plan_sdf
from drake_mobarm.world.loaded import read_loaded
from drake_mobarm.world.meshes import MESHES
from drake_mobarm.world.sdf_files import write_copy
from drake_mobarm.world.world import WORLDS, World

WORLD_SUFFIXES = (".sdf", ".world", *MAP_SUFFIXES)
"""The endings of the files of worlds, in capitals or not."""

# The files that a world was read from and when they were changed, by its
# file and what became of meshes.
_known: dict[tuple[Path, str], tuple[dict[Path, int], World]] = {}
_MOST_KNOWN = 16


def world_names() -> list[str]:
    """The shipped worlds' names."""
    return sorted(path.stem for path in WORLDS.glob("*.sdf"))


def find_world(name_or_path: str) -> Path:
    """The file of a shipped world or a path.

    Raises:
        WorldError: there is no such world; it lists those there are.
    """
    if name_or_path in world_names():
        return WORLDS / f"{name_or_path}.sdf"
    # Unlike Path's own, it takes no offence at the longest of names.
    if name_or_path.lower().endswith(WORLD_SUFFIXES) and os.path.isfile(
        name_or_path
    ):
        return Path(name_or_path).resolve()
    shown = name_or_path
    if len(shown) > 80:
        shown = f"{shown[:60]}...{shown[-17:]}"
    raise WorldError(
        f"unknown world {shown!r}: valid are {', '.join(world_names())}, or "
        f"the path of a file that ends in {', '.join(WORLD_SUFFIXES)}"
    )


def load_world(name_or_path: str, meshes: str = "refuse") -> World:
    """Reads a world: an SDF of models that stand still, or a map's YAML.

    Of an SDF, boxes, spheres, cylinders, capsules and ellipsoids are read, and
    a level plane, which is the floor: the world is moved up or down so that
    the floor is at z = 0. The occupied cells of a map, which is read as
    `read_floor_plan` does, become walls 1.2 m high.

    Args:
        name_or_path: a shipped world's name, or the path of its file.
        meshes: `refuse` a mesh, or put oriented `boxes` or convex `hulls` in
            the places of its connected parts.

    Raises:
        WorldError: no such world, or the file holds something else; it
            names the first ten faults, each with its element and line.
        MapError: the map cannot be read.
    """
    if meshes not in MESHES:
        raise WorldError(f"meshes is {meshes!r}: valid is {', '.join(MESHES)}")
    path = find_world(name_or_path)
    files, world = _known.get((path, meshes), ({}, None))
    if world is None or any(_changed(f) != at for f, at in files.items()):
        is_map = path.suffix.lower() in MAP_SUFFIXES
        files, world = _load_map(path) if is_map else _load(path, meshes)
        _known.pop((path, meshes), None)
        _known[path, meshes] = files, world
        if len(_known) > _MOST_KNOWN:
            del _known[next(iter(_known))]
    return world


def _changed(file: Path) -> int:
    return file.stat().st_mtime_ns if file.exists() else 0


def _load_map(path: Path) -> tuple[dict[Path, int], World]:
    files = {file: _changed(file) for file in map_files(path)}
    plan = read_floor_plan(path)
    try:
        text = floor_plan_sdf(plan)
    except MapError as error:
        raise MapError(f"map {path}: {error}") from error
    with tempfile.TemporaryDirectory() as folder:
        building = Path(folder) / f"{path.stem}.sdf"
        building.write_text(text)
        _, world = _load(building, "refuse")
    return files, replace(world, path=path)


def _load(path: Path, meshes: str) -> tuple[dict[Path, int], World]:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    with tempfile.TemporaryDirectory() as folder:
        copy = CleanCopy(path, Path(folder), meshes)
        file = write_copy(copy)
        try:
            Parser(plant).AddModels(str(file))
            plant.Finalize()
        except (RuntimeError, ValueError) as error:
            raise WorldError(
                f"world {path}: {_explain(str(error), copy.frames)}"
            ) from error
    world = read_loaded(copy, plant, scene_graph.model_inspector())
    return copy.files, world


def _explain(message: str, frames: dict[str, str]) -> str:
    """What Drake's parser says, in the words of this library if it can be.

    Args:
        message: of the parser.
        frames: the names of frames that a file refers to, and where.
    """
    line = " ".join(message.split())
    for name in re.findall(r"\[([^][]*)\]", line):
        if name in frames:
            return (
                f"{frames[name]}: the frame {name!r} that it refers to is not "
                "there, or depends on it"
            )
    if "cycle" in line:
        return "the frames that its poses refer to depend on themselves"
    # The names of the copies say nothing.
    line = re.sub(r"\S*/\d+\.sdf(:\d+)?:? ?", "", line)
    return f"SDF does not allow it: {line.removeprefix('error: ')}"


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
