"""A world as plain data, which laws use without loading Drake."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_mobarm.world.obstacles import Obstacle

WORLDS = Path(__file__).resolve().parent.parent / "models" / "worlds"
"""The folder of the shipped worlds and their floor plans."""

FARTHEST = 10_000.0
"""How far anything may be from W's origin along each axis [m]. Beyond it, the
single precision of what is drawn is coarser than a millimetre."""


@dataclass(frozen=True, eq=False)
class World:
    """A building: its name, its SDF file, and what stands in it.

    A world equals itself only.

    Attributes:
        name: of the file.
        path: of the file.
        obstacles: what can be touched, for lidar and maps.
        geometries: everything, as Drake's GeometryInstance, in W, with its
            properties, for contact and drawing.
    """

    name: str
    path: Path
    obstacles: tuple[Obstacle, ...]
    geometries: tuple[Any, ...]
