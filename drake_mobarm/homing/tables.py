"""Tables 2.3 and 2.4, and the sweep that chose tau of (2.3)."""

import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from drake_mobarm.geometry import Array
from drake_mobarm.homing.job import ESTIMATORS
from drake_mobarm.job import Column, Table, Trial, sample_path
from drake_mobarm.sensors.beacon import NOISE_CONFIGURATIONS
from drake_mobarm.world.rooms import ROOMS, reachable_floor, within_room
from drake_mobarm.world.sdf import load_world

AREA = 10.0
"""Targets of Table 2.3 lie within +- this of the start [m]."""

MIN_DISTANCE = 1.0
"""From start to target [m]: nearer would succeed without moving."""

TAUS = (1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 20.0)

# How the dissertation's robot drove, and how ours does.
_WAYS_TO_DRIVE = (("rules", "odometry"), ("map", "scan_matching"))

COLUMNS = (
    Column("mean_time_to_target_s", "time [s]", "time_to_target_s"),
    Column(
        "mean_net_velocity_m_per_s",
        "net velocity [m/s]",
        "net_velocity_m_per_s",
    ),
    Column(
        "mean_goal_position_error_m",
        "goal position error [m]",
        "goal_position_error_m",
    ),
    Column(
        "mean_final_position_error_m",
        "final position error [m]",
        "final_position_error_m",
    ),
    Column("mean_path_efficiency", "path efficiency", "path_efficiency"),
    Column("contacts", "contacts", "contacts", 0, "trials_with_contact"),
)


def open_space_trials(
    seed: int, count: int, *overrides: str
) -> Iterator[Trial]:
    """Table 2.3: `count` targets, quadrants in turn, for every case.

    All cases meet the same targets with the same seeds.
    """
    for index in range(count):
        rng = np.random.default_rng([seed, 23, index])
        beacon = _target_in_quadrant(rng, index % 4)
        run_seed = int(rng.integers(2**31))
        for estimator in ESTIMATORS:
            for noise in NOISE_CONFIGURATIONS:
                yield _trial(
                    f"{estimator}, configuration {noise}",
                    run_seed,
                    [0.0, 0.0, 0.0],
                    beacon,
                    *_OPEN_FLOOR,
                    f"estimator={estimator}",
                    f"noise={noise}",
                    *overrides,
                )


def house_trials(seed: int, count: int, *overrides: str) -> Iterator[Trial]:
    """Table 2.4: pairs of rooms in turn, each with new places and heading."""
    pairs = [(a, b) for a in ROOMS for b in ROOMS]
    for index in range(count):
        rng = np.random.default_rng([seed, 24, index])
        start_room, target_room = pairs[index % len(pairs)]
        start, beacon = _places(rng, start_room, target_room)
        yaw = float(rng.uniform(-np.pi, np.pi))
        run_seed = int(rng.integers(2**31))
        for estimator in ESTIMATORS:
            for avoidance, localization in _WAYS_TO_DRIVE:
                yield _trial(
                    f"{estimator}, {avoidance}",
                    run_seed,
                    [*start, yaw],
                    beacon,
                    f"estimator={estimator}",
                    f"avoidance={avoidance}",
                    f"station.localization={localization}",
                    *overrides,
                    start_room=start_room,
                    target_room=target_room,
                )


def half_turn(
    make_trials: Callable[..., Iterator[Trial]],
) -> Callable[[int, int], Iterator[Trial]]:
    """The same trials with an antenna that hears half a turn (section 2.5)."""

    def make_half_turn_trials(seed: int, count: int) -> Iterator[Trial]:
        return make_trials(
            seed, count, f"station.beacon.field_of_view={math.pi}"
        )

    return make_half_turn_trials


def told_trials(seed: int, count: int) -> Iterator[Trial]:
    """The filter with each noise, told each noise or none."""
    for index in range(count):
        rng = np.random.default_rng([seed, 12, index])
        beacon = _target_in_quadrant(rng, index % 4)
        run_seed = int(rng.integers(2**31))
        for noise in NOISE_CONFIGURATIONS:
            for told in (0, *NOISE_CONFIGURATIONS):
                yield _trial(
                    f"configuration {noise}, told {told or 'none'}",
                    run_seed,
                    [0.0, 0.0, 0.0],
                    beacon,
                    *_OPEN_FLOOR,
                    "estimator=filter",
                    f"noise={noise}",
                    f"filter.told={told}",
                )


def tau_trials(seed: int, count: int) -> Iterator[Trial]:
    """The open-space targets, with other seeds than Table 2.3's."""
    for index in range(count):
        rng = np.random.default_rng([seed, 20, index])
        beacon = _target_in_quadrant(rng, index % 4)
        run_seed = int(rng.integers(2**31))
        for tau in TAUS:
            for noise in NOISE_CONFIGURATIONS:
                yield _trial(
                    f"tau {tau:g}, configuration {noise}",
                    run_seed,
                    [0.0, 0.0, 0.0],
                    beacon,
                    *_OPEN_FLOOR,
                    "estimator=hybrid",
                    f"hybrid.tau={tau}",
                    f"noise={noise}",
                )


_OPEN_FLOOR = ("world=empty", "avoidance=none")


def _trial(
    case: str,
    seed: int,
    start: list[float],
    beacon: list[float],
    *overrides: str,
    **notes: str,
) -> Trial:
    x, y, yaw = start
    return Trial(
        case=case,
        seed=seed,
        overrides=(f"start={start}", f"beacon={beacon}", *overrides),
        notes=notes
        | {
            "start_x_m": x,
            "start_y_m": y,
            "start_yaw_rad": yaw,
            "beacon_x_m": beacon[0],
            "beacon_y_m": beacon[1],
        },
    )


def _target_in_quadrant(rng: np.random.Generator, quadrant: int) -> list[float]:
    sign_x, sign_y = ((1, 1), (-1, 1), (-1, -1), (1, -1))[quadrant]
    while True:
        x, y = rng.uniform(0, AREA, 2)
        if np.hypot(x, y) >= MIN_DISTANCE:
            return [float(sign_x * x), float(sign_y * y)]


def _places(
    rng: np.random.Generator, start_room: str, target_room: str
) -> tuple[list[float], list[float]]:
    """Start and target, uniform over the reachable floor of their rooms."""
    while True:
        places = []
        for room in (start_room, target_room):
            floor = within_room(
                reachable_floor(load_world("small_house")), room
            )
            places.append(floor[rng.integers(len(floor))])
        if np.linalg.norm(places[0] - places[1]) >= MIN_DISTANCE:
            return places[0].tolist(), places[1].tolist()


def _draw(
    name: str, rows: Sequence[dict[str, Any]], paths: Sequence[Array]
) -> Mapping[str, Any]:
    # matplotlib is imported when a picture is made.
    from drake_mobarm.homing.table_pictures import pictures

    return pictures(name, rows, paths)


_DISSERTATION = ("success_percent", *(c.name for c in COLUMNS))


def _table_2_3(case: str) -> dict[str, float]:
    columns = {
        "1": (100, 14.24, 0.62, 0.05, 0.25, 0.90),
        "2": (100, 12.68, 0.57, 0.05, 0.24, 0.88),
        "3": (100, 12.10, 0.60, 0.06, 0.25, 0.90),
        "4": (100, 12.85, 0.60, 0.06, 0.25, 0.89),
        "5": (100, 12.27, 0.57, 0.11, 0.15, 0.91),
    }
    return dict(zip(_DISSERTATION, columns[case[-1]], strict=False))


def _table_2_4(case: str) -> dict[str, float]:
    figures = (96, 44.91, 0.22, 0.12, 0.23, 0.69)
    return dict(zip(_DISSERTATION, figures, strict=False))


def _no_figures(case: str) -> dict[str, float]:
    return {}


_DEFINITIONS = (
    "A run ends at the first check (0.05 s) after the estimator says that it "
    "has arrived; errors are against the true position of the beacon, "
    "odometry's drift included."
)
_OPEN_SPACE = (
    "The same targets for every case, at least 1 m from the start. "
    + _DEFINITIONS
)
_HOUSE = (
    "Start and target are where a disc of 0.28 m radius can stand, on the "
    "house's connected floor, at least 1 m apart. " + _DEFINITIONS
)

TABLES = {
    name: Table(
        title=title,
        conditions=conditions,
        scenario="homing",
        trials=trials,
        make_trials=make_trials,
        columns=COLUMNS,
        dissertation=dissertation,
        sample=sample_path,
        draw=functools.partial(_draw, name),
    )
    for name, title, conditions, trials, make_trials, dissertation in (
        (
            "2.3",
            "Table 2.3: homing in open space",
            _OPEN_SPACE,
            40,
            open_space_trials,
            _table_2_3,
        ),
        (
            "2.4",
            "Table 2.4: homing in the small house, configuration 5",
            _HOUSE,
            80,
            house_trials,
            _table_2_4,
        ),
        (
            "2.3-half-turn",
            "Table 2.3 with an antenna that hears half a turn",
            _OPEN_SPACE,
            40,
            half_turn(open_space_trials),
            _table_2_3,
        ),
        (
            "2.4-half-turn",
            "Table 2.4 with an antenna that hears half a turn",
            _HOUSE,
            80,
            half_turn(house_trials),
            _table_2_4,
        ),
        (
            "told",
            "The noise of the readings against what the filter is told of it",
            _OPEN_SPACE,
            20,
            told_trials,
            _no_figures,
        ),
        (
            "tau",
            "Choosing tau of (2.3), for the hybrid estimator",
            _OPEN_SPACE,
            20,
            tau_trials,
            _table_2_3,
        ),
    )
}
