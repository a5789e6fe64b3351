"""What every LeafSystem of the library keeps, whatever it does.

The systems are those of the shipped diagrams, fed with what reaches them there.
"""

import copy
import inspect
import re

import numpy as np
import pytest
import yaml
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from drake_mobarm import load_scenario, signals
from drake_mobarm.signals import SIGNALS
from helpers.shipped import (
    all_systems,
    choices,
    input_ports,
    instances,
    is_vector,
    library_systems,
    output_ports,
    shipped_diagrams,
)

SYSTEMS = pytest.mark.parametrize(
    "kind", library_systems(), ids=lambda kind: kind.__name__
)
VIEWS = {
    name: signals.size(view)
    for name, view in vars(signals).items()
    if isinstance(view, type) and hasattr(view, "get_fields")
}


def robots_states(found):
    plant = found.diagram.GetSubsystemByName("plant")
    robot = plant.GetModelInstanceByName("mobile_arm")
    return plant.num_multibody_states(robot)


# What the names mean that docstrings use for sizes.
NAMED_SIZES = {
    "n": robots_states,
    "positions": lambda found: found.system._plant.num_positions(),
    "rays": lambda found: found.shipped.scenario.station.lidar.rays,
}


def documented_ports(kind):
    block = inspect.getdoc(kind).split(".. pydrake_system::")[1]
    block = re.split(r"\n(?=\S)", block)[0]
    return yaml.safe_load(inspect.cleandoc(block))


def port_lines(kind):
    """Name, size or "", and text of each port's line, in their order."""
    paragraphs = inspect.getdoc(kind).split(".. pydrake_system::")[1]
    return re.findall(
        r"^- (\w+)(?: \((\w+)\))?: (.+(?:\n  .+)*)", paragraphs, re.M
    )


def fix_inputs(found, context, *, changed=False):
    """Feeds what reaches a system in its diagram, or something a bit else.

    Zeros and ones stay when it is changed: they mean no and yes.
    """
    working = found.system.GetMyContextFromRoot(found.shipped.working)
    fresh = found.system.GetMyContextFromRoot(found.shipped.fresh)
    for port in input_ports(found.system):
        if is_vector(port):
            values = port.Eval(working)
            if changed:
                said = (values == 0) | (values == 1)
                values = np.where(said, values, 0.97 * values)
            port.FixValue(context, values)
        else:
            value = port.Eval(fresh if changed else working)
            port.FixValue(context, Value(value))


def simulate(found, *, changed=False):
    simulator = Simulator(found.system)
    fix_inputs(found, simulator.get_mutable_context(), changed=changed)
    return simulator


def vectors_out(system, context):
    """Its outputs, calculated anew, not from the cache."""
    output = system.AllocateOutput()
    system.CalcOutput(context, output)
    return [
        output.get_vector_data(port.get_index()).CopyToVector()
        for port in output_ports(system)
        if is_vector(port)
    ]


def results(system, context):
    """What comes out of a system; its state where it has no outputs."""
    if output_ports(system):
        return vectors_out(system, context)
    discrete = [
        context.get_discrete_state(index).CopyToVector()
        for index in range(context.num_discrete_state_groups())
    ]
    abstract = [
        context.get_abstract_state(index).get_value()
        for index in range(context.num_abstract_states())
    ]
    return discrete + abstract


def differ(results, others):
    return any(
        not np.array_equal(a, b) for a, b in zip(results, others, strict=True)
    )


def assert_works(results):
    """There is a result, and none is what stands for nothing yet."""
    assert results
    for result in results:
        assert np.size(result)
        if not isinstance(result, str):
            assert not np.isnan(result).any()


def test_every_choice_of_a_scenario_is_a_variant():
    assert {*choices(load_scenario("homing"))} >= {
        "estimator=hybrid",
        "avoidance=none",
    }
    assert {*choices(load_scenario("placement"))} >= {
        "avoid_collisions=false",
        "grid=plain",
    }
    assert len({shipped.name for shipped in shipped_diagrams()}) >= 6


def test_systems_are_where_they_are_looked_for():
    ours = {
        type(found.system)
        for found in all_systems()
        if type(found.system).__module__.startswith("drake_mobarm.")
    }
    assert ours <= set(library_systems())


@SYSTEMS
def test_the_system_is_in_a_shipped_diagram(kind):
    assert instances(kind)


@SYSTEMS
def test_the_documented_ports_are_the_real_ones(kind):
    ports = documented_ports(kind)
    assert ports["name"] == kind.__name__
    for found in instances(kind):
        inputs = [port.get_name() for port in input_ports(found.system)]
        outputs = [port.get_name() for port in output_ports(found.system)]
        assert ports.get("input_ports", []) == inputs
        assert ports.get("output_ports", []) == outputs
        assert [name for name, _, _ in port_lines(kind)] == inputs + outputs


@SYSTEMS
def test_the_documented_sizes_are_the_real_ones(kind):
    for found in instances(kind):
        ports = input_ports(found.system) + output_ports(found.system)
        for port, (_, size, _) in zip(ports, port_lines(kind), strict=True):
            if not is_vector(port):
                assert size == ""
            elif size.isdigit():
                assert port.size() == int(size)
            else:
                assert port.size() == NAMED_SIZES[size](found)


@SYSTEMS
def test_ports_have_the_elements_that_their_lines_name(kind):
    for found in instances(kind):
        ports = input_ports(found.system) + output_ports(found.system)
        for port, (name, _, text) in zip(ports, port_lines(kind), strict=True):
            named = [word for word in re.findall(r"\w+", text) if word in VIEWS]
            assert all(port.size() == VIEWS[view] for view in named)
            if name in SIGNALS:
                assert named == [SIGNALS[name].__name__]


def test_a_signals_name_always_stands_for_the_same_elements():
    met = set()
    diagrams = [shipped.diagram for shipped in shipped_diagrams()]
    for system in [*diagrams, *(found.system for found in all_systems())]:
        for port in input_ports(system) + output_ports(system):
            if port.get_name() in SIGNALS:
                met.add(port.get_name())
                elements = SIGNALS[port.get_name()].get_fields()
                assert port.size() == len(elements)
    assert met == set(SIGNALS)


@SYSTEMS
def test_feedthrough_is_as_documented(kind):
    said = re.findall(
        r"^(?:No d|D)irect feedthrough\.$", inspect.getdoc(kind), re.M
    )
    for found in instances(kind):
        if not output_ports(found.system):
            assert said == []
        elif found.system.HasAnyDirectFeedthrough():
            assert said == ["Direct feedthrough."]
        else:
            assert said == ["No direct feedthrough."]


@SYSTEMS
def test_the_same_context_gives_the_same_output(kind):
    for found in instances(kind):
        simulator = simulate(found)
        simulator.AdvanceTo(0.3)
        context = simulator.get_context()
        once = results(found.system, context)
        assert_works(once)
        # What calculates it again may have met another context meanwhile.
        simulate(found, changed=True).AdvanceTo(0.1)
        assert not differ(results(found.system, context), once)
        assert not differ(results(found.system, context.Clone()), once)


@SYSTEMS
def test_the_same_context_goes_on_in_the_same_way(kind):
    for found in instances(kind):
        simulator = simulate(found)
        simulator.AdvanceTo(0.1)
        ends = []
        for _ in range(2):
            going_on = Simulator(found.system, simulator.get_context().Clone())
            going_on.AdvanceTo(0.3)
            ends.append(results(found.system, going_on.get_context()))
        assert_works(ends[0])
        assert not differ(*ends)


@SYSTEMS
def test_two_contexts_never_meet(kind):
    for found in instances(kind):
        alone = simulate(found)
        alone.AdvanceTo(0.313)
        expected = results(found.system, alone.get_context())
        assert_works(expected)
        beside, again = simulate(found, changed=True), simulate(found)
        for time in (0.053, 0.123, 0.203, 0.313):
            beside.AdvanceTo(time)
            again.AdvanceTo(time)
        assert not differ(results(found.system, again.get_context()), expected)
        # They would not have met if nothing had come of what is fed.
        assert differ(results(found.system, beside.get_context()), expected)


def test_abstract_states_are_replaced_and_never_written_to():
    met = set()
    for kind in library_systems():
        for found in instances(kind):
            context = found.system.GetMyContextFromRoot(found.shipped.working)
            for index in range(context.num_abstract_states()):
                value = context.get_abstract_state(index).get_value()
                assert copy.deepcopy(value) is value
                if not isinstance(value, str):
                    assert type(value).__dataclass_params__.frozen
                    met.add(kind.__name__)
    assert met >= {"TargetEstimator", "ObstacleAvoidance", "StandPlanner"}
