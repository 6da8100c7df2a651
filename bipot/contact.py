r"""From geometry to affine contact operators: the only place that knows what touches what.

For the increment dU (free unknowns) of one step, per candidate c

    gap at the end        g + G_n dU         (n,)      with g = gap at the start against the tool's end position,
    relative slip         w_t + G_t dU       (d - 1,)  with w_t = minus the tool's tangential motion,

both relative to the tool, n from the tool into the body. Dual to them are the contact *forces* (r_n, r_t).
Friction rows exist only where the tangent is free and the tool has friction.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bipot.fem.assembly import Space
from bipot.programs.data import ContactRows, rows_of
from bipot.scene import Scene

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]


ROUND_OFF = 8 * float(np.finfo(float).eps)


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

    def distance(self, nodes: Floats, tau: float) -> Floats:
        """Gap (c,) of the configuration ``nodes`` (a, 2) to the tools' position at ``tau``, good to its round-off."""
        gap = np.empty(len(self.node))
        for k, tool in enumerate(self.scene.tools):
            mine = self.tool == k
            gap[mine] = nodes[self.node[mine]] @ np.array(tool.normal) - tool.offset(tau)
        return gap

    def load(self, r: Floats) -> Floats:
        """What contact forces r (c, d) do on the free unknowns (n,), whatever the friction."""
        normal, tangent = self._operators
        return normal.T @ r[:, 0] + tangent.T @ r[:, 1]

    @cached_property
    def held(self) -> tuple[tuple[Ints, Floats], ...]:
        """Tool by tool, the nodes (h,) of its boundaries that supports hold along its normal, and n . x there (h,)."""
        out = list[tuple[Ints, Floats]]()
        for k, tool in enumerate(self.scene.tools):
            nodes = np.setdiff1d(self.scene.mesh.boundary_nodes(*tool.candidates), self.node[self.tool == k])
            out.append((nodes, self.scene.mesh.nodes[nodes] @ np.array(tool.normal)))
        return tuple(out)

    def driven_into(self, tau: float) -> DrivenInto:
        """The tool that at ``tau`` is deepest in a node that supports hold along its normal: no motion gets it out."""
        worst = DrivenInto(0, 0, 0.0)
        for k, (tool, (nodes, level)) in enumerate(zip(self.scene.tools, self.held, strict=True)):
            plane = tool.offset(tau)
            # What round-off of the two positions makes of their difference is no depth.
            depth = plane - level - ROUND_OFF * np.maximum(np.abs(level), abs(plane))
            if len(nodes) and depth.max() > worst.depth:
                worst = DrivenInto(k, int(nodes[np.argmax(depth)]), float(depth.max()))
        return worst

    def rows(self, gap: Floats, tau: float, tau_end: float) -> ContactRows:
        """Operators of the increment from ``tau`` to ``tau_end`` that starts with the gaps (c,)."""
        tools, (normal_rows, tangent_rows) = self.scene.tools, self._operators
        travel = np.array([tool.moved(tau, tau_end) for tool in tools])[self.tool]
        normal, tangent = self._axes
        mu = self.mu
        welded = np.array([tool.welded for tool in tools])[self.tool]
        tied = welded & (gap <= _closed_tolerance(self.scene))
        rubs = self.tangent_free & (mu > 0) & (tied | np.isfinite(mu))
        slip = -np.vecdot(tangent, travel)[rubs]
        return ContactRows(
            normal_rows,
            gap - np.vecdot(normal, travel),
            rows_of(tangent_rows, rubs),
            slip[:, None],
            np.flatnonzero(rubs),
            np.where(np.isfinite(mu), mu, np.where(tied, np.inf, 0.0)),
            tied,
        )

    @cached_property
    def _axes(self) -> tuple[Floats, Floats]:
        """Normal and tangent (c, 2): those of the tools, which do not turn."""
        normal = np.array([tool.normal for tool in self.scene.tools])[self.tool]
        return normal, np.column_stack([normal[:, 1], -normal[:, 0]])

    @cached_property
    def _operators(self) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Normal and tangential rows of every candidate."""
        normal, tangent = self._axes
        return self._operator(self.node, normal), self._operator(self.node, tangent)

    def _operator(self, node: Ints, direction: Floats) -> sp.csr_matrix:
        """Rows ``direction . dU_node`` on the free unknowns (held ones do not move)."""
        dofs = self.space.position[2 * node[:, None] + np.arange(2)]
        kept = (dofs >= 0) & (direction != 0)
        ends = np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
        return sp.csr_matrix((direction[kept], dofs[kept], ends), shape=(len(node), self.space.size))


def _closed_tolerance(scene: Scene) -> float:
    """A welded point counts as touching below this gap: round-off of the geometry, not physics."""
    return 1e-9 * scene.mesh.size


def candidates(scene: Scene, space: Space) -> Candidates:
    """Candidate nodes of every tool whose normal motion is free."""
    node, owner, tangent_free, mu = [], [], [], []
    for k, tool in enumerate(scene.tools):
        mine = scene.mesh.boundary_nodes(*tool.candidates)
        free = space.position[2 * mine[:, None] + np.arange(2)] >= 0
        movable = _free_along(free, tool.normal)
        mine, free = mine[movable], free[movable]
        node.append(mine)
        owner.append(np.full(len(mine), k))
        tangent_free.append(_free_along(free, (tool.normal[1], -tool.normal[0])))
        mu.append(np.array([tool.mu_at.get(int(a), tool.mu) for a in mine], dtype=np.float64))
    return Candidates(scene, space, *(np.concatenate(part) for part in (node, owner, tangent_free, mu)))


def _free_along(free: Bools, direction: tuple[float, float]) -> Bools:
    """Whether a node with free components (c, 2) can move along ``direction``."""
    return np.asarray((free & (np.abs(direction) > 1e-12)).any(axis=1))
