"""Cook's membrane, elastic."""

from __future__ import annotations

from studies.element_scenes import Choice
from studies.element_types import ElementType
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.limit_loads import PROBLEM

COOK = PROBLEM["cook compressible"]
TYPES = {ElementType.Q4P0: 0.01, ElementType.Q8P1: 0.001, ElementType.Q9P1: 0.001, ElementType.T6: 0.001}
"""What the published digits (23.96) and the order of the element allow."""


def run(n: int, watch: Watch) -> list[float]:
    """The deflection by each type."""
    scenes = (COOK.uniform(Choice(kind, kind.quadrature), n) for kind in TYPES)
    return [COOK.value(scene) for scene in scenes]


CASE = Case(
    name="cook_membrane",
    subject=Subject.MATERIAL,
    source="published: plane stress, E = 1, nu = 1/3, F = 1 (Cook; 23.96)",
    purpose="Bending and shear of distorted elements near a singular corner.",
    setup=(
        "Corners (0, 0), (48, 44), (48, 60), (0, 44), clamped on the left, a shear force of one on the right. The "
        "value is the deflection of the middle of the right side. In its plane, plane stress equals plane strain "
        "with E = 15/16 and nu = 1/4."
    ),
    asked=tuple(Asked(f"u_y, {kind.name}", COOK.exact, allowed) for kind, allowed in TYPES.items()),
    counted="elements a side",
    meshes=(8, 16, 32),
    run=run,
    marched=False,
)
