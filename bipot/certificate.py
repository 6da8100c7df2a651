r"""The certificate: how far an increment is from the law, recomputed from the returned fields alone.

Its measures are jointly zero only for an exact solution of the discrete increment. With contact forces r, motion
u = (g + du_n, du_t), stress sigma, plastic strain increment e_p from the state at the start of the increment, and
energies of the modelled body:

* equilibrium: largest nodal residual over the largest nodal sum of |element forces| and |loads|;
* tool equilibrium: the residual of a driven tool over its driving force; for a moment, over this or the sum of |r|
  times the arm, whichever is larger, and round-off over itself is none;
* yield: max (sigma_eq - sigma_Y)+ / sigma_Y;
* penetration: max (-(g + du_n))+ / body size, the depth of held nodes in tools included;
* cone: max of (|r_t| - mu r_n)+ and (-r_n)+ over the largest contact force of the run so far;
* law: max |r - P_K(r - rho (u + mu |u_t| n))| over the largest contact force at the increment's start or end, rho the
  elastic stiffness of the contact's node at rest (over mu where mu > 1): where slips are tiny a wrong force costs no
  energy, and the gap does not show it;
* gap: sum_c (|r_n (g + du_n)| + |mu r_n |du_t| + r_t . du_t|)
  + sum_q w (|sigma_Y |e_p|_eq - sigma : e_p| + 1/2 (sigma - sigma_e) : C^-1 : (sigma - sigma_e)),
  sigma_e = R sigma_n R' + C : (de - e_p): the sum of the bipotential (14) and Fenchel gaps of all points, which is the
  bifunctional (19), in energy units. It is taken relative to the largest of the work, the dissipations and the change
  of stored energy in the increment; the material's part also relative to its own dissipation and stored energy.

Where friction is capped (:func:`bipot.laws.coulomb.limit`), min(mu r_n, cap) stands for mu r_n in the cone and the gap.

Every scale is a force or an energy that occurred; 0/0 counts as met. The :class:`Resolution` of a measure is the value
that round-off of the stored numbers alone may give it (for the gap also motions by the round-off of forces). Where it
is above the bound, the measure decides nothing and is reported as below resolution, neither passed nor refused.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from bipot.laws.coulomb import cone_violation, force_threshold, friction_gap, natural_map
from bipot.laws.material import Materials
from bipot.tensors import equivalent_stress, norm
from bipot.typing import Bools, Floats, make_floats, max_abs, vdot

EPS = 8 * float(np.finfo(float).eps)
"""Round-off of a short sum of products."""


@dataclass(frozen=True)
class ContactFields:
    """Of c contacts: forces r and motion (g + du_n, du_t) (c, d), coefficients mu, caps, tied, stiffness (c,).

    ``largest`` is the largest force of the run so far, ``present`` that at the start or end of the increment, ``blur``
    (c,) the round-off of the motion, ``placed`` (c,) that of gaps at the start which are not stored but differences of
    places, and ``inside`` the depth in a tool of held nodes, which are no contacts.
    """

    r: Floats
    motion: Floats
    mu: Floats
    cap: Floats
    tied: Bools
    stiffness: Floats
    largest: float
    present: float
    blur: Floats
    placed: Floats | float = 0.0
    inside: float = 0.0

    @property
    def none(self) -> float:
        """The force below which a point counts as carrying no force."""
        return force_threshold(self.r)


@dataclass(frozen=True)
class MaterialFields:
    """Per point: sigma at start (turned with the body) and end, e_p, sigma_e as Mandel vectors (g, s), peeq at the end
    (g,), weight (g,), and the material.
    """

    before: Floats
    stress: Floats
    plastic_strain: Floats
    elastic_stress: Floats
    peeq: Floats
    weight: Floats
    material: Materials

    @cached_property
    def yield_stress(self) -> Floats:
        """sigma_Y at the end (g,)."""
        return self.material.yield_stress(self.peeq)

    @cached_property
    def dissipation(self) -> Floats:
        """sigma_Y |e_p|_eq (g,)."""
        return self.material.dissipation(self.plastic_strain, self.peeq)


@dataclass(frozen=True)
class Balance:
    """Nodal residuals on the free unknowns (any shape), their scale ``force``, and their round-off ``blur``.

    The scale of the ``tool_residual`` (m,) of driven tools is ``tool_force`` (m,), their round-off ``tool_blur`` (m,).
    """

    residual: Floats
    force: float
    blur: float
    tool_residual: Floats
    tool_force: Floats
    tool_blur: Floats

    @property
    def equilibrium(self) -> float:
        """The largest nodal residual over the force."""
        return _over(max_abs(self.residual), self.force)

    @property
    def tools(self) -> float:
        """The largest residual of a tool over its scale."""
        # A scale of round-off, as of a roll that nothing turns, is none.
        scale = np.where(self.tool_force > self.tool_blur, self.tool_force, 0.0)
        tools = zip(np.abs(self.tool_residual).tolist(), scale.tolist(), self.tool_blur.tolist(), strict=True)
        return max((_over(*tool) for tool in tools), default=0.0)

    @property
    def resolution(self) -> float:
        """The value of :attr:`equilibrium` that round-off alone may cause."""
        return _over(self.blur, self.force)


@dataclass(frozen=True)
class Resolution:
    """The values that round-off of the stored numbers alone may give the measures of the same names; 0 for others."""

    equilibrium: float = 0.0
    yield_violation: float = 0.0
    cone_violation: float = 0.0
    law: float = 0.0
    relative_gap: float = 0.0


@dataclass(frozen=True)
class Certificate:
    """The measures (dimensionless except the gap's two parts, which are energies), and their resolution."""

    equilibrium: float
    yield_violation: float
    penetration: float
    cone_violation: float
    law: float
    relative_gap: float
    contact_gap: float
    material_gap: float
    resolution: Resolution = Resolution()
    tool_equilibrium: float = 0.0

    @property
    def gap(self) -> float:
        """The sum of both parts."""
        return self.contact_gap + self.material_gap

    def ratios(self, bounds: Bounds) -> dict[str, float]:
        """Each bounded measure over its bound, or over its resolution where that is larger."""
        return {
            name: over_bound(getattr(self, name), bound, getattr(self.resolution, name, 0.0))
            for name, bound in vars(bounds).items()
        }

    def below_resolution(self, bounds: Bounds) -> tuple[str, ...]:
        """The measures that decide nothing: round-off alone may exceed their bound."""
        return tuple(name for name, bound in vars(bounds).items() if getattr(self.resolution, name, 0.0) > bound)


@dataclass(frozen=True)
class Bounds:
    """Upper bounds on the certificate for an increment to be accepted, above zero; inf is no bound."""

    equilibrium: float = 1e-7
    yield_violation: float = 1e-9
    penetration: float = 1e-10
    cone_violation: float = 1e-8
    law: float = 1e-6
    relative_gap: float = 1e-7
    tool_equilibrium: float = 1e-7

    def __post_init__(self) -> None:
        make_floats(self, of="bounds.", **{bound.name: "> 0" for bound in fields(self)})

    @staticmethod
    def none() -> Bounds:
        """Bounds that accept everything."""
        return Bounds(*[math.inf] * len(fields(Bounds)))


def over_bound(measure: float, bound: float, resolution: float = 0.0) -> float:
    """The measure over its bound, or over its ``resolution`` where that is larger.

    Without a bound, inf, it is met even where it is infinite, as the law beside no forces is; never where it is NaN.
    """
    return 0.0 if math.isinf(bound) and not math.isnan(measure) else measure / max(bound, resolution)


def certify(
    contact: ContactFields, material: MaterialFields, balance: Balance, size: float, work: float
) -> Certificate:
    """Recompute the certificate (module docstring) of a body of this ``size``, with the external ``work``."""
    gaps, losses = contact_gaps(contact), material_gaps(material)
    contact_gap, material_gap = float(gaps.sum()), float(losses.sum())
    excess = equivalent_stress(material.stress) / material.yield_stress - 1
    material_energy = max(_energies(material))
    friction = float(np.abs(np.vecdot(contact.r[:, 1:], contact.motion[:, 1:])).sum())
    energy = max(abs(work), friction, material_energy)
    moved = np.minimum(norm(contact.motion), contact.blur / EPS)
    # Where nothing may touch there is no contact force with round-off.
    unsure = balance.blur if len(contact.r) else 0.0
    # Of a contact's motion, as much as this may be what the round-off of forces moves it by.
    told = contact.blur + contact.placed
    blur = told + np.minimum(norm(contact.motion), unsure / contact.stiffness)
    law_blur = unsure + float((contact.stiffness * told).max(initial=0.0))
    law = float(norm(law_residual(contact)).max(initial=0.0))
    gap, gap_blur = contact_gap + material_gap, vdot(norm(contact.r), blur) + balance.blur * float(moved.sum())
    # Ties have no cone.
    violation = cone_violation(contact.r, contact.mu, contact.cap, contact.none)[~contact.tied]
    resolution = Resolution(
        equilibrium=balance.resolution,
        yield_violation=EPS * 2 * max_abs(material.stress) / float(material.yield_stress.min()),
        cone_violation=_over(unsure, contact.largest),
        law=_over(law_blur, contact.present, law_blur),
        relative_gap=_over(gap_blur, energy, gap_blur),
    )
    return Certificate(
        equilibrium=balance.equilibrium,
        yield_violation=float(np.maximum(excess, 0).max()),
        penetration=max(float(np.maximum(-contact.motion[:, 0], 0).max(initial=0.0)), contact.inside) / size,
        cone_violation=_over(float(violation.max(initial=0.0)), contact.largest),
        law=_over(law, contact.present, law_blur),
        relative_gap=max(_over(gap, energy, gap_blur), _over(material_gap, material_energy)),
        contact_gap=contact_gap,
        material_gap=material_gap,
        resolution=resolution,
        tool_equilibrium=balance.tools,
    )


def contact_gaps(contact: ContactFields) -> Floats:
    """|r_n (g + du_n)| + |s |du_t| + r_t . du_t| (c,); where tied, the work of r on the motion that ties forbid."""
    c = contact
    sliding = np.abs(friction_gap(c.r, c.motion[:, 1:], c.mu, c.cap, c.none))
    work = np.abs(c.r * c.motion)
    return work[:, 0] + np.where(c.tied, work[:, 1:].sum(axis=1), sliding)


def law_residual(contact: ContactFields) -> Floats:
    """r - P_K(r - rho (u + mu |u_t| n)) (c, d), force units; where tied, stiffness times the motion that ties forbid.

    Where friction is capped it is as in :func:`~bipot.laws.coulomb.natural_map`.
    """
    c = contact
    mu = np.where(c.tied, 0.0, c.mu)
    rho = c.stiffness / np.maximum(np.where(np.isinf(mu), 0.0, mu), 1.0)
    residual = natural_map(c.r, c.motion, mu, rho, c.cap, c.none)
    return np.where(c.tied[:, None], c.stiffness[:, None] * c.motion, residual)


def material_gaps(material: MaterialFields) -> Floats:
    """Fenchel gap of plasticity plus elastic energy of the stress mismatch (g,)."""
    m = material
    fenchel = m.dissipation - np.vecdot(m.stress, m.plastic_strain)
    mismatch = m.stress - m.elastic_stress
    elastic = 0.5 * np.vecdot(mismatch, m.material.elasticity.strain(mismatch))
    return m.weight * (np.abs(fenchel) + elastic)


def _energies(material: MaterialFields) -> tuple[float, float]:
    """Plastic dissipation, and the sum over points of the magnitude of the change of stored energy."""
    m = material
    change = m.material.elasticity.strain(m.stress - m.before)
    stored = m.weight * np.abs(np.vecdot(m.stress + m.before, change)) / 2
    return vdot(m.weight, m.dissipation), float(stored.sum())


def _over(value: float, scale: float, blur: float = 0.0) -> float:
    """``value`` over its scale; over a scale of zero it is either round-off, up to ``blur``, or not met at all."""
    return value / scale if scale > 0 else 0.0 if value <= blur else np.inf
