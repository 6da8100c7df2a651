r"""Upsetting forces without finite elements, for perfect plasticity at any reduction red, h = (1 - red) H0.

Exact, frictionless (homogeneous, logarithmic strain eps = -ln(1 - red), elastic until eps = sY/E):
    R = R0 exp[(eps - sY/E)/2 + nu sY/E],    F = sY pi R^2.
Slab with Coulomb slip on the rigid-plastic cylinder R = R0/sqrt(1 - red), x = 2 mu R/h:
    F = sY pi R^2 2 (e^x - 1 - x)/x^2,
as long as it slips everywhere: mu times its largest pressure, sY e^x on the axis, is within the shear strength,
    mu e^x <= 1/sqrt3.
Upper bound for the cylindrical shape, full sticking:
    F = sY pi R^2 [1 + 2 R/(3 sqrt3 h)].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.errors import require
from bipot.typing import Bools, Floats


@dataclass(frozen=True)
class Cylinder:
    """Height, radius, Young's modulus, Poisson's ratio and yield stress."""

    height: float
    radius: float
    young: float
    poisson: float
    yield_stress: float

    def exact_radius(self, reduction: Floats | float) -> Floats:
        """Radius of the frictionless elastoplastic cylinder.

        >>> round(float(Cylinder(10, 5, 210000, 0.3, 300).exact_radius(np.array(0.45))), 7)
        6.7400726
        """
        strain = -np.log1p(-reduction)
        elastic = np.minimum(strain, self.yield_stress / self.young)
        return self.radius * np.exp((strain - elastic) / 2 + self.poisson * elastic)

    def plastic_strain(self, reduction: Floats | float) -> Floats:
        """Equivalent plastic strain of the frictionless elastoplastic cylinder, zero while it is elastic."""
        return np.maximum(-np.log1p(-reduction) - self.yield_stress / self.young, 0.0)

    def exact_force(self, reduction: Floats | float) -> Floats:
        """Force without friction.

        >>> round(float(Cylinder(10, 5, 210000, 0.3, 300).exact_force(np.array(0.45))), 3)
        42815.427
        """
        stress = np.minimum(-self.young * np.log1p(-reduction), self.yield_stress)
        return stress * np.pi * self.exact_radius(reduction) ** 2

    def slab_force(self, reduction: Floats | float, mu: float) -> Floats:
        """Slab force, slipping; an overestimate where the cylinder barrels; mu > 0.

        >>> round(float(Cylinder(10, 5, 210000, 0.3, 300).slab_force(np.array(0.45), 0.1)), -1)
        46570.0
        """
        require(0 < mu < np.inf, "mu", mu, "finite and > 0")
        radius, height = self._rigid_plastic(reduction)
        x = 2 * mu * radius / height
        return self.yield_stress * np.pi * radius**2 * 2 * (np.expm1(x) - x) / x**2

    def slips(self, reduction: Floats | float, mu: float) -> Bools:
        """Where the slab, of friction ``mu`` > 0, slips everywhere.

        >>> one = Cylinder(10, 5, 210000, 0.3, 300)
        >>> [one.slips(np.array([0.0, 0.4, 0.45]), mu).tolist() for mu in (0.1, 0.3, 0.5)]
        [[True, True, True], [True, True, False], [False, False, False]]
        """
        radius, height = self._rigid_plastic(reduction)
        return np.log(mu * np.sqrt(3)) <= -2 * mu * radius / height

    def sticking_bound(self, reduction: Floats | float) -> Floats:
        """Upper bound of the force for any friction while the cylinder keeps its shape.

        >>> round(float(Cylinder(10, 5, 210000, 0.3, 300).sticking_bound(np.array(0.45))), -1)
        63050.0
        """
        radius, height = self._rigid_plastic(reduction)
        return self.yield_stress * np.pi * radius**2 * (1 + 2 * radius / (3 * np.sqrt(3) * height))

    def _rigid_plastic(self, reduction: Floats | float) -> tuple[Floats, Floats]:
        left = 1 - np.asarray(reduction, dtype=np.float64)
        return self.radius / np.sqrt(left), self.height * left


PAPER = Cylinder(10.0, 5.0, 210_000.0, 0.3, 300.0)
"""The seed paper's: N, mm, MPa."""
