"""A table's means, its folder, and what it refuses."""

import csv
import json
import math
import shlex
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from drake_mobarm import load_scenario
from drake_mobarm.exceptions import OutputError, ReportWarning
from drake_mobarm.homing.tables import TABLES
from drake_mobarm.job import Column, Trial
from drake_mobarm.runtime import tables as tables_module
from drake_mobarm.runtime.tables import reproduce, summarise
from helpers.refusals import assert_refused


def test_means_are_over_successes_and_success_over_all():
    def row(success, error):
        return {
            "case": "c",
            "success": success,
            "time_to_target_s": 10.0,
            "net_velocity_m_per_s": 0.5,
            "goal_position_error_m": error,
            "final_position_error_m": 0.2,
            "path_efficiency": 0.9,
            "contacts": 2.0,
        }

    table = TABLES["2.3"]
    (summary,) = summarise(
        table, [row(True, 0.1), row(True, 0.3), row(False, 9.0)]
    )
    assert summary["success_percent"] == pytest.approx(200 / 3)
    # Wilson's by hand: (p + z^2/2n -+ z sqrt(p(1-p)/n + z^2/4n^2))/(1 + z^2/n).
    p, n, z = 2 / 3, 3, 1.959964
    middle, factor = p + z**2 / (2 * n), 1 / (1 + z**2 / n)
    half = z * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert summary["success_interval_percent"] == pytest.approx(
        [100 * factor * (middle - half), 100 * factor * (middle + half)],
        rel=1e-5,
    )
    assert summary["mean_goal_position_error_m"] == pytest.approx(0.2)
    assert summary["contacts"] == 6
    assert summary["trials_with_contact"] == 3
    (nothing,) = summarise(table, [row(False, 1.0)])
    assert nothing["mean_goal_position_error_m"] is None


def test_the_table_does_not_depend_on_the_number_of_jobs(tmp_path):
    tables = []
    for jobs in (1, 2):
        folder = tmp_path / str(jobs)
        reproduce("2.3", folder, trials=1, jobs=jobs, seed=5)
        tables.append(
            [
                (folder / name).read_text()
                for name in ("table.json", "trials.csv", "table.md")
            ]
        )
        # 7.2 inches at the 200 dots an inch of all our pictures: PNG's header
        # has the width in its bytes 16 to 19.
        picture = (folder / "by_distance.png").read_bytes()
        assert int.from_bytes(picture[16:20], "big") == 1440
    assert tables[0] == tables[1]
    content = json.loads(tables[0][0])
    assert content["table"] == "2.3"
    assert content["trials"] == 1
    assert content["seed"] == 5
    assert len(content["rows"]) == 10
    assert content["rows"][4]["dissertation"]["success_percent"] == 100
    assert content["rows"][4]["dissertation"][
        "mean_goal_position_error_m"
    ] == pytest.approx(0.11)


@pytest.mark.parametrize(
    ("arguments", "refused"),
    [
        ({"name": "7.1"}, "unknown table '7.1'"),
        ({"name": "2.3", "trials": 0}, "trials"),
        ({"name": "2.3", "jobs": -1}, "jobs"),
        ({"name": "2.3", "seed": -1}, "seed"),
        ({"name": "2.3", "only": "none"}, "no case of table 2.3 holds 'none'"),
    ],
)
def test_impossible_sweeps_are_refused(arguments, refused, tmp_path):
    assert_refused(refused, reproduce, folder=tmp_path / "t", **arguments)
    assert not (tmp_path / "t").exists()


def test_a_sweep_does_not_go_on_where_the_scenarios_defaults_are_others(
    tmp_path, monkeypatch
):
    def fail(work):
        raise RuntimeError("power cut")

    def other_defaults(name, overrides=()):
        return load_scenario(name, ["filter.drift=0.01", *overrides])

    def go_on():
        reproduce("2.3", tmp_path, trials=1, jobs=1)

    monkeypatch.setattr(tables_module, "run_trial", fail)
    for _ in range(2):
        with pytest.raises(RuntimeError, match="power cut"):
            go_on()
    monkeypatch.setattr(tables_module, "load_scenario", other_defaults)
    with pytest.raises(OutputError, match="another sweep"):
        go_on()


@pytest.fixture
def one_trial(monkeypatch):
    """Table 2.3 with one trial of 0.2 s a case, in one process."""
    table = TABLES["2.3"]

    def trials(seed, count):
        for trial in table.make_trials(seed, 1):
            yield replace(trial, overrides=(*trial.overrides, "time_limit=0.2"))

    short = replace(table, make_trials=trials, draw=lambda rows, samples: {})
    tables = {"2.3": short}
    monkeypatch.setattr(tables_module, "find_tables", lambda: tables)
    return tables


def test_a_trial_that_raises_is_a_failure_with_its_cause(
    one_trial, tmp_path, monkeypatch
):
    real = tables_module.run

    def run(scenario, seed):
        if scenario.noise == 2:
            raise FloatingPointError("no\nluck")
        return real(scenario, seed)

    monkeypatch.setattr(tables_module, "run", run)
    drawn = []
    one_trial["2.3"] = replace(
        one_trial["2.3"],
        draw=lambda rows, samples: drawn.append((rows, samples)) or {},
    )
    content = reproduce("2.3", tmp_path, trials=1, jobs=1)
    assert len(content["rows"]) == 10
    with (tmp_path / "trials.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        raised = row["case"].endswith("configuration 2")
        assert (row["reason"] == "FloatingPointError: no luck") == raised
        assert (row["path_efficiency"] == "") == raised
        assert row["command"].startswith("mobarm run homing")
    assert sum("no luck" in row["reason"] for row in rows) == 2
    # Pictures are of the other trials.
    ((rows, samples),) = drawn
    assert len(rows) == len(samples) == 8


def test_pictures_that_fail_leave_the_table_and_are_told(one_trial, tmp_path):
    class Torn:
        def savefig(self, path):
            path.write_text("half")
            raise ValueError("torn")

    for draw, problem in (
        (lambda rows, samples: 1 / 0, "pictures failed: ZeroDivisionError"),
        (lambda rows, samples: {"a.png": Torn()}, "a.png failed: ValueError"),
    ):
        one_trial["2.3"] = replace(one_trial["2.3"], draw=draw)
        with pytest.warns(ReportWarning, match=problem):
            reproduce("2.3", tmp_path, trials=1, jobs=1)
        content = json.loads((tmp_path / "table.json").read_text())
        (told,) = content["problems"]
        assert told.startswith(problem)
        files = {"table.json", "table.md", "trials.csv"}
        assert set(content["files"]) == files
        assert {file.name for file in tmp_path.iterdir()} == files


def test_another_table_in_the_folder_is_not_replaced_unless_forced(
    one_trial, tmp_path
):
    reproduce("2.3", tmp_path, trials=1, jobs=1)
    with pytest.raises(OutputError, match="another result"):
        reproduce("2.3", tmp_path, trials=1, jobs=1, seed=1)
    reproduce("2.3", tmp_path, trials=1, jobs=1)
    content = reproduce("2.3", tmp_path, trials=1, jobs=1, seed=1, force=True)
    assert content["seed"] == 1


def test_another_sweep_that_was_begun_is_dropped_only_by_force(
    one_trial, tmp_path
):
    store = tmp_path / "finished.jsonl"
    store.write_text('{"sweep": {"table": "2.4"}}\n')
    with pytest.raises(OutputError, match="another sweep"):
        reproduce("2.3", tmp_path, trials=1, jobs=1)
    assert store.exists()
    reproduce("2.3", tmp_path, trials=1, jobs=1, force=True)
    assert not store.exists()


def test_a_table_of_some_cases_says_so_and_is_another_result(
    one_trial, tmp_path
):
    table = reproduce("2.3", tmp_path, jobs=1, only="filter, ")
    cases = [row["case"] for row in table["rows"]]
    assert cases == [f"filter, configuration {n}" for n in range(1, 6)]
    text = (tmp_path / "table.md").read_text()
    assert "--only 'filter, '" in text
    with pytest.raises(OutputError, match="another"):
        reproduce("2.3", tmp_path, jobs=1)


def row_of(case, success, time):
    return {"case": case, "success": success, "time": time}


TIMES = (
    Column("mean_time", "mean", "time"),
    Column("median_time", "median", "time", median=True),
)


def test_a_median_is_the_middle_of_the_successes():
    table = replace(TABLES["2.3"], columns=TIMES)
    (summary,) = summarise(
        table,
        [row_of("c", True, t) for t in (1.0, 2.0, 9.0)]
        + [row_of("c", False, 99.0)],
    )
    assert summary["mean_time"] == pytest.approx(4)
    assert summary["median_time"] == pytest.approx(2)


def test_compared_cases_are_averaged_over_what_all_of_a_group_solved():
    table = replace(
        TABLES["2.3"], columns=TIMES, group=lambda case: case.split()[0]
    )
    # Trials come task by task. The second task is not solved by "far b".
    rows = [
        row_of("far a", True, 1.0),
        row_of("far b", True, 3.0),
        row_of("near a", True, 5.0),
        row_of("far a", True, 100.0),
        row_of("far b", False, 200.0),
        row_of("near a", True, 7.0),
        row_of("far a", True, 2.0),
        row_of("far b", True, 5.0),
        row_of("near a", False, 300.0),
    ]
    far_a, far_b, near = summarise(table, rows)
    assert far_a["mean_time"] == pytest.approx(1.5)
    assert far_b["mean_time"] == pytest.approx(4)
    assert near["mean_time"] == pytest.approx(6)
    assert [x["trials_compared"] for x in (far_a, far_b, near)] == [2, 2, 2]
    assert far_a["success_percent"] == pytest.approx(100)
    assert far_b["success_percent"] == pytest.approx(200 / 3)


def half(seed, number):
    """Stands for an experiment that is a call of a law."""
    if number == 3:
        raise ArithmeticError("three is odd")
    return SimpleNamespace(
        success=True, reason="halved", metrics={"half": number / 2 + seed}
    )


def test_a_trial_may_be_a_call_and_its_command_repeats_it(
    tmp_path, monkeypatch
):
    table = replace(
        TABLES["2.3"],
        scenario="",
        call=half,
        make_trials=lambda seed, count: [
            Trial(case="c", seed=seed, notes={"number": n})
            for n in range(2, 2 + count)
        ],
        columns=(Column("mean_half", "half", "half"),),
        dissertation=lambda case: {},
        sample=lambda result: np.array([result.metrics["half"]]),
        draw=lambda rows, samples: {},
    )
    monkeypatch.setattr(tables_module, "find_tables", lambda: {"x": table})
    content = reproduce("x", tmp_path, trials=3, jobs=1, seed=10)
    (row,) = content["rows"]
    # 2 / 2 + 10 and 4 / 2 + 10; 3 fails.
    assert row["mean_half"] == pytest.approx(11.5)
    assert row["success_percent"] == pytest.approx(200 / 3)
    with (tmp_path / "trials.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["number"] for row in rows] == ["2", "3", "4"]
    assert rows[1]["reason"] == "ArithmeticError: three is odd"
    program, option, line = shlex.split(rows[2]["command"])
    assert (program, option) == ("python", "-c")
    assert line == (
        f"from {half.__module__} import half; print(half(seed=10, number=4))"
    )
