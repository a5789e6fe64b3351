"""Runs a scenario: simulate, watch for the end, log, record."""

import importlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common import RandomGenerator
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram
from pydrake.systems.primitives import VectorLogSink

from drake_mobarm.checks import require
from drake_mobarm.drawing.stage import FRAMES_PER_SECOND
from drake_mobarm.geometry import Array
from drake_mobarm.job import TASKS
from drake_mobarm.runtime.scenarios import Scenario

_LOG_PREFIX = "trace."
_CHECK_PERIOD = 0.05


@dataclass(frozen=True, kw_only=True)
class Result:
    """What came out of a run.

    Attributes:
        scenario: as it was run.
        seed: of all noise.
        success: whether the robot did its job.
        reason: why, or why not.
        simulated_s: simulated time [s].
        wall_s: time that it took [s], building not included.
        metrics: name to number, SI units in the name.
        trace: `t` (n,) and a signal's (n, size) each.
        outputs: the diagram's outputs at the end, by name.
        recording: self-contained HTML, if asked for.
        diagram_dot: the block diagram in DOT.
    """

    scenario: Scenario
    seed: int
    success: bool
    reason: str
    simulated_s: float
    wall_s: float
    metrics: dict[str, float]
    trace: dict[str, Array]
    outputs: dict[str, Any]
    recording: str | None
    diagram_dot: str

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds a second."""
        return self.simulated_s / self.wall_s

    def summary(self) -> str:
        """The run in JSON; a metric without a value is null."""
        metrics = {
            name: value if np.isfinite(value) else None
            for name, value in self.metrics.items()
        }
        return json.dumps(
            {
                "scenario": self.scenario.diagram,
                "seed": self.seed,
                "success": self.success,
                "reason": self.reason,
                "simulated_s": self.simulated_s,
                "wall_s": self.wall_s,
                "real_time_factor": self.real_time_factor,
                "metrics": metrics,
            },
            indent=2,
        )


def build_diagram(
    scenario: Scenario,
    calibration_seed: int = 0,
    meshcat: Meshcat | None = None,
) -> Diagram:
    """Builds the diagram that a scenario names."""
    module = importlib.import_module(
        f"drake_mobarm.diagrams.{scenario.diagram}"
    )
    diagram: Diagram = module.build(scenario, calibration_seed, meshcat)
    return diagram


def run(
    scenario: Scenario,
    seed: int = 0,
    *,
    record: bool = False,
    live: bool = False,
    on_progress: Callable[[float], None] | None = None,
    on_live: Callable[[str], None] | None = None,
) -> Result:
    """Simulates a scenario until its job is done or its time is up.

    Args:
        scenario: what to run.
        seed: of all noise; the same one gives the same trace, to the bit.
        record: whether to keep an HTML recording.
        live: whether to show the run in a browser, at real time.
        on_progress: called with the simulated time [s] now and then.
        on_live: called with the address to open, once it is there.
    """
    require(0 <= seed < 2**63, "seed", seed, "a whole number, 0 or more")
    calibration_seed, noise_seed = (
        int(s) for s in np.random.SeedSequence(seed).generate_state(2)
    )
    task = TASKS[scenario.diagram]
    meshcat = Meshcat() if record or live else None
    diagram = build_diagram(scenario, calibration_seed, meshcat)
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.SetRandomContext(context, RandomGenerator(noise_seed))
    if meshcat is not None:
        task.set_stage(meshcat, scenario)
        meshcat.StartRecording(FRAMES_PER_SECOND)
        if live:
            simulator.set_target_realtime_rate(1.0)
            if on_live is not None:
                on_live(meshcat.web_url())
    started = time.perf_counter()
    simulator.Initialize()
    done = diagram.GetOutputPort("done")
    steps = int(np.ceil(scenario.time_limit / _CHECK_PERIOD))
    for step in range(1, steps + 1):
        simulator.AdvanceTo(min(step * _CHECK_PERIOD, scenario.time_limit))
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
    success, reason, metrics = task.judge(scenario, trace, outputs)
    return Result(
        scenario=scenario,
        seed=seed,
        success=success,
        reason=reason,
        simulated_s=context.get_time(),
        wall_s=wall,
        metrics=metrics,
        trace=trace,
        outputs=outputs,
        recording=recording,
        diagram_dot=diagram.GetGraphvizString(max_depth=1),
    )


def read_trace(diagram: Diagram, context: Context) -> dict[str, Array]:
    """What the diagram's logs hold: `t` (n,), and (n, size) a signal."""
    trace: dict[str, Array] = {}
    for system in diagram.GetSystems():
        if isinstance(system, VectorLogSink):
            log = system.FindLog(context)
            trace["t"] = log.sample_times().copy()
            name = system.get_name().removeprefix(_LOG_PREFIX)
            trace[name] = log.data().T.copy()
    return trace
