r"""The change of contact forces as nodes move along curved tools, and with the coordinates of those that are driven.

A node pushed by the vector f, whose derivative by its own position is the B of :mod:`bipot.tools.meeting`, exerts -f
on its tool. The force dual to a coordinate x_i of the tool is then -f . w_i, with w_i and 1/L_i of
:mod:`bipot.scene.drives`. The normal turns as the two pass each other; in addition the vector and its arm turn with the
tool:

    d f / d x_j = -B w_j + (z x f) / L_j,
    d (-f . w_i) / d x_j = -(d f / d x_j) . w_i + f . (z x e_j) / L_i,
    d (-f . w_i) / d x = -w_i' B + (z x f) / L_i,

with e_j the direction of x_j if a force drives it, and x the node's position. In a plane the matrix is symmetric,
because it has a potential (friction f is frozen here). In space frames do not turn with the tool about their normals n
but are transported with these (:mod:`bipot.tools.slips`): with s of :func:`~bipot.tools.slips.spin`, the friction
r_1 t_1 + r_2 t_2 lags behind the tool by the rate z . n - s . (z x n) along r_1 t_2 - r_2 t_1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.meshes.mesh import Mesh
from bipot.scene.scene import Scene
from bipot.tools.meeting import Meeting
from bipot.tools.poses import angles_of, crossed
from bipot.typing import Bools, Floats, Ints, einsum

MOST = 2
"""Coordinates of one tool: along a force, and about a centre."""


@dataclass(frozen=True)
class Pairs:
    """The coupling of the unknowns of b pairs of a node and a driven curved tool of the ``scene``.

    ``tool`` and ``node`` (b,) in that order, and ``number`` (b, 2) of the coordinates of the tool, -1 for none.
    """

    scene: Scene
    tool: Ints
    node: Ints
    number: Ints

    @property
    def unknowns(self) -> Ints:
        """Full numbers (b, d + 2) of the unknowns, those of tools behind the nodes'; -1 for none."""
        driven, d = np.where(self.number >= 0, self.scene.mesh.nodes.size + self.number, -1), self.scene.mesh.dimension
        return np.column_stack([d * self.node[:, None] + np.arange(d), driven])

    def matrices(self, tool: Ints, node: Ints, meeting: Meeting, r: Floats) -> Floats:
        """The matrices (b, d + 2, d + 2) to be subtracted from the stiffness, without the part of the nodes alone.

        They are those of parts at a ``tool`` and a ``node`` (w,), of their ``meeting`` and the forces r (w, d) on them.
        """
        d = self.scene.mesh.dimension
        out = np.zeros((len(self.node), d + MOST, d + MOST))
        if not len(out):
            return out
        mine = np.isin(tool, self.tool)
        at = np.searchsorted(self._key(self.tool, self.node), self._key(tool[mine], node[mine]))
        number, none = self.number[at], (self.number[at] < 0)[..., None]
        f = einsum("ci,cij->cj", r, meeting.frames)[mine, None]
        arm, bending = meeting.arm[mine, None], meeting.bending(r)[mine]
        ways, drives = self.scene.drives.ways[number], self.scene.drives
        w = np.where(none, 0.0, drives.motion(number, np.broadcast_to(arm, (len(f), MOST, d))))
        spin, e = np.where(none, 0.0, angles_of(ways)), np.where(none, 0.0, ways[..., :d])
        with_tool = crossed(spin, np.broadcast_to(f, w.shape))
        turned = with_tool - einsum("cij,caj->cai", bending, w) - meeting.lag(r, mine, spin)
        block = np.zeros((len(at), *out.shape[1:]))
        block[:, :d, d:] = self._along(at, turned).transpose(0, 2, 1)
        block[:, d:, :d] = self._along(at, with_tool - einsum("cij,cai->caj", bending, w))
        block[:, d:, d:] = np.vecdot(f[:, :, None], crossed(spin[:, :, None], e[:, None]))
        block[:, d:, d:] -= einsum("cbi,cai->cab", turned, w)
        np.add.at(out, at, block)
        return out

    def _along(self, pair: Ints, vectors: Floats) -> Floats:
        """Vectors (m, 2, d) of pairs (m,) by the unknowns of their nodes: components along these nodes' own axes."""
        axes, nodes = self.scene.holding.axes, self.node[pair]
        return np.stack([axes.at(nodes, vectors[:, a]) for a in range(MOST)], axis=1)

    def _key(self, tool: Ints, node: Ints) -> Ints:
        return tool * len(self.scene.mesh.nodes) + node


def pairs_of(scene: Scene) -> Pairs:
    """The pairs of a scene: nodes of the tools' boundaries."""
    tools, nodes, numbers = [np.empty(0, np.intp)], [np.empty(0, np.intp)], [np.empty((0, MOST), np.intp)]
    for k, tool in enumerate(scene.tools):
        own = np.flatnonzero(scene.drives.tool == k)
        if len(own) and not tool.flat:
            nodes.append(np.unique(scene.mesh.boundary_nodes(*tool.candidates)))
            tools.append(np.full(len(nodes[-1]), k))
            padded = np.concatenate([own, np.full(MOST - len(own), -1)])
            numbers.append(np.broadcast_to(padded, (len(nodes[-1]), MOST)))
    return Pairs(scene, np.concatenate(tools), np.concatenate(nodes), np.concatenate(numbers))


@dataclass(frozen=True)
class Bent:
    """The ``parts`` (b,) at curved tools, an ``element`` (b,) of each one's node, and its unknowns ``dofs`` (b, d).

    Any element of the node will do, because elements are summed. Of driven tools :class:`Pairs` have the rest.
    """

    parts: Ints
    element: Ints
    dofs: Ints

    @staticmethod
    def of(mesh: Mesh, node: Ints, curved: Bools) -> Bent:
        """Those of parts at these nodes (w,), of which some are at ``curved`` (w,) tools."""
        parts = np.flatnonzero(curved)
        _, first = np.unique(mesh.elements, return_index=True)
        element, local = np.divmod(first[node[parts]], mesh.elements.shape[1])
        return Bent(parts, element, mesh.dimension * local[:, None] + np.arange(mesh.dimension))

    def take_off(self, K: Floats, bending: Floats) -> None:
        """Subtract the derivatives ``bending`` (w, d, d) of the parts' forces by position from element matrices K."""
        at = self.element[:, None, None], self.dofs[:, :, None], self.dofs[:, None, :]
        np.subtract.at(K, at, bending[self.parts])
