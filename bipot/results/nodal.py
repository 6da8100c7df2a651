r"""Fields of integration points at nodes: the best linear function of each element, averaged over those around a node.

In the reference element the function is the least-squares fit of the values s_q in the rule's weights; for one point it
is constant. With its values E s at the nodes of an element of volume V_e, the value at a node is

    sum_e V_e (E s_e) / sum_e V_e.

Functions linear in the reference coordinates are reproduced. Extrapolated values may exceed the extremes at the points,
more so for steep fields; the solved values are those at the points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from bipot.fem.elements import Quadrature, tabulated
from bipot.meshes.mesh import Mesh
from bipot.typing import Floats


@dataclass(frozen=True)
class Averaging:
    """``extrapolation`` (k, q) from points to nodes of an element, ``gathering`` (a, e k) from elements to nodes."""

    extrapolation: Floats
    gathering: sp.csr_matrix

    @staticmethod
    def of(mesh: Mesh, rule: Quadrature) -> Averaging:
        """The averaging for a mesh and its integration rule."""
        count, k = mesh.elements.shape
        columns = np.arange(count * k)
        ones = np.ones(count * k)
        gathering = sp.csr_matrix((ones, (mesh.elements.ravel(), columns)), shape=(len(mesh.nodes), count * k))
        return Averaging(_extrapolation(mesh, rule), gathering)

    def __call__(self, volume: Floats, values: Floats) -> Floats:
        """Values (a, f) at nodes of ``values`` (e, q, f) at points that have the ``volume`` (e, q)."""
        k = len(self.extrapolation)
        weight = volume.sum(axis=1)
        weighted = weight[:, None, None] * (self.extrapolation @ values)
        around = self.gathering @ np.repeat(weight, k)
        return (self.gathering @ weighted.reshape(-1, values.shape[-1])) / around[:, None]


def _extrapolation(mesh: Mesh, rule: Quadrature) -> Floats:
    """E (k, q)."""
    reference, nodes = tabulated(mesh.element, rule), mesh.element.every_place
    # A linear function needs as many points as it has coefficients.
    if len(reference.weights) < 1 + nodes.shape[1]:
        return np.full((len(nodes), len(reference.weights)), 1 / len(reference.weights))
    at_points, at_nodes = (np.column_stack([np.ones(len(x)), x]) for x in (reference.points, nodes))
    weighted = at_points.T * reference.weights
    return at_nodes @ np.linalg.solve(weighted @ at_points, weighted)
