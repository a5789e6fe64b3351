"""The checks of parameters, at both ends of what they let through."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from drake_mobarm import checks
from drake_mobarm.exceptions import ParameterError
from helpers.refusals import assert_refused

NAN, INF = math.nan, math.inf
LEAST = 5e-324  # The least number above 0.
TOO_SMALL = math.nextafter(1e-9, 0)
ABOVE_A_MILLION = math.nextafter(1e6, 2e6)
MOST = 1.7976931348623157e308  # The largest finite one.


# Each helper with its arguments, what it lets through, what it does not.
CASES = {
    "positive": (
        *(checks.positive, ()),
        [1e-9, 1, 2.5, 1e6, 10**6],
        [0, 0.0, -0.0, TOO_SMALL, -1, ABOVE_A_MILLION, INF, -INF, NAN],
    ),
    "not_negative": (
        *(checks.not_negative, ()),
        [0, 0.0, -0.0, LEAST, 1, 1e6],
        [-LEAST, -1, ABOVE_A_MILLION, 10**400, INF, -INF, NAN],
    ),
    "finite": (
        *(checks.finite, ()),
        [0, -1.5, LEAST, 1e6, -1e6],
        [ABOVE_A_MILLION, -ABOVE_A_MILLION, -(10**400), INF, -INF, NAN],
    ),
    "at_least": (
        *(checks.at_least, (3,)),
        [3, 4, np.int64(5), 10**6],
        [2, 3.0, 10**6 + 1, INF, NAN],
    ),
    "whole": (
        *(checks.whole, (3, 7)),
        [3, 4, np.int64(5), 7],
        [2, 8, 10**400, 3.0, 3.5, math.nextafter(3, 0), -3, INF, NAN],
    ),
    "within open": (
        *(checks.within, ("(0, 1)",)),
        [LEAST, 0.5, math.nextafter(1, 0)],
        [0, 1, -LEAST, 2, INF, -INF, NAN],
    ),
    "within closed": (
        *(checks.within, ("[-2.5, 1e3]",)),
        [-2.5, 0, 1000],
        [math.nextafter(-2.5, -3), math.nextafter(1e3, 2e3), INF, -INF, NAN],
    ),
    "within half-open to the right": (
        *(checks.within, ("[0, 1)",)),
        [0, -0.0, math.nextafter(1, 0)],
        [-LEAST, 1, NAN],
    ),
    "within half-open to the left": (
        *(checks.within, ("(0, 1]",)),
        [LEAST, 1],
        [0, math.nextafter(1, 2), NAN],
    ),
    "within a turn": (
        *(checks.within, ("[0, 2 pi)",)),
        [0, 6.283185307179585],
        [6.283185307179586, -LEAST, NAN],
    ),
    "within half a turn": (
        *(checks.within, ("[-pi, pi]",)),
        [-3.141592653589793, 3.141592653589793],
        [-3.1415926535897936, 3.1415926535897936, NAN],
    ),
    "within a quarter of a turn": (
        *(checks.within, ("(-pi/2, pi/2]",)),
        [-1.5707963267948963, 1.5707963267948966],
        [-1.5707963267948966, 1.5707963267948968, NAN],
    ),
    "within what is finite": (
        *(checks.within, ("(-inf, inf)",)),
        [-MOST, 0, MOST],
        [INF, -INF, NAN],
    ),
    "one_of": (
        *(checks.one_of, (["a", "b", 3],)),
        ["a", "b", 3],
        ["", "c", "ab", 2, NAN, None],
    ),
    "finite_numbers": (
        *(checks.finite_numbers, ("[x, y] in m",)),
        [[0, 0.0], (-1e6, 1e6)],
        [[], [1], [1, 2, 3], [NAN, 1], [1, INF], [-INF, 1], [1, 1.1e6]],
    ),
    "positive_numbers": (
        *(checks.positive_numbers, (2,)),
        [[1e-9, 1e6], (1, 2)],
        [[], [1], [1, 2, 3], [0, 1], [1, -1], [1, NAN], [INF, 1], [9e-10, 1]],
    ),
}


@pytest.mark.parametrize(
    ("helper", "arguments", "value"),
    [
        pytest.param(helper, arguments, value, id=f"{name}: {value}")
        for name, (helper, arguments, valid, _) in CASES.items()
        for value in valid
    ],
)
def test_what_is_valid_passes(helper, arguments, value):
    assert helper(SimpleNamespace(x=value), *arguments, "x") is None


@pytest.mark.parametrize(
    ("helper", "arguments", "value"),
    [
        pytest.param(helper, arguments, value, id=f"{name}: {value}")
        for name, (helper, arguments, _, invalid) in CASES.items()
        for value in invalid
    ],
)
def test_what_is_not_valid_is_refused(helper, arguments, value):
    owner = SimpleNamespace(x=value)
    assert_refused("x", helper, owner, *arguments, "x")


@pytest.mark.parametrize("name", CASES)
def test_every_field_that_is_named_is_checked_and_no_other(name):
    helper, arguments, valid, invalid = CASES[name]
    owner = SimpleNamespace(a=valid[0], b=invalid[0], c=valid[-1])
    helper(owner, *arguments, "a", "c")
    assert_refused("b", helper, owner, *arguments, "a", "b", "c")
    helper(owner, *arguments)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("positive", "x is 0: valid is in [1e-9, 1e6]"),
        ("finite", "x is 1000000.0000000001: valid is in [-1e6, 1e6]"),
        ("not_negative", "x is -5e-324: valid is in [0, 1e6]"),
        ("at_least", "x is 2: valid is a whole number, 3 to 1000000"),
        ("within a turn", "x is 6.283185307179586: valid is in [0, 2 pi)"),
        ("one_of", "x is '': valid is a, b, 3"),
        (
            "finite_numbers",
            "x is []: valid is [x, y] in m, each in [-1e6, 1e6]",
        ),
        ("positive_numbers", "x is []: valid is 2 numbers in [1e-9, 1e6]"),
    ],
)
def test_a_refusal_tells_field_value_and_what_is_valid(name, message):
    helper, arguments, _, invalid = CASES[name]
    with pytest.raises(ParameterError) as caught:
        helper(SimpleNamespace(x=invalid[0]), *arguments, "x")
    assert str(caught.value) == message


def test_require_raises_unless_it_holds():
    checks.require(True, "x", 1, "anything")
    with pytest.raises(ParameterError) as caught:
        checks.require(False, "x", "a", "a number")
    assert str(caught.value) == "x is 'a': valid is a number"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.5, "1.5"),
        ([0.6, 0.0, -0.8], "[0.6, 0.0, -0.8]"),
        (np.array([[1, 2], [3, 4]]), "array([[1, 2], [3, 4]])"),
        pytest.param(-(10**5000), "a very long int", id="digits"),
        ("x" * 5000, "..."),
        (list(range(5000)), "[0, 1, 2, 3, 4, 5, 6, 7, ...]"),
        ([[[[[[1]]]]]], "[[[[...]]]]"),
    ],
)
def test_a_value_is_shown_in_one_short_line(value, text):
    shown = checks.shown(value)
    assert text in shown
    assert "\n" not in shown
    assert len(shown) < 200
