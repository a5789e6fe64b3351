"""How much of the free space the optimised grid of section 4.3.3 covers.

    python benchmarks/grid_coverage.py [--seed 0] [--out FILE.md]

The plain grid is a lattice along the axes from the left and the lower side of
the map. "Heights" keeps its columns and gives each its best height; "optimised"
searches orientation and offset, too, which takes the seconds told.
"""

import argparse
import os
import platform
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # One core.

import numpy as np
import scipy
import shapely
from common import parse, publish

from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.grid import grid_at, optimise_grid, plain_grid
from drake_mobarm.robot.shape import HEIGHTS, RADIUS
from drake_mobarm.world.sdf import load_world

# Worlds, and a free place in each [m].
STARTS = {
    "small_house": (-8.0, -2.6),
    "bookstore": (4.0, 0.0),
    "cafe": (0.0, 0.0),
}
SIZES = (0.20, 0.30, 0.50)  # [m]


def measure(name: str, size: float, seed: int) -> dict[str, float | str]:
    """One row: a world at a grid size."""
    free = FreeSpace.of_world(load_world(name), STARTS[name], RADIUS, HEIGHTS)
    plain, heights = plain_grid(free, size), grid_at(free, size, 0, 0)
    started = time.perf_counter()
    best = optimise_grid(free, size, seed)
    seconds = time.perf_counter() - started
    return {
        "world": name,
        "size_m": size,
        "free_area_m2": free.area,
        "plain_coverage": plain.coverage,
        "heights_coverage": heights.coverage,
        "optimised_coverage": best.coverage,
        "orientation_deg": float(np.degrees(best.orientation)),
        "offset_sizes": best.offset,
        "plain_squares": len(plain.centres),
        "optimised_squares": len(best.centres),
        "search_s": seconds,
    }


def main() -> None:
    """Measures, prints and, if asked, writes the table."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seed", type=int, default=0)
    options = parse(parser)
    rows = [
        measure(name, size, options.seed) for name in STARTS for size in SIZES
    ]
    lines = [
        f"`python benchmarks/grid_coverage.py --seed {options.seed}`, robot's "
        f"radius {RADIUS:g} m, Python {platform.python_version()}, "
        f"numpy {np.__version__}, scipy {scipy.__version__}, "
        f"shapely {shapely.__version__}",
        "",
        "| world | size [m] | free area [m^2] | covered, plain [%] | covered, "
        "heights [%] | covered, optimised [%] | orientation [deg] | offset "
        "[sizes] | squares, plain | squares, optimised | search [s] |",
        "| --- |" + " ---: |" * 10,
    ]
    lines += [
        f"| {r['world']} | {r['size_m']:.2f} | {r['free_area_m2']:.1f} | "
        f"{100 * r['plain_coverage']:.1f} | "
        f"{100 * r['heights_coverage']:.1f} | "
        f"{100 * r['optimised_coverage']:.1f} | {r['orientation_deg']:.2f} | "
        f"{r['offset_sizes']:.3f} | {r['plain_squares']} | "
        f"{r['optimised_squares']} | {r['search_s']:.1f} |"
        for r in rows
    ]
    publish(lines, rows, options.out)


if __name__ == "__main__":
    main()
