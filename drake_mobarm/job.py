"""What a job is, and which jobs there are.

A job is one thing that the robot does. It is a folder of this package with a
`job.py`, whose `JOB` is a `Job`; its wiring is `diagrams/<name>.py`, and its
shipped scenario `diagrams/<name>.yaml`. Nobody lists the jobs: they are found.
Three more files of the folder are looked for when they are needed:

- `view.py`: `set_stage(meshcat, scenario)` sets light and camera;
- `report.py`: `REPORT`, a `Report`, shows a run;
- `tables.py`: `TABLES`, a `Table` by each name, repeats experiments.
"""

import importlib
import importlib.util
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drake_mobarm.geometry import Array

_PATH_PERIOD = 0.5

Trace = Mapping[str, Array]
"""A run's logs: `t` (n,) [s], and (n, size) for each signal by its name."""


class Verdict(NamedTuple):
    """Whether the robot did its job, why or why not, and by what figures.

    Attributes:
        success: whether it did.
        reason: one line.
        metrics: name to number, SI units in the name.
    """

    success: bool
    reason: str
    metrics: dict[str, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class RunRecord:
    """What a run leaves behind, for reports and tables.

    Attributes:
        scenario: as it was run.
        seed: of all noise.
        success: whether the robot did its job.
        reason: why, or why not.
        simulated_s: simulated time [s].
        wall_s: time that it took [s], building not included.
        metrics: name to number, SI units in the name.
        trace: `t` (n,) and a signal's (n, size) each.
        outputs: the diagram's outputs at the end, by name.
    """

    scenario: Any = field(repr=False)
    seed: int
    success: bool
    reason: str
    simulated_s: float
    wall_s: float
    metrics: dict[str, float]
    trace: dict[str, Array] = field(repr=False)
    outputs: dict[str, Any] = field(repr=False)

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds a second."""
        return self.simulated_s / self.wall_s


def write_nothing(run: RunRecord, folder: Path) -> None:
    """What a report writes that has no more than its picture."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """How a run of a job is shown.

    Attributes:
        picture: name of the picture's file.
        draw: draws it, as a matplotlib Figure.
        describe: gives the figures that matter, each with its label.
        write_more: writes what else there is into a folder.
    """

    picture: str
    draw: Callable[[RunRecord], Any]
    describe: Callable[[RunRecord], list[tuple[str, str]]]
    write_more: Callable[[RunRecord, Path], None] = write_nothing


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One run of a table: `mobarm run` repeats it by seed and overrides.

    Attributes:
        case: the row of the table that it belongs to.
        seed: of all noise.
        overrides: "key.path=value" each, of the table's scenario.
        notes: further columns of its row in `trials.csv`; the arguments of
            the table's `call` where it has one.
    """

    case: str
    seed: int
    overrides: Sequence[str] = ()
    notes: Mapping[str, Any] = field(default_factory=dict)


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        name: in `table.json`.
        heading: for people.
        metric: of the runs, a metric's name.
        digits: after the point.
        trials_with: where the column is a sum over all trials, the name of
            the number of trials in which it is above 0; empty where it is a
            mean over the successful ones.
        median: whether it is a median instead of a mean.
    """

    name: str
    heading: str
    metric: str
    digits: int = 3
    trials_with: str = ""
    median: bool = False


@dataclass(frozen=True, kw_only=True)
class Table:
    """An experiment of many trials, and what the dissertation got.

    Attributes:
        title: what it is.
        conditions: what the trials are, where the text leaves it open.
        scenario: the shipped scenario that trials override; empty where they
            are no runs, but calls.
        trials: full number of trials a case.
        make_trials: gives every case's trials for a seed and a number.
        columns: after the success rate.
        dissertation: the dissertation's figures of a case, by column; those
            of the success rate as `success_percent`.
        sample: what pictures need of a run beside its row: an array, kept to
            four digits after the point.
        draw: gives the pictures, matplotlib Figures by file name, of the
            rows of `trials.csv` and the samples.
        call: what a trial calls, with its seed and notes as keywords, where it
            is no run of a scenario: a module's function, whose result has
            `success`, `reason` and `metrics`, and goes to `sample`.
        group: gives the group of a case where means are over the trials in
            which all cases of its group succeed. The n-th trials of a group's
            cases are then the same task.
    """

    title: str
    conditions: str
    scenario: str
    trials: int
    make_trials: Callable[[int, int], Iterator[Trial]]
    columns: Sequence[Column]
    dissertation: Callable[[str], Mapping[str, float]]
    sample: Callable[[Any], Array]
    draw: Callable[
        [Sequence[dict[str, Any]], Sequence[Array]], Mapping[str, Any]
    ]
    call: Callable[..., Any] | None = None
    group: Callable[[str], str] | None = None


def sample_path(run: RunRecord) -> Array:
    """What pictures of a table need of a run, every half second.

    Args:
        run: whose trace has `ground_truth` and `estimated_target`.

    Returns:
        (n, 5): time [s], the robot's x and y, the estimate's x and y [m].
    """
    trace = run.trace
    stride = round(_PATH_PERIOD / (trace["t"][1] - trace["t"][0]))
    kept = np.unique(
        np.append(np.arange(0, len(trace["t"]), stride), len(trace["t"]) - 1)
    )
    path: Array = np.column_stack(
        [
            trace["t"],
            trace["ground_truth"][:, :2],
            trace["estimated_target"][:, :2],
        ]
    )[kept]
    return path


def judge_by_done(
    scenario: Any, trace: Trace, outputs: Mapping[str, Any]
) -> Verdict:
    """The verdict where a diagram has no judge: whether it ended by itself."""
    if outputs["done"][0] > 0.5:
        return Verdict(True, "done", {})
    reason = f"time limit of {scenario.time_limit:g} s reached"
    return Verdict(False, reason, {})


def no_places(scenario: Any) -> Sequence[Any]:
    """The places of a scenario that has no world."""
    return ()


@dataclass(frozen=True, kw_only=True)
class Job:
    """What the rest of the library needs to know of a job.

    Attributes:
        name: of its folder and its diagram.
        scenario: the dataclass of its scenarios, with a `diagram` and a
            `time_limit` [s].
        places: the places (`Place`) of a scenario that are checked against
            its world; none where it has no world.
        judge: tells the verdict, from the scenario, the trace, and the
            diagram's outputs at the end, by name.
        module: of a job that is not of this package: what has its `build`,
            and any of the names that its other files would have.
    """

    name: str
    scenario: type[Any]
    places: Callable[[Any], Sequence[Any]] = no_places
    judge: Callable[[Any, Trace, Mapping[str, Any]], Verdict] = judge_by_done
    module: Any = None

    def find(self, part: str, name: str) -> Any:
        """A name of one of the job's optional modules, None without it."""
        if self.module is not None:
            return getattr(self.module, name, None)
        module = f"drake_mobarm.{self.name}.{part}"
        if importlib.util.find_spec(module) is None:
            return None
        return getattr(importlib.import_module(module), name)

    @property
    def build(self) -> Callable[..., Any]:
        """Builds its diagram: `build(scenario, *, seed, meshcat, blocks)`."""
        module = self.module or importlib.import_module(
            f"drake_mobarm.diagrams.{self.name}"
        )
        build: Callable[..., Any] = module.build
        return build

    @property
    def report(self) -> Report | None:
        """How its runs are shown, if it tells."""
        report: Report | None = self.find("report", "REPORT")
        return report


def job_names() -> list[str]:
    """The names of all jobs: the folders that hold a `job.py`."""
    here = Path(__file__).parent
    return sorted(file.parent.name for file in here.glob("*/job.py"))


def find_job(name: str) -> Job:
    """The job of a name, which is one of `job_names()`."""
    job: Job = importlib.import_module(f"drake_mobarm.{name}.job").JOB
    return job


def find_tables() -> dict[str, Table]:
    """The tables of all jobs, by their names."""
    tables: dict[str, Table] = {}
    for name in job_names():
        tables |= find_job(name).find("tables", "TABLES") or {}
    return tables


def spawn_seeds(seed: int) -> tuple[int, int]:
    """Spawns a run's seed.

    Returns:
        The seed of the noise that a diagram is built with, and that of the
        noise in its context.
    """
    built, noise = np.random.SeedSequence(seed).generate_state(2)
    return int(built), int(noise)
