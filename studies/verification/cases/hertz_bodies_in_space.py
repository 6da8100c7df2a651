"""Hertz in space with two bodies: a curved block on a flat one, of one material."""

from __future__ import annotations

import numpy as np

from bipot import (
    Accepted,
    DeformableTool,
    Elastic,
    Elasticity,
    Geometry,
    Mesh,
    Prescribed,
    Scene,
    Schedule,
    Support,
    Symmetry,
    together,
)
from bipot.fem.strain import Configuration
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.half_space import FINE, forces, half_space, peak

RADIUS, ELASTIC, FRICTION = 1000.0, Elasticity(70_000.0, 0.3), 0.3
STAR = ELASTIC.young / (1 - ELASTIC.poisson**2) / 2
APPROACH = 1 / RADIUS
"""At which the contact radius sqrt(R d) is one."""

CURVED, MORE = 10.0, 2
"""How far the upper surface is curved, over the contact radius, and how many more elements reach to 1.2 a there."""


def closed(force: float) -> tuple[float, float]:
    """a^3 = 3 F R/(4 E*) and p0 = 3 F/(2 pi a^2).

    >>> [round(each, 9) for each in closed(4 / 3 * STAR * RADIUS**0.5 * APPROACH**1.5)]
    [1.0, 24.485376391]
    """
    a = float(np.cbrt(3 * force * RADIUS / 4 / STAR))
    return a, 1.5 * force / np.pi / a**2


def scene(n: int) -> Scene:
    """Quarters of two blocks, of which the upper one is raised by r^2/(2 R) along its lower surface."""
    low, turned = half_space(1.0, n, half=False), half_space(1.0, n + MORE, half=False)
    x, y, z = turned.nodes.T
    raised = np.minimum(np.hypot(x, y), CURVED) ** 2 / (2 * RADIUS) - z
    # Turned around the line x = y.
    named = {"left": "front", "front": "left"}
    boundaries = {named.get(name, name): facets for name, facets in turned.boundaries.items()}
    parts = {"low": low, "up": Mesh(np.stack([y, x, raised], axis=1), turned.elements, boundaries)}
    return Scene(
        mesh=together(parts),
        geometry=Geometry.SOLID,
        material=Elastic(ELASTIC),
        supports=(
            *(Symmetry(f"{part}/{side}", axis) for part in parts for axis, side in enumerate(("left", "front"))),
            *(Support("low/base", axis) for axis in range(3)),
            *(Support("up/base", axis) for axis in range(2)),
            Prescribed("up/base", 2, -APPROACH),
        ),
        tools=(DeformableTool(("low/near",), ("up/near",), FRICTION),),
        configuration=Configuration.SMALL,
    )


def radius(last: Accepted, size: float) -> float:
    """Of the circle on which forces are spread as sqrt(1 - r^2/a^2): a^2 = 5/2 of their mean r^2.

    Forces are those of pressures that are linear between points, this ``size`` apart along x and y.
    """
    normal, _ = forces(last)
    x = last.state.nodes[last.solved.iterate.increment.system.candidates.node]
    return float(np.sqrt(2.5 * (normal @ (x[:, :2] ** 2).sum(axis=1) / normal.sum() + size**2 / 3)))


def run(n: int, watch: Watch) -> list[float]:
    """Contact radius and largest pressure over those of Hertz by the force, the force over that by the approach, and
    friction over the force.
    """
    last = watch.end(scene(n), Schedule(1))
    force, (normal, _) = abs(float(last.tool_force(0)[2])), forces(last)
    a, p0 = closed(force)
    by_approach = 4 / 3 * STAR * np.sqrt(RADIUS) * APPROACH**1.5
    friction = float(np.linalg.norm(last.solved.r[:, 1:], axis=1).sum() / normal.sum())
    return [radius(last, FINE / (n + MORE)) / a, peak(last) / p0, force / by_approach, friction]


CASE = Case(
    name="hertz_bodies_in_space",
    subject=Subject.TWO_BODIES,
    source="closed form (Hertz)",
    purpose="Two bodies in space that touch at one point before they are pressed: radius, pressure and force.",
    setup=(
        "Quarters of two elastic blocks, the upper one of which is raised by r^2/(2 R) along its lower surface up "
        "to r = 10, R = 1000, approach each other by d = 0.001 in one increment; E = 70000, nu = 0.3, small strain, "
        "H8 with the mean of its volume change, mu = 0.3. a^2 = R d = 1, F = 4/3 E* sqrt(R) d^1.5, 1/E* = 2 (1 - "
        "nu^2)/E. Both blocks are those of `hertz_in_space`, with n equal elements to 1.2 a in the lower one and n "
        "+ 2 in the upper one, which has the candidates. Compared are the contact radius, from the mean square of "
        "the distance of forces from the axis, and the largest pressure with those that belong to the force, and "
        "the force with that of the approach, which finite blocks make larger. Two bodies of one material do not "
        "slip: the sum of the sizes of the forces of friction is compared with zero, over the force."
    ),
    asked=(
        Asked("a over that of F", 1.0, 0.01),
        Asked("p0 over that of F", 1.0, 0.01),
        Asked("F over its closed form", 1.0, 0.04),
        Asked("friction over F", 0.0, 0.03),
    ),
    counted="equal elements to 1.2 a",
    meshes=(2, 4),
    run=run,
    note=(
        "The error of F is that of the blocks, as in `hertz_in_space` with as many elements. Friction is an error of "
        "the meshes, which do not match."
    ),
)
