r"""What a boundary in a plane faces, written a second time for the fuzz study: nothing of the library.

Edges are lines through their nodes: one straight part, or two where they have a node in the middle. At each place x(s)
of a part of the one boundary the nearest of the places y is faced, along the part's normal m, that are on parts of the
other one whose normals are against m, m . m' < -1/10. Those farther behind x than both parts are long are left out,
and those of which a third part of the one boundary, that turns away from x, is between, or is nearer than a tenth of
how far they are behind the first. Nor are those faced whose height over x, times the sine of the angle between both
parts, is more than 0.03 of the length of that of x. Where sides are welded this is the longer of both lengths, and
m . m' at most -0.4. Points are the nodes of the one boundary, two where it turns by more than 60 degrees at rest, with
hats psi over their parts, and

    w_pk = int psi_p N_k(x) dA / int psi_p dA,    w_pl = -int psi_p N_l(y) dA / int psi_p dA,    n_p ~ -int psi_p m dA

over what faces anything, with the shapes N of whole edges: parabolas where these have three nodes. The integrals are
sums over intervals of s between all ends seen, and all crossings of two parts, by Gauss' rule of four points, which is
exact. What is oblique counts less (:func:`squarely`), by c in the mean. Where the reach before a point, b = int psi_p^2
dA / int psi_p dA, is less than 0.1, or c < 1, the other side is farther off by 0.1 h (1 - c min(b/0.1, 1))^2, with the
longest part h that ends there, or way to another corner.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from studies.independent.element import Bools, Floats, Ints
from studies.independent.shapes import line

AGAINST, TURN = -0.1, np.deg2rad(60.0)
"""The largest m . m' of what is faced, and the largest turn at a point."""

WELDS = -0.4
"""The largest m . m' of what is welded."""

BESIDE = 0.1
"""How near to a third part, over how far it is behind the first, a place is before that one instead."""

STEEP = 0.03
"""How high what is faced may be, times the sine of the angle between both parts, over the length of the one."""

NOTHING = 1e-9
"""A point faces nothing if what does is no longer than this part of its edges."""

FOUR = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class Seen:
    """Points p at a ``node`` (p,) by the ``weights`` (p, a), with the ``normal`` (p, 2) into the body.

    Of the area around them the fraction ``part`` (p,) faces anything, ``farther`` (p,) off than it is; where none does,
    the weights are their nodes'. ``lowest`` is the least gap along normals of the boundary, zero if none is below.
    """

    node: Ints
    weights: Floats
    normal: Floats
    part: Floats
    farther: Floats
    lowest: float


@dataclass(frozen=True)
class Straight:
    """The straight parts (l,) of edges (f, n): the nodes of their ``ends`` (l, 2), their ``edge`` (l,) and its nodes.

    ``nodes`` (l, n) are those of the edge, of which the part is the one of number ``number`` (l,).
    """

    ends: Ints
    nodes: Ints
    number: Ints

    @staticmethod
    def of(edges: Ints) -> Straight:
        """Those of edges whose nodes are in their order from end to end."""
        count = edges.shape[1] - 1
        ends = np.concatenate([edges[:, k : k + 2] for k in range(count)])
        return Straight(ends, np.tile(edges, (count, 1)), np.repeat(np.arange(count), len(edges)))

    def shapes(self, part: int, place: Floats) -> Floats:
        """Shape functions (n, q) of the edge at places (q,), from 0 to 1 on a part of it."""
        count = self.nodes.shape[1]
        return line(2 * (self.number[part] + place) / (count - 1) - 1, count)[0]


def points(rest: Floats, edges: Ints) -> tuple[Ints, Ints]:
    """The node (p,) of each point of ``edges`` (f, 2), which run anticlockwise, and the points (f, 2) of their ends.

    They are in the order of their nodes; of two at a node that of the edge which begins there is first.
    """
    node, at = list[int](), np.empty(edges.shape, dtype=np.intp)
    along = rest[edges[:, 1]] - rest[edges[:, 0]]
    for a in np.unique(edges):
        begins, ends = np.flatnonzero(edges[:, 0] == a), np.flatnonzero(edges[:, 1] == a)
        if begins.size and ends.size:
            one, other = along[ends[0]], along[begins[0]]
            turns = abs(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other)) > TURN
        else:
            turns = False
        at[begins, 0] = len(node)
        node.append(int(a))
        if turns:
            node.append(int(a))
        at[ends, 1] = len(node) - 1
    return np.array(node, dtype=np.intp), at


def squarely(cosine: float, welded: bool) -> float:
    """How much of it counts what is faced with normals at an angle of this ``cosine``: all at more than 120 degrees.

    Nothing at :data:`AGAINST`, and in proportion in between. Of what is ``welded`` all counts from :data:`WELDS` on.
    """
    if welded:
        return float(cosine <= WELDS)
    return float(np.clip((AGAINST - cosine) / (AGAINST + 0.5), 0.0, 1.0))


def seen(rest: Floats, nodes: Floats, one: Ints, other: Ints, axisymmetric: bool, *, welded: bool = False) -> Seen:
    """The points of edges ``one`` (f, n) that face edges ``other`` (g, n), with nodes at ``nodes`` (a, 2)."""
    own, others = Straight.of(one), Straight.of(other)
    node, at = points(rest, own.ends)
    weights, normal, free = np.zeros((len(node), len(nodes))), np.zeros((len(node), 2)), np.zeros((len(node), 2))
    across, (area, square, there, before, whole) = np.zeros((len(node), 2)), np.zeros((5, len(node)))
    x, y, lowest = nodes[own.ends], nodes[others.ends], 0.0
    outer, facing = (_normals(of) for of in (x, y))
    for i, (start, end) in enumerate(x):
        t, length = (end - start) / np.linalg.norm(end - start), float(np.linalg.norm(end - start))
        free[at[i]] -= outer[i]
        s, h = ((y - start) @ t) / length, (y - start) @ outer[i]
        chosen = (facing @ outer[i] < AGAINST) & (
            h.min(axis=1) + length + np.linalg.norm(y[:, 1] - y[:, 0], axis=1) > 0
        )
        s, h, k = s[chosen], h[chosen], np.flatnonzero(chosen)
        cuts = np.unique(np.clip(np.concatenate([[0.0, 1.0], s.ravel(), _crossings(s, h)]), 0.0, 1.0))
        for low, high in pairwise(cuts.tolist()):
            whole[at[i]] += _hats(low, high, start, end, length, axisymmetric)[1]
            nearest = _nearest(s, h, (low + high) / 2, start, t * length, outer, x, i)
            if nearest is None:
                continue
            if high - low > NOTHING:
                lowest = min(lowest, *np.interp([low, high], *_rising(s[nearest], h[nearest])))
            before[at[i]] += _hats(low, high, start, end, length, axisymmetric)[1]
            rise, run = np.diff(h[nearest])[0], np.diff(s[nearest])[0] * length
            other_length = float(np.hypot(rise, run))
            most = STEEP * (max(length, other_length) if welded else length)
            part = _before((low, high), s[nearest], h[nearest], most, abs(float(rise)) / other_length)
            if part is None:
                continue
            (place, weight), parts = _hats(*part, start, end, length, axisymmetric)
            counted = squarely(facing[k[nearest]] @ outer[i], welded)
            if not counted:
                continue
            there[at[i]] += parts
            weight, parts = counted * weight, counted * parts
            eta = (place - s[nearest, 0]) / (s[nearest, 1] - s[nearest, 0])
            area[at[i]] += parts
            normal[at[i]] -= parts[:, None] * outer[i]
            across[at[i]] += parts[:, None] * facing[k[nearest]]
            mine, its = own.shapes(i, place), others.shapes(int(k[nearest]), eta)
            for p, psi in zip(at[i], (1 - place, place), strict=True):
                square[p] += weight @ psi**2
                weights[p, own.nodes[i]] += mine @ (weight * psi)
                weights[p, others.nodes[k[nearest]]] -= its @ (weight * psi)
    faces: Bools = area > NOTHING * whole
    weights[faces] /= area[faces, None]
    weights[~faces] = np.eye(len(nodes))[node[~faces]]
    part = np.where(faces, area / whole, 0.0)
    inward, other_side = (_unit(np.where(faces[:, None], of, free)) for of in (normal, across))
    # Gaps change along the normals of the other side, as far as that goes on; beyond its end along those of this one.
    # It does not end where it is too high or too oblique.
    on = (part if welded else np.where(faces, np.minimum(before / whole, 1.0), 0.0))[:, None]
    mixed = _unit(on * other_side + (1 - on) * inward)
    reach, counts = (np.divide(a, b, out=np.zeros(len(node)), where=b > 0) for a, b in ((square, area), (area, there)))
    return Seen(node, weights, mixed, part, farther(x, at, reach, counts), lowest)


def farther(x: Floats, at: Ints, reach: Floats, counts: Floats) -> Floats:
    """How much farther off (p,) what has this ``reach`` (p,) is, with corners x (l, k, d) around points ``at`` (l, k).

    The part that ``counts`` (p,) is less than one of what is oblique.

    >>> farther(np.array([[[0.0, 0.0], [3.0, 4.0]]]), np.array([[0, 1]]), np.array([0.05, 1.0]), np.ones(2)).tolist()
    [0.125, 0.0]
    """
    longest = np.zeros(len(reach))
    for corners, points_there in zip(x, at, strict=True):
        for corner, p in zip(corners, points_there, strict=True):
            longest[p] = max(longest[p], *(float(np.linalg.norm(corner - other)) for other in corners))
    return 0.1 * longest * (1 - counts * np.minimum(reach / 0.1, 1.0)) ** 2


def _unit(vectors: Floats) -> Floats:
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def _normals(x: Floats) -> Floats:
    """Outer ones (f, 2) of edges (f, 2, 2) with the body on the left."""
    along = x[:, 1] - x[:, 0]
    return np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]


def _crossings(s: Floats, h: Floats) -> Floats:
    """Places where edges over s (k, 2) at the heights h (k, 2) are equally high."""
    slope = (h[:, 1] - h[:, 0]) / (s[:, 1] - s[:, 0])
    base = h[:, 0] - slope * s[:, 0]
    i, j = np.triu_indices(len(s), 1)
    apart = slope[i] != slope[j]
    return (base[j] - base[i])[apart] / (slope[i] - slope[j])[apart]


def _rising(s: Floats, h: Floats) -> tuple[Floats, Floats]:
    """Ends and heights (2,) of a part in the order of its ends s."""
    order = np.argsort(s)
    return s[order], h[order]


def _before(bounds: tuple[float, float], s: Floats, h: Floats, most: float, sine: float) -> tuple[float, float] | None:
    """Where in the ``bounds`` a part over s (2,) at the heights h (2,) is no higher than ``most`` over the ``sine``."""
    low, high = bounds
    if sine * h.max() > most:
        ends = s[np.argsort(h)]
        bound = ends[0] + (most / sine - h.min()) / np.ptp(h) * (ends[1] - ends[0])
        low, high = (low, min(high, bound)) if ends[0] < ends[1] else (max(low, bound), high)
    return (low, high) if high > low else None


def _hats(
    low: float, high: float, start: Floats, end: Floats, length: float, axisymmetric: bool
) -> tuple[tuple[Floats, Floats], Floats]:
    """Places and weights (4,) of the rule on an interval of an edge, and the integrals (2,) of its two hats."""
    place, weight = low + (high - low) * (FOUR[0] + 1) / 2, FOUR[1] * (high - low) / 2 * length
    if axisymmetric:
        weight = weight * (start[0] + place * (end[0] - start[0]))
    return (place, weight), np.array([weight @ (1 - place), weight @ place])


def _nearest(
    s: Floats, h: Floats, at: float, start: Floats, along: Floats, outer: Floats, x: Floats, own: int
) -> int | None:
    """Which of the edges over s (k, 2) at heights h (k, 2) the place ``at`` of the edge ``own`` of x (f, 2, 2) sees."""
    over = np.flatnonzero((s.min(axis=1) < at) & (at < s.max(axis=1)))
    if not over.size:
        return None
    height = h[over, 0] + (at - s[over, 0]) / (s[over, 1] - s[over, 0]) * (h[over, 1] - h[over, 0])
    place, kept = start + at * along, np.ones(len(over), dtype=bool)
    for k, depth in enumerate(-height):
        if depth > 0:
            between = _behind(place, -outer[own], depth, x[outer @ outer[own] < 0])
            others = np.delete(x, own, axis=0) if depth > NOTHING * float(np.linalg.norm(along)) else x[:0]
            kept[k] = not (between or _beside(place - depth * outer[own], BESIDE * depth, others))
    over, height = over[kept], height[kept]
    return int(over[np.argmin(height)]) if over.size else None


def _behind(place: Floats, way: Floats, depth: float, x: Floats) -> bool:
    """Whether one of the edges x (f, 2, 2) is met on the ``way`` from a place, before the ``depth``."""
    for a, b in x:
        matrix = np.column_stack([way, a - b])
        if abs(np.linalg.det(matrix)) > 0:
            far, s = np.linalg.solve(matrix, a - place)
            if 0 < far < depth and 0 <= s <= 1:
                return True
    return False


def _beside(place: Floats, near: float, x: Floats) -> bool:
    """Whether a place is nearer than ``near`` to the line of one of the edges x (f, 2, 2), between its ends."""
    for a, b in x:
        along = (b - a) / np.linalg.norm(b - a)
        across = np.array([along[1], -along[0]])
        if abs((place - a) @ across) < near and 0 <= (place - a) @ along <= (b - a) @ along:
            return True
    return False
