"""Floor plans, and robots on them."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.patches import Circle, Polygon

from drake_mobarm.drawing.style import BLUE, GREY
from drake_mobarm.geometry import Array
from drake_mobarm.robot.shape import HEIGHTS, LIDAR_HEIGHT, RADIUS
from drake_mobarm.world.obstacles import outlines
from drake_mobarm.world.world import World


def draw_floor_plan(axes: Axes, world: World) -> None:
    """Draws what the robot could touch, and, darker, what its lidar sees."""
    scanned = (LIDAR_HEIGHT, LIDAR_HEIGHT)
    for heights, color in ((HEIGHTS, "#dadce0"), (scanned, GREY)):
        shapes = [Polygon(o) for o in outlines(world.obstacles, *heights)]
        axes.add_collection(
            PatchCollection(shapes, facecolor=color, edgecolor="none", zorder=1)
        )
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def draw_robot(
    axes: Axes, pose: Array, label: str, *, see_through: bool = False
) -> None:
    """Draws the robot's outline and heading, with a label below."""
    x, y, yaw = pose
    axes.add_patch(
        Circle(
            (x, y),
            RADIUS,
            facecolor="none" if see_through else "white",
            edgecolor=BLUE,
            lw=1.2,
            zorder=5,
        )
    )
    axes.plot(
        [x, x + RADIUS * np.cos(yaw)],
        [y, y + RADIUS * np.sin(yaw)],
        color=BLUE,
        lw=1.2,
        zorder=5,
    )
    axes.annotate(
        label,
        (x, y - RADIUS),
        textcoords="offset points",
        xytext=(0, -9),
        ha="center",
        fontsize=7,
        zorder=7,
    )


def frame_building(axes: Axes, world: World, points: Array) -> None:
    """Sets the limits so that the whole building and points (n, 2) show."""
    shapes = outlines(world.obstacles, *HEIGHTS)
    points = np.vstack([points, *shapes])
    low, high = points.min(axis=0) - 0.8, points.max(axis=0) + 0.8
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
