"""The rules of the rooms hold over the import graph, and can be broken."""

import ast
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import drake_mobarm

PACKAGE = Path(drake_mobarm.__file__).parent
NAME = "drake_mobarm"

# From the ground up: a room imports from those below it only.
GROUND = {
    "checks",
    "exceptions",
    "geometry",
    "immutable",
    "job",
    "joints",
    "signals",
}
FLOORS = [
    GROUND,
    {"robot"},
    {"world"},
    {"sensors"},
    {"station", "driving", "drawing"},
    {"jobs"},  # Every folder with a job.py.
    {"diagrams"},
    {"runtime"},
    {"cli"},
    {"__main__"},
]
DATA = {"models", "__pycache__"}

# Who knows Drake. All else is a law, or shows what a run left behind.
DRAKE_FILES = {"systems.py", "view.py", "signals.py"}
DRAKE_ROOMS = {"station", "drawing", "diagrams", "runtime"}
DRAKE_NAMED = {
    "world/sdf.py",  # Drake's parser makes the SDF the one truth.
    "placement/stand_program.py",  # By MathematicalProgram.
}
# Who draws with matplotlib, when a picture is made.
PICTURE_FILES = {"report.py", "tables.py", "table_pictures.py"}
PICTURE_ROOMS = {"drawing"}
NO_LAWS = DRAKE_FILES | PICTURE_FILES
NAMELESS = {"runtime", "cli", "__main__", "drawing"}


class Module:
    """A file of the package, and what it imports."""

    def __init__(self, root: Path, file: Path) -> None:
        self.path = file.relative_to(root).as_posix()
        self.tree = ast.parse(file.read_text())
        self.room = self.path.split("/")[0].removesuffix(".py")
        self.is_face = self.path.endswith("__init__.py")
        parts = [NAME, *Path(self.path).with_suffix("").parts]
        self.name = ".".join(parts).removesuffix(".__init__")
        # Those that importing the module runs, and those of its functions.
        self.at_once = set(_imports(self.tree.body, functions=False))
        self.ever = set(_imports(self.tree.body, functions=True))


def _imports(body: list[ast.stmt], *, functions: bool) -> Iterator[str]:
    for node in body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            # The name may itself be a module.
            yield from (f"{node.module}.{a.name}" for a in node.names)
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(
            node.test
        ):
            yield from _imports(node.orelse, functions=functions)
        elif functions or not isinstance(
            node, ast.FunctionDef | ast.AsyncFunctionDef
        ):
            inner = [
                child
                for child in ast.iter_child_nodes(node)
                if isinstance(child, ast.stmt | ast.excepthandler)
            ]
            yield from _imports(inner, functions=functions)


def read_package(root: Path) -> dict[str, Module]:
    """The package's modules by their names, linked folders included."""
    files = [
        file
        for top in root.iterdir()
        if top.name not in DATA
        for file in (top.rglob("*.py") if top.is_dir() else [top])
        if file.suffix == ".py" and "__pycache__" not in file.parts
    ]
    modules = [Module(root, file) for file in files]
    return {module.name: module for module in modules}


def faces(root: Path) -> dict[str, str]:
    """Which module each name of a lazy face comes from."""
    found = {}
    for stub in root.rglob("__init__.pyi"):
        package = ".".join([NAME, *stub.parent.relative_to(root).parts])
        for node in ast.parse(stub.read_text()).body:
            if isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    source = ".".join(filter(None, [package, node.module]))
                    found[f"{package}.{alias.name}"] = (
                        source if node.module else f"{source}.{alias.name}"
                    )
    return found


def broken_rules(root: Path) -> list[str]:
    """What breaks a rule, a line each."""
    modules, named = read_package(root), faces(root)
    jobs = {file.parent.name for file in root.glob("*/job.py")}
    floor_of = {
        room: floor for floor, rooms in enumerate(FLOORS) for room in rooms
    } | {job: FLOORS.index({"jobs"}) for job in jobs}
    broken = []

    def target(name: str) -> Module | None:
        name = named.get(name, name)
        return modules.get(name) or modules.get(name.rpartition(".")[0])

    def reaches(start: Module, package: str) -> list[str] | None:
        """The shortest chain of imports from a module to a package."""
        chains, seen = [[start.name]], {start.name}
        for chain in chains:
            for name in sorted(modules[chain[-1]].at_once):
                if name.split(".")[0] == package:
                    return [*chain, package]
                found = target(name)
                if found is not None and found.name not in seen:
                    seen.add(found.name)
                    chains.append([*chain, found.name])
        return None

    for module in modules.values():
        path, room = module.path, module.room
        if path == "__init__.py":
            continue
        if room not in floor_of:
            broken.append(f"{path}: no rule knows the room {room!r}")
            continue
        for name in sorted(module.ever):
            found = target(name)
            if found is None or found.path == "__init__.py":
                continue
            above = floor_of.get(found.room, 99)
            same_floor = above == floor_of[room] and found.room != room
            if above > floor_of[room] or (same_floor and room not in GROUND):
                broken.append(f"{path}: imports {found.path}, not below it")
        file = path.rpartition("/")[2]
        tops = {name.split(".")[0] for name in module.ever}
        drake = (
            file in DRAKE_FILES or room in DRAKE_ROOMS or path in DRAKE_NAMED
        )
        if "pydrake" in tops and not drake:
            broken.append(f"{path}: is no system, and imports pydrake")
        draws = file in PICTURE_FILES or room in PICTURE_ROOMS
        if "matplotlib" in tops and not draws:
            broken.append(f"{path}: makes no picture, imports matplotlib")
        if any(name.startswith("pydrake.all") for name in module.ever):
            broken.append(f"{path}: imports all of pydrake")
        law = (
            floor_of[room] <= FLOORS.index({"jobs"})
            and room not in DRAKE_ROOMS
            and path not in DRAKE_NAMED
            and file not in NO_LAWS
        )
        for package in ("pydrake", "matplotlib") if law else ():
            chain = reaches(module, package)
            if chain is not None and len(chain) > 2:
                broken.append(f"{path}: a law loads {' > '.join(chain)}")
        if room != "diagrams" and ".Connect(" in ast.unparse(module.tree):
            broken.append(f"{path}: connects systems outside diagrams/")
        literals = {
            node.value
            for node in ast.walk(module.tree)
            if room in NAMELESS and isinstance(node, ast.Constant)
        }
        for job in sorted(jobs):
            if job in literals:
                broken.append(f"{path}: names the job {job!r}")
    return broken


def test_no_rule_is_broken():
    assert broken_rules(PACKAGE) == []


def test_every_room_is_there():
    rooms = {module.room for module in read_package(PACKAGE).values()}
    jobs = {file.parent.name for file in PACKAGE.glob("*/job.py")}
    assert jobs
    expected = set().union(*FLOORS) - {"jobs"} | jobs | {"__init__"}
    assert rooms == expected


PLANTED = {
    "a law imports pydrake": (
        "homing/vector.py",
        "from pydrake.math import RigidTransform\n",
        "homing/vector.py: is no system, and imports pydrake",
    ),
    "a law reaches pydrake through another": (
        "homing/vector.py",
        "from drake_mobarm.signals import size\n",
        "homing/vector.py: a law loads drake_mobarm.homing.vector > "
        "drake_mobarm.signals > pydrake",
    ),
    "a room imports upwards": (
        "robot/shape.py",
        "from drake_mobarm.world.obstacles import outline\n",
        "robot/shape.py: imports world/obstacles.py, not below it",
    ),
    "a job imports another": (
        "placement/planner.py",
        "from drake_mobarm.homing import FilterParameters\n",
        "placement/planner.py: imports homing/filter.py, not below it",
    ),
    "a law draws": (
        "sensors/lidar.py",
        "import matplotlib.pyplot as plt\n",
        "sensors/lidar.py: makes no picture, imports matplotlib",
    ),
    "the runtime names a job": (
        "runtime/sweep.py",
        'FIRST = "homing"\n',
        "runtime/sweep.py: names the job 'homing'",
    ),
    "a function imports upwards": (
        "sensors/odometry.py",
        "def late():\n    from drake_mobarm.runtime import sweep\n",
        "sensors/odometry.py: imports runtime/sweep.py, not below it",
    ),
    "a room that no rule knows": (
        "kitchen/stove.py",
        '"""Cooks."""\n',
        "kitchen/stove.py: no rule knows the room 'kitchen'",
    ),
    "a system connects others": (
        "homing/systems.py",
        "def wire(builder, a, b):\n    builder.Connect(a, b)\n",
        "homing/systems.py: connects systems outside diagrams/",
    ),
}


@pytest.mark.parametrize("violation", PLANTED)
def test_a_planted_violation_is_found(violation, tmp_path):
    root = tmp_path / NAME
    shutil.copytree(
        PACKAGE, root, ignore=shutil.ignore_patterns("*.sdf", "*.csv")
    )
    path, text, expected = PLANTED[violation]
    file = root / path
    file.parent.mkdir(exist_ok=True)
    before = file.read_text() if file.exists() else ""
    file.write_text(before + text)
    assert expected in broken_rules(root)


def fresh(code: str) -> str:
    """What Python prints in a new interpreter."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_importing_laws_loads_neither_pydrake_nor_matplotlib():
    laws = [
        module.name
        for module in read_package(PACKAGE).values()
        if module.room not in {"diagrams", "runtime", "cli", "__main__"}
        and module.room not in {"drawing", "signals"}
        and module.path not in DRAKE_NAMED
        and module.path.rpartition("/")[2] not in NO_LAWS
        # The station's plant and models may know Drake; its laws do not.
        and not any(name.startswith("pydrake") for name in module.at_once)
    ]
    assert len(laws) > 40
    loaded = fresh(
        f"import importlib, sys\n"
        f"for name in {laws!r}: importlib.import_module(name)\n"
        "print({'pydrake', 'matplotlib'} & set(sys.modules))"
    )
    assert loaded == "set()"


def test_the_command_line_loads_matplotlib_only_for_a_picture():
    loaded = fresh(
        "import sys, drake_mobarm.cli\nprint('matplotlib' in sys.modules)"
    )
    assert loaded == "False"
