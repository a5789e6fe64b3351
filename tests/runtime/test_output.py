"""A result's folder: named by what was set, one result's alone."""

import json

import pytest

from drake_mobarm import cli
from drake_mobarm.exceptions import OutputError
from drake_mobarm.runtime.output import staged_folder

BLINK = ["--no-html", "--set", "world=empty", "--set", "time_limit=0.1"]
HOMING = ["run", "homing", *BLINK]
PLACEMENT = ["run", "placement", "--no-html", "--set", "world=empty"]
PICTURE = """
from matplotlib.figure import Figure
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from drake_mobarm.job import Report

REPORT = Report(
    picture="mine.png", draw=lambda run: Figure(), describe=lambda run: []
)


def build(scenario, *, seed, meshcat=None):
    builder = DiagramBuilder()
    one = builder.AddSystem(ConstantVectorSource([1.0]))
    builder.ExportOutput(one.get_output_port(), "done")
    return builder.Build()
"""


def names(folder):
    return {file.name for file in folder.iterdir()}


def setting(*values):
    return [word for value in values for word in ("--set", value)]


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ([], "homing-time_limit=0.1-world=empty-seed0"),
        (["--seed", "3"], "homing-time_limit=0.1-world=empty-seed3"),
        (setting("seed=4"), "homing-time_limit=0.1-world=empty-seed4"),
        (
            setting("noise=3", "noise=2", "beacon=[2, 1]"),
            "homing-beacon=2,1-noise=2-time_limit=0.1-world=empty-seed0",
        ),
    ],
)
def test_a_folder_is_named_by_what_was_set(
    arguments, name, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    cli.main([*HOMING, *arguments])
    assert names(tmp_path / "runs") == {name}


def test_a_name_is_short_however_much_was_set(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for rays in (360, 361):
        many = [f"station.lidar.rays={rays}", "station.lidar.noise=0.02"]
        many += ["controller.alignment=0.4", "station.beacon.dropout=0.1"]
        cli.main([*HOMING, *setting(*many)])
    folders = names(tmp_path / "runs")
    assert len(folders) == 2
    assert all(len(name) < 90 for name in folders)


def test_the_same_scenario_and_seed_are_written_anew(tmp_path):
    for _ in range(2):
        assert cli.main([*HOMING, "--out", str(tmp_path)]) == 1


@pytest.mark.parametrize(
    "other",
    [
        [*HOMING, "--seed", "1"],
        [*HOMING, "--set", "noise=2"],
        PLACEMENT,
        ["reproduce", "2.3", "--trials", "1", "--jobs", "1"],
    ],
)
def test_another_result_is_not_replaced_unless_it_is_forced(
    other, tmp_path, capsys
):
    cli.main([*HOMING, "--out", str(tmp_path)])
    before = {file: file.read_bytes() for file in tmp_path.iterdir()}
    capsys.readouterr()
    assert cli.main([*other, "--out", str(tmp_path)]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert "holds another result" in output.err
    assert "--force" in output.err
    assert {f: f.read_bytes() for f in tmp_path.iterdir()} == before


def test_forced_a_result_takes_the_place_of_another_whole(tmp_path):
    (tmp_path / "mine.py").write_text(PICTURE)
    (tmp_path / "mine.yaml").write_text("diagram: mine.py\n")
    out = tmp_path / "out"
    common = {"summary.json", "scenario.yaml", "trace.npz", "diagram.dot"}
    own = ["run", str(tmp_path / "mine.yaml"), "--no-html"]
    for run, shown in (
        (own, {"mine.png"}),
        (HOMING, {"trajectory.png"}),
        (PLACEMENT, {"map.png", "squares.csv"}),
        (own, {"mine.png"}),
    ):
        assert cli.main([*run, "--out", str(out), "--force"]) in (0, 1)
        assert names(out) == common | shown


def test_files_of_others_are_left_alone_and_run_beside_only_by_force(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    assert cli.main([*HOMING, "--out", "."]) == 2
    assert "holds other files" in capsys.readouterr().err
    assert names(tmp_path) == {"notes.txt"}
    assert cli.main([*HOMING, "--out", ".", "--force"]) == 1
    assert names(tmp_path) > {"notes.txt", "summary.json"}
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_what_an_index_lists_is_removed_from_its_folder_only(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "mine.txt").write_text("mine")
    listed = ["../mine.txt", str(tmp_path / "mine.txt"), "..", 3, "old.txt"]
    index = tmp_path / "out" / "summary.json"
    for files in (listed, listed[:3] + listed[4:]):
        (tmp_path / "out" / "old.txt").write_text("old")
        index.write_text(json.dumps({"files": files}))
        cli.main([*HOMING, "--out", str(tmp_path / "out"), "--force"])
        assert (tmp_path / "mine.txt").read_text() == "mine"
    assert "old.txt" not in names(tmp_path / "out")


def test_two_at_once_do_not_write_one_folder(tmp_path, capsys):
    out = tmp_path / "deep" / "out"
    with staged_folder(out, lambda folder: True) as stage:
        assert cli.main([*HOMING, "--out", str(out)]) == 2
        assert "another run" in capsys.readouterr().err
        (stage / "first.txt").write_text("whole")
    assert names(out) == {"first.txt"}
    assert cli.main([*HOMING, "--out", str(out), "--force"]) == 1


def test_what_a_killed_run_left_is_cleared_away(tmp_path):
    stage = tmp_path / ".mobarm-stage-killed"
    stage.mkdir()
    (stage / "half.txt").write_text("half")
    (tmp_path / ".mobarm-lock").write_text("")
    assert cli.main([*HOMING, "--out", str(tmp_path)]) == 1
    assert not [name for name in names(tmp_path) if name.startswith(".")]


def test_work_that_fails_leaves_no_folder_behind(tmp_path):
    def fail():
        with staged_folder(tmp_path / "a" / "b", lambda folder: True) as stage:
            (stage / "half.txt").write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert names(tmp_path) == set()


def test_a_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("mine")
    for folder in (tmp_path / "file", tmp_path / "file" / "run"):
        with (
            pytest.raises(OutputError, match=f"{folder} cannot be written"),
            staged_folder(folder, lambda folder: True),
        ):
            raise AssertionError("reached")
    assert (tmp_path / "file").read_text() == "mine"
