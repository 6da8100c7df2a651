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

A body that one tool alone takes along goes as that turns, too, about its centre, and the m_c above are without that.
Where the tool is welded that is its turn by theta about its axis e. Where friction holds the body it is what of it is
about the mean normal N_c of the tool there, theta (e . N_c), because the body would roll on the tool; or all of it, on
a flat tool as long as nothing else touches the body, and where several tools hold it and turn alike, as jaws do, from
more than one side. These may turn about places that are near by, which is a translation, and not as rolls do. A tool
and its mirror image turn alike about an axis across the plane. Other tools are in the way unless they hold the body on
the axis alone, as a pivot does, or it slides on them and turns along their surface, as on a rail or in a bearing, where
its gaps stay. What supports hold turns only about the one direction in which they do.

What forces and moments make of a tool's way is not known before the increment is solved, and takes nothing along.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import null_space

from bipot.contact.candidates import Candidates
from bipot.contact.closeness import carries, closed
from bipot.response import State
from bipot.tensors import norm
from bipot.tools.aloft import Carried
from bipot.tools.poses import crossed, turned_on
from bipot.tools.surfaces import Plane
from bipot.typing import Bools, Floats

HOLDS = 1e-6
"""Friction farther below its limit than this fraction of the largest contact force holds its point: no more than that
does the certificate's law leave undecided."""

PARALLEL = 1e-9
"""Directions that differ by less are one."""

BESIDE = 0.5
"""Of how far from its axis a tool holds a body: tools whose axes are no farther apart turn it about one place. Rolls
that carry a plate have them twice as far apart, or more."""

ONE_SIDE = 0.9
"""Length of the mean of unit normals of tools, above which all are on one side of a body, which may roll on them."""

SLIGHT = 1e-3
"""Of the farthest way of a turn: less off a tool's surface, or of what a tool holds, is a strain of the body."""


class Spin(NamedTuple):
    """A turn by ``angle`` about the unit ``axis`` (1,), in space (3,), through the ``middle`` (d,)."""

    angle: float
    axis: Floats
    middle: Floats

    def displacement(self, places: Floats) -> Floats:
        """That of ``places`` (m, d)."""
        return turned_on(self.axis, np.full((len(places), 1), self.angle), places - self.middle)


@dataclass(frozen=True)
class Riding:
    """What rides on the tools of the ``candidates`` from the state ``start`` on, at ``place`` and ``normal`` (w, d).

    Parts of candidates meet points of the tools that go ``motion`` (w, d), beyond the way of the supports. The tools in
    the poses ``placed`` (k, p) are to turn by ``angles`` (k,). Supports and planes hold the body along ``held`` (h, d).
    """

    candidates: Candidates
    start: State
    place: Floats
    normal: Floats
    motion: Floats
    placed: Floats
    angles: Floats
    held: Floats

    def carried(self) -> Carried:
        """How the body is carried by the other tools, where parts (w,) of each tool's candidates meet it."""
        tool, out = self.candidates.tool[self.candidates.parts.owner], Carried.evenly(np.zeros_like(self.motion))
        if not self._free.any():
            return out
        alone = self._taken_along(self.motion)
        for k in range(len(self.angles)):
            mine, spun, motion = tool == k, self._turning(k), self.motion
            if spun is not None:
                turning, spin = spun
                out.arm[mine], out.angle[mine], out.axis[mine] = self.place[mine] - spin.middle, spin.angle, spin.axis
                motion = motion - turning[tool, None] * spin.displacement(self.place)
            once = self._by_others(alone if spun is None else self._taken_along(motion), k) @ self._free
            out.by[mine] = once + self._by_others(self._taken_along(motion - once), k) @ self._free / 2
        return out

    def _turning(self, k: int) -> tuple[Bools, Spin] | None:
        """Which tools (k,) turn what the k-th meets, and how, if any do."""
        touching = np.asarray((self._weights > 0).any(axis=1))
        others = touching * (self._images - (np.arange(len(touching)) == k))
        alone = others.sum() == 1 and not touching[k]
        # Mirror images turn alike: an axis along which planes of symmetry hold the body is across these planes.
        for j in np.flatnonzero(others > 0).tolist():
            tool = self.candidates.scene.tools[j]
            for whole in (True, False):
                spin = self._spun(j, whole)
                if spin is None:
                    continue
                turning = np.array([n > 0 and (i == j or self._alike(spin, i, whole)) for i, n in enumerate(others)])
                held_so = tool.welded or self._grips(turning * others) or (alone and isinstance(tool.face, Plane))
                if (whole and not held_so) or not self._spreads(turning, spin):
                    continue
                if all(turning[i] or self._lets(i, spin) for i in np.flatnonzero(others).tolist()):
                    return turning, spin
        return None

    def _spun(self, j: int, whole: bool) -> Spin | None:
        """How the j-th tool turns what it holds, if it does: by the ``whole`` turn, or as what rolls on it."""
        tool = self.candidates.scene.tools[j]
        if tool.turn is None or self.angles[j] == 0:
            return None
        middle = np.add(tool.turn.centre, self.placed[j, : len(tool.turn.centre)])
        spin = Spin(float(self.angles[j]), tool.turn.about, middle)
        if not tool.welded and not whole:
            spin = self._twisted(spin, self._weights[j])
        holds = tool.welded or self._held[self.candidates.tool == j].all()
        beside = float(norm(crossed(spin.axis, self.held)).max(initial=0.0))
        return spin if holds and beside <= PARALLEL and spin.angle != 0 else None

    def _alike(self, spin: Spin, i: int, whole: bool) -> bool:
        """Whether the i-th tool turns what it holds by the ``spin``, about nearly the same place: rolls do not."""
        own = self._spun(i, whole)
        if own is None:
            return False
        held = self.place[self._weights[i] > 0]
        turned = float(norm(own.angle * own.axis - spin.angle * spin.axis))
        apart, reach = (crossed(spin.axis, vectors) for vectors in (own.middle - spin.middle, held - own.middle))
        return turned <= PARALLEL * abs(spin.angle) and float(norm(apart)) <= BESIDE * float(norm(reach).max())

    def _grips(self, often: Floats) -> bool:
        """Whether tools, each so ``often`` (k,) with its mirror images, hold the body from more than one side."""
        total = np.zeros(self.place.shape[1])
        for i in np.flatnonzero(often).tolist():
            normal, tool = self._weights[i] @ self.normal, self.candidates.scene.tools[i]
            facing = normal / max(float(norm(normal)), float(np.finfo(float).tiny))
            for plane in self.candidates.scene.planes:
                if often[i] > 1 and not plane.cuts(tool):
                    facing = facing - float(facing @ plane.normal) * np.array(plane.normal)
            total += often[i] * facing
        return bool(often.sum() > 1 and norm(total) <= ONE_SIDE * often.sum())

    def _spreads(self, turning: Bools, spin: Spin) -> bool:
        """Whether what tools that are ``turning`` hold is at places apart, across the axis of the ``spin``."""
        touched = self.place[(self._weights[turning] > 0).any(axis=0)]
        spread = float(norm(crossed(spin.axis, touched - touched[0])).max())
        return spread > PARALLEL * self.candidates.scene.size

    def _lets(self, i: int, spin: Spin) -> bool:
        """Whether the i-th tool lets the body turn by a ``spin``: along its surface, or about what it holds."""
        met, tool, pose = self._weights[i] > 0, self.candidates.scene.tools[i], self.placed[i]
        gone, place = spin.displacement(self.place), self.place[met]
        off, most = norm(gone[met]), float(norm(gone).max())
        if not tool.welded and not self._held[self.candidates.tool == i].any():
            off = np.abs(tool.distance(place + gone[met], pose) - tool.distance(place, pose))
        return float(off.max()) <= SLIGHT * most

    def _twisted(self, spin: Spin, weight: Floats) -> Spin:
        """What of it is about the normal, in the mean by the ``weight`` (w,): in a plane nothing is."""
        normal = weight @ self.normal
        length = float(norm(normal))
        if len(normal) == 2 or length == 0:
            return spin._replace(angle=0.0)
        return spin._replace(angle=spin.angle * float(spin.axis @ normal) / length, axis=normal / length)

    @cached_property
    def _free(self) -> Floats:
        """N N' (d, d)."""
        basis = null_space(np.vstack([np.zeros(self.motion.shape[1]), self.held]), rcond=PARALLEL)
        return basis @ basis.T

    def _by_others(self, own: Floats, k: int) -> Floats:
        """V (d,) of tools that take along ``own`` (k, d), as the k-th meets it: of its own images it is not one."""
        weights = norm(own) * (self._images - (np.arange(len(own)) == k))
        total = float(weights.sum())
        return weights @ own / total if total > 0 else np.zeros(own.shape[1])

    def _taken_along(self, motion: Floats) -> Floats:
        """v_j (k, d) of each tool that goes this ``motion`` (w, d) under the parts, zero where it touches nothing."""
        along, out = self._along(motion), np.zeros((len(self._weights), motion.shape[1]))
        for own, weight in zip(out, self._weights, strict=True):
            if weight.any():
                own[:] = weight @ along / weight.sum()
        return out

    @cached_property
    def _weights(self) -> Floats:
        """Of the means over the points of each tool (k, w)."""
        contacts, r = self.candidates, self.start.forces
        touching = closed(self.start.gap, r, contacts.scene.size)
        pushing = contacts.owned & touching & carries(r)
        resting = (contacts.owned & touching) * contacts.share
        share = np.where(pushing.any(axis=1, keepdims=True), pushing * r[:, 0], resting)
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
