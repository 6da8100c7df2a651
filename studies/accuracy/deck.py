"""The paper's upsetting as an input deck of CalculiX: the quarter of the meridian plane, the punch a stiff ring.

Nodes of the punch are all prescribed, so its elements do not deform; what they would be made of changes nothing. The
ring leaves out :data:`HOLE` around the axis: contact between faces finds no partner on a face that is folded into the
axis. Candidates are the top and the upper half of the side: no more comes to lie on the punch. Contact is linear in the
overclosure with ``stiffness`` E/h a pressure per length, and sticks with ``sticking`` of it. Each mark ends a step;
increments are the program's own, from a tenth of the longest on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bipot.laws.material import Material
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import cylinder
from bipot.paper import upsetting
from bipot.scene.regions import parts_of
from bipot.scene.scene import Scene
from bipot.typing import Floats, Ints

NODES, FACES = "NODE TO SURFACE", "SURFACE TO SURFACE"
BODY, PUNCH, HOLE, OUTSIDE = "BODY", "PUNCH", 0.001, 2.0
"""Names of the body's and the punch's nodes; the punch's inner radius over the cylinder's, and its outer one."""

STRAIN = 10.0
"""Equivalent plastic strain to which the curve, which is straight, is given: more than any point reaches."""

QUADRATIC = ("CAX8", "CAX8R")

SECTORS = 180
"""Axisymmetric elements are calculated, and their forces printed, as a sector of two degrees."""

ENTRIES = 16
"""Most entries of a line."""


@dataclass(frozen=True)
class Deck:
    """One calculation: ``longest`` is the longest increment as a part of the height."""

    mu: float
    element: str
    contact: str
    elements: int
    longest: float
    stiffness: float
    sticking: float

    def scene(self) -> Scene:
        """What is calculated."""
        return upsetting(mu=self.mu)

    @property
    def facets(self) -> int:
        """Of the punch."""
        return 1

    @property
    def tool(self) -> Material:
        """What the punch is made of."""
        return self.scene().material

    def force(self, total: Sequence[float]) -> float:
        """On the whole punch, from the ``total`` (3,) that is printed of its nodes."""
        return SECTORS * abs(total[1])

    def mesh(self) -> Mesh:
        """Of the cylinder: that of the reference between lines."""
        scene = self.scene()
        radius, half = scene.mesh.nodes.max(axis=0)
        element = Element.Q8 if self.element in QUADRATIC else Element.Q4
        return cylinder(float(radius), float(half), self.elements, self.elements, element=element)

    def text(self, marks: Sequence[float]) -> str:
        """The deck that stops at each of these reductions and prints the punch's force there."""
        mesh = self.mesh()
        parts = (
            _body(mesh, self.element, self._held(mesh)),
            self._punch(mesh),
            self._law(mesh),
            self._steps(mesh, marks),
        )
        return "\n".join([*(line for part in parts for line in part), ""])

    def _held(self, mesh: Mesh) -> dict[str, Floats]:
        """Sets of nodes that a plane of symmetry holds along each axis, and where they are zero."""
        return dict(zip(("AXIS", "MIDDLE"), mesh.nodes.T, strict=True))

    def _law(self, mesh: Mesh) -> Iterator[str]:
        """Materials and contact."""
        scene, height = self.scene(), float(mesh.nodes[:, -1].max())
        penalty = self.stiffness * scene.material.elasticity.young * self.elements / height
        for name, elements in parts_of(scene.regions, mesh).items():
            part = name.upper() or BODY
            yield from _material(part, scene.regions.get(name, scene.material))
            yield f"*ELSET, ELSET=OF_{part}"
            yield from (f"{element + 1}," for element in elements)
            yield f"*SOLID SECTION, ELSET=OF_{part}, MATERIAL={part}"
        yield from _elastic("TOOL", self.tool)
        yield "*SOLID SECTION, ELSET=TOOL, MATERIAL=TOOL"
        yield "*SURFACE INTERACTION, NAME=LAW"
        yield f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{penalty:.12g}"
        if self.mu > 0:
            yield f"*FRICTION\n{self.mu:.12g}, {self.sticking * penalty:.12g}"
        yield from self._slave(mesh)
        yield f"*CONTACT PAIR, INTERACTION=LAW, TYPE={self.contact}\nSLAVE, MASTER"

    def _slave(self, mesh: Mesh) -> Iterator[str]:
        """What may touch the punch, by nodes or by faces of elements; and what it may touch."""
        upper = self._upper(mesh, ("top", "side"))
        if self.contact == NODES:
            yield "*SURFACE, NAME=SLAVE, TYPE=NODE"
            yield from (f"{node + 1}," for node in np.unique(upper))
        else:
            yield "*SURFACE, NAME=SLAVE"
            yield from edges_of(mesh, upper[:, [0, -1]])
        yield from self._master(mesh)

    def _master(self, mesh: Mesh) -> Iterator[str]:
        """The punch's lower face."""
        yield "*SURFACE, NAME=MASTER"
        yield from (f"{len(mesh.elements) + k}, S1" for k in range(1, self.facets + 1))

    def _punch(self, mesh: Mesh) -> Iterator[str]:
        """Its elements, as many as it has facets: one."""
        (radius, half), first = mesh.nodes.max(axis=0), len(mesh.nodes) + 1
        inner, outer = HOLE * radius, OUTSIDE * radius
        yield f"*NODE, NSET={PUNCH}"
        yield from numbered(first, [(inner, half), (outer, half), (outer, 1.2 * half), (inner, 1.2 * half)])
        yield "*ELEMENT, TYPE=CAX4, ELSET=TOOL"
        yield from entries(len(mesh.elements) + 1, *range(first, first + 4))

    def _upper(self, mesh: Mesh, names: Sequence[str]) -> Ints:
        """Facets of these names in the upper half."""
        middle = mesh.nodes[:, -1].max() / 2
        facets = np.concatenate([mesh.boundaries[name] for name in names])
        return facets[(mesh.nodes[facets, -1] > middle * (1 - 1e-9)).all(axis=1)]

    def _steps(self, mesh: Mesh, marks: Sequence[float]) -> Iterator[str]:
        """Supports that last, and a step a mark."""
        half, before, last = float(mesh.nodes[:, -1].max()), 0.0, mesh.dimension
        yield "*BOUNDARY"
        yield from (f"{name}, {axis}, {axis}" for axis, name in enumerate(self._held(mesh), 1))
        yield f"{PUNCH}, 1, {last - 1}"
        for mark in marks:
            length = mark - before
            longest = min(1.0, self.longest / length)
            yield "*STEP, NLGEOM, INC=100000\n*STATIC"
            yield f"{longest / 10 if before == 0 else longest:.9g}, 1., 1e-6, {longest:.9g}"
            yield f"*BOUNDARY\n{PUNCH}, {last}, {last}, {-mark * half:.12g}"
            yield f"*NODE PRINT, NSET={PUNCH}, TOTALS=ONLY, FREQUENCY=100000\nRF\n*END STEP"
            before = mark


def _elastic(name: str, material: Material) -> Iterator[str]:
    yield f"*MATERIAL, NAME={name}\n*ELASTIC\n{material.elasticity.young:.12g}, {material.elasticity.poisson:.12g}"


def _material(name: str, material: Material) -> Iterator[str]:
    strains = np.array([0.0, STRAIN])
    yield from _elastic(name, material)
    yield "*PLASTIC"
    yield from (f"{y:.12g}, {p:g}" for y, p in zip(material.yield_stress(strains), strains, strict=True))


def _body(mesh: Mesh, element: str, held: Mapping[str, Floats]) -> Iterator[str]:
    yield f"*NODE, NSET={BODY}"
    yield from numbered(1, mesh.nodes)
    yield f"*ELEMENT, TYPE={element}, ELSET={BODY}"
    yield from (line for number, cell in enumerate(mesh.elements, 1) for line in entries(number, *(cell + 1)))
    for name, place in held.items():
        yield f"*NSET, NSET={name}"
        yield from (f"{node + 1}," for node in np.flatnonzero(place == 0))


def edges_of(mesh: Mesh, ends: Ints, before: int = 0) -> Iterator[str]:
    """Element, with so many ``before`` it, and side of edges by their ends (e, 2), in the counting of the deck."""
    wanted = {frozenset(pair) for pair in ends.tolist()}
    for number, corners in enumerate(mesh.elements[:, :4].tolist(), before + 1):
        for side in range(4):
            if frozenset((corners[side], corners[(side + 1) % 4])) in wanted:
                yield f"{number}, S{side + 1}"


def entries(*values: int) -> Iterator[str]:
    """Their lines: one that goes on in the next ends with a comma."""
    words = [str(value) for value in values]
    for first in range(0, len(words), ENTRIES):
        yield ", ".join(words[first : first + ENTRIES]) + ("," if first + ENTRIES < len(words) else "")


def numbered(first: int, places: Iterable[Sequence[float]]) -> Iterator[str]:
    """Nodes at these places (d,), which have three coordinates."""
    for number, place in enumerate(places, first):
        yield ", ".join([str(number), *(f"{x:.15g}" for x in place), *["0."] * (3 - len(place))])
