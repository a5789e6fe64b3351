"""Wiring by name: an input reads the signal that has its name.

A diagram is made of blocks. A user's own block takes the place of one of
them where its ports fit.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from pydrake.geometry import (
    Meshcat,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
)
from pydrake.systems.framework import (
    Diagram,
    DiagramBuilder,
    InputPort,
    OutputPort,
    PortDataType,
    System,
)
from pydrake.systems.primitives import LogVectorOutput

from drake_mobarm.drawing.stage import FRAMES_PER_SECOND
from drake_mobarm.exceptions import BlockError

NO_BLOCKS: Mapping[str, System] = MappingProxyType({})
"""Nothing exchanged."""

TRACE = "trace."
"""What the name of a log begins with; the rest names its signal."""

LOG_PERIOD = 0.05
"""Of the logs that a run's trace is read from [s]."""


class Wiring:
    """Builds a diagram of blocks whose ports are connected by their names.

    Args:
        blocks: systems that take the places of shipped blocks, by the names
            of these.
    """

    def __init__(self, blocks: Mapping[str, System] = NO_BLOCKS) -> None:
        self.builder = DiagramBuilder()
        self._given = dict(blocks)
        self._names: list[str] = []
        self._systems: list[tuple[str, System]] = []
        self._signals: dict[str, OutputPort] = {}

    def add(
        self,
        name: str,
        make: Callable[[], System],
        outputs: Mapping[str, int | None] = MappingProxyType({}),
    ) -> System:
        """Adds a block: the user's, where there is one, or the shipped one.

        Args:
            name: of the block.
            make: makes the shipped one.
            outputs: which signals the diagram reads of it: the name of each
                and its number of elements, None for an abstract one; empty
                for all that it has.

        Returns:
            The block that was added.

        Raises:
            BlockError: it is no System, or part of another diagram; or an
                output is missing, has another number of elements, or the name
                of another block's.
        """
        self._names.append(name)
        system = make() if name not in self._given else self._given[name]
        if not isinstance(system, System):
            raise BlockError(
                f"block {name!r} is {system!r}: it has to be a System, an "
                "object and not its class"
            )
        # A path of several names is that of a diagram's part.
        if name in self._given and system.GetSystemPathname().count("::") > 1:
            raise BlockError(
                f"block {name!r} ({type(system).__name__}) is part of another "
                "diagram: make a new one for each run"
            )
        ports = _output_ports(system)
        for signal, elements in outputs.items():
            port = ports.get(signal)
            if port is None or _elements(port) != elements:
                raise BlockError(
                    f"block {name!r} ({type(system).__name__}) "
                    + _misfit("output", signal, port)
                    + f": it has to give {_list_signals(outputs)}"
                )
        self.builder.AddNamedSystem(name, system)
        self._systems.append((name, system))
        # What a given block tells besides is not for others to read.
        for signal in outputs or ports:
            self.offer(signal, ports[signal])
        return system

    def add_primitive(
        self, name: str, system: System, gives: str, reads: Sequence[str] = ()
    ) -> None:
        """Adds one of Drake's own systems, whose ports have no such names.

        Args:
            name: of the system in the diagram.
            system: with one output.
            gives: the signal at its output.
            reads: the signal at each of its inputs, all known by now.
        """
        self.builder.AddNamedSystem(name, system)
        for index, signal in enumerate(reads):
            self.builder.Connect(
                self.signal(signal), system.get_input_port(index)
            )
        self.offer(gives, system.get_output_port())

    def offer(self, signal: str, port: OutputPort) -> None:
        """Makes an output readable by every input that has this name.

        Raises:
            BlockError: another output has this name.
        """
        if signal in self._signals:
            raise BlockError(
                f"two outputs are named {signal!r}: valid is one name each"
            )
        self._signals[signal] = port

    def rename(self, signal: str, name: str) -> None:
        """Gives a signal another name, so that a block can refine it.

        Raises:
            BlockError: there is no such signal, or the name is another's.
        """
        port = self.signal(signal)
        del self._signals[signal]
        self.offer(name, port)

    def signal(self, name: str) -> OutputPort:
        """The output that gives a signal.

        Raises:
            BlockError: there is none of this name.
        """
        if name not in self._signals:
            valid = ", ".join(self._signals)
            raise BlockError(f"no output gives {name!r}: valid are {valid}")
        return self._signals[name]

    def export(self, *signals: str, **renamed: str) -> None:
        """Makes signals outputs of the diagram.

        Args:
            signals: exported under their own names.
            renamed: exported under other names: `done="arrived"`.
        """
        for name, signal in ({s: s for s in signals} | renamed).items():
            self.builder.ExportOutput(self.signal(signal), name)

    def log(self, *signals: str) -> None:
        """Logs signals for a run's trace."""
        for signal in signals:
            log = LogVectorOutput(self.signal(signal), self.builder, LOG_PERIOD)
            log.set_name(TRACE + signal)

    def add_visualizer(self, meshcat: Meshcat) -> None:
        """Adds Drake's own visualizer of the signal `query_object`."""
        visualizer = MeshcatVisualizer(
            meshcat,
            MeshcatVisualizerParams(
                publish_period=1 / FRAMES_PER_SECOND,
                show_hydroelastic=False,
            ),
        )
        self.builder.AddNamedSystem("visualizer", visualizer)
        self.builder.Connect(
            self.signal("query_object"),
            visualizer.query_object_input_port(),
        )

    def build(
        self,
        name: str,
        *,
        inputs: Mapping[str, int | None] = MappingProxyType({}),
    ) -> Diagram:
        """Connects every block's inputs and builds the diagram.

        Args:
            name: of the diagram.
            inputs: signals that come from outside, with their numbers of
                elements (None: abstract): each is an input of the diagram
                where a block reads it.

        Raises:
            BlockError: a block's input has no signal of its name, or one
                with another number of elements; or a given block has the
                name of no shipped one.
        """
        split_blocks(self._given, self._names)
        known = {
            signal: _elements(port) for signal, port in self._signals.items()
        } | dict(inputs)
        exported: set[str] = set()
        for owner, system in self._systems:
            for index in range(system.num_input_ports()):
                port = system.get_input_port(index)
                signal = port.get_name()
                if known.get(signal, -1) != _elements(port):
                    raise BlockError(
                        f"block {owner!r} ({type(system).__name__}) "
                        + _misfit("input", signal, port)
                        + f": it can read {_list_signals(known)}"
                    )
                if signal not in inputs:
                    self.builder.Connect(self._signals[signal], port)
                elif signal in exported:
                    self.builder.ConnectInput(signal, port)
                else:
                    self.builder.ExportInput(port, signal)
                    exported.add(signal)
        diagram: Diagram = self.builder.Build()
        diagram.set_name(name)
        return diagram


def split_blocks(
    blocks: Mapping[str, System], *groups: Sequence[str]
) -> list[dict[str, System]]:
    """Sorts given blocks into groups of names.

    Raises:
        BlockError: a name is in no group.
    """
    for name in blocks:
        if not any(name in group for group in groups):
            valid = ", ".join(name for group in groups for name in group)
            raise BlockError(f"unknown block {name!r}: valid are {valid}")
    return [
        {name: blocks[name] for name in group if name in blocks}
        for group in groups
    ]


def _output_ports(system: System) -> dict[str, OutputPort]:
    ports = map(system.get_output_port, range(system.num_output_ports()))
    return {port.get_name(): port for port in ports}


def _elements(port: Any) -> int | None:
    vector = port.get_data_type() == PortDataType.kVectorValued
    return int(port.size()) if vector else None


def _misfit(kind: str, signal: str, port: InputPort | OutputPort | None) -> str:
    if port is None:
        return f"has no {kind} port {signal!r}"
    return f"has {kind} port {_list_signals({signal: _elements(port)})}"


def _list_signals(signals: Mapping[str, int | None]) -> str:
    return ", ".join(
        f"{name} ({'abstract' if elements is None else elements})"
        for name, elements in signals.items()
    )
