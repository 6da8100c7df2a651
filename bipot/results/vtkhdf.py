"""The run file ``run.vtkhdf``: an HDF5 file in VTKHDF layout, for ParaView and for resuming a march.

``/VTKHDF`` is a transient unstructured grid (version 2, VTK's type of the mesh's element). Step 0 is the start of the
march, usually the body at rest, and step k is recorded increment k. A step has points and vectors padded to three
components, nodal fields (:mod:`bipot.results.names`, :mod:`bipot.results.fields`), and cell averages weighted by volume
(symmetric tensors in VTK's order xx, yy, zz, xy, yz, xz, the hoop component as zz). All steps share the numbers of the
elements' regions, if the mesh has any, by which ParaView can colour them. ``/bipot`` holds the rest: the mesh
at rest; for each step the fields at integration points and all else that a resumed march needs; lines and poses of
tools; the text of ``history.csv``; and in ``about`` parameters, units, versions, and names of all fields.

Everything is appended with a checksum per chunk (HDF5's Fletcher filter), counted, then committed
(:mod:`bipot.hdf5.journal`): steps within the count ``NSteps`` are complete. Steps that are committed together are
written together, because each call of HDF5 has its cost.

The file ``tools.vtkhdf`` beside it has the run's tools as moving lines. It is a second file, because readers of steps
accept one grid of one kind. It contains nothing that the run's file does not: it is written when recording ends, and
again on request.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import ArrayLike

from bipot.basics.replacing import replace
from bipot.errors import ResultsError
from bipot.hdf5.growing import Growing
from bipot.hdf5.journal import Journaled
from bipot.results.description import Parameters
from bipot.results.fields import Averaging, StoredStep, cell_fields, in_space, point_fields, step_fields, together
from bipot.results.names import FIELDS, FIXED, GROUPS
from bipot.results.static import VERSIONS, Item, Line, as_bytes, store, write_cells, write_static
from bipot.system import System
from bipot.typing import Floats, Ints

POLY_LINE = 4
"""VTK's number of a line through points."""

HISTORY = "bipot/history"

GROWING = (
    "VTKHDF",
    "VTKHDF/PointData",
    "VTKHDF/CellData",
    "VTKHDF/Steps/PointDataOffsets",
    "VTKHDF/Steps/CellDataOffsets",
    "bipot",
    "bipot/steps",
)
"""Groups with datasets that grow, besides VTKHDF/Steps."""

OFFSETS = {group: FIELDS[place] for place, group in GROUPS.items()}
"""Fields by group: all of a group begin in the same row, so one dataset under all their names gives the offset."""

FIRST_ROW = "VTKHDF/Steps/PartOffsets"
"""Where the cells of a step begin, in the first row, as do fields that all steps share."""


class RunFile:
    """An open run file, to which steps are appended.

    Its datasets are created with step 0 and kept open, because looking them up costs more than writing a row.
    """

    def __init__(self, file: Journaled, out: h5py.File, system: System) -> None:
        self._file, self._system = file, system
        self._out: Item = out
        mesh = system.body.scene.mesh
        self._rows = {"Points": len(mesh.nodes), "PointData": len(mesh.nodes), "CellData": len(mesh.elements)}
        self._steps: Item = out["VTKHDF/Steps"]
        self._growing: dict[str, Growing] = {}
        self._waiting: dict[str, list[ArrayLike]] = {}
        self._made, self._text = self.count, 0
        self._averaging = Averaging.of(mesh, system.body.scene.rule)

    @staticmethod
    def create(file: Journaled, system: System, parameters: Parameters, units: Mapping[str, str]) -> RunFile:
        """A new run, without steps; ``parameters`` and ``units`` are stored as given."""
        with _closed_unless_done(h5py.File(file, "w", libver=VERSIONS)) as out:
            write_static(out, system, parameters, units)
            return RunFile(file, out, system)

    @staticmethod
    def reopen(file: Journaled, system: System) -> RunFile:
        """A run to append steps to, once it is :meth:`cut_back`."""
        with _closed_unless_done(h5py.File(file, "r+", libver=VERSIONS)) as out:
            run = RunFile(file, out, system)
            for group in (*GROWING, "VTKHDF/Steps"):
                for name, item in run._out[group].items():
                    if hasattr(item, "maxshape") and item.maxshape[0] is None:
                        run._growing[f"{group}/{name}"] = Growing(item)
            return run

    @property
    def count(self) -> int:
        """Number of complete steps, step 0 included."""
        return int(self._steps.attrs["NSteps"])

    def cut_back(self) -> bool:
        """Cut datasets that are longer than the count of steps; returns whether there were any.

        Raises:
            ResultsError: a dataset is shorter; it is named.
        """
        count, cut = self.count, False
        for name, data in self._growing.items():
            rows = count * self._rows.get(name.removeprefix("VTKHDF/").split("/")[0], 1)
            if name == HISTORY:
                rows = self._text = int(self._out[f"{HISTORY}_ends"][count - 1])
            if data.rows < rows:
                raise ResultsError(f"{self._file.path}: {name}: rows = {data.rows}: must be {rows} for {count} steps")
            if data.rows > rows:
                data.cut(rows)
                cut = True
        return cut

    def append(self, step: StoredStep, line: str) -> None:
        """Append one step and its ``line`` of the history's text, which wait for :meth:`commit`.

        Raises:
            OSError: a commit has failed.
        """
        if self._file.failed:
            raise OSError("nothing more is written after a write that failed")
        try:
            self._append(step, line)
        except BaseException:
            # The next step would follow on half of this one.
            self.end()
            raise

    def commit(self) -> None:
        """Write the waiting steps, count them and commit.

        Raises:
            OSError: it cannot be written; the file is that of the last commit, and stays so.
        """
        waiting, self._waiting = self._waiting, {}
        if not waiting:
            return
        try:
            for name, rows in waiting.items():
                self._write(name, rows[0] if len(rows) == 1 else np.concatenate(rows))
            self._steps.attrs.modify("NSteps", self._made)
            self._out.flush()
            self._file.commit()
        except BaseException:
            self.end()
            raise

    def end(self) -> None:
        """Refuse further steps, and discard the waiting ones."""
        self._file.failed = True
        self._waiting = {}

    def _append(self, step: StoredStep, line: str) -> None:
        number, system = self._made, self._system
        self._add("VTKHDF/Points", in_space(step.state.nodes))
        for name, rows in _moving(np.array([step.state.tau]), self._rows["Points"], number).items():
            self._add(f"VTKHDF/Steps/{name}", rows)
        values = together(step.state)
        averaged = point_fields(system, step, self._averaging, values)
        for group, fields in (("PointData", averaged), ("CellData", cell_fields(step, values))):
            for name, values in fields.items():
                self._add(f"VTKHDF/{group}/{name}", values)
            self._add(f"{_offsets(group)}/{next(iter(OFFSETS[group]))}", [number * self._rows[group]])
        for name, values in step_fields(step).items():
            self._add(f"bipot/steps/{name}", np.asarray(values)[None])
        text = np.asarray(as_bytes(line))
        self._text += len(text)
        self._add(HISTORY, text)
        self._add(f"{HISTORY}_ends", [self._text])
        self._made = number + 1

    def close(self) -> None:
        """Close the file as of the last commit."""
        self._growing.clear()
        self._out.close()

    def _add(self, name: str, rows: ArrayLike) -> None:
        self._waiting.setdefault(name, []).append(rows)

    def _write(self, name: str, rows: ArrayLike) -> None:
        if name in self._growing:
            self._growing[name].append(rows)
        elif self.count == 0:
            self._growing[name] = Growing.create(self._out, name, rows)
            for group, (first, *others) in OFFSETS.items():
                if name == f"{_offsets(group)}/{first}":
                    for other in others:
                        self._out[f"{_offsets(group)}/{other}"] = self._out[name]
            if name == FIRST_ROW:
                self._share(name)
        else:
            raise ResultsError(f"{self._file.path}: {name} is missing: delete the folder and run again")

    def _share(self, name: str) -> None:
        """Say that fields which all steps share begin where the dataset ``name`` says."""
        for place, group in GROUPS.items():
            for field in FIXED[place]:
                if field in self._out[f"VTKHDF/{group}"]:
                    self._out[f"{_offsets(group)}/{field}"] = self._out[name]


@contextmanager
def _closed_unless_done(out: h5py.File) -> Iterator[h5py.File]:
    """The file, closed by an error: HDF5 would write to it after its Python file is closed, and end the process."""
    try:
        yield out
    except BaseException:
        out.close()
        raise


def _offsets(group: str) -> str:
    return f"VTKHDF/Steps/{group}Offsets"


def _moving(times: Floats, points: int, first: int = 0) -> dict[str, Ints | Floats]:
    """Rows (n, ...) of ``Steps`` by name, from the ``first`` step on: one grid of so many ``points``, which move."""
    numbers, zeros = first + np.arange(len(times)), np.zeros(len(times), dtype=int)
    return {
        "Values": times,
        "NumberOfParts": zeros + 1,
        "PartOffsets": zeros,
        "PointOffsets": numbers * points,
        "CellOffsets": zeros[:, None],
        "ConnectivityIdOffsets": zeros[:, None],
    }


def write_tools(path: Path, times: Floats, steps: Sequence[Sequence[Line]]) -> None:
    """Write the lines of the tools at all pseudo-times, as a grid that moves; raises ResultsError where that fails."""
    lines = steps[0]
    lengths = [len(line.points) for line in lines]
    points = sum(lengths)
    memory = io.BytesIO()
    with h5py.File(memory, "w", libver=VERSIONS) as out:
        vtk = write_cells(out, points, np.arange(points), np.cumsum([0, *lengths]), POLY_LINE)
        store(vtk, "Points", in_space(np.concatenate([line.points for step in steps for line in step])))
        store(vtk, "CellData/tool", [line.tool for line in lines])
        for name, rows in _moving(times, points).items():
            store(vtk, f"Steps/{name}", rows)
        # Those of all steps are the first rows.
        store(vtk, "Steps/CellDataOffsets/tool", np.zeros(len(times), dtype=int))
        vtk["Steps"].attrs["NSteps"] = len(times)
    replace(path, memory.getvalue(), ResultsError)
