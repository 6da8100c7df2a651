r"""How far eight-node quadrilaterals are from squares.

With J = dx/dxi on the reference square:

    Jacobian ratio = min det J / mean det J       (1: parallelogram; <= 0: folded), a lower bound over the whole square,
    aspect ratio   = max sigma_1(J) / sigma_2(J)  (1: square), the ratio of principal stretches: shear counts,

the latter sampled where distortion shows first, at the four corners, and at the 3 x 3 Gauss points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.elements import Element
from bipot.fem.elements import Quadrature, tabulated
from bipot.fem.orientation import scaled_jacobians
from bipot.typing import Floats, Ints


@dataclass(frozen=True)
class Quality:
    """Jacobian ratio (e,) and aspect ratio (e,) of every element (module docstring)."""

    jacobian: Floats
    aspect: Floats


def quality(nodes: Floats, elements: Ints) -> Quality:
    """Quality of the elements (e, 8) with nodes (a, 2): four corners anticlockwise, then mid-sides.

    >>> x = np.array([[0, 0], [2, 0], [2, 1], [0, 1], [1, 0], [2, 0.5], [1, 1], [0, 0.5]])
    >>> quality(x, np.arange(8)[None]).aspect.round(12)
    array([2.])
    """
    x = nodes[elements]
    inside = np.einsum("eka,qkb->eqab", x, tabulated(Element.Q8, Quadrature.GAUSS3).gradients)
    stretch = np.linalg.svd(np.concatenate([inside, corner_jacobians(x)], axis=1), compute_uv=False)
    with np.errstate(divide="ignore"):
        aspect = stretch[..., 0] / stretch[..., 1]
    return Quality(scaled_jacobians(nodes, elements), aspect.max(axis=1))


def corner_jacobians(x: Floats) -> Floats:
    """J (e, 4, 2, 2) at the corners of x (e, 8, 2): the tangents of the two parabolas that meet there.

    Each corner has its own axes, turned by a right angle from the last: det J and singular values are those
    of the common reference square.
    """
    corner, middle = x[:, :4], x[:, 4:]
    forth = -3 * corner + 4 * middle - np.roll(corner, -1, axis=1)
    back = -3 * corner + 4 * np.roll(middle, 1, axis=1) - np.roll(corner, 1, axis=1)
    return np.stack([forth, back], axis=-1)
