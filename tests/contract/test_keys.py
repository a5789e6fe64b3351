"""Every key of a shipped scenario is there for something."""

import pytest

from drake_mobarm import build_diagram, load_scenario
from drake_mobarm.job import job_names
from helpers.reach import descriptions, keys, reached
from helpers.shipped import variants

# Which diagram it is and when a run ends: no system needs to know.
OF_THE_RUNTIME = {"diagram", "time_limit"}
# What becomes of meshes: shipped worlds have none; tests/world has its tests.
OF_THE_WORLD = {"meshes"}
# Where a highway's points are, which only large changes move: tests/navigation
# has their tests.
OF_THE_HIGHWAY = {
    "highway.count",
    "highway.min_distance",
    "highway.blur",
    "highway.smallest_region",
}


@pytest.mark.parametrize(
    ("job", "key"),
    [
        (job, key)
        for job in job_names()
        for key in keys(load_scenario(job))
        if key not in OF_THE_RUNTIME | OF_THE_WORLD | OF_THE_HIGHWAY
    ],
)
def test_another_value_of_a_key_makes_another_system(job, key):
    assert any(reached(job, key, *overrides) for overrides in variants(job))


@pytest.mark.parametrize("job", job_names())
def test_the_same_scenario_makes_the_same_systems(job):
    scenario = load_scenario(job, ["world=empty"])
    first, second = (descriptions(build_diagram(scenario)) for _ in range(2))
    assert len(first) > 2
    assert first == second
