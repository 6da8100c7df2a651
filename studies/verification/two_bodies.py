"""Bodies that touch each other: their meshes as one, and what they bear where they do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bipot import Accepted, DeformableTool, Element, Mesh
from bipot.tools.flats import flats
from bipot.tools.pieces import pieces
from bipot.typing import Floats
from studies.element_scenes import tensor
from studies.verification.indentation import FINE, lines


def mapped(mesh: Mesh, place: Callable[[Floats, Floats], tuple[Floats, Floats]]) -> Mesh:
    """The mesh with its nodes at places (x, y) by their former ones."""
    return replace(mesh, nodes=np.stack(place(*mesh.nodes.T), axis=1))


def turned(mesh: Mesh) -> Mesh:
    """The mesh turned by half a turn around the origin; boundaries keep their names."""
    return replace(mesh, nodes=-mesh.nodes)


def both_sides(ends: Floats) -> Floats:
    """Ends of elements from zero on, and their mirror images.

    >>> both_sides(np.array([0.0, 1.0, 3.0])).tolist()
    [-3.0, -1.0, 0.0, 1.0, 3.0]
    """
    return np.append(-ends[:0:-1], ends)


def cylinder_end(radius: float, a: float, n: int, *, half: bool) -> Mesh:
    """The lower quarter, x >= 0, or half of a circle that touches y = 0 at x = 0, up to its middle at y = ``radius``.

    ``n`` (even) equal elements reach along it to :data:`FINE` half-widths ``a``; they are half as many, as high, and
    larger away from there. With u along the base and w up of a square of size one, places are x = R u sqrt(1 - v^2/2),
    y = R - R v sqrt(1 - u^2/2), v = 1 - w: the base is the circle to 45 degrees, and the right side goes on from there.
    """
    fine = FINE * a / radius
    along, up = lines(np.sqrt(2) * fine, n, 1.0), lines(fine / 2, n // 2, 1.0)

    def place(u: Floats, w: Floats) -> tuple[Floats, Floats]:
        v = 1 - w
        return radius * u * np.sqrt(1 - v**2 / 2), radius - radius * v * np.sqrt(1 - u**2 / 2)

    return mapped(tensor(both_sides(along) if half else along, up, Element.Q4), place)


class Borne(NamedTuple):
    """Candidates of a deformable tool from left to right: places x (c, 2), forces r (c, 2) and areas (c,).

    Areas are int psi_p dA over the part of the boundary that faces the tool: r_n over them is the pressure.
    """

    x: Floats
    r: Floats
    area: Floats

    @property
    def traction(self) -> Floats:
        """Pressure and shear stress (c, 2), zero where nothing is faced."""
        area = self.area[:, None]
        return np.divide(self.r, area, out=np.zeros_like(self.r), where=area > 0)

    @property
    def pressure(self) -> Floats:
        """Of each candidate (c,)."""
        return self.traction[:, 0]


def half_width(x: Floats, forces: Floats, size: float) -> float:
    """Of what is spread as sqrt(1 - x^2/a^2): a^2 = 4 times its mean x^2, of forces (c,) at x (c,).

    Forces are those of pressures that are linear between points, this ``size`` apart: the mean x^2 of what one of them
    stands for is x^2 + size^2/6.
    """
    return float(np.sqrt(4 * (forces @ x**2 / forces.sum() + size**2 / 6)))


def borne(accepted: Accepted) -> Borne:
    """What the candidates of the scene's one deformable tool bear at the end of an increment."""
    system = accepted.solved.iterate.increment.system
    mesh, node, nodes = system.body.scene.mesh, system.candidates.node, accepted.state.nodes
    (tool,) = system.body.scene.tools
    assert isinstance(tool, DeformableTool)
    sides = tool.candidates, tool.surface
    one, other = (np.concatenate([mesh.surface(name)[0] for name in names]) for names in sides)
    found = pieces(nodes, one, other, system.body.scene.ring)
    share = np.einsum("sg,sgp->sp", found.weight, found.mine) * (2 * np.pi if system.body.scene.ring else 1.0)
    area = np.zeros(len(nodes))
    np.add.at(area, flats(one, 2)[found.one], share)
    order = np.argsort(nodes[node, 0])
    return Borne(nodes[node[order]], accepted.solved.r[order], area[node[order]])
