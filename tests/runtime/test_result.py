"""What a run gives: its table, its folder, its words."""

import json
import sys
import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from drake_mobarm import load_scenario, run
from drake_mobarm.exceptions import OutputError, ReportWarning
from drake_mobarm.job import Job, Report


@pytest.fixture(scope="module")
def result():
    overrides = ["world=empty", "avoidance=none", "start=[0, 0, 0]"]
    overrides += ["beacon=[5, 3]", "time_limit=0.4"]
    return run(load_scenario("homing", overrides), seed=2)


def test_the_frame_has_a_row_a_sample_and_a_column_an_element(result):
    frame = result.to_frame()
    assert isinstance(frame, pd.DataFrame)
    assert frame.index.name == "t_s"
    np.testing.assert_array_equal(frame.index, result.trace["t"])
    np.testing.assert_array_equal(
        frame["measured_base_pose.yaw"],
        result.trace["measured_base_pose"][:, 2],
    )
    np.testing.assert_array_equal(
        frame["beacon_reading.rssi"], result.trace["beacon_reading"][:, 1]
    )
    elements = sum(
        values.shape[1] for name, values in result.trace.items() if name != "t"
    )
    assert frame.shape == (len(result.trace["t"]), elements)


def test_a_frame_without_pandas_says_what_to_install(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(OutputError, match=r"drake_mobarm\[frames\]"):
        result.to_frame()


def test_a_result_saves_itself_and_tells_what_to_open(result, tmp_path):
    shown = result.save(tmp_path / "deep" / "run")
    assert shown == tmp_path / "deep" / "run" / "trajectory.png"
    assert shown.stat().st_size > 10_000
    saved = {file.name for file in shown.parent.iterdir()}
    assert saved == {
        "diagram.dot",
        "scenario.yaml",
        "summary.json",
        "trace.npz",
        "trajectory.png",
    }
    summary = json.loads((shown.parent / "summary.json").read_text())
    assert summary["seed"] == 2
    assert load_scenario(str(shown.parent / "scenario.yaml")) == result.scenario


def test_a_run_is_saved_whole_or_not_at_all(result, tmp_path):
    (tmp_path / "trace.npz").mkdir()
    with pytest.raises(OutputError, match=r"trace\.npz is a folder"):
        result.save(tmp_path, force=True)
    assert [file.name for file in tmp_path.iterdir()] == ["trace.npz"]


def test_a_folder_that_cannot_be_written_is_refused(result, tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(OutputError, match="cannot be written"):
        result.save(tmp_path / "file" / "run")


REPORTS = {
    "nothing": ([], {"picture.png", "more.csv"}),
    "draw": (["picture.png failed: ZeroDivisionError"], {"more.csv"}),
    "more": (["report failed: ZeroDivisionError"], {"picture.png"}),
    "all": (["report failed: ZeroDivisionError"], set()),
}


class Broken(Job):
    """A job whose report cannot even be found."""

    @property
    def report(self):
        return 1 / 0


@pytest.mark.parametrize("broken", REPORTS)
def test_a_report_that_fails_leaves_the_result_and_says_so(
    result, tmp_path, broken
):
    def draw(run):
        figure = Figure()
        figure.add_subplot().plot([1, 2], [3, 1 / (broken != "draw")])
        return figure

    def write_more(run, folder):
        (folder / "more.csv").write_text("half")
        1 / (broken != "more")

    report = Report(
        picture="picture.png",
        draw=draw,
        describe=lambda run: [],
        write_more=write_more,
    )
    job = Job(
        name="broken",
        scenario=result.job.scenario,
        module=SimpleNamespace(REPORT=report),
    )
    if broken == "all":
        job = Broken(name="broken", scenario=result.job.scenario)
    problems, files = REPORTS[broken]
    files |= {"summary.json", "scenario.yaml", "trace.npz", "diagram.dot"}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        shown = replace(result, job=job).save(tmp_path)
    assert shown.exists()
    assert {file.name for file in tmp_path.iterdir()} == files
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert set(summary["files"]) == files
    told = [str(w.message) for w in caught if w.category is ReportWarning]
    assert told == summary["problems"]
    assert len(told) == len(problems)
    for line, start in zip(told, problems, strict=True):
        assert line.startswith(start)


def test_figures_that_cannot_be_told_do_not_hide_the_verdict(result):
    words = replace(
        result, job=Broken(name="b", scenario=result.job.scenario)
    ).describe()
    assert words.splitlines() == [
        "no success: time limit of 0.4 s reached",
        "figures failed: ZeroDivisionError: division by zero",
    ]


def test_a_run_without_any_estimate_is_kept_and_drawn(tmp_path):
    overrides = ["world=empty", "start=[0, 0, 0]", "beacon=[5, 3]"]
    overrides += ["time_limit=0.4", "station.beacon.outages=[[0, 100]]"]
    silent = run(load_scenario("homing", overrides))
    picture = silent.save(tmp_path)
    assert picture.name == "trajectory.png"
    assert picture.stat().st_size > 10_000
    assert json.loads((tmp_path / "summary.json").read_text())["problems"] == []
    assert "no estimate" in silent.describe()


def test_the_words_are_verdict_reason_and_figures(result):
    lines = result.describe().splitlines()
    assert lines[0] == "no success: time limit of 0.4 s reached"
    assert [line.split("  ")[1].strip() for line in lines[1:]] == [
        "time",
        "estimate off by",
        "robot to beacon",
        "path",
        "contacts",
    ]
