"""A tube that is expanded to three times its bore."""

from __future__ import annotations

import numpy as np

from bipot import (
    Elasticity,
    Element,
    Geometry,
    Perfect,
    Prescribed,
    Quadrature,
    Scene,
    Schedule,
    Support,
    VonMises,
    ring,
)
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.tubes import pressure_on

BORE, OUTER, YIELD = 10.0, 20.0, 0.5
RADII = {0.25: 15.0, 1.0: 30.0}
"""Of the bore, by pseudo-time."""


def exact(radius: float) -> float:
    """Pressure that expands the rigid-plastic tube at this radius of its bore."""
    outer = np.sqrt(radius**2 + OUTER**2 - BORE**2)
    return float(2 / np.sqrt(3) * YIELD * np.log(outer / radius))


def run(elements: int, watch: Watch) -> list[float]:
    """The pressures, in increments as small as the elements."""
    scene = Scene(
        mesh=ring(BORE, OUTER, 1.0, elements, 1, element=Element.Q8),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(1e4 * YIELD, 0.3), Perfect(YIELD)),
        supports=(Support("base", 1), Support("top", 1), Prescribed("bore", 0, RADII[1.0] - BORE)),
        quadrature=Quadrature.GAUSS2,
    )
    steps = watch.march(scene, Schedule(4 * elements, landings=(0.25,)))
    return [pressure_on(step, "bore") for step in steps if step.state.tau in RADII]


CASE = Case(
    name="huge_strain_tube",
    subject=Subject.MATERIAL,
    source="closed form: p = (2/sqrt3) sigma_Y ln(b/a), b^2 = a^2 + b0^2 - a0^2",
    purpose="Plastic flow and geometry at strains beyond one, where the load decreases.",
    setup=(
        "Plane strain, a0 = 10, b0 = 20, sigma_Y = 0.5, E = 10^4 sigma_Y; the bore is driven to a = 30; Q8 with 2 x "
        "2 points, four increments an element."
    ),
    asked=tuple(Asked(f"p at a = {radius:g}", exact(radius), 0.005) for radius in RADII.values()),
    counted="elements through the wall",
    meshes=(5, 10, 20),
    run=run,
)
