"""Names of a package that are imported when they are first used (PEP 562).

A room's face names systems, which need pydrake (0.7 s to import), beside
parameters and laws, which do not: whoever asks for a law does not pay for it.
"""

import importlib
from collections.abc import Callable, Mapping
from typing import Any


def lazy_names(
    package: str, modules: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The `__getattr__` and `__dir__` of a package with lazy names.

    Args:
        package: its `__name__`.
        modules: the module that defines each name, by the name.
    """

    def get(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no name {name!r}")
        module = importlib.import_module(modules[name])
        # A name may also be that of a module of the package.
        whole = modules[name] == f"{package}.{name}"
        return module if whole else getattr(module, name)

    return get, lambda: sorted(modules)
