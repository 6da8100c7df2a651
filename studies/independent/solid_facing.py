r"""What faces in space face, written a second time for the fuzz study: nothing of the library.

Faces are triangles and squares, or flat parts of such with nodes in the middle of their edges, whose shape functions N
are quadratic (:mod:`studies.independent.flats`); of a square two corners may be one. Seen along the normal m of its
mean plane, a triangle or square of the one boundary has polygons in common with faces of the other one whose normals m'
are against it, m . m' < -1/10, and which are not farther behind it than both are large. Of polygons over each other the
lowest counts, and none that a third face of the one boundary, which turns away, is before, or that is nearer to a third
face than a tenth of how far it is behind the first. Where the mean plane of what is faced is higher than 0.03 of the
longest edge or diagonal of the one face, of both where they are welded, over the sine of the angle between both,
nothing is. Points are the corners of the one boundary, of faces that go on from each other by no more than 60 degrees
at rest over common edges, with their shape functions psi, and

    w_pk = int psi_p N_k(x) dA / int psi_p dA,    w_pl = -int psi_p N_l(y) dA / int psi_p dA,

over the polygons, places on squares by the inverse of their bilinear map. The normal of a point is the mean of m', with
weights int psi_p dA, over what it faces, and of -m for the part of its area before which there is nothing. Where sides
are not welded that is neither what is too high nor what is too oblique.

On triangles and parallelograms integrands are polynomials of degree five, and all rules here are exact. On others they
are rational, and the rule of seven points that is exact up to this degree, on triangles into which polygons are cut, is
a little off, by how they are cut: what such :data:`ROUGH` rules differ by from a fine one tells how far an answer by a
rule of that degree may be from the law.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.independent.data import Bools, Floats, Ints
from studies.independent.facing import AGAINST, BESIDE, STEEP, farther, squarely
from studies.independent.fans import spread
from studies.independent.flats import Flats
from studies.independent.polygons import area_of, centroid, clipped, cross, kept

NOTHING = 1e-9
"""The part of an area below which it is none."""

ROUGH = (0, 1, 2, 3, 4)
"""Of which corner polygons are cut into triangles, or of their middle."""

ROUND_OFF = 1e-12
"""Over a length: what is no farther on the wrong side of an edge is on it."""


@dataclass(frozen=True)
class SeenInSpace:
    """Points p at a ``node`` (p,) by the ``weights`` (p, a), with the ``normal`` (p, 3) into the body.

    Of the area around them the fraction ``part`` (p,) faces anything, ``farther`` (p,) off than it is
    (:func:`studies.independent.facing.farther`); where none does, the weights are their nodes'.
    ``lowest`` is the least gap at corners of polygons along normals of the boundary, zero if none is below.
    """

    node: Ints
    weights: Floats
    normal: Floats
    part: Floats
    farther: Floats
    lowest: float


@dataclass(frozen=True)
class _Face:
    """A face in the mean plane of one: ``flat`` (k, 2) places of its corners, and their heights ``above`` it (k,)."""

    flat: Floats
    above: Floats
    twice: bool

    @staticmethod
    def of(corners: Floats, middle: Floats, axes: Floats) -> _Face:
        """That of corners (k, 3), from a ``middle`` (3,), along the rows of ``axes`` (3, 3), the normal last.

        Where the last corner is there twice, it is that once, and its second shape function is zero.
        """
        twice = bool((corners[-1] == corners[-2]).all())
        x = (corners[: len(corners) - twice] - middle) @ axes.T
        return _Face(x[:, :2], x[:, 2], twice)

    def shapes(self, places: Floats) -> Floats:
        """Shape functions (q, k) where the face is seen at ``places`` (q, 2)."""
        if len(self.flat) == 3:
            matrix = np.vstack([self.flat.T, np.ones(3)])
            found = np.linalg.solve(matrix, np.vstack([places.T, np.ones(len(places))])).T
            return np.asarray(np.hstack([found, np.zeros((len(places), int(self.twice)))]), np.float64)
        s = np.zeros_like(places)
        for _ in range(30):
            N, d = _square(s)
            off = places - N @ self.flat
            if np.abs(off).max(initial=0.0) <= 1e-15 * np.abs(self.flat).max():
                break
            s = s + np.linalg.solve((np.einsum("qkr,ki->qir", d, self.flat)), off[..., None])[..., 0]
        return _square(s)[0]

    def height(self, places: Floats) -> Floats:
        """How high (q,) the face is above the plane at ``places`` (q, 2)."""
        return self.shapes(places)[:, : len(self.above)] @ self.above

    def holds(self, place: Floats) -> bool:
        """Whether it is seen at a ``place`` (2,), with corners in either turn."""
        side = cross(np.roll(self.flat, -1, axis=0) - self.flat, place - self.flat)
        return bool((side > 0).all() or (side < 0).all())


def seen(
    rest: Floats, nodes: Floats, one: Ints, other: Ints, rough: int | None = None, *, welded: bool = False
) -> SeenInSpace:
    """The points of faces ``one`` (f, n) that face faces ``other`` (g, n), with nodes at ``nodes`` (a, 3).

    Corners run anticlockwise as seen from outside. The rule is fine, or one of those that are :data:`ROUGH`.
    """
    mine_of, its_of = Flats(one), Flats(other)
    flats, others = mine_of.nodes, its_of.nodes
    node, at = points(rest, flats)
    count, rule = len(node), _fine() if rough is None else _of_seven()
    weights, (area, square, there, before, whole) = np.zeros((count, len(nodes))), np.zeros((5, count))
    across, inward, alone = np.zeros((3, count, 3))
    outer, facing = (np.array([_normal(x) for x in nodes[of]]) for of in (flats, others))
    lowest = 0.0
    for i, face in enumerate(flats):
        np.add.at(whole, at[i], _hats(nodes[face], 6 if rough is None else 2))
        np.add.at(alone, at[i], -outer[i])
        mine, found = _before(nodes, flats, others, outer, facing, i)
        for j, its, polygon in found:
            lowest = min(lowest, *its.height(polygon), *its.height(polygon.mean(axis=0)[None]))
            places, weight = _over(polygon, rule, rough or 0)
            np.add.at(before, at[i], weight @ mine.shapes(places))
            if len(polygon := _low(nodes[face], nodes[others[j]], (outer[i], facing[j]), polygon, welded)) < 3:
                continue
            places, weight = _over(polygon, rule, rough or 0)
            psi, theirs, counted = mine.shapes(places), its.shapes(places), squarely(facing[j] @ outer[i], welded)
            if not counted:
                continue
            np.add.at(there, at[i], weight @ psi)
            weight *= counted
            share = weight @ psi
            # A point may be at two corners that are one.
            np.add.at(area, at[i], share)
            np.add.at(square, at[i], weight @ psi**2)
            np.add.at(across, at[i], share[:, None] * facing[j])
            np.add.at(inward, at[i], -share[:, None] * outer[i])
            for k, p in enumerate(at[i]):
                weights[p, mine_of.whole(i)] += (weight * psi[:, k]) @ mine_of.shapes(i, psi)
                weights[p, its_of.whole(j)] -= (weight * psi[:, k]) @ its_of.shapes(j, theirs)
    part = np.minimum(area / whole, 1.0)
    faces: Bools = part > NOTHING
    weights[faces] /= area[faces, None]
    weights[~faces] = np.eye(len(nodes))[node[~faces]]
    # The other side does not end where it is too high or too oblique.
    on = np.where(faces, part if welded else np.minimum(before / whole, 1.0), 0.0)[:, None]
    away, own = (_unit(np.where(faces[:, None], of, alone)) for of in (across, inward))
    normal = _unit(on * away + (1 - on) * own)
    reach, counts = (a / np.where(b > 0, b, 1) for a, b in ((square, area), (area, there)))
    off = farther(nodes[flats], at, reach, counts)
    return SeenInSpace(node, weights, normal, np.where(faces, part, 0.0), off, lowest)


def points(rest: Floats, faces: Ints) -> tuple[Ints, Ints]:
    """The node (p,) of each point of ``faces`` (f, k), and the points (f, k) of their corners.

    They are in the order of their nodes, and at a node in that of their first faces.
    """
    normal = np.repeat(np.array([_normal(x) for x in rest[faces]])[:, None], faces.shape[1], axis=1)
    at, node = np.full(faces.shape, -1, dtype=np.intp), list[int]()
    for a, f, k in sorted((int(a), f, k) for f, face in enumerate(faces) for k, a in enumerate(face)):
        if at[f, k] < 0:
            for g, j in spread(faces, normal, f, k):
                at[g, j] = len(node)
            node.append(a)
    return np.array(node, dtype=np.intp), at


def _before(
    nodes: Floats, one: Ints, other: Ints, outer: Floats, facing: Floats, i: int
) -> tuple[_Face, list[tuple[int, _Face, Floats]]]:
    """The i-th face, and what it faces: the number of each face, this as seen, and the polygon (v, 2) in common."""
    x = nodes[one[i]]
    middle, axes = _plane(x, outer[i])
    mine, found = _Face.of(x, middle, axes), list[tuple[int, _Face, Floats]]()
    for j in np.flatnonzero(facing @ outer[i] < AGAINST):
        y = nodes[other[j]]
        both = np.linalg.norm(x - middle, axis=1).max() + np.linalg.norm(y - y.mean(axis=0), axis=1).max()
        its = _Face.of(y, middle, axes)
        if its.above.mean() <= -both:
            continue
        polygon = clipped(mine.flat, its.flat[::-1])
        if len(polygon) > 2 and area_of(polygon) > NOTHING * area_of(mine.flat):
            found.append((int(j), its, polygon))
    return mine, [piece for piece in found if _shown(nodes, one, outer, i, (middle, axes), piece, found)]


def _shown(
    nodes: Floats,
    one: Ints,
    outer: Floats,
    i: int,
    plane: tuple[Floats, Floats],
    piece: tuple[int, _Face, Floats],
    every: list[tuple[int, _Face, Floats]],
) -> bool:
    """Whether at the middle of a piece neither a lower one nor a face of the one boundary is before it."""
    j, its, polygon = piece
    place = centroid(polygon)
    height = float(its.height(place[None])[0])
    if any(k != j and of.holds(place) and of.height(place[None])[0] < height for k, of, _ in every):
        return False
    for f in np.flatnonzero(outer @ outer[i] < -ROUND_OFF):
        face = _Face.of(nodes[one[f]], *plane)
        if height < 0 and face.holds(place) and height < face.height(place[None])[0] < 0:
            return False
    deepest, x = plane[0] + np.append(place, height) @ plane[1], nodes[one]
    if height >= -NOTHING * float(np.linalg.norm(x[i] - plane[0], axis=1).max()):
        return True
    return not any(f != i and _beside(deepest, -BESIDE * height, x[f], outer[f]) for f in range(len(one)))


def _low(x: Floats, y: Floats, normals: tuple[Floats, Floats], polygon: Floats, welded: bool) -> Floats:
    """The corners (w, 2) of what is left of a polygon (v, 2) in the mean plane of x (k, 3) where that of y is low."""
    middle, axes = _plane(x, normals[0])
    normal, way = axes @ normals[1], axes @ (y.mean(axis=0) - middle)
    sine = float(np.linalg.norm(normal[:2]))
    most = STEEP * max(float(np.linalg.norm(a - b)) for of in ((x, y) if welded else (x,)) for a in of for b in of)
    above = [sine * float((normal @ way - normal[:2] @ place) / normal[2]) - most for place in polygon]
    return np.array(kept(list(polygon), above)).reshape(-1, 2)


def _plane(x: Floats, outer: Floats) -> tuple[Floats, Floats]:
    """The middle (3,) of a face x (k, 3) and axes (3, 3), the last along its normal ``outer`` (3,)."""
    along = x[1] - x[0]
    first = _unit((along - (along @ outer) * outer)[None])[0]
    return x.mean(axis=0), np.array([first, np.cross(outer, first), outer], np.float64)


def _beside(place: Floats, near: float, x: Floats, outer: Floats) -> bool:
    """Whether a place (3,) is nearer than ``near`` to the mean plane of a face x (k, 3), over or beneath the face."""
    middle, axes = _plane(x, outer)
    seen = axes @ (place - middle)
    return bool(abs(seen[2]) < near and _Face.of(x, middle, axes).holds(seen[:2]))


def _over(polygon: Floats, rule: tuple[Floats, Floats], corner: int) -> tuple[Floats, Floats]:
    """Places (q, 2) and weights (q,) of a rule on triangles of a polygon (v, 2), with its middle, 0, or a corner."""
    apex = polygon[(corner - 1) % len(polygon)] if corner else polygon.mean(axis=0)
    sides = np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1) - apex
    places, weight = apex + rule[0] @ sides, cross(sides[:, 0], sides[:, 1])[:, None] * rule[1]
    return places.reshape(-1, 2), weight.ravel()


def _of_seven() -> tuple[Floats, Floats]:
    """Places (7, 2) and weights (7,) on the triangle of (0, 0), (1, 0), (0, 1), exact up to degree five."""
    out, weight = [(1 / 3, 1 / 3)], [9 / 80]
    for root in (15.0**0.5, -(15.0**0.5)):
        a = (6 + root) / 21
        out += [(a, a), (1 - 2 * a, a), (a, 1 - 2 * a)]
        weight += 3 * [(155 + root) / 2400]
    return np.array(out), np.array(weight)


def _fine() -> tuple[Floats, Floats]:
    """Places (q, 2) and weights (q,) there up to degree ten: a square's, six points a side, one of which is a point."""
    s, w = np.polynomial.legendre.leggauss(6)
    s, w = (s + 1) / 2, w / 2
    x, y = np.meshgrid(s, s, indexing="ij")
    return np.column_stack([(x * (1 - y)).ravel(), (x * y).ravel()]), (np.outer(w, w) * x).ravel()


def _hats(x: Floats, count: int) -> Floats:
    """int psi dA (k,) of a face with corners x (k, 3), of a square by so many points a side."""
    if len(x) == 3:
        return np.full(3, float(np.linalg.norm(np.cross(x[1] - x[0], x[2] - x[0]))) / 6)
    s, w = np.polynomial.legendre.leggauss(count)
    N, d = _square(np.stack(np.meshgrid(s, s, indexing="ij"), axis=-1).reshape(-1, 2))
    return (np.outer(w, w).ravel() * np.linalg.norm(np.cross(d[..., 0] @ x, d[..., 1] @ x), axis=1)) @ N


def _square(s: Floats) -> tuple[Floats, Floats]:
    """Bilinear shape functions (q, 4) on the square [-1, 1]^2 at s (q, 2), and their derivatives (q, 4, 2)."""
    a, b = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])
    x, y = (1 + a * s[:, :1]) / 2, (1 + b * s[:, 1:]) / 2
    return x * y, np.stack([a / 2 * y, b / 2 * x], axis=-1)


def _normal(x: Floats) -> Floats:
    """Unit normal (3,) of the mean plane of a face (k, 3)."""
    ways = (x[1] - x[0], x[2] - x[0]) if len(x) == 3 else (x[2] - x[0], x[3] - x[1])
    return _unit(np.cross(*ways)[None])[0]


def _unit(vectors: Floats) -> Floats:
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]
