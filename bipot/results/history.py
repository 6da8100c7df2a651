"""Reading a run: its columns, what was asked, and its states, from ``run.vtkhdf`` alone.

``history.csv`` beside it is a copy for people. The file may be a stranger's, or still be written: it is checked before
it is believed (:mod:`bipot.hdf5.checked`), and read again where a writer was faster.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from numpy.typing import NDArray

from bipot.course import Course
from bipot.errors import ResultsError, require
from bipot.hdf5.journal import journal_of, pages_in
from bipot.mesh import Mesh
from bipot.response import State
from bipot.results.description import Parameters
from bipot.results.stored import Run, read
from bipot.results.table import columns

T = TypeVar("T")

FIELDS, OLD = "run.vtkhdf", "run.h5"


@dataclass(frozen=True)
class History:
    """A run read back: its columns as arrays (n,), what was asked, in which units, and its states.

    ``text`` is that of ``history.csv``. ``note`` says in words where a write was interrupted; empty if none was.
    States and fields are read from the file as they are asked for, and refused once it holds another run.
    """

    file: Path
    text: str
    columns: Mapping[str, NDArray[Any]]
    parameters: Parameters
    units: Mapping[str, str]
    scene: Mapping[str, Any]
    complete: bool
    note: str = ""

    @property
    def folder(self) -> Path:
        """Where the run is."""
        return self.file.parent

    def __getitem__(self, name: str) -> NDArray[Any]:
        require(name in self.columns, "column", name, f"one of {list(self.columns)}")
        return self.columns[name]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def mesh(self) -> Mesh:
        """The mesh at rest."""
        return self._read(Run.mesh)

    @property
    def start(self) -> Course:
        """Where the march began: step 0."""
        return self._course(0)

    @property
    def end(self) -> Course:
        """Where the march was when the last step was recorded: ``march(start=...)`` goes on from it."""
        return self._course(len(self))

    def state(self, row: int = -1) -> State:
        """The state after the increment of ``row`` (negative: from the end)."""
        return self.course(row).state

    def course(self, row: int = -1) -> Course:
        """Where the march was after the increment of ``row``."""
        return self._course(1 + self._row(row))

    def nodal(self, name: str, row: int = -1) -> NDArray[Any]:
        """Nodal field ``name`` after the increment of ``row``: (a,) or (a, 3)."""
        step = 1 + self._row(row)
        return self._read(lambda run: run.field("PointData", name, step))

    def cell(self, name: str, row: int = -1) -> NDArray[Any]:
        """Field ``name`` of the elements, an average over each, after the increment of ``row``: (e,) or (e, 6)."""
        step = 1 + self._row(row)
        return self._read(lambda run: run.field("CellData", name, step))

    def _row(self, row: int) -> int:
        count = len(self)
        require(-count <= row < count, "row", row, f"in [{-count}, {count}), an accepted increment")
        return row % count

    def _course(self, step: int) -> Course:
        return self._read(lambda run: run.course(step))

    def _read(self, what: Callable[[Run], T]) -> T:
        """What the file tells, as long as it is the one whose columns these are, maybe with further rows."""

        def own(run: Run) -> T:
            if not run.history().startswith(self.text):
                raise ResultsError(f"{self.file}: holds another run than when it was opened: open it again")
            return what(run)

        return read(self.file, own)


def open(path: str | Path, command: str = "") -> History:
    """Read the run of a folder, or of a run file.

    Raises:
        ResultsError: there is none, and the message names the ``command`` that makes it; or the file is no run's.
        SceneError: ``path`` is no path.
    """
    file = run_file(path)
    if not file.is_file():
        advice = f"; run: {command}" if command else ""
        raise ResultsError(f"{file.parent}: no results ({file.name} missing){advice}")
    return read(file, lambda run: _history(file, run))


def run_file(path: str | Path) -> Path:
    """The run file of a folder, or itself.

    Raises:
        ResultsError: it is one of an older version, which is not read; or the system refuses the name.
        SceneError: no path.
    """
    require(isinstance(path, str | Path), "path", path, "a path")
    path = Path(path)
    old = path if path.name == OLD else path / OLD
    new = old.with_name(FIELDS)
    try:
        if old.is_file() and not new.is_file():
            raise ResultsError(f"{old}: was written by an older version and is not read; delete it and run again")
        return new if path == old or not path.is_file() else path
    except OSError as error:
        # A name too long, or a folder that may not be looked into.
        raise ResultsError(f"{path}: cannot be read ({error.strerror})") from error


def _history(file: Path, run: Run) -> History:
    about, text, count = run.about(), run.history(), run.count
    found, times = columns(text, f"{file}: bipot/history"), run.times()
    rows = len(next(iter(found.values())))
    if rows != count - 1 or len(times) != count:
        raise ResultsError(f"{file}: bipot/history: rows = {rows}: must be {count - 1}, a row a step but step 0")
    complete, note = count > 1 and times[-1] == 1, ""
    if journal_of(file).exists():
        ended = "completed from its journal" if pages_in(file) else "not begun"
        note = f"the last write was interrupted and is {ended}: increments 1 to {rows} are whole"
    return History(file, text, found, about["parameters"], about["units"], about["scene"], complete, note)
