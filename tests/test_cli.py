"""The command line: exit codes, folders, and one line for bad input."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from drake_mobarm import Result, __version__, cli

BLINK = ["--set", "world=empty", "--set", "time_limit=0.3"]
FILES = {
    "summary.json",
    "scenario.yaml",
    "trace.npz",
    "trajectory.png",
    "diagram.dot",
}
BOX = """<sdf version="1.9"><model name="m"><static>true</static>
<link name="l"><collision name="bunny"><geometry><mesh><uri>bunny.obj</uri>
</mesh></geometry></collision></link></model></sdf>"""

OWN = """
import numpy as np
from drake_mobarm.diagrams.wiring import Wiring
from pydrake.systems.primitives import ConstantVectorSource


def build(scenario, *, seed, meshcat=None):
    wiring = Wiring()
    luck = np.random.default_rng(seed).random()
    wiring.add_primitive("luck", ConstantVectorSource([luck]), "luck")
    wiring.add_primitive("end", ConstantVectorSource([1.0]), "end")
    wiring.log("luck")
    wiring.export(done="end")
    return wiring.build("own")
"""


def test_a_run_that_fails_still_writes_its_whole_folder(tmp_path, capsys):
    out = tmp_path / "deep" / "run"
    code = cli.main(["run", "homing", "--out", str(out), *BLINK])
    assert code == 1
    assert {f.name for f in out.iterdir()} == FILES | {"recording.html"}
    summary = json.loads((out / "summary.json").read_text())
    assert summary["success"] is False
    assert "time limit" in summary["reason"]
    assert summary["simulated_s"] == pytest.approx(0.3)
    assert set(summary) == {
        "scenario",
        "seed",
        "success",
        "reason",
        "simulated_s",
        "wall_s",
        "real_time_factor",
        "metrics",
        "files",
        "problems",
    }
    assert set(summary["files"]) == FILES | {"recording.html"}
    assert summary["problems"] == []
    assert "<html" in (out / "recording.html").read_text()[:2000].lower()
    trace = np.load(out / "trace.npz")
    assert trace["ground_truth"].shape == (len(trace["t"]), 7)
    scenario = yaml.safe_load((out / "scenario.yaml").read_text())
    assert scenario["world"] == "empty"
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == f"open {out / 'recording.html'}"


def test_a_run_that_arrives_exits_with_0(tmp_path):
    code = cli.main(
        [
            *["run", "homing", "--no-html", "--out", str(tmp_path / "r")],
            *["--set", "world=empty", "--set", "start=[0, 0, 0]"],
            *["--set", "beacon=[1.5, 0.2]", "--set", "noise=1"],
        ]
    )
    assert code == 0
    assert {f.name for f in (tmp_path / "r").iterdir()} == FILES
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    assert summary["success"] is True


def traces(*folders):
    return [dict(np.load(folder / "trace.npz")) for folder in folders]


@pytest.mark.parametrize("job", ["homing", "placement", "own"])
def test_a_run_is_repeated_to_the_bit_from_its_folder(
    job, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").write_text(OWN)
    (tmp_path / "own.yaml").write_text("diagram: own.py\n")
    scenario = "own.yaml" if job == "own" else job
    settings = [] if job == "own" else ["--set", "world=empty"]
    if job == "homing":
        settings += ["--set", "noise=3", "--set", "time_limit=0.3"]
    first, again = tmp_path / "first", tmp_path / "again"
    run = ["run", scenario, "--no-html", "--seed", "7", "--out", str(first)]
    code = cli.main([*run, *settings])
    record = str(first / "scenario.yaml")
    run = ["run", record, "--no-html"]
    assert cli.main([*run, "--out", str(again)]) == code
    for one, other in (traces(first, again),):
        assert one.keys() == other.keys() > {"t"}
        for name, values in one.items():
            np.testing.assert_array_equal(values, other[name])
    assert (again / "scenario.yaml").read_text() == Path(record).read_text()
    assert json.loads((again / "summary.json").read_text())["seed"] == 7
    # Where no folder is named, it is called as the run that it repeats.
    cli.main(run)
    assert (tmp_path / "runs" / "first-seed7" / "trace.npz").exists()
    # A seed that is given goes before the file's.
    cli.main([*run, "--seed", "8"])
    summary = tmp_path / "runs" / "first-seed8" / "summary.json"
    assert json.loads(summary.read_text())["seed"] == 8
    assert "drake_mobarm" not in capsys.readouterr().err


def test_a_record_of_another_version_runs_and_says_so(tmp_path, capsys):
    run = ["run", "homing", "--no-html", *BLINK]
    cli.main([*run, "--out", str(tmp_path / "a")])
    record = tmp_path / "a" / "scenario.yaml"
    record.write_text(
        re.sub(r"drake_mobarm: .*", "drake_mobarm: 0.0.1", record.read_text())
    )
    capsys.readouterr()
    again = ["run", str(record), "--no-html", "--out", str(tmp_path / "b")]
    assert cli.main(again) == 1
    told = capsys.readouterr().err.splitlines()
    (line,) = [line for line in told if line.startswith("mobarm:")]
    assert "0.0.1" in line
    assert __version__ in line


def test_list_names_scenarios_worlds_and_tables(capsys):
    assert cli.main(["list"]) == 0
    out = capsys.readouterr().out
    for name in ("homing", "small_house", "bookstore", "cafe", "2.3", "2.4"):
        assert name in out


def test_draw_writes_dot(tmp_path, capsys):
    assert cli.main(["draw", "homing"]) == 0
    assert capsys.readouterr().out.startswith("digraph")
    file = tmp_path / "homing.dot"
    assert cli.main(["draw", "homing", "--out", str(file)]) == 0
    assert "estimator" in file.read_text()


def bad_world(folder):
    file = folder / "mesh.sdf"
    file.write_text(BOX)
    return ["run", "homing", "--set", f"world={file}"]


def bad_yaml(folder):
    file = folder / "broken.yaml"
    file.write_text("start: [1, 2")
    return ["run", str(file)]


def blocked_out(folder):
    file = folder / "file"
    file.write_text("mine")
    return ["run", "homing", *BLINK, "--out", str(file / "run")]


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (bad_yaml, ["broken.yaml", "parse"]),
        (bad_world, ["bunny", "mesh", "box"]),
        (blocked_out, ["output folder", "file"]),
        (["run", "nowhere"], ["nowhere", "homing"]),
        (["run", "homing", "--set", "nose=5"], ["nose", "noise"]),
        (["run", "homing", "--set", "noise=6"], ["noise", "6"]),
        (["run", "homing", "--set", "noise=x"], ["noise", "int"]),
        (["run", "homing", "--set", "world=mars"], ["mars", "cafe"]),
        (["run", "homing", "--set", "start=[30,0,0]"], ["outside"]),
        (["run", "homing", "--set", "start=[-6,2,0]"], ["inside"]),
        (["run", "homing", "--set", "beacon=[.nan,0]"], ["beacon", "nan"]),
        (["run", "homing", "--seed", "-1"], ["--seed", "-1"]),
        (["run", "homing", "--seed", "one"], ["--seed", "one"]),
        (["reproduce", "2.3", "--trials", "-3"], ["--trials", "-3"]),
        (["reproduce", "2.3", "--jobs", "0"], ["--jobs", "0"]),
        (["reproduce", "9.9"], ["9.9", "2.3", "2.4"]),
        (["draw", "nowhere"], ["nowhere"]),
        (["draw", "homing", "--out", "h.png"], ["h.png", ".dot", ".svg"]),
        (["run", "missing.yaml"], ["missing.yaml", "no such file"]),
        (["run", "homing", "--seed", str(2**63)], ["seed", "2**63"]),
        (["dance"], ["dance", "run"]),
        ([], ["COMMAND"]),
    ],
)
def test_bad_input_is_one_clear_line_and_exit_code_2(
    arguments, names, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    if callable(arguments):
        arguments = arguments(tmp_path)
    before = set(tmp_path.rglob("*"))
    try:
        code = cli.main(arguments)
    except SystemExit as exit_:
        code = exit_.code
    assert code == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert len(output.err.strip().splitlines()) == 1
    for name in names:
        assert name in output.err
    assert set(tmp_path.rglob("*")) == before


def test_an_interrupted_run_leaves_nothing_behind(
    tmp_path, capsys, monkeypatch
):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "run", interrupt)
    out = tmp_path / "run"
    assert cli.main(["run", "homing", "--out", str(out)]) == 130
    assert list(tmp_path.iterdir()) == []
    assert capsys.readouterr().err.strip() == "mobarm: interrupted"


def test_a_failed_write_leaves_nothing_behind(tmp_path, monkeypatch):
    def full(result, folder):
        (folder / "summary.json").write_text("{")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Result, "write", full)
    out = tmp_path / "run"
    code = cli.main(["run", "homing", "--no-html", "--out", str(out), *BLINK])
    assert code == 2
    assert not out.exists()
    assert list(tmp_path.iterdir()) == []


def test_a_recording_of_an_earlier_run_does_not_stay(tmp_path):
    run = ["run", "homing", "--out", str(tmp_path), *BLINK]
    cli.main(run)
    (tmp_path / "notes.txt").write_text("mine")
    cli.main([*run, "--no-html"])
    assert {f.name for f in tmp_path.iterdir()} == FILES | {"notes.txt"}
