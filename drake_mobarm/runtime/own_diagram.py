"""A diagram of the user's own, from a Python file: `diagram: path.py`.

The file has a function `build(scenario, *, seed, meshcat=None)` that gives a
Diagram with an output `done` (1) and logs. Optional are `Scenario`, the
dataclass of its scenarios; `judge(scenario, trace, outputs)`, which gives a
`Verdict`; `set_stage(meshcat, scenario)`; and `REPORT`, a `Report`.
"""

import contextlib
import dataclasses
import hashlib
import sys
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

from drake_mobarm.checks import shown, within
from drake_mobarm.exceptions import MobarmError, ScenarioError
from drake_mobarm.frozen import frozen
from drake_mobarm.job import Job, Verdict, judge_by_done


@frozen
class OwnScenario:
    """A scenario of a user's own diagram that has no `Scenario` of its own.

    Attributes:
        diagram: the path of the file.
        time_limit: after which the run ends without success [s].
    """

    diagram: str
    time_limit: float = 60.0

    def __post_init__(self) -> None:
        within(self, "(0, 3600]", "time_limit")


def load_own_diagram(path: Path) -> Job:
    """The job that a Python file describes.

    What the file's functions raise is told as an error of the file.

    Raises:
        ScenarioError: there is no such file, it fails, has no `build`, or its
            `Scenario` is not of a form that can be read.
    """
    try:
        module = _load(path.resolve(), path.stat().st_mtime_ns)
    except FileNotFoundError as error:
        raise ScenarioError(f"diagram {path}: there is no such file") from error
    except OSError as error:
        raise ScenarioError(
            f"diagram {shown(str(path))} cannot be read: {error.strerror}"
        ) from error
    if not callable(getattr(module, "build", None)):
        raise ScenarioError(
            f"diagram {path} has no function build(scenario, *, seed, "
            "meshcat=None)"
        )
    scenario = getattr(module, "Scenario", OwnScenario)
    if not dataclasses.is_dataclass(scenario) or not {
        "diagram",
        "time_limit",
    } <= {field.name for field in dataclasses.fields(scenario)}:
        raise ScenarioError(
            f"diagram {path}: its Scenario has to be a dataclass with the "
            "fields diagram and time_limit"
        )
    judge = getattr(module, "judge", judge_by_done)
    parts = vars(module) | {"build": _guarded(path, module.build)}
    return Job(
        name=path.stem,
        scenario=scenario,
        judge=_guarded(path, lambda *run: Verdict(*judge(*run))),
        module=SimpleNamespace(**parts),
    )


def _guarded(path: Path, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function; whatever it raises is one line about its file."""

    def call(*arguments: Any, **named: Any) -> Any:
        with _errors_of(path):
            return function(*arguments, **named)

    return call


@contextlib.contextmanager
def _errors_of(path: Path) -> Iterator[None]:
    try:
        yield
    except MobarmError:
        raise
    except (Exception, SystemExit) as error:
        line = " ".join(str(error).split())
        raise ScenarioError(
            f"diagram {path}: {type(error).__name__}: {line}"
        ) from error


@lru_cache(maxsize=16)
def _load(path: Path, _modified: int) -> ModuleType:
    # Files of one name in several folders are several modules.
    digest = hashlib.sha256(str(path).encode()).hexdigest()[:12]
    name = f"drake_mobarm_diagram_{path.stem}_{digest}"
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module  # Dataclasses look their module up.
    with _errors_of(path):
        # Not by an importer, which would write bytecode beside the file, and
        # take it for the file's where both are of the same second and size.
        code = compile(path.read_text(encoding="utf-8"), str(path), "exec")
        exec(code, vars(module))
    return module
