"""Checks of parameters: each refusal names the field, its value, what is valid.

The helpers take the object that is being made and the names of its fields. A
comparison with NaN is false, so that every check of a range refuses it, too.
Every range ends at 1e6 and, above 0, at 1e-9, in SI units: beyond them nothing
is meant, and products of two or three such numbers are still exact enough.
"""

import math
import numbers
import reprlib
from collections.abc import Iterable
from typing import Any

from drake_mobarm.exceptions import ParameterError

_SHORT = reprlib.Repr()
_SHORT.maxlist = _SHORT.maxtuple = _SHORT.maxarray = 8
_SHORT.maxstring = _SHORT.maxother = 80
_SHORT.maxlevel = 3
_LONGEST = 160

_BOUNDS = {
    "pi": math.pi,
    "-pi": -math.pi,
    "2 pi": 2 * math.pi,
    "pi/2": math.pi / 2,
    "-pi/2": -math.pi / 2,
}


def require(holds: bool, field: str, value: object, valid: str) -> None:
    """Raises a ParameterError that says what is valid, unless `holds`."""
    if not holds:
        raise ParameterError(f"{field} is {shown(value)}: valid is {valid}")


def shown(value: object) -> str:
    """A value as text for a message: one line, cut where it is long."""
    try:
        text = " ".join(_SHORT.repr(value).split())
    except ValueError:  # Python refuses to write a number of 5000 digits.
        return f"a very long {type(value).__name__}"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def finite(owner: object, *fields: str) -> None:
    """Each field has to be a number in [-1e6, 1e6]."""
    within(owner, "[-1e6, 1e6]", *fields)


def positive(owner: object, *fields: str) -> None:
    """Each field has to be a number in [1e-9, 1e6]."""
    within(owner, "[1e-9, 1e6]", *fields)


def not_negative(owner: object, *fields: str) -> None:
    """Each field has to be a number in [0, 1e6]."""
    within(owner, "[0, 1e6]", *fields)


def at_least(owner: object, least: int, *fields: str) -> None:
    """Each field has to be a whole number from `least` to a million."""
    whole(owner, least, 10**6, *fields)


def whole(owner: object, least: int, most: int, *fields: str) -> None:
    """Each field has to be a whole number from `least` to `most`."""
    for field in fields:
        value: Any = getattr(owner, field)
        is_whole = isinstance(value, numbers.Integral)
        holds = is_whole and least <= value <= most
        valid = f"a whole number, {least} to {most}"
        require(holds, field, value, valid)


def within(owner: object, interval: str, *fields: str) -> None:
    """Each field has to lie in an interval.

    Args:
        owner: the object that is being made.
        interval: such as "(0, 1]" or "[0, 2 pi)": a square bracket where the
            bound itself is valid, a round one where it is not.
        fields: names of the fields.
    """
    low, high = (_bound(text) for text in interval[1:-1].split(","))
    for field in fields:
        value = getattr(owner, field)
        holds = low <= value <= high
        if interval[0] == "(":
            holds = holds and value > low
        if interval[-1] == ")":
            holds = holds and value < high
        require(holds, field, value, f"in {interval}")


def one_of(owner: object, choices: Iterable[Any], *fields: str) -> None:
    """Each field has to be one of some choices."""
    choices = tuple(choices)
    for field in fields:
        value = getattr(owner, field)
        require(value in choices, field, value, ", ".join(map(str, choices)))


def finite_numbers(owner: object, meaning: str, *fields: str) -> None:
    """Each field has to be a list of so many numbers in [-1e6, 1e6].

    Args:
        owner: the object that is being made.
        meaning: of the numbers, such as "[x, y, yaw] in m and rad": as many
            as there are names between the brackets.
        fields: names of the fields.
    """
    count = meaning[: meaning.index("]")].count(",") + 1
    for field in fields:
        value = getattr(owner, field)
        require(
            len(value) == count and all(-1e6 <= x <= 1e6 for x in value),
            field,
            value,
            f"{meaning}, each in [-1e6, 1e6]",
        )


def positive_numbers(owner: object, count: int, *fields: str) -> None:
    """Each field has to be a list of so many numbers in [1e-9, 1e6]."""
    valid = f"{count} numbers in [1e-9, 1e6]"
    for field in fields:
        value = getattr(owner, field)
        require(
            len(value) == count and all(1e-9 <= x <= 1e6 for x in value),
            field,
            value,
            valid,
        )


def _bound(text: str) -> float:
    text = text.strip()
    return _BOUNDS[text] if text in _BOUNDS else float(text)


def check_seed(seed: Any) -> None:
    """A seed has to be a whole number that Drake takes."""
    whole = isinstance(seed, numbers.Integral) and seed is not True
    require(whole and seed >= 0, "seed", seed, "a whole number, 0 or more")
    require(seed < 2**63, "seed", seed, "below 2**63")
