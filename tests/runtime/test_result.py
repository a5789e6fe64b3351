"""What a run gives: its table, its folder, its words."""

import json
import sys

import numpy as np
import pandas as pd
import pytest

from drake_mobarm import load_scenario, run
from drake_mobarm.exceptions import OutputError


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


def test_a_recording_of_an_earlier_run_does_not_stay(result, tmp_path):
    (tmp_path / "recording.html").write_text("old")
    (tmp_path / "notes.txt").write_text("mine")
    result.save(tmp_path)
    assert not (tmp_path / "recording.html").exists()
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_files_of_an_earlier_run_of_another_job_do_not_stay(result, tmp_path):
    for name in ("map.png", "squares.csv"):
        (tmp_path / name).write_text("of a placement")
    result.save(tmp_path)
    assert not (tmp_path / "map.png").exists()
    assert not (tmp_path / "squares.csv").exists()
    assert (tmp_path / "trajectory.png").exists()


def test_a_run_is_saved_whole_or_not_at_all(result, tmp_path):
    (tmp_path / "trace.npz").mkdir()
    with pytest.raises(OutputError, match=r"trace\.npz is a folder"):
        result.save(tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["trace.npz"]


def test_a_folder_that_cannot_be_written_is_refused(result, tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(OutputError, match="cannot be written"):
        result.save(tmp_path / "file" / "run")


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
