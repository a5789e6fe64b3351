"""What the benchmarks share: one core, the machine, the files written."""

import argparse
import json
import os
import platform
from pathlib import Path
from typing import Any


def parse(parser: argparse.ArgumentParser) -> argparse.Namespace:
    """The options, with --out, whose folder has to be there."""
    parser.add_argument("--out", type=Path, help="a .md; a .json beside it")
    options = parser.parse_args()
    if options.out is not None and not options.out.parent.is_dir():
        parser.exit(2, f"--out is {options.out}: there is no such folder\n")
    return options


def use_one_core() -> None:
    """Keeps this process on one core, where the system can."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def processor() -> str:
    """The processor's model, where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    models = [line.split(":")[1] for line in lines if line[:10] == "model name"]
    return models[0].strip() if models else platform.machine()


def publish(lines: list[str], measured: Any, out: Path | None) -> None:
    """Prints the lines and, if asked, writes them and what was measured."""
    print("\n".join(lines))
    if out is not None:
        out.write_text("\n".join(lines) + "\n")
        out.with_suffix(".json").write_text(
            json.dumps(measured, indent=2) + "\n"
        )
