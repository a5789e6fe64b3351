"""Every shipped diagram in its variants, and the systems inside it."""

import dataclasses
import functools
import importlib
import inspect
from pathlib import Path

from pydrake.common import RandomGenerator
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, LeafSystem, PortDataType

import drake_mobarm
from drake_mobarm import build_diagram, load_scenario
from drake_mobarm.exceptions import ParameterError
from drake_mobarm.job import job_names

ROOT = Path(drake_mobarm.__file__).parent
# By then every sensor has sampled, and every block has worked on it [s].
WORKING_AT = 0.3


def choices(part, path=""):
    """Overrides, one for each value that differs of each field with a few.

    Such a field is true or false, or lists the valid texts when it refuses.
    """
    for field in dataclasses.fields(part):
        value, name = getattr(part, field.name), f"{path}{field.name}"
        if dataclasses.is_dataclass(value):
            yield from choices(value, f"{name}.")
        elif isinstance(value, bool):
            yield f"{name}={str(not value).lower()}"
        elif isinstance(value, str):
            try:
                dataclasses.replace(part, **{field.name: "no such choice"})
            except ParameterError as error:
                valid = str(error).split("valid is ")[1].split(", ")
                yield from (
                    f"{name}={x}"
                    for x in valid
                    # "or the path of a file" is no value.
                    if x != value and not x.startswith("or ")
                )


def variants(job):
    """The overrides of each variant of a job's shipped scenario."""
    return [[], *([choice] for choice in choices(load_scenario(job)))]


@dataclasses.dataclass(frozen=True, eq=False)
class Shipped:
    """A shipped diagram, with a view."""

    name: str
    scenario: object
    diagram: Diagram

    @functools.cached_property
    def working(self):
        """A context in which every system has something to do."""
        simulator = Simulator(self.diagram)
        context = simulator.get_mutable_context()
        self.diagram.SetRandomContext(context, RandomGenerator(0))
        simulator.AdvanceTo(WORKING_AT)
        return context.Clone()

    @functools.cached_property
    def fresh(self):
        return self.diagram.CreateDefaultContext()


@dataclasses.dataclass(frozen=True)
class Found:
    """A system inside a shipped diagram, beside others in `diagram`."""

    system: object
    diagram: Diagram
    shipped: Shipped


@functools.cache
def shipped_diagrams():
    meshcat = Meshcat()
    return [
        Shipped(
            " ".join([job, *overrides]),
            scenario := load_scenario(job, overrides),
            build_diagram(scenario, meshcat=meshcat),
        )
        for job in job_names()
        for overrides in variants(job)
    ]


def systems_inside(diagram):
    """Each system of a diagram and of its diagrams, with whose it is."""
    for system in diagram.GetSystems():
        yield system, diagram
        if isinstance(system, Diagram):
            yield from systems_inside(system)


@functools.cache
def all_systems():
    """Every system of every shipped diagram, Drake's own included."""
    return [
        Found(system, diagram, shipped)
        for shipped in shipped_diagrams()
        for system, diagram in systems_inside(shipped.diagram)
    ]


def instances(kind):
    return [found for found in all_systems() if type(found.system) is kind]


def library_systems():
    """The LeafSystems that the package defines, by import."""
    files = [
        *ROOT.glob("*/systems.py"),
        *ROOT.glob("*/view.py"),
        *ROOT.glob("*/ground_truth.py"),
    ]
    kinds = set()
    for file in files:
        name = ".".join(file.relative_to(ROOT.parent).with_suffix("").parts)
        for _, kind in inspect.getmembers(importlib.import_module(name)):
            if (
                inspect.isclass(kind)
                and issubclass(kind, LeafSystem)
                and kind.__module__ == name
            ):
                kinds.add(kind)
    return sorted(kinds, key=lambda kind: kind.__name__)


def input_ports(system):
    return [*map(system.get_input_port, range(system.num_input_ports()))]


def output_ports(system):
    return [*map(system.get_output_port, range(system.num_output_ports()))]


def is_vector(port):
    return port.get_data_type() == PortDataType.kVectorValued
