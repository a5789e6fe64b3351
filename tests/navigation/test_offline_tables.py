"""Table 3.1: its tasks, what a plan's figures are, and what must succeed."""

import contextlib
import io
import itertools
import shlex
from collections import Counter

import numpy as np
import pytest
import shapely

from drake_mobarm.navigation.environments import ENVIRONMENTS
from drake_mobarm.navigation.offline_pictures import pictures
from drake_mobarm.navigation.offline_tables import (
    OFFLINE_TABLES,
    make_map,
    make_trials,
    plan_pair,
)
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.runtime.tables import command

TABLE = OFFLINE_TABLES["3.1"]


def task(trial):
    names = ("environment", "grid_factor", "start", "target")
    return tuple(trial.notes[name] for name in names)


def by_case(trials):
    cases = {}
    for trial in trials:
        cases.setdefault(trial.case, []).append(trial)
    return cases


def test_all_trials_are_all_tasks_with_every_weight_and_method():
    cases = by_case(make_trials(3, TABLE.trials))
    assert len(cases) == 15
    for trials in cases.values():
        # Ten environments, four grid sizes, four starts, three targets.
        assert len(trials) == 10 * 4 * 4 * 3
        assert len({task(trial) for trial in trials}) == 480


def test_the_same_trials_of_all_cases_are_the_same_tasks():
    first, *others = by_case(make_trials(3, 50)).values()
    for trials in others:
        assert [task(t) for t in trials] == [task(t) for t in first]
        assert [t.seed for t in trials] == [t.seed for t in first]


def test_tasks_come_again_with_other_highways():
    trials = by_case(make_trials(3, 1000))["text, m = 10"]
    count = Counter(task(trial) for trial in trials)
    assert sorted(Counter(count.values()).items()) == [(2, 440), (3, 40)]
    assert len({(task(trial), trial.seed) for trial in trials}) == 1000


def test_a_few_trials_are_spread_over_environments_and_sizes():
    trials = by_case(make_trials(0, 60))["text, m = 10"]
    assert len({task(trial) for trial in trials}) == 60
    assert {trial.notes["environment"] for trial in trials} == {
        environment.name for environment in ENVIRONMENTS
    }


def test_a_seed_repeats_its_trials():
    assert list(make_trials(5, 20)) == list(make_trials(5, 20))
    assert list(make_trials(5, 20)) != list(make_trials(6, 20))


def test_the_dissertations_figures_stand_by_their_weight():
    beside = TABLE.dissertation("repaired, m = 75")
    assert beside == {
        "success_percent": 99.7,
        "mean_path_length_m": 2.86,
        "median_path_length_m": 3.02,
        "mean_steps": 310.54,
        "median_steps": 306.0,
    }


PAIR = {
    "seed": 1,
    "environment": "U trap",
    "grid_factor": 0.6,
    "start": 1,
    "target": 0,
}


def test_a_plans_figures_are_those_of_its_path():
    found = plan_pair(**PAIR, method="best path", weight=50)
    assert found.success
    line = shapely.linestrings(found.path)
    assert found.metrics["path_length_m"] == pytest.approx(line.length)
    assert found.metrics["steps"] == len(found.path) - 1
    (trap,) = (e for e in ENVIRONMENTS if e.name == "U trap")
    solid = shapely.union_all(
        [
            shapely.box(0, 0, *trap.size).exterior,
            *(shapely.box(*rectangle) for rectangle in trap.obstacles),
        ]
    )
    # Points at every centimetre see no more than 1/8 mm less at a corner.
    clearance = found.metrics["smallest_clearance_m"]
    assert clearance == pytest.approx(line.distance(solid) - RADIUS, abs=2e-4)
    assert found.metrics["no_contact"] == float(clearance >= 0)
    grid, highway = make_map("U trap", 0.6, True, 1)
    assert found.metrics["grid_size_m"] == grid.cell
    assert found.metrics["highway_points"] == len(highway.points)
    assert found.metrics["highway_pieces"] == 1


def test_grids_are_as_large_as_their_factors():
    sizes = [make_map("maze", f, True, 0)[0].cell for f in (0.4, 0.6, 0.8, 1.0)]
    assert np.divide(sizes, sizes[-1]) == pytest.approx([0.4, 0.6, 0.8, 1.0])


def test_only_the_texts_highway_is_not_repaired():
    # So coarse that the text's points do not make one piece.
    pieces = {
        method: plan_pair(
            **PAIR | {"environment": "maze", "grid_factor": 1.0},
            method=method,
            weight=50,
        ).metrics["highway_pieces"]
        for method in ("text", "repaired", "best path")
    }
    assert pieces["text"] > 1
    assert pieces["repaired"] == pieces["best path"] == 1


def test_the_command_of_a_trial_repeats_it():
    trial = next(t for t in make_trials(0, 1) if t.case == "best path, m = 100")
    program, option, line = command(TABLE, trial).split(" ", 2)
    assert (program, option) == ("python", "-c")
    told = io.StringIO()
    (code,) = shlex.split(line)
    with contextlib.redirect_stdout(told):
        exec(code, {})
    expected = plan_pair(seed=trial.seed, **trial.notes)
    assert told.getvalue() == f"{expected}\n"


@pytest.mark.parametrize("weight", [50, 100])
@pytest.mark.parametrize("environment", [e.name for e in ENVIRONMENTS])
def test_the_best_path_of_a_repaired_highway_reaches_every_target(
    environment, weight
):
    for start, target in itertools.product((0, 2), range(3)):
        found = plan_pair(
            seed=7,
            environment=environment,
            grid_factor=0.6,
            start=start,
            target=target,
            method="best path",
            weight=weight,
        )
        assert found.success, (start, target, found.reason)


def row_of(weight, success, steps, target=0):
    return {
        "case": f"text, m = {weight}",
        "seed": 0,
        "environment": "one table",
        "grid_factor": 1.0,
        "start": 0,
        "target": target,
        "method": "text",
        "weight": weight,
        "success": success,
        "reason": "the force vanished, 2.00 m from the target",
        "path_length_m": 3.0,
        "steps": steps,
        "highway_pieces": 2,
    }


def test_pictures_compare_what_every_weight_solved():
    rows = [
        row_of(10, True, 40.0),
        row_of(50, True, 20.0),
        row_of(10, False, 900.0, target=1),
        row_of(50, True, 70.0, target=1),
    ]
    paths = [np.array([[0.8, 0.8], [3.0, 3.0]])] * len(rows)
    figures = pictures(rows, paths)
    success, length, steps = figures["by_environment.png"].axes
    # Ten bars a weight: those of the first environment.
    assert [success.patches[i].get_height() for i in (0, 10)] == [0.5, 1.0]
    assert [length.patches[i].get_height() for i in (0, 10)] == [3.0, 3.0]
    assert [steps.patches[i].get_height() for i in (0, 10)] == [40.0, 20.0]
    titles = [axes.get_title() for axes in figures["plans.png"].axes]
    assert titles[0] == "1: one table"
    assert len(titles) == 10
    (failed,) = (a for a in figures["failures.png"].axes if a.get_title())
    assert failed.get_title() == "text, m = 10"
    assert failed.get_xlabel() == "the force vanished; pieces: 2"
