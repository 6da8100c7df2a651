"""The material of each element of a scene in plain numbers, and the same in other units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bipot.laws.hardening import Hardening, Linear, Perfect, Tabulated, Voce
from bipot.laws.material import Elastic, Material
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.scene.scene import Scene
from bipot.typing import Floats

Curve = Callable[[Floats], Floats]


def metals(scene: Scene) -> list[Material]:
    """The material of each element."""
    found = [scene.material] * len(scene.mesh.elements)
    for name, own in scene.regions.items():
        for element in scene.mesh.regions[name].tolist():
            found[element] = own
    return found


def moduli(scene: Scene) -> tuple[Floats, Floats]:
    """Young's modulus and Poisson's ratio of each element, both (e, 1)."""
    elastic = [metal.elasticity for metal in metals(scene)]
    return np.array([[own.young] for own in elastic]), np.array([[own.poisson] for own in elastic])


def bulk_and_shear(scene: Scene) -> tuple[Floats, Floats]:
    """K and G of each element, both (e, 1)."""
    young, poisson = moduli(scene)
    return young / (3 * (1 - 2 * poisson)), young / (2 * (1 + poisson))


def yield_stress_of(scene: Scene) -> Curve:
    """The yield stress (e, q) at peeq (e, q); that of what never yields is infinite."""
    curves = [_curve(metal) for metal in metals(scene)]
    return lambda peeq: np.stack([curve(own) for curve, own in zip(curves, peeq, strict=True)])


def _curve(metal: Material) -> Curve:
    if isinstance(metal, Elastic):
        return lambda p: np.full(p.shape, np.inf)
    assert isinstance(metal, VonMises)
    return curve_of(metal.hardening)


def curve_of(hardening: Hardening) -> Curve:
    """The yield stress written a second time, from the curve's numbers."""
    if isinstance(hardening, Perfect):
        sigma = hardening.sigma_y
        return lambda p: sigma + 0 * p
    if isinstance(hardening, Linear):
        sigma, slope = hardening.sigma_y, hardening.modulus
        return lambda p: sigma + slope * p
    if isinstance(hardening, Voce):
        h = hardening
        return lambda p: h.sigma_y + h.saturation * (1 - np.exp(-h.rate * p)) + h.modulus * p
    if isinstance(hardening, Tabulated):
        x, y = np.array(hardening.peeq), np.array(hardening.stress)
        return lambda p: np.interp(p, x, y)
    raise TypeError(f"no curve known for {hardening!r}")


def metals_in(scene: Scene, stress: float) -> Scene:
    """The scene with all stresses of its materials times ``stress``."""
    regions = {name: _metal_in(own, stress) for name, own in scene.regions.items()}
    return replace(scene, material=_metal_in(scene.material, stress), regions=regions)


def _metal_in(metal: Material, stress: float) -> Material:
    elastic = Elasticity(metal.elasticity.young * stress, metal.elasticity.poisson)
    if isinstance(metal, Elastic):
        return Elastic(elastic)
    assert isinstance(metal, VonMises)
    return VonMises(elastic, _hardened_in(metal.hardening, stress))


def _hardened_in(curve: Hardening, stress: float) -> Hardening:
    """The curve with its stresses times ``stress``."""
    if isinstance(curve, Perfect):
        return Perfect(curve.sigma_y * stress)
    if isinstance(curve, Linear):
        return Linear(curve.sigma_y * stress, curve.modulus * stress)
    if isinstance(curve, Voce):
        return Voce(curve.sigma_y * stress, curve.saturation * stress, curve.rate, curve.modulus * stress)
    if isinstance(curve, Tabulated):
        return Tabulated(curve.peeq, tuple(s * stress for s in curve.stress))
    raise TypeError(f"no units known for {curve!r}")
