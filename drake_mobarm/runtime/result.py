"""What came out of a run, and its folder."""

import json
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from drake_mobarm.exceptions import OutputError, ReportWarning
from drake_mobarm.job import Job, RunRecord
from drake_mobarm.runtime.output import kept, staged_folder, writing
from drake_mobarm.runtime.scenarios import VERSION, dump_record
from drake_mobarm.signals import element_names

RECORDING = "recording.html"
RECORD = "scenario.yaml"


@dataclass(frozen=True, kw_only=True, eq=False)
class Result(RunRecord):
    """What came out of a run.

    Attributes:
        job: what was run.
        recording: self-contained HTML, if asked for.
        diagram_dot: the block diagram in DOT.
    """

    job: Job = field(repr=False)
    recording: str | None = field(repr=False)
    diagram_dot: str = field(repr=False)

    def summary(
        self, files: Sequence[str] = (), problems: Sequence[str] = ()
    ) -> str:
        """The run in JSON; a metric without a value is null.

        Args:
            files: that belong to it.
            problems: what could not be shown of it, and why.
        """
        metrics = {
            name: float(value)
            if value is not None and np.isfinite(value)
            else None
            for name, value in self.metrics.items()
        }
        return json.dumps(
            {
                "scenario": self.scenario.diagram,
                "seed": self.seed,
                "success": bool(self.success),
                "reason": self.reason,
                "simulated_s": self.simulated_s,
                "wall_s": self.wall_s,
                "real_time_factor": self.real_time_factor,
                "metrics": metrics,
                "files": sorted(files),
                "problems": list(problems),
            },
            indent=2,
        )

    def describe(self) -> str:
        """Verdict, reason, and the figures that matter, a line each."""
        verdict = "success" if self.success else "no success"
        lines = [f"{verdict}: {self.reason}"]
        problems: list[str] = []
        with kept(problems, "figures"):
            if self.job.report is not None:
                for label, value in self.job.report.describe(self):
                    lines.append(f"  {label:<16} {value}")
        return "\n".join([*lines, *problems])

    def to_frame(self) -> Any:
        """The trace as a pandas DataFrame: a row a sample, indexed by time.

        Columns are `signal.element`, or `signal.0` and so on where the
        library has no names for its elements.

        Raises:
            OutputError: pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise OutputError(
                "to_frame needs pandas: pip install 'drake_mobarm[frames]'"
            ) from error
        columns = {
            f"{signal}.{element}": values[:, index]
            for signal, values in self.trace.items()
            if signal != "t"
            for index, element in enumerate(
                element_names(signal, values.shape[1])
            )
        }
        return pd.DataFrame(
            columns, index=pd.Index(self.trace["t"], name="t_s")
        )

    def save(self, folder: str | Path, *, force: bool = False) -> Path:
        """Writes the run's folder, whole or not at all.

        A picture that cannot be drawn is left out, with a warning.

        Args:
            folder: where to write; made where it is missing. An earlier
                result of the same scenario and seed there is replaced.
            force: whether to replace another result, and to write beside
                files of other kinds.

        Returns:
            The file to look at first.

        Raises:
            OutputError: the folder cannot be written, is being written, or
                holds something else.
        """
        folder = Path(folder)
        record = dump_record(self.scenario, self.seed)
        with (
            staged_folder(folder, holds_run(record), force) as stage,
            writing(f"output folder {folder}"),
        ):
            return folder / self.write(stage)

    def write(self, folder: Path) -> str:
        """Writes the run's files into a folder, which has to be empty.

        Returns:
            The name of the file to look at first.
        """
        problems: list[str] = []
        record = dump_record(self.scenario, self.seed)
        (folder / RECORD).write_text(record)
        (folder / "diagram.dot").write_text(self.diagram_dot)
        # A dict would be typed as the other keywords of savez, too.
        np.savez_compressed(folder / "trace.npz", **self.trace)  # type: ignore[arg-type]
        if self.recording is not None:
            (folder / RECORDING).write_text(self.recording)
        shown = RECORDING if self.recording is not None else "summary.json"
        with kept(problems, "report"):
            report = self.job.report
            if report is not None:
                with kept(problems, report.picture, folder):
                    report.draw(self).savefig(folder / report.picture)
                    if self.recording is None:
                        shown = report.picture
                with kept(problems, "report", folder):
                    report.write_more(self, folder)
        for problem in problems:
            warnings.warn(problem, ReportWarning, stacklevel=2)
        files = [file.name for file in folder.iterdir()]
        summary = self.summary([*files, "summary.json"], problems)
        (folder / "summary.json").write_text(summary + "\n")
        return shown


def holds_run(record: str) -> Callable[[Path], bool]:
    """Tells whether a folder holds a run of the same scenario and seed."""

    def same(folder: Path) -> bool:
        try:
            there = (folder / RECORD).read_text()
        except (OSError, ValueError):
            return False
        return _setting(there) == _setting(record)

    return same


def _setting(record: str) -> list[str]:
    """What a record says but the version."""
    return [
        line
        for line in record.splitlines()
        if not line.startswith(f"{VERSION}:")
    ]
