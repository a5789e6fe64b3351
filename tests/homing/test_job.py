"""Homing scenarios: where start and beacon may be, and what is searched."""

import numpy as np
import pytest

from drake_mobarm import load_scenario, run
from drake_mobarm.diagrams import homing
from drake_mobarm.exceptions import ScenarioError
from drake_mobarm.homing.job import AVOIDANCES
from helpers.shapes import write_wall


@pytest.fixture
def wall(tmp_path):
    return f"world={write_wall(tmp_path)}"


def test_the_start_needs_the_robots_radius_and_the_beacon_none(wall):
    # The radius is 0.27 m.
    load_scenario("homing", [wall, "start=[2.72, 0, 0]", "beacon=[2.99, 1]"])
    for start in (2.74, 3.5):
        with pytest.raises(ScenarioError, match=r"^start"):
            load_scenario(
                "homing", [wall, f"start=[{start}, 0, 0]", "beacon=[0, 1]"]
            )
    with pytest.raises(ScenarioError, match=r"^beacon"):
        load_scenario("homing", [wall, "start=[0, 0, 0]", "beacon=[3.01, 1]"])


@pytest.mark.parametrize("avoidance", AVOIDANCES)
def test_a_beacon_that_is_not_heard_is_searched_by_turning(avoidance, wall):
    scenario = load_scenario(
        "homing",
        [
            wall,
            "start=[0, 0, 0]",
            "beacon=[-3, 1]",
            f"avoidance={avoidance}",
            "station.beacon.outages=[[0, 9]]",
            "controller.search_turn_rate=0.6",
            "time_limit=2",
        ],
    )
    truth = run(scenario).trace["ground_truth"]
    assert truth[-1, 4] == pytest.approx(0.6, abs=0.05)
    assert np.hypot(*truth[-1, :2]) < 0.02


def test_the_calibration_has_noise_of_its_own_by_the_runs_seed(monkeypatch):
    drawn = []

    def calibrate(model, noise_db, rng):
        drawn.append(rng.normal())
        return model

    monkeypatch.setattr(homing, "calibrate", calibrate)
    scenario = load_scenario("homing", ["world=empty"])
    seeds = (5, 5, 6)
    for seed in seeds:
        homing.build(scenario, seed=seed)
    # The first of the two that the run's seed spawns.
    expected = [
        np.random.default_rng(
            int(np.random.SeedSequence(seed).generate_state(2)[0])
        ).normal()
        for seed in seeds
    ]
    assert drawn == expected
    assert drawn[0] == drawn[1] != drawn[2]
