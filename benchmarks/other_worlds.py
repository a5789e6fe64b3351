"""Homing in ten buildings that it was not made with, three errands in each.

    python benchmarks/other_worlds.py [--avoidance rules] [--estimator filter]
        [--seeds 1] [--only TEXT] [--set KEY.PATH=VALUE]... [--jobs 1]
        [--out FILE.md]

The buildings of `buildings.py` are written as SDF to runs/other_worlds. A run
has 30 s and the shortest way at 0.3 m/s; "shortest" is the shortest way of a
disc of 0.28 m in the true building, and efficiency is that, less the distance
that is left, over the way travelled. Runs are saved in runs/ as they finish:
the same command goes on where it was interrupted. Exit code 1 where one has no
success.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from buildings import BUILDINGS
from common import publish
from homing_sweep import (
    WORKING,
    Row,
    describe,
    free_floor,
    parse_sweep,
    shortest_ways,
    sweep,
)

SLOW = 0.3  # [m/s]
LOOK_AROUND = 30.0  # [s]


def make_cases(folder: Path) -> Iterator[Row]:
    """Every errand; writes the buildings into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for make in BUILDINGS:
        building = make()
        path = str(building.write(folder))
        for name, (start, beacon) in building.errands.items():
            grid, _ = free_floor(path)
            shortest = shortest_ways(path, start[:2])[grid.index(beacon)]
            yield {
                "name": f"{building.name}: {name}",
                "seed": 0,
                "shortest_m": round(float(shortest), 2),
                "overrides": [
                    f"world={path}",
                    f"start={start}",
                    f"beacon={beacon}",
                    f"time_limit={LOOK_AROUND + shortest / SLOW:.0f}",
                ],
            }


def efficiency(row: Row) -> float:
    """Of a run that succeeded."""
    needed = row["shortest_m"] - row["final_position_error_m"]
    return float(needed / row["distance_travelled_m"])


def line(row: Row) -> str:
    """A row of the table."""
    cells = [row["name"], str(row["seed"]), f"{row['shortest_m']:.1f}"]
    if row["success"]:
        cells += [
            f"{row['time_to_target_s']:.1f}",
            f"{efficiency(row):.2f}",
            f"{row['final_position_error_m']:.2f}",
        ]
    else:
        cells += [row["reason"], "", ""]
    cells.append(f"{row['contacts']:.0f}" if "contacts" in row else "")
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Runs what is missing, prints and writes the table."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    options = parse_sweep(parser)
    cases = list(make_cases(WORKING / "other_worlds"))
    rows = sweep("other_worlds", cases, options)
    reached = [row for row in rows if row["success"]]
    lines = [
        f"{describe(options)}: "
        f"{len(reached)} of {len(rows)} reached, "
        f"{sum(row.get('contacts', 0) for row in rows):.0f} contacts.",
        "",
        "| errand | seed | shortest way [m] | time [s] | path efficiency | "
        "final error [m] | contacts |",
        "| --- |" + " ---: |" * 6,
        *map(line, rows),
    ]
    publish(lines, rows, options.out)
    sys.exit(len(reached) < len(rows))


if __name__ == "__main__":
    main()
