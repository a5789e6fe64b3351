"""Pictures of the homing tables, after Figures 2.2, 2.6, 2.7, A.1 to A.3."""

from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from drake_mobarm.drawing.floor_plan import draw_floor_plan
from drake_mobarm.drawing.style import BLUE, GREEN, GREY, ORANGE, STYLE
from drake_mobarm.geometry import Array
from drake_mobarm.sensors.rssi import (
    BEACONS,
    calibration_samples,
    fit_rssi_model,
)
from drake_mobarm.world.sdf import load_world

Row = dict[str, Any]

_ESTIMATORS = {"hybrid": ORANGE, "filter": BLUE}
_COLORS = _ESTIMATORS | {
    "hybrid, rules": "#f8c98a",
    "filter, rules": "#9cc3f0",
    "hybrid, map": ORANGE,
    "filter, map": BLUE,
}
_METRICS = {
    "goal_position_error_m": "goal position error [m]",
    "time_to_target_s": "time to target [s]",
    "net_velocity_m_per_s": "net velocity [m/s]",
    "path_efficiency": "path efficiency",
}


def pictures(
    name: str, rows: Sequence[Row], paths: Sequence[Array]
) -> dict[str, Figure]:
    """The pictures that go with a table, by file name.

    Args:
        name: of the table.
        rows: one a trial.
        paths: of each trial, (n, 5): time [s], robot's x and y, estimate's
            x and y [m].
    """
    draws: dict[str, dict[str, Callable[[], Figure]]] = {
        "2.3": {
            "calibration.png": draw_calibration,
            "trajectories.png": lambda: draw_open_trajectories(rows, paths),
            "by_location.png": lambda: draw_by_location(rows),
            "by_distance.png": lambda: draw_by_distance(rows),
        },
        "2.4": {
            "trajectory.png": lambda: draw_house_example(rows, paths),
            "all_trajectories.png": lambda: draw_house(rows, paths),
            "by_distance.png": lambda: draw_by_distance(rows),
        },
        "tau": {"tau.png": lambda: draw_tau(rows)},
        "told": {"told.png": lambda: draw_told(rows)},
    }
    of = name.removesuffix("-half-turn")
    with mpl.rc_context(STYLE):
        return {file: draw() for file, draw in draws[of].items()}


def draw_calibration() -> Figure:
    """RSSI to distance of two beacons (Figure 2.2)."""
    figure = Figure(figsize=(5.0, 4.0), layout="constrained")
    axes = figure.add_subplot()
    distance = np.geomspace(0.4, 11, 100)
    for number, (name, model) in enumerate(BEACONS.items()):
        rng = np.random.default_rng(number)
        rssi, sampled = calibration_samples(model, 2.0, rng)
        fit = fit_rssi_model(rssi, sampled)
        color = (BLUE, ORANGE)[number]
        axes.plot(rssi, sampled, ".", color=color, ms=3, alpha=0.4)
        axes.plot(
            fit.rssi(distance),
            distance,
            color=color,
            label=f"{name}: {fit.rssi_at_1m:.1f} dBm at 1 m, "
            f"exponent {fit.path_loss_exponent:.2f}",
        )
    axes.set_xlabel("RSSI [dBm]")
    axes.set_ylabel("distance [m]")
    axes.set_title("Calibration from samples with 2 dB of noise", loc="left")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18))
    return figure


def draw_open_trajectories(
    rows: Sequence[Row], paths: Sequence[Array]
) -> Figure:
    """All paths of the noisiest configuration (Figure 2.6)."""
    figure = Figure(figsize=(7.2, 3.9), layout="constrained")
    for axes, estimator in zip(
        figure.subplots(1, 2, sharey=True), _ESTIMATORS, strict=True
    ):
        for row, path in zip(rows, paths, strict=True):
            if row["case"] == f"{estimator}, configuration 5":
                axes.plot(*path[:, 1:3].T, color=_COLORS[estimator], lw=0.9)
                axes.plot(
                    row["beacon_x_m"],
                    row["beacon_y_m"],
                    "*",
                    color=GREEN,
                    ms=6,
                )
        axes.set_aspect("equal")
        axes.set_title(f"{estimator}, configuration 5", loc="left")
        axes.set_xlabel("x [m]")
    figure.axes[0].set_ylabel("y [m]")
    return figure


def draw_by_location(rows: Sequence[Row]) -> Figure:
    """Metrics at each target's place (Figure A.1)."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    metrics = list(_METRICS)[:2]
    figure = Figure(
        figsize=(2.0 * len(cases) / 2, 2.05 * 2 * len(metrics)),
        layout="constrained",
    )
    grid = figure.subplots(
        2 * len(metrics),
        len(cases) // 2,
        sharex=True,
        sharey=True,
        squeeze=False,
    )
    for level, metric in enumerate(metrics):
        top = np.percentile([row[metric] for row in rows], 98)
        for number, case in enumerate(cases):
            half, column = divmod(number, len(cases) // 2)
            axes = grid[2 * level + half, column]
            of_case = [row for row in rows if row["case"] == case]
            dots = axes.scatter(
                [row["beacon_x_m"] for row in of_case],
                [row["beacon_y_m"] for row in of_case],
                c=[row[metric] for row in of_case],
                s=16,
                cmap="viridis",
                vmin=0,
                vmax=top,
            )
            axes.set_aspect("equal")
            axes.set_title(
                case.replace("configuration", "conf."),
                loc="left",
                fontsize=8,
            )
        figure.colorbar(
            dots,
            ax=grid[2 * level : 2 * level + 2],
            label=_METRICS[metric],
            shrink=0.7,
        )
    return figure


def draw_by_distance(rows: Sequence[Row]) -> Figure:
    """Metrics against the distance from start to target (Figure A.2)."""
    figure = Figure(figsize=(7.2, 5.0), layout="constrained")
    for axes, (metric, label) in zip(
        figure.subplots(2, 2, sharex=True).flat, _METRICS.items(), strict=True
    ):
        for way in dict.fromkeys(map(_way, rows)):
            of_case = [
                row for row in rows if _way(row) == way and row["success"]
            ]
            axes.plot(
                [_straight(row) for row in of_case],
                [row[metric] for row in of_case],
                ".",
                ms=4,
                alpha=0.6,
                color=_COLORS[way],
                label=way,
            )
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0)
    for axes in figure.axes[-2:]:
        axes.set_xlabel("distance from start to target [m]")
    figure.axes[0].legend()
    return figure


def draw_house_example(rows: Sequence[Row], paths: Sequence[Array]) -> Figure:
    """The longest successful way, in every case (Figure 2.7)."""
    longest = max(
        (row for row in rows if row["success"]),
        key=_straight,
        default=rows[0],
    )
    figure = Figure(figsize=(6.5, 4.4), layout="constrained")
    axes = figure.add_subplot()
    draw_floor_plan(axes, load_world("small_house"))
    for row, path in zip(rows, paths, strict=True):
        if row["seed"] == longest["seed"]:
            axes.plot(
                *path[:, 1:3].T,
                color=_COLORS[row["case"]],
                lw=1.6,
                label=f"{row['case']}, {row['time_to_target_s']:.0f} s",
            )
    axes.plot(
        longest["start_x_m"],
        longest["start_y_m"],
        "o",
        color=GREY,
        label="start",
    )
    axes.plot(
        longest["beacon_x_m"],
        longest["beacon_y_m"],
        "*",
        color=GREEN,
        ms=12,
        label="beacon",
    )
    axes.autoscale()
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=4)
    return figure


def draw_house(rows: Sequence[Row], paths: Sequence[Array]) -> Figure:
    """All paths, a panel for each pair of rooms (Figure A.3)."""
    rooms = list(dict.fromkeys(row["start_room"] for row in rows))
    figure = Figure(
        figsize=(2.6 * len(rooms), 1.9 * len(rooms)), layout="constrained"
    )
    grid = figure.subplots(
        len(rooms), len(rooms), sharex=True, sharey=True, squeeze=False
    )
    world = load_world("small_house")
    for axes in grid.flat:
        draw_floor_plan(axes, world)
        axes.set_xlabel("")
        axes.set_ylabel("")
        axes.autoscale()
        axes.tick_params(labelsize=6)
    for row, path in zip(rows, paths, strict=True):
        if row["target_room"] not in rooms:
            continue
        axes = grid[
            rooms.index(row["start_room"]), rooms.index(row["target_room"])
        ]
        style = "-" if row["success"] else ":"
        axes.plot(*path[:, 1:3].T, style, color=_COLORS[row["case"]], lw=0.8)
        axes.plot(row["beacon_x_m"], row["beacon_y_m"], "*", color=GREEN, ms=4)
        if not row["success"]:
            axes.plot(*path[-1, 1:3], "x", color="#c5221f", ms=6)
    for axes, room in zip(grid[0], rooms, strict=True):
        axes.set_title(f"to {room}".replace("_", " "), fontsize=8)
    for axes, room in zip(grid[:, 0], rooms, strict=True):
        axes.set_ylabel(f"from {room}".replace("_", " "), fontsize=8)
    return figure


def draw_tau(rows: Sequence[Row]) -> Figure:
    """Goal position error against tau of (2.3), a line a configuration."""
    errors: dict[int, dict[float, list[float]]] = {}
    for row in rows:
        tau, number = row["case"].removeprefix("tau ").split(", configuration ")
        of_tau = errors.setdefault(int(number), {}).setdefault(float(tau), [])
        of_tau.append(row["goal_position_error_m"])
    return _draw_errors(errors, r"$\tau$ [readings]")


def draw_told(rows: Sequence[Row]) -> Figure:
    """Goal position error against the noise told, a line a true one."""
    errors: dict[int, dict[float, list[float]]] = {}
    for row in rows:
        number, told = (
            row["case"].removeprefix("configuration ").split(", told ")
        )
        of_told = errors.setdefault(int(number), {}).setdefault(
            0.0 if told == "none" else float(told), []
        )
        of_told.append(row["goal_position_error_m"])
    return _draw_errors(errors, "configuration told (0: none)")


def _draw_errors(
    errors: dict[int, dict[float, list[float]]], label: str
) -> Figure:
    """Mean errors [m] over a parameter, a line a configuration."""
    figure = Figure(figsize=(5.4, 3.4), layout="constrained")
    axes = figure.add_subplot()
    shades = mpl.colormaps["viridis"](np.linspace(0, 0.85, len(errors)))
    for shade, (number, by_value) in zip(
        shades, sorted(errors.items()), strict=True
    ):
        axes.plot(
            list(by_value),
            [np.mean(e) for e in by_value.values()],
            "o-",
            ms=3,
            color=shade,
            label=f"configuration {number}",
        )
    axes.set_xlabel(label)
    axes.set_ylabel("mean goal position error [m]")
    axes.set_ylim(bottom=0)
    axes.legend()
    return figure


def _way(row: Row) -> str:
    """A row's case, all configurations together."""
    case: str = row["case"]
    return case.split(", configuration")[0]


def _straight(row: Row) -> float:
    return float(
        np.hypot(
            row["beacon_x_m"] - row["start_x_m"],
            row["beacon_y_m"] - row["start_y_m"],
        )
    )
