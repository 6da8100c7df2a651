"""The interface of a material, and the elastic material.

Tensors are Mandel vectors (…, s), points the leading axes (…).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from bipot.errors import require_type
from bipot.laws.von_mises import Elasticity, Returned, TangentKind
from bipot.typing import Floats


@runtime_checkable
class Material(Protocol):
    """A material with isotropic elasticity and a yield stress that never falls with the equivalent plastic strain."""

    @property
    def elasticity(self) -> Elasticity:
        """The law (6) of stress and elastic strain."""
        ...

    drifts: ClassVar[bool]
    """Whether an increment's stress may end outside the yield surface."""

    def yield_stress(self, peeq: ArrayLike) -> Floats:
        """σ_Y (…) at the equivalent plastic strain; inf where nothing flows."""
        ...

    def slope(self, peeq: ArrayLike) -> Floats:
        """H = dσ_Y/dp (…) >= 0."""
        ...

    def dissipation(self, plastic_strain: Floats, peeq: Floats) -> Floats:
        """σ_Y |e_p|_eq (…) at ``peeq``, the potential V of a plastic strain increment in (19)."""
        ...

    def update(self, rotated: Floats, strain: Floats, peeq: Floats) -> Returned:
        """Stress and plastic strain of an increment from the stress, turned to its end, and peeq of its start."""
        ...

    def tangent(self, rotated: Floats, returned: Returned, peeq: Floats, kind: TangentKind) -> Floats:
        """C (…, s, s) or (s, s), symmetric and positive semidefinite, at an :meth:`update` from the same start."""
        ...


class Moduli(Protocol):
    """Isotropic elasticity (6): with numbers of one material, arrays (e, 1) of several."""

    @property
    def young(self) -> Floats | float:
        """Young's modulus."""
        ...

    @property
    def bulk(self) -> Floats | float:
        """K."""
        ...

    @property
    def shear(self) -> Floats | float:
        """G."""
        ...

    def stiffness(self, size: int) -> Floats:
        """C^e, shape (s, s) or (e, 1, s, s)."""
        ...

    def stress(self, strain: Floats) -> Floats:
        """The stress (…, s) of an elastic strain."""
        ...

    def strain(self, stress: Floats) -> Floats:
        """The elastic strain (…, s) of a stress."""
        ...


class Materials(Protocol):
    """The material of a body, or the several of its parts, at all of its points: (e, …) or (e q, …).

    Members are those of :class:`Material`.
    """

    @property
    def elasticity(self) -> Moduli:
        """The law (6)."""
        ...

    drifts: ClassVar[bool]

    def yield_stress(self, peeq: Floats) -> Floats:
        """σ_Y."""
        ...

    def slope(self, peeq: Floats) -> Floats:
        """H."""
        ...

    def dissipation(self, plastic_strain: Floats, peeq: Floats) -> Floats:
        """σ_Y |e_p|_eq."""
        ...

    def update(self, rotated: Floats, strain: Floats, peeq: Floats) -> Returned:
        """Stress and plastic strain of an increment."""
        ...

    def tangent(self, rotated: Floats, returned: Returned, peeq: Floats, kind: TangentKind) -> Floats:
        """C."""
        ...


@dataclass(frozen=True)
class Elastic:
    """Isotropic elasticity alone: no return map, and no plastic cones in a program."""

    elasticity: Elasticity
    drifts: ClassVar[bool] = False

    def __post_init__(self) -> None:
        require_type(self.elasticity, Elasticity, "material.elasticity")

    def yield_stress(self, peeq: ArrayLike) -> Floats:
        """Out of reach."""
        return np.full(np.shape(peeq), np.inf)

    def slope(self, peeq: ArrayLike) -> Floats:
        """Zero."""
        return np.zeros(np.shape(peeq))

    def dissipation(self, plastic_strain: Floats, peeq: Floats) -> Floats:
        """Zero: there is no plastic strain."""
        return np.zeros(peeq.shape)

    def update(self, rotated: Floats, strain: Floats, peeq: Floats) -> Returned:
        """R σ_n Rᵀ + C^e : de."""
        trial = rotated + self.elasticity.stress(strain)
        nothing = np.zeros(trial.shape)
        return Returned(trial, trial, nothing, nothing[..., 0], nothing, np.zeros(peeq.shape, dtype=bool))

    def tangent(self, rotated: Floats, returned: Returned, peeq: Floats, kind: TangentKind) -> Floats:
        """C^e (s, s), of either kind."""
        return self.elasticity.stiffness(rotated.shape[-1])
