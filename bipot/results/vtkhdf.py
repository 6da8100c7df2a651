"""The run file ``run.vtkhdf``: an HDF5 file in VTKHDF layout, so that ParaView opens it and a march goes on from it.

``/VTKHDF`` is a transient unstructured grid (version 2, VTK's type of the mesh's element). Step 0 is where the march
starts, the body at rest as a rule, step k = accepted increment k: points and vectors padded to three components, nodal
fields, and cell averages weighted by volume (symmetric tensors in VTK's order xx, yy, zz, xy, yz, xz, the hoop
component as zz). ``/bipot`` holds the rest: the mesh at rest, full integration-point arrays and what else a march goes
on from step by step, the text of ``history.csv``, and in ``about`` what was asked, in which units, by which versions.

Everything is appended with a checksum a chunk (HDF5's Fletcher filter), counted, then committed
(:mod:`bipot.hdf5.journal`): what the count ``NSteps`` covers is complete.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from bipot.contact import CARRIES
from bipot.errors import ResultsError
from bipot.hdf5.journal import Journaled
from bipot.laws.coulomb import Status
from bipot.mesh import Mesh
from bipot.results.description import Parameters, describe, versions
from bipot.results.fields import NO_CANDIDATE, Step, cell_fields, padded, point_fields, step_fields
from bipot.system import System
from bipot.traction import SLIP_TOLERANCE

if TYPE_CHECKING:
    import h5py

# h5py types every item as group, dataset or datatype alike.
Item = Any

FORMAT = 1
"""Of the layout below ``/bipot``: raised where an older reader would misread it."""

CHUNK = 4096
"""Most bytes of a chunk of small rows."""


def create(file: Journaled, system: System, parameters: Parameters, units: Mapping[str, str]) -> h5py.File:
    """A new run in ``file``, open and without steps; ``parameters`` and ``units`` are stored as given."""
    # h5py takes long to import, and only files need it.
    import h5py

    out = h5py.File(file, "w", libver=("earliest", "v110"))
    scene = system.body.scene
    _write_grid(out, scene.mesh)
    own = out.create_group("bipot")
    own.attrs["format"], own.attrs["complete"] = FORMAT, 0
    about = {
        "parameters": dict(parameters),
        "units": dict(units),
        "scene": describe(scene),
        "boundaries": list(scene.mesh.boundaries),
        "versions": versions(),
        "status": {**{s.name.lower(): int(s) for s in Status}, "no_candidate": NO_CANDIDATE},
        "status_thresholds": (
            f"steps/force_tol = {CARRIES:g} x largest contact force, "
            f"steps/slip_tol = {SLIP_TOLERANCE:g} x motion of the tools in the increment, of the body where they rest"
        ),
    }
    store(own, "about", as_bytes(json.dumps(about)))
    own.create_group("steps")
    _write_mesh(own.create_group("mesh"), scene.mesh)
    store(own, "candidates/node", system.candidates.node)
    store(own, "candidates/tool", system.candidates.tool)
    return out


def reopen(file: Journaled) -> h5py.File:
    """A run to append steps to."""
    import h5py

    return h5py.File(file, "r+", libver=("earliest", "v110"))


def cut_back(file: Item, system: System) -> bool:
    """Cut whatever is longer than the count of steps covers; whether there was any.

    Raises:
        ResultsError: what is shorter, naming it.
    """
    vtk, own, mesh = file["VTKHDF"], file["bipot"], system.body.scene.mesh
    count, points, cells = int(vtk["Steps"].attrs["NSteps"]), len(mesh.nodes), len(mesh.elements)
    groups = ((vtk["PointData"], points), (vtk["CellData"], cells), (own["steps"], 1), (vtk["Steps"], 1))
    groups += tuple((vtk["Steps"][f"{name}Offsets"], 1) for name in ("PointData", "CellData"))
    lengths = [(vtk["Points"], count * points), (own["history_ends"], count)]
    lengths += [(data, count * rows) for group, rows in groups for data in group.values() if hasattr(data, "shape")]
    lengths.append((own["history"], int(own["history_ends"][count - 1])))
    for data, length in lengths:
        if len(data) < length:
            raise ResultsError(f"{file.filename}: {data.name}: rows = {len(data)}: must be {length} for {count} steps")
    longer = [(data, length) for data, length in lengths if len(data) > length]
    for data, length in longer:
        data.resize(length, axis=0)
    return bool(longer)


def append_step(file: Item, system: System, step: Step, line: str) -> None:
    """Append one step and its ``line`` of the history's text, and count it."""
    vtk, own = file["VTKHDF"], file["bipot"]
    steps, mesh = vtk["Steps"], system.body.scene.mesh
    number, points = int(steps.attrs["NSteps"]), len(mesh.nodes)
    append(vtk, "Points", padded(step.state.nodes))
    append(steps, "Values", [step.state.tau])
    append(steps, "PartOffsets", [0])
    append(steps, "NumberOfParts", [1])
    append(steps, "PointOffsets", [number * points])
    append(steps, "CellOffsets", [[0]])
    append(steps, "ConnectivityIdOffsets", [[0]])
    for group, fields, rows in (
        ("PointData", point_fields(system, step), points),
        ("CellData", cell_fields(step), len(mesh.elements)),
    ):
        for name, values in fields.items():
            append(vtk[group], name, values)
            append(steps[f"{group}Offsets"], name, [number * rows])
    for name, values in step_fields(step).items():
        append(own["steps"], name, np.asarray(values)[None])
    append(own, "history", as_bytes(line))
    append(own, "history_ends", [len(own["history"])])
    steps.attrs.modify("NSteps", number + 1)
    finished = step.state.tau == 1.0 and number > 0
    own.attrs.modify("complete", int(finished))


def append(group: Item, name: str, values: ArrayLike) -> None:
    """Append rows to an extensible dataset, made on first use: one append a chunk, or many where they are small."""
    rows = np.asarray(values)
    if name not in group:
        # Of a scene without tools some have no columns, which no chunk may lack.
        sizes = (None, *(size or None for size in rows.shape[1:]))
        many = max(len(rows), CHUNK // max(rows[0].nbytes, 1), 1)
        chunks = (many, *(max(size, 1) for size in rows.shape[1:]))
        group.create_dataset(name, data=rows, maxshape=sizes, chunks=chunks, fletcher32=True)
        return
    data = group[name]
    start = data.shape[0]
    data.resize(start + len(rows), axis=0)
    data[start:] = rows


def store(group: Item, name: str, values: ArrayLike) -> None:
    """A dataset that does not grow, with a checksum."""
    array = np.asarray(values)
    # What is empty has no chunk to check.
    group.create_dataset(name, data=array, fletcher32=True if array.size else None)


def as_bytes(text: str) -> ArrayLike:
    """A text as numbers, which HDF5 keeps without a heap."""
    return np.frombuffer(text.encode(), dtype=np.uint8)


def _write_grid(file: Item, mesh: Mesh) -> None:
    """The static part of the grid: one partition whose cells every step shares."""
    vtk = file.create_group("VTKHDF")
    vtk.attrs["Version"] = np.array([2, 2])
    vtk.attrs.create("Type", b"UnstructuredGrid", dtype="S16")
    store(vtk, "NumberOfPoints", [len(mesh.nodes)])
    store(vtk, "NumberOfCells", [len(mesh.elements)])
    store(vtk, "NumberOfConnectivityIds", [mesh.elements.size])
    store(vtk, "Connectivity", mesh.elements.ravel())
    store(vtk, "Offsets", np.arange(len(mesh.elements) + 1) * mesh.elements.shape[1])
    store(vtk, "Types", np.full(len(mesh.elements), mesh.element.vtk, dtype=np.uint8))
    steps = vtk.create_group("Steps")
    steps.attrs["NSteps"] = 0
    for name in ("PointData", "CellData"):
        vtk.create_group(name)
        steps.create_group(f"{name}Offsets")


def _write_mesh(group: Item, mesh: Mesh) -> None:
    store(group, "nodes", mesh.nodes)
    store(group, "elements", mesh.elements)
    # By number, for a name may be one that HDF5 takes for a path; ``about`` has the names.
    for number, edges in enumerate(mesh.boundaries.values()):
        store(group, f"boundaries/{number}", edges)
