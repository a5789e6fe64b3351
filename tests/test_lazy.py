"""Names that a package imports on first use, in a package made for the test."""

import importlib
import sys

import pytest

import drake_mobarm.driving
import drake_mobarm.homing

FACE = """
from drake_mobarm.lazy import attach
__getattr__, __dir__ = attach(__name__, {"Thing": "things"})
"""


@pytest.fixture
def package(tmp_path, monkeypatch):
    folder = tmp_path / "lazy_room"
    folder.mkdir()
    (folder / "__init__.py").write_text(FACE)
    (folder / "things.py").write_text("class Thing: pass\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield importlib.import_module("lazy_room")
    for name in ("lazy_room", "lazy_room.things"):
        sys.modules.pop(name, None)


def test_a_name_is_imported_on_first_use_and_stays(package):
    assert "lazy_room.things" not in sys.modules
    thing = package.Thing
    assert thing is sys.modules["lazy_room.things"].Thing
    assert vars(package)["Thing"] is thing


def test_names_are_listed_before_they_are_used(package):
    assert "Thing" in dir(package)
    assert "lazy_room.things" not in sys.modules


def test_an_unknown_name_is_an_error_that_names_it(package):
    with pytest.raises(AttributeError, match=r"'lazy_room'.*'Thong'"):
        package.Thong  # noqa: B018


@pytest.mark.parametrize("room", [drake_mobarm.driving, drake_mobarm.homing])
def test_every_name_of_a_rooms_face_is_there(room):
    assert set(room.__all__) <= set(dir(room))
    for name in room.__all__:
        assert getattr(room, name).__name__ == name
