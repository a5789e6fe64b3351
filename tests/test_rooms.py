"""The rules of the rooms hold over the import graph, and can be broken."""

import ast
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

import drake_mobarm

PACKAGE = Path(drake_mobarm.__file__).parent
NAME = "drake_mobarm"

# From the ground up: a room imports from those below it only.
GROUND = {
    "checks",
    "exceptions",
    "frozen",
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
    "world/loaded.py",  # What that parser has read.
    "placement/stand_program.py",  # By MathematicalProgram.
}
# Who draws with matplotlib, when a picture is made.
PICTURE_FILES = {
    "report.py",
    "tables.py",
    "table_pictures.py",
    "offline_pictures.py",
}
PICTURE_ROOMS = {"drawing"}
NO_LAWS = DRAKE_FILES | PICTURE_FILES
# Who knows no job.
NAMELESS = {"runtime", "cli", "__main__", "drawing"}
# Who imports what is only a text here: jobs, and a user's own file.
BY_TEXT = {"job.py", "runtime/own_diagram.py"}
IMPORTERS = {"import_module", "__import__", "spec_from_file_location"}
CONNECTORS = {"Connect", "ConnectInput", "Cascade"}


class Module:
    """A file of the package, and what it imports."""

    def __init__(self, root: Path, file: Path) -> None:
        self.path = file.relative_to(root).as_posix()
        self.tree = ast.parse(file.read_text())
        self.room = self.path.split("/")[0].removesuffix(".py")
        parts = [NAME, *Path(self.path).with_suffix("").parts]
        self.name = ".".join(parts).removesuffix(".__init__")
        self.package = parts[:-1]
        self._bound = dict(self._bindings(ast.walk(self.tree)))
        # What importing it loads; and all, which functions and types need.
        self.at_once = set(self._imports(_run_at_once(self.tree)))
        self.ever = set(self._imports(ast.walk(self.tree)))

    def _source(self, node: ast.ImportFrom) -> str:
        """What an import is from, a relative one too."""
        above = self.package[: len(self.package) + 1 - node.level]
        return ".".join(filter(None, [*above * (node.level > 0), node.module]))

    def _bindings(self, nodes: Iterable[ast.AST]) -> Iterator[tuple[str, str]]:
        """Each name that an import binds, and what it stands for."""
        for node in nodes:
            if isinstance(node, ast.Import):
                for alias in node.names:
                    top = alias.name.split(".")[0]
                    yield (
                        alias.asname or top,
                        alias.name if alias.asname else top,
                    )
            elif isinstance(node, ast.ImportFrom):
                source = self._source(node)
                for alias in node.names:
                    yield alias.asname or alias.name, f"{source}.{alias.name}"

    def _imports(self, nodes: Iterable[ast.AST]) -> Iterator[str]:
        for node in nodes:
            if isinstance(node, ast.Import):
                yield from (alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                # The name may itself be a module.
                source = self._source(node)
                yield from (f"{source}.{alias.name}" for alias in node.names)
            elif isinstance(node, ast.Attribute):
                # A lazy face imports a name when it is used.
                start, *rest = ast.unparse(node).split(".")
                if start in self._bound:
                    yield ".".join([self._bound[start], *rest])


def _run_at_once(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes that importing runs: not functions, not what types need."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if isinstance(child, ast.If):
            test = ast.unparse(child.test).removeprefix("typing.")
            if test == "TYPE_CHECKING":
                child = ast.Module(child.orelse, [])
        yield child
        yield from _run_at_once(child)


def _texts(tree: ast.AST) -> Iterator[str]:
    """All text of a module, but its docstrings, which may give examples."""
    nodes = list(ast.walk(tree))
    alone = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    for node in nodes:
        if isinstance(node, ast.Constant) and id(node) not in alone:
            yield str(node.value)


def _names(tree: ast.AST) -> set[str]:
    """All that a module names: variables, attributes, what it imports."""
    return {
        getattr(node, kind)
        for node in ast.walk(tree)
        for kind in ("id", "attr", "name")
        if isinstance(getattr(node, kind, None), str)
    }


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
            of_job = found.path.removeprefix("diagrams/").split("/")[0]
            if room in NAMELESS and of_job.removesuffix(".py") in jobs:
                broken.append(f"{path}: imports {found.path}, which is a job's")
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
        names = _names(module.tree)
        if room != "diagrams" and names & CONNECTORS:
            broken.append(f"{path}: connects systems outside diagrams/")
        if path not in BY_TEXT and names & IMPORTERS:
            broken.append(f"{path}: imports what is only a text here")
        texts = " | ".join(_texts(module.tree)) if room in NAMELESS else ""
        for job in sorted(jobs):
            if re.search(rf"(?<![A-Za-z]){job}(?![A-Za-z])", texts):
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


UPWARDS = "from drake_mobarm.runtime import sweep\n"
TYPES = "from typing import TYPE_CHECKING\n"
# By a file and what is then said of it: what is added to the file.
PLANTED = {
    ("homing/vector.py", "is no system, and imports pydrake"): {
        "a law imports pydrake": "from pydrake.math import RigidTransform\n",
    },
    (
        "homing/vector.py",
        "a law loads drake_mobarm.homing.vector > drake_mobarm.signals > "
        "pydrake",
    ): {
        "a law reaches pydrake": "from drake_mobarm.signals import size\n",
        "relatively": "from ..signals import size\n",
        "by a name": "import drake_mobarm\ndrake_mobarm.signals.size\n",
        "but for types": f"{TYPES}if not TYPE_CHECKING:\n"
        "    from drake_mobarm.signals import size\n",
    },
    ("robot/shape.py", "imports world/obstacles.py, not below it"): {
        "a room imports upwards": "import drake_mobarm.world.obstacles\n",
    },
    ("sensors/odometry.py", "imports runtime/sweep.py, not below it"): {
        "a function imports": f"def late():\n    {UPWARDS}",
        "a type is imported": f"{TYPES}if TYPE_CHECKING:\n    {UPWARDS}",
        "an arm imports": f"match 1:\n    case 1:\n        {UPWARDS}",
        "a relative import": "from ..runtime import sweep\n",
        "a relative import of a name": "from ..runtime.sweep import Trial\n",
        "a lambda": "import drake_mobarm as d\nlambda: d.runtime.sweep\n",
    },
    ("sensors/odometry.py", "imports runtime/simulation.py, not below it"): {
        "a lazy name is used": "import drake_mobarm\ndrake_mobarm.run\n",
    },
    ("placement/planner.py", "imports homing/filter.py, not below it"): {
        "a job imports another": "from drake_mobarm.homing import "
        "FilterParameters\n",
    },
    ("sensors/lidar.py", "makes no picture, imports matplotlib"): {
        "a law draws": "import matplotlib.pyplot as plt\n",
    },
    ("robot/shape.py", "imports what is only a text here"): {
        "a module by its text": "import importlib\n"
        "importlib.import_module('drake_mobarm.cli')\n",
        "another name of that": "from importlib import import_module as get\n",
        "the oldest way": "__import__('drake_mobarm.cli')\n",
    },
    ("runtime/sweep.py", "names the job 'homing'"): {
        "the runtime names a job": 'FIRST = "homing"\n',
        "the runtime names a job's file": 'FIRST = f"{1}/homing.yaml"\n',
    },
    ("runtime/sweep.py", "imports diagrams/homing.py, which is a job's"): {
        "a diagram": "from drake_mobarm.diagrams import homing\n",
    },
    ("cli.py", "imports placement/problem.py, which is a job's"): {
        "the command line imports a job": "from drake_mobarm import "
        "ToolTarget\n",
    },
    ("kitchen/stove.py", "no rule knows the room 'kitchen'"): {
        "a room that no rule knows": '"""Cooks."""\n',
    },
    ("homing/systems.py", "connects systems outside diagrams/"): {
        "a system connects others": "def wire(builder, a, b):\n"
        "    builder.Connect(a, b)\n",
        "by another name": "def wire(b):\n    c = b.Connect\n",
        "an input": "def wire(b, x):\n    b.ConnectInput('x', x)\n",
        "a cascade": "def wire(b, x, y):\n    b.Cascade(x, y)\n",
    },
}


@pytest.mark.parametrize(
    ("path", "said", "text"),
    [
        pytest.param(*place, text, id=violation)
        for place, texts in PLANTED.items()
        for violation, text in texts.items()
    ],
)
def test_a_planted_violation_is_found(path, said, text, tmp_path):
    assert f"{path}: {said}" in broken_with(path, text, tmp_path)


def test_a_docstring_may_name_a_job(tmp_path):
    text = 'def f():\n    """As homing.yaml."""\n'
    assert broken_with("runtime/sweep.py", text, tmp_path) == []


def test_what_only_types_need_is_not_loaded(tmp_path):
    text = f"{TYPES}if TYPE_CHECKING:\n    import drake_mobarm.signals\n"
    assert broken_with("homing/vector.py", text, tmp_path) == []


def broken_with(path, text, folder):
    """What breaks a rule in a copy where a file ends with some text."""
    root = folder / NAME
    shutil.copytree(
        PACKAGE, root, ignore=shutil.ignore_patterns("*.sdf", "*.csv")
    )
    file = root / path
    file.parent.mkdir(exist_ok=True)
    before = file.read_text() if file.exists() else ""
    file.write_text(before + text)
    return broken_rules(root)


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
