"""Limit load of a strip with circular notches."""

from __future__ import annotations

import numpy as np

from studies.element_types import ElementType
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.limit_loads import value

TYPES = (ElementType.T6, ElementType.Q9P1)


def run(n: int, watch: Watch) -> list[float]:
    """sigma_net/2k by each type."""
    return [value("notch", kind, n) for kind in TYPES]


CASE = Case(
    name="notched_strip",
    subject=Subject.LIMITS,
    source="closed form: sigma_net/2k = (1 + rho/b) ln(1 + b/rho), b/rho < 3.81 (Hill)",
    purpose="A limit load with curved boundaries and distorted elements.",
    setup=(
        "Plane strain, rigid-perfectly plastic, ligament 2 b = 2, notches of radius rho = 1, compressed by rigid "
        "heads (the limit load is that of tension); a quarter, of n by 2 n quadrilaterals or these halved into "
        "triangles."
    ),
    asked=tuple(Asked(f"sigma_net/2k, {kind.name}", 2 * float(np.log(2)), 0.01) for kind in TYPES),
    counted="elements from the notch to the middle",
    meshes=(4, 8, 16),
    run=run,
    marched=False,
)
