"""Who may import what, and where systems may be wired."""

import ast
from pathlib import Path

import drake_mobarm

ROOT = Path(drake_mobarm.__file__).parent
FILES = [
    file
    for file in ROOT.rglob("*.py")
    if "models" not in file.parts and "diagrams" not in file.parts
]
# The rooms of laws; what is not in a room is a system's or the user's side.
ROOMS = ("control", "homing", "placement", "robot", "sensors", "world")


def imports(file):
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""


def importers(package):
    return {
        str(file.relative_to(ROOT))
        for file in FILES
        if any(name.split(".")[0] == package for name in imports(file))
    }


def test_in_a_room_only_systems_know_drake():
    in_rooms = {f for f in importers("pydrake") if f.startswith(ROOMS)}
    assert in_rooms == {
        "control/systems.py",
        "homing/systems.py",
        "placement/stand_program.py",  # By MathematicalProgram.
        "placement/systems.py",
        "sensors/systems.py",
        "world/sdf.py",  # Drake's parser is what makes the SDF the one truth.
    }


def test_only_the_report_draws():
    assert all(f.startswith("report/") for f in importers("matplotlib"))
    assert importers("matplotlib")


def test_nobody_imports_all_of_pydrake():
    names = {name for file in FILES for name in imports(file)}
    assert "pydrake.all" not in names
    assert "pydrake" not in names


def test_only_station_diagrams_and_drawing_connect_systems():
    wiring = {
        str(file.relative_to(ROOT))
        for file in FILES
        if ".Connect(" in file.read_text()
    }
    assert wiring == {"station.py", "visualization.py"}
