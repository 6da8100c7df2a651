r"""Strain measures: where the strain and equilibrium of an increment are evaluated, and their derivatives.

``midpoint``: the strain increment is the symmetric gradient at x_n + dU/2, rotated by *half* the Hughes-Winget
rotation; the stress is rotated by the whole; equilibrium, hence B and the volumes, at x_n + dU. With H the displacement
gradient at the end, that at the middle is H (I - H/2)^-1. The rotation of spin w is the angle 2 atan(|w|/2).
``paper``: strain, B and volumes on x_n, no rotation (the geometry follows by (30) afterwards).
``small``: the same on the configuration at rest: small strains and rotations, in which a limit load is a plateau if the
element has one. Gaps are those at the current positions, where elements must not be folded.

The element tangent is K_e = d f / d dU. In the last two measures nothing moves and it is that of (25). In ``midpoint``
the strain, the rotation of the stress, B and the volumes all move. With g the entries of H, f = sum_q w D' t and t the
stress dual to g (D maps an element's displacements to g):

    K_e = sum_q w D' [ J C_alg (d e / d g) + Q ] D,     t = J s,    Q = t x trace + d(D' t)/dg at fixed t.

With H that of the middle, a change dH at the end is (I - H/2) dH (I + H/2) there. The result is unsymmetric.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from bipot.fem.assembly import element_stiffness
from bipot.fem.elements import Reference
from bipot.fem.kinematics import CLOSED_FORMS, Kinematics, gradients, refuse_inverted, strained, trace_rows
from bipot.fem.projection import Projection, Projector
from bipot.fem.reduction import Geometry, Reduction
from bipot.tensors import contract, trace
from bipot.typing import Floats, Ints

TOGETHER = 2**17
"""Number of entries of D that are computed at a time: a megabyte."""

LARGEST = 300.0
"""Volume strain that no answer has, and of which the exponential is a number: iterates that run away have any."""


@dataclass(frozen=True)
class Scratch:
    """Reusable memory of element tangents: Z (p, q, m, m), D and Z D (p, q, m, dk), K_e (e, dk, dk).

    These are the largest arrays of a Newton pass; allocating them anew costs more than the operations on them. All but
    the last hold p elements at a time, which fit in the processor's cache. Where the volume change is projected, Z, D
    and Z D have a row more, of the trace.
    """

    Z: Floats
    D: Floats
    ZD: Floats
    K: Floats

    @staticmethod
    def of(elements: int, points: int, unknowns: int, reduction: Reduction, projected: bool) -> Scratch:
        """Memory for e ``elements`` of q ``points`` and dk ``unknowns`` each."""
        m = len(reduction.entries)
        p = max(min(elements, TOGETHER // (points * m * unknowns)), 1)
        rows = (p, points, m + projected)
        K = np.empty((elements, unknowns, unknowns))
        return Scratch(np.empty((*rows, m)), np.zeros((*rows, unknowns)), np.empty((*rows, unknowns)), K)

    def part(self, elements: slice) -> Scratch:
        """The memory for some elements, no more than p."""
        count = elements.stop - elements.start
        return Scratch(self.Z[:count], self.D[:count], self.ZD[:count], self.K[elements])


@dataclass(frozen=True)
class Stresses:
    """R sigma_n R' and the returned stress (e, q, s), its moduli C_alg (e, q, s, s), or (s, s) if all are elastic.

    The ``shear`` and ``bulk`` moduli are (1,), or (e, 1, 1) of several materials.
    """

    rotated: Floats
    returned: Floats
    moduli: Floats
    shear: Floats
    bulk: Floats

    def part(self, elements: slice) -> Stresses:
        """The stresses of some elements."""
        moduli = self.moduli if self.moduli.ndim == 2 else self.moduli[elements]
        shear, bulk = ((of if of.ndim == 1 else of[elements]) for of in (self.shear, self.bulk))
        return Stresses(self.rotated[elements], self.returned[elements], moduli, shear, bulk)


@dataclass(frozen=True)
class Fixed:
    """Everything on the configuration of the increment's start, or of the body ``at_rest``."""

    at_rest: bool = False

    def origin(self, rest: Floats, nodes: Floats) -> Floats:
        """The configuration (a, d) from which an increment is measured, of a body at ``rest`` that is at ``nodes``."""
        return rest if self.at_rest else nodes

    def increment(
        self,
        nodes: Floats,
        du: Floats,
        elements: Ints,
        reference: Reference,
        geometry: Geometry,
        projection: Projection | None = None,
    ) -> Kinematics:
        """Kinematics of an increment ``du`` (a, d) from the configuration ``nodes`` (a, d), tr e by ``projection``.

        Raises:
            InvertedElement: an element is inverted in a configuration that the measure evaluates.
        """
        start = gradients(nodes, elements, reference, geometry, projection)
        g = start.of(du.take(elements, axis=0))
        straining = None if projection is None else projection.at(start.volume)
        strain = strained(contract(g, start.reduction.symmetric.T), straining)
        return Kinematics(**vars(start), strain=strain, middle=g, straining=straining)

    def tangent(self, kin: Kinematics, stresses: Stresses, scratch: Scratch) -> Floats:
        """K_e = d f_e / d dU (e, dk, dk), here of (25)."""
        return element_stiffness(kin, stresses.moduli)

    def placements(self, nodes: Floats, du: Floats) -> dict[str, Floats]:
        """The configurations (a, d) of strain and equilibrium, and the end, by their names."""
        return {"at the end of the increment": nodes + du, "at the start of the increment": nodes}

    def balanced(self, nodes: Floats, du: Floats) -> Floats:
        """The configuration (a, d) in which an increment ``du`` from ``nodes`` is in equilibrium."""
        return nodes


@dataclass(frozen=True)
class Midpoint:
    """Strain at the middle, equilibrium at the end."""

    def origin(self, rest: Floats, nodes: Floats) -> Floats:
        """As :meth:`Fixed.origin`: ``nodes``."""
        return nodes

    def increment(
        self,
        nodes: Floats,
        du: Floats,
        elements: Ints,
        reference: Reference,
        geometry: Geometry,
        projection: Projection | None = None,
    ) -> Kinematics:
        """As :meth:`Fixed.increment`."""
        end = gradients(nodes + du, elements, reference, geometry, projection)
        reduction, forms = end.reduction, CLOSED_FORMS[end.reduction.dimension]
        middle, positive = forms.middle(end.of(du.take(elements, axis=0)), reduction)
        for determinant, what in zip(positive, ("Jacobian determinant", "radius"), strict=False):
            refuse_inverted(determinant, f"{what} at the middle over that at the end", nodes, elements)
        half = forms.half_rotation(middle, reduction)
        strain = forms.turn(contract(middle, reduction.symmetric.T), half)
        # With volumes at the end instead of the middle, accumulated volume changes are off by order one.
        to_middle = np.exp(np.clip(-trace(strain) / 2, -LARGEST, LARGEST))
        straining = None if projection is None else projection.at(end.volume * to_middle)
        return Kinematics(
            **vars(end), strain=strained(strain, straining), middle=middle, straining=straining, half=half
        )

    def tangent(self, kin: Kinematics, stresses: Stresses, scratch: Scratch) -> Floats:
        """As :meth:`Fixed.tangent`, in ``scratch.K``."""
        step = len(scratch.D)
        for begin in range(0, len(scratch.K), step):
            some = slice(begin, min(begin + step, len(scratch.K)))
            _moving_tangent(kin.part(some), stresses.part(some), scratch.part(some))
        return scratch.K

    def placements(self, nodes: Floats, du: Floats) -> dict[str, Floats]:
        """As :meth:`Fixed.placements`: middle and end."""
        return {"at the end of the increment": nodes + du, "at the middle of the increment": nodes + du / 2}

    def balanced(self, nodes: Floats, du: Floats) -> Floats:
        """As :meth:`Fixed.balanced`: the end."""
        return nodes + du


def _moving_tangent(kin: Kinematics, s: Stresses, scratch: Scratch) -> None:
    """K_e of ``midpoint`` in ``scratch.K``, for no more elements than the scratch holds."""
    assert kin.half is not None, "kinematics of another measure"
    reduction = kin.reduction
    kin.gradient_operator(scratch.D)
    by_g = CLOSED_FORMS[reduction.dimension].strain_by_gradient(
        reduction, kin.middle, kin.half, kin.strain, s.rotated, s.shear
    )
    D, Z, m = scratch.D, scratch.Z, by_g.shape[-1]
    # The product with symmetric' only copies rows, and scales those of shear.
    component, factor = reduction.copied
    stress_by_g = (s.moduli * contract(kin.volume[..., None], factor)[..., None]) @ by_g
    # Q: at fixed stress w D' t changes, too.
    fixed = contract(kin.volume[..., None] * s.returned, reduction.moving).reshape(*by_g.shape[:2], m, m)
    np.add(stress_by_g.take(component, axis=-2), fixed, out=Z[:, :, :m])
    if kin.straining is not None:
        Z[:, :, m] = by_g[:, :, 0] + by_g[:, :, 1] + by_g[:, :, 2]
    np.matmul(Z, D[:, :, :m], out=scratch.ZD)
    if kin.straining is not None:
        D[:, :, m] = trace_rows(D, reduction)
        change = _projected(kin, kin.straining, D[:, :, m], scratch.ZD[:, :, m])
        np.multiply(s.bulk * kin.volume[..., None], change, out=scratch.ZD[:, :, m])
    e, n, _ = scratch.K.shape
    np.matmul(D.reshape(e, -1, n).transpose(0, 2, 1), scratch.ZD.reshape(e, -1, n), out=scratch.K)


def _projected(kin: Kinematics, projector: Projector, V: Floats, d_theta: Floats) -> Floats:
    """d(Pi theta - theta) (e, q, dk), from the trace V of D and d theta.

    K_e gains sum_q w V' K times that, K the bulk modulus. As weights change by w (V - d theta/2), Pi theta changes by
    phi (phi' w phi)^-1 phi' w (theta - Pi theta) (V - d theta/2).
    """
    by_weights = (kin.divergence - trace(kin.strain))[..., None] * (V - d_theta / 2)
    return projector.of(by_weights + d_theta) - d_theta


class Configuration(Enum):
    """The strain measures by name (:mod:`bipot.fem.strain`).

    Large deformation with strain at the middle of an increment, everything on the configuration at its start as in the
    paper, or on that at rest: small strains and rotations.
    """

    MIDPOINT = "midpoint"
    PAPER = "paper"
    SMALL = "small"

    @property
    def measure(self) -> Fixed | Midpoint:
        """The measure."""
        return _MEASURES[self.value]


_MEASURES = {"midpoint": Midpoint(), "paper": Fixed(), "small": Fixed(at_rest=True)}
