"""Pictures of Tables 3.2 to 3.4, after Figures 3.7 and 3.8; and failures."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drake_mobarm.drawing.floor_plan import draw_floor_plan, frame_building
from drake_mobarm.drawing.style import BLUE, GREEN, GREY, ORANGE, STYLE
from drake_mobarm.geometry import Array
from drake_mobarm.robot.shape import HEIGHTS
from drake_mobarm.world.obstacles import outlines
from drake_mobarm.world.sdf import load_world

Row = Mapping[str, Any]

_RED = "#c5221f"
_COLORS = {
    "apf": GREY,
    "apf_escape": "#9334e6",
    "apf_hw, adaptive": ORANGE,
    "ours": BLUE,
}
# So many failures are drawn.
_FAILURES = 12


def pictures(rows: Sequence[Row], paths: Sequence[Array]) -> dict[str, Figure]:
    """The pictures that go with a table, by file name.

    Args:
        rows: one a trial.
        paths: of each trial, (n, 5): time [s], robot's x and y, estimate's
            x and y [m].
    """
    found: dict[str, Figure] = {}
    with mpl.rc_context(STYLE):
        if len({row["world"] for row in rows}) == 1:
            found["trajectories.png"] = draw_example(rows, paths)
        found["final_errors.png"] = draw_final_errors(rows, paths)
        if not all(row["success"] for row in rows):
            found["failures.png"] = draw_failures(rows, paths)
    return found


def draw_example(rows: Sequence[Row], paths: Sequence[Array]) -> Figure:
    """One pair, driven by each planner (Figure 3.7).

    It is the pair on which the planners' distances differ most.
    """
    by_pair: dict[tuple[float, ...], list[int]] = {}
    for number, row in enumerate(rows):
        if row["case"] in _COLORS:
            by_pair.setdefault(_pair(row), []).append(number)
    chosen = max(
        by_pair.values(),
        key=lambda numbers: np.ptp(
            [rows[n]["distance_travelled_m"] for n in numbers]
        ),
    )
    figure = Figure(figsize=(7.0, 5.6), layout="constrained")
    axes = figure.add_subplot()
    _draw_building(axes, rows[chosen[0]]["world"])
    for number in chosen:
        row, path = rows[number], paths[number][:, 1:3]
        axes.plot(
            *path.T, color=_COLORS[row["case"]], lw=1.6, label=row["case"]
        )
        if not row["success"]:
            axes.plot(*path[-1], "x", color=_RED, ms=8, mew=2, zorder=6)
    _draw_ends(axes, rows[chosen[0]])
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=4)
    axes.set_title("one pair, by each planner; red: not arrived", loc="left")
    return figure


def draw_final_errors(rows: Sequence[Row], paths: Sequence[Array]) -> Figure:
    """From each target to where the robot ended, a panel a case (3.8)."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    figure, grid = _panels(len(cases), [row["world"] for row in rows])
    for axes in grid[len(cases) :]:
        axes.set_visible(False)
    for axes, case in zip(grid, cases, strict=False):
        numbers = [n for n, row in enumerate(rows) if row["case"] == case]
        _draw_building(axes, rows[numbers[0]]["world"])
        for number in numbers:
            row, end = rows[number], paths[number][-1, 1:3]
            target = row["target_x_m"], row["target_y_m"]
            color = GREEN if row["success"] else _RED
            axes.annotate(
                "",
                end,
                target,
                arrowprops={
                    "arrowstyle": "->",
                    "color": color,
                    "lw": 1.0,
                    "shrinkA": 0,
                    "shrinkB": 0,
                },
            )
            axes.plot(*target, ".", color=color, ms=3)
        share = np.mean([rows[n]["success"] for n in numbers])
        name = textwrap.fill(case, 18)
        axes.set_title(f"{name}:\n{100 * share:.0f} %", loc="left", size=8)
        axes.set_xlabel("")
        axes.set_ylabel("")
    return figure


def draw_failures(rows: Sequence[Row], paths: Sequence[Array]) -> Figure:
    """Failed trials and their causes: ours first, one a planner in turn."""
    failed = [n for n, row in enumerate(rows) if not row["success"]]
    turn: dict[int, tuple[int, int]] = {}
    seen: dict[str, int] = {}
    for number in failed:
        case = rows[number]["case"]
        turn[number] = (seen.get(case, 0), "ours" not in case)
        seen[case] = turn[number][0] + 1
    failed = sorted(failed, key=lambda number: turn[number])[:_FAILURES]
    figure, grid = _panels(len(failed), [row["world"] for row in rows])
    for axes in grid[len(failed) :]:
        axes.set_visible(False)
    for axes, number in zip(grid, failed, strict=False):
        row, path = rows[number], paths[number][:, 1:3]
        _draw_building(axes, row["world"])
        axes.plot(*path.T, color=ORANGE, lw=1.2)
        axes.plot(*path[-1], "x", color=_RED, ms=7, mew=1.8, zorder=6)
        _draw_ends(axes, row)
        axes.set_title(f"{row['case']}\n{row['reason']}", loc="left", size=7)
        axes.set_xlabel("")
        axes.set_ylabel("")
    return figure


def _panels(count: int, worlds: Sequence[str]) -> tuple[Figure, Any]:
    """A figure of so many floor plans, narrow ones closer together."""
    narrow = all(map(_is_narrow, set(worlds)))
    columns = min(count, 7 if narrow else 3)
    lines = -(-count // columns)
    width, height = (1.7, 3.6) if narrow else (3.6, 3.1)
    figure = Figure(
        figsize=(width * columns, height * lines), layout="constrained"
    )
    return figure, figure.subplots(lines, columns, squeeze=False).ravel()


def _is_narrow(name: str) -> bool:
    """Whether a world is far longer along y than along x."""
    corners = np.vstack(outlines(load_world(name).obstacles, *HEIGHTS))
    width, depth = np.ptp(corners, axis=0)
    return bool(depth > 1.6 * width)


def _pair(row: Row) -> tuple[float, ...]:
    return tuple(
        row[key]
        for key in ("start_x_m", "start_y_m", "target_x_m", "target_y_m")
    )


def _draw_ends(axes: Axes, row: Row) -> None:
    x, y, target_x, target_y = _pair(row)
    axes.plot(x, y, "X", color=BLUE, mec="white", ms=9, zorder=7)
    axes.plot(
        target_x, target_y, "*", color=GREEN, mec="white", ms=12, zorder=7
    )


def _draw_building(axes: Axes, name: str) -> None:
    world = load_world(name)
    draw_floor_plan(axes, world)
    frame_building(axes, world, np.zeros((1, 2)))
