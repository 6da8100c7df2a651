"""The parts of a run file that no step changes: cells, the mesh at rest, candidates, tools' lines and descriptions."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bipot.laws.coulomb import CARRIES, Status
from bipot.meshes.mesh import Mesh
from bipot.results.description import Parameters, describe, versions
from bipot.results.fields import NO_CANDIDATE
from bipot.results.names import REGION, described
from bipot.scene.scene import Scene
from bipot.system import System
from bipot.tools.poses import rotation
from bipot.traction import SLIP_TOLERANCE
from bipot.typing import Floats, Ints

# h5py types every item as group, dataset or datatype alike.
Item = Any

VERSIONS = ("earliest", "v110")
"""Versions of HDF5's layout: the newest that VTK's readers know, without the marks that a killed writer leaves."""

FORMAT = 2
"""Version of the layout: files of another one are refused."""

NO_REGION = -1

REACH = 1.25
"""Distance from the middle of the body at rest, over its size, to which a plane is drawn."""


@dataclass(frozen=True)
class Line:
    """A line through ``points`` (p, d) on the tool number ``tool``, which in a plane is on its right."""

    tool: int
    points: Floats


@dataclass(frozen=True)
class Lines:
    """Lines at rest: ``points`` (p, d); ``starts`` (l + 1,) of the lines, and their end; their ``tool`` (l,).

    A line is stored at rest; in the pose (a, theta) of its tool its points X are at C + a + Q(theta) (X - C), with C
    the centre about which the tool turns, of the ``centres`` (k, d) (:mod:`bipot.tools.poses`). Infinite straight tools
    are drawn near the body. In space a plane is drawn by an outline, a surface of revolution by meridians and circles.
    """

    points: Floats
    starts: Ints
    tool: Ints
    centres: Floats

    @staticmethod
    def of(scene: Scene) -> Lines:
        """The lines of a scene's tools."""
        nodes, d = scene.mesh.nodes, scene.mesh.dimension
        middle, reach = (nodes.min(axis=0) + nodes.max(axis=0)) / 2, REACH * scene.mesh.size
        found = [(k, line) for k, tool in enumerate(scene.tools) for line in tool.face.lines(middle, reach)]
        centres = [(0.0,) * d if tool.turn is None else tool.turn.centre for tool in scene.tools]
        return Lines(
            np.concatenate([np.empty((0, d)), *(line for _, line in found)]),
            np.cumsum([0, *(len(line) for _, line in found)]),
            np.array([k for k, _ in found], dtype=np.intp),
            np.array(centres).reshape(-1, d),
        )

    def at(self, poses: Floats) -> list[Line]:
        """The lines where the tools are in the ``poses`` (k, p)."""
        lines, d = [], self.centres.shape[1]
        for k, first, last in zip(self.tool.tolist(), self.starts[:-1], self.starts[1:], strict=True):
            out = self.points[first:last] - self.centres[k]
            lines.append(Line(k, self.centres[k] + poses[k, :d] + out @ rotation(poses[k, d:]).T))
        return lines


def write_static(out: Item, system: System, parameters: Parameters, units: Mapping[str, str]) -> None:
    """Write the data that no step changes."""
    scene = system.body.scene
    _write_grid(out, scene.mesh)
    group = out.create_group("bipot")
    group.attrs["format"] = FORMAT
    about = {
        "parameters": dict(parameters),
        "units": dict(units),
        "fields": described(scene.geometry, units, bool(scene.mesh.regions)),
        "scene": describe(scene),
        "boundaries": list(scene.mesh.boundaries),
        "regions": list(scene.mesh.regions),
        "versions": versions(),
        "status": {**{s.name.lower(): int(s) for s in Status}, "no_candidate": NO_CANDIDATE},
        "status_thresholds": (
            f"steps/force_tol = {CARRIES:g} x largest contact force, "
            f"steps/slip_tol = {SLIP_TOLERANCE:g} x motion of the tools in the increment, of the body where they rest"
        ),
    }
    store(group, "about", as_bytes(json.dumps(about)))
    group.create_group("steps")
    _write_mesh(group.create_group("mesh"), scene.mesh)
    store(group, "candidates/node", system.candidates.node)
    store(group, "candidates/tool", system.candidates.tool)
    for name, values in vars(Lines.of(scene)).items():
        store(group, f"tools/{name}", values)


def store(group: Item, name: str, values: ArrayLike) -> None:
    """Write a dataset that does not grow, with a checksum."""
    array = np.asarray(values)
    # An empty dataset has no chunk to check.
    group.create_dataset(name, data=array, fletcher32=True if array.size else None)


def as_bytes(text: str) -> ArrayLike:
    """A text as numbers, which HDF5 stores without a heap."""
    return np.frombuffer(text.encode(), dtype=np.uint8)


def write_cells(file: Item, points: int, connectivity: Ints, ends: Ints, kind: int) -> Item:
    """The group of a grid of so many ``points``: one partition, whose cells of VTK's type ``kind`` all steps share.

    ``connectivity`` has the points of the cells one after the other, those of a cell between two of ``ends`` (n + 1,).
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
    """Write the part of the body's grid that no step changes."""
    ends = np.arange(len(mesh.elements) + 1) * mesh.elements.shape[1]
    vtk = write_cells(file, len(mesh.nodes), mesh.elements.ravel(), ends, mesh.element.vtk)
    steps = vtk.create_group("Steps")
    steps.attrs["NSteps"] = 0
    for name in ("PointData", "CellData"):
        vtk.create_group(name)
        steps.create_group(f"{name}Offsets")
    if mesh.regions:
        store(vtk, f"CellData/{REGION}", _first_regions(mesh))


def _first_regions(mesh: Mesh) -> Ints:
    """The number (e,) of each element's region in the order of the mesh, of several the first; NO_REGION in none."""
    numbers = np.full(len(mesh.elements), NO_REGION)
    for number, members in reversed([*enumerate(mesh.regions.values())]):
        numbers[members] = number
    return numbers


def _write_mesh(group: Item, mesh: Mesh) -> None:
    store(group, "nodes", mesh.nodes)
    store(group, "elements", mesh.elements)
    # By number, because HDF5 may take a name for a path; ``about`` has the names.
    for kind, named in (("boundaries", mesh.boundaries), ("regions", mesh.regions)):
        for number, members in enumerate(named.values()):
            store(group, f"{kind}/{number}", members)
