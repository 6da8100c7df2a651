"""Hertz in space: a rigid sphere on a quarter of an elastic block."""

from __future__ import annotations

import numpy as np

from bipot import Elasticity, Schedule, ShapedTool, Symmetry, sphere
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.half_space import FINE, forces, half_space, indented, peak, radius

RADIUS, ELASTIC = 1000.0, Elasticity(70_000.0, 0.3)
STAR = ELASTIC.young / (1 - ELASTIC.poisson**2)
DEPTH = 1 / RADIUS
"""At which the contact radius sqrt(R d) is one."""


def run(n: int, watch: Watch) -> list[float]:
    """Force, contact radius and largest pressure, each over that of Hertz by the approach."""
    ball = ShapedTool(sphere((0.0, 0.0, RADIUS), RADIUS), (0.0, 0.0, -DEPTH), ("near",), 0.0)
    scene = indented(half_space(1.0, n, half=False), ELASTIC, ball, Symmetry("left", 0), Symmetry("front", 1))
    last = watch.end(scene, Schedule(1))
    force = float(-last.tool_force(0)[2])
    p0 = 2 * STAR * float(np.sqrt(DEPTH / RADIUS)) / np.pi
    normal, _ = forces(last)
    return [force / (4 / 3 * STAR * np.sqrt(RADIUS) * DEPTH**1.5), radius(last, normal, FINE / n), peak(last) / p0]


CASE = Case(
    name="hertz_in_space",
    subject=Subject.ELASTIC_CONTACT,
    source="closed form (Hertz)",
    purpose=("A sphere on a body in space: force, radius and pressure of the contact for a given approach."),
    setup=(
        "A rigid sphere, R = 1000, is pressed by d = 0.001 into a quarter of an elastic block in one increment; E = "
        "70000, nu = 0.3, small strain, H8 with the mean of its volume change, no friction. a^2 = R d = 1, F = 4/3 "
        "E* sqrt(R) d^1.5, p0 = 2 E* sqrt(d/R)/pi. n equal elements reach to 1.2 a along the surface and n/2 to 0.6 "
        "a in depth. From there 2 n - 1 elements grow with the power 4/3 of their distance, to free sides at 1.2 a "
        "(2 n)^3 and a fixed base half as deep. The finite block reduces the approach by the order of a over the "
        "depth, 0.3 %, 0.1 % and 0.04 %. The contact radius is found from the mean square of the distance of contact"
        " forces from the axis, 2/5 a^2 (less a third of the square of an element's side, by which nodal forces "
        "increase it). p0 is the largest pressure at a node."
    ),
    asked=tuple(Asked(f"{name} over its closed form", 1.0, 0.02) for name in ("F", "a", "p0")),
    counted="equal elements to 1.2 a",
    meshes=(4, 6, 8),
    run=run,
)
