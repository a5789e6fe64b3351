"""How much faster than real time the shipped homing scenario runs.

    python benchmarks/homing_speed.py [--runs 5] [--out FILE]

Small house, contact on, no recording, one core. The whole run counts, from
start to arrival: wall time over simulated time. The breakdown comes from
running less and less of the same diagram for as long: the station (sensors and
drivers, at rest), the plant alone. Each is repeated; the best run tells what
the code costs, the median what a shared machine makes of it.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # One core.

import platform
import time
from collections.abc import Callable
from importlib.metadata import version

import numpy as np
from common import parse, publish
from pydrake.common import RandomGenerator
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_mobarm import load_scenario
from drake_mobarm.diagrams.station import build_station
from drake_mobarm.homing.job import HomingScenario
from drake_mobarm.robot.shape import STOWED
from drake_mobarm.runtime.simulation import run
from drake_mobarm.sensors.beacon import Beacon
from drake_mobarm.station.plant import add_plant
from drake_mobarm.world.sdf import load_world


def plant_alone(scenario: HomingScenario) -> Diagram:
    """The contact plant, no torque on any joint: wheels and arm are free."""
    builder = DiagramBuilder()
    plant, _ = add_plant(
        builder,
        load_world(scenario.world),
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
            load_world(scenario.world),
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


def measure(
    build: Callable[[HomingScenario], Diagram],
    scenario: HomingScenario,
    runs: int,
    seconds: float,
) -> dict[str, float]:
    """Best and median [ms] a simulated second of whole runs."""
    costs = []
    for _ in range(runs):
        diagram = build(scenario)
        simulator = Simulator(diagram)
        context = simulator.get_mutable_context()
        diagram.SetRandomContext(context, RandomGenerator(0))
        simulator.Initialize()
        started = time.perf_counter()
        simulator.AdvanceTo(seconds)
        costs.append((time.perf_counter() - started) / seconds * 1e3)
    return {"best": min(costs), "median": float(np.median(costs))}


def main() -> None:
    """Measures, prints and, if asked, writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    options = parse(parser)
    scenario = load_scenario("homing")
    results = [run(scenario) for _ in range(options.runs)]
    seconds = results[0].simulated_s
    whole = [1e3 / result.real_time_factor for result in results]
    measured = {
        name: measure(build, scenario, options.runs, seconds)
        for name, build in (
            ("plant alone", plant_alone),
            ("station at rest", station_at_rest),
        )
    }
    measured["homing, start to arrival"] = {
        "best": min(whole),
        "median": float(np.median(whole)),
    }
    lines = [
        f"`homing`, {scenario.world}, {seconds:g} s to arrival, "
        f"{options.runs} runs, "
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
    publish(lines, measured, options.out)


if __name__ == "__main__":
    main()
