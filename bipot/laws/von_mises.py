"""Isotropic elasticity with von Mises plasticity and isotropic hardening, (4)-(10).

Radial return: with the trial deviator s_tr, N = s_tr/|s_tr| and q_tr = √(3/2) |s_tr|, the increment dp of the
equivalent plastic strain solves q_tr - 3 G dp = σ_Y(p + dp), the plastic strain grows by √(3/2) dp N, and the
deviator becomes √(2/3) σ_Y(p + dp) N.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bipot.errors import LARGEST_STRESS, NotConverged, require, require_magnitude, require_type
from bipot.laws.hardening import Hardening, require_hardening
from bipot.tensors import (
    contract,
    deviator,
    deviatoric_projector,
    equivalent_strain,
    equivalent_stress,
    identity,
    norm,
    trace,
    unit,
)
from bipot.typing import Bools, Floats, einsum, make_floats, read_only

_MAX_ITERATIONS = 200
"""Far above the iterations that Newton safeguarded by bisection takes."""

_ROUND_OFF = 4.0 * float(np.finfo(float).eps)
"""Relative round-off of a stress, or of a bracket of the plastic strain."""

_ON_SURFACE = 16.0 * _ROUND_OFF
"""How exactly a point that flowed is on the yield surface: within this nothing flows, so round-off decides no flow."""

NEAR = 1e-7
"""The least of 1/2 - nu and nu + 1: nearer, the round-off of one modulus times a strain hides the stress of the other,
and the answer changes by less than this."""

ON_YIELD = 1e-9
"""A stress this near the yield surface, relative to it, counts as on it for (10)."""


class TangentKind(Enum):
    """Which C^ep the quadratic energy uses: algorithmic, or the rate form (10)."""

    CONSISTENT = "consistent"
    CONTINUUM = "continuum"


@cache
def isotropic(volumetric: float, deviatoric: float, size: int) -> Floats:
    """volumetric 1 ⊗ 1 + deviatoric I_dev, (s, s), read-only; kept, because every pass asks for it."""
    unit = identity(size)
    return read_only(volumetric * np.outer(unit, unit) + deviatoric * deviatoric_projector(size), np.float64)


@dataclass(frozen=True)
class Elasticity:
    """Isotropic linear elasticity (6): Young's modulus (stress units) and Poisson's ratio.

    >>> Elasticity(210e3, 0.25).shear
    84000.0
    """

    young: float
    poisson: float

    def __post_init__(self) -> None:
        make_floats(self, "poisson", young="finite and > 0")
        require_magnitude(self.young, "young", LARGEST_STRESS)
        inside = NEAR - 1 <= self.poisson <= 0.5 - NEAR
        require(inside, "poisson", self.poisson, f"inside (-1, 0.5), at least {NEAR:g} from its ends")

    @property
    def bulk(self) -> float:
        """K = E / (3 (1 - 2ν))."""
        return self.young / (3.0 * (1.0 - 2.0 * self.poisson))

    @property
    def shear(self) -> float:
        """G = E / (2 (1 + ν))."""
        return self.young / (2.0 * (1.0 + self.poisson))

    def stiffness(self, size: int) -> Floats:
        """C^e = K 1 ⊗ 1 + 2 G I_dev of (6), shape (s, s), read-only."""
        return isotropic(self.bulk, 2.0 * self.shear, size)

    def compliance(self, size: int) -> Floats:
        """Inverse of :meth:`stiffness`, 1 ⊗ 1 / (9 K) + I_dev / (2 G), shape (s, s), read-only."""
        return isotropic(1.0 / (9.0 * self.bulk), 1.0 / (2.0 * self.shear), size)

    def stress(self, strain: Floats) -> Floats:
        """The stress (…, s) of an elastic strain."""
        return contract(strain, self.stiffness(strain.shape[-1]))

    def strain(self, stress: Floats) -> Floats:
        """The elastic strain (…, s) of a stress."""
        return contract(stress, self.compliance(stress.shape[-1]))


@dataclass(frozen=True)
class Returned:
    """What :func:`radial_return` found, over leading axes (…).

    ``trial``, the elastic trial stress, and ``stress`` (…, s); ``plastic_strain`` (…, s), the increment; ``dpeeq``
    (…); ``direction`` (…, s), the unit deviator N of the trial stress, zero where elastic; ``plastic`` (…), true where
    the trial stress is outside the yield surface.
    """

    trial: Floats
    stress: Floats
    plastic_strain: Floats
    dpeeq: Floats
    direction: Floats
    plastic: Bools


def yield_function(sigma: Floats, sigma_y: Floats | float) -> Floats:
    """Yield function √(3/2) |dev σ| - σ_Y (7), (…, s) -> (…); admissible where <= 0."""
    return equivalent_stress(sigma) - sigma_y


def _plastic_multiplier(q: Floats, peeq: Floats, shear: float, hardening: Hardening) -> Floats:
    """Solve q - 3 G dp - σ_Y(p + dp) = 0 for dp >= 0, for points on or outside the yield surface, shape (…).

    Newton inside a bracket that every iterate shortens, bisection where Newton would leave it: the left side
    falls strictly, so the root is unique and kinks of σ_Y cannot make it cycle.
    """
    three_g = 3.0 * shear
    excess = q - hardening.yield_stress(peeq)
    dp = excess / (three_g + hardening.slope(peeq))
    low, high = 0.0, excess / three_g
    for _ in range(_MAX_ITERATIONS):
        residual = q - three_g * dp - hardening.yield_stress(peeq + dp)
        low = np.where(residual > 0, dp, low)
        high = np.where(residual > 0, high, dp)
        settled = (np.abs(residual) <= _ROUND_OFF * q) | (high - low <= _ROUND_OFF * high)
        if settled.all():
            return dp
        newton = dp + residual / (three_g + hardening.slope(peeq + dp))
        inside = (newton > low) & (newton < high)
        dp = np.where(settled, dp, np.where(inside, newton, 0.5 * (low + high)))
    raise NotConverged("radial return did not settle; check that the yield stress never decreases with peeq.")


def radial_return(trial_stress: Floats, peeq: Floats, elasticity: Elasticity, hardening: Hardening) -> Returned:
    """Return trial stresses (…, s) to the yield surface of ``peeq`` (…), (7)-(9), backward Euler.

    Stress and moduli share one unit. Raises NotConverged if a trial stress is not finite.

    >>> from bipot.laws.hardening import Perfect
    >>> trial = np.array([[400.0, 0.0, 0.0, 0.0]])
    >>> radial_return(trial, np.zeros(1), Elasticity(210e3, 0.3), Perfect(300.0)).stress.round(9).tolist()
    [[333.333333333, 33.333333333, 33.333333333, 0.0]]
    """
    trial = np.asarray(trial_stress, float)
    peeq = np.broadcast_to(np.asarray(peeq, float), trial.shape[:-1])
    if not np.isfinite(trial).all():
        raise NotConverged("a trial stress is not finite: the strain increment is too large; cut the increment.")
    s = deviator(trial)
    q = np.sqrt(1.5) * norm(s)
    limit = hardening.yield_stress(peeq)
    plastic = np.asarray(q > (1.0 + _ON_SURFACE) * limit)
    safe = np.where(plastic, q, limit)
    dpeeq = _plastic_multiplier(safe, peeq, elasticity.shear, hardening)
    direction = (np.sqrt(1.5) * plastic / safe)[..., None] * s
    # From σ_Y, not by subtracting from the trial stress, so that yield holds to round-off.
    stress = (hardening.yield_stress(peeq + dpeeq) / safe)[..., None] * s
    stress[..., :3] += (trace(trial) / 3.0)[..., None]
    np.copyto(stress, trial, where=~plastic[..., None])
    return Returned(trial, stress, (np.sqrt(1.5) * dpeeq)[..., None] * direction, dpeeq, direction, plastic)


def _moduli(bulk: float, deviatoric: Floats, factor: Floats, N: Floats) -> Floats:
    """bulk 1 ⊗ 1 + deviatoric I_dev - factor N ⊗ N (…, s, s), with deviatoric and factor (…), N (…, s)."""
    size = N.shape[-1]
    # For so few components einsum is faster than a product by broadcasting.
    out = einsum("...i,...j->...ij", N, N)
    out *= -factor[..., None, None]
    out += np.multiply.outer(deviatoric, deviatoric_projector(size))
    out += isotropic(bulk, 0.0, size)
    return out


def consistent_tangent(returned: Returned, peeq: Floats, elasticity: Elasticity, hardening: Hardening) -> Floats:
    """Derivative of the returned stress with respect to the strain increment, (…, s, s), symmetric.

    K 1 ⊗ 1 + 2 G β I_dev - 2 G (β - H/(3 G + H)) N ⊗ N with β = q/q_tr and H at p + dp (``peeq`` is p, at the
    start of the increment); C^e where elastic. Positive semidefinite, since H >= 0.
    """
    trial, end = returned.trial, peeq + returned.dpeeq
    G, H = elasticity.shear, hardening.slope(end)
    # N is the unit deviator of the trial stress: q_tr = √(3/2) σ_tr : N.
    q = np.where(returned.plastic, np.sqrt(1.5) * np.vecdot(trial, returned.direction), 1.0)
    beta = np.where(returned.plastic, hardening.yield_stress(end) / q, 1.0)
    factor = 2.0 * G * (beta - H / (3.0 * G + H))
    return _moduli(elasticity.bulk, 2.0 * G * beta, factor, returned.direction)


def continuum_tangent(
    stress: Floats, peeq: Floats, plastic: Bools, elasticity: Elasticity, hardening: Hardening
) -> Floats:
    """Rate tangent C^ep of (10) where ``plastic``, C^e elsewhere; (…, s, s), symmetric.

    C^ep = C^e - (C^e N)(C^e ∂f/∂σ)ᵀ / (∂f/∂σᵀ C^e N + √(2/3) H), N the unit normal and ∂f/∂σ = √(3/2) N; the
    hardening term is missing in the printed (10). It reduces to C^e - 2 G (3 G/(3 G + H)) N ⊗ N.
    """
    s = deviator(stress)
    length = norm(s)
    active = plastic & (length > 0)
    N = np.divide(s, length[..., None], out=np.zeros(s.shape), where=active[..., None])
    G, H = elasticity.shear, hardening.slope(peeq)
    return _moduli(elasticity.bulk, np.full(length.shape, 2.0 * G), 6.0 * G**2 / (3.0 * G + H), N)


@dataclass(frozen=True)
class VonMises:
    """The material of (5)-(9): isotropic elasticity, and plastic flow with isotropic hardening."""

    elasticity: Elasticity
    hardening: Hardening
    drifts: ClassVar[bool] = False

    def __post_init__(self) -> None:
        require_type(self.elasticity, Elasticity, "material.elasticity")
        require_type(self.hardening, Hardening, "material.hardening")
        require_hardening(self.hardening)

    def yield_stress(self, peeq: ArrayLike) -> Floats:
        """σ_Y (…)."""
        return self.hardening.yield_stress(peeq)

    def slope(self, peeq: ArrayLike) -> Floats:
        """H (…)."""
        return self.hardening.slope(peeq)

    def dissipation(self, plastic_strain: Floats, peeq: Floats) -> Floats:
        """σ_Y |e_p|_eq (…)."""
        return self.yield_stress(peeq) * equivalent_strain(plastic_strain)

    def update(self, rotated: Floats, strain: Floats, peeq: Floats) -> Returned:
        """Radial return of R σ_n Rᵀ + C^e : de."""
        trial = rotated + self.elasticity.stress(strain)
        return radial_return(trial, peeq, self.elasticity, self.hardening)

    def tangent(self, rotated: Floats, returned: Returned, peeq: Floats, kind: TangentKind) -> Floats:
        """C (…, s, s): the derivative of the return, or (10) at its end."""
        if kind is TangentKind.CONSISTENT:
            return consistent_tangent(returned, peeq, self.elasticity, self.hardening)
        end = peeq + returned.dpeeq
        return continuum_tangent(returned.stress, end, returned.plastic, self.elasticity, self.hardening)


@dataclass(frozen=True)
class RateVonMises(VonMises):
    """The seed paper's update (4), sigma_n + C^ep : de with C^ep at the start of the increment.

    Without a return map the stress drifts off the yield surface.
    """

    drifts: ClassVar[bool] = True

    def update(self, rotated: Floats, strain: Floats, peeq: Floats) -> Returned:
        """Stress by (4), and the plastic strain that follows from (5) and (6)."""
        C, plastic = self._rate(rotated, peeq)
        change = einsum("...st,...t->...s", C, strain)
        e_p = strain - self.elasticity.strain(change)
        e_p = np.where(plastic[..., None], deviator(e_p), 0.0)
        trial = rotated + self.elasticity.stress(strain)
        return Returned(trial, rotated + change, e_p, equivalent_strain(e_p), unit(e_p), plastic)

    def tangent(self, rotated: Floats, returned: Returned, peeq: Floats, kind: TangentKind) -> Floats:
        """C^ep (…, s, s) at the start of the increment, of either kind."""
        return self._rate(rotated, peeq)[0]

    def _rate(self, stress: Floats, peeq: Floats) -> tuple[Floats, Bools]:
        """C^ep (…, s, s) of (10), and where it is plastic (…)."""
        sigma_y = self.yield_stress(peeq)
        plastic = yield_function(stress, sigma_y) >= -ON_YIELD * sigma_y
        return continuum_tangent(stress, peeq, plastic, self.elasticity, self.hardening), plastic
