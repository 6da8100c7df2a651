"""Extrusion in plane strain through a smooth wedge die, at the reduction of which the slip-line field is simplest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bipot import Elasticity, FlatTool, Geometry, Perfect, Scene, Schedule, ShapedTool, Symmetry, VonMises
from studies.verification.case import Asked, Case, Sense, Subject, Watch
from studies.verification.dies import converging, filling

ANGLES = (30, 45)
"""Semi-angles in degrees."""

BACK, AHEAD, TRAVEL = 1.5, 0.5, 0.5
FILLET = 0.05
LEAD = 0.3
STEPS = 6
"""Increments while the punch goes on by one element."""

SERIES = (1 / 2, 2 / 3, 1)
"""Of the elements: the three meshes from which a mean is extrapolated."""

STEADY = 0.25
"""Part of the travel before the mean is taken."""


def reduction(angle: int) -> float:
    """At which the field is a triangle on the die and a fan."""
    twice = 2 * float(np.sin(np.radians(angle)))
    return twice / (1 + twice)


def pressure(angle: int) -> float:
    """Mean p/2k of the punch; that of the die is 1 + a."""
    return reduction(angle) * (1 + float(np.radians(angle)))


def extruded(angle: int, n: int) -> Scene:
    """Half of the billet, k = 1, its container and die one profile."""
    a, r = np.radians(angle), reduction(angle)
    die = converging(a, 1 - r, FILLET, entry=FILLET)
    return Scene(
        mesh=filling(die, n, (-BACK, r / np.tan(a) + AHEAD), 1, LEAD),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(1000 * np.sqrt(3.0), 0.3), Perfect(float(np.sqrt(3.0)))),
        supports=(Symmetry("left", 0),),
        tools=(
            FlatTool((0.0, -BACK), (0.0, 1.0), (0.0, TRAVEL), ("base",), 0.0),
            ShapedTool(die, (0.0, 0.0), ("right",), 0.0),
        ),
    )


def steady(angle: int, n: int, watch: Watch) -> tuple[float, float]:
    """Mean p/2k and largest imbalance of punch and dies over the force, once the flow is steady."""
    work, worst, before = 0.0, 0.0, STEADY
    for accepted in watch.march(extruded(angle, n), Schedule(round(STEPS * n * TRAVEL), landings=(STEADY,))):
        punch, die = (float(accepted.tool_force(k)[1]) for k in range(2))
        worst = max(worst, abs(punch + 2 * die) / punch)
        if accepted.state.tau > STEADY:
            work += punch / 4 * (accepted.state.tau - before)
            before = accepted.state.tau
    return work / (1 - STEADY), worst


def run(n: int, watch: Watch) -> Sequence[float]:
    """Each angle on n elements, two thirds and half of them."""
    out = list[float]()
    meshes = tuple(round(part * n) for part in SERIES)
    for angle in ANGLES:
        found = [steady(angle, mesh, watch) for mesh in meshes]
        means = [mean for mean, _ in found]
        out += [
            means[-1],
            order(meshes, means, pressure(angle)),
            limit(meshes, means),
            max(worst for _, worst in found),
        ]
    return out


def coarse(n: int, watch: Watch) -> Sequence[float]:
    """The means on half of the elements."""
    return [steady(angle, n // 2, watch)[0] for angle in ANGLES]


def order(meshes: Sequence[int], means: Sequence[float], exact: float) -> float:
    """By least squares the power of the element's size with which the means fall towards what is exact.

    NaN where one is not above it.

    >>> order((2, 4), (1.5, 1.25), 1.0)
    1.0
    """
    above = np.array(means) - exact
    return -float(np.polyfit(np.log(meshes), np.log(above), 1)[0]) if (above > 0).all() else np.nan


def limit(meshes: Sequence[int], means: Sequence[float]) -> float:
    """By least squares what the means tend to where they are linear in the element's size."""
    return float(np.polyfit(1 / np.array(meshes), means, 1)[1])


def asked(angle: int) -> tuple[Asked, ...]:
    """The mean, from above; to first order in the element's size; the balance."""
    exact = pressure(angle)
    return (
        Asked(f"a = {angle}: p/2k", exact, 0.0, Sense.AT_LEAST),
        Asked(f"a = {angle}: order", 1.0, 0.2),
        Asked(f"a = {angle}: p/2k, extrapolated", exact, 0.03),
        Asked(f"a = {angle}: punch - dies", 0.0, 1e-6),
    )


CASE = Case(
    name="wedge_extrusion",
    subject=Subject.TOOLS,
    source="closed form: p/2k = r (1 + a), r = 2 sin a/(1 + 2 sin a) (Hill)",
    purpose=("Steady flow along a tool with a convex and a concave bend, where nodes separate from it."),
    setup=(
        "Plane strain, perfect plasticity with shear strength k, E = 1000 sigma_Y; half of a billet through a die of"
        " semi-angle a with a container, all frictionless, r = 0.5 at 30 and 0.586 at 45 degrees. The body fills the"
        " die at rest, with its front rows along the wall; container and exit are rounded by 0.05 of the "
        "half-height. Q4 with the mean of its volume change. The punch moves by half of the half-height, in six "
        "increments an element; forces are means over the last three quarters of it. From the means on n/2, 2 n/3 "
        "and n elements follow the order with which they decrease towards the exact value, and the value "
        "extrapolated linearly in the element's size. The die's pressure is q = p/r, hence 1 + a, where punch and "
        "dies are in balance, which is tested as the sum of their forces over one. Other forms are run on the "
        "marches of the coarsest mesh's n/2 elements."
    ),
    asked=tuple(one for angle in ANGLES for one in asked(angle)),
    counted="elements over the half-height",
    meshes=(8, 16, 24),
    run=run,
    beside=coarse,
    note=(
        "The order is that of twelve elements and more over the half-height. On coarser meshes, where a rounded "
        "corner lies within one element, errors vary with the positions of nodes beside the corners."
    ),
)
