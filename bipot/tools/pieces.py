"""Pieces of two boundaries in a plane that face each other.

Edges are polygons through their nodes (:mod:`bipot.tools.flats`).
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np

from bipot.tensors import norm
from bipot.tools.flats import edge_shapes, flats, outward
from bipot.tools.plane import cross
from bipot.typing import Bools, Floats, Ints

FACES = -0.1
"""Largest product of the outward normals of two flat parts that face each other."""

LEAST = 1e-9
"""Over the length or area of a flat part, a piece no larger than this is none."""

NEAR = 0.03
"""Over the longest edge or diagonal of a flat part, the height times the sine of the angle between normals beyond which
what it sees is beside what it faces. A wall that leans away from where a body is pressed would else hold means open.
"""

TOUCHES = 0.1
"""Over its depth behind one flat part, the distance from another one at which a place is before that one instead: it
touches the other side of a corner, however far inside of this one that is."""


class Near(Enum):
    """Up to which height what leans away is faced, as :data:`NEAR` allows or any: by the length of which flat part."""

    OWN = "own"
    """That which faces it."""
    WELDED = "welded"
    """The longer one. A fine side would else miss a weld to a coarse one, off whose surface edges are as they are long.
    """
    ANY = "any"

    def highest(self, mine: Floats, its: Floats) -> Floats:
        """Largest heights times sines (s,) of flats as long as ``mine`` (s,) before others as ``its`` (s,)."""
        if self is Near.ANY:
            return np.full_like(mine, np.inf)
        return NEAR * (mine if self is Near.OWN else np.maximum(mine, its))


class Pieces(NamedTuple):
    """Pieces (s,) of ``one`` flat part of facets (s,) that face pieces of the ``other`` (s,).

    Parts are numbered as by :func:`bipot.tools.flats.flats`. The hat functions of the one at integration points are
    ``mine`` (s, g, k), those of the other ``its`` (s, g, l), and the weights in int dA ``weight`` (s, g). The least gap
    of each piece is ``lowest`` (s,). Integrals of the hat functions of each flat part are, over what is before another
    one, whether that is faced or too high to be, ``before`` (f, k).
    """

    one: Ints
    other: Ints
    mine: Floats
    its: Floats
    weight: Floats
    lowest: Floats
    before: Floats

    @staticmethod
    def of(every: Pieces, faced: Bools) -> Pieces:
        """Those ``faced`` of ``every`` piece (s,) that is before a flat part, of which there are zeros ``before``."""
        before = every.before.copy()
        np.add.at(before, every.one, np.einsum("sg,sgk->sk", every.weight, every.mine))
        return Pieces._make((*(of[faced] for of in every[:-1]), before))


def pieces(nodes: Floats, one: Ints, other: Ints, ring: bool, near: Near = Near.OWN) -> Pieces:
    """The pieces of edges ``one`` (f, n) and ``other`` (g, n) of ``nodes`` (a, 2) that face each other.

    On a meridian, which is that of a ``ring``, dA has the radius. Integrals of hat functions times shape functions are
    exact. Of several pieces that face the same place the nearest counts; one that is farther behind the edge than both
    edges are long does not, nor one behind the other side of a thin part. What is higher than ``near`` allows is cut
    off.
    """
    count, x, y = one.shape[1], nodes[flats(one, 2)], nodes[flats(other, 2)]
    length, its = norm(x[:, 1] - x[:, 0]), norm(y[:, 1] - y[:, 0])
    found = _shadows(x, y).nearest()
    found, faced = found.cut(length, near.highest(length[found.one], its[found.other]))
    places, weights = np.polynomial.legendre.leggauss(count)
    xi, eta = (at[:, :1] + np.diff(at) * (places + 1) / 2 for at in (found.xi, found.eta))
    weight = np.diff(found.xi) * weights / 2 * length[found.one, None]
    if ring:
        weight *= _on(x[found.one], xi)[..., 0]
    lowest = (found.heights[:, :1] + found.eta * np.diff(found.heights)).min(axis=1)
    mine, its, none = edge_shapes(xi, 2), edge_shapes(eta, 2), np.zeros((len(x), 2))
    return Pieces.of(Pieces(found.one, found.other, mine, its, weight, lowest, none), faced)


class Shadows(NamedTuple):
    """Shadows (s,) of straights ``other`` (s,) along the normals of those ``one`` (s,), from ``low`` to ``high`` on it.

    The ends of the other are before ``ends`` (s, 2) of the one, at ``heights`` (s, 2) over it. Places on a straight go
    from 0 to 1.
    """

    one: Ints
    other: Ints
    low: Floats
    high: Floats
    ends: Floats
    heights: Floats

    @property
    def xi(self) -> Floats:
        """The places (s, 2) on the one where shadows begin and end."""
        return np.stack([self.low, self.high], axis=1)

    @property
    def eta(self) -> Floats:
        """Those (s, 2) on the other."""
        return (self.xi - self.ends[:, :1]) / np.diff(self.ends)

    def height(self, place: Floats) -> Floats:
        """Heights (s, m) of the other over a ``place`` (m,), or (s, m), on the one."""
        slope = np.diff(self.heights) / np.diff(self.ends)
        return self.heights[:, :1] + slope * (place - self.ends[:, :1])

    def only(self, some: Ints | Bools) -> Shadows:
        """Some of them."""
        return Shadows._make(of[some] for of in self)

    def nearest(self) -> Shadows:
        """Without what is hidden from the one: where several are over a place, the lowest is kept there.

        Between two of all bounds on an edge, it is that which is the lowest in the middle.
        """
        order = np.lexsort((self.low, self.one))
        edge, low, high = self.one[order], self.low[order], self.high[order]
        crowded = np.isin(self.one, edge[1:][(edge[1:] == edge[:-1]) & (low[1:] < high[:-1] - LEAST)])
        alone = np.flatnonzero(~crowded)
        kept, begin, end = [alone], [self.low[alone]], [self.high[alone]]
        for one in np.unique(self.one[crowded]):
            mine = np.flatnonzero(self.one == one)
            some = self.only(mine)
            bounds = np.unique([some.low, some.high])
            middle = (bounds[1:] + bounds[:-1]) / 2
            over = (some.low[:, None] < middle) & (middle < some.high[:, None])
            lowest, met = np.argmin(np.where(over, some.height(middle), np.inf), axis=0), over.any(axis=0)
            kept.append(mine[lowest[met]])
            begin.append(bounds[:-1][met])
            end.append(bounds[1:][met])
        return self.only(np.concatenate(kept))._replace(low=np.concatenate(begin), high=np.concatenate(end))

    def cut(self, length: Floats, highest: Floats) -> tuple[Shadows, Bools]:
        """Them, cut where they are too high over straights of this ``length`` (f,), and which are before those (s,).

        The others are beside them: heights times the sines of angles between both are larger than the ``highest`` (s,).
        """
        rise, run = np.diff(self.heights)[:, 0], np.diff(self.ends)[:, 0] * length[self.one]
        sine = np.abs(rise) / np.hypot(rise, run)
        beyond = self.height(self.xi) * sine[:, None] - highest[:, None]
        low, high = self._where(beyond <= 0, beyond), self._where(beyond > 0, beyond)
        faced = np.arange(len(low.one) + len(high.one)) < len(low.one)
        return Shadows._make(np.concatenate(both) for both in zip(low, high, strict=True)), faced

    def _where(self, kept: Bools, beyond: Floats) -> Shadows:
        """What is ``kept``, by both ends (s, 2), up to where what is ``beyond`` (s, 2) is zero."""
        first, last = beyond.T
        with np.errstate(divide="ignore", invalid="ignore"):
            bound = self.low + (self.high - self.low) * first / (first - last)
        low, high = (np.where(here, at, bound) for here, at in ((kept[:, 0], self.low), (kept[:, 1], self.high)))
        return self._replace(low=low, high=high).only(kept.any(axis=1) & (high > low))


def _shadows(one: Floats, other: Floats) -> Shadows:
    """Those on straights ``one`` (f, 2, 2) of ``other`` (g, 2, 2) that face them and are not too far behind."""
    out, length = outward(one), norm(one[:, 1] - one[:, 0])
    i, j = np.nonzero(out @ outward(other).T < FACES)
    along = (one[i, 1] - one[i, 0]) / length[i, None] ** 2
    ends = np.vecdot(other[j] - one[i, None, 0], along[:, None])
    heights = np.vecdot(other[j] - one[i, None, 0], out[i, None])
    low, high = np.maximum(ends.min(axis=1), 0.0), np.minimum(ends.max(axis=1), 1.0)
    deepest = heights.min(axis=1) + length[i] + norm(other[j, 1] - other[j, 0])
    found = Shadows(i, j, low, high, ends, heights).only((high > low) & (deepest > 0))
    middle = ((found.low + found.high) / 2)[:, None]
    behind = _on(one[found.one], middle)[:, 0], -found.height(middle)[:, 0]
    return found.only(~_through(one, out, found.one, *behind))


def _through(one: Floats, out: Floats, i: Ints, x: Floats, depth: Floats) -> Bools:
    """Whether others of the edges ``one`` (f, 2, 2) lie before the ``depth`` (s,) behind x (s, 2) on the edges i (s,).

    The edges have the outward normals ``out`` (f, 2); others are those through which one leaves the part there, or that
    the place at the depth touches.
    """
    hidden = np.zeros(len(i), dtype=bool)
    deep = np.flatnonzero(depth > LEAST * norm(one[i, 1] - one[i, 0]))
    if not deep.size:
        return hidden
    inward, start, along = -out[i[deep], None], one[None, :, 0] - x[deep, None], one[None, :, 1] - one[None, :, 0]
    side = cross(inward, along)
    with np.errstate(divide="ignore", invalid="ignore"):
        far, place = cross(start, along) / side, cross(start, inward) / side
    beyond = out[i[deep]] @ out.T < 0
    leaves = beyond & (far > 0) & (far < depth[deep, None]) & (place >= 0) & (place <= 1)
    off = inward * depth[deep, None, None] - start
    foot = np.vecdot(off, along) / np.vecdot(along, along)
    near = (np.abs(np.vecdot(off, out)) < TOUCHES * depth[deep, None]) & (np.arange(len(one)) != i[deep, None])
    hidden[deep] = (leaves | (near & (foot >= 0) & (foot <= 1))).any(axis=1)
    return hidden


def _on(edges: Floats, s: Floats) -> Floats:
    """Points (s, g, 2) at s (s, g) of edges (s, 2, 2)."""
    return edges[:, None, 0] + s[..., None] * (edges[:, None, 1] - edges[:, None, 0])
