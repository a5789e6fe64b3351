"""A base for states that a Context keeps without copying them."""

from typing import Any, Self


class Immutable:
    """An object that is its own copy.

    Drake copies all abstract state at each update; a law's state is a frozen
    dataclass that is replaced, never written to, so it need not be.
    """

    def __copy__(self) -> Self:
        """Itself."""
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Itself."""
        return self
