"""`mobarm reproduce`: a table's trials, and its folder."""

import csv
import io
import json
import platform
import shlex
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from drake_mobarm.checks import require
from drake_mobarm.exceptions import ParameterError
from drake_mobarm.job import Table, Trial, find_tables
from drake_mobarm.runtime.output import staged_folder
from drake_mobarm.runtime.scenarios import dump_scenario, load_scenario
from drake_mobarm.runtime.simulation import run
from drake_mobarm.runtime.sweep import Outcome, run_sweep

Row = dict[str, Any]


def reproduce(
    name: str,
    folder: Path,
    *,
    trials: int | None = None,
    jobs: int | None = None,
    seed: int = 0,
    dask: str | None = None,
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
        dask: address of a Dask scheduler to work on.

    Returns:
        What is in `table.json`.

    Raises:
        ParameterError: there is no such table, or a number is out of range.
        OutputError: the folder cannot be written or holds another sweep.
    """
    tables = find_tables()
    if name not in tables:
        raise ParameterError(
            f"unknown table {name!r}: valid are {', '.join(tables)}"
        )
    table = tables[name]
    count = table.trials if trials is None else trials
    require(count >= 1, "trials", count, "1 or more")
    require(jobs is None or jobs >= 1, "jobs", jobs, "1 or more")
    require(seed >= 0, "seed", seed, "0 or more")
    todo = list(table.make_trials(seed, count))
    identity = {"table": name, "trials": count, "seed": seed}
    base = dump_scenario(load_scenario(table.scenario))
    store = folder / "finished.jsonl"
    with staged_folder(folder) as stage:
        outcomes = run_sweep(
            [{"trial": n, "table": name, "do": t} for n, t in enumerate(todo)],
            run_trial,
            store,
            {**identity, "scenario": base},
            jobs,
            dask,
        )
        rows = [outcome["row"] for outcome in outcomes]
        content = {
            **identity,
            "versions": _versions(),
            "rows": [
                {**summary, "dissertation": table.dissertation(summary["case"])}
                for summary in summarise(table, rows)
            ],
        }
        (stage / "table.json").write_text(json.dumps(content, indent=2) + "\n")
        (stage / "table.md").write_text(to_markdown(table, content))
        (stage / "trials.csv").write_text(to_csv(rows))
        samples = [np.array(outcome["sample"]) for outcome in outcomes]
        for file, figure in table.draw(rows, samples).items():
            figure.savefig(stage / file)
    store.unlink()  # Done: another run is to start anew.
    return content


def run_trial(work: Mapping[str, Any]) -> Outcome:
    """Runs one trial of a table.

    Args:
        work: "trial", its number; "table", the table's name; "do", a Trial.

    Returns:
        "row", what is known of it; "sample", what pictures need of it.
    """
    table, trial = find_tables()[work["table"]], work["do"]
    result = run(load_scenario(table.scenario, trial.overrides), trial.seed)
    row = {
        "trial": work["trial"],
        "case": trial.case,
        "seed": trial.seed,
        **trial.notes,
        "success": result.success,
        "reason": result.reason,
        **result.metrics,
        "command": command(table, trial),
    }
    return {"row": row, "sample": np.round(table.sample(result), 4).tolist()}


def command(table: Table, trial: Trial) -> str:
    """The command that repeats a trial."""
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
    for case in dict.fromkeys(row["case"] for row in rows):
        of_case = [row for row in rows if row["case"] == case]
        successes = [row for row in of_case if row["success"]]
        summary: Row = {
            "case": case,
            "trials": len(of_case),
            "success_percent": 100 * len(successes) / len(of_case),
        }
        for column in table.columns:
            counted = of_case if column.trials_with else successes
            values = [row[column.metric] for row in counted]
            if column.trials_with:
                summary[column.name] = float(sum(values))
                summary[column.trials_with] = sum(value > 0 for value in values)
            else:
                mean = float(np.mean(values)) if values else None
                summary[column.name] = mean
        summaries.append(summary)
    return summaries


def to_csv(rows: Sequence[Row]) -> str:
    """The rows as CSV, one a trial."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def to_markdown(table: Table, content: Mapping[str, Any]) -> str:
    """The table for people: ours, the dissertation's in brackets."""
    heads = ["case", "success [%]", *(c.heading for c in table.columns)]
    lines = [
        f"# {table.title}",
        "",
        f"{content['trials']} trials a case, seed {content['seed']}; means "
        "over successful trials; the dissertation's figures in brackets. "
        + table.conditions,
        "",
        f"    mobarm reproduce {content['table']} --trials "
        f"{content['trials']} --seed {content['seed']}",
        "",
        ", ".join(f"{k} {v}" for k, v in content["versions"].items()),
        "",
        f"| {' | '.join(heads)} |",
        f"| --- |{' ---: |' * (len(heads) - 1)}",
    ]
    for row in content["rows"]:
        cells = [row["case"], _cell(row, "success_percent", 0)]
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
