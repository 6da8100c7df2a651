r"""Polynomials over whole elements by their Bernstein coefficients: bounds of their least values.

The least and largest coefficient bound the polynomial. When an element is halved along its sides into 2^d parts (de
Casteljau), the coefficients converge to the values with the square of its size.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import product
from math import comb, factorial, prod

import numpy as np

from bipot.meshes.elements import Element
from bipot.typing import Bools, Floats, Ints, times

LEVELS = 12
"""Halvings before a sign is undecided: det J below about 4^-12 of its mean is not distinguished from zero."""

ROUND_OFF, PLAIN = 1e-12, 25.0
"""Round-off over extent times derivative, in space times its square: 4500 machine epsilons, more than products of sums
of eight terms reach. Larger in proportion if coefficients exceed values by more than PLAIN: by 9261 in H20.
"""


@dataclass(frozen=True)
class Basis:
    """Bernstein polynomials in c coefficients, from values on the ``grid`` (c, d) and on the 2^d parts of the shape.

    ``polynomials`` are their values at points. ``from_values`` (c, c) takes values (c,), a row, to coefficients. Those
    at ``corners`` are values themselves. Part k of the reference shape is turn x + shift by ``turns`` (2^d, d, d) and
    ``shifts`` (2^d, d).
    """

    polynomials: Callable[[Floats], Floats]
    whole: int
    grid: Floats
    from_values: Floats
    corners: Ints
    turns: Floats
    shifts: Floats

    @cached_property
    def round_off(self) -> float:
        """Relative round-off of coefficients, over extent times derivatives."""
        return ROUND_OFF * max(1.0, float(np.abs(self.from_values).sum(axis=0).max()) / PLAIN)

    @cached_property
    def parts(self) -> Floats:
        """Matrices (2^d, c, c) from coefficients on the whole to those on each part, multiples of 1/``whole``."""
        halves = [self.grid @ turn.T + shift for turn, shift in zip(self.turns, self.shifts, strict=True)]
        taken = np.stack([self.from_values.T @ self.polynomials(half) for half in halves])
        # Rounding removes the round-off of the inverse.
        return np.round(self.whole * taken) / self.whole

    @staticmethod
    def of(degree: int, element: Element) -> Basis:
        """The basis of ``degree`` in each coordinate on squares and cubes, in all together on other shapes."""
        cube, d = element.shape.cube, element.dimension
        shape, even = _cube if cube else _simplex, np.linspace(0, 1, degree + 1)
        # On cubes Chebyshev's points with the ends, dyadic where they can be.
        grid = (np.round((1 - np.cos(np.pi * even)) / 2, 15) if cube else even)[_powers(degree, d, cube)]
        inverse = np.asarray(np.linalg.inv(shape(grid, degree)), dtype=np.float64)
        turns, shifts = _halves(element)
        return Basis(
            polynomials=partial(shape, degree=degree),
            whole=2 ** (d * degree),
            grid=grid,
            from_values=inverse.T,
            corners=np.flatnonzero(((grid == 0) | (grid == 1)).all(axis=1)),
            turns=turns,
            shifts=shifts,
        )


def _powers(degree: int, dimension: int, cube: bool) -> Ints:
    """Powers (c, d) of each coordinate in the polynomials: up to ``degree`` each, or all together."""
    every = np.array(list(product(range(degree + 1), repeat=dimension)))
    return every if cube else every[every.sum(axis=1) <= degree]


def _halves(element: Element) -> tuple[Floats, Floats]:
    """Turns (2^d, d, d) and shifts (2^d, d) of the parts into which halved sides cut a shape (:class:`Basis`)."""
    d = element.dimension
    if element.shape.cube:
        shifts = np.array(list(product((0.0, 0.5), repeat=d)))
        return np.broadcast_to(np.eye(d) / 2, (2**d, d, d)), shifts
    middle = element.places[np.array(element.shape.edges)].mean(axis=1)
    # Beside the parts at the corners: one triangle, or four tetrahedra around a line between two mid-sides.
    left = middle[[(1, 2, 0)]] if d == 2 else middle[[(2, 4, 0, 3), (2, 4, 3, 5), (2, 4, 5, 1), (2, 4, 1, 0)]]
    corner = np.vstack([np.zeros(d), np.eye(d)]) / 2
    vertices = np.concatenate([[corner[k] + corner for k in range(d + 1)], left])
    return (vertices[:, 1:] - vertices[:, :1]).swapaxes(1, 2), vertices[:, 0]


def _cube(points: Floats, degree: int) -> Floats:
    """Bernstein polynomials (p, (degree + 1)^d) at points (p, d) of the square or cube."""
    n = np.arange(degree + 1)
    binomials = np.array([comb(degree, k) for k in n])
    out = np.ones((len(points), 1))
    for t in points.T:
        along = binomials * t[:, None] ** n * (1 - t[:, None]) ** (degree - n)
        out = (out[:, :, None] * along[:, None, :]).reshape(len(points), -1)
    return out


def _simplex(points: Floats, degree: int) -> Floats:
    """Bernstein polynomials of total ``degree`` at points (p, d) of the triangle or tetrahedron, (p, c)."""
    powers = _powers(degree, points.shape[1], cube=False)
    exponents = np.column_stack([powers, degree - powers.sum(axis=1)])
    multinomials = [factorial(degree) // prod(map(factorial, term)) for term in exponents.tolist()]
    barycentric = np.column_stack([points, 1 - points.sum(axis=1)])
    return np.array(multinomials) * np.prod(barycentric[:, None] ** exponents, axis=2)


@dataclass(frozen=True)
class Least:
    """Bounds of the least value (e,) of each element; ``upper`` is the value at the place ``at`` (e, d)."""

    lower: Floats
    upper: Floats
    at: Floats


def least(D: Floats, form: Basis, settled: Callable[[Floats, Floats, Ints], Bools]) -> Least:
    """Bounds of the least value of each polynomial with coefficients D (e, c) in a basis.

    A patch is halved until ``settled(lower, upper, element)`` (p,), given its lower and its element's upper bound.
    """
    count, d = len(D), form.grid.shape[1]
    lower, upper, at = np.full(count, np.inf), np.full(count, np.inf), np.zeros((count, d))
    element, origin, turn = np.arange(count), np.zeros((count, d)), np.tile(np.eye(d), (count, 1, 1))
    for level in range(LEVELS + 1):
        corners = D[:, form.corners]
        high = corners.min(axis=1)
        # From the highest down, so that the least of each element is written last.
        order = np.argsort(-high)
        order = order[high[order] < upper[element[order]]]
        corner = form.grid[form.corners[corners[order].argmin(axis=1)]]
        upper[element[order]] = high[order]
        at[element[order]] = origin[order] + times(turn[order], corner)
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
