"""How far the tools that touch a body take it along where its supports leave it free: nothing of the library.

Of tool j each point that touches at the start takes along v: what its tool goes towards the body along the normal,
what it goes across it where friction holds all points that push, and all that it goes where it is welded. v_j is the
mean by the forces that push, or over all points of the whole body if none does. What tool k meets goes by the mean of
the v_j of the other tools, mirror images included, each counted as often as it is long; then by half of the same mean
of what the tools go beyond that.

Where one tool alone touches it besides k, the body turns with that about its centre and the rest is a translation: by
all of the turn where it is welded at places apart, or held by friction on a plane while k touches nothing; else, where
held by friction, by what of the turn is about the mean normal. Several tools that hold it from more sides than one and
turn by the same about places near by do so by all of that. So it does if others that touch hold it on the axis alone,
or do not hold it, and their gaps stay as it turns. Supports and planes of symmetry must hold the body along no
direction but the axis; a mirror image then turns as its tool does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from studies.independent.candidates import CARRIES
from studies.independent.contact import HOLDS, TOUCHING
from studies.independent.element import Bools, Floats, Ints

SAME, TINY = 1e-9, 1e-300
"""Directions that differ by less are one; lengths that are none."""

BESIDE = 0.5
"""Of the distance of what a tool holds from its axis: tools whose axes are no farther apart turn about one place."""

ONE_SIDE = 0.9
"""Length of the mean of unit normals of tools that are all on one side."""

SLIGHT = 1e-3
"""Of the farthest way of a turn: what less than that is in its way gives way."""


@dataclass(frozen=True)
class Ride:
    """Candidates (c,) with their ``tool``, ``gap``, ``mu``, forces r (c, d) at the start, and who is ``welded``.

    They are means of nodes (w,): ``owner``, ``share``, the ``normal`` (w, d) and the way ``goes`` (w, d) of the tool
    under it, beyond that of the supports. ``part`` (c,) is what each is of a point of the whole body, ``images`` (k,)
    are how many tools of the whole body each one is, ``held`` (s, d) directions in which supports or planes hold the
    body. The tools that are not ``flat`` (k,) have a curved face; they are to turn by ``turns`` (k, 3), by path, about
    their ``centre`` (k, d) at the start, and nodes are at ``place`` (w, d). ``gaps(k, x)`` are those of places x (m, d)
    to the k-th tool at the start.
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
    place: Floats
    centre: Floats
    turns: Floats
    flat: Bools
    gaps: Callable[[int, Floats], Floats]

    def ways(self, size: float) -> list[Ridden]:
        """How what tools (k,) meet goes, of a body of the ``size``."""
        out = []
        for k in range(len(self.images)):
            turning, spun = self._turned(k, size)
            own = turning[self.tool[self.owner]][:, None]
            left = replace(self, goes=self.goes - own * spun.after(self.place, np.ones((len(self.place), 1))))
            way = np.zeros(self.r.shape[1])
            for part in (1.0, 0.5):
                way += part * left._others(k, way.copy(), size)
            out.append(replace(spun, way=way))
        return out

    def _turned(self, k: int, size: float) -> tuple[Bools, Ridden]:
        """Which tools turn what the k-th meets, and how it goes with their turn, or rests."""
        touches = np.array([self._near(j, size).any() for j in range(len(self.images))])
        often = np.where(touches, self.images, 0.0)
        often[k] = max(often[k] - 1.0, 0.0)
        alone = often.sum() == 1.0 and not touches[k]
        turns = {rolls: [self._turns_by(j, size, rolls) for j in range(len(often))] for rolls in (False, True)}
        for j in np.flatnonzero(often > 0).tolist():
            for rolls, spins in turns.items():
                spun = Ridden(np.zeros(len(self.centre[j])), self.centre[j], spins[j])
                alike = np.abs(np.array(spins) - spins[j]).max(axis=1) <= SAME * np.abs(spins[j]).max()
                alike &= (often > 0) & self._near_by(j, spins[j], size)
                welds = bool(self.welded[self.tool == j].all())
                firm = rolls or welds or self._gripped(alike * often, size) or (alone and self.flat[j])
                rest = np.flatnonzero((often > 0) & ~alike).tolist()
                held = firm and spins[j].any() and self._apart(alike, spins[j], size) > SAME * size
                if held and all(self._glides(i, spun, size) for i in rest):
                    return alike, spun
        nowhere = np.zeros(len(self.held[0]))
        return np.zeros(len(often), dtype=bool), Ridden(nowhere, nowhere, np.zeros(3))

    def _turns_by(self, j: int, size: float, rolls: bool) -> Floats:
        """The turn (3,) by which the j-th tool takes the body along, if that ``rolls`` on it or not, or none."""
        none, weight = np.zeros(3), self._weight(j, size)[self.owner] * np.abs(self.share)
        welds, turn = bool(self.welded[self.tool == j].all()), self.turns[j]
        if not turn.any() or not weight.any() or (not welds and not self._holds(j)):
            return none
        if rolls and not welds:
            normal = _in_space(weight @ self.normal)
            turn = normal * (turn @ normal) / max(float(normal @ normal), TINY)
        axis = turn / max(float(np.linalg.norm(turn)), TINY)
        return turn if np.abs(np.cross(_in_space(self.held), axis)).max(initial=0.0) <= SAME else none

    def _gripped(self, often: Floats, size: float) -> bool:
        """Whether normals of tools, as ``often`` (k,) as they are with images, are not all on one side."""
        total = np.zeros(self.place.shape[1])
        for i in np.flatnonzero(often).tolist():
            mean = (self._weight(i, size)[self.owner] * np.abs(self.share)) @ self.normal
            mean = mean / max(float(np.linalg.norm(mean)), TINY)
            # With its image the part along what holds the body, here the axis alone, is cancelled.
            along = mean @ np.linalg.pinv(self.held, rcond=1e-9) @ self.held
            total += often[i] * (mean - along if often[i] > 1 else mean)
        return bool(often.sum() > 1 and np.linalg.norm(total) <= ONE_SIDE * often.sum())

    def _near_by(self, j: int, turn: Floats, size: float) -> Bools:
        """Which tools (k,) turn about places nearer to that of the j-th than half as far as they hold the body."""
        axis, out = turn / max(float(np.linalg.norm(turn)), TINY), np.zeros(len(self.images), dtype=bool)
        for i, centre in enumerate(self.centre):
            held = self.place[(self._weight(i, size)[self.owner] > 0) & (self.share != 0)]
            reach = np.linalg.norm(np.cross(_in_space(held - centre), axis), axis=1).max(initial=0.0)
            out[i] = i == j or np.linalg.norm(np.cross(_in_space(centre - self.centre[j]), axis)) <= BESIDE * reach
        return out

    def _apart(self, chosen: Bools, turn: Floats, size: float) -> float:
        """How far apart across a ``turn`` (3,) is what the ``chosen`` tools (k,) take along."""
        weights = [self._weight(j, size)[self.owner] * np.abs(self.share) for j in np.flatnonzero(chosen).tolist()]
        own = _in_space(self.place[(np.array(weights) > 0).any(axis=0)])
        return float(np.abs(np.cross(own - own.mean(axis=0), turn / np.linalg.norm(turn))).max(initial=0.0))

    def _glides(self, i: int, spun: Ridden, size: float) -> bool:
        """Whether the i-th tool lets the body be ``spun``: that moves nothing that it holds, or else changes no gap."""
        met = (self._weight(i, size)[self.owner] > 0) & (self.share != 0)
        gone = spun.after(self.place, np.ones((len(self.place), 1)))
        place, most = self.place[met], float(np.linalg.norm(gone, axis=1).max())
        if self._holds(i) or bool(self.welded[self.tool == i].any()):
            off = np.linalg.norm(gone[met], axis=1)
        else:
            off = np.abs(self.gaps(i, place + gone[met]) - self.gaps(i, place))
        return bool((off <= SLIGHT * most).all())

    def _near(self, k: int, size: float) -> Bools:
        return (self.tool == k) & (self.gap <= TOUCHING * size)

    @property
    def _largest(self) -> float:
        return float(np.linalg.norm(self.r, axis=1).max(initial=0.0))

    def _weight(self, k: int, size: float) -> Floats:
        """Weights (c,) of points in the means of a tool."""
        near = self._near(k, size)
        pushing = near & (self.r[:, 0] > CARRIES * self._largest)
        return self.r[:, 0] * pushing if pushing.any() else self.part * near

    def _holds(self, k: int) -> bool:
        """Whether friction holds all points of a tool that push, and any does."""
        friction = np.linalg.norm(self.r[:, 1:], axis=1)
        holds = friction < np.where(np.isinf(self.mu), 0.0, self.mu) * self.r[:, 0] - HOLDS * self._largest
        pushes = (self.tool == k) & (self.r[:, 0] > CARRIES * self._largest)
        return bool(pushes.any() and holds[pushes].all())

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
        weight, held = self._weight(k, size), self._holds(k)
        total, out = 0.0, np.zeros(self.r.shape[1])
        for c, share, n, m in zip(
            self.owner.tolist(), np.abs(self.share).tolist(), self.normal, self.goes - way, strict=True
        ):
            towards = float(n @ m)
            v = m if self.welded[c] else max(towards, 0.0) * n + held * (m - towards * n)
            out += share * float(weight[c]) * v
            total += share * float(weight[c])
        return out / (total or 1.0)


@dataclass(frozen=True)
class Ridden:
    """How a body is taken along: evenly by a ``way`` (d,), and by a ``turn`` (3,) about a ``centre`` (d,)."""

    way: Floats
    centre: Floats
    turn: Floats

    def after(self, x: Floats, fraction: Floats) -> Floats:
        """How far (w, d) places x (w, d) go by a ``fraction`` (w, 1) of the increment."""
        angle = float(np.linalg.norm(self.turn))
        axis = self.turn / max(angle, TINY)
        return fraction * self.way + swung(_in_space(x - self.centre), axis, fraction * angle)[:, : x.shape[1]]


def swung(arm: Floats, axis: Floats, angle: Floats) -> Floats:
    """How far (w, 3) the ends of arms (w, 3) go by turns about a unit ``axis`` (3,) by an ``angle`` (w, 1).

    What is along the axis stays; what is across it goes by a chord.
    """
    across = arm - np.outer(arm @ axis, axis)
    return np.sin(angle) * np.cross(axis, arm) - 2 * np.sin(angle / 2) ** 2 * across


def _in_space(vectors: Floats) -> Floats:
    """Vectors (..., d) of a plane with a third component, zero."""
    return np.concatenate([vectors, np.zeros((*vectors.shape[:-1], 3 - vectors.shape[-1]))], axis=-1)
