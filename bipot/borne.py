r"""How far tools take along a body that supports leave free: what one tool meets rides on the others.

Tool j takes along what touches it where the increment starts. Its points there go m_c along its path and as it turns;
beyond the way v_0 of the supports it takes along

    v_j = mean_c [n (n . m)+  +  (1 - n n') m  where friction holds],    m = m_c - v_0,

all of m where it is welded, by the mean over its points that push, weighted by r_n, or over all if none does. A body
that tool k meets is taken along by the others,

    N N' sum_j |v_j| v_j / sum_j |v_j|,

with N the directions in which no support and no plane of symmetry holds anything. It is the way of the one tool that
moves and pushes, none where all rest or recede, and none between two that squeeze alike. Mirror images of tools beyond
planes of symmetry are tools, too.

What forces and moments make of a tool's way is not known before the increment is solved, and takes nothing along.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.contact.candidates import Candidates
from bipot.contact.closeness import carries, touches
from bipot.response import State
from bipot.tensors import norm
from bipot.typing import Bools, Floats

HOLDS = 1e-6
"""Friction farther below its limit than this fraction of the largest contact force holds its point."""


@dataclass(frozen=True)
class Riding:
    """What rides on the tools of the ``candidates`` from the state ``start`` on, where they have normals n (w, d).

    Parts of candidates meet points of the tools that go ``motion`` (w, d), beyond the way of the supports.
    """

    candidates: Candidates
    start: State
    normal: Floats
    motion: Floats

    def ways(self, free: Floats) -> Floats:
        """Translation (k, d) of the body by the other tools, as each tool meets it, along the ``free`` (d, m)."""
        own, images = self._taken_along(), self._images()
        each = norm(own) * images
        weights = np.tile(each, (len(own), 1))
        # Of its own images a tool is not one itself.
        np.fill_diagonal(weights, norm(own) * (images - 1))
        total = weights.sum(axis=1, keepdims=True)
        return np.divide(weights @ own, total, out=np.zeros_like(own), where=total > 0) @ free @ free.T

    def _taken_along(self) -> Floats:
        """v_j (k, d) of each tool, zero where it touches nothing."""
        contacts, r = self.candidates, self.start.forces
        owner, touching = contacts.parts.owner, touches(self.start.gap, contacts.scene.mesh.size)
        pushes, out = touching & carries(r), np.zeros((len(contacts.scene.tools), self.motion.shape[1]))
        along = self._along()
        for k in range(len(out)):
            mine = contacts.tool == k
            some = bool((mine & pushes).any())
            share = np.where(mine & pushes, r[:, 0], 0.0) if some else (mine & touching).astype(np.float64)
            weight = np.abs(contacts.parts.weight) * share[owner]
            if weight.any():
                out[k] = weight @ along / weight.sum()
        return out

    def _along(self) -> Floats:
        """What each part is taken along by (w, d)."""
        owner = self.candidates.parts.owner
        pushed = np.vecdot(self.normal, self.motion)[:, None] * self.normal
        welded, held = self.candidates.welded[owner], self._held()[owner]
        by = np.where((np.vecdot(self.normal, self.motion) > 0)[:, None], pushed, 0.0)
        by = by + np.where(held[:, None], self.motion - pushed, 0.0)
        return np.where(welded[:, None], self.motion, by)

    def _held(self) -> Bools:
        """Candidates (c,) that friction holds where the increment starts, caps aside."""
        r, mu = self.start.forces, np.where(np.isfinite(self.candidates.mu), self.candidates.mu, 0.0)
        return norm(r[:, 1:]) < mu * r[:, 0] - HOLDS * float(norm(r).max(initial=0.0))

    def _images(self) -> Floats:
        """How many tools (k,) of the whole body each one is, with its mirror images."""
        scene = self.candidates.scene
        return np.array([2.0 ** sum(not plane.cuts(tool) for plane in scene.planes) for tool in scene.tools])
