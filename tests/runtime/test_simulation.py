"""What a run keeps, whatever is simulated: its time, its errors, its stage."""

import pytest
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_mobarm import load_scenario, run
from drake_mobarm.homing import view


class Waiting(LeafSystem):
    """Is never done, and may break at 0.1 s."""

    def __init__(self, breaks=False):
        super().__init__()
        self.DeclareVectorOutputPort("done", 1, lambda context, output: None)
        self.DeclarePeriodicPublishEvent(0.1, 0.1, self._work)
        self._breaks = breaks

    def _work(self, context):
        if self._breaks:
            raise RuntimeError("the wheel came off")


def waiting(scenario, *, seed, meshcat=None, breaks=False):
    builder = DiagramBuilder()
    system = builder.AddSystem(Waiting(breaks))
    builder.ExportOutput(system.GetOutputPort("done"), "done")
    return builder.Build()


def broken(scenario, *, seed, meshcat=None):
    return waiting(scenario, seed=seed, breaks=True)


def test_an_error_inside_a_diagram_is_told_and_is_no_end_of_time():
    scenario = load_scenario("homing", ["time_limit=0.3"])
    with pytest.raises(RuntimeError, match="the wheel came off"):
        run(scenario, build=broken)


def test_a_run_ends_at_its_time_limit_between_two_checks_too():
    times = []
    scenario = load_scenario("homing", ["time_limit=0.23"])
    result = run(scenario, build=waiting, on_progress=times.append)
    assert times == pytest.approx([0.05, 0.1, 0.15, 0.2, 0.23])
    assert result.simulated_s == pytest.approx(0.23)
    assert result.reason == "time limit of 0.23 s reached"


def test_the_jobs_stage_is_set_where_a_run_is_shown_and_only_there(monkeypatch):
    staged = []
    monkeypatch.setattr(
        view, "set_stage", lambda meshcat, scenario: staged.append(scenario)
    )
    scenario = load_scenario("homing", ["world=empty", "time_limit=0.1"])
    run(scenario)
    assert staged == []
    run(scenario, record=True)
    assert staged == [scenario]
