"""`mobarm reproduce`: the tables there are, and a table's folder."""

import csv
import io
import json
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from drake_mobarm.checks import require
from drake_mobarm.exceptions import ParameterError
from drake_mobarm.experiments import homing
from drake_mobarm.runtime.output import staged_folder
from drake_mobarm.runtime.scenarios import dump_scenario, load_scenario
from drake_mobarm.runtime.sweep import Outcome, Trial, run_sweep

Row = dict[str, Any]

_MEANS = {
    "mean_time_to_target_s": "time_to_target_s",
    "mean_net_velocity_m_per_s": "net_velocity_m_per_s",
    "mean_goal_position_error_m": "goal_position_error_m",
    "mean_final_position_error_m": "final_position_error_m",
    "mean_path_efficiency": "path_efficiency",
}
_COLUMNS = ("success_percent", *_MEANS, "contacts")


@dataclass(frozen=True, kw_only=True)
class Table:
    """An experiment: its trials, and what the dissertation got.

    Attributes:
        title: what it is.
        conditions: what the trials are, where the text leaves it open.
        trials: full number of trials a case.
        make_trials: gives every case's trials for a seed and a number.
        do_trial: runs one.
        dissertation: the dissertation's figures of a case, by its name.
    """

    title: str
    conditions: str
    trials: int
    make_trials: Callable[[int, int], Iterator[dict[str, Any]]]
    do_trial: Callable[[Trial], Outcome]
    dissertation: Callable[[str], Mapping[str, float]]


def _table_2_3(case: str) -> dict[str, float]:
    columns = {
        "1": (100, 14.24, 0.62, 0.05, 0.25, 0.90),
        "2": (100, 12.68, 0.57, 0.05, 0.24, 0.88),
        "3": (100, 12.10, 0.60, 0.06, 0.25, 0.90),
        "4": (100, 12.85, 0.60, 0.06, 0.25, 0.89),
        "5": (100, 12.27, 0.57, 0.11, 0.15, 0.91),
    }
    return dict(zip(_COLUMNS, columns[case[-1]], strict=False))


def _table_2_4(case: str) -> dict[str, float]:
    return dict(
        zip(_COLUMNS, (96, 44.91, 0.22, 0.12, 0.23, 0.69), strict=False)
    )


_DEFINITIONS = (
    "A run ends at the first check (0.05 s) after the estimator says that it "
    "has arrived; errors are against the true position of the beacon, "
    "odometry's drift included."
)
_OPEN_SPACE = (
    "The same targets for every case, at least 1 m from the start. "
    + _DEFINITIONS
)
_HOUSE = (
    "Start and target are where a disc of 0.28 m radius can stand, on the "
    "house's connected floor, at least 1 m apart. " + _DEFINITIONS
)

TABLES: dict[str, Table] = {
    "2.3": Table(
        title="Table 2.3: homing in open space",
        conditions=_OPEN_SPACE,
        trials=40,
        make_trials=homing.open_space_trials,
        do_trial=homing.do_trial,
        dissertation=_table_2_3,
    ),
    "2.4": Table(
        title="Table 2.4: homing in the small house, configuration 5",
        conditions=_HOUSE,
        trials=80,
        make_trials=homing.house_trials,
        do_trial=homing.do_trial,
        dissertation=_table_2_4,
    ),
    "tau": Table(
        title="Choosing tau of (2.3), for the hybrid estimator",
        conditions=_OPEN_SPACE,
        trials=20,
        make_trials=homing.tau_trials,
        do_trial=homing.do_trial,
        dissertation=_table_2_3,
    ),
}


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

    The folder gets `table.json`, `table.md`, `trials.csv` and figures; until
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
    if name not in TABLES:
        raise ParameterError(
            f"unknown table {name!r}: valid are {', '.join(TABLES)}"
        )
    table = TABLES[name]
    count = table.trials if trials is None else trials
    require(count >= 1, "trials", count, "1 or more")
    require(jobs is None or jobs >= 1, "jobs", jobs, "1 or more")
    require(seed >= 0, "seed", seed, "0 or more")
    todo = [
        {"trial": number, **trial}
        for number, trial in enumerate(table.make_trials(seed, count))
    ]
    identity = {"table": name, "trials": count, "seed": seed}
    store = folder / "finished.jsonl"
    with staged_folder(folder) as stage:
        outcomes = run_sweep(
            todo,
            table.do_trial,
            store,
            {**identity, "scenario": dump_scenario(load_scenario("homing"))},
            jobs,
            dask,
        )
        rows = [outcome["row"] for outcome in outcomes]
        content = {
            **identity,
            "versions": _versions(),
            "rows": [
                {**summary, "dissertation": table.dissertation(summary["case"])}
                for summary in summarise(rows)
            ],
        }
        (stage / "table.json").write_text(json.dumps(content, indent=2) + "\n")
        (stage / "table.md").write_text(to_markdown(table, content))
        (stage / "trials.csv").write_text(to_csv(rows))
        from drake_mobarm.homing.table_pictures import draw_figures

        draw_figures(name, rows, [o["path"] for o in outcomes], stage)
    store.unlink()  # Done: another run is to start anew.
    return content


def _versions() -> dict[str, str]:
    packages = ("drake_mobarm", "drake", "numpy", "scipy")
    return {"python": platform.python_version()} | {
        package: version(package) for package in packages
    }


def summarise(rows: Sequence[Row]) -> list[Row]:
    """A row a case: success over all trials, means over its successes."""
    summaries = []
    for case in dict.fromkeys(row["case"] for row in rows):
        of_case = [row for row in rows if row["case"] == case]
        successes = [row for row in of_case if row["success"]]
        means = {
            mean: float(np.mean([row[metric] for row in successes]))
            if successes
            else None
            for mean, metric in _MEANS.items()
        }
        summaries.append(
            {
                "case": case,
                "trials": len(of_case),
                "success_percent": 100 * len(successes) / len(of_case),
                **means,
                "contacts": sum(row["contacts"] for row in of_case),
                "trials_with_contact": sum(
                    row["contacts"] > 0 for row in of_case
                ),
            }
        )
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
    heads = (
        "case",
        "success [%]",
        "time [s]",
        "net velocity [m/s]",
        "goal position error [m]",
        "final position error [m]",
        "path efficiency",
        "contacts",
    )
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
        f"| --- |{' ---: |' * len(_COLUMNS)}",
    ]
    for row in content["rows"]:
        cells = [row["case"]]
        for column in _COLUMNS:
            value, theirs = row[column], row["dissertation"].get(column)
            digits = 0 if column in ("success_percent", "contacts") else 3
            cell = "-" if value is None else f"{value:.{digits}f}"
            cells.append(cell if theirs is None else f"{cell} ({theirs:g})")
        cells[-1] += f" in {row['trials_with_contact']} trials"
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"
