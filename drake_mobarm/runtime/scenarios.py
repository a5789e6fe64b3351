"""Scenarios: what to simulate, read from YAML and checked before it runs."""

import dataclasses
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from drake_mobarm import __version__, diagrams
from drake_mobarm.checks import check_seed, shown
from drake_mobarm.exceptions import ScenarioError, VersionWarning
from drake_mobarm.job import Job, find_job, job_names
from drake_mobarm.runtime.own_diagram import load_own_diagram
from drake_mobarm.runtime.typed_values import from_values, to_values
from drake_mobarm.runtime.yaml_text import read_yaml, write_yaml
from drake_mobarm.world.floor_plan_files import MAP_SUFFIXES
from drake_mobarm.world.places import check_places
from drake_mobarm.world.sdf import WORLD_SUFFIXES, load_world

S = TypeVar("S", bound=Any)

_LONGEST = 10**6
"""Bytes of a scenario's file, far above any."""

VERSION = "drake_mobarm"
"""The key of the version that wrote a scenario's file."""


def scenario_names() -> list[str]:
    """The shipped scenarios' names."""
    return sorted(_shipped())


class Recorded(NamedTuple):
    """What a scenario's file says.

    Attributes:
        scenario: of the dataclass that its diagram's job has for it.
        seed: of all noise.
        is_record: whether a run has written the file.
    """

    scenario: Any
    seed: int
    is_record: bool


def load_scenario(name_or_path: str, overrides: Sequence[str] = ()) -> Any:
    """Reads a scenario and checks it.

    Where the file was written by another version of the library, a warning
    says so.

    Args:
        name_or_path: a shipped scenario's name or the path of a YAML file.
        overrides: "key.path=value" each, the value in YAML.

    Returns:
        The scenario, of the dataclass that its diagram's job has for it.

    Raises:
        ScenarioError: there is no such scenario, it does not parse, lacks a
            key, or holds an unknown one or a wrong type; or its own diagram
            cannot be loaded.
        ParameterError: a value is out of its range.
        WorldError: the world cannot be used.
    """
    return read_record(name_or_path, overrides).scenario


def read_record(name_or_path: str, overrides: Sequence[str] = ()) -> Recorded:
    """Reads a scenario, checks it, and tells its seed; as `load_scenario`."""
    if isinstance(overrides, str):
        raise ScenarioError(
            f"overrides are {shown(overrides)}: valid is a list of such texts"
        )
    path = _find(name_or_path)
    values = _parse(path)
    _anchor(values, path.parent)
    for override in overrides:
        _override(values, override)
    _anchor(values, Path.cwd())
    if "diagram" not in values:
        raise ScenarioError(
            f"{path}: diagram is missing: valid is {_valid_diagrams()}"
        )
    try:
        job = job_of_diagram(str(values["diagram"]))
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from error
    version = values.pop(VERSION, None)
    if version not in (None, __version__):
        warnings.warn(
            f"{path} was written by drake_mobarm {version}, this is "
            f"{__version__}: the run may be another",
            VersionWarning,
            stacklevel=3,
        )
    seed = values.get("seed", 0)
    if not _has_seed(job.scenario):
        values.pop("seed", None)
    scenario = from_values(job.scenario, values, name_or_path)
    _check(job, scenario)
    check_seed(seed)
    return Recorded(scenario, seed, version is not None)


def changed(scenario: S, /, **values: Any) -> S:
    """A copy of a scenario with other values, checked in full.

    `changed(scenario, noise=3, beacon=[2, 1])`; a value of a part goes by its
    path: `changed(scenario, **{"station.lidar.rays": 720})`.

    Args:
        scenario: from `load_scenario`; it stays as it is.
        values: by key.

    Raises:
        ScenarioError: it is no scenario, a key is unknown, a value has a
            wrong type, or a place makes no sense.
        ParameterError: a value is out of its range.
        WorldError: the world cannot be used.
    """
    job_of(scenario)
    plain = to_values(scenario)
    for name, value in values.items():
        _put(plain, name, to_values(value), "scenario")
    _anchor(plain, Path.cwd())
    copy: S = from_values(type(scenario), plain, "scenario")
    _check(job_of(copy), copy)
    return copy


def checked_copy(scenario: Any, job: Job, seed: int | None = None) -> Any:
    """A copy of a scenario, checked anew, however it was made.

    Args:
        scenario: of any dataclass.
        job: of which it is.
        seed: that it gets if it has one; None for its own.

    Raises:
        ScenarioError: it is no dataclass, or another job's, or a value has a
            wrong type, or something is set that is no field, or a place makes
            no sense.
        ParameterError: a value is out of its range.
        WorldError: the world cannot be used.
    """
    if not dataclasses.is_dataclass(scenario) or isinstance(scenario, type):
        raise ScenarioError(
            f"{shown(scenario)} is no scenario: valid is what load_scenario "
            "gives"
        )
    plain = to_values(scenario)
    if seed is not None and _has_seed(scenario):
        plain["seed"] = seed
    copy = from_values(type(scenario), plain, "scenario")
    _check(job, copy)
    return copy


def _check(job: Job, scenario: Any) -> None:
    """Whether its form is its job's, and its places make sense."""
    names, needed = (
        {field.name for field in dataclasses.fields(kind)}
        for kind in (scenario, job.scenario)
    )
    if not needed <= names:
        raise ScenarioError(
            f"a {type(scenario).__name__} is no scenario of the diagram "
            f"{job.name!r}: load one with load_scenario"
        )
    places = job.places(scenario)
    if places:
        meshes = getattr(scenario, "meshes", "refuse")
        check_places(load_world(scenario.world, meshes), places)


def _anchor(values: dict[str, Any], folder: Path) -> None:
    """Makes paths of files in a folder absolute, to be found from elsewhere."""
    for key, endings in (
        ("diagram", (".py",)),
        ("world", WORLD_SUFFIXES),
        ("floor_plan", MAP_SUFFIXES),
    ):
        value = values.get(key)
        if isinstance(value, str) and value.lower().endswith(endings):
            file = folder / value
            # Unlike Path's own, it takes no offence at the longest of names.
            if os.path.isfile(file):
                values[key] = str(file.resolve())


def job_of(scenario: Any) -> Job:
    """The job of a scenario, by its `diagram`.

    Raises:
        ScenarioError: it is no scenario, or a user's own diagram cannot be
            loaded.
    """
    diagram = getattr(scenario, "diagram", None)
    if not isinstance(diagram, str):
        raise ScenarioError(
            f"{shown(scenario)} is no scenario: valid is what load_scenario "
            "gives"
        )
    return job_of_diagram(diagram)


def job_of_diagram(diagram: str) -> Job:
    """The job of a scenario's `diagram`: a shipped one's or a user's own.

    Raises:
        ScenarioError: there is no such job, or a user's own diagram cannot be
            loaded.
    """
    if diagram.endswith(".py"):
        return load_own_diagram(Path(diagram))
    if diagram not in job_names():
        raise ScenarioError(
            f"diagram is {shown(diagram)}: valid is {_valid_diagrams()}"
        )
    return find_job(diagram)


def dump_scenario(scenario: Any) -> str:
    """The scenario as YAML, every default spelled out."""
    values = to_values(scenario)
    # The job's own parameters, which the scenario's class inherits, go last.
    own = type(scenario).__annotations__
    ordered = sorted(values, key=lambda key: key not in own)
    return write_yaml({key: values[key] for key in ordered})


def dump_record(scenario: Any, seed: int) -> str:
    """The scenario as YAML, with what else repeats its run to the bit."""
    head: dict[str, Any] = {VERSION: __version__}
    if not _has_seed(scenario):
        head["seed"] = seed
    return write_yaml(head) + dump_scenario(scenario)


def _has_seed(scenario: Any) -> bool:
    return any(field.name == "seed" for field in dataclasses.fields(scenario))


def _valid_diagrams() -> str:
    return f"{', '.join(job_names())}, or the path of a .py file"


def _shipped() -> dict[str, Path]:
    return {
        path.stem: path
        for folder in diagrams.__path__
        for path in Path(folder).glob("*.yaml")
    }


def _find(name_or_path: str) -> Path:
    if name_or_path in _shipped():
        return _shipped()[name_or_path]
    path = Path(name_or_path)
    if path.suffix in (".yaml", ".yml"):
        return path
    raise ScenarioError(
        f"unknown scenario {shown(name_or_path)}: valid are "
        f"{', '.join(scenario_names())}, or the path of a .yaml file"
    )


def _parse(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            text = file.read(_LONGEST + 1)
    except FileNotFoundError as error:
        raise ScenarioError(
            f"scenario {path}: there is no such file"
        ) from error
    except OSError as error:
        raise ScenarioError(
            f"scenario {shown(str(path))} cannot be read: {error.strerror}"
        ) from error
    if len(text) > _LONGEST:
        raise ScenarioError(f"{path} is longer than {_LONGEST} bytes")
    values = read_yaml(text, str(path))
    if not isinstance(values, dict):
        raise ScenarioError(f"{path} does not hold keys and values")
    return values


def _override(values: dict[str, Any], override: str) -> None:
    name, separator, text = override.partition("=")
    if not separator or not name:
        raise ScenarioError(f"--set {shown(override)}: valid is key.path=value")
    _put(values, name, read_yaml(text, f"--set {name}"), "--set")


def _put(values: dict[str, Any], name: str, value: Any, where: str) -> None:
    """Puts a value where its path leads."""
    *parents, last = name.split(".")
    for parent in parents:
        values = values.setdefault(parent, {})
        if not isinstance(values, dict):
            raise ScenarioError(f"{where} {name}: {parent} has no parts")
    values[last] = value
