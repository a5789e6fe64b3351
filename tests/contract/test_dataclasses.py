"""What every dataclass of the package keeps, whatever it holds."""

import dataclasses
import importlib
import inspect
import pkgutil
import re

import pytest

import drake_mobarm

SKIPPED = {"drake_mobarm.__main__"}


def package_dataclasses():
    found = {}
    for module in pkgutil.walk_packages(drake_mobarm.__path__, "drake_mobarm."):
        if module.name in SKIPPED:
            continue
        for kind in vars(importlib.import_module(module.name)).values():
            if (
                inspect.isclass(kind)
                and dataclasses.is_dataclass(kind)
                and kind.__module__ == module.name
            ):
                found[f"{kind.__module__}.{kind.__qualname__}"] = kind
    return found


ALL = package_dataclasses()


def holds_arrays(kind):
    return any(
        re.search("Array|ndarray", str(field.type))
        and "Callable" not in str(field.type)
        for field in dataclasses.fields(kind)
    )


def test_dataclasses_with_and_without_arrays_are_found():
    names = {name.rpartition(".")[2] for name in ALL if holds_arrays(ALL[name])}
    assert names >= {"FilterState", "AvoidanceState", "Scan", "ToolTarget"}
    assert "drake_mobarm.sensors.lidar.LidarParameters" in ALL


@pytest.mark.parametrize("name", [n for n in ALL if holds_arrays(ALL[n])])
def test_what_holds_arrays_equals_itself_alone(name):
    """Arrays have no one truth: `==` of two such states would raise."""
    assert ALL[name].__eq__ is object.__eq__
