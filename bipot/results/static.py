"""What no step of a run file changes: the grid's cells, the mesh at rest, candidates, tools' lines and descriptions."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bipot.laws.coulomb import CARRIES, Status
from bipot.meshes.mesh import Mesh
from bipot.results.description import Parameters, describe, versions
from bipot.results.drawn import Lines
from bipot.results.fields import NO_CANDIDATE
from bipot.results.names import described
from bipot.system import System
from bipot.traction import SLIP_TOLERANCE
from bipot.typing import Ints

# h5py types every item as group, dataset or datatype alike.
Item = Any

VERSIONS = ("earliest", "v110")
"""Versions of HDF5's layout: the newest that VTK's readers know, without the marks that a killed writer leaves."""

FORMAT = 2
"""Version of the layout, raised where an older reader would misread it. Format 1 had no averages at nodes and no
tools."""


def write_static(out: Item, system: System, parameters: Parameters, units: Mapping[str, str]) -> None:
    """Write the data that no step changes."""
    scene = system.body.scene
    _write_grid(out, scene.mesh)
    own = out.create_group("bipot")
    own.attrs["format"] = FORMAT
    about = {
        "parameters": dict(parameters),
        "units": dict(units),
        "fields": described(scene.geometry, units),
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
    lines = Lines.of(scene)
    for name in ("points", "starts", "tool", "centres"):
        store(own, f"tools/{name}", getattr(lines, name))


def store(group: Item, name: str, values: ArrayLike) -> None:
    """A dataset that does not grow, with a checksum."""
    array = np.asarray(values)
    # What is empty has no chunk to check.
    group.create_dataset(name, data=array, fletcher32=True if array.size else None)


def as_bytes(text: str) -> ArrayLike:
    """A text as numbers, which HDF5 stores without a heap."""
    return np.frombuffer(text.encode(), dtype=np.uint8)


def write_cells(file: Item, points: int, connectivity: Ints, ends: Ints, kind: int) -> Item:
    """The group of a grid of so many points: one partition whose cells of one ``kind`` of VTK's every step shares.

    Their numbers of points stand in the ``connectivity``, those of each between two of the ``ends`` (n + 1,).
    """
    vtk = file.create_group("VTKHDF")
    vtk.attrs["Version"] = np.array([2, 2])
    vtk.attrs.create("Type", b"UnstructuredGrid", dtype="S16")
    count = len(ends) - 1
    sizes = {"NumberOfPoints": points, "NumberOfCells": count, "NumberOfConnectivityIds": len(connectivity)}
    for name, size in sizes.items():
        store(vtk, name, [size])
    store(vtk, "Connectivity", connectivity)
    store(vtk, "Offsets", ends)
    store(vtk, "Types", np.full(count, kind, dtype=np.uint8))
    return vtk


def _write_grid(file: Item, mesh: Mesh) -> None:
    """The static part of the body's grid."""
    ends = np.arange(len(mesh.elements) + 1) * mesh.elements.shape[1]
    vtk = write_cells(file, len(mesh.nodes), mesh.elements.ravel(), ends, mesh.element.vtk)
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
