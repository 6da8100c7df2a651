"""Torsion of a pressed disc: the direction of slip turns around the axis, and the moment is two thirds of mu N R."""

from __future__ import annotations

import numpy as np

from bipot import (
    Amplitude,
    Elastic,
    Elasticity,
    Geometry,
    Plane,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Turn,
    cylinder_3d,
)
from studies.verification.case import Asked, Case, Subject, Watch

RADIUS, HEIGHT, MU = 1.0, 0.25, 0.1
YOUNG, SINK = 1000.0, 0.002
"""Without Poisson's ratio the pressure is the same everywhere, YOUNG SINK / HEIGHT."""

PRESSED, ANGLE = 0.1, 0.004
"""The disc is pressed until this pseudo-time, then twisted by the angle (radians)."""

STICKS = 2e-4
"""Half the angle at which the rim begins to slip, MU (YOUNG SINK / HEIGHT) HEIGHT / (G RADIUS) = 4e-4."""

STUCK = 0.1
"""Radius over RADIUS inside of which the disc still sticks at the end, 4e-4 / ANGLE."""


def twisted(n: int) -> Scene:
    """The disc, held below, with 8 n segments around, n rings around a square of n x n in a quarter, n / 2 layers."""
    top = (0.0, 0.0, HEIGHT)
    lid = ShapedTool(
        Plane(top, (0.0, 0.0, -1.0)),
        (0.0, 0.0, -SINK),
        ("top",),
        MU,
        path=((0.0, 0.0), (PRESSED, 1.0), (1.0, 1.0)),
        turn=Turn(ANGLE, top, Amplitude(((0.0, 0.0), (PRESSED, 0.0), (1.0, 1.0))), axis=(0.0, 0.0, 1.0)),
    )
    return Scene(
        mesh=cylinder_3d(RADIUS, HEIGHT, n, n, max(1, n // 2), quarter=False),
        geometry=Geometry.SOLID,
        material=Elastic(Elasticity(YOUNG, 0.0)),
        supports=tuple(Support("base", d) for d in range(3)),
        tools=(lid,),
    )


def run(n: int, watch: Watch) -> list[float]:
    """Stiffness while all sticks, moment and friction across the circles where all but the middle slips."""
    scene = twisted(n)
    sticking = PRESSED + (1 - PRESSED) * STICKS / ANGLE
    *steps, last = watch.march(scene, Schedule(20, landings=(PRESSED, sticking)))
    stuck = next(accepted for accepted in steps if accepted.state.tau == sticking)
    stiffness = stuck.tool_moment(0) / (YOUNG / 2 * np.pi / 2 * RADIUS**4 * STICKS / HEIGHT)
    contacts, r = last.solved.iterate.increment.system.candidates, last.solved.r
    x, force = last.state.nodes[contacts.node, :2], contacts.vectors(r, last.solved.iterate.frames)
    far = np.linalg.norm(x, axis=1)
    slips = far > 2 * STUCK
    across = np.abs(np.vecdot(force[slips, :2], x[slips]) / far[slips]) / (MU * r[slips, 0])
    return [stiffness, last.tool_moment(0) / (MU * float(r[:, 0].sum()) * RADIUS), float(across.max())]


CASE = Case(
    name="torsion",
    subject=Subject.TOOLS,
    source="derived: torsion of a round bar, Coulomb's law around an axis",
    purpose=("A plane that turns about its normal: slip with two tangents, whose direction changes over the disc."),
    setup=(
        "An elastic disc, R = 1, h = R/4, nu = 0, held at its base, is pressed by a plane to the uniform pressure "
        "E/125 and twisted by it about its axis, mu = 0.1; the whole disc of H8, 8 n of them around it. The values "
        "are the stiffness at half the angle at which the rim would slip, over G pi R^4 / (2 h); at ten times that "
        "angle the moment over mu N R; and, outside of R/5, the largest friction across the circles around the axis "
        "over mu times pressure."
    ),
    asked=(
        Asked("stiffness over that of a bar", 1.0, 0.01),
        Asked("moment over mu N R", 2 / 3 * (1 - STUCK**3 / 4), 0.005),
        Asked("friction across the circles", 0.0, 0.02),
    ),
    counted="elements along the square's side",
    meshes=(2, 4, 8),
    run=run,
)
