"""A diagram of the user's own, from a Python file: `diagram: path.py`.

The file has a function `build(scenario, *, seed, meshcat=None)` that gives a
Diagram with an output `done` (1) and logs. Optional are `Scenario`, the
dataclass of its scenarios; `judge(scenario, trace, outputs)`, which gives a
`Verdict`; `set_stage(meshcat, scenario)`; and `REPORT`, a `Report`.
"""

import importlib.util
import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType

from drake_mobarm.checks import within
from drake_mobarm.exceptions import ScenarioError
from drake_mobarm.job import Job, judge_by_done


@dataclass(kw_only=True)
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

    Raises:
        ScenarioError: there is no such file, it fails, or has no `build`.
    """
    if not path.is_file():
        raise ScenarioError(f"diagram {path}: there is no such file")
    module = _load(path.resolve(), path.stat().st_mtime_ns)
    if not callable(getattr(module, "build", None)):
        raise ScenarioError(
            f"diagram {path} has no function build(scenario, *, seed, "
            "meshcat=None)"
        )
    return Job(
        name=path.stem,
        scenario=getattr(module, "Scenario", OwnScenario),
        judge=getattr(module, "judge", judge_by_done),
        module=module,
    )


@lru_cache(maxsize=16)
def _load(path: Path, _modified: int) -> ModuleType:
    name = f"drake_mobarm_diagram_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # Dataclasses look their module up.
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        # Whatever a user's file raises is one line about that file.
        line = " ".join(str(error).split())
        raise ScenarioError(
            f"diagram {path}: {type(error).__name__}: {line}"
        ) from error
    return module
