r"""From geometry to affine contact operators: the only place that knows what touches what.

For the increment dU (free displacements, and translations of tools that a force drives) of one step, per candidate c

    gap at the end        g + G_n dU         (n,)      with g = gap at the start against the end of the tool's path,
    relative slip         w_t + G_t dU       (d - 1,)  with w_t = minus the tool's tangential motion along it,

both relative to the tool, in its frame (:func:`frames`): n from the tool into the body, t = (n_y, -n_x). Dual to them
are the contact *forces* (r_n, r_t). Friction rows exist only where the tangent is free and the tool has friction.

A candidate is *closed* where it carries a force (:func:`carries`) or has no gap (:func:`touches`). Which of them is
asked depends on what is known and what for:

* by force alone: tractions and landings, for what touches without a force has no traction and has not landed;
* by gap alone: the start of an increment, where a weld takes hold, for forces there are those of the last increment;
* by either: what keeps the body where it is, for what touches without a force still stops a motion one way.

The pieces of Newton (:mod:`bipot.programs.pieces`) are guesses on the way to a solution, not statements about one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from bipot.fem.assembly import Space
from bipot.programs.data import ContactRows, rows_of
from bipot.scene import Scene, free_along
from bipot.tensors import norm
from bipot.tools import ACROSS, FlatTool
from bipot.typing import Bools, Floats, Ints

ROUND_OFF = 8 * float(np.finfo(float).eps)

CARRIES = 1e-8
"""A contact force below this fraction of the increment's largest is none: what a solver leaves at open candidates."""

TOUCHES = 1e-9
"""A gap below this fraction of the body's size is none: round-off of the geometry, not physics."""

ALIGNED = 1e-9
"""A motion along the tangent below this fraction of what tool and support move by is round-off."""

NEAR = 4.0
"""A candidate within this many lengths of the increment is near its tool: it may close where the prediction is off."""

REACH = 10.0
"""A tool farther from the body than this many sizes of it does not matter to it."""

LEAST_MOTION = 1e-6
"""Of the body's size: the length of an increment in which tools and body rest."""


class DrivenInto(NamedTuple):
    """A tool, a held node in it, and how deep (length, 0 where there is none)."""

    tool: int
    node: int
    depth: float


@dataclass(frozen=True)
class Candidates:
    """Nodes that may touch a tool, tool by tool: ``node``, ``tool``, ``tangent_free`` and coefficient ``mu`` (c,)."""

    scene: Scene
    space: Space
    node: Ints
    tool: Ints
    tangent_free: Bools
    mu: Floats

    @cached_property
    def frames(self) -> Floats:
        """Normal and tangent (c, d, d) of each candidate: those of the tools, which do not turn."""
        return frames(_normals(self.scene))[self.tool]

    def distance(self, nodes: Floats, placed: Floats) -> Floats:
        """Gap (c,) of ``nodes`` (a, 2) to the tools displaced by ``placed`` (k, d), good to its round-off."""
        gap = np.empty(len(self.node))
        for mine, tool, moved in zip(self._owned, self.scene.tools, placed, strict=True):
            gap[mine] = tool.distance(nodes[self.node[mine]], moved)
        return gap

    def reach(self, gap: Floats, travel: Floats) -> float:
        """The longest ``travel`` (k, d) of a tool that may matter to the body: one out of :data:`REACH` is no scale.

        ``gap`` (c,) is that at the end if the body rests.
        """
        near = (self._owned & (gap <= REACH * self.scene.mesh.size)).any(axis=1)
        return float(norm(travel)[near].max(initial=0.0))

    def vectors(self, r: Floats) -> Floats:
        """Contact forces r (c, d) on the body as vectors (c, d)."""
        return np.einsum("ci,cij->cj", r, self.frames)

    def resultant(self, r: Floats) -> Floats:
        """Force (k, d) of each tool on the modelled body from contact forces r (c, d)."""
        return self._owned @ self.vectors(r)

    def load(self, r: Floats) -> Floats:
        """What contact forces r (c, d) do on the free unknowns (n,), whatever the friction."""
        normal, tangent = self._operators
        return normal.T @ r[:, 0] + tangent.T @ r[:, 1]

    def driven_sums(self, values: Floats) -> Floats:
        """Sums (m,) of values (c,) over the candidates of each tool that a force drives."""
        return self._owned[self.scene.by_force] @ values

    @cached_property
    def held(self) -> tuple[Ints, ...]:
        """Tool by tool, the nodes (h,) of its boundaries that are no candidates.

        Supports hold them along its normal, and no force moves the tool along that.
        """
        mesh, owned = self.scene.mesh, zip(self._owned, self.scene.tools, strict=True)
        return tuple(np.setdiff1d(mesh.boundary_nodes(*tool.candidates), self.node[mine]) for mine, tool in owned)

    def driven_into(self, placed: Floats, driven: Floats) -> DrivenInto:
        """The tool that is deepest in a node that supports hold along its normal: no motion gets it out.

        Tools are displaced by ``placed`` (k, d) since rest, held nodes by what is ``driven`` (a, d).
        """
        worst, nodes_at = DrivenInto(0, 0, 0.0), self.scene.mesh.nodes + driven
        for k, (tool, nodes, moved) in enumerate(zip(self.scene.tools, self.held, placed, strict=True)):
            plane, level = tool.offset(moved), nodes_at[nodes] @ np.array(tool.normal)
            # What round-off of the two positions makes of their difference is no depth.
            depth = plane - level - ROUND_OFF * np.maximum(np.abs(level), abs(plane))
            if len(nodes) and depth.max() > worst.depth:
                worst = DrivenInto(k, int(nodes[np.argmax(depth)]), float(depth.max()))
        return worst

    def dragged(self, travel: Floats, driven: Floats) -> Floats:
        """Slips (c,) along the tangent where supports hold or drive it; zero where it is free, or next to normal.

        In an increment of ``travel`` (k, d) of the tools along their paths, of which ``driven`` (a, d) is prescribed.
        """
        moved = self._approach(travel, driven)
        # Against what both move by: that they move together is a difference of round-off.
        lengths = norm(travel)[self.tool] + norm(driven[self.node])
        small = np.abs(moved[:, 1]) <= ALIGNED * lengths
        return np.where(self.tangent_free | small, 0.0, -moved[:, 1])

    def torn(self, start: Touching, travel: Floats, driven: Floats) -> int | None:
        """A node in touch with a welded tool that a support drives off it, or along it; None if there is none.

        ``start`` is where the increment starts, ``travel`` and ``driven`` as in :meth:`dragged`.
        """
        size = self.scene.mesh.size
        along = self._welded & touches(start.gap, size)
        slipping = self.node[along & (self.dragged(travel, driven) != 0)]
        if slipping.size:
            return int(slipping[0])
        for tool, held, placed, moved in zip(self.scene.tools, self.held, start.placed, travel, strict=True):
            apart = norm(_across(tool, driven[held] - moved)) > TOUCHES * size
            near = touches(tool.distance(start.nodes[held], placed), size)
            if tool.welded and (apart & near).any():
                return int(held[apart & near][0])
        return None

    def _approach(self, travel: Floats, driven: Floats) -> Floats:
        """Motion (c, d) of the tools along their paths relative to what is prescribed of the candidates, in their
        frames."""
        return np.vecdot(self.frames, (travel[self.tool] - driven[self.node])[:, None])

    def rows(self, gap: Floats, travel: Floats, driven: Floats) -> ContactRows:
        """Operators of an increment that starts with the gaps (c,); ``travel`` and ``driven`` as in :meth:`dragged`."""
        normal_rows, tangent_rows = self._operators
        moved, mu = self._approach(travel, driven), self.mu
        tied = self._welded & touches(gap, self.scene.mesh.size)
        rubs = self.tangent_free & (mu > 0) & (tied | np.isfinite(mu))
        return ContactRows(
            normal_rows,
            gap - moved[:, 0],
            rows_of(tangent_rows, rubs),
            -moved[rubs, 1:],
            np.flatnonzero(rubs),
            np.where(np.isfinite(mu), mu, np.where(tied, np.inf, 0.0)),
            tied,
        )

    @cached_property
    def _welded(self) -> Bools:
        """Whether the candidate's tool welds (c,)."""
        return np.array([tool.welded for tool in self.scene.tools], dtype=bool)[self.tool]

    @cached_property
    def _owned(self) -> Bools:
        """Whether the candidate is the tool's (k, c)."""
        return np.asarray(self.tool == np.arange(len(self.scene.tools))[:, None])

    @cached_property
    def _operators(self) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Normal and tangential rows of every candidate."""
        return self._operator(self.frames[:, 0]), self._operator(self.frames[:, 1])

    def _operator(self, direction: Floats) -> sp.csr_matrix:
        """Rows ``direction . (dU_node - dU_tool)``, held nodes and tools along their paths apart."""
        dofs = np.column_stack([self.space.position[2 * self.node[:, None] + np.arange(2)], self._translation])
        entries = np.column_stack([direction, -np.vecdot(direction, _directions(self.scene)[self.tool])])
        kept = (dofs >= 0) & (np.abs(entries) > ACROSS * (np.arange(3) == 2))
        ends = np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
        return sp.csr_matrix((entries[kept], dofs[kept], ends), shape=(len(self.node), self.space.size))

    @cached_property
    def _translation(self) -> Ints:
        """The unknown (c,) that is the translation of the candidate's tool, -1 where that goes its path."""
        by_force = self.scene.by_force
        number = np.where(by_force, len(self.space.free) + np.cumsum(by_force) - 1, -1)
        return number.astype(np.intp)[self.tool]


class Touching(NamedTuple):
    """Where an increment starts: gaps (c,), nodes (a, d), and what the tools have ``placed`` (k, d) since rest."""

    gap: Floats
    nodes: Floats
    placed: Floats


def frames(normal: Floats) -> Floats:
    """Frames (…, 2, 2) of normals (…, 2), as rows the normal and the tangent (n_y, -n_x).

    >>> frames(np.array([0.6, 0.8])).tolist()
    [[0.6, 0.8], [0.8, -0.6]]
    """
    return np.stack([normal, normal[..., ::-1] * (1.0, -1.0)], axis=-2)


def force_threshold(r: Floats) -> float:
    """The force up to which a contact force of r (c, d) is none, see :data:`CARRIES`."""
    return CARRIES * float(np.linalg.norm(r, axis=1).max(initial=0.0))


def carries(r: Floats, noise: float = 0.0) -> Bools:
    """Which candidates (c,) push by contact forces r (c, d), of which those up to ``noise`` are none."""
    return r[:, 0] > max(force_threshold(r), noise)


def touches(gap: Floats, size: float) -> Bools:
    """Which gaps (c,) are none in a body of ``size``."""
    return gap <= TOUCHES * size


def near_tools(rows: ContactRows, x: Floats, length: float) -> Bools:
    """Candidates (c,) near their tool, by the ``length`` of the increment, at its displacement x (n,), and those tied.

    At least one where there is any, so that programs have contact rows: an open one changes nothing.
    """
    gap = rows.gap + rows.G_n @ x
    return (gap <= max(NEAR * length, float(gap.min(initial=np.inf)))) | rows.tied


def candidates(scene: Scene, space: Space) -> Candidates:
    """Candidate nodes of every tool that can move along its normal, or it against them; none where there is no tool."""
    owned = [scene.mesh.boundary_nodes(*tool.candidates) for tool in scene.tools]
    node = np.concatenate([np.empty(0, np.intp), *owned])
    tool = np.repeat(np.arange(len(owned)), np.array([len(nodes) for nodes in owned], np.intp))
    mu = [scene.tools[k].mu_at.get(a, scene.tools[k].mu) for k, a in zip(tool.tolist(), node.tolist(), strict=True)]
    normal, tangent = np.moveaxis(frames(_normals(scene))[tool], -2, 0)
    free = space.position[2 * node[:, None] + np.arange(2)] >= 0
    led = _directions(scene)[tool]
    kept, tangent_free = (
        free_along(free, direction) | (np.abs(np.vecdot(led, direction)) > ACROSS) for direction in (normal, tangent)
    )
    return Candidates(scene, space, node[kept], tool[kept], tangent_free[kept], np.array(mu, dtype=np.float64)[kept])


def _directions(scene: Scene) -> Floats:
    """Directions (k, d) along which forces drive the tools; zero where none does."""
    return scene.led(np.ones(len(scene.pushed)))


def _across(tool: FlatTool, motion: Floats) -> Floats:
    """The part of motions (…, d) that a force on the tool does not let go of."""
    if tool.driven_by is None:
        return motion
    direction = tool.driven_by.direction
    return motion - (motion @ direction)[..., None] * direction


def _normals(scene: Scene) -> Floats:
    """Normals (k, d) of the tools."""
    return np.array([tool.normal for tool in scene.tools]).reshape(-1, 2)
