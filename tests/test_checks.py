"""Every check accepts the bounds it names, and refuses what is beyond."""

import math
from types import SimpleNamespace

import pytest

from drake_mobarm import checks
from drake_mobarm.exceptions import ParameterError

JUST_BELOW_1, JUST_ABOVE_1 = math.nextafter(1, 0), math.nextafter(1, 2)


def refusal(check, value, *arguments):
    """What a check says of a field `x`, or None where it accepts it."""
    owner = SimpleNamespace(x=value)
    try:
        check(owner, *arguments, "x")
    except ParameterError as error:
        return str(error)
    return None


def test_a_refusal_names_the_field_its_value_and_what_is_valid():
    with pytest.raises(
        ParameterError, match=r"^mass is -1\.5: valid is finite and above 0$"
    ):
        checks.positive(SimpleNamespace(mass=-1.5), "mass")


def test_every_field_is_checked():
    owner = SimpleNamespace(first=1.0, second=0.0)
    with pytest.raises(ParameterError, match=r"^second is 0"):
        checks.positive(owner, "first", "second")


@pytest.mark.parametrize("value", [5e-324, 1, 1e300])
def test_positive_accepts_finite_numbers_above_zero(value):
    assert refusal(checks.positive, value) is None


@pytest.mark.parametrize("value", [0, -0.0, -1, math.inf, math.nan])
def test_positive_refuses_zero_and_what_is_not_finite(value):
    said = refusal(checks.positive, value)
    assert said == f"x is {value!r}: valid is finite and above 0"


@pytest.mark.parametrize("value", [0, 5e-324, 1, 1e300])
def test_not_negative_accepts_zero_and_finite_numbers_above(value):
    assert refusal(checks.not_negative, value) is None


@pytest.mark.parametrize("value", [-5e-324, -1, math.inf, math.nan])
def test_not_negative_refuses_what_is_below_zero_or_not_finite(value):
    said = refusal(checks.not_negative, value)
    assert said == f"x is {value!r}: valid is finite, 0 or more"


def test_at_least_accepts_the_least_itself():
    assert refusal(checks.at_least, 3, 3) is None
    assert refusal(checks.at_least, 4, 3) is None
    assert refusal(checks.at_least, 2, 3) == "x is 2: valid is 3 or more"
    assert refusal(checks.at_least, math.nan, 3) == (
        "x is nan: valid is 3 or more"
    )


@pytest.mark.parametrize(
    ("interval", "accepted", "refused"),
    [
        ("[0, 1]", [0, 0.5, 1], [-5e-324, JUST_ABOVE_1]),
        ("(0, 1]", [5e-324, 0.5, 1], [0, JUST_ABOVE_1]),
        ("[0, 1)", [0, 0.5, JUST_BELOW_1], [-5e-324, 1]),
        ("(0, 1)", [5e-324, 0.5, JUST_BELOW_1], [0, 1]),
        ("(-inf, inf)", [-1e300, 0, 1e300], [-math.inf, math.inf]),
        ("[-2.5, -1]", [-2.5, -1], [-2.6, -0.9]),
        ("[-pi, pi)", [-math.pi, 3.1415], [-3.1416, math.pi]),
        ("[0, 2 pi)", [0, 6.283], [2 * math.pi]),
        ("[-pi/2, pi/2]", [-math.pi / 2, math.pi / 2], [-1.571, 1.571]),
    ],
)
def test_square_brackets_are_within_and_round_ones_are_not(
    interval, accepted, refused
):
    for value in accepted:
        assert refusal(checks.within, value, interval) is None
    for value in [*refused, math.nan]:
        said = refusal(checks.within, value, interval)
        assert said == f"x is {value!r}: valid is in {interval}"


def test_one_of_accepts_its_choices_only_and_lists_them():
    choices = iter(["filter", "hybrid"])
    assert refusal(checks.one_of, "hybrid", ["filter", "hybrid"]) is None
    assert refusal(checks.one_of, "hybird", choices) == (
        "x is 'hybird': valid is filter, hybrid"
    )


@pytest.mark.parametrize(
    ("value", "accepted"),
    [
        ([1.0, -2.0, 0.0], True),
        ([1.0, 2.0], False),
        ([1.0, 2.0, 3.0, 4.0], False),
        ([1.0, 2.0, math.nan], False),
        ([-math.inf, 2.0, 3.0], False),
    ],
)
def test_finite_numbers_are_as_many_as_are_named(value, accepted):
    meaning = "[x, y, yaw] in m, m and rad"
    said = refusal(checks.finite_numbers, value, meaning)
    expected = f"x is {value!r}: valid is {meaning}, finite"
    assert said == (None if accepted else expected)


@pytest.mark.parametrize(
    ("value", "accepted"),
    [
        ([5e-324, 1e300], True),
        ([1.0], False),
        ([1.0, 2.0, 3.0], False),
        ([0.0, 1.0], False),
        ([1.0, math.inf], False),
        ([math.nan, 1.0], False),
    ],
)
def test_positive_numbers_are_so_many_and_all_above_zero(value, accepted):
    said = refusal(checks.positive_numbers, value, 2)
    expected = f"x is {value!r}: valid is 2 finite numbers above 0"
    assert said == (None if accepted else expected)
