"""Convex bodies in the place of a mesh, which no planner here can read."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError

from drake_mobarm.geometry import Array
from drake_mobarm.world.obstacles import box_corners

MESHES = ("refuse", "boxes", "hulls")
"""What can be done with a mesh: refuse it, or put an oriented box or the
convex hull in the place of each of its connected parts."""

FORMATS = (".dae", ".obj", ".stl")
"""The endings of the files of meshes that are read."""

_MOST_PARTS = 2000
# Vertices so near to each other are one [m].
_SAME = 1e-5
# A part without thickness gets this one [m].
_THINNEST = 1e-3


class MeshError(ValueError):
    """A mesh cannot be read; it says why."""


@dataclass(frozen=True, eq=False)
class MeshPart:
    """A convex body in the place of a connected part of a mesh M.

    Attributes:
        X_MP: pose of the body's frame P, (4, 4).
        corners: p_PV [m], (n, 3).
        size: edge lengths of a box about P's origin [m], (3,), or None where
            the body is the convex hull of its corners.
    """

    X_MP: Array
    corners: Array
    size: Array | None


def mesh_parts(file: Path, scale: Array, kind: str) -> list[MeshPart]:
    """The convex bodies that stand for a mesh.

    Args:
        file: of one of `FORMATS`.
        scale: of the mesh along x, y and z, (3,).
        kind: one of `MESHES`, other than `refuse`.

    Raises:
        MeshError: the file cannot be read, or has too many parts.
    """
    vertices, faces = _load(file)
    if not len(faces) or not np.isfinite(vertices).all():
        raise MeshError(f"{file} holds no faces of finite corners")
    found = _connected(vertices, faces)
    if len(found) > _MOST_PARTS:
        raise MeshError(
            f"{file} has {len(found)} parts that are not connected, more than "
            f"{_MOST_PARTS}"
        )
    parts = []
    for corners in found:
        hull = _hull(corners * scale) if kind == "hulls" else None
        parts.append(_box(corners * scale) if hull is None else hull)
    return parts


def _load(file: Path) -> tuple[Array, NDArray[np.int_]]:
    """Vertices in M [m], (n, 3), and the faces' indices, (k, 3)."""
    if file.suffix.lower() not in FORMATS:
        raise MeshError(f"{file.name} is none of {', '.join(FORMATS)}")
    try:
        import trimesh

        if file.suffix.lower() == ".dae":
            import collada  # noqa: F401
    except ImportError as error:
        raise MeshError(
            f"{file.name} needs {error.name}: pip install "
            "'drake_mobarm[meshes]'"
        ) from error
    try:
        with np.errstate(all="ignore"):
            mesh = trimesh.load_mesh(file, process=False, skip_materials=True)
    # A broken file fails with whatever its reader meets first.
    except Exception as error:
        raise MeshError(f"{file} is no mesh that can be read") from error
    # COLLADA files tell the length of their unit, as in "0.0254 * meters".
    length, separator, _ = (mesh.units or "").partition("*")
    unit = float(length) if separator else 1.0
    return unit * np.asarray(mesh.vertices), np.asarray(mesh.faces)


def _connected(vertices: Array, faces: NDArray[np.int_]) -> list[Array]:
    """The vertices of each connected part, (n_i, 3), each once."""
    _, first, same = np.unique(
        np.round(vertices / _SAME),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    joined = same.reshape(-1)[faces]
    rows, columns = joined[:, [0, 1]].ravel(), joined[:, [1, 2]].ravel()
    links = coo_array(
        (np.ones(len(rows)), (rows, columns)), shape=(len(first), len(first))
    )
    count, label = connected_components(links, directed=False)
    used = np.unique(joined)
    parts = (used[label[used] == number] for number in range(count))
    return [vertices[first[part]] for part in parts if len(part)]


def _hull(corners: Array) -> MeshPart | None:
    """The convex hull, or None where the corners are in one plane."""
    try:
        hull = ConvexHull(corners)
    except QhullError:
        return None
    return MeshPart(np.eye(4), corners[hull.vertices], None)


def _box(corners: Array) -> MeshPart:
    """The smallest box about the corners."""
    import trimesh

    try:
        with np.errstate(all="ignore"):
            X_PM, size = trimesh.bounds.oriented_bounds(corners)
    # All corners are on one line, or fewer than three: it does not expect so.
    except (TypeError, IndexError, QhullError):
        size = np.ptp(corners, axis=0)
        X_PM = np.eye(4)
        X_PM[:3, 3] = -(corners.min(axis=0) + size / 2)
    size = np.maximum(size, _THINNEST)
    return MeshPart(np.linalg.inv(X_PM), box_corners(size), size)
