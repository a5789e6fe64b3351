"""Names of a package that are imported on first use (PEP 562)."""

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any


def attach(
    module_name: str, names: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Makes `__getattr__` and `__dir__` of a package.

    A package that imports its systems at once makes each of its laws load
    pydrake, too.

    Args:
        module_name: the package's `__name__`.
        names: the submodule, relative to the package, of each name.

    Returns:
        The two functions, to be assigned to these names in the package.
    """

    def load(name: str) -> Any:
        if name not in names:
            raise AttributeError(
                f"module {module_name!r} has no attribute {name!r}"
            )
        module = importlib.import_module(f"{module_name}.{names[name]}")
        value = getattr(module, name)
        setattr(sys.modules[module_name], name, value)
        return value

    def list_names() -> list[str]:
        return sorted({*vars(sys.modules[module_name]), *names})

    return load, list_names
