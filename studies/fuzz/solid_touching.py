"""Points at tools in space in an increment, and the law of friction on discs of two tangents, by the fuzz study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from bipot.typing import Bools, Floats, Ints, einsum
from studies.independent.candidates import CARRIES
from studies.independent.contact import HOLDS, touching_part


@dataclass(frozen=True)
class Touching:
    """Candidates (c,) of an increment at a ``node``, with their ``tool``, and w nodes that they are means of.

    ``gap`` (c,) is that of the end, ``opened`` (c,) what it grew by, ``blur`` (c,) its round-off, ``places`` (c,) that
    of positions and ``unsure`` (c,) the lengths that a slip is a difference of; ``slip`` (c, 2) is zero where friction
    is of no unknown, ``cap`` (c,) what the shear yield stress lets it carry at the end and ``cap_before`` (c,) at the
    start, inf where none is. Where supports hold
    both tangents ``dragged`` (c, 2) is what the tool slips by along them. Of slips and friction planes of symmetry
    leave ``kept`` (c, 2, 2). Points ``follow`` (c,) their tool along its normal at the start, beyond what
    carries them, from a gap ``before`` (c,), and slip from one ``left`` (c,). Some start ``apart`` from a tool that is
    not flat, or end ``past`` its open end. Points go ``passing`` (c,) an end of
    another part in touch with it for this part of their slips, zero where they do not.

    Node by node, ``owner`` (w,) is the candidate, ``part`` (w,) the node, ``share`` (w,) its weight; ``frames`` (w, 3,
    3) and ``begun`` (w, 3, 3) are what gap and slip change by as it moves, at the end and the start: by rows the
    normal, and tangents longer or shorter off a curved tool. ``motion`` (w, 3) is that of the tool's point under it.
    ``inside`` is how deep nodes held along the normal are in tools.
    """

    node: Ints
    tool: Ints
    mu: Floats
    cap: Floats
    cap_before: Floats
    tied: Bools
    gap: Floats
    opened: Floats
    blur: Floats
    places: Floats
    unsure: Floats
    slip: Floats
    dragged: Floats
    kept: Floats
    follow: Floats
    before: Floats
    apart: Bools
    left: Floats
    past: Bools
    passing: Floats
    owner: Ints
    part: Ints
    share: Floats
    frames: Floats
    begun: Floats
    motion: Floats
    inside: float

    @staticmethod
    def joined(found: Sequence[Touching]) -> Touching:
        """Those of all tools, one behind the other."""
        first = np.cumsum([0, *(len(f.node) for f in found)])
        every = {
            f.name: np.concatenate([getattr(own, f.name) for own in found])
            for f in fields(Touching)
            if f.name != "inside"
        }
        every["owner"] = np.concatenate([own.owner + at for own, at in zip(found, first[:-1].tolist(), strict=True)])
        return Touching(**every, inside=max(own.inside for own in found))

    def vectors(self, r: Floats) -> Floats:
        """What nodes (w, 3) take of forces r (c, 3), one by one."""
        return self._taken(r, self.frames)

    def start_vectors(self, r: Floats) -> Floats:
        """The same of forces r (c, 3) of the start."""
        return self._taken(r, self.begun)

    def _taken(self, r: Floats, frames: Floats) -> Floats:
        left = np.column_stack([r[:, :1], einsum("cij,cj->ci", self.kept, r[:, 1:])])
        return self.share[:, None] * einsum("wi,wij->wj", left[self.owner], frames)

    def on_nodes(self, vectors: Floats, count: int) -> Floats:
        """Sums (count, ...) over nodes of what they take (w, ...), one by one."""
        out = np.zeros((count, *vectors.shape[1:]))
        np.add.at(out, self.part, vectors)
        return out

    def sums(self, values: Floats) -> Floats:
        """Sums (c,) of the values (w,) of their nodes."""
        return np.asarray(np.bincount(self.owner, values, len(self.node)), np.float64)

    def at_most(self, sizes: Floats) -> Floats:
        """What means (c,) of values of these ``sizes`` (w,) are summed of."""
        return self.sums(np.abs(self.share) * sizes)

    def rubbed(self, r: Floats) -> Floats:
        """Forces r (c, 3) of the end with the friction of tools on what supports hold."""
        return self._rubbed(r, self.cap)

    def start_rubbed(self, r: Floats) -> Floats:
        """The same of forces r (c, 3) of the start."""
        return self._rubbed(r, self.cap_before)

    def _rubbed(self, r: Floats, cap: Floats) -> Floats:
        out, size = r.copy(), np.linalg.norm(self.dragged, axis=1, keepdims=True)
        out[:, 1:] -= self._most(r, cap)[:, None] * self.dragged / np.where(size > 0, size, 1.0)
        return out

    def not_yet(self, before: Floats, after: Floats) -> Floats:
        """Work (c,) on the slip that friction of forces ``before`` (c, 3) does not do but would if it slid.

        It would be at its limit against the slip of unknowns; who is held ``after`` (c, 3), well within the limit, does
        not slide, nor who is tied.
        """
        holds = HOLDS * float(np.linalg.norm(after, axis=1).max(initial=0.0))
        slides = ~self.tied & (np.linalg.norm(after[:, 1:], axis=1) >= self.most(after) - holds)
        sliding = self._most(before, self.cap_before) * np.linalg.norm(self.slip, axis=1)
        return np.where(slides, sliding + np.vecdot(before[:, 1:], self.slip), 0.0)

    def not_in_air(self, size: float) -> Floats:
        """The part (c,) of slips along which points touch, in a body of the ``size``, as in the plane."""
        return np.maximum(touching_part(self.left, self.before, self.gap, self.follow, size), self.passing)

    def most(self, r: Floats) -> Floats:
        """Largest friction (c,) under forces r (c, 3) of the end."""
        return self._most(r, self.cap)

    def _most(self, r: Floats, cap: Floats) -> Floats:
        """Largest friction (c,) below a ``cap``; without a coefficient the cap where a point carries at all."""
        carries = r[:, 0] > CARRIES * float(np.linalg.norm(r, axis=1).max(initial=0.0))
        constant, finite = np.isinf(self.mu) & np.isfinite(cap), np.isfinite(self.mu)
        by_pressure = np.where(finite, np.where(finite, self.mu, 0.0) * r[:, 0], 0.0)
        return np.where(constant, np.where(carries, cap, 0.0), np.minimum(by_pressure, cap))

    def off(self, r: Floats, rho: Floats) -> Floats:
        """How far (c,) forces r (c, 3) are from the law, lengths made forces by rho (c,)."""
        mu = np.where(np.isinf(self.mu) | (self.dragged != 0).any(axis=1), 0.0, self.mu)
        u = np.column_stack([self.gap + mu * np.linalg.norm(self.slip, axis=1), self.slip])
        cut = self._cut(r, rho)
        off = np.where(np.isinf(self.cap), np.linalg.norm(r - projected(r - rho[:, None] * u, mu), axis=1), cut)
        rests = rho * np.linalg.norm(np.column_stack([self.gap, self.slip]), axis=1)
        return np.where(self.tied, rests, off)

    def _cut(self, r: Floats, rho: Floats) -> Floats:
        """How far (c,) forces are from the law with a cap: r_n = (r_n - rho gap)+, r_t in the disc of that radius."""
        free = (self.dragged == 0).all(axis=1)
        most = np.where(free, np.maximum(self.most(r), 0.0), 0.0)
        pull = r[:, 1:] - rho[:, None] * self.slip
        length = np.linalg.norm(pull, axis=1)
        shrink = np.minimum(most / np.where(length > 0, length, 1.0), 1.0)
        normal = r[:, 0] - np.maximum(r[:, 0] - rho * self.gap, 0.0)
        return np.hypot(normal, np.linalg.norm(r[:, 1:] - shrink[:, None] * pull, axis=1))


def projected(p: Floats, mu: Floats) -> Floats:
    """Nearest point of the cones |p_t| <= mu p_n, by their three cases.

    >>> projected(np.array([[1.0, 0.0, 3.0]]), np.array([1.0])).tolist()
    [[2.0, 0.0, 2.0]]
    """
    length = np.linalg.norm(p[:, 1:], axis=1)
    edge = np.maximum((p[:, 0] + mu * length) / (1 + mu**2), 0.0)
    way = p[:, 1:] / np.where(length > 0, length, 1.0)[:, None]
    inside = (length <= mu * p[:, 0]) & (p[:, 0] >= 0)
    return np.where(inside[:, None], p, np.column_stack([edge, (mu * edge)[:, None] * way]))
