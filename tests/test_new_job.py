"""A new job is one folder and one pair in diagrams/; no shared file knows it.

The package is copied, a toy job is put into the copy, and the copy's command
line is used as a person would.
"""

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import drake_mobarm

PACKAGE = Path(drake_mobarm.__file__).parent

JOB = '''
"""Counting: a toy."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drake_mobarm.checks import positive
from drake_mobarm.job import Job, Trace, Verdict


@dataclass(kw_only=True)
class CountingScenario:
    """Count up to a number.

    Attributes:
        diagram: the diagram that this scenario is for.
        goal: to count to.
        time_limit: after which it ends [s].
    """

    diagram: str = "counting"
    goal: float
    time_limit: float = 5.0

    def __post_init__(self) -> None:
        positive(self, "goal", "time_limit")


def judge(
    scenario: CountingScenario, trace: Trace, outputs: Mapping[str, Any]
) -> Verdict:
    reached, luck = (float(trace[name][-1, 0]) for name in ("count", "luck"))
    done = bool(outputs["done"][0] > 0.5)
    metrics = {"reached": reached, "luck": luck}
    return Verdict(done, f"counted to {reached:g}", metrics)


JOB = Job(name="counting", scenario=CountingScenario, judge=judge)
'''

SYSTEMS = '''
"""Counting as a LeafSystem."""

from pydrake.systems.framework import LeafSystem


class Counter(LeafSystem):
    """Counts one a second, from 0 up."""

    def __init__(self, goal):
        super().__init__()
        self._goal = goal
        self.DeclareVectorOutputPort("count", 1, self._count)
        self.DeclareVectorOutputPort("reached", 1, self._tell)

    def _count(self, context, output):
        output.SetFromVector([context.get_time()])

    def _tell(self, context, output):
        output.SetFromVector([float(context.get_time() >= self._goal)])
'''

REPORT = '''
"""What a run of the toy shows."""

from matplotlib.figure import Figure

from drake_mobarm.job import Report


def draw(run):
    figure = Figure()
    figure.add_subplot().plot(run.trace["t"], run.trace["count"])
    return figure


REPORT = Report(
    picture="count.png",
    draw=draw,
    describe=lambda run: [("counted", f"{run.metrics['reached']:g}")],
)
'''

TABLES = '''
"""The toy's experiment."""

from drake_mobarm.job import Column, Table, Trial


def trials(seed, count):
    for index in range(count):
        for case in ("near", "far"):
            goal = {"near": 0.2, "far": 0.4}[case] + 0.1 * index
            yield Trial(
                case=case,
                seed=100 * seed + index + 7,
                overrides=(f"goal={goal}",),
            )


TABLES = {
    "counts": Table(
        title="Counting",
        conditions="None.",
        scenario="counting",
        trials=2,
        make_trials=trials,
        columns=[Column("mean_reached", "reached", "reached")],
        dissertation=lambda case: {"mean_reached": 1.0},
        sample=lambda run: run.trace["count"],
        draw=lambda rows, samples: {},
    )
}
'''

DIAGRAM = '''
"""Counting: a counter, and what luck its run has."""

import numpy as np
from pydrake.systems.primitives import ConstantVectorSource

from drake_mobarm.counting.systems import Counter
from drake_mobarm.diagrams.wiring import NO_BLOCKS, Wiring


def build_job(scenario, *, blocks=NO_BLOCKS):
    """Wires the counter."""
    wiring = Wiring(blocks)
    wiring.add(
        "counter", lambda: Counter(scenario.goal), {"count": 1, "reached": 1}
    )
    wiring.export("count", "reached")
    return wiring.build("counting")


def build(scenario, *, seed=0, meshcat=None, blocks=NO_BLOCKS):
    """Wires the counter, with its log."""
    wiring = Wiring()
    wiring.add("job", lambda: build_job(scenario, blocks=blocks))
    luck = np.random.default_rng(seed).random()
    wiring.add_primitive("luck", ConstantVectorSource([luck]), "luck")
    wiring.export(done="reached")
    wiring.log("count", "luck")
    return wiring.build("counting")
'''

FILES = {
    "counting/__init__.py": '"""A toy."""\n',
    "counting/job.py": JOB,
    "counting/systems.py": SYSTEMS,
    "counting/report.py": REPORT,
    "counting/tables.py": TABLES,
    "diagrams/counting.py": DIAGRAM,
    "diagrams/counting.yaml": "diagram: counting\ngoal: 1.0\n",
}


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A folder that holds the package with the toy in it."""
    folder = tmp_path_factory.mktemp("copy")
    package = folder / "drake_mobarm"
    shutil.copytree(
        PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__")
    )
    for name, text in FILES.items():
        file = package / name
        assert not file.exists(), "the toy must not touch a shared file"
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
    return folder


def luck(seed):
    """What the toy draws by a seed."""
    return np.random.default_rng(seed).random()


def mobarm(copy, *arguments, code=0):
    """What the copy's command prints, run in its folder."""
    done = subprocess.run(
        [sys.executable, "-m", "drake_mobarm", *arguments],
        cwd=copy,
        env=os.environ | {"PYTHONPATH": str(copy)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, done.stderr
    return done.stdout + done.stderr


def test_a_new_job_is_listed_with_its_table(copy):
    listed = mobarm(copy, "list")
    assert "scenarios: counting, homing, navigation, placement" in listed
    assert "counts" in listed


def test_a_new_job_is_run_judged_and_shown(copy):
    shown = mobarm(
        copy, "run", "counting", "--no-html", "--out", "run", "--seed", "5"
    )
    assert "success: counted to 1" in shown
    assert shown.strip().endswith("count.png")
    summary = json.loads((copy / "run" / "summary.json").read_text())
    assert summary["scenario"] == "counting"
    assert summary["seed"] == 5
    assert summary["metrics"] == {"reached": 1.0, "luck": luck(5)}
    trace = np.load(copy / "run" / "trace.npz")
    np.testing.assert_allclose(trace["count"][:, 0], trace["t"])
    assert (copy / "run" / "count.png").stat().st_size > 1000


def test_a_new_jobs_failure_is_told_by_its_judge(copy):
    shown = mobarm(
        copy,
        *("run", "counting", "--no-html", "--out", "late"),
        *("--set", "goal=9", "--set", "time_limit=0.5"),
        code=1,
    )
    assert "no success: counted to 0.5" in shown


def test_a_new_jobs_bad_input_is_one_line_that_names_it(copy):
    shown = mobarm(copy, "run", "counting", "--set", "gaol=3", code=2)
    assert shown.strip() == (
        "mobarm: counting: unknown key gaol: valid are diagram, goal, "
        "time_limit"
    )


def test_a_new_job_is_drawn(copy):
    assert "counter" in mobarm(copy, "draw", "counting")


def test_a_new_jobs_table_is_reproduced_with_commands_that_repeat_it(copy):
    shown = mobarm(
        copy,
        *("reproduce", "counts", "--jobs", "1", "--seed", "3", "--out", "t"),
    )
    # Two of two: Wilson's interval, by hand.
    assert "| near | 100 | 34 to 100 | 0.250 (1) |" in shown
    assert json.loads((copy / "t" / "table.json").read_text())["seed"] == 3
    with (copy / "t" / "trials.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["seed"] for row in rows] == ["307", "307", "308", "308"]
    for row in rows:
        assert float(row["luck"]) == luck(int(row["seed"]))
    command = rows[2]["command"].split()
    assert command[:3] == ["mobarm", "run", "counting"]
    mobarm(copy, *command[1:], "--no-html", "--out", "again")
    summary = json.loads((copy / "again" / "summary.json").read_text())
    assert summary["seed"] == 308
    for metric, value in summary["metrics"].items():
        assert value == float(rows[2][metric])
