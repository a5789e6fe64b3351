"""Classes of parameters: what was checked once cannot be changed afterwards."""

from dataclasses import dataclass
from typing import Any, NoReturn, TypeVar, dataclass_transform

from drake_mobarm.exceptions import FrozenError

T = TypeVar("T")


@dataclass_transform(frozen_default=True, kw_only_default=True)
def frozen(kind: type[T]) -> type[T]:
    """Makes a class a frozen dataclass with keyword-only fields.

    It is `dataclass(frozen=True, kw_only=True)` whose refusal says what to do
    instead. Lists of numbers are tuples, so that they are frozen, too.
    """
    made = dataclass(frozen=True, kw_only=True)(kind)
    made.__setattr__ = _refuse  # type: ignore[method-assign]
    made.__delattr__ = _refuse  # type: ignore[method-assign]
    return made


def _refuse(self: Any, name: str, value: Any = None) -> NoReturn:
    raise FrozenError(
        f"{name} of {type(self).__name__} cannot be set: use changed(scenario, "
        "...) from drake_mobarm, which gives a checked copy"
    )
