"""Draws a highway, and how a robot does without it and with it.

    python docs/draw_highway.py

The picture is docs/images/navigation_highway.png.
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from drake_mobarm import Result, load_scenario, run
from drake_mobarm.diagrams.navigation import load_plan, make_highway
from drake_mobarm.drawing.floor_plan import draw_robot
from drake_mobarm.drawing.style import BLUE, GREEN, GREY, ORANGE, STYLE
from drake_mobarm.job import spawn_seeds
from drake_mobarm.navigation.highway import Highway
from drake_mobarm.navigation.job import NavigationScenario
from drake_mobarm.world.floor_plan import FloorPlan

PICTURE = Path(__file__).parent / "images" / "navigation_highway.png"
PLACES = ("start=[7, -3, 3.1]", "target=[-6, -4]")


def draw_plan(axes: Axes, plan: FloorPlan) -> None:
    """Draws the occupied cells of a floor plan that lies along the axes."""
    rows, columns = plan.occupied.shape
    x, y, _ = plan.origin
    axes.imshow(
        np.where(plan.occupied, 1.0, np.nan),
        cmap=ListedColormap([GREY]),
        extent=(
            x,
            x + columns * plan.resolution,
            y,
            y + rows * plan.resolution,
        ),
        interpolation="nearest",
    )


def draw_highway(axes: Axes, highway: Highway) -> None:
    """Draws points and links."""
    links = highway.points[highway.links]
    axes.add_collection(
        LineCollection(list(links), color=ORANGE, lw=0.3, alpha=0.35)
    )
    axes.plot(*highway.points.T, ".", color=ORANGE, ms=4, label="highway")


def draw_run(axes: Axes, result: Result, color: str, label: str) -> None:
    """Draws the path of a robot, and where it ended."""
    scenario = result.scenario
    assert isinstance(scenario, NavigationScenario)
    truth = result.trace["ground_truth"]
    axes.plot(*truth[:, :2].T, color=color, lw=1.8, zorder=4, label=label)
    draw_robot(axes, truth[-1, :3], "")


def main() -> None:
    """Runs both planners and writes the picture."""
    scenario = load_scenario("navigation", ["planner=apf_hw", *PLACES])
    assert isinstance(scenario, NavigationScenario)
    plan = load_plan(scenario)
    assert plan is not None
    _, highway = make_highway(scenario, plan, spawn_seeds(scenario.seed)[0])
    without = run(load_scenario("navigation", ["planner=apf", *PLACES]))
    along = run(scenario)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 4.6), layout="constrained")
        axes = figure.add_subplot()
        draw_plan(axes, plan)
        draw_highway(axes, highway)
        draw_run(axes, without, "black", f"apf: {without.reason}")
        draw_run(axes, along, BLUE, f"apf_hw: {along.reason}")
        draw_robot(axes, np.array(scenario.start), "start")
        axes.plot(
            *scenario.target,
            "*",
            color=GREEN,
            ms=13,
            mec="white",
            zorder=6,
            label="target",
            ls="none",
        )
        axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2)
        figure.savefig(PICTURE)


if __name__ == "__main__":
    main()
