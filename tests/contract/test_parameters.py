"""What every parameter keeps that a scenario reaches, whatever it is for."""

import dataclasses
import inspect
import math
import re
import typing

import pytest

from drake_mobarm import load_scenario
from drake_mobarm.exceptions import FrozenError, ParameterError
from drake_mobarm.job import job_names

NUMBERS = (float, int, tuple[float, ...], tuple[tuple[float, ...], ...])
NOT_FINITE = (math.nan, math.inf, -math.inf)


class Parameter(typing.NamedTuple):
    owner: object
    name: str
    kind: object

    @property
    def value(self):
        return getattr(self.owner, self.name)

    def refusal(self, value):
        """The message about a value that has to be refused."""
        with pytest.raises(ParameterError, match=rf"^{self.name}\b") as caught:
            dataclasses.replace(self.owner, **{self.name: value})
        return str(caught.value)

    def around(self, number):
        """Its value with the number in each place that a number has."""
        if self.kind in (float, int):
            return [number]
        if self.kind == tuple[tuple[float, ...], ...]:
            return [[[number, 1.0]], [[0.0, number]]]
        places = self.value or [1.0]
        return [
            [*places[:index], number, *places[index + 1 :]]
            for index in range(len(places))
        ]

    def stated_range(self):
        """What is said to be valid of a number that cannot be."""
        if self.kind is int:
            text = self.refusal(-(10**9))
        else:
            text = self.refusal(self.around(math.nan)[0])
        return text.split("valid is ")[1]


def parameters_of(owner):
    kinds = typing.get_type_hints(type(owner))
    for field in dataclasses.fields(owner):
        value = getattr(owner, field.name)
        if dataclasses.is_dataclass(value):
            yield from parameters_of(value)
        else:
            yield Parameter(owner, field.name, kinds[field.name])


ALL = {
    f"{type(parameter.owner).__name__}.{parameter.name}": parameter
    for job in job_names()
    for parameter in parameters_of(load_scenario(job))
}
OF_NUMBERS = {
    name: parameter
    for name, parameter in ALL.items()
    if parameter.kind in NUMBERS
}


def each(parameters):
    return pytest.mark.parametrize(
        "parameter", parameters.values(), ids=list(parameters)
    )


def bound(text):
    number = text.strip().replace("2 pi", "2*pi").replace("pi", str(math.pi))
    factors = [float(factor) for factor in re.split(r"[*/]", number)]
    if len(factors) == 1:
        return factors[0]
    first, second = factors
    return first * second if "*" in number else first / second


def just_outside(stated):
    """Numbers that a stated range leaves out, close to where it ends."""
    in_range = r"(?:.* (?:each|numbers) )?in ([(\[])(.+), (.+)([)\]])"
    if interval := re.fullmatch(in_range, stated):
        left, low, high, right = interval.groups()
        low, high = bound(low), bound(high)
        return [
            low if left == "(" else math.nextafter(low, -math.inf),
            high if right == ")" else math.nextafter(high, math.inf),
        ]
    if whole := re.fullmatch(r"a whole number, (\d+) to (\d+)", stated):
        least, most = int(whole[1]), int(whole[2])
        return [least - 1, least + 0.5, most + 1]
    if stated == "a whole number, 0 or more":  # A seed.
        return [-1, 0.5, 2**63]
    if stated.endswith("0, or 1e-6 to 1e6"):
        return [-1e-300, 0.999e-6, 1.001e6]
    if re.fullmatch(r"\d(, \d)+", stated):
        return [int(stated[0]) - 1, int(stated[-1]) + 1]
    # Any finite number is valid.
    assert "finite" in stated or stated == "[from, until] in s"
    return []


def documented(kind):
    """Text by name of the Attributes in a class's docstring and its bases'."""
    entries = {}
    for owner in kind.__mro__:
        if dataclasses.is_dataclass(owner):
            text = inspect.getdoc(owner).split("Attributes:\n")[1]
            text = re.split(r"\n(?=\S)", text)[0]
            entries |= dict(
                re.findall(r"^    (\w+): (.*(?:\n {5,}.*)*)", text, re.M)
            )
    return entries


def test_parameters_of_every_room_are_reached():
    assert {type(parameter.owner).__name__ for parameter in ALL.values()} >= {
        "HomingScenario",
        "PlacementScenario",
        "LidarParameters",
        "DifferentialDrive",
        "ObjectiveParameters",
    }


@pytest.mark.parametrize(
    "parameter",
    [
        pytest.param(
            parameter,
            id=name,
        )
        for name, parameter in OF_NUMBERS.items()
        if parameter.kind is not int
    ],
)
def test_what_is_not_finite_is_refused_by_name(parameter):
    # What has no limits of its own may well last for ever.
    pairs = parameter.kind == tuple[tuple[float, ...], ...]
    for number in (math.nan,) if pairs else NOT_FINITE:
        for value in parameter.around(number):
            parameter.refusal(value)


@each(ALL)
def test_a_parameter_cannot_be_set_on_what_was_checked(parameter):
    with pytest.raises(FrozenError, match=rf"^{parameter.name} .* changed\("):
        setattr(parameter.owner, parameter.name, parameter.value)


@each(OF_NUMBERS)
def test_the_range_that_a_refusal_states_is_kept(parameter):
    stated = parameter.stated_range()
    for number in just_outside(stated):
        for value in parameter.around(number):
            parameter.refusal(value)


@each(
    {
        name: parameter
        for name, parameter in OF_NUMBERS.items()
        if parameter.kind == tuple[float, ...] and parameter.value
    }
)
def test_a_list_of_another_length_is_refused_by_name(parameter):
    parameter.refusal([*parameter.value, 1.0])
    parameter.refusal(parameter.value[:-1])


@each(ALL)
def test_every_parameter_is_documented(parameter):
    text = documented(type(parameter.owner))[parameter.name]
    assert len(text) > 3


@each(
    {
        name: parameter
        for name, parameter in OF_NUMBERS.items()
        if parameter.kind is not int
    }
)
def test_a_quantity_is_documented_with_its_unit(parameter):
    text = " ".join(documented(type(parameter.owner))[parameter.name].split())
    dimensionless = "unit vector" in text or "relative to each other" in text
    assert dimensionless or re.search(r"\[[^\]]+\]", text)


@pytest.mark.parametrize(
    "kind",
    {type(parameter.owner) for parameter in ALL.values()},
    ids=lambda kind: kind.__name__,
)
def test_nothing_is_documented_that_is_no_parameter(kind):
    assert set(documented(kind)) == {f.name for f in dataclasses.fields(kind)}
