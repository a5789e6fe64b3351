"""A floor plan as a building: its occupied cells are boxes of an SDF."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from drake_mobarm.exceptions import MapError
from drake_mobarm.world.floor_plan import FloorPlan
from drake_mobarm.world.world import FARTHEST

# Rows and columns: the first, and the one after the last.
Cells = tuple[int, int, int, int]

# Well over what the robot's lidar and its stowed arm can meet [m].
_HEIGHT = 1.2
_MOST_BOXES = 5000
_WALL, _FLOOR = "0.8 0.8 0.77 1", "0.93 0.92 0.89 1"


def floor_plan_sdf(plan: FloorPlan) -> str:
    """The SDF of a building 1.2 m high that has a floor plan.

    Free and unknown cells are floor: what is unknown may be anything, and
    single unknown cells amid free ones, which maps are full of, are nothing.

    Raises:
        MapError: it is too far from the origin, or of too many boxes.
    """
    rows, columns = plan.occupied.shape
    if not np.abs(plan.corners()).max() < FARTHEST:
        raise MapError(
            f"it reaches further than {FARTHEST / 1000:g} km from the origin"
        )
    # Its top is a millimetre under the floor that contact knows.
    floor = _box(plan, (0, rows, 0, columns), -0.019, -0.001)
    parts = [_part("visual", "floor", floor, _FLOOR)]
    for number, cells in enumerate(cover_cells(plan.occupied)):
        if number == _MOST_BOXES:
            raise MapError(
                f"its occupied cells are more than {_MOST_BOXES} boxes: clean "
                "it of noise, or make it coarser"
            )
        wall = _box(plan, cells, 0.0, _HEIGHT)
        parts.append(_part("collision", f"occupied_{number}", wall))
        parts.append(_part("visual", f"occupied_{number}", wall, _WALL))
    return (
        '<sdf version="1.9"><model name="floor_plan"><static>true</static>'
        f'<link name="building">{"".join(parts)}</link></model></sdf>'
    )


def _box(plan: FloorPlan, cells: Cells, low: float, high: float) -> str:
    """A box over cells, as `cover_cells` has them, between two heights [m]."""
    top, bottom, start, end = cells
    rows = len(plan.occupied)
    centre = plan.resolution * np.array(
        [(start + end) / 2, rows - (top + bottom) / 2]
    )
    x, y = plan.in_world(centre)
    width, depth = (
        plan.resolution * (end - start),
        plan.resolution * (bottom - top),
    )
    return (
        f"<pose>{x} {y} {(low + high) / 2} 0 0 {plan.origin[2]}</pose>"
        f"<geometry><box><size>{width} {depth} {high - low}</size></box>"
        "</geometry>"
    )


def _part(kind: str, name: str, body: str, color: str = "") -> str:
    if color:
        body += f"<material><diffuse>{color}</diffuse></material>"
    return f'<{kind} name="{name}">{body}</{kind}>'


def cover_cells(cells: NDArray[np.bool_]) -> Iterator[Cells]:
    """Few rectangles that together are exactly some cells of a grid.

    Each begins at the first cell that no rectangle has yet, and grows as far
    as the cells allow, first along its row or first along its column,
    whichever adds more. Rectangles may overlap.

    Args:
        cells: (rows, columns).
    """
    left = cells.copy()
    for row, column in np.argwhere(cells).tolist():
        if not left[row, column]:
            continue
        along = _grow(cells, row, column)
        start, end, top, bottom = _grow(cells.T, column, row)
        across = (top, bottom, start, end)
        added = [left[r[0] : r[1], r[2] : r[3]].sum() for r in (along, across)]
        best = along if added[0] >= added[1] else across
        left[best[0] : best[1], best[2] : best[3]] = False
        yield best


def _grow(cells: NDArray[np.bool_], row: int, column: int) -> Cells:
    """The rectangle of a cell's run in its row, and of the rows like it."""
    start, end = _run(cells[row, :], column)
    top, bottom = _run(np.all(cells[:, start:end], axis=1), row)
    return top, bottom, start, end


def _run(line: NDArray[np.bool_], at: int) -> tuple[int, int]:
    """Where the run of true values about an index begins and ends."""
    before, after = np.flatnonzero(~line[:at]), np.flatnonzero(~line[at:])
    start = int(before[-1]) + 1 if before.size else 0
    end = at + int(after[0]) if after.size else len(line)
    return start, end
