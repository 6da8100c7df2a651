r"""Gradients of shape functions in a configuration, and the kinematics of an increment made of them.

Shapes: nodes (a, d), elements (e, k); with the :class:`~bipot.fem.reduction.Reduction` of the mesh's geometry strains
are Mandel vectors (e, q, s), B is (e, q, s, dk), volumes (e, q).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bipot.errors import InvertedElement
from bipot.fem import plane, solid
from bipot.fem.elements import Reference
from bipot.fem.projection import Projection, Projector
from bipot.fem.reduction import Geometry, Reduction
from bipot.tensors import identity, trace
from bipot.typing import Floats, Ints

CLOSED_FORMS = {2: plane, 3: solid}
"""The modules that invert and rotate tensors in d dimensions."""


@dataclass(frozen=True)
class Gradients:
    """Rows N,1 to N,d, and N/r with a ring, as ``shape`` (e, q, p, k), and the ``volume`` of each point (e, q).

    ``projection`` is that of the volume change; None leaves it unprojected.
    """

    reduction: Reduction
    shape: Floats
    volume: Floats
    projection: Projection | None

    @cached_property
    def projector(self) -> Projector | None:
        """The projection by the volumes, made at first use: Newton's passes need none.

        Raises:
            InvertedElement: see :meth:`bipot.fem.projection.Projection.at`.
        """
        return None if self.projection is None else self.projection.at(self.volume)

    @cached_property
    def B(self) -> Floats:
        """B (e, q, s, dk) of (23), Mandel strain from displacements (u_1, u_2 of node 1, ...), made at first use.

        Its trace is projected (:mod:`bipot.fem.projection`).
        """
        e, q, _, k = self.shape.shape
        D = np.zeros((e, q, len(self.reduction.entries), self.reduction.dimension * k))
        self.gradient_operator(D)
        B = self.reduction.symmetric @ D
        if self.projector is not None:
            B[:, :, :3] += self.projector.left(trace_rows(D, self.reduction))[:, :, None] / 3
        return B

    def gradient_operator(self, D: Floats) -> None:
        """Write D (e, q, m, dk), which maps displacements to g; entries not written remain zero."""
        for a, (i, row) in enumerate(self.reduction.places):
            D[:, :, a, i :: self.reduction.dimension] = self.shape[:, :, row]

    def of(self, du: Floats) -> Floats:
        """g (e, q, m) of element displacements du (e, k, d)."""
        e, q, p, k = self.shape.shape
        products = (self.shape.reshape(e, -1, k) @ du).reshape(e, q, p * du.shape[2])
        # N,j u_i, column by column; of a ring the last, N/r u_2, means nothing.
        return products[..., : len(self.reduction.entries)]


@dataclass(frozen=True)
class Kinematics(Gradients):
    """The kinematics of an increment at the points, and the gradients in its configuration of equilibrium.

    ``strain`` (e, q, s) is the strain increment and ``middle`` (e, q, m) g where it is taken; ``straining`` projects
    its volume change, by the weights there; ``half`` is the half rotation of tensors as in :mod:`bipot.fem.plane` or
    :mod:`bipot.fem.solid`, None if nothing rotates or moves.
    """

    strain: Floats
    middle: Floats
    straining: Projector | None = None
    half: Floats | None = None

    @cached_property
    def projector(self) -> Projector | None:
        """That of the strain where nothing moves."""
        return super().projector if self.moves else self.straining

    @property
    def divergence(self) -> Floats:
        """Volume change (e, q) of the points before projection."""
        return self.middle[..., self.reduction.diagonal].sum(axis=-1)

    def part(self, elements: slice) -> Kinematics:
        """The part of some elements."""
        projection, straining, half = self.projection, self.straining, self.half
        return Kinematics(
            reduction=self.reduction,
            shape=self.shape[elements],
            volume=self.volume[elements],
            projection=None if projection is None else projection.part(elements),
            strain=self.strain[elements],
            middle=self.middle[elements],
            straining=None if straining is None else straining.part(elements),
            half=None if half is None else half[..., elements, :],
        )

    @property
    def moves(self) -> bool:
        """Whether the configuration of equilibrium moves with the increment."""
        return self.half is not None

    def turned(self, tensor: Floats) -> Floats:
        """A tensor (e, q, s) of the increment's start turned with the body to its end."""
        return tensor if self._whole is None else CLOSED_FORMS[self.reduction.dimension].turn(tensor, self._whole)

    def turned_back(self, tensor: Floats) -> Floats:
        """A tensor (e, q, s) of the increment's end turned back to its start."""
        forms = CLOSED_FORMS[self.reduction.dimension]
        return tensor if self._whole is None else forms.turn(tensor, forms.back(self._whole))

    @cached_property
    def _whole(self) -> Floats | None:
        """The whole rotation, in the same form as :attr:`half`; None if nothing rotates."""
        return None if self.half is None else CLOSED_FORMS[self.reduction.dimension].twice(self.half)

    @property
    def volume_before(self) -> Floats:
        """Volume (e, q) at the increment's start."""
        if self.half is None:
            return self.volume
        return self.volume * np.exp(-self.divergence)


def strained(strain: Floats, projector: Projector | None) -> Floats:
    """The Mandel strain (e, q, s) with its trace projected."""
    if projector is None:
        return strain
    own = trace(strain)
    return strain + (projector.of(own) - own)[..., None] / 3 * identity(strain.shape[-1])


def trace_rows(D: Floats, reduction: Reduction) -> Floats:
    """Rows (e, q, dk) of the trace of g, from D (e, q, m, dk)."""
    a, *others = reduction.diagonal
    out = D[:, :, a].copy()
    for b in others:
        out += D[:, :, b]
    return out


def gradients(
    nodes: Floats, elements: Ints, reference: Reference, geometry: Geometry, projection: Projection | None = None
) -> Gradients:
    """Shape gradients and volumes on the configuration ``nodes``; for axisymmetry volumes are those of the full ring.

    Raises:
        InvertedElement: a Jacobian determinant or a radius at an integration point is not positive.
    """
    x, reduction = nodes.take(elements, axis=0), geometry.reduction
    # dx/dxi (e, q, d, d), components first in memory: a product for each of them.
    slopes = (x.transpose(2, 0, 1)[:, None] @ reference.gradients.transpose(2, 1, 0)).transpose(2, 3, 0, 1)
    inverse, determinant = CLOSED_FORMS[reduction.dimension].cofactors(slopes)
    refuse_inverted(determinant, "Jacobian determinant", nodes, elements)
    inverse /= determinant[..., None, None]
    (e, q), k, d = determinant.shape, x.shape[1], reduction.dimension
    shape = np.empty((e, q, reduction.rows, k))
    # One product of all elements for each point of the rule takes a third of the time of one for each pair.
    slopes = inverse.transpose(1, 0, 2, 3).reshape(q, e * d, d) @ reference.gradients.transpose(0, 2, 1)
    shape[:, :, :d] = slopes.reshape(q, e, d, k).transpose(1, 0, 2, 3)
    volume = determinant * reference.weights
    if reduction.ring:
        radius = x[..., 0] @ reference.values.T
        refuse_inverted(radius, "radius", nodes, elements)
        np.divide(reference.values, radius[..., None], out=shape[:, :, d])
        volume = 2 * np.pi * radius * volume
    return Gradients(reduction, shape, volume, projection)


def refuse_inverted(positive: Floats, name: str, nodes: Floats, elements: Ints) -> None:
    """Refuse ``elements`` (e, k) of ``nodes`` (a, d) in which ``positive`` (e, q), called ``name``, is not."""
    if positive.min() > 0:
        return
    worst = int(np.unravel_index(np.argmin(positive), positive.shape)[0])
    place = np.round(nodes[elements[worst]].mean(axis=0), 6)
    raise InvertedElement(f"element {worst} at {tuple(place.tolist())}: {name} {positive.min():.3g} is not positive")
