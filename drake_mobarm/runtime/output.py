"""Results that appear whole or not at all."""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from drake_mobarm.exceptions import OutputError


@contextlib.contextmanager
def staged_folder(folder: Path, replaced: Sequence[str] = ()) -> Iterator[Path]:
    """A scratch folder whose files move to `folder` when all are written.

    Opened before the work begins, so that a folder that cannot be written is
    known at once; whatever interrupts the work leaves nothing behind.

    Args:
        folder: where the files go.
        replaced: names of files that an earlier result may have left there
            and that are removed where the new one has none.

    Raises:
        OutputError: the folder cannot be written.
    """
    folder = folder.absolute()
    parent = next(p for p in (folder, *folder.parents) if p.exists())
    try:
        stage = Path(tempfile.mkdtemp(prefix=".mobarm-", dir=parent))
    except OSError as error:
        raise OutputError(
            f"output folder {folder} cannot be written: {error.strerror}"
        ) from error
    try:
        yield stage
        folder.mkdir(parents=True, exist_ok=True)
        new = {file.name for file in stage.iterdir()}
        for name in sorted(new):
            if (folder / name).is_dir():
                raise OutputError(
                    f"output folder {folder} cannot be written: {name} is a "
                    "folder there"
                )
        for file in sorted(stage.iterdir()):
            os.replace(file, folder / file.name)
        for name in replaced:
            if name not in new:
                (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(
            f"output folder {folder} cannot be written: {error.strerror}"
        ) from error
    finally:
        shutil.rmtree(stage, ignore_errors=True)
