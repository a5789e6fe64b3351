"""Floor plans in files: YAML and an image, as ROS's map_server has them.

A pixel's shade s is 0 where it is black and 1 where it is white; colours are
averaged. How likely its cell is occupied, p, is 1 - s, or s with `negate`.
The modes:

- `trinary`: where p > occupied_thresh, the cell is occupied; where
  p < free_thresh, it is free; all else is unknown. An alpha channel, which is
  1 where opaque, is averaged into s as a fourth colour.
- `scale`: the same, but alpha is no part of s, and what is not wholly opaque
  is unknown.
- `raw`: the shade of 0 to 255 is p as a percentage, and unknown where it is
  over 100; 0 is free and 100 occupied whatever the thresholds. `negate` and
  alpha do not matter.

ROS's own readers keep how likely a cell is occupied between the thresholds in
`scale` and `raw`; a floor plan keeps that it is unknown.

Of an image of greys and alpha, ROS 1 averages two channels in `trinary`, and
Nav2 four, as if grey were a colour. So opaque black is unknown to ROS 1, for
s = 1/2, and occupied to Nav2, for s = 1/4. Nav2 is followed here, as it is up
to its release Jazzy; in its newer source, what is not wholly opaque is unknown
in `trinary`, too.
"""

import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import ArrayLike
from PIL import Image

from drake_mobarm.checks import shown
from drake_mobarm.exceptions import MapError, OutputError, ParameterError
from drake_mobarm.geometry import Array
from drake_mobarm.world.floor_plan import FloorPlan
from drake_mobarm.world.world import WORLDS, World

MAP_SUFFIXES = (".yaml", ".yml")
"""The endings of the files of maps, in capitals or not."""

MODES = ("trinary", "scale", "raw")
"""How the pixels of an image can be meant."""

IMAGE_FORMATS = ("png", "pgm")
"""In which an image can be written."""

_READABLE = ("PNG", "PPM", "BMP")  # Pillow calls PGM a kind of PPM.
_MOST_PIXELS = 25_000_000
_NEGATE = {
    **dict.fromkeys(("0", "false", "no", "off"), False),
    **dict.fromkeys(("1", "true", "yes", "on"), True),
}
# What ROS's map_saver writes.
_FREE, _UNKNOWN, _OCCUPIED = 254, 205, 0
_THRESHOLDS = {"occupied_thresh": 0.65, "free_thresh": 0.196}


def read_floor_plan(path: str | os.PathLike[str]) -> FloorPlan:
    """Reads a map: its YAML, and the PGM, PNG or BMP that it names.

    Args:
        path: of the YAML. The image's path is relative to its folder, or
            absolute.

    Raises:
        MapError: a file is missing or cannot be read, a value is missing or
            out of its range, or no cell is free.
    """
    path = Path(path).expanduser()
    try:
        return _read(path)
    except (MapError, ParameterError) as error:
        raise MapError(f"map {path}: {error}") from error


def map_files(path: Path) -> tuple[Path, Path]:
    """The files of a map: its YAML's path, and that of its image.

    Raises:
        MapError: the YAML cannot be read, or names no image.
    """
    try:
        return path, _image_path(path, _read_fields(path))
    except MapError as error:
        raise MapError(f"map {path}: {error}") from error


def floor_plan_of(world: World, cover: ArrayLike = ()) -> FloorPlan:
    """The floor plan that a robot is given of a world.

    A shipped world with a floor plan in its folder has that one, which
    differs from the world on purpose. A world that is a map has the map, and
    any other its true plan.

    Args:
        world: the building.
        cover: points in W that a true plan has to reach beyond [m], (n, 2).

    Raises:
        WorldError: the cells are too many.
        MapError: the world's map cannot be read any more.
    """
    file = given_map(world)
    if file is not None:
        return read_floor_plan(file)
    return FloorPlan.from_world(world, cover=cover)


def given_map(world: World) -> Path | None:
    """The map's file that `floor_plan_of` a world is read from, if any."""
    if world.path.suffix.lower() in MAP_SUFFIXES:
        return world.path
    file = world.path.resolve().with_suffix(".yaml")
    shipped = file.parent == WORLDS.resolve() and file.exists()
    return file if shipped else None


def write_floor_plan(
    plan: FloorPlan,
    path: str | os.PathLike[str],
    image_format: str = "png",
) -> None:
    """Writes a map that `read_floor_plan` and ROS read.

    Args:
        plan: what to write.
        path: of the YAML; the image stands beside it, of the same name.
        image_format: one of IMAGE_FORMATS.

    Raises:
        OutputError: the path is no YAML's, or a file cannot be written.
        MapError: there is no such format.
    """
    path = Path(path)
    if path.suffix.lower() not in MAP_SUFFIXES:
        raise OutputError(f"map {path}: valid is a .yaml or .yml file")
    if image_format not in IMAGE_FORMATS:
        raise MapError(
            f"image_format is {shown(image_format)}: valid is "
            f"{', '.join(IMAGE_FORMATS)}"
        )
    image = path.with_suffix(f".{image_format}")
    fields = {
        "image": image.name,
        "mode": "trinary",
        "resolution": float(plan.resolution),
        "origin": [float(number) for number in plan.origin],
        "negate": 0,
        **_THRESHOLDS,
    }
    shades = np.full(plan.occupied.shape, _FREE, dtype=np.uint8)
    shades[plan.unknown] = _UNKNOWN
    shades[plan.occupied] = _OCCUPIED
    try:
        Image.fromarray(shades).save(image, optimize=True)
        path.write_text(
            yaml.safe_dump(fields, sort_keys=False, default_flow_style=None),
            encoding="utf-8",
        )
    except OSError as error:
        raise OutputError(
            f"map {path} cannot be written: {error.strerror or error}"
        ) from error


def _read(path: Path) -> FloorPlan:
    fields = _read_fields(path)
    resolution = _number("resolution", _required(fields, "resolution"))
    origin = _required(fields, "origin")
    if not isinstance(origin, list) or len(origin) != 3:
        raise MapError(
            f"origin is {shown(origin)}: valid is [x, y, yaw] in m and rad"
        )
    x, y, yaw = (_number("origin", number) for number in origin)
    low, high = _thresholds(fields)
    negate = _required(fields, "negate")
    if str(negate).lower() not in _NEGATE:
        raise MapError(f"negate is {shown(negate)}: valid is 0, 1, true, false")
    mode = fields.get("mode", MODES[0])
    if mode not in MODES:
        raise MapError(f"mode is {shown(mode)}: valid is {', '.join(MODES)}")
    shade, alpha = _read_image(_image_path(path, fields))
    likely = _likelihood(shade, alpha, mode, _NEGATE[str(negate).lower()])
    occupied, free = likely > high, likely < low
    if mode == "raw":
        occupied |= likely == 1
        free |= likely == 0
    unknown = ~(occupied | free)
    if not free.any():
        raise MapError(
            f"no cell is free, {occupied.sum()} are occupied, {unknown.sum()} "
            "unknown: mode, negate and the thresholds have to suit the image"
        )
    return FloorPlan(occupied, unknown, resolution, (x, y, yaw))


def _likelihood(
    shade: Array, alpha: Array | None, mode: str, negate: bool
) -> Array:
    """How likely each cell is occupied, 0 to 1, or NaN if that is unknown."""
    if mode == "raw":
        percentage = np.rint(255 * shade)
        return np.where(percentage <= 100, percentage / 100, np.nan)
    if mode == "trinary" and alpha is not None:
        shade = (3 * shade + alpha) / 4
    likely = shade if negate else 1 - shade
    if mode == "scale" and alpha is not None:
        likely = np.where(alpha == 1, likely, np.nan)
    return likely


def _read_fields(path: Path) -> dict[Any, Any]:
    """The keys of a map's YAML; every scalar is text."""
    try:
        text = path.read_bytes()
        fields = yaml.load(text, yaml.BaseLoader)
    except OSError as error:
        raise MapError(f"cannot be read: {error.strerror}") from error
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line = "" if mark is None else f" in line {mark.line + 1}"
        raise MapError(f"is no YAML: {error.problem}{line}") from error
    except (yaml.YAMLError, RecursionError) as error:
        raise MapError("is no YAML") from error
    if not isinstance(fields, dict):
        raise MapError(
            "holds no keys: valid is the YAML beside a map's image, with "
            "image, resolution and origin"
        )
    return fields


def _required(fields: dict[Any, Any], key: str) -> Any:
    """A key's value."""
    if fields.get(key) in (None, ""):
        raise MapError(f"{key} is missing")
    return fields[key]


def _number(key: str, text: Any) -> float:
    try:
        return float(text)
    except (TypeError, ValueError) as error:
        raise MapError(f"{key} is {shown(text)}: valid is a number") from error


def _thresholds(fields: dict[Any, Any]) -> tuple[float, float]:
    """Under which likelihood a cell is free, and over which occupied."""
    low, high = (
        _number(key, _required(fields, key))
        for key in ("free_thresh", "occupied_thresh")
    )
    if not 0 <= low < high <= 1:
        raise MapError(
            f"free_thresh is {low:g} and occupied_thresh {high:g}: valid is "
            "0 <= free_thresh < occupied_thresh <= 1"
        )
    return low, high


def _image_path(path: Path, fields: dict[Any, Any]) -> Path:
    name = _required(fields, "image")
    if not isinstance(name, str):
        raise MapError(f"image is {shown(name)}: valid is an image's path")
    return path.parent / name


def _read_image(file: Path) -> tuple[Array, Array | None]:
    """The shades and the alphas of an image, each 0 to 1, (rows, columns)."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(file, formats=_READABLE) as image:
                if np.prod(image.size) > _MOST_PIXELS:
                    raise Image.DecompressionBombError
                image.load()
    except Image.DecompressionBombError:
        raise MapError(
            f"image {file} is too large: valid are up to {_MOST_PIXELS} pixels"
        ) from None
    except Image.UnidentifiedImageError as error:
        raise MapError(
            f"image {file} is no PGM, PNG or BMP, or it is damaged or empty"
        ) from error
    except (OSError, SyntaxError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise MapError(f"image {file} cannot be read: {reason}") from error
    if image.mode.startswith("I"):
        return np.asarray(image, dtype=float) / 65535, None
    if image.mode == "F":
        raise MapError(
            f"image {file} has shades without a limit: valid are 8 and 16 bit"
        )
    if image.has_transparency_data:
        channels = np.asarray(image.convert("RGBA"), dtype=float)
        return channels[..., :3].mean(axis=-1) / 255, channels[..., 3] / 255
    grey = image.mode in {"1", "L"}
    channels = np.asarray(image.convert("L" if grey else "RGB"), dtype=float)
    return (channels if grey else channels.mean(axis=-1)) / 255, None
