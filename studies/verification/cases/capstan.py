"""The capstan: a strip around a cylinder, pulled until all of it slips."""

from __future__ import annotations

import numpy as np

from bipot import (
    Amplitude,
    Circle,
    Configuration,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    Mesh,
    Prescribed,
    Scene,
    Schedule,
    ShapedTool,
    Traction,
    block,
)
from studies.verification.case import Asked, Case, Subject, Watch

RADIUS, THICKNESS, MU = 1.0, 0.005, 0.3
YOUNG, HOLD = 1e6, 0.05
"""The hold-back is a force per width, and strains the strip by 1e-5, so the cylinder's normals stay."""

ANGLES = {90: 0, 180: 1}
"""Wraps in degrees, and the direction along which their ends are pulled."""

HELD = 0.2
"""Pseudo-time until which the hold-back rises; then the other end is pulled."""


def around(degrees: int, n: int) -> Mesh:
    """The strip from the cylinder's left side on over its top, ``n`` elements to a right angle."""
    straight = block(np.radians(degrees), THICKNESS, n * degrees // 90, 1, element=Element.Q8)
    angle, r = np.pi - straight.nodes[:, 0], RADIUS + straight.nodes[:, 1]
    return Mesh(np.column_stack([r * np.cos(angle), r * np.sin(angle)]), straight.elements, straight.boundaries)


def wound(degrees: int, n: int) -> Scene:
    """It is held back down on the left, and then drawn off, by twice what all of its slip takes."""
    across = ANGLES[degrees]
    full = np.radians(degrees) * RADIUS * HOLD * np.exp(MU * np.radians(degrees)) / (YOUNG * THICKNESS)
    later = Amplitude(((0.0, 0.0), (HELD, 0.0), (1.0, 1.0)))
    hold = Amplitude(((0.0, 0.0), (HELD, 1.0), (1.0, 1.0)))
    return Scene(
        mesh=around(degrees, n),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(Elasticity(YOUNG, 0.0)),
        supports=(Prescribed("right", across, 2 * full * (1 - 2 * across), later),),
        tools=(ShapedTool(Circle((0.0, 0.0), RADIUS), (0.0, 0.0), ("base",), MU),),
        loads=(Traction("left", (0.0, -HOLD / THICKNESS), hold),),
        configuration=Configuration.SMALL,
    )


def run(n: int, watch: Watch) -> list[float]:
    """The pulls that balance the cylinder's forces and the hold-back, over the hold-back."""
    found = list[float]()
    for degrees, across in ANGLES.items():
        x, y = watch.end(wound(degrees, n), Schedule(10)).tool_force(0)
        found.append(float(-x if across == 0 else y - HOLD) / HOLD)
    return found


CASE = Case(
    name="capstan",
    subject=Subject.TOOLS,
    source="closed form (Euler, Eytelwein), exp(mu theta)",
    purpose=("Friction that accumulates along a curved tool whose normals turn by up to 180 degrees."),
    setup=(
        "An elastic strip, t/R = 0.005, nu = 0, in one layer of Q8, lies around a fixed cylinder; plane strain, "
        "small strain, mu = 0.3. A traction that strains it by 1e-5 holds one end back. The other end is then drawn "
        "off along its tangent, by twice the displacement at which the whole strip slips. T2/T1 is found from the "
        "hold-back and the cylinder's force."
    ),
    asked=tuple(
        Asked(f"T2/T1, {degrees} degrees", float(np.exp(MU * np.radians(degrees))), 0.01) for degrees in ANGLES
    ),
    counted="elements to a right angle",
    meshes=(8, 16, 32),
    run=run,
    note=(
        "The line of the pull is the middle of the strip, half a thickness farther from the centre than the "
        "friction. For a strip without bending T2/T1 is therefore exp(mu theta/(1 + t/(2 R))), which is 0.12 and "
        "0.23 % lower."
    ),
)
