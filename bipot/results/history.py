"""Reading a run: its columns, parameters and states, from ``run.vtkhdf`` alone.

``history.csv`` beside it is a readable copy. The file may come from elsewhere, or still be written: it is checked
before use (:mod:`bipot.hdf5.checked`), and read again where a writer has changed it meanwhile.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bipot.control.course import Course
from bipot.errors import LARGEST_COUNT, ResultsError, require, require_count, require_number, require_type
from bipot.fem.reduction import Geometry
from bipot.hdf5.journal import journal_of, pages_in
from bipot.meshes.mesh import Mesh
from bipot.results.description import Parameters
from bipot.results.folder import RUN, TOOLS, run_file
from bipot.results.names import described
from bipot.results.snapshot import Snapshot
from bipot.results.stored import Run, RunReader, read
from bipot.results.table import columns
from bipot.state import State
from bipot.typing import Floats

T = TypeVar("T")

REDUCTION, TAU = "reduction", "tau"
"""The column by which :meth:`History.at` finds a step by default, and the name for pseudo-times."""


@dataclass(frozen=True, repr=False, eq=False)
class History:
    """A run read back: its columns as arrays (n,), its parameters and units, and its states.

    ``times`` (n + 1,) are the pseudo-times of the steps, the first where the march began. ``text`` is that of
    ``history.csv``. ``note`` says in words where a write was interrupted; empty if none was. ``regions`` are the names
    of the mesh's regions. States and fields are read from the file when used, and refused once it holds another run.
    """

    file: Path
    text: str
    columns: Mapping[str, NDArray[Any]]
    parameters: Parameters
    units: Mapping[str, str]
    scene: Mapping[str, Any]
    times: Floats
    complete: bool
    note: str = ""
    regions: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """One line, without the columns."""
        return f"History({str(self.file)!r}: {self.progress})"

    @property
    def progress(self) -> str:
        """How far the run went, in words."""
        state = "complete" if self.complete else "not complete"
        return f"{state}, {len(self)} increments to tau = {self.times[-1]:g}"

    @property
    def folder(self) -> Path:
        """The folder of the run."""
        return self.file.parent

    def __getitem__(self, name: str) -> NDArray[Any]:
        require_type(name, str, "column")
        require(name in self.columns, "column", name, f"one of {list(self.columns)}")
        return self.columns[name]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def mesh(self) -> Mesh:
        """The mesh at rest."""
        return self._reader(Run.mesh)

    @property
    def geometry(self) -> Geometry:
        """The meaning of the mesh's coordinates."""
        said = self.told("geometry", str)
        known = [geometry.value for geometry in Geometry]
        if said not in known:
            raise ResultsError(f"{self.file}: bipot/about: scene: geometry = {said!r}: must be one of {known}")
        return Geometry(said)

    @property
    def tools(self) -> list[Mapping[str, Any]]:
        """The tools in words, each with names of boundaries as its ``candidates``."""
        tools = self.told("tools", list)
        if not all(isinstance(tool, dict) and isinstance(tool.get("candidates"), list) for tool in tools):
            raise ResultsError(f"{self.file}: bipot/about: scene: tools = {tools!r}: must be tools with candidates")
        return tools

    def told(self, name: str, kind: type[T]) -> T:
        """What the :attr:`scene` tells by that ``name``; raises ResultsError unless it is of the ``kind``."""
        found = self.scene.get(name)
        if not isinstance(found, kind):
            place = f"{self.file}: bipot/about: scene: {name}"
            raise ResultsError(f"{place} = {found!r}: missing or of another type: must be a {kind.__name__}")
        return found

    @property
    def fields(self) -> Mapping[str, Mapping[str, Mapping[str, object]]]:
        """Meaning, unit and components of every field, by place and name."""
        return described(self.geometry, self.units, bool(self.regions))

    @property
    def start(self) -> Course:
        """The beginning of the march: step 0."""
        return self._step(0).course

    @property
    def end(self) -> Course:
        """The course of the march at the last recorded step, which ``march(start=...)`` continues."""
        return self._step(len(self)).course

    def at(self, value: float | None = None, by: str | None = None) -> Snapshot:
        """The recorded step nearest to a ``value`` of the column ``by``, or of the pseudo-time, "tau".

        Nothing is interpolated; of two equally near steps the earlier is taken. The default of ``by`` is the column
        "reduction" if the run has it, else "tau". Without a value it is the last step. The beginning of the march is
        a step for "tau" only.

        Raises:
            SceneError: an unknown column, one that does not increase throughout, a value that is no number or outside
                of what is recorded; the message says the range.
        """
        require_type(by, str, "by", optional=True)
        if value is None and by is None:
            return self._step(len(self))
        by = by if by is not None else REDUCTION if REDUCTION in self.columns else TAU
        columns = [TAU, *self.columns]
        require(by in columns, "by", by, f"one of {columns}")
        known = self.times if by == TAU else self[by]
        increasing = known.dtype.kind in "fiu" and len(known) > 0 and bool((np.diff(known) > 0).all())
        require(increasing, "by", by, f"{TAU}, or a column of numbers that increase throughout")
        if value is None:
            return self._step(len(self))
        require_number(value, by)
        least, most = known[0].item(), known[-1].item()
        require(least <= value <= most, by, value, f"in [{in_digits(least)}, {in_digits(most)}], what is recorded")
        return self._step(int(np.argmin(np.abs(known - value))) + (by != TAU))

    def snapshot(self, row: int = -1) -> Snapshot:
        """The step after the increment of ``row`` (negative: from the end).

        Raises:
            SceneError: a row that is no whole number, or none of the run's.
        """
        require_count(row, "row", -LARGEST_COUNT)
        count = len(self)
        require(-count <= row < count, "row", row, f"in [{-count}, {count}), an accepted increment")
        return self._step(1 + row % count)

    def state(self, row: int = -1) -> State:
        """The state after the increment of ``row``."""
        return self.snapshot(row).state

    def course(self, row: int = -1) -> Course:
        """The course of the march after the increment of ``row``."""
        return self.snapshot(row).course

    def nodal(self, name: str, row: int = -1) -> NDArray[Any]:
        """Nodal field ``name`` after the increment of ``row``, as :meth:`Snapshot.nodal`."""
        return self.snapshot(row).nodal(name)

    def cell(self, name: str, row: int = -1) -> NDArray[Any]:
        """Field ``name`` of the elements after the increment of ``row``, as :meth:`Snapshot.cell`."""
        return self.snapshot(row).cell(name)

    def points(self, name: str, row: int = -1) -> Any:
        """Field ``name`` of the integration points after the increment of ``row``, as :meth:`Snapshot.points`."""
        return self.snapshot(row).points(name)

    def frame(self) -> Any:
        """The columns as a pandas frame, one row per increment.

        Raises:
            ResultsError: pandas is not installed.
        """
        if find_spec("pandas") is None:
            raise ResultsError("frame() needs pandas: pip install bipot[frames]")
        import pandas

        return pandas.DataFrame(dict(self.columns))

    def write_tools(self) -> Path | None:
        """Write ``tools.vtkhdf`` beside the run's file: its path, None where there are no tools.

        Beside a file of another name, ``copy.vtkhdf``, it is ``copy_tools.vtkhdf``.

        Recording does this at its end; call it where recording was killed, or is still running.
        """
        from bipot.results.vtkhdf import write_tools

        steps = self._reader(lambda run: run.tools(0, len(self.times)))
        if not steps[0]:
            return None
        path = self.folder / TOOLS if self.file.name == RUN else self.file.with_name(f"{self.file.stem}_{TOOLS}")
        write_tools(path, self.times, steps)
        return path

    def _step(self, step: int) -> Snapshot:
        return Snapshot(self._reader, self.geometry, step, float(self.times[step]))

    @property
    def _reader(self) -> RunReader:
        return RunReader(self.file, self.text)


def in_digits(number: float) -> str:
    """A number in six digits if these give it exactly, else in all."""
    short = f"{number:g}"
    return short if float(short) == number else repr(number)


def open(path: str | Path, command: str = "") -> History:
    """Read the run of a folder, or of a run file.

    Raises:
        ResultsError: there is none (the message names the ``command`` that makes it), or the file is no run.
    """
    file = run_file(path)
    if not file.is_file():
        advice = f"; run: {command}" if command else ""
        raise ResultsError(f"{file.parent}: no results ({file.name} missing){advice}")
    return read(file, lambda run: _history(file, run))


def _history(file: Path, run: Run) -> History:
    about, text, count = run.about(), run.history(), run.count
    found, times = columns(text, f"{file}: bipot/history"), run.times()
    rows = len(next(iter(found.values())))
    if rows != count - 1 or len(times) != count:
        raise ResultsError(f"{file}: bipot/history: rows = {rows}: must be {count - 1}, a row a step but step 0")
    complete, note = count > 1 and float(times[-1]) == 1, ""
    if journal_of(file).exists():
        ended = "completed from its journal" if pages_in(file) else "not begun"
        note = f"the last write was interrupted and is {ended}: the run's {rows} increments are whole"
    said = about["parameters"], about["units"], about["scene"]
    return History(file, text, found, *said, times, complete, note, tuple(about["regions"]))
