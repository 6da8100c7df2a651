r"""The eight-node element written a second time, for the fuzz study's recomputation: nothing of the library.

On the square [-1, 1]^2, corners (-1, -1), (1, -1), (1, 1), (-1, 1), then the mid-sides in the same turn:

    N_c = (1 + a)(1 + b)(a + b - 1)/4 with a = xi xi_c, b = eta eta_c,
    N_m = (1 - xi^2)(1 + b)/2 on eta = +-1,    N_m = (1 - eta^2)(1 + a)/2 on xi = +-1.

Tensors are full: strain and stress (e, q, 3, 3). Shapes: element e, point q, node a of the element, direction d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

CORNERS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
MIDDLES = np.array([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])
DENSE = 9
"""Points along either axis at which orientation is sampled, corners and sides included."""


def shape_functions(points: Floats) -> tuple[Floats, Floats]:
    """Values (q, 8) and derivatives (q, 8, 2) at ``points`` (q, 2).

    >>> values, slopes = shape_functions(np.array([[0.3, -0.2]]))
    >>> round(float(values.sum()), 12), np.abs(slopes.sum(axis=1)).max() < 1e-15
    (1.0, np.True_)
    """
    values, slopes = np.empty((len(points), 8)), np.empty((len(points), 8, 2))
    xi, eta = points.T
    for k, (x, y) in enumerate(CORNERS):
        a, b = xi * x, eta * y
        values[:, k] = (1 + a) * (1 + b) * (a + b - 1) / 4
        slopes[:, k, 0] = x * (1 + b) * (2 * a + b) / 4
        slopes[:, k, 1] = y * (1 + a) * (a + 2 * b) / 4
    for k, (x, y) in enumerate(MIDDLES, 4):
        if x == 0:
            values[:, k] = (1 - xi**2) * (1 + eta * y) / 2
            slopes[:, k, 0], slopes[:, k, 1] = -xi * (1 + eta * y), y * (1 - xi**2) / 2
        else:
            values[:, k] = (1 - eta**2) * (1 + xi * x) / 2
            slopes[:, k, 0], slopes[:, k, 1] = x * (1 - eta**2) / 2, -eta * (1 + xi * x)
    return values, slopes


def rule(name: str) -> tuple[Floats, Floats]:
    """Points (q, 2) and weights (q,) of ``gauss2``, ``gauss3`` or ``radon7``, in the order stresses are stored in."""
    if name == "radon7":
        a, b, c = np.sqrt(14 / 15), np.sqrt(3 / 5), np.sqrt(1 / 3)
        points = [(0, 0), (0, a), (0, -a), (b, c), (b, -c), (-b, c), (-b, -c)]
        return np.array(points), np.array([8 / 7, 20 / 63, 20 / 63, 5 / 9, 5 / 9, 5 / 9, 5 / 9])
    if name == "gauss2":
        line, weight = np.array([-1, 1]) / np.sqrt(3), np.ones(2)
    elif name == "gauss3":
        line, weight = np.array([-1, 0, 1]) * np.sqrt(3 / 5), np.array([5, 8, 5]) / 9
    else:
        raise ValueError(f"unknown rule {name!r}")
    return np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2), np.outer(weight, weight).ravel()


@dataclass(frozen=True)
class Placed:
    """Elements on a configuration: dN/dx (e, q, 8, 2), N/r (e, q, 8), volume (e, q)."""

    slopes: Floats
    hoop: Floats
    volume: Floats


def place(nodes: Floats, elements: Ints, quadrature: str, axisymmetric: bool) -> Placed:
    """Gradients and volumes, of the full ring in axisymmetry and of unit thickness in plane strain."""
    points, weights = rule(quadrature)
    values, slopes = shape_functions(points)
    x = nodes[elements]
    J = np.einsum("ead,qar->eqdr", x, slopes)
    gradient = np.einsum("qar,eqrd->eqad", slopes, np.linalg.inv(J))
    volume = np.linalg.det(J) * weights
    if not axisymmetric:
        return Placed(gradient, np.zeros(gradient.shape[:3]), volume)
    radius = x[..., 0] @ values.T
    return Placed(gradient, values / radius[..., None], 2 * np.pi * radius * volume)


def displacement_gradient(placed: Placed, u: Floats) -> Floats:
    """du/dx (e, q, 3, 3), hoop strain at the end of the diagonal, of element displacements u (e, 8, 2)."""
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
    """Nodal forces (e, 8, 2) of the stress (e, q, 3, 3): sum_q w (sigma . grad N + sigma_33 N/r e_1)."""
    forces = np.einsum("eqij,eqaj,eq->eai", stress[..., :2, :2], placed.slopes, placed.volume)
    forces[..., 0] += np.einsum("eq,eqa,eq->ea", stress[..., 2, 2], placed.hoop, placed.volume)
    return forces


def nodal(elements: Ints, values: Floats, count: int) -> Floats:
    """Sums (count, ...) over the elements of element values (e, 8, ...)."""
    out = np.zeros((count, *values.shape[2:]))
    np.add.at(out, elements, values)
    return out


def nodal_stiffness(placed: Placed, elements: Ints, bulk: float, shear: float, count: int) -> Floats:
    """Diagonal blocks (count, 2, 2) of the elastic stiffness: sum_q w B_a' C B_a of every node a."""
    g, h = placed.slopes, placed.hoop
    lame = bulk - 2 * shear / 3
    divergence = g.copy()
    divergence[..., 0] += h
    blocks = lame * np.einsum("eqai,eqaj->eqaij", divergence, divergence)
    blocks += shear * np.einsum("eqai,eqaj->eqaij", g, g).swapaxes(-1, -2)
    blocks += shear * np.vecdot(g, g)[..., None, None] * np.eye(2)
    blocks[..., 0, 0] += 2 * shear * h**2
    return nodal(elements, np.einsum("eqaij,eq->eaij", blocks, placed.volume), count)


def orientation(nodes: Floats, elements: Ints, axisymmetric: bool) -> float:
    """Smallest Jacobian determinant at :data:`DENSE` squared points over its element's mean, or a negative radius.

    Sampling can miss a fold, it cannot invent one. A point may lie on the axis, never beyond it.
    """
    line = np.linspace(-1, 1, DENSE)
    values, slopes = shape_functions(np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2))
    x = nodes[elements]
    J = np.einsum("ead,qar->eqdr", x, slopes)
    determinant = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
    least = float((determinant / np.abs(determinant).mean(axis=1, keepdims=True)).min())
    if axisymmetric:
        radius = x[..., 0] @ values.T
        beyond = float(radius.min() / np.abs(nodes[:, 0]).max())
        least = min(least, beyond) if beyond < -1e-12 else least
    return least
