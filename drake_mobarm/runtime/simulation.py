"""Runs a scenario: simulate, watch for the end, log, record."""

import time
from collections.abc import Callable, Iterator, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
from pydrake.common import RandomGenerator
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, System
from pydrake.systems.primitives import VectorLogSink

from drake_mobarm.checks import check_seed
from drake_mobarm.diagrams.wiring import NO_BLOCKS, TRACE
from drake_mobarm.drawing.stage import FRAMES_PER_SECOND
from drake_mobarm.exceptions import BlockError, OutputError, SimulationError
from drake_mobarm.geometry import Array
from drake_mobarm.job import Job, Trace, Verdict, spawn_seeds
from drake_mobarm.runtime.result import Result
from drake_mobarm.runtime.scenarios import checked_copy, job_of

_CHECK_PERIOD = 0.05

# Names that a trace and its file have for themselves.
_RESERVED = ("t", "file")


def build_diagram(
    scenario: Any,
    *,
    seed: int | None = None,
    meshcat: Meshcat | None = None,
    blocks: Mapping[str, System] = NO_BLOCKS,
) -> Diagram:
    """Builds the diagram that a scenario names.

    Args:
        scenario: from `load_scenario`.
        seed: of all noise that the diagram is built with; the rest is in its
            context. None for the scenario's own.
        meshcat: where to draw, if anywhere.
        blocks: systems that take the places of shipped blocks, by name.

    Raises:
        ScenarioError: it is no scenario, or makes no sense.
        ParameterError: the seed or a value of the scenario is not valid.
        WorldError: the world cannot be used.
        BlockError: a block's ports do not fit, or its name is unknown.
    """
    job = job_of(scenario)
    scenario, seed = _seeded(scenario, job, seed)
    return _build(job, scenario, seed, meshcat, blocks)


def run(
    scenario: Any,
    seed: int | None = None,
    *,
    blocks: Mapping[str, System] = NO_BLOCKS,
    build: Callable[..., Diagram] | None = None,
    judge: Callable[[Any, Trace, Mapping[str, Any]], Verdict] | None = None,
    record: bool = False,
    live: bool = False,
    on_progress: Callable[[float], None] | None = None,
    on_live: Callable[[str], None] | None = None,
) -> Result:
    """Simulates a scenario until its job is done or its time is up.

    Args:
        scenario: what to run, from `load_scenario`; it is copied and checked
            anew.
        seed: of all noise; the same one gives the same trace, to the bit.
            None for the scenario's own.
        blocks: systems that take the places of shipped blocks, by name. A
            system is part of one diagram: make a new one for each run.
        build: builds another diagram than the scenario names: called as
            `build(scenario, seed=..., meshcat=...)`, and with `blocks` where
            there are any. The diagram needs an output `done` (1) that ends
            the run; its VectorLogSinks give the trace.
        judge: tells success and reason instead of the job's own judge, whose
            metrics stay, beside those of this one. A diagram of `build`
            succeeds by default when it is done.
        record: whether to keep an HTML recording.
        live: whether to show the run in a browser, at real time.
        on_progress: called with the simulated time [s] now and then.
        on_live: called with the address to open, once it is there.

    Raises:
        ScenarioError: it is no scenario, or makes no sense.
        ParameterError: the seed or a value of the scenario is not valid.
        WorldError: the world cannot be used.
        BlockError: a block's ports do not fit, or its name is unknown; or
            the diagram has no output `done`, or logs that make no trace.
        SimulationError: Drake cannot go on.
    """
    if build is None:
        job = job_of(scenario)
    else:
        job = Job(
            name=getattr(build, "__name__", "own"),
            scenario=type(scenario),
            module=SimpleNamespace(build=build),
        )
    scenario, seed = _seeded(scenario, job, seed)
    meshcat = _start_meshcat() if record or live else None
    diagram = _build(job, scenario, seed, meshcat, blocks)
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.SetRandomContext(context, RandomGenerator(spawn_seeds(seed)[1]))
    if meshcat is not None:
        set_stage = job.find("view", "set_stage")
        if set_stage is not None:
            set_stage(meshcat, scenario)
        meshcat.StartRecording(FRAMES_PER_SECOND)
        if live:
            simulator.set_target_realtime_rate(1.0)
            if on_live is not None:
                on_live(meshcat.web_url())
    started = time.perf_counter()
    _advance(simulator, 0.0)
    done = diagram.GetOutputPort("done")
    steps = int(np.ceil(scenario.time_limit / _CHECK_PERIOD))
    for step in range(1, steps + 1):
        _advance(simulator, min(step * _CHECK_PERIOD, scenario.time_limit))
        if on_progress is not None:
            on_progress(context.get_time())
        if done.Eval(context)[0] > 0.5:
            break
    wall = time.perf_counter() - started
    recording = None
    if meshcat is not None:
        meshcat.StopRecording()
        meshcat.PublishRecording()
        recording = meshcat.StaticHtml() if record else None
    trace = read_trace(diagram, context)
    outputs = {
        port.get_name(): port.Eval(context)
        for port in map(
            diagram.get_output_port, range(diagram.num_output_ports())
        )
    }
    verdict = Verdict(*job.judge(scenario, trace, outputs))
    if judge is not None:
        own = Verdict(*judge(scenario, trace, outputs))
        # The job's report shows the job's metrics.
        verdict = own._replace(metrics=verdict.metrics | own.metrics)
    return Result(
        scenario=scenario,
        seed=seed,
        success=verdict.success,
        reason=verdict.reason,
        simulated_s=context.get_time(),
        wall_s=wall,
        metrics=verdict.metrics,
        trace=trace,
        outputs=outputs,
        job=job,
        recording=recording,
        diagram_dot=diagram.GetGraphvizString(max_depth=2),
    )


def read_trace(diagram: Diagram, context: Context) -> dict[str, Array]:
    """What the diagram's logs hold: `t` (n,), and (n, size) a signal.

    Raises:
        BlockError: two logs have one name, a reserved one, or other times.
    """
    trace: dict[str, Array] = {}
    for system in _walk(diagram):
        if not isinstance(system, VectorLogSink):
            continue
        log = system.FindLog(context)
        name = system.get_name().removeprefix(TRACE)
        if name in trace or name in _RESERVED:
            raise BlockError(
                f"log {name!r}: valid is a name of its own, other than "
                f"{' and '.join(_RESERVED)}"
            )
        times = log.sample_times()
        if not np.array_equal(trace.setdefault("t", times.copy()), times):
            raise BlockError(
                f"log {name!r} was not sampled at the same times as the "
                "others: valid is one period for all"
            )
        trace[name] = log.data().T.copy()
    trace.setdefault("t", np.empty(0))
    return trace


def _walk(diagram: Diagram) -> Iterator[System]:
    for system in diagram.GetSystems():
        yield system
        if isinstance(system, Diagram):
            yield from _walk(system)


def _start_meshcat() -> Meshcat:
    try:
        return Meshcat()
    except RuntimeError as error:  # No port is free.
        raise OutputError(f"Meshcat does not start: {error}") from error


def _advance(simulator: Simulator, time: float) -> None:
    """Simulates until a time [s]."""
    try:
        simulator.AdvanceTo(time)
    except RuntimeError as error:
        if type(error) is not RuntimeError:
            raise  # Of a block in Python.
        now = simulator.get_context().get_time()
        line = " ".join(str(error).split())[:300]
        raise SimulationError(
            f"the simulation cannot go on at {now:g} s: {line}"
        ) from error


def _seeded(scenario: Any, job: Job, seed: int | None) -> tuple[Any, int]:
    """A checked copy of a scenario, and the seed of its run."""
    if seed is not None:
        check_seed(seed)
        seed = int(seed)
    scenario = checked_copy(scenario, job, seed)
    own = getattr(scenario, "seed", 0)
    return scenario, own if seed is None else seed


def _build(
    job: Job,
    scenario: Any,
    seed: int,
    meshcat: Meshcat | None,
    blocks: Mapping[str, System],
) -> Diagram:
    exchanged = {"blocks": blocks} if blocks else {}
    diagram: Diagram = job.build(
        scenario, seed=seed, meshcat=meshcat, **exchanged
    )
    if not isinstance(diagram, Diagram) or not diagram.HasOutputPort("done"):
        raise BlockError(
            f"what {job.name!r} builds is no Diagram with an output port "
            "'done', which ends a run when it is above 0.5"
        )
    return diagram
