"""Projected volume changes written a second time, for the fuzz study's recomputation: nothing of the library.

The weighted least-squares fit of a constant (``p0``), or of a linear function of the places at rest (``p1``), to values
at the points of each element, by Householder reflections.
"""

from __future__ import annotations

import numpy as np

from studies.independent.data import Floats, Setting
from studies.independent.shapes import rule, shape_functions


def fitted(s: Setting, values: Floats, weight: Floats) -> Floats:
    """Values (e, q) of the fit to ``values`` with the weights (e, q), or these where nothing is projected."""
    if s.volume == "as_is":
        return values
    shape, _ = shape_functions(rule(s.quadrature)[0], s.elements.shape[1])
    columns = [np.ones(values.shape)]
    if s.volume == "p1":
        places = np.einsum("qa,ead->eqd", shape, s.rest[s.elements])
        first = places[:, :1]
        extent = np.abs(places - first).max(axis=(1, 2), keepdims=True)
        columns += list(np.moveaxis((places - first) / extent, -1, 0))
    A, root = np.stack(columns, axis=-1), np.sqrt(weight)
    Q, _ = np.linalg.qr(root[..., None] * A)
    return np.einsum("eqk,erk,er,er->eq", Q, Q, root, values) / root


def with_fitted_trace(s: Setting, tensor: Floats, weight: Floats) -> Floats:
    """The tensor (e, q, 3, 3) with the fit to its trace for that trace."""
    trace = np.trace(tensor, axis1=-2, axis2=-1)
    return tensor + (fitted(s, trace, weight) - trace)[..., None, None] / 3 * np.eye(3)
