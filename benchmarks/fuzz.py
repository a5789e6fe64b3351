"""Random scenarios and faulty sensors: whatever comes, homing has to hold.

    python benchmarks/fuzz.py [--scenarios 2000] [--faults 60] [--seed 0]
        [--only TEXT] [--jobs 1] [--out FILE.md]

A random scenario has to give a MobarmError of one line, or a run whose
commands are finite and whose result can be saved (a tenth of them is). Each
fault, with either estimator and every avoidance, has to leave a run without an
exception, whose commands are finite and whose result can be saved, and which
never arrives more than 0.5 m from the beacon. Without avoidance the floor is
empty, else it is the small house.

Trials are saved in runs/ as they finish: the same command goes on where it was
interrupted. A trial of more than 20 s (scenarios) or 120 s (faults) is stopped,
and told, but no violation. Exit code 1 where there are violations, each with
what repeats it.
"""

import argparse
import itertools
import sys
from typing import Any

from common import parse, publish
from faults import FAULTS
from fuzz_trials import do_trial
from homing_sweep import WORKING, Row, command, run_or_go_on
from random_scenarios import make_scenario, write_worlds

from drake_mobarm.homing.job import AVOIDANCES, ESTIMATORS

LONGEST_COMMAND = 600  # Characters; a few values have thousands.
OPEN_FLOOR = ("world=empty", "start=[0, 0, 0.5]", "beacon=[5, 3]")
HOUSE = ("start=[-2, -3, 0.5]", "beacon=[3.5, 3]")


def make_trials(options: argparse.Namespace) -> list[Row]:
    """Every scenario, then every fault in every combination."""
    folder = WORKING / "fuzz"
    write_worlds(folder)
    trials = [
        make_scenario(options.seed, number, folder)
        for number in range(options.scenarios)
    ]
    combinations = itertools.product(
        list(FAULTS)[: options.faults], ESTIMATORS, AVOIDANCES
    )
    for fault, estimator, avoidance in combinations:
        overrides = [
            *(OPEN_FLOOR if avoidance == "none" else HOUSE),
            "time_limit=60",
            f"estimator={estimator}",
            f"avoidance={avoidance}",
        ]
        trials.append(
            {
                "name": f"{fault}, {estimator}, {avoidance}",
                "fault": fault,
                "job": "homing",
                "seed": options.seed,
                "overrides": overrides,
            }
        )
    chosen = [trial for trial in trials if options.only in trial["name"]]
    return [{**trial, "trial": n} for n, trial in enumerate(chosen)]


def repeat(row: Row, options: argparse.Namespace) -> str:
    """What repeats a trial."""
    if "fault" not in row and len(command(row["job"], row)) < LONGEST_COMMAND:
        return command(row["job"], row)
    return (
        f"python benchmarks/fuzz.py --seed {options.seed} "
        f"--only '{row['name']}'"
    )


def main() -> None:
    """Runs what is missing, prints and writes what it found."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--scenarios", type=int, default=2000)
    parser.add_argument("--faults", type=int, default=len(FAULTS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="trials with this text only")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    options = parse(parser)
    rows = run_or_go_on("fuzz", make_trials(options), do_trial, options.jobs)
    lines = [
        "| trials | number | refused | success | no success | stopped | "
        "violations | wall time [s] | a trial [s] |",
        "| --- |" + " ---: |" * 8,
    ]
    for kind in ("scenario", "fault"):
        of_kind = [row for row in rows if ("fault" in row) == (kind == "fault")]
        cells: list[Any] = [f"{kind}s", len(of_kind)]
        for end in ("refused", "success", "no success", "stopped"):
            cells.append(sum(row["end"] == end for row in of_kind))
        cells.append(sum(bool(row["violations"]) for row in of_kind))
        spent = sum(row["spent_s"] for row in of_kind)
        cells += [f"{spent:.0f}", f"{spent / max(len(of_kind), 1):.2f}"]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    lines.append("")
    for row in rows:
        told = row["violations"] + ["stopped"] * (row["end"] == "stopped")
        for text in told:
            line = " ".join(text.split())[:300]
            lines.append(f"- {row['name']}: {line}: `{repeat(row, options)}`")
    publish(lines, rows, options.out)
    sys.exit(any(row["violations"] for row in rows))


if __name__ == "__main__":
    main()
