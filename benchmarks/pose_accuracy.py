"""How far off the estimated pose is while the robot drives about.

    python benchmarks/pose_accuracy.py [--minutes 5] [--drives 2]
        [--worlds small_house bookstore cafe] [--out FILE]

A wheel's radius is believed 1 % too large and the track 1 % too small, which
adds up in turns; the encoders have 4096 ticks. The robot follows the shortest
ways between random places, as it should by its true pose, without dynamics and
contact; its lidar sees the world. Odometry alone stands beside localization on
the shipped floor plan: as it is; with things about that it does not show; with
a wide box before the lidar for 5 s of every 10 s; with half of the rays
missing; and on a true plan of finer cells. Times are processor time.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # One core.

import math
import platform
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from common import parse, processor, publish, use_one_core
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from drake_mobarm.geometry import Array, wrap_angle
from drake_mobarm.robot.differential_drive import DifferentialDrive
from drake_mobarm.robot.shape import HEIGHTS, LIDAR_HEIGHT
from drake_mobarm.sensors.distance_field import DistanceField
from drake_mobarm.sensors.lidar import (
    LidarParameters,
    cast_rays,
    ray_angles,
    read_lidar,
)
from drake_mobarm.sensors.localization import (
    LocalizationParameters,
    begin,
    localize,
)
from drake_mobarm.sensors.odometry import (
    OdometryParameters,
    believed_base,
    count_ticks,
    integrate_wheels,
    scale_wheels,
)
from drake_mobarm.sensors.scan_matching import compose
from drake_mobarm.world import FloorPlan, read_floor_plan
from drake_mobarm.world.obstacles import outlines, outlines_to_segments
from drake_mobarm.world.occupancy import OccupancyGrid
from drake_mobarm.world.sdf import load_world
from drake_mobarm.world.world import WORLDS

FAULTS = OdometryParameters(
    radius_error=0.01, track_error=-0.01, encoder_ticks=4096
)
LIDAR = LidarParameters()
STEP = 0.01  # Of odometry [s].
SPEED, TURN, BRAKE = 0.6, 1.5, 1.0  # [m/s, rad/s, m/s^2]
LOOK_AHEAD = 0.25  # [m]
CLEARANCE = 0.36  # Of the robot's centre to what it can touch [m].
BOXES = 40
FINE = 0.025  # Cells of the finer plan [m].
GOOD = (0.02, math.radians(0.5))  # Of position and yaw [m, rad].

Spoil = Callable[[int, Array], Array]
"""What becomes of a scan: of its number and its ranges [m]."""


class Drive(NamedTuple):
    """A drive at the lidar's samples.

    Attributes:
        true: X_WB, (n, 3).
        odometry: (n, 3).
    """

    true: Array
    odometry: Array


def find_way(things: list[Array], length: float, seed: int) -> Array:
    """A way in W [m], (n, 2), between random places, rather in the open.

    Args:
        things: outlines of what the robot can touch [m].
        length: of the way, at least [m].
        seed: of the places.
    """
    rng = np.random.default_rng(seed)
    grid = OccupancyGrid.from_outlines(things, 0.1)
    regions = grid.regions(CLEARANCE)
    inside = regions == 2 + np.argmax(np.bincount(regions.ravel())[2:])
    number = np.full(inside.shape, -1)
    number[inside] = np.arange(np.count_nonzero(inside))
    places = grid.centres()[inside]
    near = np.exp((CLEARANCE - grid.clearance()[inside]) / 0.15)
    edges = []
    for rows, columns in ((0, 1), (1, 0), (1, 1), (1, -1)):
        moved = np.roll(number, (-rows, -columns), axis=(0, 1))
        linked = (number >= 0) & (moved >= 0)
        a, b = number[linked], moved[linked]
        cost = math.hypot(rows, columns) * (1 + near[a] + near[b])
        edges.append(np.stack([a, b, cost]))
    a, b, cost = np.hstack(edges)
    graph = csr_matrix((cost, (a.astype(int), b.astype(int))))
    graph.resize(len(places), len(places))
    here, way = int(rng.integers(len(places))), []
    while sum(map(math.dist, way, way[1:])) < length:
        _, before = dijkstra(graph, False, here, return_predecessors=True)
        path = [goal := int(rng.integers(len(places)))]
        while path[-1] != here:
            path.append(int(before[path[-1]]))
        way += places[path[::-1]].tolist()
        here = goal
    return np.array(way)


def follow(way: Array, seconds: float) -> Drive:
    """A robot that follows a way by its true pose."""
    base = DifferentialDrive()
    believed = believed_base(base, FAULTS)
    x, y = way[0].tolist()
    ahead = next(p for p in way.tolist() if math.dist(p, way[0]) > LOOK_AHEAD)
    pose = told = (x, y, math.atan2(ahead[1] - y, ahead[0] - x))
    angles = counted = (0.0, 0.0)
    true, odometry = [], []
    passed, v = 0, 0.0
    for step in range(round(seconds / STEP)):
        if step % round(1 / (LIDAR.rate * STEP)) == 0:
            true.append(pose)
            odometry.append(told)
        x, y, yaw = pose
        while (
            passed < len(way) - 1
            and math.dist(way[passed], (x, y)) < LOOK_AHEAD
        ):
            passed += 1
        to_x, to_y = (way[passed] - (x, y)).tolist()
        angle = float(wrap_angle(math.atan2(to_y, to_x) - yaw))
        wanted = SPEED * max(math.cos(angle), 0.0) ** 3
        v += max(-BRAKE * STEP, min(BRAKE * STEP, wanted - v))
        w = max(-TURN, min(TURN, 2.5 * angle))
        left, right = base.wheel_speeds(v * STEP, w * STEP)
        pose = integrate_wheels(pose, (left, right), base)
        angles = (angles[0] + left, angles[1] + right)
        now = tuple(count_ticks(a, FAULTS.encoder_ticks) for a in angles)
        turned = (now[0] - counted[0], now[1] - counted[1])
        told = integrate_wheels(told, scale_wheels(turned, FAULTS), believed)
        counted = (now[0], now[1])
    return Drive(np.array(true), np.array(odometry))


def scatter_boxes(way: Array, seed: int) -> list[Array]:
    """Outlines of boxes beside a way [m], 0.1 m to 0.5 m wide."""
    rng = np.random.default_rng(seed)
    found: list[Array] = []
    while len(found) < BOXES:
        middle = way[rng.integers(len(way))] + rng.normal(0, 1, 2)
        half = rng.uniform(0.05, 0.25, 2)
        off = np.hypot(*(way - middle).T).min() - np.hypot(*half)
        if off > 0.15:
            found.append(middle + half * [[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return found


def block(scan: int, ranges: Array) -> Array:
    """A scan with a box 0.8 m wide 0.4 m ahead, half of the time."""
    angles = ray_angles(ranges.size)
    ahead = np.abs(angles) <= math.pi / 4
    if scan // 50 % 2:
        face = 0.4 / np.cos(angles[ahead])
        ranges[ahead] = np.minimum(ranges[ahead], face)
    return ranges


def lose_rays(scan: int, ranges: Array) -> Array:
    """A scan of which half the rays are missing."""
    lost = np.random.default_rng(scan).uniform(size=ranges.size) < 0.5
    return np.where(lost, math.nan, ranges)


def keep(scan: int, ranges: Array) -> Array:
    """The scan itself."""
    return ranges


def estimate(
    drive: Drive, things: list[Array], field: DistanceField, spoil: Spoil
) -> tuple[Array, list[float]]:
    """The estimated poses, (n, 3), and the times of the updates [s].

    Args:
        drive: true poses and odometry.
        things: outlines of what the lidar sees [m].
        field: of the floor plan.
        spoil: what becomes of each scan.
    """
    sides = outlines_to_segments(things)
    rng = np.random.default_rng(0)
    parameters = LocalizationParameters()
    state, poses, times = begin(parameters), [], []
    for scan, (pose, told) in enumerate(zip(*drive, strict=True)):
        ranges = read_lidar(
            cast_rays(*sides, pose, LIDAR.rays),
            rng.normal(size=LIDAR.rays),
            LIDAR.range_max,
            LIDAR.noise,
        )
        ranges = spoil(scan, ranges)
        started = time.process_time()
        state = localize(
            state, told, ranges, LIDAR.range_max, field, parameters
        )
        times.append(time.process_time() - started)
        poses.append(compose(state.correction, told))
    return np.array(poses), times


def summarise(
    off: list[Array], times: list[float] | None = None
) -> dict[str, float]:
    """The figures of errors of poses, (n, 3) each [m, m, rad]."""
    errors = np.vstack(off)
    position = np.hypot(*errors[:, :2].T)
    yaw = np.abs(wrap_angle(errors[:, 2]))
    good = (position < GOOD[0]) & (yaw < GOOD[1])
    figures = {
        "position_95_m": np.quantile(position, 0.95),
        "position_max_m": position.max(),
        "yaw_95_rad": np.quantile(yaw, 0.95),
        "yaw_max_rad": yaw.max(),
        "share_good": np.mean(good),
    }
    if times is not None:
        figures["update_median_s"] = np.median(times)
        figures["update_99_s"] = np.quantile(times, 0.99)
    return {name: float(value) for name, value in figures.items()}


def measure(
    name: str, drives: int, seconds: float
) -> dict[str, dict[str, float]]:
    """The figures of a world, by the case."""
    world = load_world(name)
    seen = outlines(world.obstacles, LIDAR_HEIGHT, LIDAR_HEIGHT)
    touched = outlines(world.obstacles, *HEIGHTS)
    plans = [
        read_floor_plan(WORLDS / f"{name}.yaml"),
        FloorPlan.from_world(world, FINE),
    ]
    shipped, fine = (
        DistanceField.from_points(
            plan.points(), plan.resolution, plan.origin[2]
        )
        for plan in plans
    )
    on_plan = f"shipped plan, cells of {100 * plans[0].resolution:g} cm"
    off: dict[str, list[Array]] = {}
    times: dict[str, list[float]] = {}
    for seed in range(drives):
        way = find_way(touched, 1.2 * SPEED * seconds, seed)
        drive = follow(way, seconds)
        boxes = scatter_boxes(way, seed)
        off.setdefault("odometry alone", []).append(drive.odometry - drive.true)
        for case, things, field, spoil in (
            (on_plan, seen, shipped, keep),
            (f"... {BOXES} boxes not on it", [*seen, *boxes], shipped, keep),
            ("... a box before the lidar", seen, shipped, block),
            ("... half of the rays missing", seen, shipped, lose_rays),
            (f"true plan, cells of {100 * FINE:g} cm", seen, fine, keep),
        ):
            poses, took = estimate(drive, things, field, spoil)
            off.setdefault(case, []).append(poses - drive.true)
            times.setdefault(case, []).extend(took)
    return {case: summarise(off[case], times.get(case)) for case in off}


def tell(
    measured: dict[str, dict[str, dict[str, float]]],
    drives: int,
    minutes: float,
) -> list[str]:
    """The figures as lines of Markdown."""
    lines = [
        f"`python benchmarks/pose_accuracy.py --minutes {minutes:g} "
        f"--drives {drives}`",
        "",
        f"{drives} x {minutes:g} min a world, wheel radius believed "
        f"{FAULTS.radius_error:+.0%}, track {FAULTS.track_error:+.0%}, "
        f"{FAULTS.encoder_ticks} ticks a turn, {LIDAR.rays} rays at "
        f"{LIDAR.rate:g} Hz; one core of {processor()}; Python "
        f"{platform.python_version()}, numpy {np.__version__}.",
        "",
        "| world | pose by | position, 95 % [cm] | largest [cm] | "
        "yaw, 95 % [deg] | largest [deg] | within 2 cm and 0.5 deg [%] | "
        "update, median [ms] | update, 99 % [ms] |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for world, cases in measured.items():
        for case, found in cases.items():
            took = [
                f"{1e3 * found[key]:.2f}" if key in found else ""
                for key in ("update_median_s", "update_99_s")
            ]
            lines.append(
                f"| {world} | {case} | {100 * found['position_95_m']:.2f} | "
                f"{100 * found['position_max_m']:.2f} | "
                f"{math.degrees(found['yaw_95_rad']):.2f} | "
                f"{math.degrees(found['yaw_max_rad']):.2f} | "
                f"{100 * found['share_good']:.1f} | {' | '.join(took)} |"
            )
    return lines


def main() -> None:
    """Measures, prints, and writes what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--drives", type=int, default=2)
    parser.add_argument(
        "--worlds", nargs="+", default=["small_house", "bookstore", "cafe"]
    )
    options = parse(parser)
    use_one_core()
    measured = {
        world: measure(world, options.drives, 60 * options.minutes)
        for world in options.worlds
    }
    publish(
        tell(measured, options.drives, options.minutes), measured, options.out
    )


if __name__ == "__main__":
    main()
