r"""From nodal displacement increments to strain, rotation, B and volumes, for all points at once.

Configuration ``midpoint``: the strain increment is the symmetric gradient at x_n + dU/2, rotated by *half* the
Hughes-Winget rotation; the stress is rotated by the whole; equilibrium, hence B and the volumes, at x_n + dU.
Configuration ``paper``: strain, B and volumes on x_n, no rotation (the geometry follows by (30) afterwards).

Shapes: nodes (a, 2), elements (e, k); strain (e, q, 4) as Mandel vectors, B (e, q, 4, 2k), volume (e, q).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from bipot.errors import InvertedElement
from bipot.fem.elements import Reference
from bipot.typing import Floats, Ints

MANDEL_2D, GRADIENT = 4, 5
"""Entries of a Mandel vector, and of g = (u_1,1  u_1,2  u_2,1  u_2,2  u_1/r), the displacement gradient."""

SQRT2 = np.sqrt(2.0)
SYMMETRIC = np.zeros((MANDEL_2D, GRADIENT))
SYMMETRIC[0, 0] = SYMMETRIC[1, 3] = SYMMETRIC[2, 4] = 1.0
SYMMETRIC[3, 1:3] = 1 / SQRT2
SYMMETRIC.flags.writeable = False
"""What takes g to the Mandel vector of its symmetric part."""


class Geometry(Enum):
    """What the plane of the mesh stands for."""

    AXISYMMETRIC = "axisymmetric"
    PLANE_STRAIN = "plane_strain"


class Configuration(Enum):
    """Where an increment's strain and equilibrium are evaluated (module docstring)."""

    MIDPOINT = "midpoint"
    PAPER = "paper"


@dataclass(frozen=True)
class Gradients:
    """Rows N,1, N,2 and N/r (e, q, 3, k), the last zero in plane strain, and physical volume of each point (e, q)."""

    shape: Floats
    volume: Floats


@dataclass(frozen=True)
class Kinematics:
    """Strain increment (e, q, 4), rotation angle (e, q), and gradients (e, q, 3, k), volume where equilibrium is asked.

    ``middle`` (e, q, 2, 2) and ``hoop`` (e, q) are du/dx and du_1/r where the strain is taken.
    """

    strain: Floats
    angle: Floats
    shape: Floats
    volume: Floats
    middle: Floats
    hoop: Floats

    @cached_property
    def B(self) -> Floats:
        """B (e, q, 4, 2k) of (23), made when first asked for: Newton's passes live without it."""
        return strain_operator(self.shape)


def _by_reference(x: Floats, reference: Reference) -> Floats:
    """dx/dxi (e, q, 2, 2) of element values (e, k, 2): one dense product, nine times faster than one a point."""
    (e, k, d), q = x.shape, len(reference.weights)
    table = reference.gradients.transpose(1, 0, 2).reshape(k, q * d)
    return (x.transpose(0, 2, 1).reshape(e * d, k) @ table).reshape(e, d, q, d).transpose(0, 2, 1, 3)


def _determinant(J: Floats) -> Floats:
    return J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]


def gradients(nodes: Floats, elements: Ints, reference: Reference, geometry: Geometry) -> Gradients:
    """Shape gradients and volumes on the configuration ``nodes``; for axisymmetry volumes are those of the full ring.

    Raises:
        InvertedElement: a Jacobian determinant or a radius at an integration point is not positive.
    """
    x = nodes.take(elements, axis=0)
    J = _by_reference(x, reference)
    determinant = _determinant(J)
    _refuse_inverted(determinant, "Jacobian determinant", x)
    inverse = np.empty(J.shape)
    inverse[..., 0, 0], inverse[..., 1, 1] = J[..., 1, 1], J[..., 0, 0]
    inverse[..., 0, 1], inverse[..., 1, 0] = -J[..., 1, 0], -J[..., 0, 1]
    inverse /= determinant[..., None, None]
    (e, q), k = determinant.shape, x.shape[1]
    shape = np.empty((e, q, 3, k))
    np.matmul(inverse, reference.gradients.transpose(0, 2, 1), out=shape[:, :, :2])
    volume = determinant * reference.weights
    if geometry is Geometry.PLANE_STRAIN:
        shape[:, :, 2] = 0.0
        return Gradients(shape, volume)
    radius = x[..., 0] @ reference.values.T
    _refuse_inverted(radius, "radius", x)
    np.divide(reference.values, radius[..., None], out=shape[:, :, 2])
    return Gradients(shape, 2 * np.pi * radius * volume)


def _refuse_inverted(positive: Floats, name: str, x: Floats) -> None:
    if positive.min() > 0:
        return
    worst = int(np.unravel_index(np.argmin(positive), positive.shape)[0])
    place = np.round(x[worst].mean(axis=0), 6)
    raise InvertedElement(f"element {worst} at {tuple(place.tolist())}: {name} {positive.min():.3g} is not positive")


def strain_operator(shape: Floats) -> Floats:
    """B (e, q, 4, 2k) of (23): Mandel strain from the element's displacements (u_1, u_2 of node 1, ...)."""
    e, q, _, k = shape.shape
    D = np.zeros((e, q, GRADIENT, 2 * k))
    gradient_operator(shape, D)
    return SYMMETRIC @ D


def gradient_operator(shape: Floats, D: Floats) -> None:
    """Write D (e, q, 5, 2k) from the gradients (e, q, 3, k); what is not written stays zero."""
    D[:, :, 0, 0::2] = D[:, :, 2, 1::2] = shape[:, :, 0]
    D[:, :, 1, 0::2] = D[:, :, 3, 1::2] = shape[:, :, 1]
    D[:, :, 4, 0::2] = shape[:, :, 2]


def _displacement_gradient(grad: Gradients, du: Floats) -> tuple[Floats, Floats]:
    """du/dx (e, q, 2, 2) and du_1/r (e, q), zero in plane strain, of element displacements du (e, k, 2)."""
    e, q, rows, k = grad.shape.shape
    columns = (grad.shape.reshape(e, -1, k) @ du).reshape(e, q, rows, 2)
    return columns[:, :, :2].swapaxes(-1, -2), columns[:, :, 2, 0]


def _strain(G: Floats, hoop: Floats) -> Floats:
    """Symmetric part (e, q, 4) of a displacement gradient."""
    strain = np.empty((*hoop.shape, MANDEL_2D))
    strain[..., 0], strain[..., 1], strain[..., 2] = G[..., 0, 0], G[..., 1, 1], hoop
    strain[..., 3] = (G[..., 0, 1] + G[..., 1, 0]) / SQRT2
    return strain


def _at_middle(G: Floats, hoop: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Gradient and hoop strain at the middle, G (I - G/2)^-1 and h / (1 - h/2), from those at the end.

    Jacobian determinant and radius at the middle are det (I - G/2) and 1 - h/2 times those at the end.
    """
    half = _determinant(G) / 2
    ratio, shrink = 1 - (G[..., 0, 0] + G[..., 1, 1]) / 2 + half / 2, 1 - hoop / 2
    _refuse_inverted(ratio, "Jacobian determinant at the middle over that at the end", x)
    _refuse_inverted(shrink, "radius at the middle over that at the end", x)
    # Cayley-Hamilton: G (I - G/2)^-1 = (G - det G / 2 I) / det (I - G/2).
    out = G.copy()
    out[..., 0, 0] -= half
    out[..., 1, 1] -= half
    out /= ratio[..., None, None]
    return out, hoop / shrink


def rotate(tensor: Floats, angle: Floats) -> Floats:
    """Rotate Mandel tensors (..., 4) by ``angle`` (...) about the third axis: Q t Q^T.

    >>> rotate(np.array([1.0, 0.0, 0.0, 0.0]), np.array(np.pi / 2)).round(12)
    array([0., 1., 0., 0.])
    """
    # Mohr's circle: twice the angle.
    c, s = np.cos(2 * angle), np.sin(2 * angle)
    a, b, m = tensor[..., 0], tensor[..., 1], tensor[..., 3] / SQRT2
    mean, half = (a + b) / 2, (a - b) / 2
    across = c * half - s * m
    out = np.empty(np.broadcast_shapes(tensor.shape, (*np.shape(angle), MANDEL_2D)))
    out[..., 0] = mean + across
    out[..., 1] = mean - across
    out[..., 2] = tensor[..., 2]
    out[..., 3] = SQRT2 * (s * half + c * m)
    return out


def increment(
    nodes: Floats,
    du: Floats,
    elements: Ints,
    reference: Reference,
    geometry: Geometry,
    configuration: Configuration,
) -> Kinematics:
    """Kinematics of one increment ``du`` (a, 2) from the configuration ``nodes`` (a, 2).

    Hughes-Winget: the rotation of spin w is the angle 2 atan(w/2), so half of it is atan(w/2).

    Raises:
        InvertedElement: at the middle or at the end of the increment.
    """
    element_du = du.take(elements, axis=0)
    if configuration is Configuration.PAPER:
        start = gradients(nodes, elements, reference, geometry)
        G, hoop = _displacement_gradient(start, element_du)
        return Kinematics(_strain(G, hoop), np.zeros(hoop.shape), start.shape, start.volume, G, hoop)
    end = gradients(nodes + du, elements, reference, geometry)
    middle, hoop = _at_middle(*_displacement_gradient(end, element_du), nodes[elements])
    half = np.arctan((middle[..., 1, 0] - middle[..., 0, 1]) / 4)
    strain = rotate(_strain(middle, hoop), half)
    return Kinematics(strain, 2 * half, end.shape, end.volume, middle, hoop)
