r"""The volume change of an element, projected on a small space of functions: a cure for volumetric locking.

With theta = tr e the unprojected volume change at the points of an element, weights w in the configuration where the
strain is taken (in ``midpoint`` w_1 exp(-theta/2), w_1 the volumes at the end), and functions phi_k that span the
projected volume change,

    e' = e + (Pi theta - theta) 1/3,    Pi = phi (phi' w phi)^-1 phi' w,

so that sum_q w phi_k (Pi theta - theta) = 0. phi is 1 (``p0``, the mean dilatation) or 1 and the coordinates at rest
(``p1``). The values of phi at the points never change. The pressure, which follows from tr e' alone where plastic flow
preserves the volume, therefore stays in span phi if it starts there. Then Pi p = p at any weights, and the force dual
to e' in the configuration of equilibrium, sum_q w_1 B'(s + Pi p 1), is that of the stress at the points, which needs no
projection. With the weights of the middle the error of accumulated volume changes is of order two in the increment,
with those of the end of order one. As elements are refined their maps become affine, and functions linear at rest are
linear in the current configuration.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from bipot.errors import InvertedElement
from bipot.fem.elements import Reference
from bipot.meshes.elements import Element
from bipot.typing import Floats, Ints, read_only


class VolumeChange(Enum):
    """How the volume change of an element is represented: as it is, or projected on constants or linear functions."""

    AS_IS = "as_is"
    P0 = "p0"
    P1 = "p1"


VOLUMES = {
    Element.T3: (VolumeChange.AS_IS,),
    Element.T6: (VolumeChange.P0, VolumeChange.AS_IS),
    Element.Q4: (VolumeChange.P0, VolumeChange.AS_IS),
    Element.Q8: (VolumeChange.P1, VolumeChange.AS_IS, VolumeChange.P0),
    Element.Q9: (VolumeChange.P1, VolumeChange.AS_IS, VolumeChange.P0),
    Element.T4: (VolumeChange.AS_IS,),
    Element.T10: (VolumeChange.P0, VolumeChange.AS_IS),
    Element.H8: (VolumeChange.P0, VolumeChange.AS_IS),
    Element.H20: (VolumeChange.P1, VolumeChange.AS_IS, VolumeChange.P0),
}
"""The choices of an element, its default first: the most constraints that its displacements can satisfy.

P1 of T6 would have as many constraints as unknowns, and T3 can satisfy none.
"""


@dataclass(frozen=True)
class Projector:
    """Pi at given weights w (e, q): ``spread`` phi (phi' w phi)^-1 phi' (e, q, q)."""

    spread: Floats
    weight: Floats

    def of(self, values: Floats) -> Floats:
        """Pi of values (e, q) or (e, q, n)."""
        if values.ndim == 2:
            return (self.spread @ (self.weight * values)[..., None])[..., 0]
        return self.spread @ (self.weight[..., None] * values)

    def part(self, elements: slice) -> Projector:
        """Pi of some elements."""
        return Projector(self.spread[elements], self.weight[elements])

    def left(self, rows: Floats) -> Floats:
        """(Pi - 1) of rows (e, q, n)."""
        return self.of(rows) - rows


@dataclass(frozen=True)
class Projection:
    """The functions phi (e, q, k) that span the volume change of every element."""

    functions: Floats

    def part(self, elements: slice) -> Projection:
        """The projection of some elements."""
        return Projection(self.functions[elements])

    @staticmethod
    def of(volume: VolumeChange, nodes: Floats, elements: Ints, reference: Reference) -> Projection | None:
        """The projection for a mesh at rest, None if the volume change is not projected."""
        if volume is VolumeChange.AS_IS:
            return None
        x = nodes[elements]
        ones = np.ones((len(elements), len(reference.weights), 1))
        if volume is VolumeChange.P0:
            return Projection(read_only(ones, np.float64))
        # From the element's middle, over its size: phi' w phi depends on neither units nor place.
        x = (x - x.mean(axis=1, keepdims=True)) / np.ptp(x, axis=(1, 2))[:, None, None]
        return Projection(read_only(np.concatenate([ones, reference.values @ x], axis=2), np.float64))

    def at(self, weight: Floats) -> Projector:
        """Pi at the weights (e, q).

        Raises:
            InvertedElement: one weight of an element is all of its sum, to round-off: a trial nearly folds it.
        """
        phi = self.functions
        across = phi.transpose(0, 2, 1)
        try:
            return Projector(phi @ np.linalg.solve(across @ (weight[..., None] * phi), across), weight)
        except np.linalg.LinAlgError as singular:
            worst = int(np.argmin(weight.min(axis=1) / weight.max(axis=1)))
            few = f"element {worst}: a point's volume is {weight[worst].max() / weight[worst].min():.3g} of another's"
            raise InvertedElement(few) from singular
