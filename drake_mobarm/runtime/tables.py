"""`mobarm reproduce`: a table's trials, and its folder."""

import csv
import io
import json
import platform
import shlex
import warnings
from collections.abc import Mapping, Sequence
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from drake_mobarm.checks import check_seed, require, shown
from drake_mobarm.exceptions import ParameterError, ReportWarning
from drake_mobarm.job import Table, Trial, find_tables
from drake_mobarm.runtime.output import kept, staged_folder, writing
from drake_mobarm.runtime.scenarios import dump_scenario, load_scenario
from drake_mobarm.runtime.simulation import run
from drake_mobarm.runtime.sweep import Outcome, run_sweep

Row = dict[str, Any]

STORE = "finished.jsonl"
"""The file of a sweep's finished trials."""


def reproduce(
    name: str,
    folder: Path,
    *,
    trials: int | None = None,
    jobs: int | None = None,
    seed: int = 0,
    only: str | None = None,
    dask: str | None = None,
    force: bool = False,
) -> dict[str, Any]:
    """Runs a table's experiment and writes its folder.

    The folder gets `table.json`, `table.md`, `trials.csv` and pictures; until
    they are there, `finished.jsonl` keeps what has been done.

    Args:
        name: of the table.
        folder: where to write, and to go on from.
        trials: how many a case; None for the table's own number.
        jobs: processes; None for one a core.
        seed: of all trials.
        only: of the cases, those whose names hold this text; None for all.
        dask: address of a Dask scheduler to work on.
        force: whether to replace another result in the folder.

    Returns:
        What is in `table.json`.

    Raises:
        ParameterError: there is no such table or case, or a number is out of
            range.
        OutputError: the folder cannot be written, is being written, or holds
            another result or sweep.
    """
    tables = find_tables()
    if name not in tables:
        raise ParameterError(
            f"unknown table {shown(name)}: valid are {', '.join(tables)}"
        )
    table = tables[name]
    count = table.trials if trials is None else trials
    require(1 <= count <= 10_000, "trials", count, "1 to 10000")
    require(jobs is None or 1 <= jobs <= 1000, "jobs", jobs, "1 to 1000")
    check_seed(seed)
    todo = list(table.make_trials(seed, count))
    identity = {"table": name, "trials": count, "seed": seed, "only": only}
    if only is not None:
        cases = "; ".join(dict.fromkeys(trial.case for trial in todo))
        todo = [trial for trial in todo if only in trial.case]
        if not todo:
            raise ParameterError(
                f"no case of table {name} holds {shown(only)}: valid are "
                f"parts of {cases}"
            )
    base = None
    if table.call is None:
        base = dump_scenario(load_scenario(table.scenario))
    store = folder / STORE
    same = partial(_holds_table, identity)
    with staged_folder(folder, same, force) as stage:
        outcomes = run_sweep(
            [{"trial": n, "table": name, "do": t} for n, t in enumerate(todo)],
            run_trial,
            store,
            {**identity, "scenario": base},
            jobs,
            dask,
            force,
        )
        rows = [outcome["row"] for outcome in outcomes]
        problems = _draw(table, outcomes, stage)
        content = {
            **identity,
            "versions": _versions(),
            "rows": [
                {**summary, "dissertation": table.dissertation(summary["case"])}
                for summary in summarise(table, rows)
            ],
        }
        with writing(f"output folder {folder}"):
            (stage / "table.md").write_text(to_markdown(table, content))
            (stage / "trials.csv").write_text(to_csv(rows))
            files = ["table.json", *(file.name for file in stage.iterdir())]
            content |= {"files": sorted(files), "problems": problems}
            text = json.dumps(content, indent=2) + "\n"
            (stage / "table.json").write_text(text)
    store.unlink()  # Done: another run is to start anew.
    return content


def _draw(table: Table, outcomes: Sequence[Outcome], folder: Path) -> list[str]:
    """Draws a table's pictures, of the trials that ran to an end.

    Returns:
        What could not be drawn, and why.
    """
    ran = [outcome for outcome in outcomes if outcome["sample"] is not None]
    rows = [outcome["row"] for outcome in ran]
    samples = [np.array(outcome["sample"]) for outcome in ran]
    problems: list[str] = []
    with kept(problems, "pictures", folder):
        for file, figure in table.draw(rows, samples).items():
            with kept(problems, file, folder):
                figure.savefig(folder / file)
    for problem in problems:
        warnings.warn(problem, ReportWarning, stacklevel=2)
    return problems


def _holds_table(identity: Mapping[str, Any], folder: Path) -> bool:
    """Whether a folder holds this table, or no more than finished trials."""
    try:
        content = json.loads((folder / "table.json").read_bytes())
        return bool(identity.items() <= content.items())
    except (OSError, ValueError, AttributeError):
        others = {file.name for file in folder.iterdir()} - {STORE}
        return all(name.startswith(".") for name in others)


def run_trial(work: Mapping[str, Any]) -> Outcome:
    """Runs one trial of a table; an exception is a failure with its cause.

    Args:
        work: "trial", its number; "table", the table's name; "do", a Trial.

    Returns:
        "row", what is known of it; "sample", what pictures need of it, None
        where it raised an exception.
    """
    table, trial = find_tables()[work["table"]], work["do"]
    sample: list[Any] | None = None
    try:
        result = _run(table, trial)
        found = {"success": result.success, "reason": result.reason}
        found |= result.metrics
        sample = np.round(table.sample(result), 4).tolist()
    except Exception as error:
        line = f"{type(error).__name__}: {' '.join(str(error).split())}"
        found = {"success": False, "reason": line}
    row = {
        "trial": work["trial"],
        "case": trial.case,
        "seed": trial.seed,
        **trial.notes,
        **found,
        "command": command(table, trial),
    }
    return {"row": row, "sample": sample}


def _run(table: Table, trial: Trial) -> Any:
    if table.call is not None:
        return table.call(seed=trial.seed, **trial.notes)
    return run(load_scenario(table.scenario, trial.overrides), trial.seed)


def command(table: Table, trial: Trial) -> str:
    """The command that repeats a trial."""
    if table.call is not None:
        name = table.call.__name__
        given = {"seed": trial.seed, **trial.notes}
        arguments = ", ".join(
            f"{key}={value!r}" for key, value in given.items()
        )
        line = (
            f"from {table.call.__module__} import {name}; "
            f"print({name}({arguments}))"
        )
        return shlex.join(["python", "-c", line])
    words = ["mobarm", "run", table.scenario, "--seed", str(trial.seed)]
    for override in trial.overrides:
        words += ["--set", override]
    return shlex.join(words)


def _versions() -> dict[str, str]:
    packages = ("drake_mobarm", "drake", "numpy", "scipy")
    return {"python": platform.python_version()} | {
        package: version(package) for package in packages
    }


def summarise(table: Table, rows: Sequence[Row]) -> list[Row]:
    """A row a case: success over all trials, and the table's columns."""
    summaries = []
    by_case: dict[str, list[Row]] = {}
    for row in rows:
        by_case.setdefault(row["case"], []).append(row)
    for case, of_case in by_case.items():
        successes = sum(row["success"] for row in of_case)
        compared = _compared(table, by_case, case)
        summary: Row = {
            "case": case,
            "trials": len(of_case),
            "success_percent": 100 * successes / len(of_case),
            "success_interval_percent": _interval(successes, len(of_case)),
        }
        if table.group is not None:
            summary["trials_compared"] = len(compared)
        for column in table.columns:
            counted = of_case if column.trials_with else compared
            values = [
                row[column.metric] for row in counted if column.metric in row
            ]
            if column.trials_with:
                summary[column.name] = float(sum(values))
                summary[column.trials_with] = sum(value > 0 for value in values)
            else:
                average = np.median if column.median else np.mean
                summary[column.name] = (
                    float(average(values)) if values else None
                )
        summaries.append(summary)
    return summaries


def _compared(
    table: Table, by_case: Mapping[str, Sequence[Row]], case: str
) -> list[Row]:
    """The trials of a case that its means are over."""
    group = table.group
    cases = [case]
    if group is not None:
        cases = [other for other in by_case if group(other) == group(case)]
    tasks = zip(*(by_case[other] for other in cases), strict=True)
    return [
        row
        for row, task in zip(by_case[case], tasks, strict=True)
        if all(other["success"] for other in task)
    ]


def _interval(successes: int, trials: int) -> list[float]:
    """Where the success rate lies in 95 of 100 such tables [%] (Wilson)."""
    # Half a second to import, for a table alone.
    from scipy.stats import binomtest

    interval = binomtest(successes, trials).proportion_ci(method="wilson")
    return [100 * float(interval.low), 100 * float(interval.high)]


def to_csv(rows: Sequence[Row]) -> str:
    """The rows as CSV, one a trial."""
    text = io.StringIO()
    # A trial that raised an exception has no metrics.
    columns = max((list(row) for row in rows), key=len)
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def to_markdown(table: Table, content: Mapping[str, Any]) -> str:
    """The table for people: ours, the dissertation's in brackets."""
    only = ""
    if content["only"] is not None:
        only = f" --only {shlex.quote(content['only'])}"
    over = "successful trials"
    if table.group is not None:
        over = "trials in which all compared cases succeed"
    heads = [
        "case",
        "success [%]",
        "interval [%]",
        *(c.heading for c in table.columns),
    ]
    lines = [
        f"# {table.title}",
        "",
        f"{content['trials']} trials a case, seed {content['seed']}; the "
        "interval of the success rate is Wilson's, of 95 %; means are over "
        f"{over}; the dissertation's figures in brackets. " + table.conditions,
        "",
        f"    mobarm reproduce {content['table']} --trials "
        f"{content['trials']} --seed {content['seed']}{only}",
        "",
        ", ".join(f"{k} {v}" for k, v in content["versions"].items()),
        "",
        f"| {' | '.join(heads)} |",
        f"| --- |{' ---: |' * (len(heads) - 1)}",
    ]
    for row in content["rows"]:
        low, high = row["success_interval_percent"]
        interval = f"{low:.0f} to {high:.0f}"
        cells = [row["case"], _cell(row, "success_percent", 0), interval]
        for column in table.columns:
            cell = _cell(row, column.name, column.digits)
            if column.trials_with:
                cell += f" in {row[column.trials_with]} trials"
            cells.append(cell)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _cell(row: Row, column: str, digits: int) -> str:
    value, theirs = row[column], row["dissertation"].get(column)
    cell = "-" if value is None else f"{value:.{digits}f}"
    return cell if theirs is None else f"{cell} ({theirs:g})"
