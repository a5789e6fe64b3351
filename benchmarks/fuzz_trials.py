"""How a trial of the fuzz ends, and what it violates.

In a module of its own: its functions go to child processes by their names.
"""

import tempfile
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from faults import make_blocks
from homing_sweep import Row
from recycling import in_child

from drake_mobarm import load_scenario, run
from drake_mobarm.exceptions import MobarmError
from drake_mobarm.job import RunRecord

LIMITS = {"scenario": 20.0, "fault": 120.0}  # Of wall time [s].
ERROR = 0.5  # [m]


def do_trial(trial: Mapping[str, Any]) -> Row:
    """A trial's row, from a child process."""
    started = time.perf_counter()
    seconds = LIMITS["fault" if "fault" in trial else "scenario"]
    row = in_child(examine, seconds, trial)
    if "died" in row:
        row = {"end": "died", "violations": [row["died"]]}
    spent = round(time.perf_counter() - started, 3)
    return {**trial, "spent_s": spent, **row}


def examine(trial: Mapping[str, Any]) -> Row:
    """How a trial ended, and what it violates."""
    try:
        return _examine(trial)
    except MobarmError as error:
        text = f"{type(error).__name__}: {error}"
        wrong = "fault" in trial or "\n" in text
        violations = [text] if wrong else []
        return {"end": "refused", "why": text, "violations": violations}
    except TimeoutError:
        return {"end": "stopped", "violations": []}
    except Exception as error:
        text = f"{type(error).__name__}: {error}"
        return {"end": "raised", "violations": [text]}


def _examine(trial: Mapping[str, Any]) -> Row:
    scenario = load_scenario(trial["job"], trial["overrides"])
    blocks = {}
    if "fault" in trial:
        blocks = make_blocks(trial["fault"], scenario)
    result = run(scenario, trial["seed"], blocks=blocks)
    violations = find_violations(result)
    if "fault" in trial:
        error = result.metrics["final_position_error_m"]
        if result.outputs["arrived"][0] > 0.5 and not error <= ERROR:
            violations.append(f"arrived {error:.2f} m from the beacon")
    result.describe()
    # Pictures take longer than many a run.
    if "fault" in trial or trial["seed"] % 10 == 0:
        with tempfile.TemporaryDirectory() as folder:
            result.save(folder)
    return {
        "end": "success" if result.success else "no success",
        "why": result.reason,
        "simulated_s": result.simulated_s,
        "violations": violations,
    }


def find_violations(result: RunRecord) -> list[str]:
    """Commands of a run that are not finite."""
    command = result.trace.get("commanded_base_velocity", np.zeros((0, 2)))
    wrong = ~np.isfinite(command).all(axis=1)
    if not wrong.any():
        return []
    first = result.trace["t"][wrong][0]
    return [f"a command is not finite, first at {first:g} s"]
