"""The files in a run's folder, by name."""

from __future__ import annotations

from pathlib import Path

from bipot.errors import ResultsError, require_path

RUN, TOOLS, CSV = "run.vtkhdf", "tools.vtkhdf", "history.csv"
"""The run itself, and what is written from it: its tools as moving lines, and its columns as a table."""

OLD = "run.h5"
"""The run file of an older version."""


def settled(path: str | Path) -> Path:
    """The absolute path, which stays the same when the process changes its working directory.

    Raises:
        ResultsError: it is relative, and the working directory is gone.
    """
    try:
        return Path(path).absolute()
    except OSError as error:
        raise ResultsError(f"{path}: cannot be read or written (no working directory: {error.strerror})") from error


def run_file(path: str | Path) -> Path:
    """The run file of a folder, or itself, as an absolute path.

    Raises:
        ResultsError: the file is one of an older version, which is not read; or the system refuses the name.
    """
    require_path(path)
    path = settled(path)
    old = path if path.name == OLD else path / OLD
    new = old.with_name(RUN)
    try:
        if old.is_file() and not new.is_file():
            raise ResultsError(f"{old}: was written by an older version and is not read; delete it and run again")
        return new if path == old or not path.is_file() else path
    except OSError as error:
        # A name that is too long, or a folder without permission.
        raise ResultsError(f"{path}: cannot be read ({error.strerror})") from error
