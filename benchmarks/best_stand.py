"""How good the best stand is: against the map, and against a dense search.

    python benchmarks/best_stand.py [--targets 200] [--seed 0] [--out FILE.md]

Random targets in three worlds: positions evenly over the box around the free
space and from 0.1 to 0.95 m high, approaches evenly over those not from below.
A target counts when the dense search, over all free places of a 1 cm lattice
and all solutions of the arm, finds a place for it. Twice: for the arm as its
kinematics has it, which is the dissertation's, and for an arm that must keep
out of furniture and off the robot. One core.
"""

import argparse
import os
import platform
import time
from collections import Counter
from importlib.metadata import version
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # One core.
os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
import shapely
from common import parse, processor, publish, use_one_core
from grid_coverage import STARTS
from objective_map import random_target

from drake_mobarm.geometry import Array
from drake_mobarm.placement.best_stand import find_best_stand
from drake_mobarm.placement.collision import Surroundings
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.grid import optimise_grid
from drake_mobarm.placement.objective import (
    ObjectiveParameters,
    PlacementObjective,
)
from drake_mobarm.placement.objective_map import score_places
from drake_mobarm.placement.problem import StandProblem
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.shape import HEIGHTS, RADIUS
from drake_mobarm.world.sdf import load_world

DENSE = 0.01  # [m]
GRID = 0.2  # [m]
# Of the objective: better, or as good, but for rounding.
EQUAL = 1e-9
CLOSE = 0.01


def dense_places(problem: StandProblem) -> Array:
    """The free places of a lattice of W within reach."""
    target, reach = problem.target, problem.objective.arm.reach
    low = np.floor((target.p_WT[:2] - reach) / DENSE)
    steps = np.arange(np.ceil(2 * reach / DENSE) + 2)
    x, y = np.meshgrid(*(DENSE * (c + steps) for c in low))
    places = np.column_stack([x.ravel(), y.ravel()])
    near = np.linalg.norm(places - target.p_WT[:2], axis=1) <= reach
    places = places[near]
    return places[problem.free.contains(places)]


def least(values: Array) -> float | None:
    """The least number, None where there is none."""
    return None if np.isnan(values).all() else float(np.nanmin(values))


def measure(
    name: str,
    objective: PlacementObjective,
    targets: int,
    rng: np.random.Generator,
    collisions: bool,
) -> tuple[list[dict[str, Any]], int]:
    """Rows of one world, one a target, and how many were drawn."""
    world = load_world(name)
    surroundings = Surroundings(world.obstacles) if collisions else None
    free = FreeSpace.of_world(world, STARTS[name], RADIUS, HEIGHTS)
    grid = optimise_grid(free, GRID)
    low, high = np.reshape(free.polygon.bounds, (2, 2))
    rows: list[dict[str, Any]] = []
    drawn = 0
    while len(rows) < targets:
        drawn += 1
        target = random_target(rng, low, high)
        problem = StandProblem(
            objective=objective,
            target=target,
            free=free,
            surroundings=surroundings,
        )
        times = [time.perf_counter()]
        places = dense_places(problem)
        dense = least(score_places(problem, places).objective)
        times.append(time.perf_counter())
        if dense is None:
            continue
        squares = score_places(problem, grid.centres)
        best_square = least(squares.objective)
        times.append(time.perf_counter())
        stand, reason = find_best_stand(problem, squares)
        times.append(time.perf_counter())
        dense_s, map_s, stand_s = np.diff(times)
        ours = float(stand.scores.objective) if stand else None
        rows.append(
            {
                "world": name,
                "collisions": collisions,
                "position_m": target.p_WT.tolist(),
                "approach": target.a_W.tolist(),
                "dense": dense,
                "map": best_square,
                "ours": ours,
                "ours_over_dense": ours and ours / dense,
                "ours_over_map": ours and best_square and ours / best_square,
                "pose": stand.pose.tolist() if stand else None,
                "active": list(stand.active) if stand else None,
                "reason": reason,
                "ours_s": stand_s,
                "map_s": map_s,
                "dense_s": dense_s,
            }
        )
    return rows, drawn


def summarise(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The figures of a line of the table."""
    found = [r for r in rows if r["ours"] is not None]
    ratio = np.array([r["ours_over_dense"] for r in found])
    mapped = [r["ours_over_map"] for r in found if r["map"] is not None]
    return {
        "targets": len(rows),
        "within_1_percent": float(np.sum(ratio <= 1 + CLOSE)) / len(rows),
        "within_0.1_percent": float(np.sum(ratio <= 1 + CLOSE / 10))
        / len(rows),
        "better_than_dense": float(np.sum(ratio < 1 - EQUAL)) / len(rows),
        "worst_over_dense": float(ratio.max()),
        "median_over_dense": float(np.median(ratio)),
        "median_over_map": float(np.median(mapped)),
        "worse_than_map": int(np.sum(np.array(mapped) > 1 + EQUAL)),
        "missed": len(rows) - len(found),
        "without_square": sum(r["map"] is None for r in rows),
        "median_ours_s": float(np.median([r["ours_s"] for r in rows])),
        "longest_ours_s": max(r["ours_s"] for r in rows),
        "median_map_s": float(np.median([r["map_s"] for r in rows])),
        "median_dense_s": float(np.median([r["dense_s"] for r in rows])),
    }


def kind_of(line: str) -> str:
    """What kind of thing holds a stand."""
    for part, kind in (
        (" limit, ", "a joint's limit"),
        ("what the arm would touch", "what the arm would touch"),
        ("the target, ", "a low target"),
        ("the edge", "the map's edge"),
    ):
        if part in line:
            return kind
    return "an obstacle"


def holders(rows: list[dict[str, Any]]) -> Counter[str]:
    """How many stands are held by what; one may be held by several."""
    count: Counter[str] = Counter()
    for row in rows:
        if row["active"] is not None:
            kinds = {kind_of(line) for line in row["active"]}
            count[" and ".join(sorted(kinds)) or "nothing"] += 1
    return count


def table(summaries: dict[str, dict[str, Any]]) -> list[str]:
    """Lines of Markdown."""
    return [
        "| world | targets | within 1 % of dense, or better [%] | within "
        "0.1 %, or better [%] | better than dense [%] | ours / dense, median | "
        "worst | ours / map, median | worse than map | missed | no square | "
        "ours, median [ms] | longest [ms] | map, median [ms] | dense, median "
        "[ms] |",
        "| --- |" + " ---: |" * 14,
        *(
            f"| {name} | {s['targets']} | {100 * s['within_1_percent']:.1f} | "
            f"{100 * s['within_0.1_percent']:.1f} | "
            f"{100 * s['better_than_dense']:.1f} | "
            f"{s['median_over_dense']:.4f} | {s['worst_over_dense']:.4f} | "
            f"{s['median_over_map']:.3f} | {s['worse_than_map']} | "
            f"{s['missed']} | {s['without_square']} | "
            f"{1e3 * s['median_ours_s']:.0f} | "
            f"{1e3 * s['longest_ours_s']:.0f} | "
            f"{1e3 * s['median_map_s']:.1f} | "
            f"{1e3 * s['median_dense_s']:.0f} |"
            for name, s in summaries.items()
        ),
    ]


def main() -> None:
    """Measures, prints and, if asked, writes the table."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--targets", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parse(parser)
    if options.targets < len(STARTS):
        parser.exit(
            2,
            f"--targets is {options.targets}: valid is {len(STARTS)} or more\n",
        )
    use_one_core()
    objective = PlacementObjective(ArmKinematics(), ObjectiveParameters())
    share, more = divmod(options.targets, len(STARTS))
    command = (
        f"python benchmarks/best_stand.py --targets {options.targets} "
        f"--seed {options.seed}"
    )
    lines = [
        f"`{command}`",
        "",
        f"WidowX 250 on a base of {RADIUS:g} m radius, grid of "
        f"{GRID:g} m squares, dense lattice of {DENSE:g} m; one core of "
        f"{processor()}; Python {platform.python_version()}, Drake "
        f"{version('drake')}, numpy {np.__version__}, shapely "
        f"{shapely.__version__}. Times are of one call each; that of ours "
        'comes after the map\'s. "No square" counts targets that the map has '
        "no square for.",
    ]
    rows: list[dict[str, Any]] = []
    summaries = {}
    for collisions in (False, True):
        part: list[dict[str, Any]] = []
        drawn = []
        for i, name in enumerate(STARTS):
            rng = np.random.default_rng([options.seed, i])
            found, count = measure(
                name, objective, share + (i < more), rng, collisions
            )
            part += found
            drawn.append(f"{count} in {name}")
        by_world = {
            name: summarise([r for r in part if r["world"] == name])
            for name in STARTS
        }
        by_world["all"] = summarise(part)
        what = "with collisions" if collisions else "kinematics alone"
        summaries[what] = by_world
        rows += part
        held = ", ".join(f"{n} by {x}" for x, n in holders(part).most_common())
        lines += [
            "",
            "The arm kept out of furniture and off the robot:"
            if collisions
            else "The arm's kinematics alone:",
            "",
            *table(by_world),
            "",
            f"Drawn until these had a free place: {', '.join(drawn)}. Held: "
            f"{held}.",
        ]
    measured = {"command": command, "summaries": summaries, "rows": rows}
    publish(lines, measured, options.out)


if __name__ == "__main__":
    main()
