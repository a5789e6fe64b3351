"""A run of the placement scenario, for people."""

import csv
import textwrap
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from drake_mobarm.drawing.floor_plan import (
    draw_floor_plan,
    draw_robot,
    frame_building,
)
from drake_mobarm.drawing.style import GREEN, GREY, ORANGE, STYLE
from drake_mobarm.geometry import Array
from drake_mobarm.job import Report, RunRecord
from drake_mobarm.placement.job import PlacementScenario
from drake_mobarm.placement.planner import Placement
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.world.obstacles import outlines
from drake_mobarm.world.sdf import load_world

# Characters that fit in the figure's width.
_LINE = 105
# Half of what is shown around the target [m].
_CLOSE = 1.15
# Squares so many times worse than the best one are all of one colour.
_SHADED_UP_TO = 4.0


def draw_map(run: RunRecord) -> Figure:
    """The objective over the floor plan, and the chosen stand."""
    scenario = run.scenario
    assert isinstance(scenario, PlacementScenario)
    placement: Placement = run.outputs["placement"]
    world = load_world(scenario.world, scenario.meshes)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 4.6), layout="constrained")
        plan, close = figure.subplots(1, 2, width_ratios=(1.25, 1))
        for axes, line_width in ((plan, 0.0), (close, 0.3)):
            draw_floor_plan(axes, world)
            shades = _draw_squares(axes, placement, line_width)
            if placement.stand is not None:
                draw_robot(axes, placement.stand.pose, "", see_through=True)
            _draw_target(axes, scenario)
        if placement.stand is not None:
            _draw_arm(close, placement)
        draw_robot(plan, np.array(scenario.start), "start")
        frame_building(
            plan, world, np.array([scenario.start[:2], scenario.target[:2]])
        )
        x, y, z = scenario.target
        # What the base passes under and the arm does not.
        for shape in outlines(
            world.obstacles, HEIGHTS[1], max(z, HEIGHTS[1]) + 0.2
        ):
            close.add_patch(
                Polygon(shape, fill=False, color=GREY, lw=0.8, ls="--")
            )
        close.set_xlim(x - _CLOSE, x + _CLOSE)
        close.set_ylim(y - _CLOSE, y + _CLOSE)
        close.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3)
        plan.set_title("free squares, and those in reach", loc="left")
        close.set_title(f"target at {z:.2f} m", loc="left")
        if len(placement.squares):
            bar = figure.colorbar(
                shades,
                ax=close,
                label="objective (4.12), less is better",
                extend="max",
            )
            ticks = _ticks(placement.objective[0])
            bar.set_ticks(ticks, labels=[f"{t:g}" for t in ticks])
            bar.ax.minorticks_off()
        reason = textwrap.fill(run.reason, _LINE)
        figure.suptitle(reason, x=0.01, ha="left", fontsize=10)
    return figure


def describe_placement(run: RunRecord) -> list[tuple[str, str]]:
    """The figures that matter, each with its label."""
    m = run.metrics
    lines = [
        (
            "free squares",
            f"{m['free_squares']:.0f}, {100 * m['free_area_covered']:.1f} % "
            "of the free area",
        ),
        ("in reach", f"{m['attractive_squares']:.0f} of them"),
    ]
    placement: Placement = run.outputs["placement"]
    if placement.stand is None:
        return lines
    if len(placement.squares):
        lines.append(
            (
                "objective",
                f"{m['objective']:.3f}, best square "
                f"{m['best_square_objective']:.3f}",
            )
        )
    else:
        lines.append(("objective", f"{m['objective']:.3f}"))
    joints = ", ".join(f"{np.rad2deg(x):.1f}" for x in placement.stand.q)
    return [
        *lines,
        (
            "torque",
            f"score {m['torque_score_n_m']:.3f} N m, at most "
            f"{100 * m['largest_load']:.0f} % of a joint's limit",
        ),
        (
            "sensitivity",
            f"{m['position_sensitivity_m_per_rad']:.3f} m/rad, "
            f"{m['attitude_sensitivity']:.3f} rad/rad",
        ),
        ("joints", f"{joints} deg"),
    ]


def write_squares(run: RunRecord, folder: Path) -> None:
    """The attractive squares with their values, the best first."""
    placement: Placement = run.outputs["placement"]
    with (folder / "squares.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["x_m", "y_m", "objective"])
        for (x, y), value in zip(
            placement.centres, placement.objective, strict=True
        ):
            writer.writerow([f"{x:.6f}", f"{y:.6f}", f"{value:.6f}"])


def _draw_squares(
    axes: Axes, placement: Placement, line_width: float
) -> PolyCollection:
    corners = placement.grid.corners()
    axes.add_collection(
        PolyCollection(
            list(corners),
            facecolor="#e8eef7",
            edgecolor="white",
            linewidth=line_width,
            zorder=1.5,
        )
    )
    best = placement.objective[0] if len(placement.squares) else 1.0
    shaded = PolyCollection(
        list(corners[placement.squares]),
        array=placement.objective,
        norm=LogNorm(best, _SHADED_UP_TO * best),
        cmap="viridis",
        edgecolor="white",
        linewidth=line_width,
        zorder=2,
    )
    axes.add_collection(shaded)
    return shaded


def _draw_target(axes: Axes, scenario: PlacementScenario) -> None:
    x, y, _ = scenario.target
    axes.plot(
        x,
        y,
        "*",
        color=GREEN,
        ms=13,
        mec="white",
        zorder=8,
        label="target",
        ls="none",
    )
    a_x, a_y, _ = scenario.approach
    if np.hypot(a_x, a_y) > 0.1:  # Else it would be a dot.
        axes.annotate(
            "",
            (x, y),
            (x - 0.35 * a_x, y - 0.35 * a_y),
            arrowprops={"arrowstyle": "->", "color": GREEN, "lw": 1.5},
            zorder=7.5,
        )


def _draw_arm(axes: Axes, placement: Placement) -> None:
    """The arm from above."""
    assert placement.stand is not None
    x, y, yaw = placement.stand.pose
    points = ArmKinematics().joint_positions(placement.stand.q)
    c, s = np.cos(yaw), np.sin(yaw)
    above: Array = points[:, :2] @ np.array([[c, s], [-s, c]]) + (x, y)
    axes.plot(*above.T, "o-", color=ORANGE, lw=2, ms=3.5, zorder=7, label="arm")


def _ticks(best: float) -> list[float]:
    values = best * np.geomspace(1, _SHADED_UP_TO, 5)
    return [float(f"{v:.2g}") for v in values]


REPORT = Report(
    picture="map.png",
    draw=draw_map,
    describe=describe_placement,
    write_more=write_squares,
)
