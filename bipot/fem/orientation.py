r"""Whether elements are folded anywhere, not only where they are integrated.

An eight-node quadrilateral is a quadratic Bezier patch x = sum B_i B_j P_ij whose middle point P_11 is given by the
others, because the square of both coordinates is not among its shapes. Its derivatives have degrees (1, 2) and (2, 1),
so that det J has degree (3, 3) and is, from sixteen values, its Bernstein coefficients D_mn over the whole element:

    det J = x,1 x y,2 - y,1 x,2,    min D_mn <= det J <= max D_mn,    mean det J = mean D_mn,

with D at the four corners equal to det J there. Where the least D is not positive while the corners are, the patch is
halved in both directions (de Casteljau), which takes D to det J with the square of its size.

Where det J > 0 the radius has no stationary point inside, hence no least value there: r > 0 inside if it is not
negative on the edges, where it is a parabola. End nodes and whole edges may lie on the axis, r = 0; the rest may not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from math import comb

import numpy as np

from bipot.errors import InvertedElement
from bipot.fem.elements import quad8_at
from bipot.fem.reduction import Geometry
from bipot.typing import Bools, Floats, Ints

LEVELS = 12
"""Halvings before a sign is given up: det J below some 4^-12 of its mean is then told from zero no more."""

ROUND_OFF = 1e-12
"""Of extent times derivative: above 5000 units in the last place, what products of sums of eight terms can gather."""

AXIS = 1e-12
"""A node this near the axis, over the largest radius, lies on it."""


_TIMES = np.array([0.0, 0.25, 0.75, 1.0])
_CUBICS = np.array([[comb(3, n) * t**n * (1 - t) ** (3 - n) for n in range(4)] for t in _TIMES])
FROM_VALUES = np.linalg.inv(np.kron(_CUBICS, _CUBICS)).T
"""What takes values (16,) on the grid of Chebyshev's points with ends to the coefficients (16,) in degree (3, 3)."""
_GRID = np.array([(s, t) for s in _TIMES for t in _TIMES])
_FIRST = np.array([[comb(m, n) / 2**m for n in range(4)] for m in range(4)])
HALVES = np.stack([_FIRST, _FIRST[::-1, ::-1]])
"""De Casteljau's matrices (2, 4, 4): a cubic's coefficients on the first and on the second half."""


@cache
def _slopes() -> Floats:
    """d/dxi at the points of the grid, then d/deta (8, 32), from nodal values."""
    return quad8_at(_GRID).gradients.transpose(1, 2, 0).reshape(8, 32)


def determinant_coefficients(x: Floats) -> tuple[Floats, Floats]:
    """Bernstein coefficients D (e, 4, 4) of det J of elements x (e, 8, 2), and the round-off (e,) they may hold."""
    D, local, both = _coefficients(x)
    extent, steepest = (np.abs(of).max(axis=(0, 2)) for of in (local, both))
    return D, 2 * ROUND_OFF * extent * steepest


def _coefficients(x: Floats) -> tuple[Floats, Floats, Floats]:
    """D (e, 4, 4), the coordinates (2, e, 8) from the first node, and derivatives (2, e, 32) on the grid."""
    # Direction first: one dense product instead of one an element.
    local = np.ascontiguousarray(x.transpose(2, 0, 1))
    local -= local[:, :, :1].copy()
    both = (local.reshape(-1, 8) @ _slopes()).reshape(2, len(x), 32)
    first, second = both[:, :, :16], both[:, :, 16:]
    cross = first[0] * second[1] - first[1] * second[0]
    return (cross @ FROM_VALUES).reshape(-1, 4, 4), local, both


@dataclass(frozen=True)
class Least:
    """Bounds of the least value (e,) of each element; ``upper`` is taken at ``at`` (e, 2)."""

    lower: Floats
    upper: Floats
    at: Floats


def least(D: Floats, settled: Callable[[Floats, Floats, Ints], Bools]) -> Least:
    """Bounds of the least value of each polynomial with coefficients D (e, 4, 4).

    A patch is halved until ``settled(lower, upper, element)`` (p,), told its own lower and its element's upper bounds.
    """
    count = len(D)
    lower, upper, at = np.full(count, np.inf), np.full(count, np.inf), np.zeros((count, 2))
    element, origin, size = np.arange(count), np.zeros((count, 2)), 1.0
    for level in range(LEVELS + 1):
        corners = D[:, ::3, ::3].reshape(-1, 4)
        high = corners.min(axis=1)
        # From the highest down: what is written last, and stays, is the least of its element.
        order = np.argsort(-high)
        order = order[high[order] < upper[element[order]]]
        corner = corners[order].argmin(axis=1)
        upper[element[order]] = high[order]
        at[element[order]] = origin[order] + size * np.column_stack([corner // 2, corner % 2])
        low = D.min(axis=(1, 2))
        done = settled(low, upper[element], element) | (level == LEVELS)
        np.minimum.at(lower, element[done], low[done])
        if done.all():
            break
        left, size = ~done, size / 2
        halves = HALVES[:, None] @ D[left][:, None, None] @ HALVES.swapaxes(1, 2)
        D, element = halves.reshape(-1, 4, 4), np.repeat(element[left], 4)
        shift = size * np.array([(0, 0), (0, 1), (1, 0), (1, 1)])
        origin = (origin[left][:, None] + shift).reshape(-1, 2)
    return Least(lower, upper, at)


def scaled_jacobians(nodes: Floats, elements: Ints, tolerance: float = 1e-3) -> Floats:
    """min det J over the element / mean det J (e,): a lower bound, below it by ``tolerance`` of it at most.

    1 for parallelograms, not positive where folded (within 4^-LEVELS); minus infinity where the mean is not positive.

    >>> x = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.3, 0], [1, 0.5], [0.5, 1], [0, 0.5]])
    >>> scaled_jacobians(x, np.arange(8)[None]).round(12)
    array([0.2])
    """
    D, _ = determinant_coefficients(nodes[elements])
    mean = D.mean(axis=(1, 2))
    out, turned = np.full(len(D), -np.inf), mean > 0
    scaled = D[turned] / mean[turned, None, None]
    out[turned] = least(scaled, lambda low, upper, _: low >= upper - tolerance * np.abs(upper)).lower
    return out


def refuse_folded(placements: Mapping[str, Floats], elements: Ints, geometry: Geometry) -> None:
    """Refuse nodes (a, 2) in which det J, or in axisymmetry the radius off the axis, is not positive all over.

    The ``placements`` are told apart in words. What no halving decides is refused too.

    Raises:
        InvertedElement: naming an element, the placement, the place and the value.
    """
    x = np.concatenate([nodes.take(elements, axis=0) for nodes in placements.values()])
    D, local, both = _coefficients(x)
    # The round-off of the largest element is more than any other's: the usual answer costs no look at each.
    clear = D.min() > 2 * ROUND_OFF * np.abs(local).max() * np.abs(both).max()
    fault = None if clear else _folded(x)
    if fault is None and geometry is Geometry.AXISYMMETRIC:
        fault = _off_axis(x)
    if fault is not None:
        count = len(elements)
        when = list(placements)[fault.patch // count]
        place = tuple(np.round(quad8_at(fault.at[None]).values[0] @ x[fault.patch], 6).tolist())
        raise InvertedElement(f"element {fault.patch % count} at {place}, {when}: {fault.what}")


@dataclass(frozen=True)
class Fault:
    """What is wrong at reference point ``at`` (2,) of which element."""

    patch: int
    at: Floats
    what: str


def _folded(x: Floats) -> Fault | None:
    """The worst of the elements whose least det J is not above round-off, or not known to be."""
    D, noise = determinant_coefficients(x)
    suspect = np.flatnonzero(~(D.min(axis=(1, 2)) > noise))
    D, noise = D[suspect], noise[suspect]
    found = least(D, lambda low, upper, element: (low > noise[element]) | ~(upper > noise[element]))
    bad = np.flatnonzero(~(found.lower > noise))
    if not bad.size:
        return None
    worst = bad[np.argmin(found.upper[bad])]
    value = found.upper[worst]
    known = "is not positive" if value <= noise[worst] else f"is not known to be above {found.lower[worst]:.3g}"
    return Fault(int(suspect[worst]), found.at[worst], f"Jacobian determinant {value:.3g} {known}")


def _parabolas(r: Floats) -> tuple[Floats, Floats, Floats]:
    """Coefficients a, b, c (e, 4) of the radius on the edges, a (1 - t)^2 + 2 b t (1 - t) + c t^2, from r (e, 8)."""
    a = r[:, :4]
    c = a[:, [1, 2, 3, 0]]
    return a, 2 * r[:, 4:] - (a + c) / 2, c


def _off_axis(x: Floats) -> Fault | None:
    """The edge with the least radius of those on which it is not positive off the axis."""
    r = x[..., 0]
    if r.min() >= 0 and _parabolas(r)[1].min() >= 0:
        return None
    tiny = AXIS * np.abs(r).max()
    a, b, c = _parabolas(np.where(np.abs(r) <= tiny, 0.0, r))
    # A parabola that is >= 0 at its ends vanishes between them where b <= -sqrt(a c).
    between = b + np.sqrt(np.maximum(a, 0) * np.maximum(c, 0)) > tiny
    bad = (a < 0) | (c < 0) | ~(between | ((np.abs(b) <= tiny) & (a * c == 0)))
    if not bad.any():
        return None
    curve = a - 2 * b + c
    t = np.clip(np.divide(a - b, curve, out=np.where(a < c, 0.0, 1.0), where=curve > 0), 0, 1)
    value = a * (1 - t) ** 2 + 2 * b * t * (1 - t) + c * t**2
    patch, edge = np.unravel_index(np.argmin(np.where(bad, value, np.inf)), value.shape)
    ends = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    at = (1 - t[patch, edge]) * ends[edge] + t[patch, edge] * ends[(edge + 1) % 4]
    return Fault(int(patch), at, f"radius {value[patch, edge]:.3g} is not positive")
