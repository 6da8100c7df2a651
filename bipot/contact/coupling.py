r"""The change of contact forces as nodes move along curved tools, and with the coordinates of driven tools.

A node pushed by the vector f, whose derivative by its own position is the B of :mod:`bipot.tools.meeting`, exerts -f
on its tool. The force dual to a coordinate x_i of the tool is then -f . w_i, with w_i and 1/L_i of
:mod:`bipot.scene.drives`. The normal turns as node and tool pass each other; in addition f and its arm turn with the
tool:

    d f / d x_j = -B w_j + (z x f) / L_j,
    d (-f . w_i) / d x_j = -(d f / d x_j) . w_i + f . (z x e_j) / L_i,
    d (-f . w_i) / d x = -w_i' B + (z x f) / L_i,

with z the axis of the tool's turn, e_j the direction of x_j if a force drives it, and x the node's position. In a plane
the matrix is symmetric, because the forces have a potential (friction is frozen here). In space frames do not turn with
the tool about their normals n but are transported with these (:mod:`bipot.tools.slips`): with s of
:func:`~bipot.tools.slips.spin`, the friction r_1 t_1 + r_2 t_2 lags behind the tool by the rate z . n - s . (z x n)
along r_1 t_2 - r_2 t_1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.fem.assembly import Space
from bipot.meshes.mesh import Mesh
from bipot.programs.pieces import Measured
from bipot.scene.scene import Scene
from bipot.tools.meeting import Faces, Meeting
from bipot.tools.poses import angles_of, crossed
from bipot.typing import Floats, Ints, einsum

MOST = 2
"""The most coordinates of one tool: along a force, and about a centre."""


@dataclass(frozen=True)
class Pairs:
    """The coupling of the unknowns of b pairs of a node and a driven curved tool of the ``scene``.

    They are sorted by ``tool`` (b,), then ``node`` (b,); ``number`` (b, 2) are the tool's coordinates, -1 for none.
    """

    scene: Scene
    tool: Ints
    node: Ints
    number: Ints

    @property
    def unknowns(self) -> Ints:
        """Numbers (b, d + 2) among all unknowns, held ones included, tools' after nodes'; -1 for none."""
        driven, d = np.where(self.number >= 0, self.scene.mesh.nodes.size + self.number, -1), self.scene.mesh.dimension
        return np.column_stack([d * self.node[:, None] + np.arange(d), driven])

    def matrices(self, tool: Ints, node: Ints, meeting: Meeting, r: Floats) -> Floats:
        """The matrices (b, d + 2, d + 2) to be subtracted from the stiffness, without the part of the nodes alone.

        They are made of parts at ``tool`` and ``node`` (w,), their ``meeting`` and the forces r (w, d) on them.
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

    def measured(self, space: Space, faces: Faces, meeting: Meeting) -> Measured | None:
        """How motions of candidates, whose parts meet the ``faces``, change in space; None in a plane, as rows say.

        Beside what the relative motion of node and tool changes, slips turn with the tool by the rate of the module's
        docstring.
        """
        if meeting.measured is None:
            return None
        drives, turn, spin = self.scene.drives, np.full(len(meeting.motion), -1), np.zeros_like(meeting.by)
        for number in np.flatnonzero(drives.spins).tolist():
            mine = faces.owned[drives.tool[number]]
            turn[faces.parts.owner[mine]], spin[mine] = len(space.free) + number, angles_of(drives.ways[number])
        turned = meeting.by_turn(faces.parts, spin) if spin.any() else np.zeros_like(meeting.motion)
        return Measured(meeting.measured, turn, turned)

    def _along(self, pair: Ints, vectors: Floats) -> Floats:
        """Vectors (m, 2, d) of each ``pair`` (m,) by the unknowns of its node: components along the node's axes."""
        axes, nodes = self.scene.holding.axes, self.node[pair]
        return np.stack([axes.at(nodes, vectors[:, a]) for a in range(MOST)], axis=1)

    def _key(self, tool: Ints, node: Ints) -> Ints:
        return tool * len(self.scene.mesh.nodes) + node


def entries_of(mesh: Mesh, nodes: Ints) -> tuple[Ints, Ints, Ints]:
    """Where the matrices (b, d, d) of ``nodes`` (b,) are in those of elements (e, dk, dk): in any, as they sum."""
    _, first = np.unique(mesh.elements, return_index=True)
    element, local = np.divmod(first[nodes], mesh.elements.shape[1])
    dofs = mesh.dimension * local[:, None] + np.arange(mesh.dimension)
    return element[:, None, None], dofs[:, :, None], dofs[:, None, :]


def pairs_of(scene: Scene) -> Pairs:
    """The pairs of a scene: driven curved tools with the nodes of their boundaries."""
    tools, nodes, numbers = [np.empty(0, np.intp)], [np.empty(0, np.intp)], [np.empty((0, MOST), np.intp)]
    for k, tool in enumerate(scene.tools):
        coordinates = np.flatnonzero(scene.drives.tool == k)
        if len(coordinates) and not tool.flat:
            nodes.append(np.unique(scene.mesh.boundary_nodes(*tool.candidates)))
            tools.append(np.full(len(nodes[-1]), k))
            padded = np.pad(coordinates, (0, MOST - len(coordinates)), constant_values=-1)
            numbers.append(np.broadcast_to(padded, (len(nodes[-1]), MOST)))
    return Pairs(scene, np.concatenate(tools), np.concatenate(nodes), np.concatenate(numbers))
