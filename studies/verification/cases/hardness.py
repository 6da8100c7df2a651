"""Hardness: a sphere pressed into perfect plasticity."""

from __future__ import annotations

import numpy as np

from bipot import (
    Circle,
    Elasticity,
    Element,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    VonMises,
)
from studies.element_scenes import tensor
from studies.verification.case import Asked, Case, Sense, Subject, Watch
from studies.verification.indentation import along, lines

RADIUS, FAR, DEPTH = 5.0, 10.0, 0.07
YOUNG = 1000.0
"""Over the yield stress, which is one."""

FULLY = 0.5
"""Part of the travel after which E a/(sigma_Y R) is above 100."""


def dented(n: int) -> Scene:
    """The block under the sphere, n equal elements along the surface to 1.4."""
    x, y = lines(1.4, n, FAR), FAR - lines(0.7, n // 2, FAR)[::-1]
    return Scene(
        mesh=tensor(x, y, Element.Q4),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(YOUNG, 0.3), Perfect(1.0)),
        supports=(Support("base", 0), Support("base", 1), Support("left", 0)),
        tools=(ShapedTool(Circle((0.0, FAR + RADIUS), RADIUS), (0.0, -DEPTH), ("top",), 0.0),),
    )


def run(n: int, watch: Watch) -> list[float]:
    """The mean pressure, in the mean of the increments that are fully plastic, twice."""
    found = list[float]()
    for accepted in watch.march(dented(n), Schedule(n)):
        if accepted.state.tau > FULLY:
            x, _, r = along(accepted)
            edge = int(np.flatnonzero(r[:, 0] > 0).max())
            found.append(float(-accepted.tool_force(0)[1] / (np.pi * x[edge : edge + 2].mean() ** 2)))
    return 2 * [float(np.mean(found))]


CASE = Case(
    name="hardness",
    subject=Subject.TOOLS,
    source="published trend: Tabor; fully plastic, E a/(sigma_Y R) >= 100",
    purpose="Plastic flow under a curved tool in large deformation, with pile-up at the rim.",
    setup=(
        "A rigid sphere, R = 5, is pressed by 0.07 into an axisymmetric block 10 wide and deep; E = 1000 sigma_Y, nu"
        " = 0.3, perfect plasticity, no friction, Q4 with the mean of its volume change, n increments; a/R = 0.19 "
        "and E a/(sigma_Y R) = 190 at the end. The mean pressure is F/(pi a^2), with a halfway between the last node"
        " that carries force and the next. It is averaged over the second half of the travel, because one node "
        "changes the area by 8 % on the finest mesh."
    ),
    asked=(
        Asked("p/sigma_Y, lower end", 2.7, 0.0, Sense.AT_LEAST),
        Asked("p/sigma_Y, upper end", 3.1, 0.0, Sense.AT_MOST),
    ),
    counted="equal elements to 1.4",
    meshes=(8, 16, 32),
    run=run,
)
