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

    with pytest.raises(BlockError, match="'mute' has no output port 'done'"):
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


def test_a_file_that_is_missing_is_named(tmp_path):
    file = write(tmp_path, MINE)
    (tmp_path / "mine.py").unlink()
    with pytest.raises(ScenarioError, match=r"mine\.py: there is no such file"):
        load_scenario(file)
