"""Limit load of a square block in space between rough platens, against strict bounds from both sides."""

from __future__ import annotations

from math import inf

from bipot import (
    Configuration,
    Elasticity,
    FlatTool,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    Symmetry,
    VonMises,
    brick,
)
from studies.verification.case import Asked, Case, Sense, Subject, Watch

BOUNDS = {1: (1.0316, 1.0569), 4: (1.553, 1.747)}
"""Of p/sigma_Y, by width over height."""

YIELD, SHORTENED, INCREMENTS, FIRST = 300.0, 0.04, 8, 0.02
PLANES = (Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2))


def pressure(ratio: int, n: int, mu: float, watch: Watch) -> float:
    """Mean pressure over the yield stress of a block whose eighth has n elements along its height, when all flows."""
    half = 0.5 * ratio
    travel = (0.0, 0.0, -SHORTENED * 0.5)
    scene = Scene(
        mesh=brick(half, half, 0.5, ratio * n, ratio * n, n),
        geometry=Geometry.SOLID,
        material=VonMises(Elasticity(200e3, 0.3), Perfect(YIELD)),
        supports=PLANES,
        tools=(FlatTool((0.0, 0.0, 0.5), (0.0, 0.0, -1.0), travel, ("top",), mu),),
        configuration=Configuration.SMALL,
    )
    return float(-watch.end(scene, Schedule(INCREMENTS, first=FIRST)).tool_force(0)[2] / (YIELD * ratio**2))


def run(n: int, watch: Watch) -> list[float]:
    """By ratio the pressure twice, for its bounds, and over that of elements of twice the size; without friction."""
    out = list[float]()
    for ratio in BOUNDS:
        coarse, fine = (pressure(ratio, count, inf, watch) for count in (n // 2, n))
        out += [fine, fine, fine / coarse]
    return [*out, pressure(1, n, 0.0, watch)]


def asked() -> tuple[Asked, ...]:
    """Bounds, descent, the exact value without friction."""
    out = list[Asked]()
    for ratio, (lower, upper) in BOUNDS.items():
        out += [
            Asked(f"p/sigma_Y, w/h = {ratio}", upper, 0.0, Sense.AT_MOST),
            Asked(f"p/sigma_Y, w/h = {ratio}, from below", lower, 0.0, Sense.AT_LEAST),
            Asked(f"w/h = {ratio}, over that of elements of twice the size", 1.0, 0.0, Sense.AT_MOST),
        ]
    return (*out, Asked("p/sigma_Y, w/h = 1, frictionless", 1.0, 1e-8))


CASE = Case(
    name="rough_block",
    subject=Subject.LIMITS,
    source="strict bounds from both sides: kinematic and static programs on tetrahedra",
    purpose=(
        "The limit load of a body in space that sticks to its tools: it decreases with the mesh, into its bounds."
    ),
    setup=(
        "A block of square section, width w, height h, von Mises, perfect plasticity, between platens that weld it"
        f" (mu = inf) or are frictionless (mu = 0); small strain, shortened by {SHORTENED:.0%} in {INCREMENTS}"
        " increments after a start-up,"
        " E = 667 sigma_Y; an eighth with n elements along its height and (w/h) n along its width, cubes, H8 with the"
        " mean of its volume change."
    ),
    asked=asked(),
    counted="elements along half the height",
    meshes=(2, 4, 6),
    run=run,
    note="The bounds hold for the exact limit load. Values of coarse meshes are above them, as is admissible.",
)
