"""Which systems of a diagram a key of its scenario reaches."""

import dataclasses
import functools
import typing
from collections.abc import Mapping

import numpy as np
from pydrake.common import RandomGenerator
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, System

from drake_mobarm import build_diagram, load_scenario
from drake_mobarm.exceptions import MobarmError
from helpers.shipped import (
    choices,
    input_ports,
    is_vector,
    output_ports,
    systems_inside,
)

# How long to watch for updates [s]: the slowest sensors sample at 10 Hz.
WATCHED = 0.25


def keys(part, path=""):
    """The keys of a scenario, down to those that hold a value."""
    for field in dataclasses.fields(part):
        value, name = getattr(part, field.name), f"{path}{field.name}"
        if dataclasses.is_dataclass(value):
            yield from keys(value, f"{name}.")
        else:
            yield name


def with_other_value(part, key):
    """A copy of a scenario, or of a part, with another valid value of a key."""
    name, _, rest = key.partition(".")
    if rest:
        return dataclasses.replace(
            part, **{name: with_other_value(getattr(part, name), rest)}
        )
    for value in _other_values(part, name):
        try:
            return dataclasses.replace(part, **{name: value})
        except MobarmError:
            continue
    raise AssertionError(f"no other value of {key} was found")


def _other_values(owner, name):
    value = getattr(owner, name)
    kind = typing.get_type_hints(type(owner))[name]
    if name == "world":
        return ["small_house"]
    if kind is bool:
        return [not value]
    if kind is str:
        start = f"{name}="
        found = [x for x in choices(owner) if x.startswith(start)]
        return [choice.removeprefix(start) for choice in found]
    if kind is int:
        return [value - 1, value + 1]
    if kind is float:
        return [1.01 * value + 0.001, 0.99 * value]
    if kind == tuple[float, ...] and value:
        return [
            [1.01 * x + 0.001 for x in value],
            [0.99 * x for x in value],
            [-x for x in value],
        ]
    pairs = kind == tuple[tuple[float, ...], ...]
    return [[[0.1, 0.2]]] if pairs else [[20.0] * 6, [0.1]]


def update_times(system):
    """When a system that is fed with zeros steps within `WATCHED` [s]."""
    simulator = Simulator(system)
    for port in input_ports(system):
        port.FixValue(simulator.get_mutable_context(), [0.0] * port.size())
    times = []
    simulator.set_monitor(lambda context: times.append(context.get_time()))
    simulator.AdvanceTo(WATCHED)
    return times


def descriptions(diagram):
    """By its name, what each system of a diagram was made with, as text."""
    return {
        system.get_name(): repr(_describe(system))
        for system, _ in systems_inside(diagram)
        if not isinstance(system, Diagram)
    }


def _describe(system):
    context = system.CreateDefaultContext()
    system.SetRandomContext(context, RandomGenerator(0))
    numbers = [
        *map(
            context.get_numeric_parameter,
            range(context.num_numeric_parameter_groups()),
        ),
        *map(
            context.get_discrete_state,
            range(context.num_discrete_state_groups()),
        ),
    ]
    ports = input_ports(system) + output_ports(system)
    vectors = all(map(is_vector, input_ports(system)))
    periodic = system.GetUniquePeriodicDiscreteUpdateAttribute()
    own = {
        name: value
        for name, value in vars(system).items()
        if not name.startswith("_pydrake")
    }
    return [
        type(system).__name__,
        [(p.get_name(), p.size()) for p in ports if is_vector(p)],
        [values.CopyToVector().tolist() for values in numbers],
        [periodic.period_sec(), periodic.offset_sec()]
        if periodic
        else vectors and update_times(system),
        _plain(own),
    ]


def _plain(value):
    """A value as numbers, text and lists, all the way down."""
    kind = type(value)
    if isinstance(value, int | float | str | None):
        return value
    if isinstance(value, np.ndarray):
        return value.shape, hash(value.tobytes())
    if isinstance(value, Mapping):
        return [(_plain(key), _plain(x)) for key, x in value.items()]
    if isinstance(value, list | tuple):
        return [_plain(x) for x in value]
    ours = kind.__module__.startswith("drake_mobarm.")
    if ours and not isinstance(value, System):
        slots = [getattr(value, x) for x in getattr(kind, "__slots__", ())]
        return [kind.__name__, _plain(slots), _plain(vars(value))]
    return kind.__name__


def differing(one, two):
    """The names of the systems that two descriptions do not share."""
    return {name for name in one | two if one.get(name) != two.get(name)}


@functools.cache
def _shipped(job, overrides):
    scenario = load_scenario(job, ["world=empty", *overrides])
    return scenario, descriptions(build_diagram(scenario))


@functools.cache
def reached(job, key, *overrides):
    """The names of the systems that another value of a key changes.

    In an empty world, which is built sooner.
    """
    scenario, before = _shipped(job, overrides)
    after = descriptions(build_diagram(with_other_value(scenario, key)))
    return differing(before, after)
