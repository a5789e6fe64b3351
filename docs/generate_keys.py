"""The keys of every shipped scenario, as Markdown.

Units and meanings come from the dataclasses' docstrings, defaults from the
dataclasses, ranges from their checks, which are listened to.
"""

import dataclasses
import inspect
import re
import sys
from collections import defaultdict
from collections.abc import Sequence
from typing import Any, NamedTuple
from unittest.mock import patch

from generate_markdown import one_line, table

from drake_mobarm import checks, load_scenario
from drake_mobarm.world.sdf import world_names

_UNITS = {"m", "s", "rad", "Hz", "kg", "N", "dB", "dBm", "readings", "-", "1"}

RANGES = {
    "diagram": "a job's name, or the path of a .py file",
    "approach": "a unit vector, to 1e-6",
    "world": f"{', '.join(world_names())}, or the path of an SDF",
    "floor_plan": "given, world, none, or the path of a map's YAML file",
    "objective.torque_shape": "empty, or six numbers, each the torque limit "
    "of its joint or more",
    "station.beacon.outages": "[from, until] each, until not before from",
}
"""What is checked elsewhere than where the parameters are made, or only where
there are any."""


class Key(NamedTuple):
    """A key of a scenario."""

    path: str
    type: str
    unit: str
    default: str
    range: str
    meaning: str


def list_keys(owner: Any, prefix: str = "", shipped: Any = None) -> list[Key]:
    """The keys of a parameters object, those of its parts last.

    Args:
        owner: the object.
        prefix: of its keys.
        shipped: the same object of the shipped scenario.
    """
    shipped = owner if shipped is None else shipped
    ranges = observe_checks(owner)
    meanings = read_attributes(type(owner))
    keys, parts = [], []
    # A job's own parameters, which the scenario's class inherits, go last.
    own = type(owner).__annotations__
    for f in sorted(dataclasses.fields(owner), key=lambda f: f.name not in own):
        path, loaded = prefix + f.name, getattr(shipped, f.name)
        if dataclasses.is_dataclass(loaded):
            assert f.default_factory is not dataclasses.MISSING
            parts += list_keys(f.default_factory(), f"{path}.", loaded)
            continue
        kind = f.type.__name__ if isinstance(f.type, type) else str(f.type)
        kind = str(f.type) if "[" in str(f.type) else kind
        # A tuple is a list in YAML.
        kind = kind.replace("tuple", "list").replace(", ...", "")
        unit, meaning = split_unit(meanings[f.name])
        valid = RANGES.get(path) or join_ranges(ranges[f.name], kind)
        default = default_of(f, loaded)
        keys.append(Key(path, kind, unit, default, valid, meaning))
    return keys + parts


def default_of(f: Any, shipped: Any) -> str:
    """A field's default, and what the shipped scenario has instead."""
    if f.default_factory is not dataclasses.MISSING:
        default = f.default_factory()
    else:
        default = f.default
    if default is dataclasses.MISSING:
        return f"needed; shipped: {_value(shipped)}"
    if default != shipped:
        return f"{_value(default)}; shipped: {_value(shipped)}"
    return _value(default)


def observe_checks(owner: Any) -> dict[str, list[str]]:
    """What the checks of an object's fields call valid, by the fields.

    The object is made once more while every `require` is listened to.
    """
    found: dict[str, list[str]] = defaultdict(list)
    require = checks.require

    def listen(holds: bool, field: str, value: object, valid: str) -> None:
        # "target position" is a check of the field `target`.
        found[field.split()[0]].append(valid)
        require(holds, field, value, valid)

    users = [
        module
        for name, module in sys.modules.items()
        if name.startswith("drake_mobarm.")
        and vars(module).get("require") is require
    ]
    patches = [patch.object(module, "require", listen) for module in users]
    for each in patches:
        each.start()
    try:
        dataclasses.replace(owner)
    finally:
        for each in patches:
            each.stop()
    return found


def join_ranges(valid: Sequence[str], kind: str) -> str:
    """The range of a field in few words."""
    short = list(dict.fromkeys(valid))
    for words in ("in ", "finite and ", "finite, "):
        short = [text.removeprefix(words) for text in short]
    if any(text.startswith("(0, ") for text in short):
        short = [text for text in short if text != "[1e-9, 1e6]"]
    if not short:
        return "true, false" if kind == "bool" else "any"
    return "; ".join(short)


def read_attributes(kind: type[Any]) -> dict[str, str]:
    """The meanings of a dataclass's fields, from the docstrings."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        section = re.search(
            r"^Attributes:\n((?:    .*\n?|\n)+)",
            inspect.cleandoc(base.__doc__ or ""),
            re.M,
        )
        if section is not None:
            items = re.findall(
                r"^    (\w+): (.*?)(?=^    \w|\Z)", section[1], re.M | re.S
            )
            found |= {name: one_line(text) for name, text in items}
    return found


def split_unit(text: str) -> tuple[str, str]:
    """The unit in a meaning, and the meaning without it."""
    for bracket in re.finditer(r" ?\[([^\[\]]+)\]", text):
        words = re.findall(r"[^\s,/^()\d]+|\b1\b", bracket[1])
        if words and set(words) <= _UNITS:
            rest = text[: bracket.start()] + text[bracket.end() :]
            return bracket[1], rest.strip()
    named = re.search(r"\] in ((?:m|rad|s)(?: and (?:m|rad|s))*)\b", text)
    return (named[1].replace(" and ", ", ") if named else ""), text


def make_keys(job: str) -> str:
    """All keys of a job's scenario, in groups."""
    groups: dict[str, list[Key]] = defaultdict(list)
    for key in list_keys(load_scenario(job)):
        groups[key.path.rpartition(".")[0]].append(key)
    heads = ["key", "type", "unit", "default", "range", "meaning"]
    parts = []
    for group, keys in groups.items():
        parts.append(f"### {f'`{group}`' if group else 'The scenario itself'}")
        rows = [
            [f"`{k.path}`", k.type, k.unit, k.default, k.range, k.meaning]
            for k in keys
        ]
        parts.append(table(heads, rows))
    return "\n\n".join(parts)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, float):
        return f"`{value:.6g}`"
    if isinstance(value, list | tuple):
        return f"`[{', '.join(_value(x).strip('`') for x in value)}]`"
    return f"`{value}`"
