"""XML as Gazebo and Drake read it, which standard parsers call invalid."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

_DEPTH = 100

# What has no elements in it: declarations, comments, text that is quoted.
_NO_ELEMENTS = re.compile(r"<\?.*?\?>|<!--.*?-->|<!\[CDATA\[.*?\]\]>", re.S)
# An ampersand that begins none of XML's own entities.
_BARE_AMPERSAND = re.compile(r"&(?!(?:amp|lt|gt|quot|apos|#\d+);)")
_CONTROL = re.compile(r"[\x01-\x08\x0b\x0c\x0e-\x1f]")


@dataclass(eq=False)
class Node:
    """An element of a file.

    Attributes:
        tag: its name, with the prefix.
        attributes: by their names.
        line: of the file, in which it begins.
        text: before the first element in it.
        children: the elements in it.
    """

    tag: str
    attributes: dict[str, str]
    line: int
    text: str = ""
    children: list["Node"] = field(default_factory=list)

    def __iter__(self) -> Iterator["Node"]:
        return iter(self.children)

    def all(self, *tags: str) -> list["Node"]:
        """The children of some names."""
        return [child for child in self.children if child.tag in tags]

    def find(self, path: str) -> "Node | None":
        """The first child of a name, or its first child as in `a/b`."""
        tag, _, rest = path.partition("/")
        for child in self.all(tag):
            found = child.find(rest) if rest else child
            if found is not None:
                return found
        return None

    def text_of(self, tag: str) -> str:
        """The text of a child, empty where there is none."""
        child = self.find(tag)
        return "" if child is None else child.text.strip()

    @property
    def name(self) -> str:
        """The attribute `name`, empty where it is missing."""
        return self.attributes.get("name", "")


class DocumentError(ValueError):
    """A text is no XML; it says why."""


def read_document(path: Path) -> Node:
    """The root element of an XML file.

    As in the parsers of Gazebo and Drake, a comment may hold two hyphens, a
    prefix need not be declared, blank lines may come before the declaration,
    an ampersand may stand for itself, and what is not UTF-8 is Latin-1.

    Raises:
        DocumentError: the file is no XML for those either, or cannot be read.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DocumentError(f"cannot be read: {error.strerror}") from error
    return parse_document(data)


def parse_document(data: bytes) -> Node:
    """The root element of an XML text, as `read_document` reads it.

    Raises:
        DocumentError: the text is no XML.
    """
    if b"\0" in data:
        raise DocumentError("is not valid XML: it holds zero bytes")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    # Lines stay the same, for messages name them.
    text = _NO_ELEMENTS.sub(lambda found: "\n" * found[0].count("\n"), text)
    start = text.find("<")
    if start < 0:
        raise DocumentError("is not valid XML: there is no element in it")
    text = "\n" * text[:start].count("\n") + text[start:]
    text = _BARE_AMPERSAND.sub("&amp;", _CONTROL.sub(" ", text))
    return _build(text)


def _build(text: str) -> Node:
    # Without a separator, prefixes are part of the names.
    parser = expat.ParserCreate("utf-8")
    top = Node("", {}, 0)
    parents = [top]

    def start(tag: str, attributes: dict[str, str]) -> None:
        node = Node(tag, attributes, parser.CurrentLineNumber)
        parents[-1].children.append(node)
        parents.append(node)
        if len(parents) > _DEPTH + 1:
            raise DocumentError(
                f"is nested more than {_DEPTH} elements deep in line "
                f"{node.line}"
            )

    def end(_tag: str) -> None:
        parents.pop()

    def read_text(data: str) -> None:
        if not parents[-1].children:
            parents[-1].text += data

    parser.buffer_text = True
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = read_text
    try:
        parser.Parse(text.encode(), True)
    except expat.ExpatError as error:
        reason = expat.errors.messages[error.code]
        node = parents[-1]
        within = f" within <{node.tag}> of line {node.line}" if node.tag else ""
        raise DocumentError(
            f"is not valid XML: {reason} in line {error.lineno}{within}"
        ) from error
    return top.children[0]
