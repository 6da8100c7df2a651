"""Elements written a second time, for the fuzz study's recomputation: nothing of the library.

Tensors are full: strain and stress (e, q, 3, 3). Shapes: element e, point q, node a of the element, direction d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.independent.shapes import dense, rule, shape_functions

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

DENSE = 9
"""Points along either axis at which orientation is sampled, corners and sides included."""


@dataclass(frozen=True)
class Placed:
    """Elements on a configuration: dN/dx (e, q, k, 2), N/r (e, q, k), volume (e, q)."""

    slopes: Floats
    hoop: Floats
    volume: Floats


def place(nodes: Floats, elements: Ints, quadrature: str, axisymmetric: bool) -> Placed:
    """Gradients and volumes, of the full ring in axisymmetry and of unit thickness in plane strain."""
    points, weights = rule(quadrature)
    values, slopes = shape_functions(points, elements.shape[1])
    x = nodes[elements]
    J = np.einsum("ead,qar->eqdr", x, slopes)
    gradient = np.einsum("qar,eqrd->eqad", slopes, np.linalg.inv(J))
    volume = np.linalg.det(J) * weights
    if not axisymmetric:
        return Placed(gradient, np.zeros(gradient.shape[:3]), volume)
    radius = x[..., 0] @ values.T
    return Placed(gradient, values / radius[..., None], 2 * np.pi * radius * volume)


def displacement_gradient(placed: Placed, u: Floats) -> Floats:
    """du/dx (e, q, 3, 3), hoop strain at the end of the diagonal, of element displacements u (e, k, 2)."""
    G = np.zeros((*placed.volume.shape, 3, 3))
    G[..., :2, :2] = np.einsum("eai,eqaj->eqij", u, placed.slopes)
    G[..., 2, 2] = np.einsum("ea,eqa->eq", u[..., 0], placed.hoop)
    return G


def rotation(angle: Floats) -> Floats:
    """Rotation (..., 3, 3) by ``angle`` (...) about the third axis."""
    Q = np.zeros((*angle.shape, 3, 3))
    Q[..., 0, 0] = Q[..., 1, 1] = np.cos(angle)
    Q[..., 1, 0] = np.sin(angle)
    Q[..., 0, 1] = -Q[..., 1, 0]
    Q[..., 2, 2] = 1.0
    return Q


def turned(tensor: Floats, Q: Floats) -> Floats:
    """Q t Q'."""
    return Q @ tensor @ Q.swapaxes(-1, -2)


def element_forces(placed: Placed, stress: Floats) -> Floats:
    """Nodal forces (e, k, 2) of the stress (e, q, 3, 3): sum_q w (sigma . grad N + sigma_33 N/r e_1)."""
    forces = np.einsum("eqij,eqaj,eq->eai", stress[..., :2, :2], placed.slopes, placed.volume)
    forces[..., 0] += np.einsum("eq,eqa,eq->ea", stress[..., 2, 2], placed.hoop, placed.volume)
    return forces


def nodal(elements: Ints, values: Floats, count: int) -> Floats:
    """Sums (count, ...) over the elements of element values (e, k, ...)."""
    out = np.zeros((count, *values.shape[2:]))
    np.add.at(out, elements, values)
    return out


def nodal_stiffness(placed: Placed, elements: Ints, bulk: Floats, shear: Floats, count: int) -> Floats:
    """Diagonal blocks (count, 2, 2) of the elastic stiffness: sum_q w B_a' C B_a of every node a; moduli are (e, 1)."""
    g, h = placed.slopes, placed.hoop
    lame, shear = ((bulk - 2 * shear / 3)[..., None, None, None], shear[..., None, None, None])
    divergence = g.copy()
    divergence[..., 0] += h
    blocks = lame * np.einsum("eqai,eqaj->eqaij", divergence, divergence)
    blocks += shear * np.einsum("eqai,eqaj->eqaij", g, g).swapaxes(-1, -2)
    blocks += shear * np.vecdot(g, g)[..., None, None] * np.eye(2)
    blocks[..., 0, 0] += 2 * shear[..., 0, 0] * h**2
    return nodal(elements, np.einsum("eqaij,eq->eaij", blocks, placed.volume), count)


STRAIGHT = 1e-8
"""Of a Jacobian determinant over its mean: a corner between straight edges that lie on one line."""


def orientation(nodes: Floats, elements: Ints, axisymmetric: bool, straight: bool = False) -> float:
    """Smallest Jacobian determinant at :data:`DENSE` squared points over its element's mean, or a negative radius.

    Sampling can miss a fold, it cannot invent one. A point may lie on the axis, never beyond it. With ``straight``
    one point of each element of four nodes, where the determinant vanishes, is passed over.
    """
    values, slopes = shape_functions(dense(elements.shape[1], DENSE), elements.shape[1])
    x = nodes[elements]
    J = np.einsum("ead,qar->eqdr", x, slopes)
    determinant = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
    scaled = np.sort(determinant / np.abs(determinant).mean(axis=1, keepdims=True), axis=1)
    vanishes = (straight and elements.shape[1] == 4) & (np.abs(scaled[:, 0]) <= STRAIGHT)
    least = float(np.where(vanishes, scaled[:, 1], scaled[:, 0]).min())
    if axisymmetric:
        radius = x[..., 0] @ values.T
        beyond = float(radius.min() / np.abs(nodes[:, 0]).max())
        least = min(least, beyond) if beyond < -1e-12 else least
    return least
