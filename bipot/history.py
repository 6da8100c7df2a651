"""What a run leaves behind: ``history.csv``, one row an accepted increment, and ``run.h5``, its fields.

Both are flushed row by row, so an interrupted or failed run leaves them readable. A folder holds one run:
results of the same parameters are overwritten, those of others refused.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TextIO

import numpy as np
from numpy.typing import NDArray

from bipot.accepted import Accepted
from bipot.columns import ENERGY_ERROR, Column, Value
from bipot.errors import BipotError, IncrementFailed, ResultsError, require
from bipot.export import Item, Parameters, create, finish, record
from bipot.laws.flow import Flow
from bipot.mesh import Mesh
from bipot.response import State
from bipot.scene import Scene
from bipot.system import system_of

CURVES = "history.csv"
FIELDS = "run.h5"
CHOICE = "delete it or choose another folder"


class Recorder:
    """Writes every accepted increment of one run into ``folder``, as a context manager.

    Leaving it normally at the end of the path marks the run complete; an :class:`IncrementFailed` on its way
    out gets the :class:`History` so far attached. ``parameters`` (JSON values) identify the run; ``units`` are
    stored as given. Every history has the column ``energy_error``: where ``columns`` lacks it, it comes last.

    Raises:
        ResultsError: the folder cannot be written, or holds a run of other parameters (names the field).
        SceneError: two columns of one name.
    """

    def __init__(
        self,
        folder: str | Path,
        scene: Scene,
        columns: Sequence[Column],
        parameters: Parameters,
        units: Mapping[str, str],
    ) -> None:
        names = [column.name for column in columns]
        require(len(set(names)) == len(names), "columns", names, "of different names")
        folder = _path(folder)
        _refuse_other(folder, parameters)
        missing = () if ENERGY_ERROR.name in names else (ENERGY_ERROR,)
        self.folder, self.columns, self.parameters, self.units = folder, (*columns, *missing), parameters, units
        self.system = system_of(scene)
        self._fields: Item
        self._curves: TextIO
        self._opened: ExitStack

    def __enter__(self) -> Self:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with ExitStack() as opened:
                curves = (self.folder / CURVES).open("w", newline="", encoding="utf-8")
                self._curves = opened.enter_context(curves)
                file = create(self.folder / FIELDS, self.system, self.parameters, self.units)
                self._fields = opened.enter_context(file)
                self._write([column.name for column in self.columns])
                self._opened = opened.pop_all()
        except OSError as error:
            raise ResultsError(f"{self.folder}: cannot be written ({error})") from error
        return self

    def record(self, accepted: Accepted) -> None:
        """Append one accepted increment to both files and flush them."""
        record(self._fields, self.system, accepted)
        self._write([column.value(self.system, accepted) for column in self.columns])

    def _write(self, row: Sequence[Value]) -> None:
        # float() first, because NumPy's scalars print their type.
        csv.writer(self._curves).writerow([float(v) if isinstance(v, np.floating) else v for v in row])
        self._curves.flush()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            finish(self._fields)
        self._opened.close()
        if isinstance(error, IncrementFailed):
            error.history = load(self.folder)


@dataclass(frozen=True)
class History:
    """A run read back: its columns as arrays (n,), what was asked, and its states in ``run.h5``."""

    folder: Path
    columns: Mapping[str, NDArray[Any]]
    parameters: Parameters
    scene: Mapping[str, Any]
    complete: bool

    def __getitem__(self, name: str) -> NDArray[Any]:
        require(name in self.columns, "column", name, f"one of {list(self.columns)}")
        return self.columns[name]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def mesh(self) -> Mesh:
        """The mesh at rest."""
        with _open(self.folder) as file:
            group = file["bipot/mesh"]
            edges = {name: _array(group["boundaries"], name) for name in group["boundaries"]}
            return Mesh(_array(group, "nodes"), _array(group, "elements"), edges)

    def state(self, row: int = -1) -> State:
        """The state after the increment of ``row`` (negative: from the end), as a march resumes from it."""
        with _open(self.folder) as file:
            vtk, steps = file["VTKHDF"], file["bipot/steps"]
            step = _step(vtk, row)
            return State(
                tau=float(vtk["Steps/Values"][step]),
                nodes=_nodal(vtk, "Points", step)[:, :2],
                stress=steps["stress"][step],
                plastic_strain=steps["plastic_strain"][step],
                peeq=steps["peeq"][step],
                forces=steps["contact_force"][step],
                gap=steps["gap"][step],
                du=steps["du"][step],
                translation=steps["translation"][step],
                translated=steps["translated"][step],
                length=float(steps["length"][step]),
                flow=_flow(steps, step),
            )

    def nodal(self, name: str, row: int = -1) -> NDArray[Any]:
        """Nodal field ``name`` of ``run.h5`` after the increment of ``row``: (a,) or (a, 3)."""
        with _open(self.folder) as file:
            vtk = file["VTKHDF"]
            require(name in vtk["PointData"], "nodal field", name, f"one of {list(vtk['PointData'])}")
            return _nodal(vtk, f"PointData/{name}", _step(vtk, row))


def load(folder: str | Path, command: str = "") -> History:
    """Read the run in ``folder``.

    Raises:
        ResultsError: there is none, and the message names the ``command`` that makes it; or its files are no run's.
        SceneError: ``folder`` is no path.
    """
    folder = _path(folder)
    missing = [name for name in (CURVES, FIELDS) if not (folder / name).is_file()]
    if missing:
        advice = f"; run: {command}" if command else ""
        raise ResultsError(f"{folder}: no results ({', '.join(missing)} missing){advice}")
    header, rows = _table(folder / CURVES)
    with _open(folder) as file:
        own = file["bipot"].attrs
        parameters, scene = json.loads(own["parameters"]), json.loads(own["scene"])
        complete = bool(own["complete"])
    columns = {name: _typed([row[k] for row in rows]) for k, name in enumerate(header)}
    return History(folder, columns, parameters, scene, complete)


def resume(folder: str | Path, command: str = "") -> State:
    """The last state in ``folder``, for ``march(start=...)``.

    Raises:
        ResultsError: there is no run, or it has no accepted increment.
    """
    history = load(folder, command)
    if not len(history):
        raise ResultsError(f"{folder}: the run has no accepted increment to resume from")
    return history.state()


def _refuse_other(folder: Path, parameters: Parameters) -> None:
    """Refuse a folder with a run of other parameters, or with curves whose parameters are unknown."""
    if not (folder / FIELDS).exists():
        if (folder / CURVES).exists():
            raise ResultsError(f"{folder}: holds {CURVES} without {FIELDS}; delete it or choose another folder")
        return
    with _open(folder) as file:
        stored = json.loads(file["bipot"].attrs["parameters"])
    asked = json.loads(json.dumps(dict(parameters)))
    for name in sorted(stored.keys() | asked.keys()):
        held, new = (given.get(name, "absent") for given in (stored, asked))
        if held != new:
            raise ResultsError(f"{folder}: holds a run with {name} = {held}, not {new}; {CHOICE}")


def _path(folder: str | Path) -> Path:
    require(isinstance(folder, str | Path), "folder", folder, "a path")
    return Path(folder)


def _table(path: Path) -> tuple[list[str], list[list[str]]]:
    """Names and rows of a CSV file."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            header, *rows = csv.reader(file)
    except (OSError, ValueError, csv.Error) as error:
        raise _unreadable(path, error) from error
    if any(len(row) != len(header) for row in rows):
        raise _unreadable(path, "rows of different lengths")
    return header, rows


@contextmanager
def _open(folder: Path) -> Iterator[Item]:
    """The file of fields; what it lacks is said as a :class:`ResultsError`."""
    # h5py takes long to import, and only files need it.
    import h5py

    path = folder / FIELDS
    try:
        with h5py.File(path, "r", locking=False) as file:
            yield file
    except BipotError:
        raise
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, why: object) -> ResultsError:
    return ResultsError(f"{path}: cannot be read ({why}); delete the folder and run again")


def _step(vtk: Item, row: int) -> int:
    """The number from 0 of the increment of ``row``."""
    count = int(vtk["Steps"].attrs["NSteps"])
    require(-count <= row < count, "row", row, f"in [{-count}, {count}), an accepted increment")
    return row % count


def _array(group: Item, name: str) -> NDArray[Any]:
    return group[name][...]


def _nodal(vtk: Item, name: str, step: int) -> NDArray[Any]:
    points = int(vtk["NumberOfPoints"][0])
    return vtk[name][step * points : (step + 1) * points]


def _flow(steps: Item, step: int) -> Flow | None:
    """The flow of the increment, None in a file that does not hold it: the next increment then starts without."""
    names = [f"flow_{field.name}" for field in fields(Flow)]
    return Flow(*(steps[name][step] for name in names)) if all(name in steps for name in names) else None


def _typed(texts: list[str]) -> NDArray[Any]:
    """Integers if all are, else floats if all are, else strings."""
    for kind in (int, float):
        try:
            return np.array([kind(text) for text in texts], dtype=kind)
        except ValueError:
            continue
    return np.array(texts, dtype=str)
