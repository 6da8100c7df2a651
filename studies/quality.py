r"""How far elements are from what they were at rest, or from squares.

With J = dx/dxi on the reference shape:

    Jacobian ratio = min det J / mean det J       (1: parallelogram, straight triangle; <= 0: folded), a lower bound,
    aspect ratio   = max sigma_1(J) / sigma_2(J)  (1: square), the ratio of principal stretches: shear counts,
    stretch ratio  = max sigma_1(F) / sigma_2(F)  (1: the form it had at rest), F = J J_0^-1 with J_0 at rest,

the aspect sampled where distortion shows first, at the corners, and at the points of the element's fullest rule; the
stretch at those points alone, for where an angle between straight edges has become straight, on a tool, it is infinite
at that corner. In a mesh of squares aspect and stretch ratio are one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.fem.elements import Quadrature, tabulated, tabulated_at
from bipot.fem.orientation import scaled_jacobians
from bipot.meshes.elements import Element
from bipot.typing import Floats, Ints, einsum

FULLEST = {4: Quadrature.GAUSS3, 3: Quadrature.TRIANGLE7}
"""By the number of corners."""


@dataclass(frozen=True)
class Quality:
    """Jacobian ratio (e,) and aspect ratio (e,) of every element (module docstring)."""

    jacobian: Floats
    aspect: Floats


def quality(nodes: Floats, elements: Ints) -> Quality:
    """Quality of the elements (e, k) with nodes (a, 2): corners anticlockwise, then mid-sides, then the middle.

    >>> x = np.array([[0, 0], [2, 0], [2, 1], [0, 1], [1, 0], [2, 0.5], [1, 1], [0, 0.5]])
    >>> quality(x, np.arange(8)[None]).aspect.round(12)
    array([2.])
    """
    return Quality(scaled_jacobians(nodes, elements), _ratio(jacobians(nodes[elements])))


def stretch_ratios(nodes: Floats, elements: Ints, rest: Floats) -> Floats:
    """Stretch ratio (e,) of the elements (e, k) that have come from ``rest`` (a, 2) to ``nodes`` (a, 2).

    >>> x = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 1.0]])
    >>> stretch_ratios(x * [1.0, 0.5], np.arange(3)[None], x).round(12)
    array([2.])
    """
    inside = slice(Element.of(elements.shape[1]).corners, None)
    now, before = (jacobians(x[elements])[:, inside] for x in (nodes, rest))
    return _ratio(now @ np.linalg.inv(before))


def jacobians(x: Floats) -> Floats:
    """J (e, q, 2, 2) of elements x (e, k, 2) at their corners, then inside."""
    element = Element.of(x.shape[1])
    places = tabulated_at(element, element.places), tabulated(element, FULLEST[element.corners])
    gradients = np.concatenate([place.gradients for place in places])
    return einsum("eka,qkb->eqab", x, gradients)


def _ratio(jacobian: Floats) -> Floats:
    stretch = np.linalg.svd(jacobian, compute_uv=False)
    with np.errstate(divide="ignore"):
        return (stretch[..., 0] / stretch[..., 1]).max(axis=1)
