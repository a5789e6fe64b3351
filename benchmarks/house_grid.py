"""Homing from every free place of the small house on a grid of 1 m.

    python benchmarks/house_grid.py [--avoidance rules] [--estimator filter]
        [--seeds 1] [--only TEXT] [--set KEY.PATH=VALUE]... [--jobs 1]
        [--out FILE.md]

Starts are where a disc of 0.28 m can stand and drive to the shipped scenario's
beacon, at least 1 m from it, each with a random heading of its own. Runs are
saved in runs/ as they finish: the same command goes on where it was
interrupted. Exit code 1 where one has no success.
"""

import argparse
import sys
from collections.abc import Iterator

import numpy as np
from common import publish
from homing_sweep import (
    Row,
    describe,
    free_floor,
    parse_sweep,
    shortest_ways,
    sweep,
)

from drake_mobarm import load_scenario

WORLD = "small_house"
SPACING = 1.0  # [m]
MIN_DISTANCE = 1.0  # From the beacon [m]: nearer would succeed at once.


def make_cases() -> Iterator[Row]:
    """A case a start, by rows of the grid."""
    beacon = load_scenario("homing").beacon
    ways = shortest_ways(WORLD, beacon)
    grid, _ = free_floor(WORLD)
    low, high = grid.origin, grid.centres()[-1, -1]
    first, last = np.ceil(low / SPACING), np.floor(high / SPACING)
    for y in SPACING * np.arange(first[1], last[1] + 1):
        for x in SPACING * np.arange(first[0], last[0] + 1):
            shortest = ways[grid.index([x, y])]
            far = np.hypot(x - beacon[0], y - beacon[1]) >= MIN_DISTANCE
            if np.isfinite(shortest) and far:
                rng = np.random.default_rng([int(100 + x), int(100 + y)])
                yaw = round(rng.uniform(-np.pi, np.pi), 3)
                yield {
                    "name": f"({x:g}, {y:g})",
                    "seed": 0,
                    "shortest_m": round(float(shortest), 2),
                    "overrides": [
                        f"start=[{x:g}, {y:g}, {yaw}]",
                        "time_limit=120",
                    ],
                }


def main() -> None:
    """Runs what is missing, prints and writes the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    options = parse_sweep(parser)
    rows = sweep("house_grid", list(make_cases()), options)
    reached = [row for row in rows if row["success"]]
    times = sorted(row["time_to_target_s"] for row in reached)
    lines = [
        describe(options),
        "",
        "| starts | runs | reached | longest time [s] | median [s] | contacts "
        "| runs with contact |",
        "|" + " ---: |" * 7,
        f"| {len(rows) // options.seeds} | {len(rows)} | {len(reached)} | "
        f"{max(times, default=np.nan):.1f} | "
        f"{np.median(times) if times else np.nan:.1f} | "
        f"{sum(row.get('contacts', 0) for row in rows):.0f} | "
        f"{sum(row.get('contacts', 0) > 0 for row in rows)} |",
    ]
    slowest = sorted(reached, key=lambda row: -row["time_to_target_s"])[:5]
    for row in slowest:
        lines.append(f"- {row['time_to_target_s']:.1f} s: `{row['command']}`")
    for row in rows:
        if not row["success"]:
            lines.append(f"- {row['reason']}: `{row['command']}`")
    publish(lines, rows, options.out)
    sys.exit(len(reached) < len(rows))


if __name__ == "__main__":
    main()
