"""Jobs are found, and so is what their folders hold."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import drake_mobarm
from drake_mobarm.job import (
    Job,
    RunRecord,
    Table,
    find_job,
    find_tables,
    job_names,
    judge_by_done,
    spawn_seeds,
)

PACKAGE = Path(drake_mobarm.__file__).parent
SCENARIO = SimpleNamespace(time_limit=2.5)


def test_a_job_is_a_folder_with_a_job_file():
    folders = {f.name for f in PACKAGE.iterdir() if (f / "job.py").is_file()}
    assert job_names() == sorted(folders)
    assert {"homing", "placement"} <= folders


@pytest.mark.parametrize("name", job_names())
def test_a_job_is_found_by_its_name(name):
    job = find_job(name)
    assert isinstance(job, Job)
    assert job.name == name
    assert callable(job.build)


def test_a_name_without_a_folder_is_no_job():
    with pytest.raises(ModuleNotFoundError):
        find_job("dancing")


def test_tables_are_those_of_the_jobs_folders():
    tables = find_tables()
    homing = find_job("homing").find("tables", "TABLES")
    assert {"2.3", "2.4"} <= set(homing) <= set(tables)
    assert tables["2.3"] is homing["2.3"]
    assert all(isinstance(table, Table) for table in tables.values())


def test_no_two_jobs_have_a_table_of_the_same_name():
    names = [
        name
        for job in job_names()
        for name in find_job(job).find("tables", "TABLES") or {}
    ]
    assert len(names) == len(set(names)) == len(find_tables())


def test_what_a_jobs_folder_does_not_hold_is_none():
    assert find_job("placement").find("tables", "TABLES") is None
    assert find_job("placement").find("nothing", "NOTHING") is None


def test_a_jobs_file_has_to_have_the_name_that_is_looked_for():
    with pytest.raises(AttributeError, match="NOTHING"):
        find_job("homing").find("report", "NOTHING")


def test_a_job_of_a_module_of_its_own_finds_all_in_it():
    def build(scenario, *, seed, meshcat=None):
        return "a diagram"

    report = object()
    module = SimpleNamespace(build=build, REPORT=report)
    own = Job(name="homing", scenario=SimpleNamespace, module=module)
    assert own.build is build
    assert own.report is report
    assert own.find("view", "set_stage") is None
    assert own.find("tables", "TABLES") is None


def test_a_job_has_no_places_unless_it_tells():
    own = Job(name="own", scenario=SimpleNamespace)
    assert list(own.places(SCENARIO)) == []
    assert own.judge is judge_by_done


@pytest.mark.parametrize(
    ("done", "success", "reason"),
    [
        (1.0, True, "done"),
        (0.51, True, "done"),
        (0.5, False, "time limit of 2.5 s reached"),
        (0.0, False, "time limit of 2.5 s reached"),
    ],
)
def test_without_a_judge_a_run_succeeds_when_it_is_done(done, success, reason):
    verdict = judge_by_done(SCENARIO, {}, {"done": np.array([done])})
    assert verdict == (success, reason, {})


def test_a_run_that_takes_half_its_time_has_a_real_time_factor_of_two():
    record = RunRecord(
        scenario=SCENARIO,
        seed=0,
        success=True,
        reason="done",
        simulated_s=3.0,
        wall_s=1.5,
        metrics={},
        trace={},
        outputs={},
    )
    assert record.real_time_factor == 2.0


def test_a_seed_gives_two_that_differ_and_are_always_the_same():
    seeds = [spawn_seeds(seed) for seed in range(100)]
    assert seeds == [spawn_seeds(seed) for seed in range(100)]
    assert len({seed for pair in seeds for seed in pair}) == 200
    assert all(0 <= s < 2**32 for pair in seeds for s in pair)
