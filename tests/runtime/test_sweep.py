"""A sweep keeps order, resumes, and does nothing twice."""

import json

import pytest

from drake_mobarm.exceptions import OutputError
from drake_mobarm.runtime.sweep import run_sweep

TRIALS = [{"trial": n, "x": n / 3} for n in range(6)]
IDENTITY = {"table": "squares", "seed": 0}


def square(trial):
    return {"row": {"value": trial["x"] ** 2}}


def fail_on_4(trial):
    if trial["trial"] == 4:
        raise RuntimeError("power cut")
    return square(trial)


def forbidden(trial):
    raise AssertionError("done twice")


def test_outcomes_come_in_the_order_of_the_trials(tmp_path):
    for jobs in (1, 2):
        outcomes = run_sweep(
            TRIALS, square, tmp_path / f"{jobs}.jsonl", IDENTITY, jobs
        )
        assert [o["row"]["value"] for o in outcomes] == pytest.approx(
            [0, 1 / 9, 4 / 9, 1, 16 / 9, 25 / 9]
        )


def test_an_interrupted_sweep_goes_on_where_it_was(tmp_path):
    store = tmp_path / "store.jsonl"
    with pytest.raises(RuntimeError, match="power cut"):
        run_sweep(TRIALS, fail_on_4, store, IDENTITY, jobs=1)
    done = [json.loads(line) for line in store.read_text().splitlines()[1:]]
    assert [entry["trial"] for entry in done] == [0, 1, 2, 3]
    resumed = run_sweep(TRIALS, square, store, IDENTITY, jobs=1)
    fresh = run_sweep(TRIALS, square, tmp_path / "b", IDENTITY, jobs=1)
    assert resumed == fresh
    # Nothing is done twice.
    assert run_sweep(TRIALS, forbidden, store, IDENTITY, jobs=1) == fresh


def test_a_line_that_was_cut_off_is_done_again(tmp_path):
    store = tmp_path / "store.jsonl"
    whole = run_sweep(TRIALS, square, store, IDENTITY, jobs=1)
    store.write_text(store.read_text()[:-9])
    assert run_sweep(TRIALS, square, store, IDENTITY, jobs=1) == whole


def test_another_sweep_in_the_folder_is_not_mixed_in(tmp_path):
    store = tmp_path / "store.jsonl"
    run_sweep(TRIALS, square, store, IDENTITY, jobs=1)
    with pytest.raises(OutputError, match="another sweep"):
        run_sweep(TRIALS, square, store, {"table": "cubes"}, jobs=1)
