"""Names, numbers and poses in an SDF, each fault of them with its line."""

import re
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from drake_mobarm.world.clean_copy import CleanCopy
from drake_mobarm.world.document import Node

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_SHOWN = 60

# Of any number: positions, sizes and angles.
_LARGEST = 1e6
_ROTATIONS = {
    ("euler_rpy", "false"),
    ("euler_rpy", "0"),
    ("euler_rpy", "true"),
    ("euler_rpy", "1"),
    ("quat_xyzw", "false"),
    ("quat_xyzw", "0"),
}

# The minor version of SDF since which a pose has `relative_to`, and since
# which :: may not be in a name; before, it told of models within models.
_RELATIVE, _SCOPED = 7, 8


def label(node: Node) -> str:
    """What messages call an element."""
    return (
        f"{node.tag} {node.name[:_SHOWN]!r}" if node.name else f"<{node.tag}>"
    )


def add(parent: Element, tag: str, text: str = "") -> Element:
    """Adds an element to a copy."""
    child = SubElement(parent, tag)
    child.text = text
    return child


def keep(node: Node, out: Element, *attributes: str) -> None:
    """Copies the attributes that are there."""
    for name in attributes:
        if name in node.attributes:
            out.set(name, node.attributes[name])


class Elements:
    """Reads the elements of one file, and writes down what is wrong.

    Args:
        copy: what the faults are written into.
        path: of the file.
        minor: of the file's SDF version, 9 for 1.9.
    """

    def __init__(self, copy: CleanCopy, path: Path, minor: int = 0) -> None:
        self.copy = copy
        self.path = path
        self.minor = minor

    def where(self, node: Node) -> str:
        """The place of an element."""
        return self.copy.where(self.path, node.line)

    def problem(self, node: Node, text: str) -> None:
        """Writes down that something is wrong with an element."""
        self.copy.problems.append(f"{self.where(node)}: {text}")

    def only(self, owner: Node, tag: str) -> Node | None:
        """The child of this name, of which there may be one at most."""
        found = owner.all(tag)
        if len(found) > 1:
            self.problem(found[1], f"{label(owner)} has a second <{tag}>")
        return found[0] if found else None

    def numbers(
        self,
        owner: Node,
        node: Node,
        count: int,
        low: float = -_LARGEST,
        high: float = _LARGEST,
    ) -> list[float] | None:
        """The numbers in an element, or None if they are not valid.

        Args:
            owner: the element to name.
            node: the element with the numbers.
            count: how many there have to be.
            low: the least valid one.
            high: the largest valid one.
        """
        words = node.text.split()
        numbers = [float(word) for word in words if _NUMBER.fullmatch(word)]
        if (
            len(words) == len(numbers) == count
            and low <= min(numbers)
            and max(numbers) <= high
        ):
            return numbers
        found = " ".join(words)
        found = found if len(found) <= _SHOWN else f"{found[:_SHOWN]}..."
        self.problem(
            node,
            f"<{node.tag}> of {label(owner)} is {found!r}: valid is "
            f"{count} number{'s' if count > 1 else ''} from {low:.7g} to "
            f"{high:.7g}",
        )
        return None

    def flag(self, owner: Node, tag: str) -> bool:
        """A child that is true or false; false where it is not there."""
        node = self.only(owner, tag)
        if node is None:
            return False
        text = node.text.strip().lower()
        if text not in ("", "true", "false", "1", "0"):
            self.problem(
                node,
                f"<{tag}> of {label(owner)} is {text[:_SHOWN]!r}: valid is "
                "true or false",
            )
            return True
        return text in ("true", "1")

    def name(self, node: Node, name: str, siblings: dict[str, Node]) -> None:
        """Checks the name of an element against those beside it."""
        parts = [part.strip() for part in name.split("::")]
        if not name.strip():
            self.problem(node, f"<{node.tag}> has no name")
        elif name in siblings:
            self.problem(
                node,
                f"{node.tag} {name[:_SHOWN]!r} has the name of the "
                f"{siblings[name].tag} in line {siblings[name].line}",
            )
        elif name == "world" or re.fullmatch("__.*__", name):
            self.problem(
                node,
                f"{node.tag} {name[:_SHOWN]!r}: that name is reserved in SDF",
            )
        elif len(parts) > 1 and (self.minor >= _SCOPED or not all(parts)):
            self.problem(
                node, f"{node.tag} {name[:_SHOWN]!r}: no name may have :: in it"
            )
        else:
            siblings[name] = node

    def pose(self, owner: Node, out: Element) -> None:
        """Copies an element's pose, if it has one."""
        node = self.only(owner, "pose")
        if node is None:
            return
        form = node.attributes.get("rotation_format", "euler_rpy")
        degrees = node.attributes.get("degrees", "false").strip().lower()
        if (form, degrees) not in _ROTATIONS:
            self.problem(
                node,
                f"<pose> of {label(owner)} has rotation_format={form!r} and "
                f"degrees={degrees!r}: valid is euler_rpy with true or false, "
                "and quat_xyzw with false",
            )
            return
        count = 7 if form == "quat_xyzw" else 6
        numbers: list[float] | None = [0.0] * 6 + [1.0] * (count - 6)
        if node.text.strip():
            numbers = self.numbers(owner, node, count)
        if numbers is None:
            return
        if count == 7 and not any(numbers[3:]):
            self.problem(
                node, f"<pose> of {label(owner)} has a quaternion of 0"
            )
            return
        copied = add(out, "pose", text_of(numbers))
        keep(node, copied, "degrees", "rotation_format")
        self.keep_frame(node, copied, "relative_to")
        if node.attributes.get("frame"):
            if self.minor >= _RELATIVE:
                self.problem(
                    node,
                    f"<pose> of {label(owner)} has a frame, which is "
                    "relative_to since SDF 1.7",
                )
            else:
                self.keep_frame(node, copied, "frame")

    def keep_frame(self, node: Node, out: Element, attribute: str) -> None:
        """Copies an attribute that names a frame, if it is there."""
        name = node.attributes.get(attribute, "")
        if name == "__root__":
            self.problem(node, f"{label(node)}: {attribute} may not be {name}")
        elif attribute in node.attributes:
            out.set(attribute, name)
            self.copy.frames[name] = self.where(node)


def text_of(numbers: list[float]) -> str:
    """Numbers as the text of an element."""
    return " ".join(map(repr, numbers))
