"""What came out of a run, and its folder."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from drake_mobarm.exceptions import OutputError
from drake_mobarm.job import Job, RunRecord, find_job, job_names
from drake_mobarm.runtime.output import staged_folder
from drake_mobarm.runtime.scenarios import dump_record
from drake_mobarm.signals import element_names

RECORDING = "recording.html"


def run_files() -> list[str]:
    """Files that a run may leave in its folder and another run has not."""
    files = [RECORDING]
    for name in job_names():
        report = find_job(name).report
        if report is not None:
            files += [report.picture, *report.more_files]
    return files


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

    def summary(self) -> str:
        """The run in JSON; a metric without a value is null."""
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
            },
            indent=2,
        )

    def describe(self) -> str:
        """Verdict, reason, and the figures that matter, a line each."""
        verdict = "success" if self.success else "no success"
        lines = [f"{verdict}: {self.reason}"]
        if self.job.report is not None:
            for label, value in self.job.report.describe(self):
                lines.append(f"  {label:<16} {value}")
        return "\n".join(lines)

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

    def save(self, folder: str | Path) -> Path:
        """Writes the run's folder, whole or not at all.

        Args:
            folder: where to write; made where it is missing. Files of an
                earlier run there are replaced.

        Returns:
            The file to look at first.

        Raises:
            OutputError: the folder cannot be written.
        """
        with staged_folder(Path(folder), run_files()) as stage:
            self.write(stage)
        return Path(folder) / self.first_file

    @property
    def first_file(self) -> str:
        """Of the run's folder, the file to look at first."""
        if self.recording is not None:
            return RECORDING
        report = self.job.report
        return "summary.json" if report is None else report.picture

    def write(self, folder: Path) -> None:
        """Writes the run's files into a folder, which has to be there."""
        (folder / "summary.json").write_text(self.summary() + "\n")
        (folder / "scenario.yaml").write_text(
            dump_record(self.scenario, self.seed)
        )
        (folder / "diagram.dot").write_text(self.diagram_dot)
        # A dict would be typed as the other keywords of savez, too.
        np.savez_compressed(folder / "trace.npz", **self.trace)  # type: ignore[arg-type]
        report = self.job.report
        if report is not None:
            report.draw(self).savefig(folder / report.picture)
            report.write_more(self, folder)
        if self.recording is not None:
            (folder / RECORDING).write_text(self.recording)
