r"""How far tools take along a body that supports leave free: what one tool meets rides on the others.

Tool j takes along what touches it where the increment starts. Its points there go m_c along its path and as it turns;
beyond a way v of the body it takes along

    v_j(v) = mean_c n (n . m)+,    m = m_c - v,

(1 - n n') m besides where friction holds all points that push, and all of m where it is welded, by the mean over its
points that push, weighted by r_n, or over all of the whole body if none does. A body that tool k meets is taken along
by the others, beyond the way v_s of the supports by

    v_1 = N N' V(v_s),        v_1 + 1/2 N N' V(v_s + v_1),        V(v) = sum_j |v_j| v_j / sum_j |v_j|,

with N the directions in which no support and no plane of symmetry holds anything. It is the way of the one tool that
pushes, as far as no other is in the way, the mean of both ways of two that squeeze, and none where all rest or recede.
Mirror images of tools beyond planes of symmetry are tools, too.

What forces and moments make of a tool's way is not known before the increment is solved, and takes nothing along.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bipot.contact.candidates import Candidates
from bipot.contact.closeness import carries, touches
from bipot.response import State
from bipot.tensors import norm
from bipot.typing import Bools, Floats

HOLDS = 1e-6
"""Friction farther below its limit than this fraction of the largest contact force holds its point: no more than that
does the certificate's law leave undecided."""


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
        count, out = len(self.candidates.scene.tools), np.zeros((len(self.candidates.scene.tools), len(free)))
        alone = self._taken_along(np.zeros(len(free)))
        for k in range(count):
            once = self._by_others(alone, k) @ free @ free.T
            out[k] = once + self._by_others(self._taken_along(once), k) @ free @ free.T / 2
        return out

    def _by_others(self, own: Floats, k: int) -> Floats:
        """V (d,) of tools that take along ``own`` (k, d), as the k-th meets it: of its own images it is not one."""
        weights = norm(own) * (self._images - (np.arange(len(own)) == k))
        total = float(weights.sum())
        return weights @ own / total if total > 0 else np.zeros(own.shape[1])

    def _taken_along(self, way: Floats) -> Floats:
        """v_j (k, d) of each tool beyond a ``way`` (d,), zero where it touches nothing."""
        along, out = self._along(self.motion - way), np.zeros((len(self._weights), len(way)))
        for own, weight in zip(out, self._weights, strict=True):
            if weight.any():
                own[:] = weight @ along / weight.sum()
        return out

    @cached_property
    def _weights(self) -> Floats:
        """Of the means over the points of each tool (k, w)."""
        contacts, r = self.candidates, self.start.forces
        touching = touches(self.start.gap, contacts.scene.mesh.size)
        own = contacts.tool == np.arange(len(contacts.scene.tools))[:, None]
        pushing = own & touching & carries(r)
        share = np.where(pushing.any(axis=1, keepdims=True), pushing * r[:, 0], (own & touching) * contacts.share)
        return np.abs(contacts.parts.weight) * share[:, contacts.parts.owner]

    def _along(self, motion: Floats) -> Floats:
        """What each part is taken along by (w, d) as the tool goes this ``motion`` (w, d) under it."""
        owner, towards = self.candidates.parts.owner, np.vecdot(self.normal, motion)[:, None]
        across = np.where(self._held[owner, None], motion - towards * self.normal, 0.0)
        pushed = np.where(towards > 0, towards * self.normal, 0.0)
        return np.where(self.candidates.welded[owner, None], motion, pushed + across)

    @cached_property
    def _held(self) -> Bools:
        """Candidates (c,) of tools of which friction holds all points that push where it starts, caps aside."""
        contacts, r = self.candidates, self.start.forces
        mu, tools = np.where(np.isfinite(contacts.mu), contacts.mu, 0.0), np.arange(len(contacts.scene.tools))
        slides = norm(r[:, 1:]) >= mu * r[:, 0] - HOLDS * float(norm(r).max(initial=0.0))
        own = contacts.tool == tools[:, None]
        holds = (own & carries(r)).any(axis=1) & ~(own & carries(r) & slides).any(axis=1)
        return np.asarray(holds[contacts.tool])

    @cached_property
    def _images(self) -> Floats:
        """How many tools (k,) of the whole body each one is, with its mirror images."""
        scene = self.candidates.scene
        return np.array([2.0 ** sum(not plane.cuts(tool) for plane in scene.planes) for tool in scene.tools])
