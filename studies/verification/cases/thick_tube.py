"""A thick tube under inner pressure: displacements while the plastic front advances, and the limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot import (
    Configuration,
    Elasticity,
    Element,
    Geometry,
    IncrementFailed,
    Perfect,
    Prescribed,
    Pressure,
    Quadrature,
    Scene,
    Schedule,
    Support,
    VonMises,
    ring,
)
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.tubes import pressure_on

INNER, OUTER, YIELD = 100.0, 200.0, 240.0
LIMIT = 2 * YIELD / np.sqrt(3) * np.log(OUTER / INNER)
FRONTS = {140: (163.914, 0.117687), 160: (180.134, 0.153714)}
"""Pressure and outer displacement by the radius of the plastic front."""

BELOW, ABOVE = 0.995, 1.005
SCHEDULE = Schedule(10)


def tube(elements: int) -> Scene:
    """A slice of it; 2 x 2 points, because seven are too many for flow without change of volume."""
    return Scene(
        mesh=ring(INNER, OUTER, 10.0, elements, 1, element=Element.Q8),
        geometry=Geometry.AXISYMMETRIC,
        material=VonMises(Elasticity(210_000.0, 0.3), Perfect(YIELD)),
        supports=(Support("base", 1), Support("top", 1)),
        quadrature=Quadrature.GAUSS2,
        configuration=Configuration.SMALL,
    )


def carries(scene: Scene, pressure: float, watch: Watch) -> bool:
    """Whether the tube carries a pressure."""
    try:
        watch.end(replace(scene, loads=(Pressure("bore", pressure),)), SCHEDULE)
    except IncrementFailed:
        return False
    return True


def run(elements: int, watch: Watch) -> list[float]:
    """Outer displacements by fronts, the limit by displacement, and whether pressures around it are carried."""
    scene, out = tube(elements), list[float]()
    side = scene.mesh.boundary_nodes("side")
    for pressure, _ in FRONTS.values():
        end = watch.end(replace(scene, loads=(Pressure("bore", pressure),)), SCHEDULE)
        out.append(float(end.displacement[side, 0].mean()))
    driven = replace(scene, supports=(*scene.supports, Prescribed("bore", 0, 1.0)))
    out.append(pressure_on(watch.end(driven, SCHEDULE), "bore"))
    return [*out, *(float(carries(scene, share * LIMIT, watch)) for share in (BELOW, ABOVE))]


CASE = Case(
    name="thick_tube",
    subject=Subject.MATERIAL,
    source="closed form: Tresca's solution with 2k = 2 sigma_Y/sqrt3; the limit 2k ln(b/a) is exact",
    purpose=(
        "Elastoplastic flow around a plastic front, and a limit load: slightly smaller loads are carried, slightly "
        "larger ones refused."
    ),
    setup=(
        "Plane strain, a = 100, b = 200, E = 210000, nu = 0.3, sigma_Y = 240, perfect plasticity, small strain; Q8 "
        "with 2 x 2 points, ten increments. The values are the displacement of the outer surface at the pressures "
        "that bring the front to c = 140 and 160 (of Tresca's solution, within 1 % of von Mises'), the pressure of a"
        " bore that is driven outwards by one, and whether a pressure is carried (1 if it is)."
    ),
    asked=(
        *(Asked(f"u(b), front at {front}", moved, 0.01) for front, (_, moved) in FRONTS.items()),
        Asked("limit, bore driven", float(LIMIT), 0.005),
        Asked(f"{BELOW} of the limit is carried", 1.0, 0.0),
        Asked(f"{ABOVE} of the limit is carried", 0.0, 0.0),
    ),
    counted="elements through the wall",
    meshes=(5, 10, 20),
    run=run,
)
