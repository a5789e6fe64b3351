"""Many homing runs by one command: options, rows saved as they finish."""

import argparse
import hashlib
import json
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # One core a run.

import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from common import parse
from numpy.typing import NDArray
from recycling import in_child
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

import drake_mobarm
from drake_mobarm import load_scenario, run
from drake_mobarm.exceptions import MobarmError
from drake_mobarm.geometry import Array
from drake_mobarm.homing.job import AVOIDANCES, ESTIMATORS, HomingParameters
from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.runtime.sweep import run_sweep
from drake_mobarm.world.obstacles import outlines
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.sdf import load_world

Row = dict[str, Any]

STAND_RADIUS = 0.28
"""Of a disc that has to have a way [m]: the robot's and a centimetre."""

WORKING = Path("runs")
"""Where sweeps keep their rows until they are done, and what they write."""

LONGEST = 600.0
"""Wall time of a homing run [s]: after it, it is stopped."""

# Steps from cell to cell, and back: in the 16 nearest directions.
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1))


def parse_sweep(parser: argparse.ArgumentParser) -> argparse.Namespace:
    """The options of a sweep.

    Args:
        parser: with the options that this sweep alone has.
    """
    shipped = HomingParameters()
    parser.add_argument(
        "--avoidance", choices=AVOIDANCES, default=shipped.avoidance
    )
    parser.add_argument(
        "--estimator", choices=ESTIMATORS, default=shipped.estimator
    )
    parser.add_argument("--seeds", type=int, default=1, help="runs a case")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY.PATH=VALUE"
    )
    parser.add_argument("--only", default="", help="cases with this text only")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    return parse(parser)


def describe(options: argparse.Namespace) -> str:
    """The command that was given, and what it left to defaults."""
    return (
        f"`python {shlex.join(sys.argv)}` (avoidance {options.avoidance}, "
        f"estimator {options.estimator})"
    )


def sweep(
    name: str, cases: Sequence[Row], options: argparse.Namespace
) -> list[Row]:
    """Runs homing for each case that is not in the file of rows yet.

    Args:
        name: of the sweep.
        cases: each with its `name`, `overrides` and `seed`, and whatever else
            its row shall hold.
        options: of `parse_sweep`.

    Returns:
        The cases in their order, each with what came out of it.
    """
    chosen = [
        f"avoidance={options.avoidance}",
        f"estimator={options.estimator}",
        *options.set,
    ]
    trials = [
        case
        | {
            "trial": number,
            "seed": case["seed"] + again,
            "overrides": [*case["overrides"], *chosen],
        }
        for number, (case, again) in enumerate(
            (case, again)
            for case in cases
            for again in range(options.seeds)
            if options.only in case["name"]
        )
    ]
    return run_or_go_on(name, trials, run_case, options.jobs)


def run_or_go_on(
    name: str,
    trials: Sequence[Row],
    work: Callable[[Mapping[str, Any]], Row],
    jobs: int,
) -> list[Row]:
    """Does the trials that are not in the sweep's file of rows yet.

    The file is there until all trials are done; other trials or other code
    have another one.

    Args:
        name: of the sweep.
        trials: each with its number as `trial`.
        work: gives a trial's row; picklable.
        jobs: processes.
    """
    content = json.dumps([digest_of_code(), trials], sort_keys=True)
    digest = hashlib.sha256(content.encode()).hexdigest()[:16]
    file = WORKING / f"{name}-{digest}.jsonl"
    try:
        rows = run_sweep(trials, work, file, {"sweep": digest}, jobs)
    except MobarmError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
    file.unlink()
    return rows


def run_case(trial: Mapping[str, Any]) -> Row:
    """One homing run; what raises is a row, too, so that the others run."""
    row = in_child(_run_case, LONGEST, trial)
    if "died" in row:
        row = {"success": False, "reason": row["died"]}
    return {**trial, "command": command("homing", trial), **row}


def _run_case(trial: Mapping[str, Any]) -> Row:
    try:
        result = run(load_scenario("homing", trial["overrides"]), trial["seed"])
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        return {"success": False, "reason": reason}
    return {
        "success": result.success,
        "reason": result.reason,
        "wall_s": round(result.wall_s, 2),
        **result.metrics,
    }


def command(scenario: str, trial: Mapping[str, Any]) -> str:
    """What repeats a run."""
    words = ["mobarm", "run", scenario, "--seed", str(trial["seed"])]
    for override in trial["overrides"]:
        words += ["--set", override]
    return shlex.join(words)


def digest_of_code() -> str:
    """Of the package's Python files: rows of other code are not mixed in."""
    hashed = hashlib.sha256()
    for path in sorted(Path(drake_mobarm.__file__).parent.rglob("*.py")):
        hashed.update(path.read_bytes())
    return hashed.hexdigest()[:16]


@lru_cache(maxsize=16)
def free_floor(world: str) -> tuple[OccupancyGrid, NDArray[np.bool_]]:
    """A world's grid, and in which cells (ny, nx) the robot can stand."""
    grid = OccupancyGrid.from_outlines(
        outlines(load_world(world).obstacles, *HEIGHTS)
    )
    return grid, grid.clearance() > STAND_RADIUS


def shortest_ways(world: str, start: Sequence[float]) -> Array:
    """Lengths [m] of the robot's shortest ways to all cells, (ny, nx).

    From cell to cell of 5 cm in 16 directions: up to 3 % more than the true
    ones; infinite where there is none.

    Args:
        world: its name or path.
        start: [x, y] in W [m].
    """
    grid, free = free_floor(world)
    number = np.arange(free.size).reshape(free.shape)
    steps = []
    for dy, dx in _STEPS:
        here, there = _pairs(number, dy, dx)
        both = free.flat[here] & free.flat[there]
        length = np.full(both.sum(), grid.cell * np.hypot(dx, dy))
        steps.append((length, here[both], there[both]))
    lengths, here, there = map(np.concatenate, zip(*steps, strict=True))
    size = (free.size, free.size)
    graph = coo_matrix((lengths, (here, there)), shape=size).tocsr()
    source = number[grid.index(start)]
    ways: Array = dijkstra(graph, directed=False, indices=source)
    return ways.reshape(free.shape)


def _pairs(
    number: NDArray[np.int_], dy: int, dx: int
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Cells and those a step further, by their numbers, (k,) each."""
    ny, nx = number.shape
    here = number[: ny - dy, max(0, -dx) : nx - max(0, dx)]
    there = number[dy:, max(0, dx) : nx + min(0, dx)]
    return here.ravel(), there.ravel()
