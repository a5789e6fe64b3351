"""How much faster than real time the shipped homing scenario runs.

    python benchmarks/homing_speed.py [--runs 5] [--out FILE]

Small house, contact on, no recording, one core. The whole run counts, from
start to arrival: wall time over simulated time. Less and less of the same
diagram runs for as long: the station (sensors and drivers, at rest), the
plant alone. They take turns, so that a noisy machine hits all alike; the best
run tells what the code costs, the median what a shared machine makes of it.
The ratio is that of the whole loop to the plant alone.

One more run of the whole loop times the Python callbacks of each system, each
without those of other systems that it evaluates, but with what Drake computes
for it meanwhile. The rest is the plant, Drake's own systems and its framework.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # One core.

import platform
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib.metadata import version
from typing import Any
from unittest.mock import patch

import numpy as np
from common import parse, publish, use_one_core
from pydrake.common import RandomGenerator
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource

from drake_mobarm import load_scenario
from drake_mobarm.diagrams.station import build_station
from drake_mobarm.homing.job import HomingScenario
from drake_mobarm.robot.shape import STOWED
from drake_mobarm.runtime.simulation import run
from drake_mobarm.sensors.beacon import Beacon
from drake_mobarm.station.plant import add_plant
from drake_mobarm.world.sdf import load_world

PLANT = "plant alone"
STATION = "station at rest"
HOMING = "homing, start to arrival"


def plant_alone(scenario: HomingScenario) -> Diagram:
    """The contact plant, no torque on any joint: wheels and arm are free."""
    builder = DiagramBuilder()
    plant, _ = add_plant(
        builder,
        load_world(scenario.world, scenario.meshes),
        scenario.start,
        scenario.station.time_step,
    )
    torque = builder.AddSystem(
        ConstantVectorSource(np.zeros(plant.num_actuators()))
    )
    builder.Connect(torque.get_output_port(), plant.get_actuation_input_port())
    return builder.Build()


def station_at_rest(scenario: HomingScenario) -> Diagram:
    """Plant, sensors and drivers, told to stand still."""
    builder = DiagramBuilder()
    station = builder.AddSystem(
        build_station(
            load_world(scenario.world, scenario.meshes),
            scenario.start,
            scenario.station,
            Beacon(position=scenario.beacon, noise=scenario.noise),
        )
    )
    for port, value in (
        ("commanded_base_velocity", [0.0, 0.0]),
        ("desired_arm_state", [*STOWED, *np.zeros(6)]),
    ):
        source = builder.AddSystem(ConstantVectorSource(value))
        builder.Connect(source.get_output_port(), station.GetInputPort(port))
    return builder.Build()


def measure(diagram: Diagram, seconds: float) -> float:
    """Wall time of a run [ms] a simulated second."""
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.SetRandomContext(context, RandomGenerator(0))
    started = time.perf_counter()
    simulator.Initialize()
    simulator.AdvanceTo(seconds)
    return (time.perf_counter() - started) / seconds * 1e3


class CallbackTimer:
    """Times the Python callbacks of every LeafSystem, by its class's name.

    Attributes:
        seconds: in callbacks of a system, without those of other systems
            that they evaluate.
        calls: of its callbacks.
    """

    def __init__(self) -> None:
        self.seconds: Counter[str] = Counter()
        self.calls: Counter[str] = Counter()
        self._nested = [0.0]

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Times the systems that are made meanwhile."""
        with ExitStack() as patches:
            for name in dir(LeafSystem):
                if name.startswith("Declare"):
                    declare = getattr(LeafSystem, name)
                    patches.enter_context(
                        patch.object(LeafSystem, name, self._declare(declare))
                    )
            yield

    def _declare(self, declare: Callable[..., Any]) -> Callable[..., Any]:
        def declare_timed(system: LeafSystem, *args: Any, **named: Any) -> Any:
            name = type(system).__name__
            return declare(
                system,
                *(self._timed(name, x) if callable(x) else x for x in args),
                **{
                    key: self._timed(name, x) if callable(x) else x
                    for key, x in named.items()
                },
            )

        return declare_timed

    def _timed(
        self, name: str, callback: Callable[..., Any]
    ) -> Callable[..., Any]:
        def timed(*args: Any) -> Any:
            self._nested.append(0.0)
            started = time.perf_counter()
            result = callback(*args)
            elapsed = time.perf_counter() - started
            self.seconds[name] += elapsed - self._nested.pop()
            self._nested[-1] += elapsed
            self.calls[name] += 1
            return result

        return timed


def break_down(scenario: HomingScenario) -> dict[str, dict[str, float]]:
    """Cost [ms] and callbacks of each system, a simulated second."""
    timer = CallbackTimer()
    with timer.watching():
        result = run(scenario)
    parts = {
        name: {
            "cost": seconds / result.simulated_s * 1e3,
            "callbacks": timer.calls[name] / result.simulated_s,
        }
        for name, seconds in timer.seconds.most_common()
    }
    whole = 1e3 / result.real_time_factor
    rest = whole - sum(part["cost"] for part in parts.values())
    return parts | {"the rest": {"cost": rest, "callbacks": 0.0}}


def main() -> None:
    """Measures, prints and, if asked, writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    options = parse(parser)
    use_one_core()
    scenario = load_scenario("homing")
    seconds = run(scenario).simulated_s  # The first one warms up, too.
    costs: dict[str, list[float]] = {PLANT: [], STATION: [], HOMING: []}
    for _ in range(options.runs):
        costs[PLANT].append(measure(plant_alone(scenario), seconds))
        costs[STATION].append(measure(station_at_rest(scenario), seconds))
        costs[HOMING].append(1e3 / run(scenario).real_time_factor)
    measured = {
        name: {"best": min(values), "median": float(np.median(values))}
        for name, values in costs.items()
    }
    ratio = {
        kind: measured[HOMING][kind] / measured[PLANT][kind]
        for kind in ("best", "median")
    }
    parts = break_down(scenario)
    lines = [
        f"`homing`, {scenario.world}, {seconds:g} s to arrival, "
        f"{options.runs} runs of each in turn, "
        f"Python {platform.python_version()}, Drake {version('drake')}, "
        f"numpy {np.__version__}",
        "",
        "| what runs | best [ms/s] | median [ms/s] | times real time, best |"
        " times real time, median |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    lines += [
        f"| {name} | {m['best']:.1f} | {m['median']:.1f} | "
        f"{1e3 / m['best']:.1f} | {1e3 / m['median']:.1f} |"
        for name, m in measured.items()
    ]
    lines += [
        "",
        f"The whole loop costs {ratio['best']:.2f} times the plant alone, best "
        f"over best, and {ratio['median']:.2f} times, median over median.",
        "",
        "| Python callbacks of, in one timed run | cost [ms/s] | calls [1/s] |",
        "| --- | ---: | ---: |",
    ]
    lines += [
        f"| {name} | {part['cost']:.2f} | {part['callbacks']:.0f} |"
        for name, part in parts.items()
    ]
    publish(
        lines,
        {"runs": measured, "ratio": ratio, "callbacks": parts},
        options.out,
    )


if __name__ == "__main__":
    main()
