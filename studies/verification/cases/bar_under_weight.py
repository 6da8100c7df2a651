"""A bar that hangs under its own weight."""

from __future__ import annotations

from bipot import (
    BodyForce,
    Configuration,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    Scene,
    Schedule,
    Support,
    block,
)
from studies.verification.case import Asked, Case, Subject, Watch

LENGTH, YOUNG, WEIGHT = 4.0, 1e6, 1.0


def run(elements: int, watch: Watch) -> list[float]:
    """How far its end comes down."""
    scene = Scene(
        mesh=block(1.0, LENGTH, 1, elements, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(Elasticity(YOUNG, 0.0)),
        supports=(Support("top", 1), Support("left", 0)),
        loads=(BodyForce((0.0, -WEIGHT)),),
        configuration=Configuration.SMALL,
    )
    end = watch.end(scene, Schedule(1))
    return [float(-end.displacement[scene.mesh.boundary_nodes("base"), 1].mean())]


CASE = Case(
    name="bar_under_weight",
    subject=Subject.MATERIAL,
    source="closed form: rho g L^2/(2 E)",
    purpose="A body force, for which quadratic elements contain the exact solution.",
    setup="A bar of length 4 on rollers at its top, E = 10^6, nu = 0, rho g = 1, small strain, one increment; Q8.",
    asked=(Asked("end displacement", WEIGHT * LENGTH**2 / (2 * YOUNG), 1e-9),),
    counted="elements along the bar",
    meshes=(1, 2, 4),
    run=run,
)
