"""The command line: mobarm run | reproduce | list | draw."""

import argparse
import hashlib
import io
import logging
import os
import re
import shutil
import signal
import subprocess
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from tqdm import tqdm

from drake_mobarm import __version__
from drake_mobarm.checks import shown
from drake_mobarm.exceptions import MobarmError, OutputError
from drake_mobarm.job import find_tables
from drake_mobarm.runtime.output import staged_folder, write_file, writing
from drake_mobarm.runtime.result import holds_run
from drake_mobarm.runtime.scenarios import (
    dump_record,
    load_scenario,
    read_record,
    scenario_names,
)
from drake_mobarm.runtime.simulation import build_diagram, run
from drake_mobarm.runtime.tables import reproduce
from drake_mobarm.runtime.terminal import (
    abandon,
    flush,
    say,
    tell,
    tell_fault,
    warn,
)
from drake_mobarm.world.sdf import world_names

# Of what is set, in the name of a run's folder.
_NAME_LENGTH = 60
_FORCE = "replace what else the folder holds"

SUCCESS, FAILURE, BAD_INPUT, FAULT, INTERRUPTED = 0, 1, 2, 70, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command.

    Whatever goes wrong is one line: nothing is raised but what leaves Python.

    Returns:
        0: the robot did its job; 1: it ran and did not; 2: bad input; 70: a
        fault of this program; 130: interrupted.
    """
    # Pictures go to files, whatever windows the environment asks for.
    os.environ["MPLBACKEND"] = "agg"
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # Names of files need not be text.
            stream.reconfigure(errors="backslashreplace")
    try:
        with warnings.catch_warnings():
            warnings.showwarning = warn
            return _run_command(arguments)
    except Exception as error:
        words = sys.argv[1:] if arguments is None else arguments
        tell_fault(error, words)
        return FAULT


def _run_command(arguments: Sequence[str] | None) -> int:
    try:
        try:
            options = _make_parser().parse_args(arguments)
            # A kill cleans up as Ctrl-C does.
            signal.signal(signal.SIGTERM, signal.default_int_handler)
            # Drake tells on which port Meshcat listens at every recording.
            logging.getLogger("drake").setLevel(logging.WARNING)
            code: int = options.command(options)
            return code
        finally:
            flush()
    except MobarmError as error:
        tell(str(error))
        return BAD_INPUT
    except BrokenPipeError:
        # The reader of the output has gone: nothing more to say.
        abandon(sys.stdout)
        return INTERRUPTED
    except KeyboardInterrupt:
        tell("interrupted")
        return INTERRUPTED


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, as everything else here does."""

    def error(self, message: str) -> NoReturn:
        tell(message, self.prog)
        self.exit(BAD_INPUT)


def _make_parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="mobarm",
        description="Simulates a mobile arm from 'the target is somewhere in "
        "this building' on.",
        allow_abbrev=False,
    )
    parser.add_argument(
        "--version", action="version", version=f"mobarm {__version__}"
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    command = commands.add_parser("run", help="simulate a scenario")
    command.add_argument(
        "scenario",
        metavar="SCENARIO",
        help="a shipped scenario's name, or the path of a YAML file",
    )
    command.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="where to write (default: runs/SCENARIO-seedN, with what is set)",
    )
    command.add_argument("--force", action="store_true", help=_FORCE)
    command.add_argument(
        "--seed",
        type=_count,
        help="of all noise (default: the scenario's, or 0)",
    )
    command.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="KEY.PATH=VALUE",
        help="change a value of the scenario",
    )
    command.add_argument(
        "--no-html", action="store_true", help="leave out the recording"
    )
    command.add_argument(
        "--live",
        action="store_true",
        help="watch in a browser while it runs, at real time",
    )
    command.set_defaults(command=_run)

    command = commands.add_parser(
        "reproduce", help="run a table's experiment and compare"
    )
    command.add_argument("table", metavar="TABLE", help="see `mobarm list`")
    command.add_argument(
        "--trials", type=_positive, help="how many a case (default: all)"
    )
    command.add_argument(
        "--jobs",
        type=_positive,
        default=None,
        help="processes (default: one a core)",
    )
    command.add_argument("--seed", type=_count, default=0)
    command.add_argument(
        "--only", metavar="TEXT", help="the cases whose names hold a text"
    )
    command.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="where to write, and to go on from "
        "(default: runs/table-TABLE-seedN)",
    )
    command.add_argument("--force", action="store_true", help=_FORCE)
    command.add_argument(
        "--dask", metavar="ADDRESS", help="of a Dask scheduler to work on"
    )
    command.set_defaults(command=_reproduce)

    command = commands.add_parser("list", help="scenarios, worlds and tables")
    command.set_defaults(command=_list)

    command = commands.add_parser("draw", help="draw the block diagram")
    command.add_argument("scenario", metavar="SCENARIO")
    command.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="DOT, or SVG by its ending (default: DOT to the terminal)",
    )
    command.set_defaults(command=_draw)
    return parser


def _whole_number(text: str, least: int) -> int:
    try:
        number = int(text)
    except ValueError:
        number = least - 1
    if number < least:
        raise argparse.ArgumentTypeError(
            f"{shown(text)}: valid is a whole number, {least} or more"
        )
    return number


def _count(text: str) -> int:
    return _whole_number(text, 0)


def _positive(text: str) -> int:
    return _whole_number(text, 1)


def _run(options: argparse.Namespace) -> int:
    overrides = options.overrides
    if options.seed is not None:
        overrides = [*overrides, f"seed={options.seed}"]
    scenario, seed, is_record = read_record(options.scenario, overrides)
    name = _name(options.scenario, options.overrides, is_record)
    folder = options.out or Path("runs") / f"{name}-seed{seed}"
    same = holds_run(dump_record(scenario, seed))
    with staged_folder(folder, same, options.force) as stage:
        bar = tqdm(
            total=scenario.time_limit,
            unit="s",
            disable=None,
            leave=False,
            bar_format="{desc} {n:.1f} s simulated, {elapsed} passed",
            desc=name,
        )
        with bar:
            result = run(
                scenario,
                seed,
                record=not options.no_html,
                live=options.live,
                on_progress=lambda time: bar.update(time - bar.n),
                on_live=lambda address: say(f"watch at {address}"),
            )
        with writing(f"output folder {folder}"):
            shown = result.write(stage)
    say(result.describe())
    say(f"open {folder / shown}")
    return SUCCESS if result.success else FAILURE


def _name(scenario: str, overrides: Sequence[str], is_record: bool) -> str:
    """What a run is called: as its scenario, or as the run that it repeats.

    And as what was set, in few words.
    """
    file = Path(scenario)
    name = file.stem
    if is_record:
        name = re.sub(r"-seed\d+$", "", file.resolve().parent.name)
    values = dict(override.split("=", 1) for override in overrides)
    values.pop("seed", None)
    settings = "-".join(
        f"{key}={re.sub(r'[^A-Za-z0-9_.,+-]', '', text.rpartition('/')[2])}"
        for key, text in sorted(values.items())
    )
    if len(settings) > _NAME_LENGTH:
        digest = hashlib.sha256(settings.encode()).hexdigest()[:8]
        settings = f"{settings[:_NAME_LENGTH]}-{digest}"
    return f"{name}-{settings}" if settings else name


def _reproduce(options: argparse.Namespace) -> int:
    some = "" if options.trials is None else f"-trials{options.trials}"
    if options.only is not None:
        some += "-" + re.sub(r"\W+", "-", options.only)[:_NAME_LENGTH]
    name = f"table-{options.table}{some}-seed{options.seed}"
    folder = options.out or Path("runs") / name
    reproduce(
        options.table,
        folder,
        trials=options.trials,
        jobs=options.jobs,
        seed=options.seed,
        only=options.only,
        dask=options.dask,
        force=options.force,
    )
    say((folder / "table.md").read_text())
    say(f"written to {folder}")
    return SUCCESS


def _list(options: argparse.Namespace) -> int:
    for title, names in (
        ("scenarios", scenario_names()),
        ("worlds", world_names()),
        ("tables", list(find_tables())),
    ):
        say(f"{title}: {', '.join(names)}")
    return SUCCESS


def _draw(options: argparse.Namespace) -> int:
    ending = "" if options.out is None else options.out.suffix.lower()
    if ending not in ("", ".dot", ".svg"):
        raise OutputError(f"--out {options.out}: valid is a .dot or .svg file")
    diagram = build_diagram(load_scenario(options.scenario))
    dot = diagram.GetGraphvizString()
    if options.out is None:
        say(dot)
        return SUCCESS
    write_file(options.out, _render(dot) if ending == ".svg" else dot)
    say(f"open {options.out}")
    return SUCCESS


def _render(dot: str) -> str:
    """DOT as SVG."""
    program = shutil.which("dot")
    if program is None:
        raise OutputError(
            "--out: SVG needs Graphviz's program `dot`; without it "
            "write a .dot file"
        )
    done = subprocess.run(
        [program, "-Tsvg"],
        input=dot,
        text=True,
        capture_output=True,
        check=False,
    )
    if done.returncode:
        raise OutputError(f"Graphviz fails: {' '.join(done.stderr.split())}")
    return done.stdout
