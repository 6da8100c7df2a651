"""Von Mises plasticity by the rate equation (4) alone, as in the seed paper: the stress is not returned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bipot.laws.projections import unit
from bipot.laws.von_mises import Returned, TangentKind, VonMises, continuum_tangent, yield_function
from bipot.tensors import deviator, equivalent_strain
from bipot.typing import Bools, Floats, einsum

ON_YIELD = 1e-9
"""A stress this near the yield surface, relative to it, counts as on it for (10)."""


@dataclass(frozen=True)
class RateVonMises(VonMises):
    """sigma_n + C^ep : de (4), C^ep that of the start of the increment: the stress drifts off the yield surface."""

    drifts: ClassVar[bool] = True

    def update(self, rotated: Floats, strain: Floats, peeq: Floats) -> Returned:
        """Stress by (4), and the plastic strain that follows from (5) and (6)."""
        C, plastic = self._rate(rotated, peeq)
        size = strain.shape[-1]
        change = einsum("...st,...t->...s", C, strain)
        e_p = strain - change @ self.elasticity.compliance(size)
        e_p = np.where(plastic[..., None], deviator(e_p), 0.0)
        trial = rotated + strain @ self.elasticity.stiffness(size)
        return Returned(trial, rotated + change, e_p, equivalent_strain(e_p), unit(e_p), plastic)

    def tangent(self, rotated: Floats, returned: Returned, peeq: Floats, kind: TangentKind) -> Floats:
        """C^ep (…, s, s) at the start of the increment, of either kind."""
        return self._rate(rotated, peeq)[0]

    def _rate(self, stress: Floats, peeq: Floats) -> tuple[Floats, Bools]:
        """C^ep (…, s, s) of (10), and where it is plastic (…)."""
        sigma_y = self.yield_stress(peeq)
        plastic = yield_function(stress, sigma_y) >= -ON_YIELD * sigma_y
        return continuum_tangent(stress, peeq, plastic, self.elasticity, self.hardening), plastic
