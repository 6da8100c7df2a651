r"""How tools carry a body in the directions that supports leave free: what one tool meets rides on the others.

Tool j takes along what touches it at the start of the increment. The tool's points there move by m_c, along its path
and as it turns. A body that already moves by v is taken along, beyond v, by

    v_j(v) = mean_c n (n . m)+,    m = m_c - v,

plus (1 - n n') m where friction holds all points that push; where the tool is welded, by all of m. The mean is over the
points that push, weighted by r_n, or if none does over all that touch, weighted by their part of the whole body. A body
that tool k meets is carried by the others, beyond the way v_s of its supports by v_1 and then by more:

    v_1 = N N' V(v_s),        v_1 + 1/2 N N' V(v_s + v_1),        V(v) = sum_j |v_j| v_j / sum_j |v_j|,

with N the directions in which no support and no plane of symmetry holds anything. Where one tool pushes and no other is
in the way, this is its way; where two squeeze the body, the mean of both ways; where all rest or recede, zero. Mirror
images of tools beyond planes of symmetry count as tools.

A body that one tool alone takes along also turns with it, about its centre; the m_c above are then without that turn.
A welded tool turns it by the whole turn, by theta about the axis e. Where friction holds the body, it turns only about
the mean normal N_c of the tool there, by theta (e . N_c), because it would roll on the tool about other axes. It makes
the whole turn on a flat tool if nothing else touches it, and where several tools hold it from more than one side and
turn alike, as jaws do. Their centres may be apart a little, which adds a translation, but not as far as those of rolls.
A tool and its mirror image turn alike about an axis normal to the plane. Other tools prevent the turn unless they hold
the body at the axis alone, as a pivot does, or it slides on them and the turn leaves its gaps unchanged, as on a rail
or in a bearing. A body that supports hold turns only about the direction in which they hold it, if there is only one.

What forces and moments add to a tool's way is not known before the increment is solved, and takes nothing along.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from bipot.contact.candidates import Candidates
from bipot.contact.closeness import carries, closed
from bipot.state import State
from bipot.tensors import norm
from bipot.tools.aloft import Carried
from bipot.tools.poses import crossed, turned_on
from bipot.tools.surfaces import Plane
from bipot.typing import Bools, Floats

HOLDS = 1e-6
"""Friction that is below its limit by more than this fraction of the largest contact force holds its point; smaller
differences are within the certificate's bound on the law."""

PARALLEL = 1e-9
"""Directions that differ by less are the same."""

BESIDE = 0.5
"""Tools whose axes are no farther apart than this, over the distance from the axis at which one holds the body, turn it
about one place. The axes of rolls that carry a plate are apart by twice that distance or more."""

ONE_SIDE = 0.9
"""Length of the mean of the tools' unit normals above which all are on one side of a body, which may roll on them."""

SLIGHT = 1e-3
"""Motion off a tool's surface, or of points that a tool holds, below this part of the longest way of a turn is a strain
of the body and does not prevent the turn."""


class Spin(NamedTuple):
    """A turn by ``angle`` about the unit ``axis`` (1,), in space (3,), through the ``middle`` (d,)."""

    angle: float
    axis: Floats
    middle: Floats

    def displacement(self, places: Floats) -> Floats:
        """The displacement (m, d) of ``places`` (m, d)."""
        return turned_on(self.axis, np.full((len(places), 1), self.angle), places - self.middle)


@dataclass(frozen=True)
class Riding:
    """What rides on the tools of the ``candidates``, of which parts are at ``place`` with the tools' ``normal`` (w, d).

    Beyond the way of the supports, the tools' points there move by ``motion`` (w, d) from the state ``start`` on. Tools
    in the poses ``placed`` (k, p) are to turn by ``angles`` (k,).
    """

    candidates: Candidates
    start: State
    place: Floats
    normal: Floats
    motion: Floats
    placed: Floats
    angles: Floats

    def carried(self) -> Carried:
        """How, where parts (w,) of each tool's candidates are, the body is carried by the other tools."""
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
        """Which tools (k,) turn what the k-th meets, and how; None if none does."""
        touching = np.asarray((self._weights > 0).any(axis=1))
        others = touching * self._others(k)
        alone = others.sum() == 1 and not touching[k]
        for j, whole in product(np.flatnonzero(others > 0).tolist(), (True, False)):
            spin = self._spun(j, whole)
            if spin is not None and (turning := self._turning_with(j, spin, whole, others, alone)) is not None:
                return turning, spin
        return None

    def _turning_with(self, j: int, spin: Spin, whole: bool, others: Floats, alone: bool) -> Bools | None:
        """Which tools (k,) turn the body by the ``spin`` of the j-th, its ``whole`` turn or not; None if it does not.

        ``others`` (k,) says how often each tool is there beside the one that the body meets, ``alone`` whether the j-th
        is the only one of all that touches it.
        """
        tool = self.candidates.scene.tools[j]
        # Mirror images turn alike: an axis along which planes of symmetry hold the body is across these planes.
        turning = np.array([n > 0 and (i == j or self._alike(spin, i, whole)) for i, n in enumerate(others)])
        cannot_roll = tool.welded or self._clamp(turning * others) or (alone and isinstance(tool.face, Plane))
        if (whole and not cannot_roll) or not self._is_spread(turning, spin):
            return None
        prevented = any(not (turning[i] or self._allows(i, spin)) for i in np.flatnonzero(others).tolist())
        return None if prevented else turning

    def _spun(self, j: int, whole: bool) -> Spin | None:
        """How the j-th tool turns what it holds, if it does: by its ``whole`` turn, or else about its normal."""
        tool = self.candidates.scene.tools[j]
        if tool.turn is None or self.angles[j] == 0:
            return None
        middle = np.add(tool.turn.centre, self.placed[j, : len(tool.turn.centre)])
        spin = Spin(float(self.angles[j]), tool.turn.about, middle)
        if not tool.welded and not whole:
            spin = self._twisted(spin, self._weights[j])
        holds = tool.welded or self._stuck[self.candidates.tool == j].all()
        across = float(norm(crossed(spin.axis, self.candidates.scene.directions.held)).max(initial=0.0))
        return spin if holds and across <= PARALLEL and spin.angle != 0 else None

    def _alike(self, spin: Spin, i: int, whole: bool) -> bool:
        """Whether the i-th tool turns what it holds by the ``spin``, about nearly the same place: rolls do not."""
        other = self._spun(i, whole)
        if other is None:
            return False
        held = self.place[self._weights[i] > 0]
        turned = float(norm(other.angle * other.axis - spin.angle * spin.axis))
        apart, reach = (crossed(spin.axis, vectors) for vectors in (other.middle - spin.middle, held - other.middle))
        return turned <= PARALLEL * abs(spin.angle) and float(norm(apart)) <= BESIDE * float(norm(reach).max())

    def _clamp(self, often: Floats) -> bool:
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

    def _is_spread(self, turning: Bools, spin: Spin) -> bool:
        """Whether points held by the ``turning`` tools (k,) are apart across the axis of the ``spin``."""
        touched = self.place[(self._weights[turning] > 0).any(axis=0)]
        spread = float(norm(crossed(spin.axis, touched - touched[0])).max())
        return spread > PARALLEL * self.candidates.scene.size

    def _allows(self, i: int, spin: Spin) -> bool:
        """Whether the i-th tool allows the body a ``spin``: along its surface, or about the points that it holds."""
        met, tool, pose = self._weights[i] > 0, self.candidates.scene.tools[i], self.placed[i]
        gone, place = spin.displacement(self.place), self.place[met]
        off, most = norm(gone[met]), float(norm(gone).max())
        if not tool.welded and not self._stuck[self.candidates.tool == i].any():
            off = np.abs(tool.distance(place + gone[met], pose) - tool.distance(place, pose))
        return float(off.max()) <= SLIGHT * most

    def _twisted(self, spin: Spin, weight: Floats) -> Spin:
        """The part of a spin about the mean normal by ``weight`` (w,); none in a plane, where the axis is across it."""
        normal = weight @ self.normal
        length = float(norm(normal))
        if len(normal) == 2 or length == 0:
            return spin._replace(angle=0.0)
        return spin._replace(angle=spin.angle * float(spin.axis @ normal) / length, axis=normal / length)

    @cached_property
    def _free(self) -> Floats:
        """N N' (d, d)."""
        free = self.candidates.scene.directions.free
        return free @ free.T

    def _by_others(self, v: Floats, k: int) -> Floats:
        """V (d,) of all tools but the k-th, which take the body along by ``v`` (k, d)."""
        weights = norm(v) * self._others(k)
        total = float(weights.sum())
        return weights @ v / total if total > 0 else np.zeros(v.shape[1])

    def _others(self, k: int) -> Floats:
        """How often each tool (k,) is there beside the k-th: with its mirror images, among which are the k-th's own."""
        return self._images - (np.arange(len(self._images)) == k)

    def _taken_along(self, motion: Floats) -> Floats:
        """v_j (k, d) of each tool by the ``motion`` (w, d) of its points at the parts; zero if it touches nothing."""
        along, out = self._along(motion), np.zeros((len(self._weights), motion.shape[1]))
        for j, weight in enumerate(self._weights):
            if weight.any():
                out[j] = weight @ along / weight.sum()
        return out

    @cached_property
    def _weights(self) -> Floats:
        """Weights (k, w) of the parts in the mean over each tool's points (module docstring)."""
        contacts, r = self.candidates, self.start.forces
        # A part of the body is no tool that carries it.
        touching = closed(self.start.gap, r, contacts.scene.size) & ~contacts.between
        pushing = contacts.owned & touching & carries(r)
        resting = (contacts.owned & touching) * contacts.share
        share = np.where(pushing.any(axis=1, keepdims=True), pushing * r[:, 0], resting)
        return np.abs(contacts.parts.weight) * share[:, contacts.parts.owner]

    def _along(self, motion: Floats) -> Floats:
        """How far each part is taken along (w, d) by the tool's ``motion`` (w, d) under it."""
        owner, towards = self.candidates.parts.owner, np.vecdot(self.normal, motion)[:, None]
        across = np.where(self._stuck[owner, None], motion - towards * self.normal, 0.0)
        pushed = np.where(towards > 0, towards * self.normal, 0.0)
        return np.where(self.candidates.welded[owner, None], motion, pushed + across)

    @cached_property
    def _stuck(self) -> Bools:
        """Candidates (c,) of tools at which friction holds all points that push at the start; caps are ignored."""
        contacts, r = self.candidates, self.start.forces
        mu = np.where(np.isfinite(contacts.mu), contacts.mu, 0.0)
        slides = norm(r[:, 1:]) >= mu * r[:, 0] - HOLDS * float(norm(r).max(initial=0.0))
        pushing = contacts.owned & carries(r)
        sticks = np.asarray(pushing.any(axis=1) & ~(pushing & slides).any(axis=1))
        return sticks[contacts.tool]

    @cached_property
    def _images(self) -> Floats:
        """How many tools of the whole body each tool (k,) stands for, with its mirror images."""
        scene = self.candidates.scene
        return np.array([2.0 ** sum(not plane.cuts(tool) for plane in scene.planes) for tool in scene.tools])
