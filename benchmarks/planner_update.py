"""How long one update of each of navigation's planners takes.

    python benchmarks/planner_update.py [--pairs 3] [--replays 3] [--out FILE]

Each planner drives between the same pairs of places in the three buildings, for
30 s at the most, and all that it is given at its scans of 360 rays is kept:
poses, targets and ranges. Then the law alone is given the same again, from its
first state on: the time of an update is the least of all replays, which others
on the machine disturb least. Making the highway and the known floor is not part
of it. One core; processor time.
"""

import argparse
import os
import platform
import time
from typing import Any, NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # One core.

import numpy as np
from common import parse, processor, publish, use_one_core

from drake_mobarm import load_scenario, run
from drake_mobarm.diagrams.navigation import load_plan, make_law
from drake_mobarm.geometry import Array
from drake_mobarm.job import spawn_seeds
from drake_mobarm.navigation.job import PLANNERS, NavigationScenario
from drake_mobarm.navigation.planner import PlannerLaw, PlannerState
from drake_mobarm.navigation.systems import NavigationPlanner
from drake_mobarm.navigation.trials import make_pair
from drake_mobarm.station.parameters import PROCESSING_DELAY

WORLDS = ("small_house", "bookstore", "cafe")
SEED = 5000  # Of pairs that no table uses.
LONGEST = 30  # Drive [s]: a trapped robot repeats itself.
TO_REACH_MS = {"ours": 5.0, "apf": 2.0, "apf_escape": 2.0, "apf_hw": 2.0}


class Given(NamedTuple):
    """What an update is given: pose, target and ranges."""

    pose_WB: Array
    p_WT: Array
    ranges: Array


class RecordingLaw:
    """A law that keeps all that it is given."""

    def __init__(self, law: PlannerLaw) -> None:
        self.law = law
        self.given: list[Given] = []

    def initial_state(self) -> PlannerState:
        """The law's."""
        return self.law.initial_state()

    def update(
        self, state: PlannerState, pose_WB: Array, p_WT: Array, ranges: Array
    ) -> PlannerState:
        """The law's, of what is kept from now on."""
        self.given.append(Given(pose_WB.copy(), p_WT.copy(), ranges.copy()))
        return self.law.update(state, pose_WB, p_WT, ranges)

    def command(
        self, state: PlannerState, pose_WB: Array
    ) -> tuple[float, float]:
        """The law's."""
        return self.law.command(state, pose_WB)


def record(planner: str, world: str, index: int) -> RecordingLaw:
    """What a planner is given on a drive between a pair of places."""
    pair = make_pair(world, SEED, index)
    scenario = load_scenario(
        "navigation",
        [
            f"world={world}",
            f"start={pair.start}",
            f"target={pair.target}",
            f"planner={planner}",
            f"time_limit={LONGEST}",
        ],
    )
    assert isinstance(scenario, NavigationScenario)
    station = scenario.station
    seed, _ = spawn_seeds(pair.seed)
    law = RecordingLaw(make_law(scenario, station, load_plan(scenario), seed))
    block = NavigationPlanner(law, station.lidar, PROCESSING_DELAY)
    run(scenario, pair.seed, blocks={"planner": block})
    return law


def replay(law: PlannerLaw, given: list[Given]) -> Array:
    """Processor time of each update [ms]."""
    state, times = law.initial_state(), []
    for each in given:
        started = time.thread_time_ns()
        state = law.update(state, *each)
        times.append(time.thread_time_ns() - started)
    return np.array(times) / 1e6


def measure(planner: str, world: str, pairs: int, replays: int) -> Array:
    """Processor time of each update in a building [ms]."""
    times = []
    for index in range(pairs):
        recorded = record(planner, world, index)
        replayed = [
            replay(recorded.law, recorded.given) for _ in range(replays)
        ]
        times.append(np.min(replayed, axis=0))
    return np.concatenate(times)


def summarise(planner: str, world: str, times: Array) -> dict[str, Any]:
    """A row of the table."""
    return {
        "planner": planner,
        "world": world,
        "updates": len(times),
        "median_ms": float(np.median(times)),
        "p99_ms": float(np.percentile(times, 99)),
        "max_ms": float(times.max()),
    }


def main() -> None:
    """Measures, prints and, if asked, writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=3, help="in each building")
    parser.add_argument("--replays", type=int, default=3)
    options = parse(parser)
    use_one_core()
    rows = []
    for planner in PLANNERS:
        times = {
            world: measure(planner, world, options.pairs, options.replays)
            for world in WORLDS
        }
        rows += [summarise(planner, *item) for item in times.items()]
        every = np.concatenate(list(times.values()))
        rows.append(summarise(planner, "all", every))
    lines = [
        f"One update, 360 rays, {options.pairs} drives in each building, "
        f"least of {options.replays} replays; {processor()}, "
        f"Python {platform.python_version()}, numpy {np.__version__}",
        "",
        "| planner | world | updates | median [ms] | 99th percentile [ms] | "
        "longest [ms] | to reach, 99th percentile [ms] |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    lines += [
        f"| {row['planner']} | {row['world']} | {row['updates']} | "
        f"{row['median_ms']:.2f} | {row['p99_ms']:.2f} | {row['max_ms']:.2f} | "
        f"{TO_REACH_MS[row['planner']]:g} |"
        for row in rows
    ]
    publish(lines, rows, options.out)


if __name__ == "__main__":
    main()
