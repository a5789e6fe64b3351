"""A run checks what it is given anew, and keeps it as it was."""

import copy
import dataclasses
import functools
import pickle

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_mobarm import build_diagram, changed, load_scenario, run
from drake_mobarm.exceptions import (
    BlockError,
    FrozenError,
    MobarmError,
    ParameterError,
    ScenarioError,
    SimulationError,
    WorldError,
)
from drake_mobarm.homing.hybrid import HybridParameters
from drake_mobarm.job import Verdict, job_names

OPEN = ["world=empty", "avoidance=none", "start=[0, 0, 0]", "beacon=[2, 1]"]


def blink():
    return load_scenario("homing", [*OPEN, "time_limit=0.1"])


def with_value(part, name, value):
    """The scenario made by hand with another value, which nobody checked."""
    first, _, rest = name.partition(".")
    if rest:
        value = with_value(getattr(part, first), rest, value)
    made = copy.copy(part)
    object.__setattr__(made, first, value)
    return made


def test_a_result_keeps_the_scenario_as_it_was_run():
    start, beacon = np.zeros(3), [2.0, 1.0]
    given = dataclasses.replace(blink(), start=start, beacon=beacon)
    result = run(given)
    beacon[0], start[0] = 7.0, 3.0
    assert result.scenario == blink()


@pytest.mark.parametrize("name", ["noise", "nosie", "beacon", "station"])
@pytest.mark.parametrize("part", ["", "station", "station.lidar", "hybrid"])
def test_a_scenario_cannot_be_changed_and_the_refusal_tells_the_way(name, part):
    owner = functools.reduce(getattr, filter(None, part.split(".")), blink())
    with pytest.raises(FrozenError, match=rf"^{name} of .* changed\(scenario"):
        setattr(owner, name, 2)
    with pytest.raises(FrozenError, match=rf"^{name} of "):
        delattr(owner, name)


def test_no_value_of_a_loaded_scenario_can_be_written_to():
    def values(part):
        for field in dataclasses.fields(part):
            value = getattr(part, field.name)
            yield from (
                values(value) if dataclasses.is_dataclass(value) else [value]
            )

    for job in job_names():
        for value in values(load_scenario(job)):
            hash(value)  # A list or an array has none.


def test_a_changed_copy_has_the_other_values_and_the_scenario_its_own():
    scenario = blink()
    other = changed(
        scenario,
        noise=np.int64(2),
        beacon=np.array([3.0, 1.0]),
        hybrid=HybridParameters(tau=9.0),
        **{"station.lidar.rays": 90},
    )
    assert scenario == blink()
    overrides = ["noise=2", "beacon=[3, 1]", "hybrid.tau=9"]
    overrides += ["station.lidar.rays=90", "time_limit=0.1"]
    assert other == load_scenario("homing", [*OPEN, *overrides])


@pytest.mark.parametrize(
    ("name", "value", "error", "words"),
    [
        ("estimator", "hybird", ParameterError, ["hybird", "hybrid, filter"]),
        ("avoidance", "rulez", ParameterError, ["rulez", "none, rules"]),
        ("time_limit", -3.0, ParameterError, ["time_limit", "-3"]),
        ("time_limit", np.nan, ScenarioError, ["time_limit", "finite"]),
        ("time_limt", 3, ScenarioError, ["unknown key time_limt"]),
        ("station.lidar.rayz", 3, ScenarioError, ["station.lidar.rayz"]),
        ("station.lidar", 3, ScenarioError, ["station.lidar"]),
        ("station.lidar.rays", 8.5, ScenarioError, ["rays", "int"]),
        ("station.base_drive.base.mass", -1.0, ParameterError, ["mass"]),
        ("start", None, ScenarioError, ["start", "not a list"]),
        ("start", [0.0, 0.0], ParameterError, ["start", "yaw"]),
        ("world", "mars", MobarmError, ["mars", "small_house"]),
    ],
)
@pytest.mark.parametrize("do", [run, build_diagram])
def test_a_scenario_that_nobody_checked_is_checked(
    do, name, value, error, words
):
    with pytest.raises(error) as caught:
        do(with_value(blink(), name, value))
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value", "error", "words"),
    [
        ("noise", 33, ParameterError, ["noise", "33", "1, 2, 3, 4, 5"]),
        ("nosie", 2, ScenarioError, ["unknown key nosie"]),
        ("station.lidar.rayz", 3, ScenarioError, ["station.lidar.rayz"]),
        ("noise.level", 3, ScenarioError, ["noise.level", "no parts"]),
        ("beacon", [50.0, 50.0], ScenarioError, ["beacon", "outside"]),
        ("start", [-6.0, 2.0, 0.0], ScenarioError, ["start", "inside"]),
        ("start", "here", ScenarioError, ["start", "not a list"]),
        ("world", "mars", WorldError, ["mars", "small_house"]),
        ("diagram", "placement", ScenarioError, ["placement"]),
        ("diagram", "dancing", ScenarioError, ["dancing", "homing"]),
    ],
)
def test_a_changed_copy_is_checked_in_full(name, value, error, words):
    with pytest.raises(error) as caught:
        changed(load_scenario("homing"), **{name: value})
    for word in words:
        assert word in str(caught.value)


def test_only_a_scenario_has_changed_copies():
    with pytest.raises(ScenarioError, match="no scenario"):
        changed("homing", noise=2)


def test_a_place_that_was_changed_is_checked_again():
    scenario = load_scenario("homing", ["time_limit=0.1"])
    with pytest.raises(ScenarioError, match="inside an obstacle"):
        run(dataclasses.replace(scenario, start=[-6.0, 2.0, 0.0]))


@pytest.mark.parametrize("do", [run, build_diagram])
def test_a_scenario_of_another_job_is_refused(do):
    scenario = dataclasses.replace(blink(), diagram="placement")
    with pytest.raises(ScenarioError, match=r"HomingScenario .* 'placement'"):
        do(scenario)


def test_arrays_are_as_good_as_lists():
    scenario = dataclasses.replace(
        blink(), start=np.zeros(3), noise=np.int64(3)
    )
    assert run(scenario, np.int64(2)).scenario.start == (0.0, 0.0, 0.0)


def test_a_run_has_the_seed_of_its_scenario_unless_it_is_given_one():
    scenario = changed(blink(), seed=4)
    own, given = run(scenario), run(scenario, seed=5)
    assert (own.seed, own.scenario.seed) == (4, 4)
    assert (given.seed, given.scenario.seed) == (5, 5)
    for result in (own, given):
        again = run(result.scenario)
        np.testing.assert_array_equal(
            again.trace["beacon_reading"], result.trace["beacon_reading"]
        )


@pytest.mark.parametrize("seed", [-1, "1", 0.5, True])
def test_a_diagram_is_not_built_from_a_seed_that_is_no_seed(seed):
    with pytest.raises(ParameterError, match="seed"):
        build_diagram(blink(), seed=seed)


def test_a_judge_of_ones_own_replaces_the_jobs(tmp_path):
    result = run(
        blink(),
        judge=lambda scenario, trace, outputs: (True, "mine", {"mine": 1.0}),
    )
    assert result.success
    assert result.reason == "mine"
    # The job's metrics stay, so that it is shown as the job's runs are.
    assert result.metrics == run(blink()).metrics | {"mine": 1.0}
    assert result.describe().startswith("success: mine\n  time ")
    assert result.save(tmp_path).name == "trajectory.png"


def test_a_result_may_be_copied_pickled_and_printed():
    result = run(blink(), record=True)
    again = pickle.loads(pickle.dumps(result))
    assert again.metrics.keys() == result.metrics.keys()
    assert copy.deepcopy(result) != result  # A run equals no other.
    assert len(repr(result)) < 5000


def with_logs(*logs):
    """A build function whose diagram has logs of names and periods."""

    def build(scenario, *, seed, meshcat=None):
        builder = DiagramBuilder()
        source = builder.AddSystem(ConstantVectorSource([0.0]))
        for name, period in logs:
            log = LogVectorOutput(source.get_output_port(), builder, period)
            log.set_name(name)
        builder.ExportOutput(source.get_output_port(), "done")
        return builder.Build()

    return build


def test_logs_of_diagrams_in_the_diagram_are_in_the_trace():
    def build(scenario, *, seed, meshcat=None):
        inner = with_logs(("trace.deep", 0.05))(scenario, seed=seed)
        inner.set_name("inner")
        builder = DiagramBuilder()
        builder.AddSystem(inner)
        builder.ExportOutput(inner.GetOutputPort("done"), "done")
        return builder.Build()

    trace = run(blink(), build=build).trace
    assert trace["deep"].shape == (3, 1)
    np.testing.assert_allclose(trace["t"], [0.0, 0.05, 0.1])


def test_a_diagram_without_logs_has_an_empty_trace():
    result = run(blink(), build=with_logs())
    assert result.trace.keys() == {"t"}
    assert result.to_frame().shape == (0, 0)


@pytest.mark.parametrize(
    ("logs", "words"),
    [
        ([("a", 0.05), ("b", 0.1)], "same times"),
        ([("t", 0.05)], "log 't'"),
        ([("trace.file", 0.05)], "log 'file'"),
        ([("a", 0.05), ("trace.a", 0.05)], "log 'a'"),
    ],
)
def test_logs_that_make_no_trace_are_refused(logs, words):
    with pytest.raises(BlockError, match=words):
        run(blink(), build=with_logs(*logs))


def test_a_verdict_is_a_verdict():
    result = run(blink(), judge=lambda *_: Verdict(False, "no", {"x": None}))
    assert '"x": null' in result.summary()


class Breaking(LeafSystem):
    """Raises what it is given when it is asked."""

    def __init__(self, error):
        super().__init__()
        self._error = error
        self.DeclareVectorOutputPort("done", 1, self._fail)
        self.DeclarePeriodicPublishEvent(0.01, 0.0, lambda _: self._raise())

    def _fail(self, context, output):
        output.SetFromVector([0.0])

    def _raise(self):
        raise self._error


@pytest.mark.parametrize(
    ("error", "raised"),
    [
        (RuntimeError("the solver\nfailed"), SimulationError),
        (ZeroDivisionError("mine"), ZeroDivisionError),
        (NotImplementedError("mine"), NotImplementedError),
    ],
)
def test_a_simulation_that_cannot_go_on_says_when_and_why(error, raised):
    def build(scenario, *, seed, meshcat=None):
        builder = DiagramBuilder()
        system = builder.AddSystem(Breaking(error))
        builder.ExportOutput(system.get_output_port(), "done")
        return builder.Build()

    with pytest.raises(raised) as caught:
        run(blink(), build=build)
    if raised is SimulationError:
        assert "cannot go on at 0" in str(caught.value)
        assert "the solver failed" in str(caught.value)
