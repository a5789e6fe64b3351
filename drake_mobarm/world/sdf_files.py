"""The files of an SDF world: its models, its includes and its states."""

from pathlib import Path
from xml.etree.ElementTree import Element, ElementTree, SubElement

from drake_mobarm.exceptions import WorldError
from drake_mobarm.world.clean_copy import CleanCopy, LinkState
from drake_mobarm.world.document import DocumentError, Node
from drake_mobarm.world.elements import Elements, add, keep, label
from drake_mobarm.world.links import copy_link, copy_part, read_plane
from drake_mobarm.world.resources import ResourceError, find_model

_VERSIONS = {f"1.{minor}" for minor in range(2, 13)}
_MOST_COPIES = 5_000
# What Gazebo brings along.
_SUN, _GROUND = "model://sun", "model://ground_plane"
# What cannot be in a world that stands still, and why.
_REFUSED = {
    "actor": "it moves, which nothing in a world does",
    "population": "it puts models at random, so write each as a <model>",
    "insertions": "write its models into the world, and remove <state>",
    "deletions": "take its models out of the world, and remove <state>",
}


def write_copy(copy: CleanCopy) -> Path:
    """Copies a world's file, and all that it includes, for Drake to read.

    Args:
        copy: of the world; what is found is written into it.

    Returns:
        The world's copy.

    Raises:
        WorldError: something is wrong in the files.
    """
    copied = _copy_file(copy, copy.world, (), None)
    copy.raise_problems()
    assert copied is not None
    return copied[0]


def _copy_file(
    copy: CleanCopy,
    path: Path,
    including: tuple[Path, ...],
    static: bool | None,
) -> tuple[Path, str] | None:
    """Copies a file.

    Args:
        copy: of the world.
        path: of the file.
        including: the files that include it, the world's first.
        static: whether the model is, where the including file says so.

    Returns:
        The copy and the name of its model, or None where there is nothing to
        touch in it, or something is wrong.
    """
    try:
        root = copy.root(path)
    except DocumentError as error:
        place = f"{path} " if including else ""
        copy.problems.append(f"{place}{error}")
        return None
    elements = Elements(copy, path)
    if root.tag != "sdf":
        elements.problem(root, f"the root is <{root.tag}>, not <sdf>")
        return None
    version = root.attributes.get("version", "").strip()
    if version not in _VERSIONS:
        elements.problem(
            root,
            f"<sdf> has {f'version {version!r}' if version else 'no version'}"
            ': valid is 1.2 to 1.12, as in <sdf version="1.9">',
        )
        return None
    elements.minor = int(version.partition(".")[2])
    for child in root:
        _refuse(elements, child)
    tops = root.all("world", "model")
    if including and not tops:
        return None  # Such as a light.
    if len(tops) != 1 or (including and tops[0].tag == "world"):
        found = ", ".join(f"<{node.tag}>" for node in tops) or "neither"
        elements.problem(
            root,
            "<sdf> has to hold one <model>"
            f"{'' if including else ' or one <world>'}, and it holds {found}",
        )
        return None
    (top,) = tops
    out = Element("sdf", version=version)
    reader = _Reader(elements, including)
    if top.tag == "world":
        reader.world(top, out)
    else:
        reader.model(top, out, static, {})
    copied = copy.folder / f"{copy.copies}.sdf"
    copy.copies += 1
    ElementTree(out).write(copied, encoding="utf-8")
    return copied, top.name


def _refuse(elements: Elements, node: Node) -> None:
    """Writes down what a world cannot have, if an element is that."""
    if node.tag in _REFUSED and node.children:
        elements.problem(node, f"{label(node)}: {_REFUSED[node.tag]}")


class _Reader:
    """Copies worlds and models of a file.

    Args:
        elements: of the file.
        including: the files that include it, the world's first.
    """

    def __init__(self, elements: Elements, including: tuple[Path, ...]) -> None:
        self._elements = elements
        self._including = including

    def world(self, node: Node, parent: Element) -> None:
        """Copies a `<world>`."""
        # Nothing refers to its own name, which need not be a valid one.
        out = SubElement(parent, "world", name="copy")
        self._children(node, out, None)
        for state in node.all("state"):
            self._state(state, out)

    def model(
        self,
        node: Node,
        parent: Element,
        static: bool | None,
        siblings: dict[str, Node],
    ) -> None:
        """Copies a `<model>`.

        Args:
            node: the model.
            parent: of its copy.
            static: whether it is, where that is told elsewhere.
            siblings: the names of those beside it.
        """
        elements = self._elements
        elements.name(node, node.name, siblings)
        if static is None:
            static = elements.flag(node, "static")
        # Models within may stand still by themselves.
        if not static and (
            node.all("link") or not node.all("model", "include")
        ):
            elements.problem(
                node,
                f"{label(node)} can move: write <static>true</static> in it",
            )
        out = SubElement(parent, "model")
        keep(node, out, "name")
        elements.keep_frame(node, out, "placement_frame")
        # Drake does not hand this on to models within, as Gazebo does.
        add(out, "static", "true")
        elements.pose(node, out)
        self._children(node, out, static or None)

    def _children(self, node: Node, out: Element, static: bool | None) -> None:
        siblings: dict[str, Node] = {}
        for child in node:
            _refuse(self._elements, child)
            if child.tag == "model":
                self.model(child, out, static, siblings)
            elif child.tag == "include":
                self._include(child, out, static, siblings)
            elif child.tag in ("link", "frame"):
                self._elements.name(child, child.name, siblings)
                copied = SubElement(out, child.tag)
                keep(child, copied, "name")
                self._elements.keep_frame(child, copied, "attached_to")
                if child.tag == "link":
                    copy_link(self._elements, child, copied)
                else:
                    self._elements.pose(child, copied)

    def _include(
        self,
        node: Node,
        parent: Element,
        static: bool | None,
        siblings: dict[str, Node],
    ) -> None:
        elements, copy = self._elements, self._elements.copy
        uri = node.text_of("uri")
        if static is None and node.find("static") is not None:
            static = elements.flag(node, "static")
        including = (*self._including, elements.path)
        try:
            file = find_model(uri, elements.path, copy.world)
        except ResourceError as error:
            if uri == _GROUND:
                self._ground(node, parent, siblings)
            elif uri != _SUN:
                elements.problem(node, f"<include>: {error}")
            return
        if file in including:
            elements.problem(node, f"<include>: {uri!r} includes itself")
            return
        if copy.copies >= _MOST_COPIES:
            raise WorldError(
                f"world {copy.world}: it includes more than {_MOST_COPIES} "
                "models"
            )
        copied = _copy_file(copy, file, including, static)
        if copied is None:
            return
        file, name = copied
        out = SubElement(parent, "include")
        add(out, "uri", file.as_uri())
        if node.attributes.get("merge", "").strip().lower() in ("true", "1"):
            out.set("merge", "true")
        else:
            name = node.text_of("name") or name
            elements.name(node, name, siblings)
            add(out, "name", name)
        elements.pose(node, out)
        frame = node.text_of("placement_frame")
        if frame:
            copy.frames[frame] = elements.where(node)
            add(out, "placement_frame", frame)

    def _ground(
        self, node: Node, parent: Element, siblings: dict[str, Node]
    ) -> None:
        """The model of a ground plane that every Gazebo has."""
        name = node.text_of("name") or "ground_plane"
        self._elements.name(node, name, siblings)
        out = SubElement(parent, "model", name=name)
        add(out, "static", "true")
        self._elements.pose(node, out)
        collision = Node("collision", {"name": name}, node.line)
        plane = read_plane(
            self._elements, collision, Node("plane", {}, node.line)
        )
        assert plane is not None
        link = SubElement(out, "link", name="link")
        copy_part(self._elements, collision, plane, "collision", link)

    def _state(self, node: Node, out: Element) -> None:
        """Puts the models of a copied world where a `<state>` has them."""
        elements = self._elements
        for child in node:
            _refuse(elements, child)
        models = {
            child.findtext("name") or child.get("name"): child
            for child in out
            if child.tag in ("model", "include")
        }
        for state in node.all("model"):
            name = state.name
            inside = state.find("model")
            scale = elements.only(state, "scale")
            if name not in models:
                self._refuse_state(state, "there is no such model")
            elif inside is not None:
                self._refuse_state(inside, f"it is within model {name!r}")
            elif scale is not None and (
                elements.numbers(state, scale, 3) != [1.0, 1.0, 1.0]
            ):
                self._refuse_state(scale, "it has another size there")
            else:
                self._place(state, models[name])

    def _place(self, state: Node, model: Element) -> None:
        elements = self._elements
        posed = Element("posed")
        elements.pose(state, posed)
        pose = posed.find("pose")
        if pose is not None:
            for tag in ("pose", "placement_frame"):
                for child in model.findall(tag):
                    model.remove(child)
            model.attrib.pop("placement_frame", None)
            model.append(pose)
        for link in state.all("link"):
            node = elements.only(link, "pose")
            if node is None:
                continue
            numbers = elements.numbers(link, node, 6)
            if numbers is not None:
                elements.copy.link_states.append(
                    LinkState(
                        state.name,
                        link.name,
                        elements.where(link),
                        numbers,
                    )
                )

    def _refuse_state(self, node: Node, why: str) -> None:
        self._elements.problem(
            node, f"<state> places {label(node)}, but {why}: remove <state>"
        )
