"""Ten buildings unlike the shipped worlds, with three errands in each.

They are what homing was not made with: mazes, offices, dead ends, traps whose
way round leads away from the beacon first, doors of 0.75 m, and things that the
lidar at 0.20 m does not see: chairs, low tables and racks, whose boards stand
on thin legs above its plane, and pallets below it.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

WALL = 0.1  # [m]
HEIGHT = 2.0  # [m]

Point = tuple[float, float]


@dataclass
class Building:
    """A floor plan in the making.

    Attributes:
        name: of the building.
        shapes: the shapes in SDF, each with its pose.
        errands: start [x, y, yaw] and beacon [x, y] by the errand's name.
    """

    name: str
    shapes: list[str] = field(default_factory=list)
    errands: dict[str, tuple[list[float], list[float]]] = field(
        default_factory=dict
    )

    def box(self, centre: Point, size: Point, low: float, high: float) -> None:
        """A box between two heights [m]."""
        (x, y), (a, b) = centre, size
        self._add(
            f"{x:.3f} {y:.3f} {(low + high) / 2:.3f}",
            f"<box><size>{a:.3f} {b:.3f} {high - low:.3f}</size></box>",
        )

    def column(self, centre: Point, radius: float) -> None:
        """An upright cylinder, of a wall's height."""
        x, y = centre
        self._add(
            f"{x:.3f} {y:.3f} {HEIGHT / 2:.3f}",
            f"<cylinder><radius>{radius:.3f}</radius>"
            f"<length>{HEIGHT:.3f}</length></cylinder>",
        )

    def _add(self, place: str, shape: str) -> None:
        self.shapes.append(
            f"<pose>{place} 0 0 0</pose><geometry>{shape}</geometry>"
        )

    def wall(self, a: Point, b: Point, *doors: Point) -> None:
        """A wall along x or y.

        Args:
            a: one end [m].
            b: the other end [m], greater than `a`.
            doors: where along the wall, in W, and how wide [m].
        """
        along = 0 if a[1] == b[1] else 1
        edges = [a[along] - WALL / 2]
        for middle, width in sorted(doors):
            edges += [middle - width / 2, middle + width / 2]
        edges.append(b[along] + WALL / 2)
        for low, high in zip(edges[::2], edges[1::2], strict=True):
            centre, size = [a[0], a[1]], [WALL, WALL]
            centre[along], size[along] = (low + high) / 2, high - low
            self.box((centre[0], centre[1]), (size[0], size[1]), 0, HEIGHT)

    def room(self, low: Point, high: Point) -> None:
        """Four walls around a rectangle."""
        (x0, y0), (x1, y1) = low, high
        for y in (y0, y1):
            self.wall((x0, y), (x1, y))
        for x in (x0, x1):
            self.wall((x, y0), (x, y1))

    def board(
        self, centre: Point, size: Point, height: float, leg: float
    ) -> None:
        """A board on four legs: a table, a chair's seat, a rack's shelf.

        Args:
            centre: [m].
            size: of the board [m].
            height: of its lower side [m].
            leg: thickness of a leg [m].
        """
        self.box(centre, size, height, height + 0.04)
        for sx in (-0.5, 0.5):
            for sy in (-0.5, 0.5):
                x = centre[0] + sx * (size[0] - leg)
                y = centre[1] + sy * (size[1] - leg)
                self.box((x, y), (leg, leg), 0, height)

    def chair(self, centre: Point) -> None:
        """A seat that the stowed arm would hit."""
        self.board(centre, (0.42, 0.42), 0.42, 0.03)

    def low_table(self, centre: Point, size: Point) -> None:
        """A table that the chassis would hit."""
        self.board(centre, size, 0.25, 0.05)

    def desk(self, centre: Point) -> None:
        """Two pedestals; the board between them is above the robot."""
        x, y = centre
        for side in (-0.6, 0.6):
            self.box((x + side, y), (0.4, 0.7), 0, 0.72)

    def errand(self, name: str, start: list[float], beacon: Point) -> None:
        """A start [x, y, yaw] and where the beacon is [m]."""
        self.errands[name] = (start, list(beacon))

    def write(self, folder: Path) -> Path:
        """Writes the building's SDF and returns its path."""
        collisions = "\n".join(
            f'<collision name="thing_{n}">{shape}</collision>\n'
            f'<visual name="thing_{n}">{shape}</visual>'
            for n, shape in enumerate(self.shapes)
        )
        path = folder / f"{self.name}.sdf"
        path.write_text(
            f'<sdf version="1.9"><model name="{self.name}">'
            '<static>true</static><link name="link">\n'
            f"{collisions}\n</link></model></sdf>\n"
        )
        return path


def maze() -> Building:
    """A maze of 7 x 7 cells with three walls taken out again."""
    building, count, pitch = Building("maze"), 7, 1.6
    rng = np.random.default_rng(7)
    # Walls by the two cells that they part; the maze opens some.
    walls = {
        ((i, j), (i + di, j + dj))
        for i in range(count)
        for j in range(count)
        for di, dj in ((1, 0), (0, 1))
        if i + di < count and j + dj < count
    }
    seen, stack = {(0, 0)}, [(0, 0)]
    while stack:
        i, j = stack[-1]
        near = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
        new = [
            (k, m)
            for k, m in near
            if 0 <= k < count and 0 <= m < count and (k, m) not in seen
        ]
        if not new:
            stack.pop()
            continue
        cell = new[rng.integers(len(new))]
        walls -= {((i, j), cell), (cell, (i, j))}
        seen.add(cell)
        stack.append(cell)
    ordered = sorted(walls)
    for index in rng.choice(len(ordered), 3, replace=False):
        walls.remove(ordered[index])
    building.room((0, 0), (count * pitch, count * pitch))
    for (i, _), (k, m) in sorted(walls):
        corner = (k * pitch, m * pitch)
        end = (corner[0], corner[1] + pitch)
        if k == i:
            end = (corner[0] + pitch, corner[1])
        building.wall(corner, end)
    building.errand("corner to corner", [0.8, 0.8, 0.0], (10.4, 10.4))
    building.errand("across a wall", [0.8, 0.8, 2.0], (2.4, 0.8))
    building.errand("along a side", [0.8, 10.4, -1.0], (10.4, 10.4))
    return building


def office() -> Building:
    """Ten rooms along a corridor; one is entered from its neighbour only."""
    building = Building("office")
    building.room((0, 0), (24, 13))
    building.wall(
        (0, 5.5), (24, 5.5), (0.7, 0.85), (8.7, 0.8), (12.7, 0.75), (20.7, 0.85)
    )
    building.wall(
        (0, 7.5), (24, 7.5), (5.2, 0.8), (11.0, 0.85), (12.9, 0.85), (23.2, 0.8)
    )
    for x in (4.0, 8.0, 12.0, 16.0, 20.0):
        # The second and the fifth room have no door to the corridor.
        doors = {8.0: (0.7, 0.8), 16.0: (4.6, 0.85)}
        building.wall((x, 0), (x, 5.5), *([doors[x]] if x in doors else []))
    for x in (6.0, 12.0, 18.0):
        building.wall((x, 7.5), (x, 13))
    for x in (2.0, 6.0, 10.0, 14.0, 18.0, 22.0):
        building.desk((x, 2.6))
        building.chair((x, 1.8))
    for x in (3.0, 9.0, 15.0, 21.0):
        building.low_table((x, 10.3), (1.2, 0.7))
        for side in (-0.4, 0.4):
            building.chair((x + side, 11.1))
    building.column((10.0, 6.5), 0.15)
    building.errand("next room", [3.3, 0.8, 0.5], (4.8, 0.9))
    building.errand("across the corridor", [22.5, 11.8, 1.0], (1.0, 1.0))
    building.errand("room behind a room", [0.8, 6.5, 0.0], (18.8, 0.8))
    return building


def long_hall() -> Building:
    """A hall of 36 m, shut by baffles but for 0.9 m at either side in turn."""
    building = Building("long_hall")
    building.room((0, 0), (36, 4.4))
    for number, x in enumerate((6.0, 12.0, 18.0, 24.0, 30.0)):
        building.wall((x, 0), (x, 4.4), (0.55 if number % 2 else 3.85, 0.9))
    building.low_table((9.0, 2.2), (1.4, 0.8))
    building.chair((21.0, 1.4))
    building.chair((21.0, 2.0))
    building.column((27.0, 2.2), 0.3)
    building.errand("end to end", [1.0, 0.8, 3.0], (35.0, 3.6))
    building.errand("behind a baffle", [11.2, 3.6, 0.0], (12.8, 3.8))
    building.errand("back", [35.0, 0.8, 1.0], (6.8, 0.8))
    return building


def spiral() -> Building:
    """A square spiral within a yard."""
    building = Building("spiral")
    building.room((-2, -2), (11.6, 11.6))
    corners = [(0.0, 0.0), (9.6, 0.0), (9.6, 9.6), (0.0, 9.6), (0.0, 1.6)]
    corners += [(8.0, 1.6), (8.0, 8.0), (1.6, 8.0), (1.6, 3.2)]
    corners += [(6.4, 3.2), (6.4, 6.4), (3.2, 6.4)]
    for a, b in pairwise(corners):
        building.wall(min(a, b), max(a, b))
    building.errand("in", [1.0, 0.8, 3.0], (4.8, 4.8))
    building.errand("out", [4.8, 4.8, 1.0], (10.6, 4.8))
    building.errand("next arm", [8.8, 4.8, 1.6], (7.2, 4.8))
    return building


def suite() -> Building:
    """Two rows of six rooms, one through the other, joined at one end."""
    building = Building("suite")
    building.room((0, 0), (24, 9))
    building.wall((0, 4.5), (24, 4.5), (23.2, 0.9))
    low_doors = ((0.8, 0.8), (3.7, 0.9), (0.8, 0.75), (3.7, 0.8), (0.8, 0.85))
    high_doors = ((8.2, 0.8), (5.3, 0.85), (8.2, 0.8), (5.3, 0.75), (6.8, 0.9))
    for number in range(5):
        x = 4.0 * (number + 1)
        building.wall((x, 0), (x, 4.5), low_doors[number])
        building.wall((x, 4.5), (x, 9), high_doors[number])
    for x in (2.0, 10.0, 18.0):
        building.low_table((x, 2.2), (1.0, 0.6))
        building.chair((x, 7.2))
    building.box((14.0, 2.2), (1.6, 1.0), 0, 0.7)
    building.box((6.0, 6.9), (1.2, 0.8), 0, 0.7)
    building.errand("through six rooms", [0.8, 3.6, 1.0], (22.8, 0.9))
    building.errand("behind the wall", [1.0, 3.7, 1.6], (1.0, 5.4))
    building.errand("half way round", [13.0, 3.7, 0.0], (13.2, 5.6))
    return building


def traps() -> Building:
    """A hall with pockets that open towards who comes."""
    building = Building("traps")
    building.room((0, 0), (22, 14))
    # A deep one, a wide one behind it, and one with lips, upside down.
    for x0, x1, y0, y1 in ((4.0, 9.0, 5.5, 8.5), (10.5, 14.0, 2.0, 12.0)):
        building.wall((x0, y0), (x1, y0))
        building.wall((x0, y1), (x1, y1))
        building.wall((x1, y0), (x1, y1))
    building.wall((16.0, 4.0), (20.0, 4.0))
    building.wall((16.0, 4.0), (16.0, 9.0))
    building.wall((20.0, 4.0), (20.0, 9.0))
    building.wall((16.0, 9.0), (20.0, 9.0), (18.0, 1.0))
    building.column((2.5, 3.0), 0.25)
    building.column((7.0, 12.0), 0.4)
    building.errand("out of a pocket", [8.2, 7.0, 0.0], (12.8, 7.0))
    building.errand("past all", [1.0, 7.0, 0.0], (21.2, 6.5))
    building.errand("out of lips", [18.0, 4.8, -1.5], (18.0, 2.6))
    return building


def dead_ends() -> Building:
    """Eight corridors side by side, of which the last one leads on."""
    building = Building("dead_ends")
    building.room((0, 0), (11, 12.8))
    for number in range(1, 8):
        y = 1.6 * number
        building.wall((1.6, y), (8.0, y))
    building.wall((8.0, 0), (8.0, 12.8), (12.0, 1.0))
    building.box((5.0, 5.6), (0.4, 0.5), 0, 1.0)
    building.chair((9.5, 8.0))
    building.errand("from the end of one", [7.2, 0.8, 0.0], (9.8, 0.9))
    building.errand("from the corridor", [0.8, 4.0, 0.0], (9.0, 4.0))
    building.errand("back", [10.2, 0.8, 1.6], (7.2, 2.4))
    return building


def warehouse() -> Building:
    """Aisles between pallets, and racks whose boards the lidar does not see."""
    building = Building("warehouse")
    building.room((0, 0), (18, 12))
    for y, x0 in ((2.2, 0.45), (6.6, 2.0)):
        for bay in range(12):
            building.box((x0 + 1.2 * bay + 0.6, y), (1.1, 0.8), 0, 0.144)
            building.box((x0 + 1.2 * bay + 0.6, y), (0.9, 0.7), 0.144, 1.2)
    for y, x0 in ((4.4, 6.0), (9.0, 1.8)):
        for bay in range(8):
            building.board((x0 + bay + 0.5, y), (1.0, 0.6), 0.24, 0.05)
    building.wall((16.0, 6.6), (18.0, 6.6))
    building.errand("next aisle", [1.0, 3.3, 0.0], (1.0, 1.0))
    building.errand("across a rack", [6.0, 10.4, -1.5], (6.0, 7.9))
    building.errand("across all", [9.0, 1.0, 1.5], (12.0, 10.8))
    return building


def clutter() -> Building:
    """A hall where furniture stands about."""
    building = Building("clutter")
    building.room((0, 0), (15, 11))
    rng = np.random.default_rng(3)
    corners = np.array([[1, 1], [14, 10], [1, 10], [14, 1], [7.5, 5.5]])
    placed: list[np.ndarray] = []
    while len(placed) < 38:
        place = rng.uniform([0.8, 0.8], [14.2, 10.2])
        if placed and np.linalg.norm(placed - place, axis=1).min() < 1.15:
            continue
        if np.linalg.norm(corners - place, axis=1).min() < 1.1:
            continue
        centre, kind = (place[0], place[1]), len(placed) % 5
        placed.append(place)
        if kind == 0:
            building.column(centre, rng.uniform(0.1, 0.35))
        elif kind == 1:
            building.low_table(centre, (0.9, 0.5))
        elif kind == 2:
            building.box(centre, (0.6, 0.4), 0, rng.uniform(0.3, 1.5))
        else:
            building.chair(centre)
    building.errand("corner to corner", [1.0, 1.0, 0.8], (14.0, 10.0))
    building.errand("other corners", [14.0, 1.0, 0.0], (1.0, 10.0))
    building.errand("middle", [1.0, 10.0, 3.0], (7.5, 5.5))
    return building


def ring() -> Building:
    """A corridor round a block, shut at one place, with rooms in the block."""
    building = Building("ring")
    building.room((0, 0), (16, 12))
    building.wall((1.5, 1.5), (14.5, 1.5))
    building.wall((1.5, 10.5), (14.5, 10.5), (3.0, 0.8))
    building.wall((1.5, 1.5), (1.5, 10.5))
    building.wall((14.5, 1.5), (14.5, 10.5))
    building.wall((8.0, 1.5), (8.0, 10.5), (2.4, 0.8))
    building.box((12.0, 0.75), (0.5, 1.4), 0, 1.0)
    building.low_table((5.0, 6.0), (1.2, 0.8))
    building.chair((11.0, 6.0))
    building.errand("into the block", [5.0, 0.75, 0.0], (5.0, 2.6))
    building.errand("past the shut place", [9.0, 0.75, 0.0], (15.2, 2.0))
    building.errand("out of the block", [13.5, 9.4, 0.0], (15.2, 9.4))
    return building


BUILDINGS = (
    maze,
    office,
    long_hall,
    spiral,
    suite,
    traps,
    dead_ends,
    warehouse,
    clutter,
    ring,
)
