"""Pictures of Table 3.1, after Figure 3.6; its environments and failures."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from drake_mobarm.drawing.style import BLUE, GREEN, GREY, ORANGE, STYLE
from drake_mobarm.geometry import Array
from drake_mobarm.navigation.environments import ENVIRONMENTS, Environment

Row = Mapping[str, Any]

_NUMBER = {e.name: number for number, e in enumerate(ENVIRONMENTS)}
# So many failures are drawn.
_FAILURES = 10


def pictures(rows: Sequence[Row], paths: Sequence[Array]) -> dict[str, Figure]:
    """The pictures that go with the table, by file name.

    Args:
        rows: one a trial.
        paths: of each trial [m], (n, 2).
    """
    methods = list(dict.fromkeys(row["method"] for row in rows))
    last = methods[-1]
    draws: dict[str, Callable[[], Figure]] = {
        "by_environment.png": lambda: draw_by_environment(rows),
        "by_grid_size.png": lambda: draw_by_grid_size(rows),
        "plans.png": lambda: draw_plans(rows, paths, last),
        "failures.png": lambda: draw_failures(rows, paths),
    }
    with mpl.rc_context(STYLE):
        return {file: draw() for file, draw in draws.items()}


def draw_by_environment(rows: Sequence[Row]) -> Figure:
    """Success, path length and steps, by environment and weight."""
    methods = list(dict.fromkeys(row["method"] for row in rows))
    weights = sorted({row["weight"] for row in rows})
    shades = mpl.colormaps["viridis"](np.linspace(0.1, 0.9, len(weights)))
    figure = Figure(figsize=(7.2, 2.4 * len(methods)), layout="constrained")
    grid = figure.subplots(len(methods), 3, squeeze=False, sharex=True)
    panels = (
        ("success", "success rate", False),
        ("path_length_m", "mean path length [m]", True),
        ("steps", "mean steps", True),
    )
    for line, method in zip(grid, methods, strict=True):
        own = [row for row in rows if row["method"] == method]
        common = _solved_by_all(own)
        for axes, (metric, label, compared) in zip(line, panels, strict=True):
            for index, weight in enumerate(weights):
                means = [
                    _mean(row[metric] for row in chosen)
                    for e in ENVIRONMENTS
                    for chosen in [
                        [
                            row
                            for row in (common if compared else own)
                            if row["weight"] == weight
                            and row["environment"] == e.name
                        ]
                    ]
                ]
                place = np.arange(1, len(means) + 1) + 0.16 * (
                    index - (len(weights) - 1) / 2
                )
                axes.bar(place, means, 0.16, color=shades[index])
            axes.set_title(method if metric == "success" else "")
            axes.set_ylabel(label)
            axes.set_xticks(range(1, len(ENVIRONMENTS) + 1))
    for axes in grid[-1]:
        axes.set_xlabel("environment")
    figure.legend(
        [Rectangle((0, 0), 1, 1, color=shade) for shade in shades],
        [f"m = {weight:g}" for weight in weights],
        loc="outside upper center",
        ncols=len(weights),
    )
    return figure


def draw_by_grid_size(rows: Sequence[Row]) -> Figure:
    """Success and the highway's pieces, by grid size and method; m = 50."""
    figure = Figure(figsize=(7.2, 2.6), layout="constrained")
    success, pieces = figure.subplots(1, 2)
    methods = list(dict.fromkeys(row["method"] for row in rows))
    factors = sorted({row["grid_factor"] for row in rows})
    for index, method in enumerate(methods):
        middle = (len(methods) - 1) / 2
        place = np.arange(len(factors)) + 0.27 * (index - middle)
        for axes, metric in (
            (success, "success"),
            (pieces, "highway_pieces"),
        ):
            means = [
                _mean(
                    row[metric]
                    for row in rows
                    if row["method"] == method
                    and row["grid_factor"] == factor
                    and row["weight"] == 50
                )
                for factor in factors
            ]
            color = (ORANGE, GREEN, BLUE)[index]
            axes.bar(place, means, 0.27, color=color, label=method)
    success.set_ylabel("success rate")
    pieces.set_ylabel("mean number of pieces")
    for axes in (success, pieces):
        axes.set_xticks(range(len(factors)), [f"{x:g}" for x in factors])
        axes.set_xlabel("grid size, share of (3.1)'s")
    pieces.legend()
    return figure


def draw_plans(
    rows: Sequence[Row], paths: Sequence[Array], method: str
) -> Figure:
    """The ten environments with the paths of one method, m = 50."""
    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    for axes, environment in zip(
        figure.subplots(2, 5).ravel(), ENVIRONMENTS, strict=True
    ):
        draw_environment(axes, environment)
        for row, path in zip(rows, paths, strict=True):
            if (
                row["environment"] == environment.name
                and row["method"] == method
                and row["weight"] == 50
            ):
                color = BLUE if row["success"] else ORANGE
                axes.plot(*np.transpose(path), color=color, lw=0.6, alpha=0.6)
    return figure


def draw_failures(rows: Sequence[Row], paths: Sequence[Array]) -> Figure:
    """Plans that failed, of all methods and environments in turn."""
    failed = [
        (row, path)
        for row, path in zip(rows, paths, strict=True)
        if not row["success"]
    ]
    order = _turns([(row["method"], row["environment"]) for row, _ in failed])
    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    for axes, index in zip(
        figure.subplots(2, _FAILURES // 2).ravel(), order, strict=False
    ):
        row, path = failed[index]
        environment = ENVIRONMENTS[_NUMBER[row["environment"]]]
        draw_environment(axes, environment)
        axes.plot(*np.transpose(path), color=ORANGE, lw=1.2)
        axes.plot(*path[-1], "x", color=ORANGE)
        axes.plot(*environment.starts[row["start"]], "o", color=BLUE)
        axes.plot(*environment.targets[row["target"]], "*", color=GREEN, ms=9)
        reason = row["reason"].partition(",")[0]
        axes.set_title(row["case"], fontsize=7)
        axes.set_xlabel(
            f"{reason}; pieces: {row['highway_pieces']:.0f}", fontsize=7
        )
    for axes in figure.axes[len(order) :]:
        axes.set_axis_off()
    return figure


def draw_environment(axes: Axes, environment: Environment) -> None:
    """Draws obstacles, walls, starts and targets."""
    width, depth = environment.size
    for x_min, y_min, x_max, y_max in environment.obstacles:
        axes.add_patch(
            Rectangle(
                (x_min, y_min), x_max - x_min, y_max - y_min, color=GREY, lw=0
            )
        )
    axes.add_patch(Rectangle((0, 0), width, depth, fill=False, ec=GREY, lw=1.5))
    axes.plot(*np.transpose(environment.starts), "o", color=BLUE, ms=3)
    axes.plot(*np.transpose(environment.targets), "*", color=GREEN, ms=5)
    axes.set_title(f"{_NUMBER[environment.name] + 1}: {environment.name}")
    axes.set_xlim(-0.05, width + 0.05)
    axes.set_ylim(-0.05, depth + 0.05)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)


def _solved_by_all(rows: Sequence[Row]) -> list[Row]:
    """Rows of the tasks in which every weight succeeds."""
    tasks: dict[tuple[Any, ...], bool] = {}
    for row in rows:
        task = _task(row)
        tasks[task] = tasks.get(task, True) and row["success"]
    return [row for row in rows if tasks[_task(row)]]


def _task(row: Row) -> tuple[Any, ...]:
    names = ("seed", "environment", "grid_factor", "start", "target")
    return tuple(row[name] for name in names)


def _mean(values: Any) -> float:
    values = list(values)
    return float(np.mean(values)) if values else float("nan")


def _turns(kinds: Sequence[tuple[str, str]]) -> list[int]:
    """Indices such that methods take turns, and environments in a method."""
    seen: dict[Any, int] = {}
    ranks = []
    for kind in kinds:
        ranks.append(seen.get(kind, 0))
        seen[kind] = ranks[-1] + 1
    by_method: dict[str, list[int]] = {}
    for index in sorted(range(len(kinds)), key=lambda i: (ranks[i], i)):
        by_method.setdefault(kinds[index][0], []).append(index)
    rounds = itertools.zip_longest(*by_method.values())
    mixed = [index for turn in rounds for index in turn if index is not None]
    return mixed[:_FAILURES]
