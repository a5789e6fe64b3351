"""YAML 1.2 as scenarios hold it: its core schema, each key once.

PyYAML reads YAML 1.1, in which 010 is 8, 2:30 is 150, and `no` is false.
"""

import re
from typing import Any, ClassVar

import yaml

from drake_mobarm.checks import shown
from drake_mobarm.exceptions import ScenarioError

_TAG = "tag:yaml.org,2002:"
_SCALARS = {
    "null": (r"~|null|Null|NULL|", "~nN\0"),
    "bool": (r"true|True|TRUE|false|False|FALSE", "tTfF"),
    "int": (r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", "-+0123456789"),
    "float": (
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"
        r"|[-+]?(\.inf|\.Inf|\.INF)|\.nan|\.NaN|\.NAN",
        "-+.0123456789",
    ),
}
"""What a plain scalar has to be for each tag, and how it may begin."""

_DIGITS = 300
"""More than any number needs; a float holds up to 308."""


def read_yaml(text: str | bytes, what: str) -> Any:
    """The value that a text in YAML stands for.

    Args:
        text: in UTF-8 or UTF-16, if in bytes.
        what: the text is, for messages.

    Raises:
        ScenarioError: it is no YAML, uses a tag that is not of the core
            schema, gives a key twice, or is nested too deeply.
    """
    try:
        return yaml.load(text, _Loader)
    except yaml.MarkedYAMLError as error:
        mark, problem = error.problem_mark, error.problem or error.context
        line = "" if mark is None else f"line {mark.line + 1}: "
        raise ScenarioError(
            f"{what} does not parse: {line}{problem}"
        ) from error
    except yaml.YAMLError as error:
        line = " ".join(str(error).split())
        raise ScenarioError(f"{what} does not parse: {line}") from error
    except RecursionError as error:
        raise ScenarioError(f"{what} is nested too deeply") from error


def write_yaml(values: Any) -> str:
    """Plain values as YAML that 1.1 and 1.2 read alike."""
    text: str = yaml.dump(values, Dumper=_Dumper, sort_keys=False)
    return text


class _Loader(yaml.SafeLoader):
    """Reads the core schema of YAML 1.2, and refuses keys given twice."""

    yaml_implicit_resolvers: ClassVar[dict[str, Any]] = {}
    yaml_constructors: ClassVar[dict[str | None, Any]] = {
        _TAG + "map": yaml.SafeLoader.construct_yaml_map,
        _TAG + "seq": yaml.SafeLoader.construct_yaml_seq,
        _TAG + "str": yaml.SafeLoader.construct_yaml_str,
        None: yaml.SafeLoader.construct_undefined,
    }

    def flatten_mapping(self, node: Any) -> None:
        """Nothing: YAML 1.2 has no key that merges."""

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """The mapping of a node, each key once."""
        found: dict[Any, Any] = super().construct_mapping(node, deep)
        if len(found) < len(node.value):
            keys = set()
            for key_node, _ in node.value:
                key = self.construct_object(key_node, deep)
                if key in keys:
                    raise _error(key_node, f"key {shown(key)} is given twice")
                keys.add(key)
        return found


class _Dumper(yaml.SafeDumper):
    """Quotes what YAML 1.1 or 1.2 would take for a number."""

    yaml_implicit_resolvers: ClassVar[dict[str, Any]] = {
        first: list(resolvers)
        for first, resolvers in yaml.SafeDumper.yaml_implicit_resolvers.items()
    }

    def ignore_aliases(self, data: Any) -> bool:
        """Always: a list that is there twice is written twice."""
        return True


def _error(node: Any, problem: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)


def _construct(loader: _Loader, node: Any) -> Any:
    """A scalar that is not text, whether its tag is resolved or given."""
    text = loader.construct_scalar(node)
    kind = node.tag.removeprefix(_TAG)
    if re.fullmatch(_SCALARS[kind][0], text) is None:
        raise _error(node, f"{text[:40]!r} is no {kind}")
    if kind == "null":
        return None
    if kind == "bool":
        return text.lower() == "true"
    if len(text) > _DIGITS:
        raise _error(node, f"a number of more than {_DIGITS} digits")
    if kind == "int":
        base = {"0o": 8, "0x": 16}.get(text[:2], 10)
        return int(text, base)
    return float(re.sub(r"\.(inf|nan)", r"\1", text.lower()))


for _kind, (_form, _first) in _SCALARS.items():
    _pattern = re.compile(f"(?:{_form})$")
    for _class in (_Loader, _Dumper):
        _class.add_implicit_resolver(
            _TAG + _kind,
            _pattern,
            [first.strip("\0") for first in _first],
        )
    _Loader.add_constructor(_TAG + _kind, _construct)
