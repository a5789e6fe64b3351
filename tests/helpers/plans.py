"""Floor plans in squares to try navigation on."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from drake_mobarm.world.occupancy import OccupancyGrid


def plan(*rows, cell=1.0, origin=(0.0, 0.0)):
    """A grid drawn as it is seen: the first row is the highest; # occupied."""
    occupied = np.array([[mark == "#" for mark in row] for row in rows[::-1]])
    return OccupancyGrid(np.array(origin, dtype=float), cell, occupied)


def plan_of(occupied, cell=1.0):
    """A grid of truth values, whose square [r, c] is at (c, r) times `cell`."""
    return OccupancyGrid(np.zeros(2), cell, np.asarray(occupied, dtype=bool))


def occupied_squares(longest=9):
    """Truth values (ny, nx), at most so many along each side."""
    shape = st.tuples(st.integers(1, longest), st.integers(1, longest))
    return shape.flatmap(lambda s: arrays(bool, s, elements=st.booleans()))


def free_regions(grid):
    """The sets of (column, row) that steps to the four sides connect."""
    left = {
        (int(c), int(r))
        for r, c in zip(*np.nonzero(~grid.occupied), strict=True)
    }
    regions = []
    while left:
        region, edge = set(), {left.pop()}
        while edge:
            region |= edge
            beside = {
                (c + dc, r + dr)
                for c, r in edge
                for dc, dr in ((1, 0), (-1, 0), (0, 1), (0, -1))
            }
            edge = beside & left
            left -= edge
        regions.append(region)
    return regions
