"""The files that a world's URIs name."""

import os
import re
from collections.abc import Sequence
from pathlib import Path

from drake_mobarm.world.document import DocumentError, read_document

SEARCH_PATHS = ("GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH")
"""The environment variables that hold folders of models."""


_SHOWN = 80


class ResourceError(ValueError):
    """A URI names nothing that can be found; it says where was looked."""


def find_resource(uri: str, file: Path, world: Path) -> Path:
    """The file or folder that a URI in an SDF names.

    A path, or one after `file://`, is absolute or relative to the file; what
    else is relative, `model://` and `package://` are looked for in the
    folders of the file and of the world, their `models` folders and those
    beside them, and in the folders of `SEARCH_PATHS`.

    Args:
        uri: what the file says.
        file: where it stands.
        world: the file of the world that is being loaded.

    Raises:
        ResourceError: there is no such file or folder.
    """
    uri = uri.strip()
    shown = repr(uri if len(uri) <= _SHOWN else f"{uri[:_SHOWN]}...")
    scheme, separator, name = uri.rpartition("://")
    if not uri or not name:
        raise ResourceError(f"<uri> {shown} names no file")
    if separator and scheme not in ("file", "model", "package"):
        raise ResourceError(
            f"{shown} is not on this machine: valid is a path, file:// or "
            "model://"
        )
    if scheme in ("", "file") and Path(name).is_absolute():
        places = [Path(name)]
    else:
        places = [folder / name for folder in _folders(file, world)]
    for place in places:
        # Unlike Path's own, it takes no offence at the longest of names.
        if os.path.exists(place):
            return place.resolve()
    folders = ", ".join(str(folder) for folder in _folders(file, world))
    where = f" in {folders}" if len(places) > 1 else ""
    raise ResourceError(
        f"{shown} is not found{where}: name its folder in {SEARCH_PATHS[0]}"
    )


def find_model(uri: str, file: Path, world: Path) -> Path:
    """The SDF of a model that an `<include>` in an SDF names.

    Args:
        uri: of the SDF, or of a folder that holds it.
        file: where the URI stands.
        world: the file of the world that is being loaded.

    Raises:
        ResourceError: there is no such file or folder, or no SDF in it.
    """
    place = find_resource(uri, file, world)
    if not place.is_dir():
        return place
    newest = _named_in_config(place / "model.config") or place / "model.sdf"
    if newest.is_file():
        return newest
    raise ResourceError(f"{uri!r} is {place}, which holds no {newest.name}")


def _named_in_config(config: Path) -> Path | None:
    """The SDF of the newest version that a model.config names."""
    if not config.is_file():
        return None
    try:
        named = read_document(config).all("sdf")
    except DocumentError as error:
        raise ResourceError(f"{config} {error}") from error
    by_version = {
        _numbers(sdf.attributes.get("version", "")): sdf.text.strip()
        for sdf in named
    }
    if not by_version:
        return None
    return config.parent / by_version[max(by_version)]


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(map(int, re.findall(r"\d+", version)))


def _folders(file: Path, world: Path) -> Sequence[Path]:
    folders = []
    for own in (file.parent, world.parent):
        folders += [own, own / "models", own.parent / "models"]
        # A file of a model's own names that model from outside.
        folders += [own.parent]
    for variable in SEARCH_PATHS:
        listed = os.environ.get(variable, "").split(os.pathsep)
        folders += [Path(folder).absolute() for folder in listed if folder]
    return list(dict.fromkeys(folders))
