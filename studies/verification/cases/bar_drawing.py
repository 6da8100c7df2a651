"""A bar drawn through a cone with constant shear, against Avitzur's upper bound."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bipot import Elasticity, Geometry, Perfect, Prescribed, Scene, Schedule, ShapedTool, Support, VonMises
from studies.verification.case import Asked, Case, Sense, Subject, Watch
from studies.verification.dies import converging, filling

BOUNDS = {
    (15, 0.3): {0.0: 0.56059, 0.1: 0.63744, 0.2: 0.71429},
    (10, 0.2): {0.0: 0.35819, 0.1: 0.43125, 0.2: 0.50432},
}
"""Drawing stress over the yield stress, by semi-angle in degrees and reduction of area, by the shear factor."""

BACK, AHEAD, TRAVEL = 0.8, 0.6, 0.5
FILLET = 0.05
STEPS = 6
"""Increments while the bar goes on by one element."""

STEADY = 0.25
"""Part of the travel before the mean is taken."""


def drawn(angle: int, reduction: float, m: float, n: int) -> Scene:
    """The bar, n elements over its radius of one, pulled at its thin end; its yield stress is one."""
    a, thin = float(np.radians(angle)), float(np.sqrt(1 - reduction))
    die = converging(a, thin, FILLET)
    return Scene(
        mesh=filling(die, n, (-BACK, (1 - thin) / np.tan(a) + AHEAD), 2),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(1000.0, 0.3), Perfect(1.0)),
        supports=(Support("left", 0), Prescribed("top", 1, TRAVEL)),
        tools=(ShapedTool(die, (0.0, 0.0), ("right",), np.inf if m else 0.0, shear=m or np.inf),),
    )


def stress(angle: int, reduction: float, m: float, n: int, watch: Watch) -> tuple[float, float]:
    """Mean drawing stress over the area of the die's exit, once the flow is steady, and largest imbalance of forces."""
    scene = drawn(angle, reduction, m, n)
    end = scene.mesh.boundary_nodes("top")
    total, worst, before = 0.0, 0.0, STEADY
    schedule = Schedule(round(STEPS * n * TRAVEL), landings=(STEADY,))
    for accepted in watch.march(scene, schedule):
        pull = float(accepted.solved.iterate.reactions(accepted.solved.r)[end, 1].sum())
        worst = max(worst, abs(pull + float(accepted.tool_force(0)[1])) / pull)
        if accepted.state.tau > STEADY:
            total += pull * (accepted.state.tau - before)
            before = accepted.state.tau
    return total / (1 - STEADY) / (np.pi * (1 - reduction)), worst


def run(n: int, watch: Watch) -> Sequence[float]:
    """Each stress twice, because two bounds hold it, and its imbalance."""
    found = [stress(*die, m, n, watch) for die, bounds in BOUNDS.items() for m in bounds]
    return [value for mean, imbalance in found for value in (mean, mean, imbalance)]


def asked(angle: int, reduction: float, m: float, bound: float) -> tuple[Asked, ...]:
    """Between homogeneous work and the upper bound; the balance of pull and die."""
    said = f"a = {angle}, r = {reduction:.0%}, m = {m:g}"
    return (
        Asked(f"{said}: homogeneous", float(-np.log1p(-reduction)), 0.0, Sense.AT_LEAST),
        Asked(f"{said}: upper bound", bound, 0.0, Sense.AT_MOST),
        Asked(f"{said}: pull - die", 0.0, 1e-6),
    )


CASE = Case(
    name="bar_drawing",
    subject=Subject.TOOLS,
    source="published upper bound: Avitzur, spherical velocity field; homogeneous work ln(1/(1 - r)) from below",
    purpose="Steady axisymmetric flow through a cone that shears the body by m times its shear yield stress.",
    setup=(
        "A bar of radius one is drawn through a cone of semi-angle a without a land, the exit rounded by 0.05; "
        "perfect plasticity, E = 1000 sigma_Y; mu = inf with the shear capped at m k, and mu = 0 where m = 0. The "
        "bar fills the die at rest. Q4 with the mean of its volume change. The thin end moves by half a radius, in "
        "six increments an element. The value is the mean force over the last three quarters, over the exit's area "
        "and the yield stress."
    ),
    asked=tuple(one for die, bounds in BOUNDS.items() for m, bound in bounds.items() for one in asked(*die, m, bound)),
    counted="elements over the radius",
    meshes=(4, 8, 16),
    run=run,
)
