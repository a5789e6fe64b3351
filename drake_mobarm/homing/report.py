"""A run of the homing scenario, for people."""

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from drake_mobarm.drawing.floor_plan import (
    draw_floor_plan,
    draw_robot,
    frame_building,
)
from drake_mobarm.drawing.style import BLUE, GREEN, STYLE
from drake_mobarm.homing.job import HomingScenario
from drake_mobarm.job import Report, RunRecord
from drake_mobarm.world.sdf import load_world


def draw_trajectory(run: RunRecord) -> Figure:
    """The floor plan with the path driven and the estimates on the way."""
    scenario, trace = run.scenario, run.trace
    assert isinstance(scenario, HomingScenario)
    world = load_world(scenario.world, scenario.meshes)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.5, 5.0), layout="constrained")
        axes = figure.add_subplot()
        path = trace["ground_truth"][:, :2]
        estimates = trace["estimated_target"]
        estimates = estimates[estimates[:, 2] > 0.5, :2]
        draw_floor_plan(axes, world)
        shades = axes.scatter(
            estimates[:, 0],
            estimates[:, 1],
            c=np.linspace(0, 1, len(estimates)),
            s=7,
            cmap="YlOrBr",
            vmin=-0.4,
            vmax=1.0,
            zorder=3,
            linewidths=0,
        )
        axes.plot(*path.T, color=BLUE, lw=1.8, zorder=4, label="robot")
        shades.set_label("estimates (darker: later)")
        draw_robot(axes, trace["ground_truth"][0, :3], "start")
        draw_robot(axes, trace["ground_truth"][-1, :3], "end")
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
        frame_building(
            axes, world, np.vstack([path, estimates[-1:], [scenario.beacon]])
        )
        metrics = run.metrics
        error = metrics["goal_position_error_m"]
        estimated = f"estimate off by {100 * error:.1f} cm"
        if np.isnan(error):
            estimated = "no estimate"
        # Two lines: some buildings are narrow.
        axes.set_title(
            f"{run.reason}, {metrics['time_to_target_s']:.1f} s\n{estimated}, "
            f"path efficiency {metrics['path_efficiency']:.2f}",
            loc="left",
        )
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3)
    return figure


def describe_homing(run: RunRecord) -> list[tuple[str, str]]:
    """The figures that matter, each with its label."""
    m = run.metrics
    error = m["goal_position_error_m"]
    return [
        (
            "time",
            f"{m['time_to_target_s']:.1f} s, "
            f"{run.real_time_factor:.0f} times real time",
        ),
        (
            "estimate off by",
            "no estimate" if np.isnan(error) else f"{error:.3f} m",
        ),
        ("robot to beacon", f"{m['final_position_error_m']:.3f} m"),
        (
            "path",
            f"{m['distance_travelled_m']:.2f} m, efficiency "
            f"{m['path_efficiency']:.2f}",
        ),
        ("contacts", f"{m['contacts']:.0f}"),
        *(
            (f"{kind} dropped", f"{m[f'{kind}_dropped']:.0f}")
            for kind in ("poses", "readings")
            if m[f"{kind}_dropped"] > 0
        ),
    ]


REPORT = Report(
    picture="trajectory.png", draw=draw_trajectory, describe=describe_homing
)
