"""Trials in a child process that is replaced now and then, and may die.

Drake never frees a Python LeafSystem, so a process that runs hundreds of
diagrams fills the memory; and a fuzz has to outlive what it makes crash.
"""

import multiprocessing
import multiprocessing.util
import resource
import signal
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any

Row = dict[str, Any]

_TRIALS = 40  # Of a child.
_MEMORY = 6 << 30  # Of a child [bytes].
_PATIENCE = 2.0  # Times the limit of a trial, until its child is killed.


class _Child:
    """The child of this process."""

    pool: ProcessPoolExecutor | None = None
    trials = 0

    @classmethod
    def get(cls) -> ProcessPoolExecutor:
        """A child that has not done all its trials."""
        if cls.trials >= _TRIALS:
            cls.end()
        if cls.pool is None:
            # A worker of joblib has a start method that a child does not know.
            multiprocessing.set_start_method("spawn", force=True)
            spawn = multiprocessing.get_context("spawn")
            cls.pool = ProcessPoolExecutor(1, spawn, initializer=_limit)
            # A worker that ends would wait for its child for ever.
            multiprocessing.util.Finalize(None, cls.end, exitpriority=10)
        cls.trials += 1
        return cls.pool

    @classmethod
    def end(cls) -> None:
        """Ends the child, whatever it does."""
        if cls.pool is not None:
            for process in list((cls.pool._processes or {}).values()):
                process.kill()
            cls.pool.shutdown()
        cls.pool, cls.trials = None, 0


def in_child(
    work: Callable[[Mapping[str, Any]], Row],
    seconds: float,
    trial: Mapping[str, Any],
) -> Row:
    """What a trial gives, from a child process.

    Args:
        work: does the trial; picklable. It is interrupted by a TimeoutError.
        seconds: of wall time after which it is.
        trial: what to do.

    Returns:
        The row of `work`; {"died": why} where the child did not give one.
    """
    future = _Child.get().submit(_do, work, seconds, trial)
    try:
        return future.result(_PATIENCE * seconds + 10)
    except BrokenProcessPool:
        _Child.end()
        return {"died": "the process crashed"}
    except TimeoutError:
        _Child.end()
        return {"died": f"no end after {_PATIENCE * seconds + 10:g} s"}


def _limit() -> None:
    """Makes what asks for too much memory fail by itself."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))


def _do(
    work: Callable[[Mapping[str, Any]], Row],
    seconds: float,
    trial: Mapping[str, Any],
) -> Row:
    signal.signal(signal.SIGALRM, _interrupt)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        return work(trial)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def _interrupt(number: int, frame: Any) -> None:
    raise TimeoutError
