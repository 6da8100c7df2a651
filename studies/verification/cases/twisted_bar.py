"""A round bar that is twisted past first yield and turned back, until an exact bar carries no moment."""

from __future__ import annotations

import numpy as np

from bipot import (
    Amplitude,
    Configuration,
    Elasticity,
    Geometry,
    Perfect,
    Plane,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Turn,
    VonMises,
    cylinder_3d,
)
from studies.verification.case import Asked, Case, Subject, Watch

RADIUS, HEIGHT = 1.0, 0.5
YOUNG, POISSON, YIELD = 1000.0, 0.3, 1.0

SHEAR, STRENGTH = YOUNG / (2 * (1 + POISSON)), YIELD / np.sqrt(3)
TIMES = 3.0
"""The angle over that of first yield; the radius over that of the elastic core."""

ANGLE = TIMES * STRENGTH * HEIGHT / (SHEAR * RADIUS)
MOMENT = 2 * np.pi / 3 * STRENGTH * RADIUS**3 * (1 - 1 / (4 * TIMES**3))
BACK = MOMENT * HEIGHT / (SHEAR * np.pi / 2 * RADIUS**4)
"""By which an elastic bar turns back."""

TURNED = 0.6
"""Pseudo-time of the largest angle."""


def twisted(n: int) -> Scene:
    """The bar, held at its base, with 8 n segments around as in `torsion`, welded to a plane that turns."""
    top = (0.0, 0.0, HEIGHT)
    turns = Amplitude(((0.0, 0.0), (TURNED, 1.0), (1.0, 1 - BACK / ANGLE)))
    lid = ShapedTool(
        Plane(top, (0.0, 0.0, -1.0)),
        (0.0, 0.0, 0.0),
        ("top",),
        np.inf,
        turn=Turn(ANGLE, top, turns, axis=(0.0, 0.0, 1.0)),
    )
    return Scene(
        mesh=cylinder_3d(RADIUS, HEIGHT, n, n, max(1, n // 2), quarter=False),
        geometry=Geometry.SOLID,
        material=VonMises(Elasticity(YOUNG, POISSON), Perfect(YIELD)),
        supports=tuple(Support("base", d) for d in range(3)),
        tools=(lid,),
        configuration=Configuration.SMALL,
    )


def run(n: int, watch: Watch) -> list[float]:
    """The moments at the largest angle and at the end, over the exact one at the largest."""
    steps = watch.march(twisted(n), Schedule(20, landings=(TURNED,)))
    return [step.tool_moment(0) / MOMENT for step in steps if step.state.tau in (TURNED, 1.0)]


CASE = Case(
    name="twisted_bar",
    subject=Subject.MATERIAL,
    source="closed form: shear stress k outside of an elastic core (Nadai), less the elastic solution",
    purpose="Plastic flow in shear and its unloading in space; a tool that is welded to the body and turns.",
    setup=(
        "A round bar, R = 1, h = R/2, E = 1000 sigma_Y, nu = 0.3, perfect plasticity, small strain, held at its base "
        "and welded to a plane that turns it to three times the angle of first yield, and back by what an elastic bar "
        "turns under the moment; the whole bar of H8 with the mean of its volume change, 8 n of them around it, "
        "straight between nodes. M = 2/3 pi k R^3 (1 - c^3/(4 R^3)) with the core's radius c = R/3 and "
        "k = sigma_Y/sqrt3. The values are the moments at the largest angle and at the end, over M."
    ),
    asked=(
        Asked("moment at the largest angle", 1.0, 0.005),
        Asked("moment at the end", 0.0, 0.005),
    ),
    counted="elements along the square's side",
    meshes=(2, 4, 8),
    run=run,
)
