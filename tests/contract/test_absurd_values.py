"""No value of a scenario, however absurd, costs more than a clear refusal."""

import math
import resource
import typing

import pytest

from drake_mobarm import build_diagram, changed, load_scenario
from drake_mobarm.exceptions import MobarmError
from drake_mobarm.job import job_names
from helpers.reach import keys

ABSURD = [1e300, 1e9, 1e6, 1e-9, 5e-324, 0, -1, -1e300, math.nan]
HUGE = [10**400, 10**5000, 10**18, 10**9, 10**6, 0, -1]
# Of address space above what the tests have taken by then [bytes].
ROOM = 3 * 2**30


@pytest.fixture(autouse=True)
def little_memory():
    """What asks for too much memory fails, instead of the machine."""
    with open("/proc/self/statm") as file:
        taken = int(file.read().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (taken + ROOM, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


def kind_of(scenario, key):
    *owners, last = key.split(".")
    for owner in owners:
        scenario = getattr(scenario, owner)
    kind = typing.get_type_hints(type(scenario))[last]
    return kind, getattr(scenario, last)


def absurd_values(scenario, key):
    """Values of a key's type with each absurd number in each place."""
    kind, value = kind_of(scenario, key)
    if kind is float:
        return ABSURD + HUGE[:1]
    if kind is int:
        return HUGE
    if kind == tuple[float, ...]:
        places = list(value or [1.0])
        # Too many numbers, too.
        return [[0.0] * 10_000] + [
            [*places[:i], x, *places[i + 1 :]]
            for i in range(len(places))
            for x in ABSURD + HUGE[:1]
        ]
    if kind == tuple[tuple[float, ...], ...]:
        return [[[0, 1e300]], [[-1e300, 0]], [[0, 1]] * 1000, [[]]]
    return []


@pytest.mark.parametrize(
    ("job", "key"),
    [(job, key) for job in job_names() for key in keys(load_scenario(job))],
)
def test_an_absurd_value_is_refused_or_makes_a_diagram(job, key):
    scenario = load_scenario(job, ["world=empty"])
    messages = []
    for value in absurd_values(scenario, key):
        try:
            build_diagram(changed(scenario, **{key: value}))
        except MobarmError as error:
            messages.append(str(error))
    for message in messages:
        assert len(message) < 400


def test_every_number_of_a_scenario_has_an_end():
    endless = []
    for job in job_names():
        scenario = load_scenario(job, ["world=empty"])
        for key in keys(scenario):
            kind, value = kind_of(scenario, key)
            big = {float: 1e7, int: 10**7}.get(kind)
            if kind == tuple[float, ...]:
                big = [1e7] * max(len(value), 1)
            if big is None:
                continue
            try:
                changed(scenario, **{key: big})
            except MobarmError:
                continue
            endless.append(key)
    assert set(endless) == {"seed"}
