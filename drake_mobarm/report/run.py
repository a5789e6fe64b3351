"""Pictures and files of a run."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from drake_mobarm.geometry import Array
from drake_mobarm.report.style import BLUE, GREEN, GREY, STYLE
from drake_mobarm.scenario import (
    ROBOT_HEIGHTS,
    ROBOT_RADIUS,
    HomingScenario,
    dump_scenario,
)
from drake_mobarm.simulation import Result
from drake_mobarm.world.obstacles import outlines
from drake_mobarm.world.sdf import World, load_world


def save_run(result: Result, folder: Path) -> None:
    """Writes a run's files: see the README for what is in them."""
    (folder / "summary.json").write_text(result.summary() + "\n")
    (folder / "scenario.yaml").write_text(dump_scenario(result.scenario))
    (folder / "diagram.dot").write_text(result.diagram_dot)
    # A dict would be typed as the other keywords of savez, too.
    np.savez_compressed(folder / "trace.npz", **result.trace)  # type: ignore[arg-type]
    draw_trajectory(result).savefig(folder / "trajectory.png")
    if result.recording is not None:
        (folder / "recording.html").write_text(result.recording)


def draw_trajectory(result: Result) -> Figure:
    """The floor plan with the path driven and the estimates on the way."""
    scenario, trace = result.scenario, result.trace
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.5, 5.0), layout="constrained")
        axes = figure.add_subplot()
        path = trace["ground_truth"][:, :2]
        estimates = trace["estimated_target"]
        estimates = estimates[estimates[:, 2] > 0.5, :2]
        draw_floor_plan(axes, load_world(scenario.world))
        shades = axes.scatter(
            estimates[:, 0],
            estimates[:, 1],
            c=np.linspace(0, 1, len(estimates)),
            s=7,
            cmap="YlOrBr",
            vmin=-0.4,
            zorder=3,
            linewidths=0,
        )
        axes.plot(*path.T, color=BLUE, lw=1.8, zorder=4, label="robot")
        shades.set_label("estimates (darker: later)")
        _draw_robot(axes, trace["ground_truth"][0, :3], "start")
        _draw_robot(axes, trace["ground_truth"][-1, :3], "end")
        axes.plot(
            *scenario.beacon,
            "*",
            color=GREEN,
            ms=13,
            mec="white",
            zorder=6,
            label="beacon",
            ls="none",
        )
        axes.add_patch(
            Circle(
                (scenario.beacon[0], scenario.beacon[1]),
                0.3,
                fill=False,
                color=GREEN,
                lw=0.8,
                ls=":",
                zorder=5,
            )
        )
        _frame(axes, scenario, np.vstack([path, estimates[-1:]]))
        metrics = result.metrics
        axes.set_title(
            f"{result.reason}: {metrics['time_to_target_s']:.1f} s, estimate "
            f"off by {100 * metrics['goal_position_error_m']:.1f} cm, path "
            f"efficiency {metrics['path_efficiency']:.2f}",
            loc="left",
        )
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3)
    return figure


def draw_floor_plan(axes: Axes, world: World) -> None:
    """What the robot could touch, grey; what its lidar sees of it, darker."""
    for heights, color in ((ROBOT_HEIGHTS, "#dadce0"), ((0.2, 0.2), GREY)):
        shapes = [Polygon(o) for o in outlines(world.obstacles, *heights)]
        axes.add_collection(
            PatchCollection(shapes, facecolor=color, edgecolor="none", zorder=1)
        )
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def _draw_robot(axes: Axes, pose: Array, label: str) -> None:
    x, y, yaw = pose
    axes.add_patch(
        Circle(
            (x, y),
            ROBOT_RADIUS,
            facecolor="white",
            edgecolor=BLUE,
            lw=1.2,
            zorder=5,
        )
    )
    axes.plot(
        [x, x + ROBOT_RADIUS * np.cos(yaw)],
        [y, y + ROBOT_RADIUS * np.sin(yaw)],
        color=BLUE,
        lw=1.2,
        zorder=5,
    )
    axes.annotate(
        label,
        (x, y - ROBOT_RADIUS),
        textcoords="offset points",
        xytext=(0, -9),
        ha="center",
        fontsize=7,
        zorder=7,
    )


def _frame(axes: Axes, scenario: HomingScenario, points: Array) -> None:
    """Shows the whole building, or the run where there is none."""
    world = outlines(load_world(scenario.world).obstacles, *ROBOT_HEIGHTS)
    points = np.vstack([points, [scenario.beacon], *world])
    low, high = points.min(axis=0) - 0.8, points.max(axis=0) + 0.8
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
