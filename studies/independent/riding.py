"""How far the tools that touch a body take it along where its supports leave it free: nothing of the library.

Of tool j each point that touches at the start takes along v: what its tool goes towards the body along the normal,
what it goes across it where friction holds all points that push, and all that it goes where it is welded. v_j is the
mean by the forces that push, or over all points of the whole body if none does. What tool k meets goes by the mean of
the v_j of the other tools, mirror images included, each counted as often as it is long; then by half of the same mean
of what the tools go beyond that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.contact import HOLDS, TOUCHING
from studies.independent.data import CARRIES
from studies.independent.element import Bools, Floats, Ints


@dataclass(frozen=True)
class Ride:
    """Candidates (c,) with their ``tool``, ``gap``, ``mu``, forces r (c, d) at the start, and who is ``welded``.

    They are means of nodes (w,): ``owner``, ``share``, the ``normal`` (w, d) and the way ``goes`` (w, d) of the tool
    under it, beyond that of the supports. ``part`` (c,) is what each is of a point of the whole body, ``images`` (k,)
    are how many tools of the whole body each one is, ``held`` (s, d) directions in which supports or planes hold the
    body.
    """

    tool: Ints
    gap: Floats
    mu: Floats
    welded: Bools
    r: Floats
    owner: Ints
    share: Floats
    normal: Floats
    goes: Floats
    part: Floats
    images: Floats
    held: Floats

    def ways(self, size: float) -> Floats:
        """Translations (k, d) of what tools meet, of a body of the ``size``."""
        out = np.zeros((len(self.images), self.r.shape[1]))
        for k, way in enumerate(out):
            for part in (1.0, 0.5):
                way += part * self._others(k, way.copy(), size)
        return out

    def _others(self, k: int, way: Floats, size: float) -> Floats:
        """Their mean beyond a ``way`` (d,), where the body is free."""
        total, out = 0.0, np.zeros(len(way))
        for j, images in enumerate(self.images.tolist()):
            own = self._of(j, way, size)
            often = (images - (j == k)) * float(np.linalg.norm(own))
            out += often * own
            total += often
        out /= total or 1.0
        return out - out @ np.linalg.pinv(self.held, rcond=1e-9) @ self.held

    def _of(self, k: int, way: Floats, size: float) -> Floats:
        """v_k of what the tool goes beyond a ``way`` (d,)."""
        near = (self.tool == k) & (self.gap <= TOUCHING * size)
        largest = float(np.linalg.norm(self.r, axis=1).max(initial=0.0))
        pushing = near & (self.r[:, 0] > CARRIES * largest)
        weight = self.r[:, 0] * pushing if pushing.any() else self.part * near
        friction = np.linalg.norm(self.r[:, 1:], axis=1)
        holds = friction < np.where(np.isinf(self.mu), 0.0, self.mu) * self.r[:, 0] - HOLDS * largest
        pushes = (self.tool == k) & (self.r[:, 0] > CARRIES * largest)
        held = bool(pushes.any() and holds[pushes].all())
        total, out = 0.0, np.zeros(self.r.shape[1])
        for c, share, n, m in zip(
            self.owner.tolist(), np.abs(self.share).tolist(), self.normal, self.goes - way, strict=True
        ):
            towards = float(n @ m)
            v = m if self.welded[c] else max(towards, 0.0) * n + held * (m - towards * n)
            out += share * float(weight[c]) * v
            total += share * float(weight[c])
        return out / (total or 1.0)
