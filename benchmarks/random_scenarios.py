"""Random scenarios: valid, nearly valid and odd values of every key."""

import dataclasses
import math
import typing
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from buildings import BUILDINGS
from homing_sweep import STAND_RADIUS, free_floor

from drake_mobarm.geometry import Array
from drake_mobarm.job import find_job
from drake_mobarm.world.sdf import world_names

JOBS = ("homing", "homing", "homing", "placement")
PLACES = {
    "homing": ("start", "beacon"),
    "placement": ("start", "target", "approach"),
}
_CHOICES = {
    "estimator": ("hybrid", "filter"),
    "avoidance": ("none", "rules", "map"),
    "grid": ("optimised", "plain"),
    "model": ("beacon_1", "beacon_2"),
    "localization": ("odometry", "scan_matching"),
    "diagram": ("homing", "placement"),
}

_NUMBERS = (0.0, -0.0, -1.0, 1.0, 1e-12, 1e-300, 1e9, 1e300, 5e-324)
_NUMBERS += (math.nan, math.inf, -math.inf, math.pi, 2 * math.pi)
_TEXTS = ("", "010", "2:30", "0x1F", "1e-3", "1_000", "yes", "~", "[]", "{}")
_TEXTS += ("[1, 2", "{a: 1, a: 2}", "2024-01-01", "!!python/none x", "&a *a")
_TEXTS += ("9" * 400, "9" * 5000, "[" * 200, "'a'", "a: b: c", "\t", "1,5")
_TEXTS += ("ü", "\x00", "*", "- 1", "null", "[.nan, 1]", "[[1, 2], [3]]")

_BOX = "<box><size>{}</size></box>"
_SPHERE = "<sphere><radius>0.5</radius></sphere>"
_MODEL = (
    '<sdf version="1.9"><model name="m">{}<link name="l">{}</link>'
    "</model></sdf>"
)
_STATIC = "<static>true</static>"
_THING = (
    '<collision name="{}"><pose>{}</pose><geometry>{}</geometry></collision>'
)


def _world(name: str, pose: str, shape: str, static: str = _STATIC) -> str:
    return _MODEL.format(static, _THING.format(name, pose, shape))


_TWO = _THING.format("a", "2 0 0.5 0 0 0", _BOX.format("1 1 1"))

ODD_WORLDS = {
    "nothing.sdf": "",
    "no_xml.sdf": "not XML at all <",
    "other_root.sdf": "<robot/>",
    "no_model.sdf": '<sdf version="1.9"/>',
    "no_version.sdf": "<sdf><model name='m'/></sdf>",
    "empty_model.sdf": _MODEL.format(_STATIC, ""),
    "fine.sdf": _world("a", "2 0 0.5 0 0 0", _BOX.format("1 1 1")),
    "fine.WORLD": _world("a", "2 0 0.5 0 0 0", _BOX.format("1 1 1")),
    "same_name.sdf": _MODEL.format(_STATIC, _TWO + _TWO),
    "ground.sdf": _world("ground", "3 0 0.5 0 0 0", _BOX.format("1 1 1")),
    "commas.sdf": _world("a", "1,7 0 0.5 0 0 0", _BOX.format("1 1 1")),
    "negative.sdf": _world("a", "2 0 0.5 0 0 0", _BOX.format("1 -1 1")),
    "not_a_number.sdf": _world("a", "nan 0 0.5 0 0 0", _BOX.format("1 1 1")),
    "infinite.sdf": _world("a", "2 0 0.5 0 0 0", _BOX.format("1 inf 1")),
    "far_beside_a_room.sdf": _MODEL.format(
        _STATIC,
        _TWO + _THING.format("b", "1e6 1e6 0.5 0 0 0", _BOX.format("1 1 1")),
    ),
    "far.sdf": _world("a", "1e6 1e6 0.5 0 0 0", _BOX.format("1 1 1")),
    "huge.sdf": _world("a", "0 0 -1e7 0 0 0", _BOX.format("1e7 1e7 1")),
    "thin.sdf": _world("a", "2 0 0.5 0 0 0", _BOX.format("1e-9 4 1")),
    "tilted.sdf": _world("a", "3 0 0.5 0.7 0.4 0.2", _BOX.format("1 2 1")),
    "sphere.sdf": _world("a", "3 0 0.5 0 0 0", _SPHERE),
    "free.sdf": _world("a", "3 0 0.5 0 0 0", _BOX.format("1 1 1"), ""),
    "include.sdf": _MODEL.format(
        _STATIC,
        "</link><include><uri>file:///no/such.sdf</uri></include><link>",
    ),
    "mesh.sdf": _world("a", "0 0 0 0 0 0", "<mesh><uri>no.obj</uri></mesh>"),
    "two_shapes.sdf": _world(
        "a", "3 0 0.5 0 0 0", _BOX.format("1 1 1") + _SPHERE
    ),
}


def write_worlds(folder: Path) -> None:
    """Writes the odd worlds and the ten buildings into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in ODD_WORLDS.items():
        (folder / name).write_text(text)
    for make in BUILDINGS:
        make().write(folder)


def make_scenario(seed: int, number: int, folder: Path) -> dict[str, Any]:
    """A random scenario: its job, its overrides and its seed.

    Args:
        seed: of the fuzz.
        number: of the scenario.
        folder: of `write_worlds`.
    """
    rng = np.random.default_rng([seed, number])
    job = str(rng.choice(JOBS))
    world = _a_world(rng, folder)
    values = {"world": world}
    for place in PLACES[job]:
        values[place] = _write(_a_place(rng, place, world))
    if job == "homing":
        values["time_limit"] = f"{rng.uniform(0.05, 2):.3f}"
    else:
        values["grid"] = "plain"  # The search takes seconds.
        values["grid_size"] = f"{rng.uniform(0.1, 1):.3f}"
    keys = _keys(job)
    for index in rng.integers(len(keys), size=rng.integers(0, 6)):
        key, kind, default = keys[index]
        if key == "time_limit" and rng.uniform() < 0.7:
            continue  # Most of its values take long.
        values[key] = _a_value(rng, key, kind, default)
    return {
        "name": f"scenario {number:05}",
        "job": job,
        "seed": int(rng.integers(2**31)),
        "overrides": [f"{key}={text}" for key, text in values.items()],
    }


def _a_world(rng: np.random.Generator, folder: Path) -> str:
    kind = rng.uniform()
    if kind < 0.75:
        return str(rng.choice(world_names()))
    if kind < 0.85:
        name = BUILDINGS[rng.integers(len(BUILDINGS))]().name
        return str(folder / f"{name}.sdf")
    if kind < 0.97:
        return str(folder / str(rng.choice(list(ODD_WORLDS))))
    odd = (
        "",
        ".",
        "/",
        "no_such",
        "cafe.sdf",
        "x" * 5000,
        str(folder),
        "../..",
    )
    return str(rng.choice(odd))


def _a_place(rng: np.random.Generator, name: str, world: str) -> list[float]:
    """A place: four in five are free ones, where the world is a good one."""
    if name == "approach":
        direction = rng.normal(size=3)
        return (direction / np.linalg.norm(direction)).round(6).tolist()
    size = float(rng.choice([3, 12, 200, 1e5], p=(0.6, 0.3, 0.05, 0.05)))
    place = rng.uniform(-size, size, 2)
    good = world in world_names() or Path(world).stem in _BUILDINGS
    if good and rng.uniform() < 0.8:
        floor = _free_places(world)
        place = floor[rng.integers(len(floor))]
    third = {"start": rng.uniform(-7, 7), "target": rng.uniform(-0.2, 1.2)}
    if name in third:
        place = np.append(place, third[name])
    return place.round(3).tolist()


_BUILDINGS = {make().name for make in BUILDINGS}


@cache
def _free_places(world: str) -> Array:
    """Cells' centres of the floor that the robot has within walls, (n, 2)."""
    grid, _ = free_floor(world)
    regions = grid.regions(STAND_RADIUS)
    sizes = np.bincount(regions.ravel())
    if world != "empty":
        sizes[:2] = 0
    floor: Array = grid.centres()[regions == np.argmax(sizes)]
    return floor


@cache
def _keys(job: str) -> list[tuple[str, Any, Any]]:
    """Every key of a job's scenario that has a default, its type and that."""
    return list(_walk(find_job(job).scenario, ""))


def _walk(kind: type[Any], prefix: str) -> Iterator[tuple[str, Any, Any]]:
    kinds = typing.get_type_hints(kind)
    for field in dataclasses.fields(kind):
        of, default = kinds[field.name], field.default
        if dataclasses.is_dataclass(of):
            yield from _walk(typing.cast(Any, of), f"{prefix}{field.name}.")
            continue
        if field.default_factory is not dataclasses.MISSING:
            default = field.default_factory()
        if default is dataclasses.MISSING:
            continue
        yield f"{prefix}{field.name}", of, default


def _a_value(
    rng: np.random.Generator, key: str, kind: Any, default: Any
) -> str:
    """A value of a key as YAML; nine in ten are near its default."""
    draw, name = rng.uniform(), key.rsplit(".", maxsplit=1)[-1]
    if draw < 0.05:
        return str(rng.choice(_TEXTS))
    if draw < 0.12 and kind in (int, float):
        return _write(_NUMBERS[rng.integers(len(_NUMBERS))])
    if kind is float:
        start = default if isinstance(default, float) and default else 1.0
        decades = 6.0 if draw < 0.22 else 0.6
        return _write(start * 10 ** rng.uniform(-decades, decades))
    if kind is int:
        start = default if isinstance(default, int) else 1
        return _write(int(start * 2 ** rng.uniform(-2, 2)))
    if kind is bool:
        return _write(bool(rng.integers(2)))
    if name in _CHOICES:
        return str(rng.choice(_CHOICES[name]))
    if typing.get_origin(kind) is list:
        items = list(default) if isinstance(default, list) else [0.0, 1.0]
        if typing.get_args(kind)[0] is not float:
            return _write([rng.uniform(-1, 9, 2).round(2).tolist()])
        items = [x * 2 ** rng.uniform(-1, 1) for x in items]
        if 0.2 < draw < 0.3:
            items = [x * 10 ** rng.uniform(-6, 6) for x in items]
        if draw < 0.2:
            items = items[:-1] if draw < 0.12 else [*items, 1.0]
        return _write(items)
    return _write(str(default))


def _write(value: Any) -> str:
    """A value as YAML in one line."""
    if isinstance(value, list):
        value = [x if isinstance(x, list) else float(x) for x in value]
    text = yaml.safe_dump(value, default_flow_style=True, width=math.inf)
    return str(text).removesuffix("\n").removesuffix("\n...")
