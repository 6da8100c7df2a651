"""Whether a motion proves that a load in space is above the limit load: see :mod:`studies.independent.collapse`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from studies.independent.collapse import FEW, Pressed, Proof, Worked, closing, rigid, spent, ways_of
from studies.independent.element import Bools
from studies.independent.solid import Floats, Ints, displacement_gradient, fitted, place


@dataclass(frozen=True)
class Solid:
    """A body: ``elements`` of nodes at ``rest`` (a, 3), the ``volume`` change that they are fitted by, the last yield
    stress ``sigma_y`` (e, 1), and what supports leave of nodes' vectors, ``freed`` (a, 3, 3).
    """

    elements: Ints
    rest: Floats
    quadrature: str
    volume: str
    sigma_y: Floats
    freed: Floats


@dataclass(frozen=True)
class Discs:
    """Points (c,) at tools, of which the friction is a disc of two tangents: what they are of, and what touches.

    Each is the mean of w nodes: ``owner`` (w,) is the point, ``part`` (w,) the node, ``share`` (w,) its weight. By the
    ``rows`` (w, 3, 3), a normal and two tangents, its gap and slip change, of which planes of symmetry leave ``kept``
    (c, 2, 2), and ``moved`` (c, 3, 3) of what it moves by. As the m driven tools go by one, their places under the
    nodes go by ``led`` (m, w, 3).
    """

    tool: Ints
    mu: Floats
    welded: Bools
    touching: Bools
    owner: Ints
    part: Ints
    share: Floats
    rows: Floats
    kept: Floats
    moved: Floats
    led: Floats

    def means(self, values: Floats) -> Floats:
        """Means (c, 3) of values (w, 3)."""
        out = np.zeros((len(self.tool), 3))
        np.add.at(out, self.owner, self.share[:, None] * values)
        return out

    def motion(self, nodal: Floats) -> Floats:
        """That of points (c, 3) as nodes go (a, 3) and tools rest."""
        return np.einsum("cij,cj->ci", self.moved, self.means(nodal[self.part]))

    def opening(self, nodal: Floats, ways: Floats) -> tuple[Floats, Floats]:
        """What gaps (c,) grow by, and how long slips (c,) are, as nodes go (a, 3) and driven tools their ``ways``."""
        u = self.means(np.einsum("wij,wj->wi", self.rows, nodal[self.part] - np.einsum("m,mwi->wi", ways, self.led)))
        return u[:, 0], np.linalg.norm(np.einsum("cij,cj->ci", self.kept, u[:, 1:]), axis=1)


@dataclass(frozen=True)
class Drives:
    """What drives tools, m forces and moments: ``tool`` (m,) by number, of flat ones ``normal`` and ``direction``.

    The latter (m, 3) is that of the force, ``force`` (m,) what acts on the modelled part.
    """

    tool: Ints
    normal: Floats
    direction: Floats
    force: Floats


@dataclass(frozen=True)
class SolidCollapse:
    """What is claimed: ``motion`` (a, 3) of the nodes ``placed`` (a, 3) under nodal ``loads`` (a, 3), forces on tools.

    Driven tools that touch nothing rest, or follow the body where they are ``following``.
    """

    placed: Floats
    motion: Floats
    loads: Floats
    drives: Drives
    points: Discs
    following: bool = False


def judged(s: Solid, c: SolidCollapse, ways: Floats | None = None) -> Proof:
    """The inequalities of a claim; driven tools go by ``ways`` (m,), or flat ones as far as their contacts let them."""
    if ways is None:
        farthest = [_pressed(c, k).farthest(c.following) for k in range(len(c.drives.tool))]
        ways = ways_of(farthest, c.drives.force, c.loads, c.motion)
    held = float(np.abs(_barred(s, c.motion)).max())
    return Worked(c.motion, ways, c.loads, c.drives.force, _spent(s, c), _closing(c, ways), held).proof()


def rigid_part(s: Solid, placed: Floats, motion: Floats) -> Floats:
    """The rigid motion (a, 3) nearest to ``motion`` (a, 3) of nodes at ``placed`` (a, 3) that supports allow."""
    x = placed - placed.mean(axis=0)
    turns = np.asarray(np.cross(np.eye(3)[:, None], x / np.abs(x).max()), dtype=np.float64)
    every = np.concatenate([np.broadcast_to(np.eye(3)[:, None], (3, *x.shape)), turns])
    return rigid(motion, every, _barred(s, every))


def _barred(s: Solid, vectors: Floats) -> Floats:
    """What supports hold of nodes' vectors (..., a, 3)."""
    return vectors - np.einsum("aij,...aj->...ai", s.freed, vectors)


def _spent(s: Solid, c: SolidCollapse) -> tuple[float, float]:
    """Largest change of volume as work of the yield stress, and dissipation, beyond the round-off of the motion."""
    at = place(c.placed, s.elements, s.quadrature)
    # A translation strains nothing, and what is added to it has its round-off.
    G = displacement_gradient(at, (c.motion - c.motion.mean(axis=0))[s.elements])
    blur = FEW * np.abs(c.motion).max() * np.abs(at.slopes).sum(axis=(-2, -1))
    fit = partial(fitted, weight=at.volume, rest=s.rest[s.elements], quadrature=s.quadrature, volume=s.volume)
    return spent(G, blur, at.volume, np.broadcast_to(s.sigma_y, at.volume.shape), fit)


def _pressed(c: SolidCollapse, k: int) -> Pressed:
    """The points of a driven tool."""
    p, drives, own = c.points, c.drives, c.points.tool == c.drives.tool[k]
    mu = np.where(p.welded, 0.0, p.mu)
    v = p.motion(c.motion)
    return Pressed(v[own], mu[own], p.touching[own], p.welded[own], drives.normal[k], drives.direction[k])


def _closing(c: SolidCollapse, ways: Floats) -> tuple[float, float]:
    """What contacts do as driven tools go their ways."""
    p = c.points
    return closing(*p.opening(c.motion, ways), p.mu, p.welded, p.touching)
