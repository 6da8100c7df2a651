"""Two elastoplastic curved beams, one of which is pulled over the other."""

from __future__ import annotations

import numpy as np

from bipot import (
    DeformableTool,
    Elasticity,
    Geometry,
    Linear,
    Mesh,
    Prescribed,
    Scene,
    Schedule,
    Support,
    VonMises,
    block,
    together,
)
from bipot.typing import Floats
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.two_bodies import mapped

MATERIAL = VonMises(Elasticity(689.56, 0.32), Linear(31.0, 261.2))
LOW, HIGH = (10.0, 12.0), (8.0, 10.0)
"""Inner and outer radius of the lower and of the upper beam."""

HEIGHT, TRAVEL, MU, INCREMENTS = 17.0, 31.5, 0.3, 63
"""How high the ends of the upper beam are above those of the lower one, how far they go, and in how many increments."""

PART = 0.2
"""Of the way, which other forms go."""

PEAKS = {"Fx": 17.280, "Fy": 39.005}
FORCES = {5.54: 12.71, 10.60: 19.49, 15.00: 24.34, 20.04: 31.26, 22.79: 36.54, 24.38: 39.00, 27.52: 23.97}
"""Published peaks, and Fy by travel."""


def half_ring(radii: tuple[float, float], x: float, y: float, n: int, *, up: bool) -> Mesh:
    """Half a ring with its ends at the height ``y`` and the middle of them at ``x``: an arch, or a cup.

    ``n`` elements around, n/10 through the thickness; its ends are ``base`` and ``top``, ``right`` is outside.
    """
    inner, outer = radii

    def around(s: Floats, turn: Floats) -> tuple[Floats, Floats]:
        angle = np.pi * (turn if up else turn + 1)
        r = inner + s
        return x + r * np.cos(angle), y + r * np.sin(angle)

    return mapped(block(outer - inner, 1.0, n // 10, n), around)


def beams(n: int) -> Scene:
    """Both beams with ``n`` elements around, at rest in touch."""
    aside = 12.0 - float(np.sqrt((LOW[1] + HIGH[1]) ** 2 - HEIGHT**2))
    parts = {
        "low": half_ring(LOW, 12.0, 0.0, n, up=True),
        "high": half_ring(HIGH, aside, HEIGHT, n, up=False),
    }
    ends = ("base", "top")
    return Scene(
        mesh=together(parts),
        geometry=Geometry.PLANE_STRAIN,
        material=MATERIAL,
        supports=(
            *(Support(f"low/{end}", axis) for end in ends for axis in range(2)),
            *(Support(f"high/{end}", 1) for end in ends),
            *(Prescribed(f"high/{end}", 0, TRAVEL) for end in ends),
        ),
        tools=(DeformableTool(("low/right",), ("high/right",), MU),),
    )


def run(n: int, watch: Watch) -> list[float]:
    """Peaks of the forces (in magnitude) at the moved ends, and the vertical one along the way."""
    scene = beams(n)
    ends = scene.mesh.boundary_nodes("high/base", "high/top")
    found = [(0.0, 0.0, 0.0)]
    for accepted in watch.march(scene, Schedule(INCREMENTS)):
        along, up = np.abs(accepted.reactions[ends].sum(axis=0)).tolist()
        found.append((TRAVEL * accepted.state.tau, along, up))
    travel, along, up = np.array(found).T
    return [float(along.max()), float(up.max()), *np.interp(list(FORCES), travel, up).tolist()]


def beside(n: int, watch: Watch) -> list[float]:
    """The part of the way that other forms go, too."""
    for accepted in watch.march(beams(n), Schedule(INCREMENTS)):
        if accepted.state.tau >= PART:
            break
    return []


CASE = Case(
    name="curved_beams",
    subject=Subject.TWO_BODIES,
    source=(
        "published: Neto, Oliveira and Menezes 2016; geometry and curve of the verification cases of solids4foam, "
        "digitised to about 1 %"
    ),
    purpose="Elastoplastic bodies in large deformation that slide over each other with friction, touch and part.",
    setup=(
        "Plane strain, thickness 1, E = 689.56, nu = 0.32, sigma_Y = 31, linear hardening 261.2, mu = 0.3, Q4 "
        "with the mean of its volume change. The lower beam is an arch, half a ring with radii 10 and 12, the "
        "middle of its held ends at (12, 0). The upper one is a cup with radii 8 and 10, the middle of its ends "
        "at (-1.9642, 17), where it touches the lower one; they move by 31.5 along x at their height, in 63 equal"
        " increments. n elements are around each beam and n/10 through it: the finest mesh, and the increments, "
        "are those of solids4foam's case. Forces are the reactions of the moved ends; between increments Fy is "
        "linear. 1 % is allowed for the curve, as read, and half of that for the rest."
    ),
    asked=(
        *(Asked(f"largest {name}", value, 0.015) for name, value in PEAKS.items()),
        *(Asked(f"Fy at {travel:g}", value, 0.015) for travel, value in FORCES.items()),
    ),
    counted="elements around",
    meshes=(20, 50),
    run=run,
    beside=beside,
    note=(
        "The published forces have the error of their mesh in them. With 96 elements around and 8 through the "
        "thickness, and 252 increments, forces are 1.2 to 3.3 % below them. Increments matter less: with twice, "
        "and four times, as many of them on the finest mesh, Fy at the ends of the 63 changes by less than 0.12 "
        "%. Other forms go the first fifth of the way. Beyond it slender beams make more of what the bounds of a "
        "certificate allow, up to 3e-4 of the force on the coarsest mesh; with bounds of 1e-11, forms agree to "
        "4e-8 as far as was tried, a third of the way."
    ),
)
