r"""Whether elements are folded anywhere, not only at their integration points.

A quadrilateral of eight or nine nodes is a quadratic Bezier patch: its derivatives have degrees (1, 2) and (2, 1), so
that det J has degree (3, 3). One of four nodes has degree (1, 1); a hexahedron of eight nodes has (2, 2, 2), one of
twenty (5, 5, 5). A triangle of six nodes has total degree 2, a tetrahedron of ten 3, those of straight edges 0. In each
det J has, from as many values, its Bernstein coefficients D_m over the whole element:

    det J = x,1 y,2 - y,1 x,2  or  x,1 . (x,2 x x,3),    min D_m <= det J <= max D_m,    mean det J = mean D_m,

with D at the corners equal to det J there. Where the least D is not positive while the corners are, the element is
halved (:mod:`bipot.fem.bernstein`).

Where two straight edges of an element lie on one flat tool, their angle is straight and det J = 0 at that corner alone.
This is no fold, however often an increment ends so: one corner of each such element may have |det J| up to
:data:`STRAIGHT` of its mean. For a brick of eight nodes it is a corner whose three faces lie on the tool, or an edge
whose two faces do. Coefficients there may be as small, unless they are at all corners of a face; they are lifted to
that bound, and the element is then checked as any other. At rest this is not allowed.

Where det J > 0 the radius has no stationary point inside, hence no least value there: r > 0 inside if it is not
negative on the edges, where it is a parabola or linear. End nodes and whole edges may lie on the axis, r = 0; the rest
may not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from bipot.errors import InvertedElement
from bipot.fem.bernstein import Basis, least
from bipot.fem.elements import tabulated_at
from bipot.fem.reduction import Geometry
from bipot.meshes.elements import Element, same_places
from bipot.typing import Floats, Ints

STRAIGHT = 1e-9
"""det J at a corner over its mean, below which the angle there is straight: the remaining gaps of three nodes."""

DEGREES = {
    Element.T3: 0,
    Element.T6: 2,
    Element.Q4: 1,
    Element.Q8: 3,
    Element.Q9: 3,
    Element.T4: 0,
    Element.T10: 3,
    Element.H8: 2,
    Element.H20: 5,
}
"""Degrees of det J: in each coordinate on squares and cubes, in all together on triangles and tetrahedra."""

BELOW = 1e-3
"""How far the lower bound of the least det J may be below the upper one, over the latter."""

AXIS = 1e-12
"""A node this near the axis, over the largest radius, lies on it."""


@cache
def basis(element: Element) -> Basis:
    """The basis of det J."""
    return Basis.of(DEGREES[element], element)


@cache
def _slopes(element: Element) -> Floats:
    """Map (k, d c) from nodal values to d/dxi at the points of the grid, then d/deta and so on."""
    gradients = tabulated_at(element, basis(element).grid).gradients
    return gradients.transpose(1, 2, 0).reshape(element.nodes, -1)


def _element(x: Floats) -> Element:
    """The kind of elements with nodes x (e, k, d)."""
    return Element.of(*x.shape[1:])


def determinant_coefficients(x: Floats) -> tuple[Floats, Floats]:
    """Bernstein coefficients D (e, c) of det J of elements x (e, k, d), and the round-off (e,) they may hold."""
    D, local, slopes = _coefficients(x)
    extent, steepest = (np.abs(of).max(axis=(0, 2)) for of in (local, slopes))
    return D, _noise(extent, steepest, _element(x))


def _noise(extent: Floats, steepest: Floats, element: Element) -> Floats:
    """Round-off of D in elements of this ``extent`` with ``steepest`` derivatives of coordinates."""
    return 2 * basis(element).round_off * extent * steepest ** (element.dimension - 1)


def _coefficients(x: Floats) -> tuple[Floats, Floats, Floats]:
    """D (e, c), the coordinates (d, e, k) from the first node, and derivatives (d, e, d c) on the grid."""
    # Directions first: one dense product instead of one for each element.
    local = np.ascontiguousarray(x.transpose(2, 0, 1))
    local -= local[:, :, :1].copy()
    element, d = _element(x), x.shape[2]
    slopes = (local.reshape(-1, element.nodes) @ _slopes(element)).reshape(d, len(x), -1)
    return _determinant(slopes.reshape(d, len(x), d, -1)) @ basis(element).from_values, local, slopes


def _determinant(slopes: Floats) -> Floats:
    """det J (e, c) from the derivatives (d, e, d, c)."""
    first, *others = slopes.swapaxes(1, 2)
    if len(others) == 1:
        return first[0] * others[0][1] - others[0][0] * first[1]
    (a, b, c), (d, e, f) = others
    return first[0] * (b * f - c * e) + first[1] * (c * d - a * f) + first[2] * (a * e - b * d)


def scaled_jacobians(nodes: Floats, elements: Ints) -> Floats:
    """A lower bound (e,) of min det J / mean det J of each element, off by at most :data:`BELOW` of it.

    1 for parallelograms and straight triangles, not positive where folded (within 4^-LEVELS); minus infinity where the
    mean is not positive.

    >>> x = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.3, 0], [1, 0.5], [0.5, 1], [0, 0.5]])
    >>> scaled_jacobians(x, np.arange(8)[None]).round(12)
    array([0.2])
    """
    D, _ = determinant_coefficients(nodes[elements])
    mean = D.mean(axis=1)
    out, turned = np.full(len(D), -np.inf), mean > 0
    scaled, form = D[turned] / mean[turned, None], basis(Element.of(elements.shape[1], nodes.shape[1]))
    out[turned] = least(scaled, form, lambda low, upper, _: low >= upper - BELOW * np.abs(upper)).lower
    return out


def refuse_folded(
    placements: Mapping[str, Floats], elements: Ints, geometry: Geometry, *, straight: bool = False
) -> None:
    """Refuse nodes (a, d) for which det J, or in axisymmetry the radius off the axis, is not positive everywhere.

    The ``placements`` are named in words. Undecided elements are refused too. With ``straight``, corners between
    straight edges, and edges between the faces of a brick, may have a straight angle.
    """
    x = np.concatenate([nodes.take(elements, axis=0) for nodes in placements.values()])
    D, local, slopes = _coefficients(x)
    # The round-off of the largest element is a bound for all: usually no element need be examined by itself.
    clear = D.min() > _noise(np.abs(local).max(), np.abs(slopes).max(), _element(x))
    fault = None if clear else _folded(x, straight)
    if fault is None and geometry is Geometry.AXISYMMETRIC:
        fault = _off_axis(x)
    if fault is not None:
        count = len(elements)
        when = list(placements)[fault.patch // count]
        place = tuple(np.round(tabulated_at(_element(x), fault.at[None]).values[0] @ x[fault.patch], 6).tolist())
        raise InvertedElement(f"element {fault.patch % count} at {place}, {when}: {fault.what}")


@dataclass(frozen=True)
class Fault:
    """The element that is folded, the reference point ``at`` (d,), and the value."""

    patch: int
    at: Floats
    what: str


def _folded(x: Floats, straight: bool) -> Fault | None:
    """The worst of the elements whose least det J is not above round-off, or not known to be."""
    D, noise = determinant_coefficients(x)
    positive = D > noise[:, None]
    if straight and _element(x) is Element.Q4:
        # Its coefficients are the values at its corners.
        flat = np.abs(D) <= STRAIGHT * D.mean(axis=1, keepdims=True)
        positive |= flat & (positive.sum(axis=1, keepdims=True) == D.shape[1] - 1)
    elif straight and _element(x) is Element.H8:
        D = _lifted(D)
        positive = D > noise[:, None]
    suspect = np.flatnonzero(~positive.all(axis=1))
    D, noise = D[suspect], noise[suspect]
    form = basis(_element(x))
    found = least(D, form, lambda low, upper, element: (low > noise[element]) | ~(upper > noise[element]))
    bad = np.flatnonzero(~(found.lower > noise))
    if not bad.size:
        return None
    worst = bad[np.argmin(found.upper[bad])]
    value = found.upper[worst]
    known = "is not positive" if value <= 0 else f"is not above its round-off, {noise[worst]:.2g}"
    if value > noise[worst]:
        known = f"is not known to be above {found.lower[worst]:.3g}"
    return Fault(int(suspect[worst]), found.at[worst], f"Jacobian determinant {value:.3g} {known}")


def _lifted(D: Floats) -> Floats:
    """D (e, c) of bricks with straight corners, and edges between two of them, lifted from zero to that bound.

    Faces all of whose corners are straight have collapsed: their elements are not changed.
    """
    at_corner, ends, faces = _on_edges()
    bound = STRAIGHT * D.mean(axis=1, keepdims=True)
    flat = np.abs(D) <= bound
    corners = flat[:, at_corner]
    allowed = np.zeros_like(flat)
    allowed[:, at_corner] = corners
    for middle, (a, b) in ends:
        allowed[:, middle] = corners[:, a] & corners[:, b] & flat[:, middle]
    allowed &= ~corners[:, faces].all(axis=2).any(axis=1)[:, None]
    return np.where(allowed, bound, D)


@cache
def _on_edges() -> tuple[Ints, tuple[tuple[int, tuple[int, int]], ...], Ints]:
    """Numbers of a brick's coefficients at corners (8,) and in the middle of edges, with their ends, and its faces."""
    form, shape = basis(Element.H8), Element.H8.shape
    places = np.array(shape.corners, dtype=float)
    at_corner = same_places(places, form.grid)
    middles = same_places(np.array([places[list(edge)].mean(axis=0) for edge in shape.edges]), form.grid)
    edges = [(a, b) for a, b in shape.edges]
    return at_corner, tuple(zip(middles.tolist(), edges, strict=True)), np.array(shape.faces)


def _parabolas(x: Floats, r: Floats) -> tuple[Floats, Floats, Floats]:
    """a, b, c (e, edges) of the radius r (e, k) on the edges of elements x, a (1 - t)^2 + 2 b t (1 - t) + c t^2."""
    sides = _element(x).edges
    a, c = r[:, sides[:, 0]], r[:, sides[:, -1]]
    middle = r[:, sides[:, 1]] if sides.shape[1] == 3 else (a + c) / 2
    return a, 2 * middle - (a + c) / 2, c


def _off_axis(x: Floats) -> Fault | None:
    """The edge with the least radius of those on which it is not positive off the axis."""
    r = x[..., 0]
    if r.min() >= 0 and _parabolas(x, r)[1].min() >= 0:
        return None
    tiny = AXIS * np.abs(r).max()
    a, b, c = _parabolas(x, np.where(np.abs(r) <= tiny, 0.0, r))
    # A parabola that is >= 0 at its ends vanishes between them where b <= -sqrt(a c).
    between = b + np.sqrt(np.maximum(a, 0) * np.maximum(c, 0)) > tiny
    bad = (a < 0) | (c < 0) | ~(between | ((np.abs(b) <= tiny) & (a * c == 0)))
    if not bad.any():
        return None
    curve = a - 2 * b + c
    t = np.clip(np.divide(a - b, curve, out=np.where(a < c, 0.0, 1.0), where=curve > 0), 0, 1)
    value = a * (1 - t) ** 2 + 2 * b * t * (1 - t) + c * t**2
    patch, edge = np.unravel_index(np.argmin(np.where(bad, value, np.inf)), value.shape)
    ends = _element(x).places
    at = (1 - t[patch, edge]) * ends[edge] + t[patch, edge] * np.roll(ends, -1, axis=0)[edge]
    return Fault(int(patch), at, f"radius {value[patch, edge]:.3g} is not positive")
