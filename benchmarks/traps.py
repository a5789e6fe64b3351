"""Worlds that trap a potential field, by our planner and by the text's.

    python benchmarks/traps.py [--out FILE.md]

A bug trap, a U, a spiral, a corridor 4 cm wider than the robot, and a goal that
moves, each with and without a floor plan, in contact simulation; the target is
known. The worlds are written as SDF to runs/traps. With --out a picture of the
paths is drawn beside the table. Exit code 1 where ours does not arrive.
"""

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from buildings import WALL, Building
from common import parse, publish, use_one_core
from matplotlib.figure import Figure
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_mobarm import load_scenario, load_world, run
from drake_mobarm.drawing.floor_plan import draw_floor_plan, frame_building
from drake_mobarm.drawing.style import BLUE, GREEN, GREY, ORANGE, STYLE
from drake_mobarm.robot.shape import RADIUS

WORKING = Path("runs") / "traps"
PLANNERS = {
    "ours": (BLUE, ["planner=ours"]),
    "ours, no plan": ("#12a4af", ["planner=ours", "floor_plan=none"]),
    "apf_hw": (ORANGE, ["planner=apf_hw"]),
    "apf": (GREY, ["planner=apf"]),
}
# The goal that moves goes round a circle [m, m/s].
CIRCLE, GOAL_SPEED = 1.5, 0.2


class MovingTarget(LeafSystem):
    """A target that goes round a circle about a place in W [m]."""

    def __init__(self, centre: tuple[float, float]) -> None:
        super().__init__()
        self._centre = centre
        self.DeclareVectorOutputPort("estimated_target", 3, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        angle = GOAL_SPEED / CIRCLE * context.get_time()
        output.SetFromVector([*goal_at(self._centre, angle), 1.0])


def goal_at(centre: tuple[float, float], angle: float) -> list[float]:
    """A place on the circle about a centre [m]."""
    x, y = centre
    return [x + CIRCLE * math.cos(angle), y + CIRCLE * math.sin(angle)]


def bug_trap() -> Building:
    """A room whose only way out is a funnel that leads back into it."""
    made = Building("bug trap")
    made.room((-5.0, -4.0), (8.0, 4.0))
    made.wall((-3.0, -2.0), (2.0, -2.0))
    made.wall((-3.0, 2.0), (2.0, 2.0))
    made.wall((2.0, -2.0), (2.0, 2.0))
    made.wall((-3.0, 0.5), (-3.0, 2.0))
    made.wall((-3.0, -2.0), (-3.0, -0.5))
    made.wall((-3.0, 0.5), (-1.5, 0.5))
    made.wall((-3.0, -0.5), (-1.5, -0.5))
    made.errand("out", [1.0, 0.0, 0.0], (6.5, 0.0))
    return made


def u_trap() -> Building:
    """A U that is open towards the robot."""
    made = Building("U")
    made.room((-4.0, -4.5), (7.0, 4.5))
    made.wall((0.0, -2.5), (3.0, -2.5))
    made.wall((0.0, 2.5), (3.0, 2.5))
    made.wall((3.0, -2.5), (3.0, 2.5))
    made.errand("round", [-3.0, 0.3, 0.0], (5.5, 0.0))
    return made


def spiral() -> Building:
    """A spiral, with the robot in its middle."""
    made = Building("spiral")
    made.room((-6.5, -6.0), (7.0, 6.0))
    made.wall((-1.0, -1.0), (-1.0, 1.0))
    made.wall((-1.0, -1.0), (1.0, -1.0))
    made.wall((1.0, -1.0), (1.0, 2.5))
    made.wall((-2.5, 2.5), (1.0, 2.5))
    made.wall((-2.5, -2.5), (-2.5, 2.5))
    made.wall((-2.5, -2.5), (2.5, -2.5))
    made.wall((2.5, -2.5), (2.5, 4.0))
    made.wall((-4.0, 4.0), (2.5, 4.0))
    made.wall((-4.0, -4.0), (-4.0, 4.0))
    made.wall((-4.0, -4.0), (4.0, -4.0))
    made.errand("out", [0.0, 0.0, 0.0], (5.5, 0.0))
    return made


def corridor() -> Building:
    """A corridor that is 4 cm wider than the robot, the only way."""
    made = Building("corridor")
    made.room((-3.0, -2.5), (6.0, 2.5))
    half = (2 * RADIUS + 0.04 + WALL) / 2
    for x in (0.5, 2.5):
        made.wall((x, -2.5), (x, -half))
        made.wall((x, half), (x, 2.5))
    made.wall((0.5, half), (2.5, half))
    made.wall((0.5, -half), (2.5, -half))
    made.errand("through", [-2.0, 1.0, 0.0], (5.0, -1.0))
    return made


def moving_goal() -> Building:
    """Columns, and a goal that goes round among them."""
    made = Building("moving goal")
    made.room((-5.0, -3.5), (6.0, 3.5))
    for x, y in ((-1.0, 0.6), (0.5, -1.0), (2.7, 0.7), (4.7, 2.4)):
        made.column((x, y), 0.35)
    made.errand("catch it", [-4.0, 0.0, 0.0], (2.5, 0.0))
    return made


def run_trap(
    world: Path, errand: tuple[list[float], list[float]], planner: str
) -> dict[str, Any]:
    """One run: its figures, and its path [m], (n, 2)."""
    (start, target), moves = errand, world.stem == "moving_goal"
    _, overrides = PLANNERS[planner]
    scenario = load_scenario(
        "navigation",
        [
            f"world={world}",
            f"start={start}",
            f"target={target}",
            f"target_from={'beacon' if moves else 'known'}",
            "time_limit=120",
            *overrides,
        ],
    )
    centre = (target[0], target[1])
    blocks = {"estimator": MovingTarget(centre)} if moves else {}
    result = run(scenario, seed=1, blocks=blocks)
    goal = result.trace["estimated_target"][-1, :2]
    path = result.trace["ground_truth"][:, :2]
    left = float(np.linalg.norm(path[-1] - goal))
    arrived = bool(result.outputs["arrived"][0] > 0.5) and left < 1.0
    return {
        "trap": world.stem.replace("_", " "),
        "planner": planner,
        "arrived": arrived,
        "reason": "arrived" if arrived else result.reason,
        "time_s": result.simulated_s,
        "contacts": result.metrics["contacts"],
        "left_m": left,
        "path": np.round(path[::5], 3).tolist(),
    }


def draw(rows: list[dict[str, Any]], worlds: dict[str, Path]) -> Figure:
    """The paths in each trap."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 5.6), layout="constrained")
        grid = figure.subplots(2, 3).ravel()
        for axes, (name, path) in zip(grid, worlds.items(), strict=False):
            world = load_world(str(path))
            draw_floor_plan(axes, world)
            frame_building(axes, world, np.zeros((1, 2)))
            for row in rows:
                if row["trap"] != name:
                    continue
                way = np.array(row["path"])
                color, _ = PLANNERS[row["planner"]]
                axes.plot(*way.T, color=color, lw=1.5)
                mark = "*" if row["arrived"] else "x"
                axes.plot(*way[-1], mark, color=color, ms=9, mew=1.5)
            axes.set_title(name, loc="left")
            axes.set_xlabel("")
            axes.set_ylabel("")
        legend = grid[len(worlds)]
        legend.set_axis_off()
        for name, (color, _) in PLANNERS.items():
            legend.plot([], [], color=color, label=name)
        legend.plot([], [], "*", color=GREEN, label="arrived")
        legend.plot([], [], "x", color=GREEN, label="not arrived")
        legend.legend(loc="center")
    return figure


def main() -> None:
    """Runs the traps, prints and writes the table."""
    options = parse(
        argparse.ArgumentParser(
            description=__doc__,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
    )
    use_one_core()
    WORKING.mkdir(parents=True, exist_ok=True)
    worlds, rows = {}, []
    for make in (bug_trap, u_trap, spiral, corridor, moving_goal):
        building = make()
        path = building.write(WORKING)
        worlds[path.stem.replace("_", " ")] = path
        (errand,) = building.errands.values()
        for planner in PLANNERS:
            rows.append(run_trap(path, errand, planner))
            print(rows[-1]["trap"], planner, rows[-1]["reason"], flush=True)
    lines = [
        "Known target, contact simulation, 120 s at most.",
        "",
        "| trap | planner | outcome | time [s] | contacts | left [m] |",
        "| --- | --- | --- | ---: | ---: | ---: |",
        *(
            f"| {row['trap']} | {row['planner']} | {row['reason']} | "
            f"{row['time_s']:.1f} | {row['contacts']:.0f} | "
            f"{row['left_m']:.2f} |"
            for row in rows
        ),
    ]
    if options.out is not None:
        draw(rows, worlds).savefig(options.out.with_suffix(".png"))
    for row in rows:
        del row["path"]
    publish(lines, rows, options.out)
    ours = [row for row in rows if row["planner"].startswith("ours")]
    sys.exit(not all(row["arrived"] for row in ours))


if __name__ == "__main__":
    main()
