"""Dataclasses from plain values and back, checked all the way down.

pydrake's yaml_load_typed sets values past the dataclasses' own checks, and
does not say what the valid keys are.
"""

import dataclasses
import math
import typing
from typing import Any

from drake_mobarm.checks import shown
from drake_mobarm.exceptions import ParameterError, ScenarioError

_VALID_TYPES = (
    "bool, int, float, str, lists and tuples such as tuple[float, ...] of "
    "these, and dataclasses"
)


def from_values(
    kind: type[Any], values: Any, where: str, prefix: str = ""
) -> Any:
    """A dataclass from a dict.

    Args:
        kind: the dataclass.
        values: by field; those of dataclasses in it are dicts, too.
        where: what the values are of, for messages.
        prefix: of the keys in messages.

    Raises:
        ScenarioError: a key is unknown or missing, or a value has a wrong
            type.
        ParameterError: a value is out of its range.
    """
    if not isinstance(values, dict):
        raise ScenarioError(f"{where}: {prefix[:-1]} needs keys and values")
    kinds = typing.get_type_hints(kind)
    fields = dataclasses.fields(kind)
    names = [f.name for f in fields]
    for key in values:
        if key not in names:
            raise ScenarioError(
                f"{where}: unknown key {prefix}{_key(key)}: valid are "
                f"{', '.join(prefix + name for name in names)}"
            )
    for f in fields:
        needed = (
            f.default is dataclasses.MISSING
            and f.default_factory is dataclasses.MISSING
        )
        if needed and f.name not in values:
            raise ScenarioError(
                f"{where}: {prefix}{f.name} is missing: give it in the file "
                "or by --set"
            )
    checked = {
        key: _check_value(kinds[key], value, where, f"{prefix}{key}")
        for key, value in values.items()
    }
    try:
        return kind(**checked)
    except ValueError as error:
        raise ParameterError(f"{where}: {prefix}{error}") from error


def _key(key: object) -> str:
    return key if isinstance(key, str) and len(key) <= 80 else shown(key)


def to_values(made: Any) -> Any:
    """The plain values of a dataclass, copied; arrays become lists.

    What was set on it besides its fields is among them.
    """
    if dataclasses.is_dataclass(made) and not isinstance(made, type):
        return {key: to_values(value) for key, value in vars(made).items()}
    if hasattr(made, "tolist"):
        return made.tolist()
    if isinstance(made, list | tuple):
        return [to_values(item) for item in made]
    return made


def _as_float(value: int) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _check_value(kind: Any, value: Any, where: str, name: str) -> Any:
    """The value as `kind`; whole numbers are made float where wanted."""
    if dataclasses.is_dataclass(kind):
        assert isinstance(kind, type)
        return from_values(kind, value, where, f"{name}.")
    sequence = typing.get_origin(kind)
    if sequence is list or (
        sequence is tuple and typing.get_args(kind)[1:] == (...,)
    ):
        if not isinstance(value, list):
            raise ScenarioError(
                f"{where}: {name} is {shown(value)}, not a list"
            )
        item = typing.get_args(kind)[0]
        return sequence(
            _check_value(item, x, where, f"{name}[{i}]")
            for i, x in enumerate(value)
        )
    if kind not in (bool, int, float, str):
        raise ScenarioError(
            f"{where}: {name} is declared as {kind}: valid are {_VALID_TYPES}"
        )
    if kind is float:
        if isinstance(value, int) and not isinstance(value, bool):
            value = _as_float(value)
        if isinstance(value, float) and not math.isfinite(value):
            raise ScenarioError(
                f"{where}: {name} is {value}: it has to be finite"
            )
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise ScenarioError(
            f"{where}: {name} is {shown(value)}: it has to be of type "
            f"{kind.__name__}"
        )
    return value
