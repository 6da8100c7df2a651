"""Hertz: a rigid sphere on an elastic half-space, by its approach."""

from __future__ import annotations

import numpy as np

from bipot import Elasticity, Element, Geometry, Schedule
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.indentation import RADIUS, along, elliptic, pressed

ELASTIC = Elasticity(1.40625e7, 0.25)
STAR = ELASTIC.young / (1 - ELASTIC.poisson**2)
DEPTH = 1 / RADIUS
"""At which the contact radius sqrt(R d) is one."""


def run(n: int, watch: Watch) -> list[float]:
    """Force, contact radius and largest pressure."""
    last = watch.end(pressed(Geometry.AXISYMMETRIC, DEPTH, ELASTIC, 0.0, n, Element.Q8), Schedule(4))
    x, pressure, _ = along(last)
    return [float(-last.tool_force(0)[1]), *elliptic(x, pressure)]


CASE = Case(
    name="hertz_sphere",
    subject=Subject.TOOLS,
    source="closed form (Hertz)",
    purpose=("A curved tool with a growing contact: force, radius and pressure of the contact for a given approach."),
    setup=(
        "A rigid sphere, R = 1000, is pressed by d = 0.001 into an axisymmetric block 1000 wide and deep; E = "
        "1.40625e7, nu = 0.25, small strain, Q8, no friction. a^2 = R d = 1, F = 4/3 E* sqrt(R) d^1.5, p0 = 2 E* "
        "sqrt(d/R)/pi. A straight line is fitted to the squares of nodal pressures over r^2, by least squares over "
        "the nodes with p > 0.3 of the largest; it is zero at r = a and p0^2 at r = 0. The elastic "
        "constants are those of a published case (MOOSE, R_eff = 1, d = 0.01: a = 0.1, p0 = 9.55e5) with a smaller "
        "contact, because at a/R = 0.1 a sphere differs from a paraboloid by 1 % of the force."
    ),
    asked=(
        Asked("F", 4 / 3 * STAR * float(np.sqrt(RADIUS)) * DEPTH**1.5, 0.01),
        Asked("a", 1.0, 0.01),
        Asked("p0", 2 * STAR * float(np.sqrt(DEPTH / RADIUS)) / np.pi, 0.01),
    ),
    counted="equal elements to 1.3 a",
    meshes=(8, 16, 32),
    run=run,
)
