r"""Whether elements are folded anywhere, not only where they are integrated.

A quadrilateral of eight or nine nodes is a quadratic Bezier patch: its derivatives have degrees (1, 2) and (2, 1), so
that det J has degree (3, 3). One of four nodes has degree (1, 1); a hexahedron of eight nodes has (2, 2, 2), one of
twenty (5, 5, 5). A triangle of six nodes has total degree 2, a tetrahedron of ten 3, those of straight edges 0. In each
det J has, from as many values, its Bernstein coefficients D_m over the whole element:

    det J = x,1 y,2 - y,1 x,2  or  x,1 . (x,2 x x,3),    min D_m <= det J <= max D_m,    mean det J = mean D_m,

with D at the corners equal to det J there. Where the least D is not positive while the corners are, the element is
halved along its sides into 2^d (de Casteljau), which takes D to det J with the square of its size.

Where two edges of an element with straight ones lie on one flat tool their angle is straight, and det J = 0 at that
corner alone. That is no fold, however often an increment ends so: one corner of each such element may have |det J| up
to :data:`STRAIGHT` of its mean. At rest none may.

Where det J > 0 the radius has no stationary point inside, hence no least value there: r > 0 inside if it is not
negative on the edges, where it is a parabola or linear. End nodes and whole edges may lie on the axis, r = 0; the rest
may not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product
from math import comb, factorial, prod

import numpy as np

from bipot.elements import Element
from bipot.errors import InvertedElement
from bipot.fem.elements import tabulated_at
from bipot.fem.reduction import Geometry
from bipot.typing import Bools, Floats, Ints

LEVELS = 12
"""Halvings before a sign is given up: det J below some 4^-12 of its mean is then told from zero no more."""

ROUND_OFF, PLAIN = 1e-12, 25.0
"""Of extent times derivative, in space times its square: above 5000 units in the last place, what products of sums of
eight terms can gather. More where values make coefficients of more than so many times their size: in H20 9261 times.
"""

STRAIGHT = 1e-9
"""det J at a corner over its mean, below which the angle there is straight: what is left of the gaps of three nodes."""

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
"""Of det J: in every coordinate on squares and cubes, in all together on triangles and tetrahedra."""

AXIS = 1e-12
"""A node this near the axis, over the largest radius, lies on it."""


@dataclass(frozen=True)
class Basis:
    """Bernstein polynomials in c coefficients: how they follow from values on the ``grid`` (c, d), and on 2^d parts.

    ``from_values`` (c, c) takes values (c,), a row, to coefficients. Those at ``corners`` are values themselves. Part k
    is what ``turns`` (2^d, d, d) and ``shifts`` (2^d, d) make of the reference shape, turn x + shift; ``parts``
    (2^d, c, c) are its coefficients.
    """

    grid: Floats
    from_values: Floats
    corners: Ints
    turns: Floats
    shifts: Floats
    parts: Floats

    @cached_property
    def round_off(self) -> float:
        """Of coefficients, over extent times derivatives."""
        return ROUND_OFF * max(1.0, float(np.abs(self.from_values).sum(axis=0).max()) / PLAIN)

    @staticmethod
    def of(degree: int, element: Element) -> Basis:
        """Of ``degree`` in each coordinate on the element's square or cube, in all together on other shapes."""
        cube, d = element.shape.cube, element.dimension
        at, shape = (_chebyshev(degree), _cube) if cube else (np.linspace(0, 1, degree + 1), _simplex)
        grid = at[_powers(degree, d, cube)]
        inverse = np.asarray(np.linalg.inv(shape(grid, degree)), dtype=np.float64)
        turns, shifts = _halves(element)
        # Of dyadic numbers: what the inverse has of round-off is taken off again.
        whole = 2 ** (d * degree)
        halves = [grid @ turn.T + shift for turn, shift in zip(turns, shifts, strict=True)]
        parts = np.round(whole * np.stack([inverse @ shape(half, degree) for half in halves])) / whole
        places = np.flatnonzero(((grid == 0) | (grid == 1)).all(axis=1))
        return Basis(grid, inverse.T, places, turns, shifts, parts)


def _chebyshev(degree: int) -> Floats:
    """Chebyshev's points (degree + 1,) of [0, 1], with its ends: dyadic where they can be."""
    return np.round((1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2, 15)


def _powers(degree: int, dimension: int, cube: bool) -> Ints:
    """Powers (c, d) of each coordinate in the polynomials: up to ``degree`` each, or all together."""
    every = np.array(list(product(range(degree + 1), repeat=dimension)))
    return every if cube else every[every.sum(axis=1) <= degree]


def _halves(element: Element) -> tuple[Floats, Floats]:
    """Into which parts (2^d, d, d), (2^d, d) halved sides cut the element's shape (:class:`Basis`)."""
    d = element.dimension
    if element.shape.cube:
        shifts = np.array(list(product((0.0, 0.5), repeat=d)))
        return np.broadcast_to(np.eye(d) / 2, (2**d, d, d)), shifts
    middle = element.places[np.array(element.shape.edges)].mean(axis=1)
    # What the parts at the corners leave: one triangle, or four tetrahedra around a line between two mid-sides.
    left = middle[[(1, 2, 0)]] if d == 2 else middle[[(2, 4, 0, 3), (2, 4, 3, 5), (2, 4, 5, 1), (2, 4, 1, 0)]]
    corner = np.vstack([np.zeros(d), np.eye(d)]) / 2
    vertices = np.concatenate([[corner[k] + corner for k in range(d + 1)], left])
    return (vertices[:, 1:] - vertices[:, :1]).swapaxes(1, 2), vertices[:, 0]


def _cube(points: Floats, degree: int) -> Floats:
    """Bernstein polynomials (p, (degree + 1)^d) at points (p, d) of the square or cube."""
    n = np.arange(degree + 1)
    some = np.array([comb(degree, k) for k in n])
    out = np.ones((len(points), 1))
    for t in points.T:
        along = some * t[:, None] ** n * (1 - t[:, None]) ** (degree - n)
        out = (out[:, :, None] * along[:, None, :]).reshape(len(points), -1)
    return out


def _simplex(points: Floats, degree: int) -> Floats:
    """Bernstein polynomials of total ``degree`` at points (p, d) of the triangle or tetrahedron, (p, c)."""
    powers = _powers(degree, points.shape[1], cube=False)
    every = np.column_stack([powers, degree - powers.sum(axis=1)])
    many = [factorial(degree) // prod(map(factorial, some)) for some in every.tolist()]
    weights = np.column_stack([points, 1 - points.sum(axis=1)])
    return np.array(many) * np.prod(weights[:, None] ** every, axis=2)


@cache
def basis(element: Element) -> Basis:
    """That of det J."""
    return Basis.of(DEGREES[element], element)


@cache
def _slopes(element: Element) -> Floats:
    """d/dxi at the points of the grid, then d/deta and so on (k, d c), from nodal values."""
    gradients = tabulated_at(element, basis(element).grid).gradients
    return gradients.transpose(1, 2, 0).reshape(element.nodes, -1)


def _element(x: Floats) -> Element:
    """What elements with nodes x (e, k, d) are."""
    return Element.of(*x.shape[1:])


def determinant_coefficients(x: Floats) -> tuple[Floats, Floats]:
    """Bernstein coefficients D (e, c) of det J of elements x (e, k, d), and the round-off (e,) they may hold."""
    D, local, slopes = _coefficients(x)
    extent, steepest = (np.abs(of).max(axis=(0, 2)) for of in (local, slopes))
    return D, _noise(extent, steepest, _element(x))


def _noise(extent: Floats, steepest: Floats, element: Element) -> Floats:
    """Round-off of D in elements of this extent, of which no coordinate has steeper derivatives."""
    return 2 * basis(element).round_off * extent * steepest ** (element.dimension - 1)


def _coefficients(x: Floats) -> tuple[Floats, Floats, Floats]:
    """D (e, c), the coordinates (d, e, k) from the first node, and derivatives (d, e, d c) on the grid."""
    # Direction first: one dense product instead of one an element.
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


@dataclass(frozen=True)
class Least:
    """Bounds of the least value (e,) of each element; ``upper`` is taken at ``at`` (e, d)."""

    lower: Floats
    upper: Floats
    at: Floats


def least(D: Floats, form: Basis, settled: Callable[[Floats, Floats, Ints], Bools]) -> Least:
    """Bounds of the least value of each polynomial with coefficients D (e, c) in a basis.

    A patch is halved until ``settled(lower, upper, element)`` (p,), told its own lower and its element's upper bounds.
    """
    count, d = len(D), form.grid.shape[1]
    lower, upper, at = np.full(count, np.inf), np.full(count, np.inf), np.zeros((count, d))
    element, origin, turn = np.arange(count), np.zeros((count, d)), np.tile(np.eye(d), (count, 1, 1))
    for level in range(LEVELS + 1):
        corners = D[:, form.corners]
        high = corners.min(axis=1)
        # From the highest down: what is written last, and stays, is the least of its element.
        order = np.argsort(-high)
        order = order[high[order] < upper[element[order]]]
        corner = form.grid[form.corners[corners[order].argmin(axis=1)]]
        upper[element[order]] = high[order]
        at[element[order]] = origin[order] + (turn[order] @ corner[..., None])[..., 0]
        low = D.min(axis=1)
        done = settled(low, upper[element], element) | (level == LEVELS)
        np.minimum.at(lower, element[done], low[done])
        if done.all():
            break
        left = ~done
        D = (form.parts @ D[left].T).transpose(2, 0, 1).reshape(-1, D.shape[1])
        origin = (origin[left][:, None] + form.shifts @ turn[left].swapaxes(1, 2)).reshape(-1, d)
        element, turn = np.repeat(element[left], 2**d), (turn[left][:, None] @ form.turns).reshape(-1, d, d)
    return Least(lower, upper, at)


def scaled_jacobians(nodes: Floats, elements: Ints, tolerance: float = 1e-3) -> Floats:
    """min det J over the element / mean det J (e,): a lower bound, below it by ``tolerance`` of it at most.

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
    out[turned] = least(scaled, form, lambda low, upper, _: low >= upper - tolerance * np.abs(upper)).lower
    return out


def refuse_folded(
    placements: Mapping[str, Floats], elements: Ints, geometry: Geometry, *, straight: bool = False
) -> None:
    """Refuse nodes (a, d) in which det J, or in axisymmetry the radius off the axis, is not positive all over.

    The ``placements`` are told apart in words. What no halving decides is refused too. With ``straight`` a corner
    between straight edges may have a straight angle.

    Raises:
        InvertedElement: naming an element, the placement, the place and the value.
    """
    x = np.concatenate([nodes.take(elements, axis=0) for nodes in placements.values()])
    D, local, slopes = _coefficients(x)
    # The round-off of the largest element is more than any other's: the usual answer costs no look at each.
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
    """What is wrong at reference point ``at`` (d,) of which element."""

    patch: int
    at: Floats
    what: str


def _folded(x: Floats, straight: bool) -> Fault | None:
    """The worst of the elements whose least det J is not above round-off, or not known to be."""
    D, noise = determinant_coefficients(x)
    positive = D > noise[:, None]
    if straight and _element(x) is Element.Q4:
        # its coefficients are the values at its corners
        flat = np.abs(D) <= STRAIGHT * D.mean(axis=1, keepdims=True)
        positive |= flat & (positive.sum(axis=1, keepdims=True) == D.shape[1] - 1)
    suspect = np.flatnonzero(~positive.all(axis=1))
    D, noise = D[suspect], noise[suspect]
    form = basis(_element(x))
    found = least(D, form, lambda low, upper, element: (low > noise[element]) | ~(upper > noise[element]))
    bad = np.flatnonzero(~(found.lower > noise))
    if not bad.size:
        return None
    worst = bad[np.argmin(found.upper[bad])]
    value = found.upper[worst]
    known = "is not positive" if value <= noise[worst] else f"is not known to be above {found.lower[worst]:.3g}"
    return Fault(int(suspect[worst]), found.at[worst], f"Jacobian determinant {value:.3g} {known}")


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
