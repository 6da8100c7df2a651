"""One HDF5 file a run, in VTKHDF layout, so that ParaView opens it and a run resumes from it.

``/VTKHDF`` is a transient unstructured grid (version 2, VTK's type of the mesh's element), step k = accepted
increment k + 1: points and vectors padded to three components, nodal fields, and cell averages weighted by
volume (symmetric tensors in VTK's order xx, yy, zz, xy, yz, xz, the hoop component as zz). ``/bipot`` holds
the rest: mesh at rest, full integration-point arrays step by step, what was asked, in which units, by which
versions.

Every step is appended, then counted, then flushed: what the count covers is complete. The file is not locked,
so it can be read while the run goes on.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bipot.accepted import Accepted
from bipot.contact import CARRIES
from bipot.laws.coulomb import Status
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import VonMises
from bipot.mesh import Mesh
from bipot.scene import Scene
from bipot.supports import Prescribed, Support, Symmetry
from bipot.system import System
from bipot.traction import SLIP_TOLERANCE, Traction, traction
from bipot.typing import Floats

if TYPE_CHECKING:
    import h5py

Parameters = Mapping[str, Any]
# h5py types every item as group, dataset or datatype alike.
Item = Any

NO_CANDIDATE = -1
PACKAGES = ("bipot", "numpy", "scipy", "cvxpy", "clarabel")


def create(path: Path, system: System, parameters: Parameters, units: Mapping[str, str]) -> h5py.File:
    """A new open file without steps; ``parameters`` and ``units`` are stored as given."""
    # h5py takes long to import, and only files need it.
    import h5py

    file = h5py.File(path, "w", libver=("earliest", "v110"), locking=False)
    scene = system.body.scene
    _write_grid(file, scene.mesh)
    own = file.create_group("bipot")
    own.attrs["complete"] = False
    own.attrs["parameters"] = json.dumps(dict(parameters))
    own.attrs["units"] = json.dumps(dict(units))
    own.attrs["scene"] = json.dumps(describe(scene))
    own.attrs["versions"] = json.dumps(versions())
    own.attrs["status"] = json.dumps({**{s.name.lower(): int(s) for s in Status}, "no_candidate": NO_CANDIDATE})
    own.attrs["status_thresholds"] = (
        f"steps/force_tol = {CARRIES:g} x largest contact force, "
        f"steps/slip_tol = {SLIP_TOLERANCE:g} x motion of the tools in the increment, of the body where they rest"
    )
    own.create_group("steps")
    _write_mesh(own.create_group("mesh"), scene.mesh)
    own["candidates/node"] = system.candidates.node
    own["candidates/tool"] = system.candidates.tool
    file.flush()
    return file


def record(file: Item, system: System, accepted: Accepted) -> None:
    """Write one accepted increment to a file of :func:`create` and flush."""
    tractions = increment_traction(accepted)
    vtk, own = file["VTKHDF"], file["bipot/steps"]
    steps, mesh = vtk["Steps"], system.body.scene.mesh
    number, points = int(steps.attrs["NSteps"]), len(mesh.nodes)
    append(vtk, "Points", padded(accepted.state.nodes))
    append(steps, "Values", [accepted.state.tau])
    append(steps, "PartOffsets", [0])
    append(steps, "NumberOfParts", [1])
    append(steps, "PointOffsets", [number * points])
    append(steps, "CellOffsets", [[0]])
    append(steps, "ConnectivityIdOffsets", [[0]])
    for group, fields, rows in (
        ("PointData", point_fields(system, accepted, tractions), points),
        ("CellData", cell_fields(accepted), len(mesh.elements)),
    ):
        for name, values in fields.items():
            append(vtk[group], name, values)
            append(steps[f"{group}Offsets"], name, [number * rows])
    for name, values in step_fields(accepted, tractions).items():
        append(own, name, np.asarray(values)[None])
    steps.attrs["NSteps"] = number + 1
    file.flush()


def finish(file: Item) -> None:
    """Mark the run complete if its last increment landed on the end of the path, tau = 1."""
    steps = file["VTKHDF/Steps"]
    file["bipot"].attrs["complete"] = bool(steps.attrs["NSteps"] and steps["Values"][-1] == 1.0)


def increment_traction(accepted: Accepted) -> Traction:
    """Recovered traction and status at the end of an accepted increment, on its configuration of equilibrium."""
    return traction(accepted.solved.iterate, accepted.solved.r)


def point_fields(system: System, accepted: Accepted, tractions: Traction) -> dict[str, NDArray[Any]]:
    """Nodal fields: vectors (a, 3), scalars (a,); NaN (status: -1) where a node is no candidate.

    Where two tools share a node, the one that pushes harder speaks, except for the force, which is the sum.
    """
    scene, candidates, r = system.body.scene, system.candidates, accepted.solved.r
    order = np.argsort(r[:, 0], kind="stable")
    node, count = candidates.node[order], len(scene.mesh.nodes)

    def scatter(values: NDArray[Any], empty: float) -> NDArray[Any]:
        out = np.full(count, empty, dtype=values.dtype)
        out[node] = values[order]
        return out

    force = np.zeros(scene.mesh.nodes.shape)
    increment = accepted.solved.iterate.increment
    np.add.at(force, candidates.node, candidates.vectors(increment.rubbed(r)))
    gap = accepted.solved.rows.motion(accepted.solved.response.x)[:, 0]
    return {
        "displacement": padded(accepted.displacement),
        "velocity": padded(accepted.state.velocity),
        "contact_force": padded(force),
        "recovered_pressure": scatter(tractions.recovered_pressure, np.nan),
        "recovered_shear": scatter(tractions.recovered_shear, np.nan),
        "gap": scatter(gap, np.nan),
        "status": scatter(tractions.status, NO_CANDIDATE),
    }


def cell_fields(accepted: Accepted) -> dict[str, Floats]:
    """Volume averages: stress and plastic strain (e, 6) in VTK's order, von Mises stress and peeq (e,)."""
    state, volume = accepted.state, accepted.solved.response.kinematics.volume
    weight = volume / volume.sum(axis=1, keepdims=True)
    return {
        "stress": symmetric(np.einsum("eq,eqs->es", weight, state.stress)),
        "plastic_strain": symmetric(np.einsum("eq,eqs->es", weight, state.plastic_strain)),
        "mises": np.einsum("eq,eq->e", weight, state.mises),
        "peeq": np.einsum("eq,eq->e", weight, state.peeq),
    }


def step_fields(accepted: Accepted, tractions: Traction) -> dict[str, ArrayLike]:
    """What ``/bipot/steps`` holds of one increment: everything a state needs beside nodes."""
    state = accepted.state
    assert state.flow is not None, "only the state at rest has no flow"
    flow: dict[str, ArrayLike] = {f"flow_{name}": value for name, value in vars(state.flow).items()}
    return {
        **flow,
        "stress": state.stress,
        "plastic_strain": state.plastic_strain,
        "peeq": state.peeq,
        "volume": accepted.solved.response.kinematics.volume,
        "contact_force": state.forces,
        "gap": state.gap,
        "du": state.du,
        "translation": state.translation,
        "translated": state.translated,
        "length": state.length,
        "force_tol": tractions.force_tol,
        "slip_tol": tractions.slip_tol,
    }


def padded(vectors: Floats) -> Floats:
    """Vectors (a, d) with zeros up to three components."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def symmetric(mandel: Floats) -> Floats:
    """VTK's symmetric tensor (e, 6), xx yy zz xy yz xz, from Mandel vectors (e, 4) in the plane.

    >>> symmetric(np.array([[1.0, 2.0, 3.0, np.sqrt(2.0)]])).round(12)
    array([[1., 2., 3., 1., 0., 0.]])
    """
    return np.pad(mandel / np.array([1, 1, 1, np.sqrt(2.0)]), ((0, 0), (0, 2)))


def append(group: Item, name: str, values: ArrayLike) -> None:
    """Append rows to an extensible dataset, made on first use with one append a chunk."""
    rows = np.asarray(values)
    if name not in group:
        # Of a scene without tools some have no columns, which no chunk may lack.
        sizes = (None, *(size or None for size in rows.shape[1:]))
        group.create_dataset(name, data=rows, maxshape=sizes, chunks=tuple(max(size, 1) for size in rows.shape))
        return
    data = group[name]
    start = data.shape[0]
    data.resize(start + len(rows), axis=0)
    data[start:] = rows


def versions() -> dict[str, str]:
    """Versions of this package, of what it computes with, and of Python."""
    return {**{name: version(name) for name in PACKAGES}, "python": platform.python_version()}


def describe(scene: Scene) -> dict[str, Any]:
    """The scene in plain numbers and words, for readers of the file."""
    material = scene.material
    return {
        "geometry": scene.geometry.value,
        "element": scene.mesh.element.value,
        "quadrature": scene.rule.value,
        "configuration": scene.configuration.value,
        "young": material.elasticity.young,
        "poisson": material.elasticity.poisson,
        "yield_stress": float(material.yield_stress(0.0)),
        "material": repr(material),
        "perfectly_plastic": isinstance(material, VonMises) and isinstance(material.hardening, Perfect),
        "supports": [_support(s) for s in scene.supports],
        "loads": [repr(load) for load in scene.loads],
        "tools": [
            {
                **{name: getattr(t, name) for name in ("point", "normal", "travel", "path", "candidates", "mu")},
                "mu_at": {str(node): mu for node, mu in t.mu_at.items()},
                "driven_by": t.driven_by and {"vector": t.driven_by.vector, "amplitude": t.driven_by.amplitude.points},
            }
            for t in scene.tools
        ],
    }


def _support(support: Support) -> dict[str, Any]:
    """Where a support is, whether it is a plane of symmetry, and how it moves if it does."""
    said = {"boundary": support.boundary, "direction": support.direction, "symmetry": isinstance(support, Symmetry)}
    if not isinstance(support, Prescribed):
        return said
    return {**said, "displacement": support.displacement, "amplitude": support.amplitude.points}


def _write_grid(file: h5py.File, mesh: Mesh) -> None:
    """The static part of the grid: one partition whose cells every step shares."""
    vtk = file.create_group("VTKHDF")
    vtk.attrs["Version"] = np.array([2, 2])
    vtk.attrs.create("Type", b"UnstructuredGrid", dtype="S16")
    vtk["NumberOfPoints"] = [len(mesh.nodes)]
    vtk["NumberOfCells"] = [len(mesh.elements)]
    vtk["NumberOfConnectivityIds"] = [mesh.elements.size]
    vtk["Connectivity"] = mesh.elements.ravel()
    vtk["Offsets"] = np.arange(len(mesh.elements) + 1) * mesh.elements.shape[1]
    vtk["Types"] = np.full(len(mesh.elements), mesh.element.vtk, dtype=np.uint8)
    steps = vtk.create_group("Steps")
    steps.attrs["NSteps"] = 0
    for name in ("PointData", "CellData"):
        vtk.create_group(name)
        steps.create_group(f"{name}Offsets")


def _write_mesh(group: h5py.Group, mesh: Mesh) -> None:
    group["nodes"] = mesh.nodes
    group["elements"] = mesh.elements
    for name, edges in mesh.boundaries.items():
        group[f"boundaries/{name}"] = edges
