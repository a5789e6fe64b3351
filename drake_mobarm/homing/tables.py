"""Tables 2.3 and 2.4, and the sweep that chose tau of (2.3)."""

import functools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from drake_mobarm.geometry import Array
from drake_mobarm.homing.hybrid import HybridParameters
from drake_mobarm.runtime.scenarios import (
    ESTIMATORS,
    ROBOT_HEIGHTS,
    HomingScenario,
    load_scenario,
)
from drake_mobarm.runtime.simulation import run
from drake_mobarm.runtime.sweep import Outcome, Trial
from drake_mobarm.sensors.beacon import NOISE_CONFIGURATIONS
from drake_mobarm.world.obstacles import outlines
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.sdf import load_world

AREA = 10.0
"""Targets of Table 2.3 lie within +- this of the start [m]."""

STAND_RADIUS = 0.28
"""Start and target are where a disc of this radius can stand [m]."""

MIN_DISTANCE = 1.0
"""From start to target [m]: nearer would succeed without moving."""

ROOMS: dict[str, tuple[float, float, float, float]] = {
    "bedroom": (-9.30, -2.50, -5.50, 3.10),
    "living_room": (-2.50, 4.84, -5.50, 1.20),
    "fitness_room": (-2.50, 4.84, 1.20, 5.50),
    "kitchen": (4.84, 9.30, -5.50, 3.10),
}
"""Rooms of the small house: x_min, x_max, y_min, y_max [m]."""

TAUS = (1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 20.0)

_PATH_PERIOD = 0.5


def open_space_trials(seed: int, count: int) -> Iterator[dict[str, Any]]:
    """Table 2.3: `count` targets, quadrants in turn, for every case.

    All cases meet the same targets with the same seeds.
    """
    for index in range(count):
        rng = np.random.default_rng([seed, 23, index])
        beacon = _target_in_quadrant(rng, index % 4)
        run_seed = int(rng.integers(2**31))
        for estimator in ESTIMATORS:
            for noise in NOISE_CONFIGURATIONS:
                yield {
                    "case": f"{estimator}, configuration {noise}",
                    "estimator": estimator,
                    "noise": noise,
                    "seed": run_seed,
                    "start": [0.0, 0.0, 0.0],
                    "beacon": beacon,
                }


def house_trials(seed: int, count: int) -> Iterator[dict[str, Any]]:
    """Table 2.4: pairs of rooms in turn, each with new places and heading."""
    pairs = [(a, b) for a in ROOMS for b in ROOMS]
    for index in range(count):
        rng = np.random.default_rng([seed, 24, index])
        start_room, target_room = pairs[index % len(pairs)]
        start, beacon = _places(rng, start_room, target_room)
        yaw = float(rng.uniform(-np.pi, np.pi))
        run_seed = int(rng.integers(2**31))
        for estimator in ESTIMATORS:
            yield {
                "case": estimator,
                "estimator": estimator,
                "noise": 5,
                "seed": run_seed,
                "start": [*start, yaw],
                "beacon": beacon,
                "start_room": start_room,
                "target_room": target_room,
            }


def tau_trials(seed: int, count: int) -> Iterator[dict[str, Any]]:
    """The open-space targets, with other seeds than Table 2.3's."""
    for index in range(count):
        rng = np.random.default_rng([seed, 20, index])
        beacon = _target_in_quadrant(rng, index % 4)
        run_seed = int(rng.integers(2**31))
        for tau in TAUS:
            for noise in NOISE_CONFIGURATIONS:
                yield {
                    "case": f"tau {tau:g}, configuration {noise}",
                    "estimator": "hybrid",
                    "tau": tau,
                    "noise": noise,
                    "seed": run_seed,
                    "start": [0.0, 0.0, 0.0],
                    "beacon": beacon,
                }


def do_trial(trial: Trial) -> Outcome:
    """Runs one trial of any of the three.

    Returns:
        "row": what is known of it, and "path": time [s], the robot's x, y and
        the estimate's x, y [m], every half second.
    """
    in_house = "start_room" in trial
    # The shipped scenario, as a user would run it.
    shipped = load_scenario("homing")
    assert isinstance(shipped, HomingScenario)
    scenario = replace(
        shipped,
        world="small_house" if in_house else "empty",
        avoidance="rules" if in_house else "none",
        start=list(trial["start"]),
        beacon=list(trial["beacon"]),
        noise=trial["noise"],
        estimator=trial["estimator"],
    )
    if "tau" in trial:
        scenario = replace(scenario, hybrid=HybridParameters(tau=trial["tau"]))
    result = run(scenario, trial["seed"])
    trace = result.trace
    stride = round(_PATH_PERIOD / (trace["t"][1] - trace["t"][0]))
    kept = np.unique(
        np.append(np.arange(0, len(trace["t"]), stride), len(trace["t"]) - 1)
    )
    path = np.column_stack(
        [
            trace["t"],
            trace["ground_truth"][:, :2],
            trace["estimated_target"][:, :2],
        ]
    )[kept]
    x, y, yaw = trial["start"]
    rooms = {
        key: trial[key] for key in ("start_room", "target_room") if key in trial
    }
    row = {
        "trial": trial["trial"],
        "case": trial["case"],
        "seed": trial["seed"],
        **rooms,
        "start_x_m": x,
        "start_y_m": y,
        "start_yaw_rad": yaw,
        "beacon_x_m": trial["beacon"][0],
        "beacon_y_m": trial["beacon"][1],
        "success": result.success,
        "reason": result.reason,
        **result.metrics,
    }
    return {"row": row, "path": np.round(path, 4).tolist()}


def _target_in_quadrant(rng: np.random.Generator, quadrant: int) -> list[float]:
    sign_x, sign_y = ((1, 1), (-1, 1), (-1, -1), (1, -1))[quadrant]
    while True:
        x, y = rng.uniform(0, AREA, 2)
        if np.hypot(x, y) >= MIN_DISTANCE:
            return [float(sign_x * x), float(sign_y * y)]


def _places(
    rng: np.random.Generator, start_room: str, target_room: str
) -> tuple[list[float], list[float]]:
    """Uniform over the floor of each room that the robot can reach."""
    while True:
        places = []
        for room in (start_room, target_room):
            floor = _reachable_floor()
            x_min, x_max, y_min, y_max = ROOMS[room]
            floor = floor[
                (floor[:, 0] >= x_min)
                & (floor[:, 0] < x_max)
                & (floor[:, 1] >= y_min)
                & (floor[:, 1] < y_max)
            ]
            places.append(floor[rng.integers(len(floor))])
        if np.linalg.norm(places[0] - places[1]) >= MIN_DISTANCE:
            return places[0].tolist(), places[1].tolist()


@functools.cache
def _reachable_floor() -> Array:
    """Cell centres [m], (n, 2), of the house's largest connected floor."""
    world = load_world("small_house")
    grid = OccupancyGrid.from_outlines(
        outlines(world.obstacles, *ROBOT_HEIGHTS)
    )
    regions = grid.regions(STAND_RADIUS)
    indoors = np.bincount(regions.ravel())
    indoors[:2] = 0
    floor: Array = grid.centres()[regions == np.argmax(indoors)]
    return floor
