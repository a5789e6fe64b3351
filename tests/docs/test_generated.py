"""The generated parts of the pages are what docs/generate.py writes."""

import dataclasses
import importlib
import inspect
import re
import sys
from pathlib import Path

import pytest
from pydrake.systems.framework import LeafSystem

import drake_mobarm
from drake_mobarm import load_scenario, run
from drake_mobarm.exceptions import MobarmError
from drake_mobarm.job import job_names

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGES = [DOCS.parent / "README.md", *sorted(DOCS.glob("*.md"))]


@pytest.fixture(scope="module", autouse=True)
def generator():
    """The script, imported from its folder."""
    sys.path.insert(0, str(DOCS))
    try:
        yield importlib.import_module("generate")
    finally:
        sys.path.remove(str(DOCS))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_is_up_to_date(page, generator):
    text = page.read_text(encoding="utf-8")
    assert generator.fill(text) == text, "run: python docs/generate.py"


def test_an_outdated_part_is_written_anew(generator):
    page = "a\n<!-- generated: signals -->\nold\n<!-- end -->\nb\n"
    filled = generator.fill(page)
    assert filled.startswith("a\n<!-- generated: signals -->\n\n| signal |")
    assert filled.endswith("|\n\n<!-- end -->\nb\n")
    assert "old" not in filled


def test_two_parts_do_not_run_together(generator):
    part = "<!-- generated: signals -->\n<!-- end -->\n"
    filled = generator.fill(f"{part}between\n{part}")
    assert filled.count("BeaconReading") == 2
    assert "\nbetween\n" in filled


def test_every_system_of_the_library_is_listed():
    pages = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    root = Path(drake_mobarm.__file__).parent
    kinds = set()
    for file in root.glob("*/*.py"):
        if "LeafSystem):" in file.read_text(encoding="utf-8"):
            name = f"drake_mobarm.{file.parent.name}.{file.stem}"
            for _, kind in inspect.getmembers(importlib.import_module(name)):
                if (
                    inspect.isclass(kind)
                    and issubclass(kind, LeafSystem)
                    and kind.__module__ == name
                ):
                    kinds.add(kind.__name__)
    assert "TargetEstimator" in kinds
    assert [k for k in kinds if pages.count(f"\n### `{k}`\n") != 1] == []


def leaves(value, prefix=""):
    for field in dataclasses.fields(value):
        part = getattr(value, field.name)
        if dataclasses.is_dataclass(part):
            yield from leaves(part, f"{prefix}{field.name}.")
        else:
            yield prefix + field.name


@pytest.mark.parametrize("job", job_names())
def test_every_key_of_a_scenario_is_listed_once(job):
    page = (DOCS / f"{job}.md").read_text(encoding="utf-8")
    keys = list(leaves(load_scenario(job)))
    assert "diagram" in keys
    assert [k for k in keys if page.count(f"\n| `{k}` | ") != 1] == []


@pytest.mark.parametrize("job", job_names())
def test_every_metric_of_a_run_is_described(job):
    page = (DOCS / f"{job}.md").read_text(encoding="utf-8")
    section = page.split("## Metrics")[1].split("\n## ")[0]
    rows = re.findall(r"^\| (`.*?`) \|", section, re.M)
    named = {name.strip(" `") for row in rows for name in row.split(",")}
    metrics = run(load_scenario(job)).metrics
    assert named == set(metrics)


@pytest.mark.parametrize(
    ("key", "cells"),
    [
        ("filter.arrival_margin", "float | - | `4.5` | [1e-9, 1e6]"),
        ("station.beacon.dropout", "float | - | `0` | [0, 1)"),
        (
            "station.base_drive.base.com_offset",
            "float | m | `-0.003235` | [-1e6, 1e6]",
        ),
        (
            "rules.tight_margin",
            "float | m | `0.015` | [1e-9, 1e6]; up to margin",
        ),
        ("estimator", "str |  | `filter` | hybrid, filter"),
        ("start", "list[float] | m, rad | needed; shipped: `[-8, -2.6, 0.5]`"),
    ],
)
def test_a_key_has_the_unit_default_and_range_of_its_dataclass(key, cells):
    page = (DOCS / "homing.md").read_text(encoding="utf-8")
    assert f"\n| `{key}` | {cells}" in page


def test_every_key_has_a_range():
    unchecked = {
        line.split("|")[1].strip(" `")
        for job in job_names()
        for line in (DOCS / f"{job}.md").read_text().splitlines()
        if "| any |" in line
    }
    assert unchecked == set()


@pytest.mark.parametrize(
    ("job", "override"),
    [
        ("homing", "diagram=nothing"),
        ("homing", "world=nowhere"),
        ("homing", "station.beacon.outages=[[5, 4]]"),
        ("navigation", "floor_plan=nothing"),
        ("placement", "approach=[0, 0, -1.00001]"),
        ("placement", "objective.torque_shape=[9, 9, 9, 9, 9]"),
        ("placement", "objective.torque_shape=[1, 1, 1, 1, 1, 1]"),
    ],
)
def test_the_ranges_kept_by_hand_are_checked(job, override):
    key = override.partition("=")[0]
    assert key in importlib.import_module("generate_keys").RANGES
    assert f"\n| `{key}` | " in (DOCS / f"{job}.md").read_text()
    with pytest.raises(MobarmError, match=key.rpartition(".")[2]):
        load_scenario(job, [override])


def test_no_range_is_kept_by_hand_of_a_key_that_is_gone():
    keys = {key for job in job_names() for key in leaves(load_scenario(job))}
    assert set(importlib.import_module("generate_keys").RANGES) <= keys
