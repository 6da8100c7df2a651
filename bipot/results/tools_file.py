"""The file ``tools.vtkhdf`` beside a run's: its tools as lines that move, for ParaView and other readers of VTK.

It is a second file, because readers of steps accept one grid of one kind. It contains nothing that the run's file does
not: it is written when recording ends, and again on request.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bipot.basics.replacing import replace
from bipot.errors import ResultsError
from bipot.results.fields import in_space
from bipot.results.static import VERSIONS, Line, store, write_cells
from bipot.typing import Floats

POLY_LINE = 4
"""VTK's number of a line through points."""


def write_tools(path: Path, times: Floats, steps: Sequence[Sequence[Line]]) -> None:
    """Write the lines of the tools at all pseudo-times; raises ResultsError where that fails."""
    replace(path, _content(times, steps), ResultsError)


def _content(times: Floats, steps: Sequence[Sequence[Line]]) -> memoryview:
    """The file's bytes: an unstructured grid whose points move from step to step."""
    # h5py takes long to import, and only files need it.
    import h5py

    lines, count = steps[0], len(times)
    lengths = [len(line.points) for line in lines]
    points, rows = sum(lengths), np.arange(count)
    memory = io.BytesIO()
    with h5py.File(memory, "w", libver=VERSIONS) as out:
        vtk = write_cells(out, points, np.arange(points), np.cumsum([0, *lengths]), POLY_LINE)
        store(vtk, "Points", in_space(np.concatenate([line.points for step in steps for line in step])))
        store(vtk, "CellData/tool", [line.tool for line in lines])
        store(vtk, "Steps/Values", times)
        store(vtk, "Steps/NumberOfParts", np.ones(count, dtype=int))
        store(vtk, "Steps/PartOffsets", 0 * rows)
        store(vtk, "Steps/PointOffsets", points * rows)
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            store(vtk, f"Steps/{name}", np.zeros((count, 1), dtype=int))
        store(vtk, "Steps/CellDataOffsets/tool", 0 * rows)
        vtk["Steps"].attrs["NSteps"] = count
    return memory.getbuffer()
