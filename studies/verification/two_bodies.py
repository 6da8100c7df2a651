"""Bodies that touch each other: their meshes as one, and what they bear where they do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bipot import Accepted, DeformableTool, Mesh
from bipot.tools.facing import pieces
from bipot.typing import Floats


def mapped(mesh: Mesh, place: Callable[[Floats, Floats], tuple[Floats, Floats]]) -> Mesh:
    """The mesh with its nodes at places (x, y) by their former ones."""
    return replace(mesh, nodes=np.stack(place(*mesh.nodes.T), axis=1))


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


def borne(accepted: Accepted) -> Borne:
    """What the candidates of the scene's one deformable tool bear at the end of an increment."""
    system = accepted.solved.iterate.increment.system
    mesh, node, nodes = system.body.scene.mesh, system.candidates.node, accepted.state.nodes
    (tool,) = system.body.scene.tools
    assert isinstance(tool, DeformableTool)
    sides = tool.candidates, tool.surface
    one, other = (np.concatenate([mesh.surface(name)[0] for name in names]) for names in sides)
    found = pieces(nodes[one], nodes[other], system.body.scene.ring)
    psi = np.stack([1 - found.xi, found.xi], axis=-1)
    share = np.einsum("sg,sgp->sp", found.weight, psi)
    area = np.zeros(len(nodes))
    np.add.at(area, one[found.one], share)
    order = np.argsort(nodes[node, 0])
    return Borne(nodes[node[order]], accepted.solved.r[order], area[node[order]])
