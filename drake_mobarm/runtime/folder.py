"""Files of a run, and what the terminal says of it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from drake_mobarm.homing.report import describe_homing, draw_trajectory
from drake_mobarm.placement.report import (
    describe_placement,
    draw_map,
    write_squares,
)
from drake_mobarm.runtime.scenarios import dump_scenario
from drake_mobarm.runtime.simulation import Result


@dataclass(frozen=True)
class Report:
    """How runs of one diagram are shown.

    Attributes:
        picture: name of the picture's file.
        draw: draws it.
        describe: gives the figures that matter, each with its label.
        write_more: writes what else there is into a folder.
    """

    picture: str
    draw: Callable[[Result], Figure]
    describe: Callable[[Result], list[tuple[str, str]]]
    write_more: Callable[[Result, Path], None] = lambda result, folder: None


REPORTS = {
    "homing": Report("trajectory.png", draw_trajectory, describe_homing),
    "placement": Report("map.png", draw_map, describe_placement, write_squares),
}
"""By the diagram's name."""


def save_run(result: Result, folder: Path) -> None:
    """Writes a run's files: see the README for what is in them."""
    report = REPORTS[result.scenario.diagram]
    (folder / "summary.json").write_text(result.summary() + "\n")
    (folder / "scenario.yaml").write_text(dump_scenario(result.scenario))
    (folder / "diagram.dot").write_text(result.diagram_dot)
    # A dict would be typed as the other keywords of savez, too.
    np.savez_compressed(folder / "trace.npz", **result.trace)  # type: ignore[arg-type]
    report.draw(result).savefig(folder / report.picture)
    report.write_more(result, folder)
    if result.recording is not None:
        (folder / "recording.html").write_text(result.recording)


def describe_run(result: Result) -> str:
    """Verdict, reason, and the figures that matter, a line each."""
    verdict = "success" if result.success else "no success"
    lines = [f"{verdict}: {result.reason}"]
    for label, value in REPORTS[result.scenario.diagram].describe(result):
        lines.append(f"  {label:<16} {value}")
    return "\n".join(lines)
