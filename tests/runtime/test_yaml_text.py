"""YAML 1.2's core schema: what a scalar stands for, and what is refused."""

import math

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from drake_mobarm import load_scenario
from drake_mobarm.exceptions import ScenarioError
from drake_mobarm.runtime.yaml_text import read_yaml, write_yaml


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("010", 10),  # 8 in YAML 1.1.
        ("0o10", 8),
        ("0x1F", 31),
        ("-07", -7),
        ("+3", 3),
        ("1e3", 1000.0),  # Text in YAML 1.1.
        ("1e-3", 0.001),
        ("6.E+1", 60.0),
        (".5", 0.5),
        ("-.inf", -math.inf),
        ("2:30", "2:30"),  # 150 in YAML 1.1.
        ("2:30.5", "2:30.5"),
        ("1_000", "1_000"),  # 1000 in YAML 1.1.
        ("0b11", "0b11"),
        ("0o9", "0o9"),
        ("2020-01-01", "2020-01-01"),  # A date in YAML 1.1.
        ("yes", "yes"),  # True in YAML 1.1, and so on.
        ("no", "no"),
        ("on", "on"),
        ("Off", "Off"),
        ("y", "y"),
        ("true", True),
        ("FALSE", False),
        ("tRUE", "tRUE"),
        ("~", None),
        ("", None),
        ("Null", None),
        ("='", "='"),
        ("'010'", "010"),
        ('"true"', "true"),
        ("!!str 3", "3"),
        ("!!float 3", 3.0),
        ("<<: {a: 1}", {"<<": {"a": 1}}),  # Merged in YAML 1.1.
        ("{a: &x [1], b: *x}", {"a": [1], "b": [1]}),
    ],
)
def test_a_scalar_is_what_the_core_schema_says(text, value):
    read = read_yaml(text, "it")
    assert read == value
    assert type(read) is type(value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: 1\nb: [1, 2", ["line 2", "expected"]),
        ("a: 1\nb: 2\na: 3", ["line 3", "'a'", "twice"]),
        ("x: {a: 1, a: 2}", ["line 1", "'a'", "twice"]),
        ("1: a\n0o1: b", ["line 2", "1", "twice"]),
        ("? [1]\n: 2", ["line 1", "key"]),
        ("!!int 1_0", ["'1_0'", "int"]),
        ("!!bool yes", ["'yes'", "bool"]),
        ("!!timestamp now", ["timestamp"]),
        ("!!python/name:os.system", ["python"]),
        ("7" * 301, ["300 digits"]),
        ("a: 7\nb: " + "7" * 5000, ["line 2", "300 digits"]),
        ("0x" + "f" * 5000, ["300 digits"]),
        ("[" * 3000 + "]" * 3000, ["nested"]),
        ("{a: " * 3000 + "1" + "}" * 3000, ["nested"]),
        ("a: 1\n---\nb: 2", ["line 2", "another document"]),
        ("a\0b", ["special characters"]),
        ("\udcff", ["special characters"]),
        (b"a: \xff\xfe", ["invalid start byte"]),
    ],
)
def test_what_is_no_yaml_is_refused_in_one_line(text, words):
    with pytest.raises(ScenarioError, match=r"^mine\.yaml ") as caught:
        read_yaml(text, "mine.yaml")
    message = str(caught.value)
    assert len(message) < 300
    assert "\n" not in message
    for word in words:
        assert word in message


def test_utf_16_is_told_by_its_mark():
    assert read_yaml("a: \xe9".encode("utf-16"), "it") == {"a": "\xe9"}


SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**20), 10**20),
    st.floats(allow_nan=False),
    st.text(max_size=8),
    st.sampled_from(
        ["1e3", "0o10", "010", "no", "2:30", "1_000", "~", "", "2020-01-01"]
    ),
)


@given(st.dictionaries(st.text(max_size=4), st.lists(SCALARS), max_size=4))
def test_what_is_written_reads_the_same_by_1_1_and_by_1_2(values):
    text = write_yaml(values)
    assert read_yaml(text, "it") == values
    assert yaml.safe_load(text) == values


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("time_limit=2:30", ["time_limit", "'2:30'", "float"]),
        ("time_limit=1_000", ["time_limit", "'1_000'", "float"]),
        ("time_limit='60'", ["time_limit", "'60'", "float"]),
        ("time_limit=2020-01-01", ["time_limit", "'2020-01-01'", "float"]),
        ("noise=2020-01-01", ["noise", "'2020-01-01'", "int"]),
        ("time_limit=" + "7" * 300, ["time_limit", "777"]),
        ("noise=" + "7" * 300, ["noise", "777"]),
        ("noise=" + "7" * 400, ["noise", "digits"]),
        ("start=[[[[[[[[[[[[]]]]]]]]]]]]", ["start[0]", "float"]),
    ],
)
def test_a_number_is_one_by_1_2_only(override, words):
    with pytest.raises((ScenarioError, ValueError)) as caught:
        load_scenario("homing", [override])
    assert len(str(caught.value)) < 300
    for word in words:
        assert word in str(caught.value)
    assert load_scenario("homing", ["time_limit=010"]).time_limit == 10.0
    assert load_scenario("homing", ["noise=0o2"]).noise == 2


def test_a_bomb_of_aliases_is_refused_at_once():
    lines = ["a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    for name, last in zip("bcdefghijk", "abcdefghij", strict=True):
        lines.append(f"{name}: &{name} [{', '.join(['*' + last] * 9)}]")
    lines.append("start: *k")
    with pytest.raises(
        ScenarioError, match=r"start is .* not a list"
    ) as caught:
        load_scenario("homing", [f"start={{{', '.join(lines)}}}"])
    assert len(str(caught.value)) < 1000
