"""Draws the floor plans that a robot is given of the shipped worlds.

    python docs/draw_floor_plans.py

writes them beside the worlds, and the picture docs/images/floor_plans.png.
They differ from the worlds on purpose, as the floor plans of section 3.3.4 do:
loose things are missing, and tables and chairs are solid, though the robot
can see between their legs, and drive between those of some. A chair or a
table is the convex outline of what the robot can touch of it. The tables of
the café and the dining table have their tops, too; the long tables of the
bookstore do not, for the only way behind some stools leads under one.
"""

import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull

from drake_mobarm.drawing.style import ORANGE, STYLE
from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.world.floor_plan import FloorPlan
from drake_mobarm.world.floor_plan_files import write_floor_plan
from drake_mobarm.world.obstacles import Obstacle, outlines
from drake_mobarm.world.sdf import load_world
from drake_mobarm.world.world import WORLDS, World

# Fine enough to hold a robot's pose to a centimetre [m].
RESOLUTION = 0.025
PICTURE = Path(__file__).parent / "images" / "floor_plans.png"
NAMES, WIDTHS = ("small_house", "bookstore", "cafe"), (1.8, 1.5, 1.0)
LOOSE = re.compile(r"(ball|book_stack|photo_frame|picture)_\d+(_p\d+)?")
SOLID = re.compile(
    r"((?:\w+_)?(?:bench|chair|reading_desk|stool|table)(?:_\d+)?)"
    r"(?:_p\d+|_foot|_post|_top)?"
)
TOPPED = re.compile(r"table_\d+|dining_table")


def floor_plan(world: World) -> FloorPlan:
    """The plan that is given of a world."""
    shown = tuple(shown_on_plan(world.obstacles))
    return FloorPlan.from_world(replace(world, obstacles=shown), RESOLUTION)


def shown_on_plan(obstacles: tuple[Obstacle, ...]) -> Iterator[Obstacle]:
    """What a plan shows of obstacles."""
    parts = defaultdict(list)
    for obstacle in obstacles:
        thing = SOLID.fullmatch(obstacle.name)
        if thing is None and not LOOSE.fullmatch(obstacle.name):
            yield obstacle
        if thing is not None and (
            TOPPED.fullmatch(thing[1]) or obstacle.outline(*HEIGHTS) is not None
        ):
            parts[thing[1]].append(obstacle.corners[:, :2])
    for thing, corners in parts.items():
        points = np.vstack(corners)
        hull = points[ConvexHull(points).vertices]
        low, high = (np.insert(hull, 2, z, axis=1) for z in HEIGHTS)
        yield Obstacle(thing, np.vstack([low, high]))


def draw(axes: Axes, world: World) -> None:
    """Draws a plan, and the outlines of what the robot could touch."""
    plan = floor_plan(world)
    shades = np.where(plan.occupied, 0.35, np.where(plan.unknown, 0.85, 1.0))
    low, _, high, _ = plan.corners()
    extent = (low[0], high[0], low[1], high[1])
    axes.imshow(shades, cmap="gray", vmin=0, vmax=1, extent=extent)
    for outline in outlines(world.obstacles, *HEIGHTS):
        axes.fill(*outline.T, fill=False, ec=ORANGE, lw=0.4)
    axes.set_title(world.name, loc="left")
    axes.set_xlabel("x [m]")


def main() -> None:
    """Writes the plans and the picture."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 3.2), layout="constrained")
        subplots = figure.subplots(1, len(NAMES), width_ratios=WIDTHS)
        for axes, name in zip(subplots, NAMES, strict=True):
            world = load_world(name)
            write_floor_plan(floor_plan(world), WORLDS / f"{name}.yaml")
            draw(axes, world)
        subplots[0].set_ylabel("y [m]")
        figure.savefig(PICTURE)


if __name__ == "__main__":
    main()
