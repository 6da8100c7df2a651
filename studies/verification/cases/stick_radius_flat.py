"""Spence's stick radius under flat punches, by friction."""

from __future__ import annotations

from functools import partial

import numpy as np

from bipot import (
    Configuration,
    Elastic,
    Element,
    FlatTool,
    Geometry,
    Mesh,
    Scene,
    Schedule,
    Support,
    Symmetry,
)
from studies.element_scenes import tensor
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.cases.stick_radius import BETA, ELASTIC
from studies.verification.indentation import FAR, NEAR, along, lines, stick_radius

RATIOS = {
    Geometry.PLANE_STRAIN: {0.5: 3 - 2 * float(np.sqrt(2)), 1.0: float(np.sqrt(0.5)), 1.5: 0.930648},
    Geometry.AXISYMMETRIC: {0.5: 0.4851, 1.0: 0.9038, 1.5: 0.9814},
}
"""c/a by mu/beta."""

WORDS = {Geometry.PLANE_STRAIN: "strip", Geometry.AXISYMMETRIC: "disc"}


def pressed(geometry: Geometry, mu: float, n: int, far: float = FAR) -> Scene:
    """The block under a punch of half-width one, n elements of the surface under it."""
    mesh = tensor(lines(1.0, n, far), far - lines(0.25, n // 4, far)[::-1], Element.Q4)
    top = mesh.boundary("top")
    under = top[(mesh.nodes[top, 0] <= 1 + 1e-9).all(axis=1)]
    left = Support("left", 0) if geometry is Geometry.AXISYMMETRIC else Symmetry("left", 0)
    return Scene(
        mesh=Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "under": under}),
        geometry=geometry,
        material=Elastic(ELASTIC),
        supports=(Support("base", 0), Support("base", 1), left),
        tools=(FlatTool((0.0, far), (0.0, -1.0), (0.0, -1e-3), ("under",), mu),),
        configuration=Configuration.SMALL,
    )


def run(n: int, watch: Watch, far: float = FAR) -> list[float]:
    """c/a of strip and disc, by friction."""
    out = list[float]()
    for geometry, known in RATIOS.items():
        for ratio in known:
            x, _, r = along(watch.end(pressed(geometry, ratio * BETA, n, far), Schedule(1)))
            out.append(stick_radius(x, r, ratio * BETA))
    return out


CASE = Case(
    name="stick_radius_flat",
    subject=Subject.ELASTIC_CONTACT,
    source="closed form (Spence; Galin), pressure without the coupling by shear",
    purpose=("Stick and slip side by side in a given contact area: one increment, at three coefficients."),
    setup=(
        "The block and the law of `stick_radius` under a flat strip and a flat disc of half-width a = 1, mu/beta = "
        "0.5, 1 and 1.5, one increment. The pressure is singular at the edge. c is halfway between the last node "
        "that sticks and the next. Other forms are run on a block ten times smaller."
    ),
    asked=tuple(
        Asked(f"c/a, {WORDS[geometry]}, mu/beta = {ratio:g}", exact, 0.05)
        for geometry, known in RATIOS.items()
        for ratio, exact in known.items()
    ),
    counted="equal elements to the edge",
    meshes=(16, 32, 64),
    run=run,
    beside=partial(run, far=NEAR),
    note=(
        "c is known to half an element, which on the finest mesh is 4.6 % of the smallest c. Its error therefore "
        "only shows that the right node was found."
    ),
)
