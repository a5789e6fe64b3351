"""Draws what a robot that drives by a map knows, at two moments of a run.

    python docs/draw_map_avoidance.py

The picture is docs/images/map_avoidance.png. No log holds the map: an
avoidance that keeps all of its states takes the shipped one's place.
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pydrake.systems.framework import Context, State

from drake_mobarm import load_scenario, run
from drake_mobarm.drawing.floor_plan import (
    draw_floor_plan,
    draw_robot,
    frame_building,
)
from drake_mobarm.drawing.style import BLUE, GREEN, ORANGE, STYLE
from drake_mobarm.driving.map_avoidance_state import MapAvoidanceState
from drake_mobarm.driving.systems import MapAvoidance
from drake_mobarm.geometry import Array
from drake_mobarm.station.parameters import PROCESSING_DELAY
from drake_mobarm.world.sdf import load_world
from drake_mobarm.world.world import World

PICTURE = Path(__file__).parent / "images" / "map_avoidance.png"
SCENARIO = load_scenario("homing", ["start=[0, 4.8, 0]"])
BEFORE_THE_TURN = 7.0  # [s]


class Recorded(MapAvoidance):
    """Keeps every state, with its time [s]."""

    def __init__(self) -> None:
        super().__init__(SCENARIO.map, SCENARIO.station.lidar, PROCESSING_DELAY)
        self.states: list[tuple[float, MapAvoidanceState]] = []

    def _update(self, context: Context, state: State) -> None:
        super()._update(context, state)
        memory = state.get_abstract_state().get_value(0).get_value()
        self.states.append((context.get_time(), memory))


def draw_moment(axes: Axes, world: World, seen: Array, path: Array) -> None:
    """Draws the building, the map, and the path until now.

    Args:
        axes: where to draw.
        world: the building.
        seen: p_WP of the map's points [m], (n, 2).
        path: true poses until now, (n, 3).
    """
    draw_floor_plan(axes, world)
    axes.plot(*seen.T, ".", color="black", ms=1.2, zorder=3, label="map")
    axes.plot(*path[:, :2].T, color=BLUE, lw=1.8, zorder=4, label="robot")
    axes.plot(
        *SCENARIO.beacon,
        "*",
        color=GREEN,
        ms=13,
        mec="white",
        zorder=6,
        label="beacon",
        ls="none",
    )
    for pose in (path[0], path[-1]):
        draw_robot(axes, pose, "")
    x, y = path[0, :2]
    axes.annotate("start", (x - 0.5, y), ha="right", va="center", fontsize=7)
    frame_building(axes, world, np.array([SCENARIO.beacon]))


def draw_plan(axes: Axes, state: MapAvoidanceState) -> None:
    """Draws the way that the robot is on."""
    assert state.plan is not None
    axes.plot(
        *state.plan.route.places.T,
        "--",
        color=ORANGE,
        lw=1.4,
        zorder=4,
        label="planned way",
    )


def main() -> None:
    """Runs the scenario and writes the picture."""
    avoidance = Recorded()
    result = run(SCENARIO, blocks={"avoidance": avoidance})
    world = load_world(SCENARIO.world)
    times, states = zip(*avoidance.states, strict=True)
    poses = result.trace["ground_truth"][:, :3]
    before = states[np.searchsorted(times, BEFORE_THE_TURN) - 1]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 3.0), layout="constrained")
        for axes, state, time in zip(
            figure.subplots(1, 2, sharey=True),
            (before, states[-1]),
            (BEFORE_THE_TURN, result.simulated_s),
            strict=True,
        ):
            until = result.trace["t"] <= time
            draw_moment(axes, world, state.map.points(), poses[until])
            axes.set_title(f"after {time:g} s", loc="left")
        first, second = figure.axes
        draw_plan(first, before)
        second.set_ylabel("")
        figure.legend(
            *first.get_legend_handles_labels(),
            loc="outside lower center",
            ncols=4,
            markerscale=1,
        )
        figure.savefig(PICTURE)


if __name__ == "__main__":
    main()
