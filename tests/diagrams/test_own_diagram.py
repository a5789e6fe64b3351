"""A diagram of the user's own, in Python and from a scenario's file."""

import numpy as np
import pytest
import yaml
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource,
    LogVectorOutput,
    TrajectorySource,
)
from pydrake.trajectories import PiecewisePolynomial

from drake_mobarm import cli, load_scenario, run
from drake_mobarm.exceptions import BlockError, ScenarioError
from drake_mobarm.job import Verdict

MINE = """
from dataclasses import dataclass
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial


def build(scenario, *, seed, meshcat=None):
    builder = DiagramBuilder()
    clock = builder.AddSystem(TrajectorySource(
        PiecewisePolynomial.FirstOrderHold([0.0, 10.0], [[0.0, 10.0]])))
    LogVectorOutput(clock.get_output_port(), builder, 0.05).set_name("clock")
    builder.ExportOutput(clock.get_output_port(), "done")
    return builder.Build()
"""

SCENARIO = """

@dataclass(kw_only=True)
class Scenario:
    diagram: str
    patience: float = 3.0
    time_limit: float = 4.0


def judge(scenario, trace, outputs):
    from drake_mobarm.job import Verdict
    waited = float(trace["clock"][-1, 0])
    return Verdict(waited < scenario.patience, "waited", {"waited_s": waited})
"""


def rising(scenario, *, seed, meshcat=None):
    """Done after half a second."""
    builder = DiagramBuilder()
    ramp = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [[0.0, 1.0]])
    source = builder.AddSystem(TrajectorySource(ramp))
    log = LogVectorOutput(source.get_output_port(), builder, 0.05)
    log.set_name("trace.ramp")
    builder.ExportOutput(source.get_output_port(), "done")
    return builder.Build()


def write(folder, text, **values):
    (folder / "mine.py").write_text(text)
    file = folder / "mine.yaml"
    file.write_text(yaml.safe_dump({"diagram": "mine.py", **values}))
    return str(file)


def test_a_build_function_of_ones_own_needs_only_an_output_done():
    scenario = load_scenario("homing", ["time_limit=2"])
    result = run(scenario, build=rising)
    assert result.success
    assert result.reason == "done"
    assert result.metrics == {}
    # Above 0.5 at the first check after half a second.
    assert result.simulated_s == pytest.approx(0.55)
    np.testing.assert_allclose(
        result.trace["ramp"][:, 0], result.trace["t"], atol=1e-12
    )


def test_a_diagram_of_ones_own_that_never_ends_is_stopped():
    def endless(scenario, *, seed, meshcat=None):
        builder = DiagramBuilder()
        zero = builder.AddSystem(ConstantVectorSource([0.0]))
        builder.ExportOutput(zero.get_output_port(), "done")
        return builder.Build()

    result = run(load_scenario("homing", ["time_limit=0.2"]), build=endless)
    assert not result.success
    assert result.reason == "time limit of 0.2 s reached"


def test_a_judge_of_ones_own_decides():
    def judge(scenario, trace, outputs):
        return Verdict(False, "too slow", {"end": float(trace["ramp"][-1, 0])})

    result = run(
        load_scenario("homing", ["time_limit=2"]), build=rising, judge=judge
    )
    assert not result.success
    assert result.reason == "too slow"
    assert result.metrics["end"] == pytest.approx(0.55)


def test_the_seed_reaches_a_build_function():
    seeds = []

    def listen(scenario, *, seed, meshcat=None):
        seeds.append(seed)
        return rising(scenario, seed=seed)

    run(load_scenario("homing"), 41, build=listen)
    assert seeds == [41]


def test_a_diagram_without_done_is_refused():
    def mute(scenario, *, seed, meshcat=None):
        builder = DiagramBuilder()
        builder.AddSystem(ConstantVectorSource([0.0]))
        return builder.Build()

    with pytest.raises(BlockError, match=r"'mute' builds is no .* 'done'"):
        run(load_scenario("homing"), build=mute)


def test_a_scenario_may_name_a_file_beside_it(tmp_path):
    scenario = load_scenario(write(tmp_path, MINE, time_limit=2.0))
    result = run(scenario)
    assert result.success
    assert result.trace["clock"][-1, 0] == pytest.approx(0.55)


def test_a_files_own_scenario_and_judge_are_used(tmp_path):
    file = write(tmp_path, MINE + SCENARIO, patience=0.3)
    result = run(load_scenario(file))
    assert not result.success
    assert result.reason == "waited"
    assert run(load_scenario(file, ["patience=1"])).success
    with pytest.raises(ScenarioError, match=r"patients: .* patience"):
        load_scenario(file, ["patients=1"])


def test_the_command_line_runs_a_diagram_of_ones_own(tmp_path, capsys):
    file = write(tmp_path, MINE, time_limit=2.0)
    out = tmp_path / "run"
    assert cli.main(["run", file, "--no-html", "--out", str(out)]) == 0
    assert "success: done" in capsys.readouterr().out
    assert {f.name for f in out.iterdir()} == {
        "diagram.dot",
        "scenario.yaml",
        "summary.json",
        "trace.npz",
    }
    # What was run can be run again, from anywhere.
    again = str(out / "scenario.yaml")
    code = cli.main(["run", again, "--no-html", "--out", str(tmp_path / "b")])
    assert code == 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1\n", ["mine.py", "no function build"]),
        ("import nowhere\n", ["mine.py", "ModuleNotFoundError", "nowhere"]),
        ("def build(:\n", ["mine.py", "SyntaxError"]),
    ],
)
def test_a_file_that_is_no_diagram_is_one_line(tmp_path, text, words):
    with pytest.raises(ScenarioError) as caught:
        load_scenario(write(tmp_path, text))
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "def build(scenario, *, seed, meshcat=None):\n    1 / 0\n",
            ["ZeroDivisionError"],
        ),
        ("def build(scenario):\n    pass\n", ["TypeError", "seed"]),
        (MINE + "\n\ndef judge(*_):\n    return 3\n", ["TypeError"]),
        ("import sys\nsys.exit(3)\n", ["SystemExit"]),
        (MINE + "\n\nclass Scenario:\n    pass\n", ["dataclass"]),
        (
            MINE
            + "\n\n@dataclass(kw_only=True)\nclass Scenario:\n"
            + "    diagram: str\n    time_limit: float | None = 3\n",
            ["time_limit", "float | None", "list"],
        ),
        (
            MINE
            + "\n\n@dataclass(kw_only=True)\nclass Scenario:\n"
            + "    diagram: str\n    time_limit: float = 3.0\n\n"
            + "    def __post_init__(self):\n"
            + "        raise ValueError('too late')\n",
            ["too late"],
        ),
    ],
)
def test_what_goes_wrong_in_a_file_is_one_line_and_exit_code_2(
    tmp_path, capsys, text, words
):
    file = write(tmp_path, text, time_limit=1.0)
    code = cli.main(["run", file, "--no-html", "--out", str(tmp_path / "run")])
    assert code == 2
    told = capsys.readouterr().err.strip()
    assert len(told.splitlines()) == 1
    for word in ["mine", *words]:
        assert word in told
    assert not (tmp_path / "run").exists()


def test_two_files_of_one_name_do_not_meet(tmp_path):
    files = []
    for name, patience in (("p", 0.3), ("q", 9.0)):
        (tmp_path / name).mkdir()
        text = MINE + SCENARIO.replace("3.0", str(patience))
        files.append(write(tmp_path / name, text))
    assert not run(load_scenario(files[0])).success
    assert run(load_scenario(files[1])).success
    assert not run(load_scenario(files[0])).success


def test_a_world_beside_a_scenarios_file_is_found_from_anywhere(
    tmp_path, monkeypatch
):
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "hall.sdf").write_text(
        '<sdf version="1.9"><model name="m"><static>true</static>'
        '<link name="l"><collision name="c"><pose>9 9 0.5 0 0 0</pose>'
        "<geometry><box><size>1 1 1</size></box></geometry>"
        "</collision></link></model></sdf>"
    )
    (tmp_path / "own" / "mine.yaml").write_text(
        "diagram: homing\nworld: hall.sdf\nstart: [0, 0, 0]\nbeacon: [2, 1]\n"
    )
    monkeypatch.chdir(tmp_path)
    scenario = load_scenario("own/mine.yaml")
    assert scenario.world == str(tmp_path / "own" / "hall.sdf")
    # As --set names it: seen from where the command is given.
    monkeypatch.chdir(tmp_path / "own")
    overrides = ["world=hall.sdf", "start=[0, 0, 0]", "beacon=[2, 1]"]
    assert load_scenario("homing", overrides).world == scenario.world


def test_a_file_that_is_missing_is_named(tmp_path):
    file = write(tmp_path, MINE)
    (tmp_path / "mine.py").unlink()
    with pytest.raises(ScenarioError, match=r"mine\.py: there is no such file"):
        load_scenario(file)
