"""Cattaneo and Mindlin: a rigid sphere that is pressed on an elastic half-space and then shifted along it."""

from __future__ import annotations

import numpy as np

from bipot import Elasticity, Schedule, ShapedTool, Symmetry, sphere
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.half_space import FINE, forces, half_space, indented, peak, radius

RADIUS, ELASTIC, MU, FORCE = 10.0, Elasticity(200.0, 0.49), 0.3, 10.0
STAR, SHEAR = ELASTIC.young / (1 - ELASTIC.poisson**2), ELASTIC.young / (2 * (1 + ELASTIC.poisson))
PRESSED = 0.25
"""Pseudo-time at which the sphere has been pressed; then it is shifted."""


def extent(force: float) -> float:
    """a^3 = 3 P R/(4 E*), the contact radius of Hertz by the force.

    >>> round(extent(10.0), 6)
    0.658056
    """
    return float(np.cbrt(3 * force * RADIUS / (4 * STAR)))


def stuck(force: float, pull: float) -> float:
    """c = a (1 - Q/(mu P))^(1/3), the stick radius.

    >>> round(stuck(10.0, 1.5), 6)
    0.522299
    """
    return extent(force) * float(np.cbrt(1 - pull / (MU * force)))


def shifted(force: float, pull: float) -> float:
    """3 mu P (2 - nu)/(16 G a) (1 - (1 - Q/(mu P))^(2/3)), how far the sphere goes along the half-space.

    >>> round(shifted(10.0, 1.5), 8)
    0.00711658
    """
    soft = 3 * MU * force * (2 - ELASTIC.poisson) / (16 * SHEAR * extent(force))
    return soft * (1 - (1 - pull / (MU * force)) ** (2 / 3))


SINK, SHIFT = extent(FORCE) ** 2 / RADIUS, shifted(FORCE, MU * FORCE / 2)
"""Approach and shift at which the force is 10 and half of what slides."""


def run(n: int, watch: Watch) -> list[float]:
    """Contact radius, pressure, approach, stick radius and shift, each over its closed form of the forces found."""
    path = ((0.0, 0.0), (PRESSED, (0.0, 0.0, 1.0)), (1.0, 1.0))
    ball = ShapedTool(sphere((0.0, 0.0, RADIUS), RADIUS), (SHIFT, 0.0, -SINK), ("near",), MU, path)
    a = extent(FORCE)
    last = watch.end(indented(half_space(a, n, half=True), ELASTIC, ball, Symmetry("front", 1)), Schedule(4))
    pull, _, force = map(float, last.tool_force(0) * (1, 1, -1))
    normal, left = forces(last)
    size, exact = FINE * a / n, extent(force)
    return [
        radius(last, normal, size) / exact,
        peak(last) / (3 * force / (2 * np.pi * exact**2)),
        SINK * RADIUS / exact**2,
        radius(last, left, size) / stuck(force, pull),
        SHIFT / shifted(force, pull),
    ]


TOLERANCES = {"a": 0.02, "p0": 0.02, "approach": 0.02, "stick radius": 0.05, "shift": 0.05}

CASE = Case(
    name="mindlin",
    subject=Subject.ELASTIC_CONTACT,
    source="closed form (Hertz; Cattaneo; Mindlin, for one elastic body)",
    purpose=("Partial slip in space, with two tangents: an outer ring of the contact slips, its middle sticks."),
    setup=(
        "A rigid sphere, R = 10, on half of an elastic block, E = 200, nu = 0.49 (pressure and friction are nearly "
        "uncoupled), mu = 0.3, small strain, H8 with the mean of its volume change. The sphere is pressed by "
        "0.0433037 in one increment, at which P = 10 and a = 0.658056, then shifted by 0.00711658 in three, at which"
        " Q = mu P/2. The references are those for the computed forces P and Q: a^3 = 3 P R/(4 E*), p0 = 3 P/(2 pi "
        "a^2), the approach a^2/R, the stick radius a (1 - Q/(mu P))^(1/3), the shift 3 mu P (2 - nu)/(16 G a) (1 - "
        "(1 - Q/(mu P))^(2/3)). The mesh is that of `hertz_in_space`, and a and p0 are measured in the same way. The"
        " stick radius is measured likewise from mu p - |q|, the distance of the friction from its limit: over the "
        "sticking circle this is distributed as the pressure of a contact of that radius, and it is zero where the "
        "surface slips."
    ),
    asked=tuple(Asked(f"{name} over its closed form", 1.0, tolerance) for name, tolerance in TOLERANCES.items()),
    counted="equal elements to 1.2 a",
    meshes=(2, 4, 6),
    run=run,
)
