"""A copy of a world's files that holds only what Drake has to read."""

from dataclasses import dataclass, field
from pathlib import Path

from drake_mobarm.exceptions import WorldError
from drake_mobarm.world.document import Node, read_document
from drake_mobarm.world.meshes import MeshPart

_SHOWN = 10


@dataclass(frozen=True)
class Part:
    """A collision or visual of a world's files.

    Attributes:
        name: in the file.
        label: what it is, and its name.
        where: its line, and its file where that is not the world's.
        shape: the name of its shape in SDF.
        extents: the numbers of the shape [m].
        mesh: what stands for a mesh; the shape is then a box in its place.
    """

    name: str
    label: str
    where: str
    shape: str
    extents: tuple[float, ...]
    mesh: list[MeshPart] | None


@dataclass(frozen=True)
class LinkState:
    """Where a `<state>` says that a link is.

    Attributes:
        model: of the link.
        link: its name.
        where: the line of the state's link.
        pose: X_WL, as x, y, z, roll, pitch and yaw [m, rad].
    """

    model: str
    link: str
    where: str
    pose: list[float]


@dataclass
class CleanCopy:
    """What is found while a world's files are copied.

    Attributes:
        world: the world's file.
        folder: of the copies.
        meshes: one of `MESHES`.
        parts: collisions and visuals; each is called `part_` and its number
            in the copies.
        frames: the names of frames that something refers to, and where.
        link_states: to be compared with where Drake puts the links.
        problems: what is wrong, each with its place.
        files: all that were read, and when they were changed last [ns].
        copies: how many files were written.
    """

    world: Path
    folder: Path
    meshes: str
    parts: list[Part] = field(default_factory=list)
    frames: dict[str, str] = field(default_factory=dict)
    link_states: list[LinkState] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    files: dict[Path, int] = field(default_factory=dict)
    copies: int = 0
    _roots: dict[Path, Node] = field(default_factory=dict)

    def raise_problems(self) -> None:
        """Raises a WorldError of the first problems, if there are any."""
        if self.problems:
            more = len(self.problems) - _SHOWN
            tail = [f"and {more} more"] if more > 0 else []
            raise WorldError(
                f"world {self.world}: "
                + "; ".join([*self.problems[:_SHOWN], *tail])
            )

    def where(self, file: Path, line: int) -> str:
        """The place of a line, with its file where that is not the world's."""
        return f"{'' if file == self.world else f'{file} '}line {line}"

    def root(self, file: Path) -> Node:
        """The root of a file, which is read once.

        Raises:
            DocumentError: the file is no XML.
        """
        if file not in self._roots:
            self._roots[file] = read_document(file)
            self.note(file)
        return self._roots[file]

    def note(self, file: Path) -> None:
        """Remembers that the world depends on a file."""
        self.files[file] = file.stat().st_mtime_ns
