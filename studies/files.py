"""Files that are there whole or not at all, whatever stops the one who writes them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bipot.basics.replacing import replacing as replaced
from bipot.errors import ResultsError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name in the same folder to write to, whose file takes the place of ``path`` when the block ends.

    A kill or a full disk leaves the file that was there, or none.

    Raises:
        ResultsError: it cannot be written.
    """
    with sentence(path, "written"):
        path.parent.mkdir(parents=True, exist_ok=True)
    with replaced(path, ResultsError) as part:
        yield part


@contextmanager
def sentence(path: Path, verb: str) -> Iterator[None]:
    """What the system refuses is said as a :class:`ResultsError` that names the path: it cannot be ``verb``."""
    try:
        yield
    except OSError as error:
        raise ResultsError(f"{path}: cannot be {verb} ({error.strerror or error})") from error


def require_writable(folder: Path) -> None:
    """Make the folder and a file in it for a moment, so that no hours are spent on what cannot be kept.

    Raises:
        ResultsError: the folder cannot be made, or not be written to.
    """
    with sentence(folder, "written"):
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".{os.getpid()}.part"
        probe.touch()
        probe.unlink()
