r"""From geometry to affine contact operators: the only place that knows what touches what.

For the increment dU (free unknowns) of one step, per candidate c

    gap at the end        g + G_n dU         (n,)      with g = gap at the start against the tool's end position,
    relative slip         w_t + G_t dU       (d - 1,)  with w_t = minus the tool's tangential motion,

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

    def distance(self, nodes: Floats, tau: float) -> Floats:
        """Gap (c,) of the configuration ``nodes`` (a, 2) to the tools' position at ``tau``, good to its round-off."""
        gap = np.empty(len(self.node))
        for mine, tool in zip(self._owned, self.scene.tools, strict=True):
            gap[mine] = tool.distance(nodes[self.node[mine]], tau)
        return gap

    def travel(self, tau: float, tau_end: float) -> Floats:
        """Displacement (k, d) of each tool from pseudo-time ``tau`` to ``tau_end``."""
        return np.array([tool.moved(tau, tau_end) for tool in self.scene.tools]).reshape(-1, 2)

    def reach(self, gap: Floats, tau: float, tau_end: float) -> float:
        """The longest travel of a tool that may matter to the body: one out of :data:`REACH` is no scale.

        ``gap`` (c,) is that at the end if the body rests.
        """
        near = (self._owned & (gap <= REACH * self.scene.mesh.size)).any(axis=1)
        return float(norm(self.travel(tau, tau_end))[near].max(initial=0.0))

    def length(self, rows: ContactRows, x: Floats, tau: float, tau_end: float) -> float:
        """How far tools go in the increment by x (n,) on ``rows``, or nodes where the tools rest; never zero."""
        moved = max(float(norm(self.space.spread(x)).max()), LEAST_MOTION * self.scene.mesh.size)
        return self.reach(rows.gap, tau, tau_end) or moved

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

    @cached_property
    def held(self) -> tuple[Ints, ...]:
        """Tool by tool, the nodes (h,) of its boundaries that supports hold along its normal."""
        mesh, owned = self.scene.mesh, zip(self._owned, self.scene.tools, strict=True)
        return tuple(np.setdiff1d(mesh.boundary_nodes(*tool.candidates), self.node[mine]) for mine, tool in owned)

    def driven_into(self, tau: float) -> DrivenInto:
        """The tool that at ``tau`` is deepest in a node that supports hold along its normal: no motion gets it out."""
        worst, placed = DrivenInto(0, 0, 0.0), self.scene.mesh.nodes + self.scene.driven(tau)
        for k, (tool, nodes) in enumerate(zip(self.scene.tools, self.held, strict=True)):
            plane, level = tool.offset(tau), placed[nodes] @ np.array(tool.normal)
            # What round-off of the two positions makes of their difference is no depth.
            depth = plane - level - ROUND_OFF * np.maximum(np.abs(level), abs(plane))
            if len(nodes) and depth.max() > worst.depth:
                worst = DrivenInto(k, int(nodes[np.argmax(depth)]), float(depth.max()))
        return worst

    def dragged(self, tau: float, tau_end: float) -> Floats:
        """Slips (c,) along the tangent where supports hold or drive it; zero where it is free, or next to normal."""
        moved, driven = self._approach(tau, tau_end), self.scene.driven(tau_end) - self.scene.driven(tau)
        # Against what both move by: that they move together is a difference of round-off.
        lengths = norm(self.travel(tau, tau_end))[self.tool] + norm(driven[self.node])
        small = np.abs(moved[:, 1]) <= ALIGNED * lengths
        return np.where(self.tangent_free | small, 0.0, -moved[:, 1])

    def torn(self, gap: Floats, nodes: Floats, tau: float, tau_end: float) -> int | None:
        """A node in touch with a welded tool that a support drives off it, or along it; None if there is none."""
        size, driven = self.scene.mesh.size, self.scene.driven(tau_end) - self.scene.driven(tau)
        along = np.array([tool.welded for tool in self.scene.tools], dtype=bool)[self.tool] & touches(gap, size)
        slipping = self.node[along & (self.dragged(tau, tau_end) != 0)]
        if slipping.size:
            return int(slipping[0])
        for tool, held in zip(self.scene.tools, self.held, strict=True):
            apart = norm(driven[held] - tool.moved(tau, tau_end)) > TOUCHES * size
            near = touches(tool.distance(nodes[held], tau), size)
            if tool.welded and (apart & near).any():
                return int(held[apart & near][0])
        return None

    def _approach(self, tau: float, tau_end: float) -> Floats:
        """Motion (c, d) of the tools relative to what is prescribed of the candidates, in their frames."""
        driven = self.scene.driven(tau_end) - self.scene.driven(tau)
        return np.vecdot(self.frames, (self.travel(tau, tau_end)[self.tool] - driven[self.node])[:, None])

    def rows(self, gap: Floats, tau: float, tau_end: float) -> ContactRows:
        """Operators of the increment from ``tau`` to ``tau_end`` that starts with the gaps (c,)."""
        normal_rows, tangent_rows = self._operators
        moved, mu = self._approach(tau, tau_end), self.mu
        welded = np.array([tool.welded for tool in self.scene.tools], dtype=bool)[self.tool]
        tied = welded & touches(gap, self.scene.mesh.size)
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
    def _owned(self) -> Bools:
        """Whether the candidate is the tool's (k, c)."""
        return np.asarray(self.tool == np.arange(len(self.scene.tools))[:, None])

    @cached_property
    def _operators(self) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Normal and tangential rows of every candidate."""
        return self._operator(self.frames[:, 0]), self._operator(self.frames[:, 1])

    def _operator(self, direction: Floats) -> sp.csr_matrix:
        """Rows ``direction . dU_node`` on the free unknowns (held ones do not move)."""
        dofs = self.space.position[2 * self.node[:, None] + np.arange(2)]
        kept = (dofs >= 0) & (direction != 0)
        ends = np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
        return sp.csr_matrix((direction[kept], dofs[kept], ends), shape=(len(self.node), self.space.size))


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
    """Candidate nodes of every tool whose normal motion is free, tool by tool; none where there is no tool."""
    owned = [scene.mesh.boundary_nodes(*tool.candidates) for tool in scene.tools]
    node = np.concatenate([np.empty(0, np.intp), *owned])
    tool = np.repeat(np.arange(len(owned)), np.array([len(nodes) for nodes in owned], np.intp))
    mu = [scene.tools[k].mu_at.get(a, scene.tools[k].mu) for k, a in zip(tool.tolist(), node.tolist(), strict=True)]
    normal, tangent = np.moveaxis(frames(_normals(scene))[tool], -2, 0)
    free = space.position[2 * node[:, None] + np.arange(2)] >= 0
    kept, tangent_free = free_along(free, normal), free_along(free, tangent)
    return Candidates(scene, space, node[kept], tool[kept], tangent_free[kept], np.array(mu, dtype=np.float64)[kept])


def _normals(scene: Scene) -> Floats:
    """Normals (k, d) of the tools."""
    return np.array([tool.normal for tool in scene.tools]).reshape(-1, 2)
