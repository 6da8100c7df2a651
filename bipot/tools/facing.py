r"""Contact of two boundaries of one mesh: means of the gap between them, and of their relative motion.

Boundaries are polygons through their nodes (:mod:`bipot.tools.flats`). Points p are the nodes of the boundary that may
touch, with the hat functions psi_p of these flat parts. Seen along the normal of such a part, a place x of it faces
the place y(x) on the other boundary, and

    z_p = sum_k D_pk x_k - sum_l M_pl y_l,    D_pk = int w psi_p N_k dA / int w psi_p dA,    M_pl by N_l(y(x)),

with the shape functions N of the edges, is the mean vector between them over the part of the boundary that faces the
other one, of which w counts. Integrals are taken piece by piece (:mod:`bipot.tools.pieces`, in space
:mod:`bipot.tools.polygons`), where neither side has a node within, so that they are exact: a uniform pressure on the
one side is the same on the other, whatever the meshes are. What is faced more obliquely than at 60 degrees has w < 1,
and from 84 on w = 0: a wall behind a corner would otherwise be faced all at once. Of what leans away only the foot is
faced, which is no higher than :data:`~bipot.tools.pieces.NEAR` allows. Rows of the weights (D, -M) sum to zero. With
the normal n_p, into the side of the points, the gap is n_p . z_p, more at an end (:func:`rounding`), and a force r_p
acts on both sides.

The distance from x to y(x), along the normal n of x, changes by m . v / (n . m) as the sides move by v to each other,
with the normal m of y(x). Forces that do the work of the gaps are therefore along m: a corner that ploughs is pushed
back by the slope before it. n_p is the mean of the outward normals m over what is faced. Of a point of which only a
part is before the other side, because that ends there, and moves on over a slope of this side, it is this part of that
mean, and for the rest the mean of the inward normals of its own side. The other side does not end where it leans away.

Quadratic edges and faces are those of their shape functions in the vectors between the sides, and polygons where it is
asked what faces what. On straight edges with centred middle nodes the two are the same. A point at each end alone would
leave them a mode in which the corner of a body sinks into the other side, and slips along its normals would do work.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import scipy.sparse as sp

from bipot.tensors import norm, unit
from bipot.tools.fans import beside, fans, twice
from bipot.tools.flats import flats, hat_integrals, outward, shapes
from bipot.tools.pieces import FACES, LEAST, Near, Pieces, pieces
from bipot.tools.polygons import polygons
from bipot.tools.surfaces import across
from bipot.typing import Bools, Floats, Ints, Vector

SQUARELY = -0.5
"""Largest product of the outward normals of two facets that face each other wholly; at :data:`FACES` nothing counts."""

WELDS = -0.4
"""Largest such product at which sides are welded: not what is seen across a crease of more than 60 degrees, which is
oblique by no less. Exactly 60 degrees are no crease.
"""

ROUND, FILLET = 0.1, 0.1
"""Reach of the other side before a point below which the point is at a rounded end, and how deep this is rounded, over
the longest edge or diagonal from there."""


@dataclass(frozen=True)
class Facing:
    """Points (p,) of a boundary that faces another one: ``weights`` (D, -M) (p, a), inward ``normal`` (p, d).

    Where a point does not face it, as those ``unfaced`` (u,), the weights are those of its own node. The ``part`` (p,)
    of int psi_p dA faces the other one, of each flat part the ``shares`` (l, k). The other one reaches before the point
    as far as the mean of psi_p there, weighted by psi_p: ``reach`` (p,). Of what the point sees, less as it is oblique,
    the part ``squarely`` (p,) counts.
    """

    weights: sp.csr_matrix
    normal: Floats
    unfaced: Ints
    part: Floats
    shares: Floats
    reach: Floats
    squarely: Floats


@dataclass(frozen=True)
class Sides:
    """Facets ``one`` (f, n) and ``other`` (g, n) that may face each other, which run anticlockwise, nodes of each.

    These are at ``nodes`` (a, d) at rest. The former have the flat parts ``flats`` (l, k), whose corners are the points
    ``point`` (l, k), at the nodes ``node`` (p,).
    """

    nodes: Floats
    one: Ints
    other: Ints
    flats: Ints
    point: Ints
    node: Ints

    @staticmethod
    def of(nodes: Floats, one: Ints, other: Ints) -> Sides:
        """With one point a node, or two where the boundary at ``nodes`` (a, d) turns by more than 60 degrees.

        So it does at the corner of a body, of which one side may touch and the other be far off. In space a fan of
        faces that continue into each other has one point.
        """
        ends = flats(one, nodes.shape[1])
        out = outward(nodes[ends])
        if nodes.shape[1] == 2:
            # Of two points at a node the first is that of the edge that begins there.
            a, b = twice(ends.T.reshape(-1, 1))
            point, node = fans(ends.T, a, b, np.vecdot(out[a % len(ends)], out[b % len(ends)]))
            return Sides(nodes, one, other, ends, point.T, node)
        a, b = beside(ends)
        point, node = fans(ends, a, b, np.vecdot(out[a // ends.shape[1]], out[b // ends.shape[1]]))
        return Sides(nodes, one, other, ends, point, node)


class Integrands(NamedTuple):
    """What is integrated over pieces (s,) of flats ``flat`` (s,) with nodes ``own`` (s, n), before ``others`` (s, n).

    Hat functions ``psi`` (s, g, k), shape functions ``mine`` and ``its`` (s, g, n), and weights in int dA (s, g): all
    that is ``seen``, and as far as it counts. The outward normal of the other side is ``across`` (s, d), and ``before``
    is as in :class:`~bipot.tools.pieces.Pieces`.
    """

    flat: Ints
    own: Ints
    others: Ints
    psi: Floats
    mine: Floats
    its: Floats
    weight: Floats
    seen: Floats
    across: Floats
    before: Floats

    @staticmethod
    def of(nodes: Floats, sides: Sides, ring: bool, near: Near) -> Integrands:
        """Those where ``nodes`` (a, d) are at their present places; ``ring`` and ``near`` as of :func:`pieces_of`."""
        one, other, beyond = sides.one, sides.other, flats(sides.other, nodes.shape[1])
        found = pieces_of(nodes, one, other, ring, near)
        across = outward(nodes[beyond])[found.other]
        cosine = np.vecdot(outward(nodes[sides.flats])[found.one], across)
        share = np.clip((FACES - cosine) / (FACES - SQUARELY), 0.0, 1.0)
        if near is Near.WELDED:
            found, share = found._replace(weight=found.weight * (cosine <= WELDS)[:, None]), np.ones_like(share)
        return Integrands(
            flat=found.one,
            own=one[found.one // (len(sides.flats) // len(one))],
            others=other[found.other // (len(beyond) // len(other))],
            psi=found.mine,
            mine=shapes(found.mine, found.one, one.shape[1]),
            its=shapes(found.its, found.other, other.shape[1]),
            weight=found.weight * share[:, None],
            seen=found.weight,
            across=across,
            before=found.before,
        )


def pieces_of(nodes: Floats, one: Ints, other: Ints, ring: bool, near: Near = Near.OWN) -> Pieces:
    """The pieces of facets ``one`` (f, n) and ``other`` (g, n) that are ``near`` each other, with ``nodes`` at (a, d).

    In a plane it may be the meridian of a ``ring``.
    """
    if nodes.shape[1] == 2:
        return pieces(nodes, one, other, ring, near)
    return polygons(nodes[flats(one, 3)], nodes[flats(other, 3)], near)


def facing(nodes: Floats, sides: Sides, ring: bool, near: Near = Near.OWN) -> Facing:
    """The points of the ``sides`` with ``nodes`` at their present places (a, d); the rest as of :func:`pieces_of`."""
    found, count, corners = Integrands.of(nodes, sides, ring, near), len(sides.node), nodes[sides.flats]
    point = sides.point[found.flat]
    share = np.einsum("sg,sgp->sp", found.weight, found.psi)
    square = np.einsum("sg,sgp,sgp->sp", found.weight, found.psi, found.psi)
    area = _sums(point, share, count)
    seen = _sums(point, np.einsum("sg,sgp->sp", found.seen, found.psi), count)
    reach = _sums(point, square, count) / np.where(area > 0, area, 1.0)
    whole, faced = hat_integrals(corners, ring), np.zeros(corners.shape[:2])
    all_of = _sums(sides.point, whole, count)
    part = np.minimum(area / all_of, 1.0)
    np.add.at(faced, found.flat, share)
    unfaced = np.flatnonzero(part <= LEAST)
    theirs, ours, alone = np.zeros((3, count, nodes.shape[1]))
    out = outward(corners)
    np.add.at(theirs, point, share[..., None] * found.across[:, None])
    np.add.at(ours, point, -share[..., None] * out[found.flat][:, None])
    # Where nothing is faced, normals are those of all facets.
    np.add.at(alone, sides.point, -out[:, None])
    theirs[unfaced] = ours[unfaced] = alone[unfaced]
    squarely = area / np.where(seen > 0, seen, 1.0)
    # However high that is and however oblique, the other side does not end where it is no longer faced.
    before = np.minimum(_sums(sides.point, found.before, count) / all_of, 1.0) if near is Near.OWN else part
    normal = unit(before[:, None] * unit(theirs) + (1 - before[:, None]) * unit(ours))
    return Facing(
        _weights(found, point, area, unfaced, sides),
        normal,
        unfaced,
        part,
        _shares(sides, faced, whole),
        reach,
        squarely,
    )


def _shares(sides: Sides, faced: Floats, whole: Floats) -> Floats:
    """Parts (l, k) of int psi dA ``whole`` (l, k) that are ``faced`` (l, k), none of an edge on the axis.

    Of two corners that are one it is that of both.
    """
    one = sides.flats[:, -1] == sides.flats[:, -2]
    mine, all_of = faced.copy(), whole.copy()
    for of in (mine, all_of):
        of[one, -2:] = of[one, -2:].sum(axis=1, keepdims=True)
    return np.minimum(np.divide(mine, all_of, out=np.zeros_like(whole), where=all_of > 0), 1.0)


def _sums(point: Ints, values: Floats, count: int) -> Floats:
    """Sums (p,) at p = ``count`` points of ``values`` (s, k), each at its ``point`` (s, k)."""
    return np.asarray(np.bincount(point.ravel(), values.ravel(), count), np.float64)


def _weights(found: Integrands, point: Ints, area: Floats, unfaced: Ints, sides: Sides) -> sp.csr_matrix:
    """(D, -M) (p, a) by the ``point`` (s, k) of each hat function, and int psi dA (p,) over what is faced."""
    own = np.einsum("sg,sgp,sgk->spk", found.weight, found.psi, found.mine)
    others = -np.einsum("sg,sgp,sgk->spk", found.weight, found.psi, found.its)
    entries = [
        (of, *np.broadcast_arrays(point[:, :, None], at[:, None, :]))
        for of, at in ((own, found.own), (others, found.others))
    ]
    values, rows, columns = (np.concatenate([part[k].ravel() for part in entries]) for k in range(3))
    kept = ~np.isin(rows, unfaced)
    data = np.concatenate([values[kept] / area[rows[kept]], np.ones(len(unfaced))])
    place = np.concatenate([rows[kept], unfaced]), np.concatenate([columns[kept], sides.node[unfaced]])
    weights = sp.csr_matrix((data, place), shape=(len(area), len(sides.nodes)))
    weights.sum_duplicates()
    return weights


class Plane(Protocol):
    """A plane of symmetry."""

    @property
    def normal(self) -> Vector:
        """Unit normal."""
        ...

    def holds(self, points: Floats) -> Bools:
        """Which places ``points`` (n, d) are in it (n,)."""
        ...


def in_planes(normals: Floats, x: Floats, planes: Sequence[Plane]) -> Floats:
    """Unit ``normals`` (p, d) at x (p, d), in the ``planes`` of symmetry that hold x."""
    out = normals.copy()
    for plane in planes:
        there = plane.holds(x)
        out[there] = across(out[there], plane.normal)
    return unit(out)


def rounding(nodes: Floats, sides: Sides, found: Facing) -> Floats:
    """How much farther off (p,) the other side is where no more than its end reaches before a point, or it is oblique.

    With the longest edge or diagonal h from the point, its reach b and the part c that counts that is FILLET h (1 - c
    min(b/ROUND, 1))^2, as if the end were rounded. If a point that barely faces it felt all of it, whether it does
    could depend on whether it is felt. What is before the middle of an edge is no end, however thin it is.
    """
    ends = nodes[sides.flats]
    longest = norm(ends[:, :, None] - ends[:, None]).max(axis=2)
    size = np.zeros(len(found.reach))
    np.maximum.at(size, sides.point, longest)
    return FILLET * size * (1 - found.squarely * np.minimum(found.reach / ROUND, 1.0)) ** 2


def lowest(nodes: Floats, one: Ints, other: Ints, ring: bool) -> float:
    """The least gap between facets ``one`` (f, n) and ``other`` (g, n) that face each other; 0 if none is below it."""
    return float(pieces_of(nodes, one, other, ring).lowest.min(initial=0.0))
