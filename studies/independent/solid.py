r"""Elements of space written a second time, for the fuzz study's recomputation: nothing of the library.

Shapes are the polynomials in monomials xi^i eta^j zeta^k that are one at a node and zero at all others: of 4, 8, 10 and
20 nodes those with i + j + k <= 1; i, j, k <= 1; i + j + k <= 2; and of which the powers above one sum to two at most.
Corners of the cube [0, 1]^3 run around its base, then around its top; mid-sides follow edge by edge. Tensors are full,
(e, q, 3, 3), and a rotation is one about an axis by an angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from studies.independent.shapes import rule as flat_rule

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

TETRAHEDRON = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
SIDES = {
    10: ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    20: ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
}
DENSE = {4: 2, 8: 7, 10: 9, 20: 9}
"""Points along each axis at which orientation is sampled, by the number of nodes; corners and sides are included."""


@cache
def places(nodes: int) -> Floats:
    """The nodes (k, 3) on the reference shape."""
    corners = np.array(TETRAHEDRON if nodes in (4, 10) else CUBE, dtype=np.float64)
    return np.vstack([corners, *[corners[list(ends)].mean(axis=0) for ends in SIDES.get(nodes, ())]])


@cache
def _powers(nodes: int) -> Ints:
    every = np.array(list(product(range(3), repeat=3)))
    kept = {
        4: every.sum(axis=1) <= 1,
        8: every.max(axis=1) <= 1,
        10: every.sum(axis=1) <= 2,
        20: np.where(every > 1, every, 0).sum(axis=1) <= 2,
    }
    return every[kept[nodes]]


def shape_functions(points: Floats, nodes: int) -> tuple[Floats, Floats]:
    """Values (q, k) and derivatives (q, k, 3) at ``points`` (q, 3).

    >>> values, slopes = shape_functions(np.array([[0.3, 0.2, 0.1]]), 20)
    >>> round(float(values.sum()), 12), np.abs(slopes.sum(axis=1)).max() < 1e-13
    (1.0, np.True_)
    """
    powers = _powers(nodes)

    def monomials(x: Floats, along: int | None = None) -> Floats:
        lowered, factor = powers.copy(), np.ones(len(powers))
        if along is not None:
            factor = powers[:, along].astype(np.float64)
            lowered[:, along] = np.maximum(powers[:, along] - 1, 0)
        return factor * np.prod(x[:, None] ** lowered, axis=2)

    of_nodes = np.linalg.inv(monomials(places(nodes)))
    return monomials(points) @ of_nodes, np.stack([monomials(points, d) @ of_nodes for d in range(3)], axis=-1)


def rule(name: str) -> tuple[Floats, Floats]:
    """Points (q, 3) and weights (q,) of a rule of the library, in the order stresses are stored in."""
    if name == "tetrahedron1":
        return np.full((1, 3), 0.25), np.full(1, 1 / 6)
    if name == "tetrahedron4":
        a = (5 - np.sqrt(5)) / 20
        return np.vstack([a + (1 - 4 * a) * np.eye(3), np.full((1, 3), a)]), np.full(4, 1 / 24)
    line, weight = {
        "gauss2": (0.5 + np.array([-1, 1]) / np.sqrt(12), np.ones(2) / 2),
        "gauss3": (0.5 + np.array([-1, 0, 1]) * np.sqrt(0.15), np.array([5, 8, 5]) / 18),
    }[name]
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    return points, np.einsum("i,j,k->ijk", weight, weight, weight).ravel()


@dataclass(frozen=True)
class Placed:
    """Elements on a configuration: dN/dx (e, q, k, 3), volume (e, q)."""

    slopes: Floats
    volume: Floats


def place(nodes: Floats, elements: Ints, quadrature: str) -> Placed:
    """Gradients and volumes."""
    points, weights = rule(quadrature)
    _, slopes = shape_functions(points, elements.shape[1])
    J = np.einsum("ead,qar->eqdr", nodes[elements], slopes)
    return Placed(np.einsum("qar,eqrd->eqad", slopes, np.linalg.inv(J)), np.linalg.det(J) * weights)


def displacement_gradient(placed: Placed, u: Floats) -> Floats:
    """du/dx (e, q, 3, 3) of element displacements u (e, k, 3)."""
    return np.einsum("eai,eqaj->eqij", u, placed.slopes)


def element_forces(placed: Placed, stress: Floats) -> Floats:
    """Nodal forces (e, k, 3) of the stress (e, q, 3, 3)."""
    return np.einsum("eq,eqij,eqaj->eai", placed.volume, stress, placed.slopes)


def nodal(elements: Ints, each: Floats, count: int) -> Floats:
    """Sums over elements at the nodes (count, ...) of what each (e, k, ...) gives."""
    out = np.zeros((count, *each.shape[2:]))
    np.add.at(out, elements, each)
    return out


def nodal_stiffness(placed: Placed, elements: Ints, bulk: Floats, shear: Floats, count: int) -> Floats:
    """The elastic stiffness (a, 3, 3) of every node by itself; moduli are (e, 1)."""
    bulk, shear = bulk[..., None, None, None], shear[..., None, None, None]
    size = np.vecdot(placed.slopes, placed.slopes)
    outer = placed.slopes[..., :, None] * placed.slopes[..., None, :]
    own = (bulk + shear / 3) * outer + shear * size[..., None, None] * np.eye(3)
    return nodal(elements, np.einsum("eq,eqaij->eaij", placed.volume, own), count)


def rotation(spin: Floats, part: float) -> Floats:
    """The ``part`` of Hughes and Winget's rotation (..., 3, 3), by 2 atan(|w|/2) about the spin w (..., 3)."""
    length = np.linalg.norm(spin, axis=-1)
    axis = spin / np.where(length > 0, length, 1.0)[..., None]
    angle = (2 * part * np.arctan(length / 2))[..., None, None]
    W = np.zeros((*spin.shape, 3))
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        W[..., c, b], W[..., b, c] = axis[..., a], -axis[..., a]
    return np.eye(3) + np.sin(angle) * W + (1 - np.cos(angle)) * (W @ W)


def turned(tensor: Floats, Q: Floats) -> Floats:
    """Q t Q'."""
    return Q @ tensor @ Q.swapaxes(-1, -2)


def orientation(nodes: Floats, elements: Ints) -> float:
    """The least det J over its element's mean, sampled densely."""
    count = elements.shape[1]
    line = np.linspace(0.0, 1.0, DENSE[count])
    points = np.stack(np.meshgrid(line, line, line), axis=-1).reshape(-1, 3)
    if count in (4, 10):
        points = points[points.sum(axis=1) <= 1 + 1e-9]
    _, slopes = shape_functions(points, count)
    det = np.linalg.det(np.einsum("ead,qar->eqdr", nodes[elements], slopes))
    return float((det.min(axis=1) / np.abs(det).mean(axis=1)).min())


def fitted(values: Floats, weight: Floats, rest: Floats, quadrature: str, volume: str) -> Floats:
    """Values (e, q) of the fit of constants (``p0``) or linear functions (``p1``) of places at ``rest`` (e, k, 3)."""
    if volume == "as_is":
        return values
    columns = [np.ones(values.shape)]
    if volume == "p1":
        shape, _ = shape_functions(rule(quadrature)[0], rest.shape[1])
        x = np.einsum("qa,ead->eqd", shape, rest - rest[:, :1])
        columns += list(np.moveaxis(x / np.abs(x).max(axis=(1, 2), keepdims=True), -1, 0))
    root = np.sqrt(weight)
    Q, _ = np.linalg.qr(root[..., None] * np.stack(columns, axis=-1))
    return np.einsum("eqk,erk,er,er->eq", Q, Q, root, values) / root


def face_rule(count: int) -> tuple[Floats, Floats]:
    """Points (q, 2) and weights (q,) of the library's rule on faces of so many nodes, as :func:`on_face` has them."""
    points, weights = flat_rule("triangle7" if count in (3, 6) else "gauss3")
    return (points, weights) if count in (3, 6) else ((points + 1) / 2, weights / 4)


def on_face(count: int, points: Floats) -> tuple[Floats, Floats]:
    """Values (q, n) and derivatives (q, n, 2) of the shapes of a face of so many nodes at its ``points`` (q, 2)."""
    of = {3: 4, 6: 10, 4: 8, 8: 20}[count]
    on = np.flatnonzero(places(of)[:, 2] == 0)
    values, slopes = shape_functions(np.column_stack([points, np.zeros(len(points))]), of)
    return values[:, on], slopes[:, on, :2]


def face_forces(x: Floats, inside: Floats) -> tuple[Floats, Floats]:
    """int N_a dA (n,) and int N_a n dA (n, 3) of a face with nodes x (n, 3), n away from ``inside`` (3,).

    Corners come first, mid-sides behind each: of 3 or 6 nodes triangles, of 4 or 8 quadrilaterals. Each is the face of
    an element of space, whose shapes are taken. On warped faces dA is no polynomial: rules are those of the library,
    Radon's of seven points and Gauss' of three along each axis.
    """
    points, weights = face_rule(len(x))
    values, slopes = on_face(len(x), points)
    along, across = (slopes[..., d].copy() @ x for d in (0, 1))
    normal = np.asarray(np.cross(along, across) * weights[:, None], dtype=np.float64)
    way = np.sign(normal.sum(axis=0) @ (x.mean(axis=0) - inside))
    return values.T @ np.linalg.norm(normal, axis=1), way * values.T @ normal
