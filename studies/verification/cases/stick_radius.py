"""Spence's stick radius under a rigid cylinder and a rigid sphere."""

from __future__ import annotations

from functools import partial

import numpy as np

from bipot import Elasticity, Element, Geometry, Schedule
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.indentation import FAR, NEAR, RADIUS, along, pressed, stick_radius

ELASTIC = Elasticity(100_000.0, 0.45)
STAR = ELASTIC.young / (1 - ELASTIC.poisson**2)
BETA = (1 - 2 * ELASTIC.poisson) / (2 * (1 - ELASTIC.poisson))
HALVES = (0.5, 1.0)
"""Parts of the travel at which the radius is read."""

TRAVELS = {Geometry.PLANE_STRAIN: 0.0038, Geometry.AXISYMMETRIC: 1 / RADIUS}
"""At which the half-width is about one."""


def half_width(geometry: Geometry, force: float) -> float:
    """That of Hertz by the force."""
    if geometry is Geometry.PLANE_STRAIN:
        return float(np.sqrt(4 * force * RADIUS / np.pi / STAR))
    return float(np.cbrt(3 * force * RADIUS / 4 / STAR))


def run(n: int, watch: Watch, far: float = FAR) -> list[float]:
    """c/a of the cylinder and the sphere, at half the travel and at its end."""
    out = list[float]()
    for geometry, travel in TRAVELS.items():
        scene = pressed(geometry, travel, ELASTIC, BETA, n, Element.Q4, far)
        for accepted in watch.march(scene, Schedule(n // 2)):
            if accepted.state.tau in HALVES:
                x, _, r = along(accepted)
                out.append(stick_radius(x, r, BETA) / half_width(geometry, -accepted.tool_force(0)[1]))
    return out


CASE = Case(
    name="stick_radius",
    subject=Subject.TOOLS,
    source="closed form (Spence; Galin), pressure without the coupling by shear",
    purpose=(
        "Friction that depends on history: points come into contact one after the other, slip and then stick for "
        "good. In self-similar indentation the stick radius is a constant fraction of the contact radius."
    ),
    setup=(
        "The block of `hertz_cylinder` with E = 100000, nu = 0.45 and mu = beta = (1 - 2 nu)/(2 (1 - nu)) = 0.0909, "
        "under a rigid cylinder and a rigid sphere, R = 1000 a, Q4, n/2 increments. K'(c/a)/K(c/a) = beta/mu for the"
        " cylinder, (a/2c) ln((a + c)/(a - c)) = (mu/beta) K'(c/a) for the sphere. The neglected coupling is of the "
        "order of beta. c is halfway between the last node that sticks and the next, a is Hertz' radius for the "
        "force. Far sides and the turning normals change c/a by the order of a/R and a/L over beta, so these are "
        "small. Other forms are run on a block ten times smaller."
    ),
    asked=tuple(
        Asked(f"c/a, {name}, {'half the travel' if half < 1 else 'end'}", exact, 0.05)
        for name, exact in (("cylinder", float(np.sqrt(0.5))), ("sphere", 0.9038))
        for half in HALVES
    ),
    counted="equal elements to 1.3 a",
    meshes=(16, 32, 64),
    run=run,
    beside=partial(run, far=NEAR),
)
