"""Unknowns of an element for each volume change that it holds."""

from __future__ import annotations

from bipot import Element, Geometry, Perfect, Quadrature, Scene, Support, VolumeChange, VonMises, block
from bipot.laws.von_mises import Elasticity
from studies.element_limits import unknowns_per_constraint
from studies.verification.case import Asked, Case, Subject, Watch

COUNTS = {
    (Geometry.PLANE_STRAIN, Quadrature.GAUSS2): 3 / 2,
    (Geometry.PLANE_STRAIN, Quadrature.RADON7): 1.0,
    (Geometry.PLANE_STRAIN, Quadrature.GAUSS3): 1.0,
    (Geometry.AXISYMMETRIC, Quadrature.GAUSS2): 3 / 2,
    (Geometry.AXISYMMETRIC, Quadrature.RADON7): 6 / 7,
    (Geometry.AXISYMMETRIC, Quadrature.GAUSS3): 3 / 4,
}


def run(elements: int, watch: Watch) -> list[float]:
    """The counts, of an element in the middle of a mesh."""
    material = VonMises(Elasticity(1000.0, 0.3), Perfect(1.0))
    mesh, held = block(1.0, 1.0, elements, elements, element=Element.Q8), (Support("left", 0), Support("base", 1))
    scenes = (Scene(mesh, of, material, held, quadrature=rule, volume=VolumeChange.AS_IS) for of, rule in COUNTS)
    return [unknowns_per_constraint(scene) for scene in scenes]


CASE = Case(
    name="volume_constraints",
    subject=Subject.ELEMENTS,
    source="derived: six unknowns of Q8 in a large mesh over the rank of its volume changes",
    purpose=(
        "Where flow preserves the volume, an element needs about two unknowns per constraint. Q8 with seven points "
        "has 0.857 in axisymmetry; it is kept only to reproduce the paper."
    ),
    setup=("The rank of the volume changes at the points of one unprojected Q8, for each of its rules."),
    asked=tuple(
        Asked(f"{of.name.lower()}, {rule.value}".replace("_", " "), n, 1e-12) for (of, rule), n in COUNTS.items()
    ),
    counted="elements a side",
    meshes=(3,),
    run=run,
    marched=False,
)
