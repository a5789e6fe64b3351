"""How long a highway takes to build and to ask, and how that grows.

    python benchmarks/highway.py [--repetitions 5] [--out FILE.md]

Building: the points, links, repair and table of best paths of the shipped
worlds' floor plans, by the adaptive method. Growth: the bookstore, with more
random points at 0.1 m a square, and with finer squares at 200 points.

Asking: the points within 2 m of the robot and of the target, for each of the
latter the entry with the shortest way, and its path: what one update of the
planner looks up. The graphs are lattices as in Nav2's benchmark of its route
server, nav2_route/test/performance_benchmarking.cpp. For 10,000 points its
README tells 0.232 ms on its authors' machine: in C++, for one start and one
goal, which that program draws from one row of the lattice. Ours are drawn from
all of it, and told for a target that was asked for before, for one that was
not, and for a single path to a point that was not. networkx's A* finds the
same single paths in the same run. One core; times are the processor's, which
are those of the clock where no other process wants the core.
"""

import argparse
import os
import platform
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # One core.

import networkx
import numpy as np
from common import parse, processor, publish, use_one_core

from drake_mobarm.geometry import Array
from drake_mobarm.navigation.highway import (
    Highway,
    HighwayParameters,
    build_highway,
)
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.world.floor_plan import FloorPlan
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.sdf import load_world

SEED = 0
WORLDS = ("small_house", "bookstore", "cafe")
SQUARES = (0.1, 0.2)  # [m]
GROWTH_POINTS = (50, 100, 200, 400, 800, 1600)
GROWTH_SQUARES = (0.4, 0.3, 0.2, 0.15, 0.1, 0.075, 0.05)  # [m]
LATTICES = (10, 32, 100, 200)  # Points along a side.
REACH = 2.0  # Of near points and target points [m].
TARGETS, PLACES = 10, 30


def timed(function: Callable[..., Any], *arguments: Any) -> tuple[float, Any]:
    """Seconds of processor time that a call takes, and what it gives."""
    started = time.process_time()
    result = function(*arguments)
    return time.process_time() - started, result


def measure_build(
    grid: OccupancyGrid,
    parameters: HighwayParameters,
    repetitions: int,
    points: str = "adaptive",
) -> dict[str, Any]:
    """Best and median times of a highway with its table [s]."""
    build, table = [], []
    for _ in range(repetitions):
        rng = np.random.default_rng(SEED)
        seconds, highway = timed(build_highway, grid, parameters, rng, points)
        build.append(seconds)
        table.append(timed(getattr, highway, "length")[0])
    return {
        "square_m": grid.cell,
        "free_squares": int((~grid.occupied).sum()),
        "points": len(highway.points),
        "links": len(highway.links),
        "pieces": highway.pieces,
        "build_s": min(build),
        "build_median_s": float(np.median(build)),
        "table_s": min(table),
        "table_median_s": float(np.median(table)),
    }


def measure_worlds(repetitions: int) -> list[dict[str, Any]]:
    """A row a world and size of squares."""
    rows = []
    for name in WORLDS:
        plan = FloorPlan.from_world(load_world(name))
        for cell in SQUARES:
            grid = plan.grid(cell, RADIUS)
            alone = build_highway(
                grid,
                HighwayParameters(repair=False),
                np.random.default_rng(SEED),
            )
            row = measure_build(grid, HighwayParameters(), repetitions)
            rows.append(
                {
                    "world": name,
                    "points_unrepaired": len(alone.points),
                    "pieces_unrepaired": alone.pieces,
                    **row,
                }
            )
    return rows


def measure_growth(repetitions: int) -> dict[str, list[dict[str, Any]]]:
    """Rows with more points, and with finer squares."""
    plan = FloorPlan.from_world(load_world("bookstore"))
    fine = plan.grid(0.1, RADIUS)

    def random(count: int) -> HighwayParameters:
        return HighwayParameters(count=count)

    return {
        "points": [
            measure_build(fine, random(count), repetitions, "random")
            for count in GROWTH_POINTS
        ],
        "squares": [
            measure_build(
                plan.grid(cell, RADIUS), random(200), repetitions, "random"
            )
            for cell in GROWTH_SQUARES
        ],
    }


def lattice(side: int) -> Highway:
    """Points 1 m apart, each linked to those beside it."""
    number = np.arange(side * side).reshape(side, side)
    links = [
        np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()]),
        np.column_stack([number[:-1].ravel(), number[1:].ravel()]),
    ]
    rows, columns = np.divmod(number.ravel(), side)
    return Highway.from_links(
        np.column_stack([columns, rows]), np.vstack(links)
    )


def ask(highway: Highway, place: Array, target: Array) -> float:
    """The shortest way from a place to a point near the target [m]."""
    near = highway.within(place, REACH)
    exits = highway.within(target, REACH)
    apart = np.hypot(*(highway.points[near] - place).T)
    entries, length = highway.best_entries(near, apart, exits)
    for entry, end in zip(entries, exits, strict=True):
        highway.path(int(entry), int(end))
    return float(length.min())


def measure_queries(side: int) -> dict[str, Any]:
    """Times of queries on a lattice [ms]."""
    rng = np.random.default_rng(SEED)
    highway = lattice(side)
    ask(highway, np.zeros(2), np.zeros(2))  # Trees and, if small, the table.
    graph = networkx.Graph()
    graph.add_weighted_edges_from(
        (i, j, 1.0) for i, j in highway.links.tolist()
    )

    def straight(i: int, j: int) -> float:
        return float(np.hypot(*(highway.points[i] - highway.points[j])))

    first, again, one, peer = [], [], [], []
    for target in rng.uniform(0, side - 1, (TARGETS, 2)):
        places = rng.uniform(0, side - 1, (PLACES, 2))
        first.append(timed(ask, highway, places[0], target)[0])
        again += [timed(ask, highway, place, target)[0] for place in places]
    for i, j in rng.integers(0, side * side, (TARGETS, 2)).tolist():
        fresh = Highway(highway.points, highway.links)
        fresh.path(i, i)  # Its graph and, if small, the table.
        seconds, path = timed(fresh.path, i, j)
        one.append(seconds)
        seconds, theirs = timed(networkx.astar_path, graph, i, j, straight)
        peer.append(seconds)
        if len(path) != len(theirs):
            raise SystemExit(f"{len(path)} and {len(theirs)} points differ")
    return {
        "points": side * side,
        "again_ms": 1e3 * float(np.median(again)),
        "first_ms": 1e3 * float(np.median(first)),
        "one_path_ms": 1e3 * float(np.median(one)),
        "networkx_ms": 1e3 * float(np.median(peer)),
        "networkx_ratio": float(np.median(peer) / np.median(one)),
    }


def draw(growth: dict[str, Any], queries: list[Any], path: Path) -> None:
    """Growth with points and squares, and of queries."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
    for axis, x, label in (
        (axes[0], "points", "points (squares of 0.1 m)"),
        (axes[1], "free_squares", "free squares (200 points)"),
    ):
        rows = growth["points" if x == "points" else "squares"]
        at = [row[x] for row in rows]
        axis.loglog(at, [row["build_s"] for row in rows], "o-", label="build")
        axis.loglog(at, [row["table_s"] for row in rows], "s-", label="table")
        axis.set(xlabel=label, ylabel="time [s]")
    at = [row["points"] for row in queries]
    for key, label in (
        ("again_ms", "known target"),
        ("first_ms", "new target"),
        ("one_path_ms", "one path, new target"),
        ("networkx_ms", "one path, networkx A*"),
    ):
        axes[2].loglog(at, [row[key] for row in queries], "o-", label=label)
    axes[2].set(xlabel="points of a lattice", ylabel="time of a query [ms]")
    for axis in axes:
        axis.grid(True, which="both", alpha=0.3)
        axis.legend()
    figure.savefig(path, dpi=100)


def tables(
    worlds: list[Any], growth: dict[str, Any], queries: list[Any]
) -> list[str]:
    """What was measured as Markdown."""
    lines = [
        "| world | square [m] | free squares | points (pieces) as in the text "
        "| repaired | links | build, best [s] | median [s] | table [s] |",
        "| --- |" + " ---: |" * 8,
    ]
    lines += [
        f"| {r['world']} | {r['square_m']:g} | {r['free_squares']} | "
        f"{r['points_unrepaired']} ({r['pieces_unrepaired']}) | {r['points']} "
        f"({r['pieces']}) | {r['links']} | {r['build_s']:.3f} | "
        f"{r['build_median_s']:.3f} | {r['table_s']:.3f} |"
        for r in worlds
    ]
    for name, rows in growth.items():
        lines += [
            "",
            f"Growth with {name}, the bookstore, random points, repaired:",
            "",
            "| square [m] | free squares | points | links | build, best [s] | "
            "table [s] |",
            "|" + " ---: |" * 6,
        ]
        lines += [
            f"| {r['square_m']:g} | {r['free_squares']} | {r['points']} | "
            f"{r['links']} | {r['build_s']:.3f} | {r['table_s']:.3f} |"
            for r in rows
        ]
    lines += [
        "",
        f"Queries, medians of {TARGETS} targets and {PLACES} places each:",
        "",
        "| points | known target [ms] | new target [ms] "
        "| one path, new target [ms] | networkx A* [ms] | ratio |",
        "|" + " ---: |" * 6,
    ]
    lines += [
        f"| {r['points']} | {r['again_ms']:.3f} | "
        f"{r['first_ms']:.3f} | {r['one_path_ms']:.3f} | "
        f"{r['networkx_ms']:.3f} | {r['networkx_ratio']:.1f} |"
        for r in queries
    ]
    return lines


def main() -> None:
    """Measures, prints and, if asked, writes the tables and the picture."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--repetitions", type=int, default=5)
    options = parse(parser)
    if options.repetitions < 1:
        parser.exit(2, "--repetitions: valid is 1 or more\n")
    use_one_core()
    worlds = measure_worlds(options.repetitions)
    growth = measure_growth(options.repetitions)
    queries = [measure_queries(side) for side in LATTICES]
    setting = {
        "command": "python benchmarks/highway.py --repetitions "
        f"{options.repetitions}",
        "processor": processor(),
        "cores": 1,
        "seed": SEED,
        "versions": {
            "Python": platform.python_version(),
            **{x: version(x) for x in ("numpy", "scipy", "networkx")},
        },
    }
    versions = ", ".join(f"{x} {y}" for x, y in setting["versions"].items())
    lines = [
        f"`{setting['command']}`",
        "",
        f"One core of {setting['processor']}; {versions}; seed {SEED}, robot's "
        f"radius {RADIUS:g} m. Processor time:",
        "",
        *tables(worlds, growth, queries),
    ]
    measured = {
        "setting": setting,
        "worlds": worlds,
        "growth": growth,
        "queries": queries,
    }
    publish(lines, measured, options.out)
    if options.out is not None:
        draw(growth, queries, options.out.with_suffix(".png"))


if __name__ == "__main__":
    main()
