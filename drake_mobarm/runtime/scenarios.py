"""Scenarios: what to simulate, read from YAML and checked before it runs."""

import contextlib
import dataclasses
import math
import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from drake_mobarm import diagrams
from drake_mobarm.exceptions import ParameterError, ScenarioError
from drake_mobarm.job import Job, find_job, job_names
from drake_mobarm.runtime.own_diagram import load_own_diagram
from drake_mobarm.world.places import check_places
from drake_mobarm.world.sdf import load_world


def scenario_names() -> list[str]:
    """The shipped scenarios' names."""
    return sorted(_shipped())


def load_scenario(name_or_path: str, overrides: Sequence[str] = ()) -> Any:
    """Reads a scenario and checks it.

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
    path = _find(name_or_path)
    values = _parse(path)
    for override in overrides:
        _override(values, override)
    diagram = str(values.get("diagram"))
    if diagram.endswith(".py"):
        # As seen from the scenario's file, beside which it stands.
        diagram = values["diagram"] = str((path.parent / diagram).resolve())
    try:
        job = job_of_diagram(diagram)
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from error
    scenario = _make(job.scenario, values, name_or_path, "")
    places = job.places(scenario)
    if places:
        check_places(load_world(scenario.world), places)
    return scenario


def job_of(scenario: Any) -> Job:
    """The job of a scenario, by its `diagram`.

    Raises:
        ScenarioError: it is no scenario, or a user's own diagram cannot be
            loaded.
    """
    diagram = getattr(scenario, "diagram", None)
    if not isinstance(diagram, str):
        raise ScenarioError(
            f"{scenario!r} is no scenario: valid is what load_scenario gives"
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
            f"diagram is {diagram!r}: valid is {', '.join(job_names())}, or "
            "the path of a .py file"
        )
    return find_job(diagram)


def dump_scenario(scenario: Any) -> str:
    """The scenario as YAML, every default spelled out."""
    values = dataclasses.asdict(scenario)
    # The job's own parameters, which the scenario's class inherits, go last.
    own = type(scenario).__annotations__
    ordered = sorted(values, key=lambda key: key not in own)
    text: str = yaml.safe_dump(
        {key: values[key] for key in ordered}, sort_keys=False
    )
    return text


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
    if path.suffix in (".yaml", ".yml") and path.is_file():
        return path
    raise ScenarioError(
        f"unknown scenario {name_or_path!r}: valid are "
        f"{', '.join(scenario_names())}, or the path of a .yaml file"
    )


def _parse(path: Path) -> dict[str, Any]:
    try:
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
    except yaml.YAMLError as error:
        line = " ".join(str(error).split())
        raise ScenarioError(f"{path} does not parse: {line}") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path} cannot be read: {error}") from error
    if not isinstance(values, dict):
        raise ScenarioError(f"{path} does not hold keys and values")
    return values


def _override(values: dict[str, Any], override: str) -> None:
    name, separator, text = override.partition("=")
    if not separator or not name:
        raise ScenarioError(f"--set {override!r}: valid is key.path=value")
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ScenarioError(
            f"--set {name}: {text!r} does not parse as YAML"
        ) from error
    *parents, last = name.split(".")
    for parent in parents:
        values = values.setdefault(parent, {})
        if not isinstance(values, dict):
            raise ScenarioError(f"--set {name}: {parent} has no parts")
    values[last] = value


def _make(kind: type[Any], values: Any, where: str, prefix: str) -> Any:
    """A dataclass from a dict, which is checked all the way down.

    pydrake's yaml_load_typed sets values past the dataclasses' own checks,
    and does not say what the valid keys are.
    """
    if not isinstance(values, dict):
        raise ScenarioError(f"{where}: {prefix[:-1]} needs keys and values")
    kinds = typing.get_type_hints(kind)
    fields = dataclasses.fields(kind)
    names = [f.name for f in fields]
    for key in values:
        if key not in names:
            raise ScenarioError(
                f"{where}: unknown key {prefix}{key}: valid are "
                f"{', '.join(prefix + name for name in names)}"
            )
    for f in fields:
        needed = (
            f.default is dataclasses.MISSING
            and f.default_factory is dataclasses.MISSING
        )
        if needed and f.name not in values:
            raise ScenarioError(f"{where}: {prefix}{f.name} is missing")
    checked = {
        key: _check_value(kinds[key], value, where, f"{prefix}{key}")
        for key, value in values.items()
    }
    try:
        return kind(**checked)
    except ParameterError as error:
        raise ParameterError(f"{where}: {prefix}{error}") from error


def _check_value(kind: Any, value: Any, where: str, name: str) -> Any:
    """The value as `kind`; whole numbers are made float where wanted."""
    if dataclasses.is_dataclass(kind):
        assert isinstance(kind, type)
        return _make(kind, value, where, f"{name}.")
    if typing.get_origin(kind) is list:
        if not isinstance(value, list):
            raise ScenarioError(f"{where}: {name} is {value!r}, not a list")
        (item,) = typing.get_args(kind)
        return [
            _check_value(item, x, where, f"{name}[{i}]")
            for i, x in enumerate(value)
        ]
    if kind is float:
        # YAML 1.1 reads 1e-3 as text.
        if isinstance(value, str):
            with contextlib.suppress(ValueError):
                value = float(value)
        if isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if isinstance(value, float) and not math.isfinite(value):
            raise ScenarioError(
                f"{where}: {name} is {value}: it has to be finite"
            )
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise ScenarioError(
            f"{where}: {name} is {value!r}: it has to be of type "
            f"{kind.__name__}"
        )
    return value
