"""The same scene in other units, mirrored, or renumbered, and how its results come back to the original's terms."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bipot.fem.reduction import Geometry
from bipot.meshes.mesh import Mesh
from bipot.scene.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.state import State
from bipot.typing import Floats, Ints
from studies.fuzz.metals import metals_in
from studies.fuzz.surfaces import Seen

ACROSS = {0: (1, 0, 3, 2, 4, 7, 6, 5, 8), 1: (3, 2, 1, 0, 6, 5, 4, 7, 8)}
"""A quadrilateral's nodes after a mirror along direction 0 or 1: anticlockwise again, reference axes as they were."""


@dataclass(frozen=True)
class Variant:
    """A scene that is the original seen otherwise.

    Original nodal vectors are :meth:`nodal` of ``vectors[number]`` over the scale; ``number`` (a,) is each original
    node's here. Nodal forces of the original tools are ``weight`` (tools, a, 1) times the original's beside, a factor
    of them all or each.
    """

    name: str
    scene: Scene
    number: Ints
    seen: Seen
    length: float
    force: float
    weight: Floats | float = 1.0

    def back(self, vectors: Floats) -> Floats:
        """Vectors (..., 2) as they are in the original, but for their unit."""
        return vectors @ self.seen.matrix

    @property
    def read_in(self) -> Scene:
        """The scene as one of which states are :meth:`read`."""
        return self.scene

    def read(self, state: State) -> State:
        """A state of it as the study reads it."""
        return state

    def read_vectors(self, vectors: Floats) -> Floats:
        """Vectors (..., 2) of it likewise."""
        return vectors

    def nodal(self, vectors: Floats) -> Floats:
        """Vectors (..., 2) of what was read as they are in the original, but for their unit."""
        return self.back(vectors)

    def ways(self, ways: Floats) -> Floats:
        """Ways (m,) of driven tools as the study reads them."""
        return ways

    def tells(self, nodes: Floats) -> bool:
        """Whether an answer of which ``nodes`` (a, d) are the places is one that the original must have."""
        return True


def variants(scene: Scene, seed: int) -> list[Variant]:
    """One of each kind, drawn from ``seed``."""
    rng = np.random.default_rng([seed, 2])
    length, stress = 10.0 ** rng.uniform(-3, 3), 10.0 ** rng.uniform(-6, 6)
    sideways = scene.geometry is Geometry.PLANE_STRAIN and rng.random() < 0.5
    return [
        in_units(scene, length, stress),
        mirrored(scene, 0 if sideways else 1),
        renumbered(scene, rng.permutation(len(scene.mesh.nodes)), rng.permutation(len(scene.mesh.elements))),
    ]


def in_units(scene: Scene, length: float, stress: float) -> Variant:
    """Lengths times ``length``, stresses times ``stress``; forces are those of unit thickness in plane strain."""
    mesh = scene.mesh
    force = stress * (length if scene.geometry is Geometry.PLANE_STRAIN else length**2)
    seen = Seen.scaled(length)
    tools = tuple(seen.tool(tool, force) for tool in scene.tools)
    other = replace(
        metals_in(scene, stress),
        mesh=Mesh(mesh.nodes * length, mesh.elements, mesh.boundaries, mesh.regions),
        tools=tools,
        supports=tuple(map(seen.support, scene.supports)),
        loads=tuple(_in_units(load, length, stress, force) for load in scene.loads),
    )
    return Variant("units", other, np.arange(len(mesh.nodes)), seen, length, force)


def mirrored(scene: Scene, axis: int) -> Variant:
    """Coordinate ``axis`` reversed."""
    mesh, seen = scene.mesh, Seen.mirrored(axis)
    other = replace(
        scene,
        mesh=Mesh(seen.points(mesh.nodes), mesh.elements[:, reflected(mesh, axis)], mesh.boundaries, mesh.regions),
        tools=tuple(map(seen.tool, scene.tools)),
        supports=tuple(map(seen.support, scene.supports)),
        loads=loads_seen(scene, seen),
    )
    return Variant("mirrored", other, np.arange(len(mesh.nodes)), seen, 1.0, 1.0)


def reflected(mesh: Mesh, axis: int) -> Ints:
    """The order of an element's nodes in its mirror image along ``axis``: its rule is then the mirror image, too."""
    element = mesh.element
    quads = [k for k in ACROSS[axis] if k < element.nodes]
    return np.array(quads if element.corners == 4 else element.mirrored)


def renumbered(scene: Scene, nodes: Ints, elements: Ints) -> Variant:
    """Node a becomes ``nodes[a]``; elements in the order ``elements``."""
    mesh = scene.mesh
    x = np.empty_like(mesh.nodes)
    x[nodes] = mesh.nodes
    boundaries = {name: nodes[edges] for name, edges in mesh.boundaries.items()}
    tools = tuple(
        replace(
            tool,
            mu_at={int(nodes[a]): mu for a, mu in tool.mu_at.items()},
            shear_at={int(nodes[a]): m for a, m in tool.shear_at.items()},
        )
        for tool in scene.tools
    )
    loads = tuple(
        replace(load, node=int(nodes[load.node])) if isinstance(load, PointForce) else load for load in scene.loads
    )
    regions = {name: np.flatnonzero(np.isin(elements, members)) for name, members in mesh.regions.items()}
    other = replace(scene, mesh=Mesh(x, nodes[mesh.elements[elements]], boundaries, regions), tools=tools, loads=loads)
    return Variant("renumbered", other, nodes, Seen.scaled(1.0), 1.0, 1.0)


def _in_units(load: Load, length: float, stress: float, force: float) -> Load:
    if isinstance(load, Pressure):
        return replace(load, pressure=load.pressure * stress)
    if isinstance(load, BodyForce | Traction | PointForce):
        unit = stress / length if isinstance(load, BodyForce) else stress if isinstance(load, Traction) else force
        return replace(load, vector=(load.vector[0] * unit, load.vector[1] * unit))
    raise TypeError(f"no units known for {load!r}")


def loads_seen(scene: Scene, seen: Seen) -> tuple[Load, ...]:
    """The loads of a scene as they are in another."""
    return tuple(
        replace(load, vector=seen.way(load.vector)) if isinstance(load, BodyForce | Traction | PointForce) else load
        for load in scene.loads
    )
