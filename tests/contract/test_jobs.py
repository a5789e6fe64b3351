"""What every job keeps: the files it comes with, and what its diagram gives."""

import dataclasses
import importlib
import inspect
import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from pydrake.systems.primitives import VectorLogSink

from drake_mobarm import load_scenario, run
from drake_mobarm.diagrams.wiring import TRACE
from drake_mobarm.job import find_job, job_names
from drake_mobarm.runtime.scenarios import scenario_names
from helpers.shipped import (
    all_systems,
    input_ports,
    is_vector,
    output_ports,
    shipped_diagrams,
)

ROOT = Path(__file__).parents[2]

JOBS = pytest.mark.parametrize("job", job_names())


def short(scenario):
    """The scenario, ended after a blink where it does not end by itself."""
    if "time_limit" in {field.name for field in dataclasses.fields(scenario)}:
        return dataclasses.replace(scenario, time_limit=0.2)
    return scenario


def test_the_jobs_are_those_of_the_shipped_scenarios():
    assert job_names() == scenario_names()
    assert "homing" in job_names()


@JOBS
def test_a_job_has_the_name_of_its_folder_and_of_its_scenarios_diagram(job):
    assert find_job(job).name == job
    file = ROOT / "diagrams" / f"{job}.yaml"
    assert yaml.safe_load(file.read_text())["diagram"] == job


@JOBS
@pytest.mark.parametrize(
    "file",
    [
        "drake_mobarm/{}/job.py",
        "drake_mobarm/{}/metrics.py",
        "drake_mobarm/{}/report.py",
        "drake_mobarm/{}/systems.py",
        "drake_mobarm/{}/view.py",
        "diagrams/{}.py",
        "diagrams/{}.yaml",
        "notebooks/{}.ipynb",
        "docs/{}.md",
        "tests/diagrams/test_{}.py",
    ],
)
def test_a_job_comes_with_all_its_files(job, file):
    assert (ROOT / file.format(job)).stat().st_size > 100


@JOBS
def test_a_diagram_has_its_two_functions(job):
    module = importlib.import_module(f"drake_mobarm.diagrams.{job}")
    assert "blocks" in inspect.signature(module.build_job).parameters
    assert list(inspect.signature(module.build).parameters) == [
        *("scenario", "seed", "meshcat", "blocks")
    ]


def test_a_diagram_tells_when_it_is_done():
    for shipped in shipped_diagrams():
        done = shipped.diagram.GetOutputPort("done")
        assert done.size() == 1
        assert done.Eval(shipped.fresh) == [0.0]


def test_logs_have_the_names_of_the_signals_that_they_hold():
    for shipped in shipped_diagrams():
        systems = [
            found.system for found in all_systems() if found.shipped is shipped
        ]
        sizes = {
            port.get_name(): port.size()
            for system in systems
            for port in input_ports(system) + output_ports(system)
            if is_vector(port)
        }
        logs = [s for s in systems if isinstance(s, VectorLogSink)]
        assert logs
        for log in logs:
            assert log.get_name().startswith(TRACE)
            signal = log.get_name().removeprefix(TRACE)
            assert log.get_input_port().size() == sizes[signal]


@JOBS
def test_a_shipped_scenario_runs_for_a_blink_and_leaves_its_folder(
    job, tmp_path
):
    result = run(short(load_scenario(job)), seed=1)
    assert 0 < result.simulated_s < 1.1
    assert result.reason
    assert set(result.trace) > {"t"}
    for values in result.trace.values():
        assert len(values) == len(result.trace["t"]) > 0
    assert (np.diff(result.trace["t"]) > 0).all()
    assert result.outputs["done"].shape == (1,)
    first = result.save(tmp_path)
    assert first.stat().st_size > 1000
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["scenario"] == job
    assert summary["metrics"].keys() == result.metrics.keys() != set()
