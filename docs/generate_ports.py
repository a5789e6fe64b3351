"""The ports of every system in the shipped diagrams, as Markdown."""

import importlib
import inspect
import re
from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

from generate_keys import RANGES, list_keys
from generate_markdown import one_line, table
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, PortDataType, System

from drake_mobarm import build_diagram, load_scenario, signals
from drake_mobarm.job import job_names

_OF_DRAKE = {"query_object": "QueryObject of the scene graph, for drawing."}
"""The ports of a shipped diagram that no system of the library tells of."""


class Block(NamedTuple):
    """A system of the library where it stands in a shipped diagram."""

    name: str
    diagram: str
    system: System

    @property
    def room(self) -> str:
        """The folder of the package that it comes from."""
        return type(self.system).__module__.split(".")[1]

    @property
    def place(self) -> str:
        """Where it stands, and whether it may be exchanged."""
        wiring = importlib.import_module(
            f"drake_mobarm.diagrams.{self.diagram}"
        )
        names = getattr(wiring, f"{self.diagram.upper()}_BLOCKS", ())
        exchanged = ", may be exchanged" if self.name in names else ""
        return f"Block `{self.name}` of `{self.diagram}`{exchanged}."


@cache
def shipped_diagrams(job: str) -> list[Diagram]:
    """A job's diagram, and one for each other choice of a block."""
    scenario = load_scenario(job)
    choices = [
        f"{key.path}={choice}"
        for key in list_keys(scenario)
        if key.type == "str" and key.path not in RANGES and "." not in key.path
        for choice in key.range.split(", ")
        if choice != getattr(scenario, key.path)
    ]
    return [build_diagram(scenario, meshcat=Meshcat())] + [
        build_diagram(load_scenario(job, [choice])) for choice in choices
    ]


def blocks_of(diagram: Diagram, name: str) -> Iterator[Block]:
    """The library's own systems inside a diagram, all the way down."""
    for system in diagram.GetSystems():
        if isinstance(system, Diagram):
            part = system.get_name()
            yield from blocks_of(system, name if part == "job" else part)
        elif type(system).__module__.startswith("drake_mobarm."):
            yield Block(system.get_name(), name, system)


@cache
def all_blocks() -> dict[type[System], Block]:
    """Of every kind of system the first one met, in order of their names."""
    found: dict[type[System], Block] = {}
    for job in job_names():
        for diagram in shipped_diagrams(job):
            for block in blocks_of(diagram, job):
                found.setdefault(type(block.system), block)
    return dict(sorted(found.items(), key=lambda item: item[0].__name__))


def read_docstring(kind: type[System]) -> tuple[str, dict[str, str]]:
    """A system's first sentence, and the meaning of each of its ports."""
    text = inspect.getdoc(kind) or ""
    ports = re.findall(
        r"^- (\w+)(?: \(\w+\))?: (.*?)(?=^- |^$|\Z)", text, re.M | re.S
    )
    sentence = re.split(r"(?<=\.)\s", text)[0]
    return one_line(sentence), {name: one_line(text) for name, text in ports}


def list_ports(system: System, meaning: Callable[[str], str]) -> str:
    """The table of a system's ports."""
    rows = []
    for way, count, get in (
        ("in", system.num_input_ports(), system.get_input_port),
        ("out", system.num_output_ports(), system.get_output_port),
    ):
        for port in map(get, range(count)):
            abstract = port.get_data_type() == PortDataType.kAbstractValued
            elements = "abstract" if abstract else port.size()
            name = port.get_name()
            text = meaning(name).removeprefix("abstract, ")
            rows.append([f"`{name}`", way, elements, text])
    return table(["port", "direction", "size", "meaning"], rows)


def make_systems(room: str) -> str:
    """Every system of a room: what it is, where it stands, its ports."""
    parts = []
    for kind, block in all_blocks().items():
        if block.room == room:
            sentence, ports = read_docstring(kind)
            parts += [
                f"### `{kind.__name__}`",
                f"{sentence} {block.place}",
                list_ports(block.system, ports.__getitem__),
            ]
    return "\n\n".join(parts)


def make_ports(part: str) -> str:
    """The ports of a job's diagram, or of the station."""
    job = part if part in job_names() else job_names()[0]
    name = "job" if part == job else part
    diagram = shipped_diagrams(job)[0].GetSubsystemByName(name)

    inside = sorted(
        blocks_of(diagram, part), key=lambda b: type(b.system).__name__
    )

    def meaning(port: str) -> str:
        # Whoever gives a signal tells more of it than those that read it.
        for block in sorted(
            inside, key=lambda b: not b.system.HasOutputPort(port)
        ):
            ports = read_docstring(type(block.system))[1]
            if port in ports:
                return ports[port]
        return _OF_DRAKE[port]

    return list_ports(diagram, meaning)


def make_signals(_: str) -> str:
    """The elements of the signals that have names."""
    source = inspect.getsource(signals)
    rows = []
    for name, view in vars(signals).items():
        if hasattr(view, "get_fields"):
            meaning = re.search(
                rf'^{name} = .*?^"""(.*?)"""', source, re.M | re.S
            )
            assert meaning is not None
            elements = ", ".join(f"`{f}`" for f in view.get_fields())
            rows.append([f"`{name}`", elements, one_line(meaning[1])])
    return table(["signal", "elements", "meaning"], rows)
