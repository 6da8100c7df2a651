"""Pieces of two boundaries in space that face each other.

Faces are the flat parts of :mod:`bipot.tools.flats`. Where two of them overlap, seen along the normal of the mean plane
of one, the polygon that they have in common is cut into triangles from its centroid. Places on squares are those of
their bilinear shape functions. Integration is exact on triangles and parallelograms; on other squares integrands are
rational, and what is left out nearly cancels between the triangles around a centroid.
"""

from __future__ import annotations

import numpy as np

from bipot.tensors import norm, unit
from bipot.tools.flats import SQUARE, bilinear, outward
from bipot.tools.pieces import FACES, LEAST, TOUCHES, Near, Pieces
from bipot.tools.plane import area_of, cross
from bipot.typing import Bools, Floats, Ints, max_abs

BLOCK = 2_000_000
"""Pairs of faces that are looked at together."""

ROUND_OFF = 1e-12
"""Areas over the square of a side, and sines of angles, that are zero."""

STEPS = 6
"""The most steps of Newton's method for a place on a square: one is needed on parallelograms."""

PLACED = 8 * float(np.finfo(float).eps)
"""Over the size of a square, an error of such a place that is round-off."""

BILINEAR = np.stack([SQUARE[:, 0], SQUARE[:, 1], SQUARE[:, 0] * SQUARE[:, 1]])
"""Four times the coefficients (3, 4) of xi, eta and xi eta by the corners of a square."""

ROOTS = np.array([-1.0, 1.0]) * np.sqrt(15.0)
RULE = np.array([(1 / 3, 1 / 3, 1 / 3), *(np.roll([1 - 2 * b, b, b], k) for b in (6 + ROOTS) / 21 for k in range(3))])
"""Barycentric places (7, 3) on a triangle of Radon's rule, which is exact for polynomials of degree five."""

SHARES = np.array([9 / 40, *np.repeat((155 + ROOTS) / 1200, 3)])
"""Its weights (7,) in the mean."""


def polygons(one: Floats, other: Floats, near: Near = Near.OWN) -> Pieces:
    """The polygons in which faces ``one`` (f, k, 3) and ``other`` (g, l, 3) face each other, cut into triangles.

    Seen along the normals of the former, of several faces before one place the nearest counts, and none that is farther
    behind it than both are large, or behind the other side of a thin part. What is higher than
    ``near`` allows is cut off. The least gap of a triangle is that of its polygon.
    """
    out = outward(one)
    i, j = _near(one, other, out, outward(other))
    a, b = (seen(one[i], of) for of in (one[i], other[j]))
    height = np.einsum("px,pvx->pv", out[i], other[j] - one[i].mean(axis=1, keepdims=True))
    ends = _common(a, b[:, ::-1])
    middle = _centroids(ends)[:, None]
    whole = area_of(a)
    share = area_of(ends) / whole
    some = np.flatnonzero(share > LEAST)
    gaps = np.einsum("pvk,pk->pv", _placed(b[some], np.concatenate([ends, middle], axis=1)[some]), height[some])
    lowest = np.zeros(len(i))
    lowest[some] = gaps.min(axis=1)
    before = ~_through(one, out, i[some], middle[some, 0], -gaps[:, -1])
    some, above = some[before], gaps[before, -1]
    kept = some[~_hidden(i[some], b[some], middle[some, 0], above, share[some])]
    piece, fans, faced = _cut(one, other, i[kept], j[kept], ends[kept], near)
    area = area_of(fans)
    some = np.flatnonzero(area > LEAST**2 * whole[kept[piece]])
    piece, places = kept[piece[some]], RULE @ fans[some]
    weight, none = area[some, None] * SHARES, np.zeros(one.shape[:2])
    mine, its = _placed(a[piece], places), _placed(b[piece], places)
    return Pieces.of(Pieces(i[piece], j[piece], mine, its, weight, lowest[piece], none), faced[some])


def _cut(one: Floats, other: Floats, i: Ints, j: Ints, ends: Floats, near: Near) -> tuple[Ints, Floats, Bools]:
    """Triangles (t, 3, 2) of polygons ``ends`` (p, v, 2), whose each is, and which are before faces and not beside.

    Beside is what ``near`` does not allow, by the mean plane of the other face.
    """
    frame, normal = _axes(one[i]), outward(other)[j]
    along = np.einsum("pax,px->pa", frame, normal)
    mine, its = (norm(of[:, :, None] - of[:, None]).max(axis=(1, 2)) for of in (one, other))
    # n . (x - c) = 0 with the other's normal n and mean c, from the mean of the one.
    way, down = other[j].mean(axis=1) - one[i].mean(axis=1), np.vecdot(normal, outward(one)[i])
    height = (np.vecdot(way, normal)[:, None] - np.einsum("pva,pa->pv", ends, along)) / down[:, None]
    beyond = height * norm(along)[:, None] - near.highest(mine[i], its[j])[:, None]
    before, beside = (beyond <= 0).all(axis=1), (beyond >= 0).all(axis=1)
    some = ~before & ~beside
    low, high = (_less(ends[some], sign * beyond[some]) for sign in (1, -1))
    away = beside & ~before
    parts = [(before, ends[before]), (some, low), (some, high), (away, ends[away])]
    fans = [_fans(polygon) for _, polygon in parts]
    count = [of.shape[1] for of in fans]
    whose = [np.repeat(np.flatnonzero(of), many) for (of, _), many in zip(parts, count, strict=True)]
    faced = np.arange(sum(map(len, whose))) < len(whose[0]) + len(whose[1])
    return np.concatenate(whose), np.concatenate([of.reshape(-1, 3, 2) for of in fans]), faced


def _fans(ends: Floats) -> Floats:
    """Triangles (p, v, 3, 2) around the centroids of polygons (p, v, 2)."""
    middle = np.broadcast_to(_centroids(ends)[:, None], ends.shape)
    return np.stack([middle, ends, np.roll(ends, -1, axis=1)], axis=2)


def _less(ends: Floats, beyond: Floats) -> Floats:
    """Convex polygons (p, 2 v, 2), some corners more than once: those ``ends`` (p, v, 2) less where ``beyond`` > 0."""
    after, then = np.roll(ends, -1, axis=1), np.roll(beyond, -1, axis=1)
    kept, leaves = beyond <= 0, (beyond <= 0) & (then > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = ends + (beyond / (beyond - then))[..., None] * (after - ends)
    last = bound[np.arange(len(ends)), np.argmax(leaves, axis=1)][:, None]
    first = np.where(kept[..., None], ends, np.where((then <= 0)[..., None], bound, last))
    return np.stack([first, np.where(leaves[..., None], bound, first)], axis=2).reshape(len(ends), 2 * ends.shape[1], 2)


def _near(one: Floats, other: Floats, out: Floats, beyond: Floats) -> tuple[Ints, Ints]:
    """Faces (p,) of either side that may have a polygon in common, by the spheres around them, block by block."""
    # From the mean of the one side, so that differences of squares have no more round-off than those.
    middle = [of.mean(axis=1) - one.mean(axis=(0, 1)) for of in (one, other)]
    reach = [norm(of - of.mean(axis=1, keepdims=True)).max(axis=1) for of in (one, other)]
    square = [np.vecdot(of, of) for of in middle]
    found = list[tuple[Ints, Ints]]()
    step = max(1, BLOCK // max(1, len(other)))
    for start in range(0, len(one), step):
        block = slice(start, start + step)
        height = out[block] @ middle[1].T - np.vecdot(out, middle[0])[block, None]
        beside = square[0][block, None] + square[1] - 2 * middle[0][block] @ middle[1].T - height**2
        both = reach[0][block, None] + reach[1]
        f, g = np.nonzero((out[block] @ beyond.T < FACES) & (beside < both**2) & (height > -both))
        found.append((f + start, g))
    return np.concatenate([f for f, _ in found]), np.concatenate([g for _, g in found])


def _axes(faces: Floats) -> Floats:
    """Two axes (f, 2, 3) in the mean planes of faces (f, k, 3), anticlockwise seen from outside."""
    out, along = outward(faces), faces[:, 1] - faces[:, 0]
    along = unit(along - np.vecdot(along, out)[:, None] * out)
    return np.stack([along, np.cross(out, along)], axis=1)


def _centroids(corners: Floats) -> Floats:
    """Centroids (p, 2) of polygons (p, k, 2), means of the corners where there is no area."""
    first = corners - corners[:, :1]
    area = cross(first, np.roll(first, -1, axis=1))
    whole, moment = area.sum(axis=1), np.einsum("pk,pka->pa", area, first + np.roll(first, -1, axis=1)) / 3
    none = whole <= ROUND_OFF * (first**2).sum(axis=2).max(axis=1)
    whole = np.where(none, 1.0, whole)
    return np.where(none[:, None], corners.mean(axis=1), corners[:, 0] + moment / whole[:, None])


def _common(a: Floats, b: Floats) -> Floats:
    """The corners (p, k + l + k l, 2), some more than once, of what a (p, k, 2) and b (p, l, 2) have in common.

    All are convex and run anticlockwise.
    """
    edge_a, edge_b = (np.roll(of, -1, axis=1) - of for of in (a, b))
    way, pairs = b[:, None] - a[:, :, None], a.shape[1] * b.shape[1]
    det = cross(edge_a[:, :, None], edge_b[:, None])
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = cross(way, edge_b[:, None]) / det, cross(way, edge_a[:, :, None]) / det
    scale = norm(edge_a)[:, :, None] * norm(edge_b)[:, None]
    met = (np.abs(det) > ROUND_OFF * scale) & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    crossing = a[:, :, None] + np.where(met, s, 0.0)[..., None] * edge_a[:, :, None]
    points = np.concatenate([a, b, crossing.reshape(len(a), pairs, 2)], axis=1)
    valid = np.concatenate([inside(a, b), inside(b, a), met.reshape(len(a), pairs)], axis=1)
    first = points[np.arange(len(a)), np.argmax(valid, axis=1)]
    points = np.where(valid[..., None], points, first[:, None])
    off = points - points.mean(axis=1, keepdims=True)
    order = np.argsort(np.arctan2(off[..., 1], off[..., 0]), axis=1)
    return np.take_along_axis(points, order[..., None], axis=1)


def inside(points: Floats, polygon: Floats) -> Bools:
    """Which points (p, v, 2) are in convex polygons (p, k, 2), which run anticlockwise, or on their edges."""
    edges = np.roll(polygon, -1, axis=1) - polygon
    side = cross(edges[:, None], points[:, :, None] - polygon[:, None])
    return np.asarray((side >= -ROUND_OFF * (norm(edges) ** 2)[:, None]).all(axis=2))


def _hidden(i: Ints, b: Floats, middle: Floats, above: Floats, share: Floats) -> Bools:
    """Pieces (p,) of the faces ``i`` (p,) behind another one, by their middles (p, 2) at heights ``above`` (p,).

    Other faces are at b (p, k, 2). Only faces that are covered more than once, by the ``share`` (p,) of their area in
    each piece, have such pieces.
    """
    hidden = np.zeros(len(i), dtype=bool)
    for face in np.flatnonzero(np.bincount(i, share) > 1 + 1e-6):
        mine = np.flatnonzero(i == face)
        over = inside(np.broadcast_to(middle[mine], (len(mine), len(mine), 2)), b[mine, ::-1])
        hidden[mine] = (over & (above[mine, None] < above[mine])).any(axis=0)
    return hidden


def _through(one: Floats, out: Floats, i: Ints, middle: Floats, depth: Floats) -> Bools:
    """Whether others of the faces ``one`` (f, k, 3) lie before the ``depth`` (p,) behind places on faces i (p,).

    The faces have the outward normals ``out`` (f, 3); others are those through which one leaves the part there, or that
    the place at the depth touches. Places are ``middle`` (p, 2) in mean planes.
    """
    hidden, centre = np.zeros(len(i), dtype=bool), one.mean(axis=1)
    reach = norm(one - centre[:, None]).max(axis=1)
    deep = np.flatnonzero(depth > LEAST * reach[i])
    mine, depth = i[deep], depth[deep]
    x = centre[mine] + np.einsum("pa,pax->px", middle[deep], _axes(one[mine]))
    # Those that may touch the sphere around the way to the depth.
    p, f = within_reach(centre, x - depth[:, None] / 2 * out[mine], reach.max() + depth / 2)
    ahead, deepest = -out[mine[p]], x[p] - depth[p, None] * out[mine[p]]
    near = (np.abs(np.vecdot(deepest - centre[f], out[f])) < TOUCHES * depth[p]) & (f != mine[p])
    hidden[deep[p[near][_over(one[f[near]], deepest[near])]]] = True
    beyond = np.vecdot(ahead, out[f]) > ROUND_OFF
    p, f, ahead = p[beyond], f[beyond], ahead[beyond]
    far = np.vecdot(centre[f] - x[p], out[f]) / np.vecdot(ahead, out[f])
    met = (far > 0) & (far < depth[p]) & _over(one[f], x[p] + far[:, None] * ahead)
    hidden[deep[p[met]]] = True
    return hidden


def _over(faces: Floats, x: Floats) -> Bools:
    """Whether x (p, 3) are over or beneath the faces (p, k, 3), each its own."""
    return inside(seen(faces, x[:, None]), seen(faces, faces))[:, 0]


def _placed(corners: Floats, points: Floats) -> Floats:
    """Hat functions (p, g, k) of plane faces (p, k, 2) at ``points`` (p, g, 2).

    At the second of two corners that are one it is zero.
    """
    if corners.shape[1] == 3:
        return _on_triangles(corners, points)
    one = (corners[:, 2] == corners[:, 3]).all(axis=1)
    out = np.zeros((*points.shape[:2], 4))
    out[one, :, :3] = _on_triangles(corners[one, :3], points[one])
    out[~one] = _on_squares(corners[~one], points[~one])
    return out


def _on_triangles(corners: Floats, points: Floats) -> Floats:
    """Those (p, g, 3) of triangles (p, 3, 2)."""
    start, first, second = corners[:, None, 0], corners[:, None, 1], corners[:, None, 2]
    whole = cross(first - start, second - start)
    by_first = cross(points - start, second - start) / whole
    by_second = cross(first - start, points - start) / whole
    return np.stack([1 - by_first - by_second, by_first, by_second], axis=-1)


def _on_squares(corners: Floats, points: Floats) -> Floats:
    """Those (p, g, 4) of squares (p, 4, 2)."""
    # x = c + u xi + v eta + w xi eta, relative to the corners' mean c.
    c = corners.mean(axis=1)[:, None]
    u, v, w = np.moveaxis(BILINEAR @ corners / 4, 1, 0)[:, :, None]
    off, places = points - c, np.zeros_like(points)
    for _ in range(STEPS):
        by_first, by_second = u + places[..., 1:] * w, v + places[..., :1] * w
        left = off - places[..., :1] * by_first - places[..., 1:] * v
        if max_abs(left) <= PLACED * max_abs(off):
            break
        steps = np.stack([cross(left, by_second), cross(by_first, left)], axis=-1)
        places = places + steps / cross(by_first, by_second)[..., None]
    return bilinear(places)[0]


def seen(faces: Floats, x: Floats) -> Floats:
    """Places (s, v, 2) of x (s, v, 3) in the mean planes of faces (s, k, 3)."""
    return np.einsum("sax,svx->sva", _axes(faces), x - faces.mean(axis=1, keepdims=True))


def within_reach(centre: Floats, x: Floats, far: Floats) -> tuple[Ints, Ints]:
    """Numbers (m,) of places x (p, 3) and of those ``centre`` (f, 3) that are no farther off than ``far`` (p,)."""
    # Imported here because only scenes in space need it.
    from scipy.spatial import cKDTree

    found = cKDTree(centre).query_ball_point(x, far * (1 + 1e-6))
    p = np.repeat(np.arange(len(x)), np.fromiter(map(len, found), np.intp, len(x)))
    return p, np.fromiter((f for some in found for f in some), np.intp, len(p))
