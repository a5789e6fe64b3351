"""What Drake has read of a world: shapes where they stand, and the floor."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    SceneGraphInspector,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex

from drake_mobarm.exceptions import WorldError
from drake_mobarm.geometry import Array
from drake_mobarm.world.clean_copy import CleanCopy, Part
from drake_mobarm.world.obstacles import (
    Obstacle,
    box_corners,
    capsule_corners,
    capsule_edges,
    cylinder_corners,
    ellipsoid_corners,
    hull_edges,
)
from drake_mobarm.world.world import FARTHEST, World

# A plane's slope [-], the heights of two planes [m], and a link's pose in a
# state [m, rad] may be this far off: files are written with few digits.
_SAME = 1e-3


def read_loaded(
    copy: CleanCopy, plant: MultibodyPlant, inspector: SceneGraphInspector
) -> World:
    """The world that Drake has read from a copy.

    It is moved up or down so that its floor, a level plane, is at z = 0.

    Args:
        copy: of the world's files.
        plant: finalized, with nothing in it but the world.
        inspector: of the plant's scene graph.

    Raises:
        WorldError: Drake has read something else than the files say, or the
            shapes are not where a world can have them.
    """
    context = plant.CreateDefaultContext()
    found: list[tuple[Part, GeometryInstance]] = []
    X_WL = {}
    for number in range(plant.num_bodies()):
        body = plant.get_body(BodyIndex(number))
        X_WB = body.EvalPoseInWorld(context)
        model = plant.GetModelInstanceName(body.model_instance())
        X_WL[f"{model}::{body.name()}"] = X_WB
        frame = plant.GetBodyFrameIdOrThrow(body.index())
        for geometry in inspector.GetGeometries(frame):
            instance = inspector.CloneGeometryInstance(geometry)
            instance.set_pose(X_WB @ instance.pose())
            index = int(instance.name().rpartition("part_")[2])
            part = copy.parts[index]
            _check_shape(copy, part, instance.shape(), plant.IsAnchored(body))
            found.append((part, instance))
    if len(found) != len(copy.parts):
        raise WorldError(
            f"world {copy.world}: Drake reads {len(found)} of its "
            f"{len(copy.parts)} collisions and visuals"
        )
    _check_states(copy, X_WL)
    floor = _floor(copy, found)
    obstacles, geometries = [], []
    for part, instance in found:
        if part.shape == "plane":
            continue
        X_WG = instance.pose()
        X_WG.set_translation(X_WG.translation() - [0, 0, floor])
        for shape, X_GP, corners, edges in _solids(part, instance.shape()):
            X_WP = X_WG @ X_GP
            p_WV = X_WP.multiply(corners.T).T
            if not (np.abs(p_WV) < FARTHEST).all():
                copy.problems.append(
                    f"{part.where}: {part.label} is further than "
                    f"{FARTHEST / 1000:g} km from the origin"
                )
                break
            solid = instance
            if part.mesh is not None:
                solid = _with_shape(instance, shape)
            solid.set_pose(X_WP)
            solid.set_name(part.name or part.label)
            if solid.proximity_properties() is not None:
                obstacles.append(Obstacle(solid.name(), p_WV, edges))
            geometries.append(solid)
    copy.raise_problems()
    return World(
        copy.world.stem, copy.world, tuple(obstacles), tuple(geometries)
    )


def _with_shape(instance: GeometryInstance, shape: Shape) -> GeometryInstance:
    """Another shape with the properties of an instance."""
    other = GeometryInstance(instance.pose(), shape, instance.name())
    illustration = instance.illustration_properties()
    if illustration is not None:
        other.set_illustration_properties(illustration)
    proximity = instance.proximity_properties()
    if proximity is not None:
        other.set_proximity_properties(proximity)
    return other


def _check_shape(
    copy: CleanCopy, part: Part, shape: Shape, stands_still: bool
) -> None:
    """What Drake has read has to be what the file says."""
    same = type(shape).__name__ == (
        "HalfSpace" if part.shape == "plane" else part.shape.capitalize()
    ) and (part.shape == "plane" or _extents(shape) == part.extents)
    if not (same and stands_still):
        copy.problems.append(
            f"{part.where}: Drake reads {part.label} otherwise, as {shape!r}"
            f"{'' if stands_still else ' that can move'}"
        )


def _check_states(copy: CleanCopy, X_WL: dict[str, RigidTransform]) -> None:
    """The links have to be where a `<state>` has them, if there is one."""
    for state in copy.link_states:
        name = f"{state.model}::{state.link}"
        X_WS = RigidTransform(RollPitchYaw(state.pose[3:]), state.pose[:3])
        away = X_WL.get(name)
        why = "there is no such link"
        if away is not None:
            why = "its model has it elsewhere"
            X_SL = X_WS.inverse() @ away
            if np.abs(X_SL.GetAsMatrix4() - np.eye(4)).max() < _SAME:
                continue
        copy.problems.append(
            f"{state.where}: <state> places link {name!r}, but {why}: remove "
            "<state>"
        )


def _floor(
    copy: CleanCopy, found: list[tuple[Part, GeometryInstance]]
) -> float:
    """The height of the level planes, 0 where there are none [m]."""
    floors = []
    for part, instance in found:
        if part.shape != "plane":
            continue
        X_WG = instance.pose()
        normal = X_WG.rotation().col(2)
        if np.abs(normal - [0, 0, 1]).max() > _SAME:
            copy.problems.append(
                f"{part.where}: {part.label} is a plane that is not level, "
                "and only a floor can be a plane"
            )
        else:
            floors.append((part, float(X_WG.translation()[2])))
    for part, height in floors[1:]:
        first, floor = floors[0]
        if abs(height - floor) > _SAME:
            copy.problems.append(
                f"{part.where}: {part.label} is a floor at z = {height:g} m, "
                f"and {first.label} of {first.where} is one at {floor:g} m"
            )
    return floors[0][1] if floors else 0.0


def _solids(
    part: Part, shape: Shape
) -> Iterator[tuple[Shape, RigidTransform, Array, NDArray[np.int_] | None]]:
    """The convex bodies S of a part P.

    Yields:
        Drake's shape, its pose X_PS, its corners p_SV [m], (n, 3), and their
        edges, where they are many.
    """
    if part.mesh is None:
        corners, edges = _corners(shape)
        yield shape, RigidTransform(), corners, edges
        return
    for solid in part.mesh:
        edges = None
        if solid.size is not None:
            shape = Box(solid.size)
        else:
            shape = Convex(solid.corners.T, part.label)
            edges = hull_edges(solid.corners)
        yield shape, RigidTransform(solid.X_MP), solid.corners, edges


def _extents(shape: Shape) -> tuple[float, ...]:
    """The shape's numbers, as `Part` has them."""
    if isinstance(shape, Box):
        return tuple(shape.size())
    if isinstance(shape, Sphere):
        return (shape.radius(),)
    if isinstance(shape, Cylinder | Capsule):
        return (shape.radius(), shape.length())
    assert isinstance(shape, Ellipsoid)
    return (shape.a(), shape.b(), shape.c())


def _corners(shape: Shape) -> tuple[Array, NDArray[np.int_] | None]:
    """The corners of a shape's convex body, and their edges if many."""
    extents = _extents(shape)
    if isinstance(shape, Box):
        return box_corners(np.array(extents)), None
    if isinstance(shape, Cylinder):
        return cylinder_corners(*extents), None
    if isinstance(shape, Ellipsoid):
        return ellipsoid_corners(np.array(extents)), capsule_edges()
    length = shape.length() if isinstance(shape, Capsule) else 0.0
    return capsule_corners(shape.radius(), length), capsule_edges()
