"""Whatever happens, a command says one line, and its exit code tells what."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import drake_mobarm
from drake_mobarm import cli

PACKAGE = Path(drake_mobarm.__file__).parents[1]
LONG = "x" * 5000
DIGITS = "7" * 5000
RUN = ["run", "homing", "--no-html", "--set", "world=empty"]
BLINK = [*RUN, "--set", "time_limit=0.1"]
DEEP = "[" * 3000 + "]" * 3000


def mobarm(arguments, folder, **environment):
    """Runs the program itself, in a folder."""
    return subprocess.run(
        [sys.executable, "-m", "drake_mobarm", *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(PACKAGE)} | environment,
        capture_output=True,
        check=False,
    )


def in_a_file(content):
    def write(folder):
        (folder / "s.yaml").write_bytes(content)
        return ["run", "s.yaml"]

    return write


def a_folder(folder):
    (folder / "s.yaml").mkdir()
    return ["run", "s.yaml"]


def out_is_a_file(folder):
    (folder / "file").write_text("mine")
    return [*RUN, "--out", "file"]


def draw_into_a_file(folder):
    (folder / "file").write_text("mine")
    return ["draw", "homing", "--out", "file/h.dot"]


def draw_over_a_folder(folder):
    (folder / "h.dot").mkdir()
    return ["draw", "homing", "--out", "h.dot"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", f"{LONG}.yaml"], ["scenario", "too long"]),
        (["run", LONG], ["unknown scenario", "homing"]),
        ([*RUN, "--set", f"world={LONG}"], ["unknown world"]),
        ([*RUN, "--set", f"world={LONG}.sdf"], ["unknown world"]),
        ([*RUN, "--set", f"diagram={LONG}.py"], ["diagram", "too long"]),
        ([*RUN, "--set", f"diagram={LONG}"], ["diagram", "homing"]),
        ([*RUN, "--set", f"{LONG}=3"], ["unknown key"]),
        ([*RUN, "--set", f"noise={LONG}"], ["noise", "int"]),
        ([*RUN, "--set", f"noise={DIGITS}"], ["noise", "digits"]),
        ([*RUN, "--set", f"noise={DIGITS[:290]}"], ["noise", "1, 2, 3"]),
        ([*RUN, "--set", f"time_limit={DIGITS[:290]}"], ["time_limit"]),
        ([*RUN, "--set", "time_limit=1e400"], ["time_limit", "finite"]),
        ([*RUN, "--set", "noise=2020-01-01"], ["noise", "int"]),
        ([*RUN, "--set", "beacon=[1e300, 0]"], ["beacon", "1e6"]),
        ([*RUN, "--set", "start=[0, 0, 1e300]"], ["start", "1e6"]),
        ([*RUN, "--set", f"start={DEEP}"], ["start", "nested"]),
        ([*RUN, "--set", "world=\udcff"], ["world", "parse"]),
        (["run", "\udcff.yaml"], ["no such file"]),
        ([*RUN, "--out", LONG], ["output folder", "too long"]),
        ([*RUN, "--seed", DIGITS], ["--seed", "whole number"]),
        (["reproduce", "2.3", "--trials", DIGITS], ["--trials"]),
        (["reproduce", "2.3", "--trials", "999999999"], ["trials", "10000"]),
        (["reproduce", "2.3", "--jobs", "999999999"], ["jobs", "1000"]),
        (["reproduce", "2.3", "--seed", str(2**63)], ["seed", "2**63"]),
        (["reproduce", LONG], ["unknown table", "2.3"]),
        (in_a_file(b""), ["s.yaml", "keys and values"]),
        (in_a_file(b"a: \xff\xfe\n"), ["s.yaml", "parse"]),
        (in_a_file(bytes(range(256)) * 9), ["s.yaml", "parse"]),
        (in_a_file(DEEP.encode()), ["s.yaml", "nested"]),
        (in_a_file(b"#" * 1_000_001), ["s.yaml", "1000000 bytes"]),
        (in_a_file(b"a: 1\nnoise: " + DIGITS.encode()), ["line 2", "digits"]),
        (a_folder, ["s.yaml", "directory"]),
        (out_is_a_file, ["output folder", "file"]),
        (draw_into_a_file, ["file/h.dot", "written"]),
        (draw_over_a_folder, ["h.dot", "written"]),
    ],
)
def test_what_nobody_would_write_is_one_short_line_and_exit_code_2(
    arguments, words, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    if callable(arguments):
        arguments = arguments(tmp_path)
    before = set(tmp_path.rglob("*"))
    try:
        code = cli.main(arguments)
    except SystemExit as exit_:
        code = exit_.code
    output = capsys.readouterr()
    assert code == 2, output.err
    assert output.out == ""
    assert output.err.count("\n") == 1
    for word in words:
        assert word in output.err
    assert set(tmp_path.rglob("*")) == before


def test_a_very_short_run_is_a_run(tmp_path):
    for limit in ("0.01", "1e-9"):
        run = ["run", "homing", "--no-html", "--out", str(tmp_path), "--force"]
        assert cli.main([*run, "--set", f"time_limit={limit}"]) == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("arguments", [["list"], ["draw", "homing"], BLINK])
def test_an_output_that_is_full_is_one_line_and_exit_code_2(
    arguments, tmp_path
):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "drake_mobarm", *arguments],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(PACKAGE)},
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 2
    assert done.stderr == (
        "mobarm: the standard output cannot be written: No space left on "
        "device\n"
    )


def test_an_output_whose_reader_has_gone_is_no_error(tmp_path):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "drake_mobarm", "list"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(PACKAGE)},
        stdout=writer,
        stderr=subprocess.PIPE,
        check=False,
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (130, b"")


def test_windows_that_the_environment_asks_for_are_not_needed(tmp_path):
    done = mobarm(BLINK, tmp_path, MPLBACKEND="nonsense")
    assert done.returncode == 1, done.stderr
    (picture,) = tmp_path.glob("runs/*/trajectory.png")
    assert picture.stat().st_size > 10_000
    assert done.stderr == b""


@pytest.mark.parametrize(
    "error",
    [
        ZeroDivisionError("some\nlines\nof text"),
        MemoryError(),
        RecursionError("deep"),
        KeyError("x" * 5000),
    ],
)
def test_what_nobody_foresaw_is_one_line_a_file_and_exit_code_70(
    error, tmp_path, monkeypatch, capsys
):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(cli, "run", fail)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    out = tmp_path / "out"
    assert cli.main([*BLINK, "--out", str(out)]) == 70
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert len(told) < 400
    kind = type(error).__name__
    file = Path(
        re.fullmatch(rf"mobarm: unforeseen {kind}: .* (\S+)\n", told)[1]
    )
    text = file.read_text()
    assert "Traceback" in text
    assert "in fail" in text
    assert "time_limit=0.1" in text
    assert drake_mobarm.__version__ in text
    assert set(tmp_path.iterdir()) == {file}


def test_without_a_place_for_the_file_the_line_tells_where(
    tmp_path, monkeypatch, capsys
):
    def fail(*_, **__):
        raise ZeroDivisionError

    monkeypatch.setattr(cli, "run", fail)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "missing"))
    assert cli.main([*BLINK, "--out", str(tmp_path / "out")]) == 70
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "raise ZeroDivisionError" in told
