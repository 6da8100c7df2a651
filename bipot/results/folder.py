"""The files in a run's folder, by name."""

from __future__ import annotations

from pathlib import Path

from bipot.errors import ResultsError, require_path

RUN, TOOLS, CSV = "run.vtkhdf", "tools.vtkhdf", "history.csv"
"""The run itself, and what is written from it: its tools as moving lines, and its columns as a table."""


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
        ResultsError: the system refuses the name.
    """
    require_path(path)
    path = settled(path)
    try:
        return path if path.is_file() else path / RUN
    except OSError as error:
        # A name that is too long, or a folder without permission.
        raise ResultsError(f"{path}: cannot be read ({error.strerror})") from error
