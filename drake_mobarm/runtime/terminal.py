"""What a command says: its output, one line an error, what nobody foresaw."""

import contextlib
import os
import sys
import tempfile
import traceback
from collections.abc import Iterator, Sequence
from typing import TextIO

from drake_mobarm import __version__
from drake_mobarm.exceptions import OutputError


def say(text: str) -> None:
    """Prints to the standard output.

    Raises:
        BrokenPipeError: its reader has gone.
        OutputError: it cannot be written.
    """
    with _writing_output():
        print(text)


def flush() -> None:
    """Writes what was said; raises as `say`."""
    with _writing_output():
        if sys.stdout is not None:
            sys.stdout.flush()


@contextlib.contextmanager
def _writing_output() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        abandon(sys.stdout)
        raise OutputError(
            f"the standard output cannot be written: {error.strerror}"
        ) from error


def abandon(stream: TextIO) -> None:
    """Drops what is left to print, which Python would flush on leaving."""
    with contextlib.suppress(OSError):  # No file, where tests replace it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def tell(line: str, program: str = "mobarm") -> None:
    """Says a line on the standard error, if there is anybody to hear it."""
    line = f"{program}: {' '.join(line.split())}"
    try:
        print(line, file=sys.stderr, flush=True)
    except OSError:
        abandon(sys.stderr)


def warn(message: Warning | str, *_: object, **__: object) -> None:
    """Says a warning: in the place of `warnings.showwarning`."""
    tell(str(message))


def tell_fault(error: Exception, arguments: Sequence[str]) -> None:
    """Says what nobody foresaw, and where its traceback is kept."""
    trace = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile(
            "w",
            prefix="mobarm-error-",
            suffix=".txt",
            delete=False,
            encoding="utf-8",
            errors="backslashreplace",
        ) as file:
            file.write(
                f"drake_mobarm {__version__}, Python {sys.version}\n"
                f"arguments: {list(arguments)!r}\n\n{trace}"
            )
        where = f"please report it with {file.name}"
    except OSError:
        where = f"at {trace.splitlines()[-2].strip()}"
    line = " ".join(str(error).split())[:200]
    tell(f"unforeseen {type(error).__name__}: {line}; {where}")
