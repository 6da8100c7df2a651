"""Hertz: a rigid cylinder on an elastic half-plane, by the force it finds."""

from __future__ import annotations

import numpy as np

from bipot import Accepted, Elasticity, Element, Geometry, Schedule
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.indentation import FAR, RADIUS, along, elliptic, pressed

ELASTIC = Elasticity(70_000.0, 0.3)
STAR = ELASTIC.young / (1 - ELASTIC.poisson**2)
TRAVEL = 0.00355
"""At which the half-width is about one."""

BELOW = 10.0
"""Half-widths down to which the approach is measured."""


def run(n: int, watch: Watch) -> list[float]:
    """Half-width, largest pressure and approach, each over its closed form of the force."""
    last = watch.end(pressed(Geometry.PLANE_STRAIN, TRAVEL, ELASTIC, 0.0, n, Element.Q8), Schedule(4))
    force = float(-last.tool_force(0)[1])
    half, peak = elliptic(*along(last)[:2])
    a, p0 = np.sqrt(4 * force * RADIUS / np.pi / STAR), np.sqrt(force * STAR / np.pi / RADIUS)
    return [half / a, peak / p0, approach(last, BELOW * a) / closed_approach(force, a)]


def approach(last: Accepted, depth: float) -> float:
    """How much nearer the surface on the axis has come to the point of the axis at this depth."""
    rest = last.state.nodes - last.displacement
    (axis,) = np.nonzero(rest[:, 0] == 0)
    axis = axis[np.argsort(-rest[axis, 1])]
    down = -last.displacement[axis, 1]
    return float(down[0] - np.interp(depth, FAR - rest[axis, 1], down))


def closed_approach(force: float, a: float) -> float:
    """(1 - nu^2) F/(pi E) (2 ln(2 d/a) - nu/(1 - nu)) of a point d = BELOW a deep (Johnson 1985, 5.58)."""
    ratio = ELASTIC.poisson / (1 - ELASTIC.poisson)
    return force / (np.pi * STAR) * (2 * np.log(2 * BELOW) - ratio)


CASE = Case(
    name="hertz_cylinder",
    subject=Subject.ELASTIC_CONTACT,
    source="closed form (Hertz; Johnson 1985 for the approach)",
    purpose="The plane contact of a curved tool: half-width, pressure and approach.",
    setup=(
        "A rigid cylinder, R = 1000, on a plane-strain block 2000 wide and 1000 deep, E = 70000, nu = 0.3, small "
        "strain, Q8, no friction. In a half-plane the approach has no limit, so the references are those for the "
        "computed force F per length: a^2 = 4 F R/(pi E*), p0^2 = F E*/(pi R), and the approach to the point d = 10 "
        "a below on the axis, F (2 ln(2 d/a) - nu/(1 - nu))/(pi E*). Half-width and largest pressure are measured as"
        " in `hertz_sphere`. The problem of two bodies, NAFEMS R0094-1, is `hertz_two_bodies`."
    ),
    asked=tuple(Asked(f"{name} over its closed form", 1.0, 0.01) for name in ("a", "p0", "approach")),
    counted="equal elements to 1.3 a",
    meshes=(8, 16, 32),
    run=run,
)
