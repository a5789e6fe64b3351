"""A run of navigation, for people."""

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from drake_mobarm.drawing.floor_plan import (
    draw_floor_plan,
    draw_robot,
    frame_building,
)
from drake_mobarm.drawing.style import BLUE, GREEN, ORANGE, STYLE
from drake_mobarm.job import Report, RunRecord
from drake_mobarm.navigation.job import NavigationScenario
from drake_mobarm.world.sdf import load_world

# From one force's arrow to the next [s], and the longest arrow [m].
_ARROWS, _LONGEST = 1.0, 0.8


def draw_trajectory(run: RunRecord) -> Figure:
    """The floor plan with the path driven, and the forces on the way."""
    scenario, trace = run.scenario, run.trace
    assert isinstance(scenario, NavigationScenario)
    world = load_world(scenario.world, scenario.meshes)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.5, 5.0), layout="constrained")
        axes = figure.add_subplot()
        path, target = trace["ground_truth"][:, :2], scenario.target
        draw_floor_plan(axes, world)
        axes.plot(*path.T, color=BLUE, lw=1.8, zorder=4, label="robot")
        draw_robot(axes, trace["ground_truth"][0, :3], "start")
        draw_robot(axes, trace["ground_truth"][-1, :3], "end")
        stride = round(_ARROWS / (trace["t"][1] - trace["t"][0]))
        forces = trace["navigation_forces"].reshape(-1, 3, 2).sum(axis=1)
        forces, places = forces[::stride], path[::stride]
        strength = np.hypot(*forces.T)[:, None]
        if strength.max() > 0:
            arrows = forces / np.maximum(strength, 1.0) * _LONGEST
            axes.quiver(
                *places.T,
                *arrows.T,
                color=ORANGE,
                angles="xy",
                scale_units="xy",
                scale=1,
                width=0.003,
                zorder=5,
                label="total force",
            )
        axes.plot(
            *target,
            "*",
            color=GREEN,
            ms=13,
            mec="white",
            zorder=6,
            label="target",
            ls="none",
        )
        frame_building(axes, world, np.vstack([path, [target]]))
        m = run.metrics
        axes.set_title(
            f"{run.reason}, {m['time_to_target_s']:.1f} s\n{scenario.planner}: "
            f"path efficiency {m['path_efficiency']:.2f}, "
            f"{m['length_over_shortest']:.2f} times the shortest way",
            loc="left",
        )
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3)
    return figure


def describe_navigation(run: RunRecord) -> list[tuple[str, str]]:
    """The figures that matter, each with its label."""
    m = run.metrics
    return [
        (
            "time",
            f"{m['time_to_target_s']:.1f} s, "
            f"{run.real_time_factor:.0f} times real time",
        ),
        ("robot to target", f"{m['final_position_error_m']:.3f} m"),
        (
            "path",
            f"{m['distance_travelled_m']:.2f} m, "
            f"{m['length_over_shortest']:.2f} times the shortest way",
        ),
        (
            "contacts",
            f"{m['contacts']:.0f}, {m['time_in_contact_s']:.1f} s, smallest "
            f"clearance {m['smallest_clearance_m']:.3f} m",
        ),
        (
            "pose off by",
            f"{m['pose_error_m']:.3f} m, {m['yaw_error_rad']:.3f} rad",
        ),
    ]


REPORT = Report(
    picture="trajectory.png", draw=draw_trajectory, describe=describe_navigation
)
