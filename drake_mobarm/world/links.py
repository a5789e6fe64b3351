"""Links in an SDF: collisions and visuals, and the shapes that are read."""

from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from drake_mobarm.world.clean_copy import Part
from drake_mobarm.world.document import Node
from drake_mobarm.world.elements import Elements, add, label, text_of
from drake_mobarm.world.meshes import MeshError, MeshPart, mesh_parts
from drake_mobarm.world.resources import ResourceError, find_resource

SHAPES = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "ellipsoid": {"radii": 3},
}
"""The solid shapes, what SDF calls their extents, and how many numbers."""

SMALLEST = 1e-6
"""The least extent of a shape that can be told from none [m]."""

_VALID = f"valid are {', '.join(SHAPES)} and a level plane"


@dataclass(frozen=True)
class Shape:
    """A shape as `Part` has it, and the element of the file that has it."""

    name: str
    extents: tuple[float, ...]
    node: Node
    mesh: list[MeshPart] | None = None


def copy_link(elements: Elements, node: Node, out: Element) -> None:
    """Copies what can be touched and drawn of a link.

    Where a visual's shape cannot be drawn, the link's collisions are drawn
    instead of its visuals.

    Args:
        elements: of the file.
        node: the link.
        out: its copy.
    """
    elements.pose(node, out)
    collisions = node.all("collision")
    visuals = node.all("visual")
    solid = [
        (owner, shape)
        for owner in collisions
        if (shape := _read_shape(elements, owner)) is not None
    ]
    for owner, shape in solid:
        copy_part(elements, owner, shape, "collision", out)
    if collisions and any(map(_is_not_drawn, visuals)):
        drawn = solid
    else:
        drawn = [
            (owner, shape)
            for owner in visuals
            if (shape := _read_shape(elements, owner)) is not None
        ]
    for owner, shape in drawn:
        if shape.name != "plane":
            copy_part(elements, owner, shape, "visual", out)


def copy_part(
    elements: Elements, owner: Node, shape: Shape, tag: str, out: Element
) -> None:
    """Copies a collision or visual under a name of its own.

    Args:
        elements: of the file.
        owner: what has the shape.
        shape: to copy.
        tag: `collision` or `visual`.
        out: the copy of the link.
    """
    parts = elements.copy.parts
    part = SubElement(out, tag, name=f"part_{len(parts)}")
    parts.append(
        Part(
            owner.name,
            label(owner),
            elements.where(owner),
            shape.name,
            shape.extents,
            shape.mesh,
        )
    )
    elements.pose(owner, part)
    copied = add(add(part, "geometry"), shape.name)
    if shape.name == "plane":
        add(copied, "normal", text_of(list(shape.extents)))
        add(copied, "size", "1 1")
    else:
        numbers = list(shape.extents)
        for extent, count in SHAPES[shape.name].items():
            add(copied, extent, text_of(numbers[:count]))
            del numbers[:count]
    if tag == "collision":
        _copy_friction(elements, owner, part)
    else:
        _copy_colour(elements, owner, part)


def read_plane(elements: Elements, owner: Node, node: Node) -> Shape | None:
    """The shape of a `<plane>`: its extents are its normal."""
    normal = elements.only(node, "normal")
    numbers: list[float] | None = [0.0, 0.0, 1.0]
    if normal is not None:
        numbers = elements.numbers(owner, normal, 3)
    if numbers is None:
        return None
    if not any(numbers):
        elements.problem(node, f"{label(owner)}: its plane has no normal")
        return None
    return Shape("plane", tuple(numbers), node)


def _is_not_drawn(visual: Node) -> bool:
    geometry = visual.find("geometry")
    tags = set() if geometry is None else {shape.tag for shape in geometry}
    return bool(tags - {"empty", "plane", *SHAPES})


def _read_shape(elements: Elements, owner: Node) -> Shape | None:
    """The shape of a collision or visual, None if it has no valid one."""
    geometry = elements.only(owner, "geometry")
    nodes = [] if geometry is None else list(geometry)
    if len(nodes) != 1:
        found = ", ".join(f"<{node.tag}>" for node in nodes)
        elements.problem(
            owner,
            f"{label(owner)} has "
            + (f"several shapes, {found}" if nodes else "no shape")
            + f": {_VALID}",
        )
        return None
    (node,) = nodes
    if node.tag == "empty":
        return None
    if node.tag == "plane":
        return read_plane(elements, owner, node)
    if node.tag == "mesh":
        return _read_mesh(elements, owner, node)
    if node.tag not in SHAPES:
        elements.problem(owner, f"{label(owner)} is a {node.tag}: {_VALID}")
        return None
    extents: list[float] = []
    for tag, count in SHAPES[node.tag].items():
        # sdformat would put sizes of its own in the place of missing ones.
        child = elements.only(node, tag)
        if child is None:
            elements.problem(
                node, f"{node.tag} of {label(owner)} has no <{tag}>"
            )
            return None
        numbers = elements.numbers(owner, child, count, low=SMALLEST)
        if numbers is None:
            return None
        extents += numbers
    return Shape(node.tag, tuple(extents), node)


def _read_mesh(elements: Elements, owner: Node, node: Node) -> Shape | None:
    copy = elements.copy
    if copy.meshes == "refuse":
        elements.problem(
            owner,
            f"{label(owner)} is a mesh: {_VALID}, or set meshes=boxes or "
            "meshes=hulls to put those in its place",
        )
        return None
    if node.find("submesh") is not None:
        elements.problem(
            node,
            f"{label(owner)} is a part of a mesh by its "
            "name, <submesh>, which is not read",
        )
        return None
    child = elements.only(node, "scale")
    scale = None if child is None else elements.numbers(owner, child, 3)
    if child is not None and scale is None:
        return None
    try:
        file = find_resource(node.text_of("uri"), elements.path, copy.world)
        mesh = mesh_parts(file, np.array(scale or [1.0, 1.0, 1.0]), copy.meshes)
    except (ResourceError, MeshError) as error:
        elements.problem(node, f"mesh of {label(owner)}: {error}")
        return None
    copy.note(file)
    return Shape("box", (1.0, 1.0, 1.0), node, mesh)


def _copy_friction(elements: Elements, owner: Node, out: Element) -> None:
    node = owner.find("surface/friction/ode")
    if node is None:
        return
    copied = add(add(add(out, "surface"), "friction"), "ode")
    for tag in ("mu", "mu2"):
        child = elements.only(node, tag)
        numbers = (
            [1.0]
            if child is None
            else elements.numbers(owner, child, 1, low=0.0, high=1e300)
        )
        add(copied, tag, text_of(numbers or [1.0]))


def _copy_colour(elements: Elements, owner: Node, out: Element) -> None:
    node = owner.find("material/diffuse")
    if node is None:
        return
    count = 3 if len(node.text.split()) == 3 else 4
    colour = elements.numbers(owner, node, count)
    if colour is not None:
        add(
            add(out, "material"),
            "diffuse",
            text_of([min(max(value, 0.0), 1.0) for value in colour]),
        )
