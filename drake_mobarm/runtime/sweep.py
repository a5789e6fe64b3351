"""Many independent trials in parallel, saved as they finish, resumable."""

import contextlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import joblib
from tqdm import tqdm

from drake_mobarm.exceptions import OutputError

Trial = Mapping[str, Any]
Outcome = dict[str, Any]


def run_sweep(
    trials: Sequence[Trial],
    work: Callable[[Trial], Outcome],
    store: Path,
    identity: Mapping[str, Any],
    jobs: int | None = None,
    dask: str | None = None,
    force: bool = False,
) -> list[Outcome]:
    """Runs the trials that a file does not hold yet.

    A finished trial is a line of the file at once, so a sweep that was
    interrupted goes on from there.

    Args:
        trials: what to do; each has a "trial", its number.
        work: does one trial; picklable. What it gives goes through JSON.
        store: the file, in JSON lines.
        identity: what tells this sweep from another, in JSON.
        jobs: processes; None for one a core.
        dask: address of a Dask scheduler to work on instead.
        force: whether to begin anew where the file holds another sweep.

    Returns:
        The outcomes in the trials' order, whatever the order in which they
        finished.

    Raises:
        OutputError: the file cannot be written, or holds another sweep, or
            no Dask scheduler answers.
    """
    finished = _open_store(store, identity, force)
    missing = [t for t in trials if t["trial"] not in finished]
    with _backend(dask), store.open("a", encoding="utf-8") as file:
        parallel = joblib.Parallel(
            n_jobs=jobs or joblib.cpu_count(),
            return_as="generator_unordered",
        )
        outcomes = parallel(
            joblib.delayed(_do)(work, trial) for trial in missing
        )
        for number, outcome in tqdm(
            outcomes,
            total=len(trials),
            initial=len(trials) - len(missing),
            unit="trial",
            disable=None,
        ):
            line = json.dumps({"trial": number, "outcome": outcome})
            finished[number] = json.loads(line)["outcome"]
            file.write(line + "\n")
            file.flush()
    return [finished[trial["trial"]] for trial in trials]


def _do(work: Callable[[Trial], Outcome], trial: Trial) -> tuple[int, Outcome]:
    return trial["trial"], work(trial)


def _open_store(
    store: Path, identity: Mapping[str, Any], force: bool
) -> dict[int, Outcome]:
    """The finished trials; what a kill left half-written is cut off."""
    head = json.dumps({"sweep": dict(identity)})
    try:
        store.parent.mkdir(parents=True, exist_ok=True)
        if not store.exists():
            store.write_text(head + "\n")
        lines = store.read_text().splitlines(keepends=True)
        whole = [line for line in lines if line.endswith("\n")]
        if len(whole) < len(lines):
            store.write_text("".join(whole))
    except OSError as error:
        raise OutputError(
            f"output folder {store.parent} cannot be written: {error.strerror}"
        ) from error
    if not whole or whole[0].strip() != head:
        if force:
            store.unlink()
            return _open_store(store, identity, False)
        raise OutputError(
            f"{store} holds another sweep: choose another --out, or --force"
        )
    entries = [json.loads(line) for line in whole[1:]]
    return {entry["trial"]: entry["outcome"] for entry in entries}


@contextlib.contextmanager
def _backend(dask: str | None) -> Iterator[None]:
    if dask is None:
        # One thread a process: the trials fill the cores by themselves.
        with joblib.parallel_config("loky", inner_max_num_threads=1):
            yield
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise OutputError(
            "--dask needs the extra: pip install 'drake_mobarm[dask]'"
        ) from error
    try:
        client = Client(dask, timeout=10)
    except (OSError, ValueError) as error:
        raise OutputError(
            f"no Dask scheduler answers at {dask}: {error}"
        ) from error
    with client, joblib.parallel_config("dask"):
        yield
