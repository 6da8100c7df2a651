r"""How far an increment is from the law: five numbers recomputed from the returned fields alone.

Jointly zero only for an exact solution of the discrete increment. With contact forces r, motion (g + du_n, du_t),
stress sigma, plastic strain increment e_p from the state the increment started from, and energies of the modelled body:

* equilibrium: largest nodal residual over the largest nodal sum of |element forces| (the caller's floor under that
  scale keeps an unstressed body, whose forces are round-off, measurable);
* yield: max (sigma_eq - sigma_Y)+ / sigma_Y;      * penetration: max (-(g + du_n))+ / body size;
* cone: max of (|r_t| - mu r_n)+ and (-r_n)+ over the largest contact force of the run so far;
* gap: sum_c |mu r_n |du_t| + r_n (g + du_n) + r_t . du_t|
       + sum_q |w (sigma_Y |e_p|_eq - sigma : e_p) + w/2 (sigma - sigma_e) : C^-1 : (sigma - sigma_e)|,
  sigma_e = R sigma_n R' + C : (de - e_p): the bipotential (14) and Fenchel gaps of every point, in energy units.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from bipot.laws.coulomb import bipotential_gap, cone_violation
from bipot.laws.hardening import Hardening
from bipot.laws.tensors import equivalent_strain, equivalent_stress
from bipot.laws.von_mises import Elasticity

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ContactFields:
    """Forces r (c, d), motion (g + du_n, du_t) (c, d), coefficients mu (c,), tied (c,), largest force so far."""

    r: Floats
    motion: Floats
    mu: Floats
    tied: NDArray[np.bool_]
    largest: float


@dataclass(frozen=True)
class MaterialFields:
    """Per point: sigma, e_p, sigma_e as Mandel vectors (g, s), peeq at the end (g,), weight (g,), and the law."""

    stress: Floats
    plastic_strain: Floats
    elastic_stress: Floats
    peeq: Floats
    weight: Floats
    elasticity: Elasticity
    hardening: Hardening


@dataclass(frozen=True)
class Balance:
    """Nodal residuals (m,) on free unknowns, the force they are measured by, body size, |work| and its floor."""

    residual: Floats
    force: float
    size: float
    work: float
    work_floor: float


@dataclass(frozen=True)
class Certificate:
    """The five numbers (dimensionless but ``gap``, an energy), with the gap's two parts."""

    equilibrium: float
    yield_violation: float
    penetration: float
    cone_violation: float
    gap: float
    relative_gap: float
    contact_gap: float
    material_gap: float

    def ratios(self, bounds: Bounds) -> dict[str, float]:
        """Each bounded measure over its bound."""
        return {f.name: getattr(self, f.name) / getattr(bounds, f.name) for f in fields(bounds)}


@dataclass(frozen=True)
class Bounds:
    """Upper bounds on the certificate for an increment to be accepted."""

    equilibrium: float = 5e-7
    yield_violation: float = 1e-9
    penetration: float = 1e-10
    cone_violation: float = 1e-8
    relative_gap: float = 1e-7


def certify(contact: ContactFields, material: MaterialFields, balance: Balance) -> Certificate:
    """Recompute the certificate (formulas in the module docstring)."""
    contact_gap = float(np.abs(contact_gaps(contact)).sum())
    material_gap = float(np.abs(material_gaps(material)).sum())
    yield_stress = material.hardening.yield_stress(material.peeq)
    excess = equivalent_stress(material.stress) / yield_stress - 1
    return Certificate(
        equilibrium=_ratio(float(np.abs(balance.residual).max(initial=0.0)), balance.force),
        yield_violation=float(np.maximum(excess, 0).max()),
        penetration=_largest_negative(contact.motion[:, 0]) / balance.size,
        cone_violation=_ratio(_cone(contact), contact.largest),
        gap=contact_gap + material_gap,
        relative_gap=(contact_gap + material_gap) / max(abs(balance.work), balance.work_floor),
        contact_gap=contact_gap,
        material_gap=material_gap,
    )


def contact_gaps(contact: ContactFields) -> Floats:
    """mu r_n |du_t| + r_n (g + du_n) + r_t . du_t (c,); where tied, the work of r on the motion it forbids."""
    sliding = bipotential_gap(contact.motion, contact.r, np.where(contact.tied, 0.0, contact.mu))
    return np.where(contact.tied, np.abs(contact.r * contact.motion).sum(axis=1), sliding)


def material_gaps(material: MaterialFields) -> Floats:
    """Fenchel gap of plasticity plus elastic energy of the stress mismatch (g,)."""
    m = material
    sigma_y = m.hardening.yield_stress(m.peeq)
    fenchel = sigma_y * equivalent_strain(m.plastic_strain) - np.vecdot(m.stress, m.plastic_strain)
    mismatch = m.stress - m.elastic_stress
    elastic = 0.5 * np.vecdot(mismatch, mismatch @ m.elasticity.compliance(m.stress.shape[-1]))
    return m.weight * (fenchel + elastic)


def _cone(contact: ContactFields) -> float:
    free = ~contact.tied
    return float(cone_violation(contact.r[free], contact.mu[free]).max(initial=0.0))


def _largest_negative(gap: Floats) -> float:
    return float(np.maximum(-gap, 0).max(initial=0.0))


def _ratio(value: float, scale: float) -> float:
    """0/0 counts as met."""
    if value == 0.0:
        return 0.0
    return value / scale if scale > 0 else np.inf
