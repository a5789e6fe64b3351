"""Offline plans beside OMPL's PRM* and RRT*, and A* on the grid.

    python benchmarks/offline_planners.py [--limit 0.25] [--grid 0.6]
        [--seed 0] [--out FILE.md]

The ten environments of Table 3.1, four starts and three targets each. All
plan on the same squares, those of the robot's grown obstacles: OMPL asks for
a state's square, which costs it a call of Python each; A* steps over squares'
sides and corners, never between two occupied ones. The two OMPL planners run
until their first solution, and, anew, until the time limit; their paths are
simplified by OMPL, A*'s by lines of sight. The highway is built once a map:
its time stands apart. Where a plan ends short of its target, by the text's
rule, the way left is added. OMPL is in the extra `peers`. One core.
"""

import argparse
import heapq
import math
import os
import platform
import time
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # One core.
os.environ["OMP_NUM_THREADS"] = "1"

import matplotlib as mpl
import numpy as np
from common import parse, processor, publish, use_one_core
from matplotlib.figure import Figure
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from drake_mobarm.drawing.style import STYLE
from drake_mobarm.geometry import Array
from drake_mobarm.navigation.environments import ENVIRONMENTS, Environment
from drake_mobarm.navigation.highway import Highway
from drake_mobarm.navigation.highway_force import HighwayForceParameters
from drake_mobarm.navigation.line_of_sight import LineOfSight
from drake_mobarm.navigation.offline import OFFLINE_POTENTIAL, MapField, plan
from drake_mobarm.navigation.offline_pictures import draw_environment
from drake_mobarm.navigation.offline_tables import METHODS, make_map
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.world.occupancy import OccupancyGrid

WEIGHT = 50
FIRST, ANYTIME = "first solution", "until the limit"
# A step of OMPL's motion checks [m].
MOTION_STEP = 0.02
SHOWN = ("maze", 0, 2)  # The example of the picture.

Found = tuple[Array, float]
"""A path [m], (n, 2), of no points where there is none; its time [s]."""


def field_plan(
    grid: OccupancyGrid, highway: Highway, start: Array, goal: Array, best: bool
) -> Found:
    """Of the potential field with the highway."""
    began = time.perf_counter()
    field = MapField(
        grid,
        goal,
        OFFLINE_POTENTIAL,
        highway,
        HighwayForceParameters(weight=WEIGHT),
        best_only=best,
    )
    found = plan(field.force, start, goal)
    spent = time.perf_counter() - began
    if not found.success:
        return np.empty((0, 2)), spent
    return np.vstack([found.path, goal]), spent


def a_star(grid: OccupancyGrid, start: Array, goal: Array) -> Found:
    """Over the squares, and then straight wherever that is free."""
    began = time.perf_counter()
    free = (~grid.occupied).tolist()
    (first_row, last_row), (first_column, last_column) = grid.index(
        [start, goal]
    )
    source = (int(first_row), int(first_column))
    sink = (int(last_row), int(last_column))

    def left(square: tuple[int, int]) -> float:
        rows, columns = abs(square[0] - sink[0]), abs(square[1] - sink[1])
        return max(rows, columns) + (math.sqrt(2) - 1) * min(rows, columns)

    best, before = {source: 0.0}, {source: source}
    queue = [(left(source), source)]
    closed = set()
    while queue:
        _, square = heapq.heappop(queue)
        if square == sink:
            break
        if square in closed:
            continue
        closed.add(square)
        row, column = square
        for down, right in STEPS:
            there = (row + down, column + right)
            if not free[there[0]][there[1]]:
                continue
            if not (free[row][there[1]] and free[there[0]][column]):
                continue
            cost = best[square] + math.hypot(down, right)
            if cost < best.get(there, math.inf):
                best[there], before[there] = cost, square
                heapq.heappush(queue, (cost + left(there), there))
    else:
        return np.empty((0, 2)), time.perf_counter() - began
    squares = [sink]
    while squares[-1] != source:
        squares.append(before[squares[-1]])
    centres = grid.origin + grid.cell * np.array(squares[::-1])[:, ::-1]
    path = np.vstack([start, centres, goal])
    straight = shortcut(LineOfSight(grid), path)
    return straight, time.perf_counter() - began


STEPS = [
    (down, right)
    for down in (-1, 0, 1)
    for right in (-1, 0, 1)
    if down or right
]


def shortcut(sight: LineOfSight, path: Array) -> Array:
    """A path from each corner to the farthest one in sight."""
    kept = [0]
    while kept[-1] < len(path) - 1:
        seen = sight.clear(path[kept[-1]], path[kept[-1] + 1 :])
        ahead = np.flatnonzero(seen)
        kept.append(kept[-1] + 1 + int(ahead[-1] if ahead.size else 0))
    return path[kept]


def ompl_plan(
    kind: type,
    grid: OccupancyGrid,
    start: Array,
    goal: Array,
    limit: float,
    first: bool,
) -> Found:
    """Of one of OMPL's optimal planners, simplified by OMPL."""
    occupied = grid.occupied.tolist()
    # From the outer corner of square [0, 0].
    left, low = (grid.origin - grid.cell / 2).tolist()
    inverse = 1 / grid.cell

    def is_free(state: Any) -> bool:
        column = int((state[0] - left) * inverse)
        row = int((state[1] - low) * inverse)
        return not occupied[row][column]

    began = time.perf_counter()
    space = ob.RealVectorStateSpace(2)
    bounds = ob.RealVectorBounds(2)
    rows, columns = grid.occupied.shape
    for axis, (least, count) in enumerate(((left, columns), (low, rows))):
        bounds.setLow(axis, least)
        # A state on the very edge would be in no square.
        bounds.setHigh(axis, least + (count - 1e-6) * grid.cell)
    space.setBounds(bounds)
    setup = og.SimpleSetup(space)
    setup.setStateValidityChecker(is_free)
    information = setup.getSpaceInformation()
    share = MOTION_STEP / space.getMaximumExtent()
    information.setStateValidityCheckingResolution(share)
    ends = []
    for place in (start, goal):
        state = space.allocState()
        state[0], state[1] = (float(x) for x in place)
        ends.append(state)
    setup.setStartAndGoalStates(*ends)
    objective = ob.PathLengthOptimizationObjective(information)
    objective.setCostThreshold(ob.Cost(math.inf if first else 0.0))
    setup.setOptimizationObjective(objective)
    setup.setPlanner(kind(information))
    setup.solve(10.0 if first else limit)
    if not setup.haveExactSolutionPath():
        return np.empty((0, 2)), time.perf_counter() - began
    setup.simplifySolution()
    spent = time.perf_counter() - began
    path = setup.getSolutionPath()
    states = [path.getState(i) for i in range(path.getStateCount())]
    return np.array([[state[0], state[1]] for state in states]), spent


def length(path: Array) -> float:
    """Of a path [m]."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def clearance(environment: Environment, path: Array) -> float:
    """Between the robot's edge and all else along a path [m], at least."""
    parts = np.linspace(0, 1, 50)[:, None, None]
    places = path[:-1] + parts * np.diff(path, axis=0)
    return float(environment.clearance(places).min()) - RADIUS


def measure(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """A row a problem and planner."""
    for number, environment in enumerate(ENVIRONMENTS):
        began = time.perf_counter()
        made = {
            name: make_map(
                environment.name, options.grid, method.repair, options.seed
            )
            for name, method in METHODS.items()
            if name != "repaired"
        }
        build = (time.perf_counter() - began) / len(made)
        grid, highway = made["best path"]
        planners: dict[str, Callable[[Array, Array], Found]] = {
            "potential field with highway, best path": (
                lambda s, g, grid=grid, highway=highway: field_plan(
                    grid, highway, s, g, True
                )
            ),
            "potential field with highway, text": (
                lambda s, g, made=made["text"]: field_plan(*made, s, g, False)
            ),
            "A* on the grid, shortcut": (
                lambda s, g, grid=grid: a_star(grid, s, g)
            ),
        }
        for kind, name in ((og.PRMstar, "PRM*"), (og.RRTstar, "RRT*")):
            for when in (FIRST, ANYTIME):
                planners[f"OMPL {name}, {when}"] = (
                    lambda s, g, kind=kind, when=when, grid=grid: ompl_plan(
                        kind, grid, s, g, options.limit, when == FIRST
                    )
                )
        for i, start in enumerate(environment.starts):
            for j, target in enumerate(environment.targets):
                for name, solve in planners.items():
                    ends = (np.array(start), np.array(target))
                    path, spent = solve(*ends)
                    solved = len(path) > 0
                    yield {
                        "environment": environment.name,
                        "number": number + 1,
                        "start": i,
                        "target": j,
                        "planner": name,
                        "solved": solved,
                        "time_s": spent,
                        "build_s": build if "field" in name else 0.0,
                        "length_m": length(path) if solved else None,
                        "clearance_m": clearance(environment, path)
                        if solved
                        else None,
                        "path": np.round(path, 3).tolist(),
                    }


def summarise(rows: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """The figures of each planner."""
    shortest: dict[tuple[Any, ...], float] = {}
    for row in rows:
        if row["solved"]:
            key = (row["number"], row["start"], row["target"])
            known = shortest.get(key, math.inf)
            shortest[key] = min(known, row["length_m"])
    summaries = {}
    for name in dict.fromkeys(row["planner"] for row in rows):
        own = [row for row in rows if row["planner"] == name]
        solved = [row for row in own if row["solved"]]
        over = [
            row["length_m"]
            / shortest[(row["number"], row["start"], row["target"])]
            for row in solved
        ]
        times = [1e3 * row["time_s"] for row in own]
        summaries[name] = {
            "problems": len(own),
            "solved": len(solved),
            "mean_length_over_shortest": float(np.mean(over)),
            "largest_length_over_shortest": max(over),
            "median_time_ms": float(np.median(times)),
            "longest_time_ms": max(times),
            "share_without_contact": float(
                np.mean([row["clearance_m"] >= 0 for row in solved])
            ),
            "mean_build_ms": 1e3 * float(np.mean([r["build_s"] for r in own])),
        }
    return summaries


def table(summaries: dict[str, dict[str, Any]]) -> list[str]:
    """Lines of Markdown."""
    return [
        "| planner | solved | length over shortest found, mean | largest | "
        "time, median [ms] | longest [ms] | share without contact | once a map "
        "[ms] |",
        "| --- |" + " ---: |" * 7,
        *(
            f"| {name} | {s['solved']} of {s['problems']} | "
            f"{s['mean_length_over_shortest']:.3f} | "
            f"{s['largest_length_over_shortest']:.2f} | "
            f"{s['median_time_ms']:.1f} | {s['longest_time_ms']:.0f} | "
            f"{s['share_without_contact']:.2f} | {s['mean_build_ms']:.0f} |"
            for name, s in summaries.items()
        ),
    ]


def draw(
    rows: list[dict[str, Any]], summaries: dict[str, dict[str, Any]]
) -> Figure:
    """An example of all planners, and length against time."""
    name, start, target = SHOWN
    figure = Figure(figsize=(9.0, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    (environment,) = (e for e in ENVIRONMENTS if e.name == name)
    draw_environment(left, environment)
    colors = mpl.colormaps["tab10"]
    for index, (planner, figures) in enumerate(summaries.items()):
        for row in rows:
            if (
                (row["environment"], row["start"], row["target"]) == SHOWN
                and row["planner"] == planner
                and row["solved"]
            ):
                path = np.array(row["path"])
                left.plot(*path.T, color=colors(index), lw=1.2)
        right.plot(
            figures["median_time_ms"],
            figures["mean_length_over_shortest"],
            "o",
            color=colors(index),
            label=f"{planner}: {figures['solved']} of {figures['problems']}",
        )
    left.set_title(f"{name}, start {start + 1}, target {target + 1}")
    right.set_xscale("log")
    right.set_xlabel("median time a plan [ms]")
    right.set_ylabel("mean length over shortest found")
    figure.legend(loc="outside lower center", ncols=2, fontsize=7)
    right.margins(x=0.15, y=0.15)
    return figure


def main() -> None:
    """Measures, prints and, if asked, writes table and picture."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--limit", type=float, default=0.25, help="of OMPL [s]")
    parser.add_argument(
        "--grid", type=float, default=0.6, help="square, as a share of (3.1)'s"
    )
    parser.add_argument("--seed", type=int, default=0)
    options = parse(parser)
    use_one_core()
    ou.noOutputHandler()
    ou.RNG.setSeed(options.seed + 1)
    rows = list(measure(options))
    summaries = summarise(rows)
    command = (
        f"python benchmarks/offline_planners.py --limit {options.limit:g} "
        f"--grid {options.grid:g} --seed {options.seed}"
    )
    lines = [
        f"`{command}`",
        "",
        f"Ten environments, twelve pairs each; squares of {options.grid:g} "
        f"times (3.1)'s size; m = {WEIGHT}; OMPL's limit {options.limit:g} s, "
        f"its motions checked every {MOTION_STEP:g} m; one core of "
        f"{processor()}; Python {platform.python_version()}, OMPL "
        f"{version('ompl')}, numpy {np.__version__}. Times are of one call "
        "from scratch, simplification included; the highway, and only it, is "
        "built once a map. A contact is the robot's edge inside an obstacle: a "
        "square is free whose centre is, not all of it.",
        "",
        *table(summaries),
    ]
    measured = {
        "command": command,
        "summaries": summaries,
        "rows": [{k: v for k, v in r.items() if k != "path"} for r in rows],
    }
    publish(lines, measured, options.out)
    if options.out is not None:
        picture: Path = options.out.with_suffix(".png")
        with mpl.rc_context(STYLE):
            draw(rows, summaries).savefig(picture)


if __name__ == "__main__":
    main()
