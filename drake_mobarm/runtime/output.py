"""Folders of results: each holds one result, whole or not at all."""

import contextlib
import fcntl
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from drake_mobarm.exceptions import OutputError

INDEXES = ("summary.json", "table.json")
"""Files that list, as `files`, what belongs to a result."""

# What is ours alone, and gone when a result is there.
_OURS = ".mobarm-"
_LOCK = _OURS + "lock"
_STAGE = _OURS + "stage-"


@contextlib.contextmanager
def staged_folder(
    folder: Path, is_same: Callable[[Path], bool], force: bool = False
) -> Iterator[Path]:
    """A scratch folder whose files move to `folder` when all are written.

    Opened before the work begins, so that a folder that cannot be written is
    known at once; whatever interrupts the work leaves nothing behind. Until
    then no other process gets the same folder. The files of an earlier result
    there are removed when the new one is whole.

    Args:
        folder: where the files go; made where it is missing.
        is_same: whether the result that a folder holds may be replaced,
            because it is of the same kind and setting.
        force: whether any result may be replaced, and files of others kept
            company.

    Raises:
        OutputError: the folder cannot be written, is being written, or holds
            something else.
    """
    folder = folder.absolute()
    made: list[Path] = []
    try:
        with writing(f"output folder {folder}"):
            made = [p for p in (folder, *folder.parents) if not p.exists()]
            folder.mkdir(parents=True, exist_ok=True)
            lock = _lock(folder)
        try:
            _check(folder, is_same, force)
            with writing(f"output folder {folder}"):
                for stale in folder.glob(f"{_STAGE}*"):
                    shutil.rmtree(stale)
                stage = Path(tempfile.mkdtemp(dir=folder, prefix=_STAGE))
            try:
                yield stage
                with writing(f"output folder {folder}"):
                    _move(stage, folder)
            finally:
                shutil.rmtree(stage, ignore_errors=True)
        finally:
            (folder / _LOCK).unlink(missing_ok=True)
            os.close(lock)
    finally:
        for new in made:  # The innermost first.
            with contextlib.suppress(OSError):
                new.rmdir()  # Where nothing came into it.


def write_file(path: Path, text: str) -> None:
    """Writes a file, whole or not at all.

    Raises:
        OutputError: it cannot be written.
    """
    with writing(str(path)):
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = path.with_name(f"{_OURS}{os.getpid()}-{path.name}")
        try:
            draft.write_text(text)
            os.replace(draft, path)
        finally:
            draft.unlink(missing_ok=True)


@contextlib.contextmanager
def writing(target: str) -> Iterator[None]:
    """Tells what the system refuses as an OutputError about the target."""
    try:
        yield
    except OSError as error:
        raise OutputError(
            f"{target} cannot be written: {error.strerror or error}"
        ) from error


@contextlib.contextmanager
def kept(
    problems: list[str], what: str, folder: Path | None = None
) -> Iterator[None]:
    """Whatever goes wrong is a problem, and leaves nothing half-written."""
    before = set() if folder is None else set(folder.iterdir())
    try:
        yield
    except Exception as error:
        for half in set() if folder is None else {*folder.iterdir()} - before:
            shutil.rmtree(half) if half.is_dir() else half.unlink()
        line = " ".join(str(error).split())
        problems.append(f"{what} failed: {type(error).__name__}: {line}")


def _lock(folder: Path) -> int:
    """Locks a folder for this process; the lock ends with it."""
    while True:
        lock = os.open(folder / _LOCK, os.O_CREAT | os.O_RDWR)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(lock), os.stat(folder / _LOCK)):
                return lock
        except BlockingIOError as error:
            os.close(lock)
            raise OutputError(
                f"output folder {folder} is being written by another run: "
                "choose another folder (--out)"
            ) from error
        except FileNotFoundError:
            pass
        os.close(lock)  # Its owner has just removed it.


def _check(folder: Path, is_same: Callable[[Path], bool], force: bool) -> None:
    """Refuses a folder with something else in it."""
    present = [
        file for file in folder.iterdir() if not file.name.startswith(_OURS)
    ]
    if force or not present or is_same(folder):
        return
    result = any((folder / index).exists() for index in INDEXES)
    what = "another result" if result else "other files"
    raise OutputError(
        f"output folder {folder} holds {what}: choose another folder (--out), "
        "or --force"
    )


def _move(stage: Path, folder: Path) -> None:
    """Moves a result to its folder, in place of the one that is there."""
    new = {file.name for file in stage.iterdir()}
    for name in sorted(new):
        if (folder / name).is_dir():
            raise OutputError(
                f"output folder {folder} cannot be written: {name} is a "
                "folder there"
            )
    old = _files_of(folder)
    for name in sorted(new):
        os.replace(stage / name, folder / name)
    for name in old - new:
        (folder / name).unlink(missing_ok=True)


def _files_of(folder: Path) -> set[str]:
    """The files of the result that a folder holds."""
    files: set[str] = set()
    for index in INDEXES:
        try:
            listed = json.loads((folder / index).read_bytes())["files"]
            names = {name for name in listed if Path(name).name == name}
        except (OSError, ValueError, KeyError, TypeError):
            continue  # Of an older version, or none of ours.
        files |= {n for n in names if (folder / n).is_file()} | {index}
    return files
