"""The paper's upsetting as an input deck of CalculiX: the quarter of the meridian plane, the punch a stiff ring.

Nodes of the punch are all prescribed, so its elements do not deform; what they would be made of changes nothing. The
ring leaves out :data:`HOLE` around the axis: contact between faces finds no partner on a face that is folded into the
axis. Candidates are the top and the upper half of the side: no more comes to lie on the punch. Contact is linear in the
overclosure with ``stiffness`` E/h a pressure per length, and sticks with ``sticking`` of it. Each mark ends a step;
increments are the program's own, from a tenth of the longest on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bipot.elements import Element
from bipot.mesh import Mesh
from bipot.scene import upsetting
from bipot.sections import cylinder
from bipot.typing import Ints

NODES, FACES = "NODE TO SURFACE", "SURFACE TO SURFACE"
PUNCH, HOLE, OUTSIDE = "PUNCH", 0.001, 2.0
"""Name of the punch's nodes; its inner radius over the cylinder's, and its outer one."""

STRAIN = 10.0
"""Equivalent plastic strain to which the flat curve is given: more than any point reaches."""

QUADRATIC = ("CAX8", "CAX8R")


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

    def mesh(self) -> Mesh:
        """Of the cylinder: that of the reference between lines."""
        scene = upsetting(mu=self.mu)
        radius, half = scene.mesh.nodes.max(axis=0)
        element = Element.Q8 if self.element in QUADRATIC else Element.Q4
        return cylinder(float(radius), float(half), self.elements, self.elements, element=element)

    def text(self, marks: Sequence[float]) -> str:
        """The deck that stops at each of these reductions and prints the punch's force there."""
        mesh = self.mesh()
        return "\n".join([*_body(mesh, self.element), *_punch(mesh), *self._law(mesh), *self._steps(mesh, marks), ""])

    def _law(self, mesh: Mesh) -> Iterator[str]:
        """Materials and contact."""
        scene, height = upsetting(mu=self.mu), float(mesh.nodes[:, 1].max())
        bulk = scene.material
        stress = float(bulk.yield_stress(np.zeros(1))[0])
        penalty = self.stiffness * bulk.elasticity.young * self.elements / height
        yield f"*MATERIAL, NAME=BODY\n*ELASTIC\n{bulk.elasticity.young:.12g}, {bulk.elasticity.poisson:.12g}"
        yield f"*PLASTIC\n{stress:.12g}, 0.\n{stress:.12g}, {STRAIN:g}"
        yield f"*MATERIAL, NAME=TOOL\n*ELASTIC\n{bulk.elasticity.young:.12g}, {bulk.elasticity.poisson:.12g}"
        yield "*SOLID SECTION, ELSET=BODY, MATERIAL=BODY\n*SOLID SECTION, ELSET=TOOL, MATERIAL=TOOL"
        yield "*SURFACE INTERACTION, NAME=LAW"
        yield f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{penalty:.12g}"
        if self.mu > 0:
            yield f"*FRICTION\n{self.mu:.12g}, {self.sticking * penalty:.12g}"
        yield from self._slave(mesh)
        yield f"*CONTACT PAIR, INTERACTION=LAW, TYPE={self.contact}\nSLAVE, MASTER"

    def _slave(self, mesh: Mesh) -> Iterator[str]:
        """What may touch the punch, by nodes or by faces of elements; and the punch's lower face."""
        middle = mesh.nodes[:, 1].max() / 2
        edges = np.concatenate([mesh.boundaries["top"], mesh.boundaries["side"]])
        upper = edges[(mesh.nodes[edges, 1] > middle * (1 - 1e-9)).all(axis=1)]
        if self.contact == NODES:
            yield "*SURFACE, NAME=SLAVE, TYPE=NODE"
            yield from (f"{node + 1}," for node in np.unique(upper))
        else:
            yield "*SURFACE, NAME=SLAVE"
            yield from _faces(mesh, upper[:, [0, -1]])
        yield f"*SURFACE, NAME=MASTER\n{len(mesh.elements) + 1}, S1"

    def _steps(self, mesh: Mesh, marks: Sequence[float]) -> Iterator[str]:
        """Supports that last, and a step a mark."""
        half, before = float(mesh.nodes[:, 1].max()), 0.0
        yield "*BOUNDARY\nAXIS, 1, 1\nMIDDLE, 2, 2\nPUNCH, 1, 1"
        for mark in marks:
            length = mark - before
            longest = min(1.0, self.longest / length)
            yield "*STEP, NLGEOM, INC=100000\n*STATIC"
            yield f"{longest / 10 if before == 0 else longest:.9g}, 1., 1e-6, {longest:.9g}"
            yield f"*BOUNDARY\n{PUNCH}, 2, 2, {-mark * half:.12g}"
            yield f"*NODE PRINT, NSET={PUNCH}, TOTALS=ONLY, FREQUENCY=100000\nRF\n*END STEP"
            before = mark


def _body(mesh: Mesh, element: str) -> Iterator[str]:
    yield "*NODE, NSET=BODY"
    yield from _numbered(1, mesh.nodes)
    yield f"*ELEMENT, TYPE={element}, ELSET=BODY"
    yield from (", ".join(map(str, (number, *(cell + 1)))) for number, cell in enumerate(mesh.elements, 1))
    for name, place in (("AXIS", mesh.nodes[:, 0]), ("MIDDLE", mesh.nodes[:, 1])):
        yield f"*NSET, NSET={name}"
        yield from (f"{node + 1}," for node in np.flatnonzero(place == 0))


def _punch(mesh: Mesh) -> Iterator[str]:
    """One element."""
    (radius, half), first = mesh.nodes.max(axis=0), len(mesh.nodes) + 1
    inner, outer = HOLE * radius, OUTSIDE * radius
    yield f"*NODE, NSET={PUNCH}"
    yield from _numbered(first, [(inner, half), (outer, half), (outer, 1.2 * half), (inner, 1.2 * half)])
    yield "*ELEMENT, TYPE=CAX4, ELSET=TOOL"
    yield ", ".join(map(str, (len(mesh.elements) + 1, *range(first, first + 4))))


def _faces(mesh: Mesh, ends: Ints) -> Iterator[str]:
    """Element and side of edges by their ends (e, 2), in the counting of the deck."""
    wanted = {frozenset(pair) for pair in ends.tolist()}
    for number, corners in enumerate(mesh.elements[:, :4].tolist(), 1):
        for side in range(4):
            if frozenset((corners[side], corners[(side + 1) % 4])) in wanted:
                yield f"{number}, S{side + 1}"


def _numbered(first: int, places: Iterable[Sequence[float]]) -> Iterator[str]:
    return (f"{number}, {r:.15g}, {z:.15g}, 0." for number, (r, z) in enumerate(places, first))
