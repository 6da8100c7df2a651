"""Limit load of a half-plane under a strip punch (Prandtl)."""

from __future__ import annotations

from studies.verification.case import Case, Subject
from studies.verification.limit_loads import asked, runner

NAMES = {f"punch {kind}": f"p/k, {kind}" for kind in ("smooth", "rough")}

CASE = Case(
    name="strip_punch",
    subject=Subject.LIMITS,
    source="closed form: p/k = 2 + pi (Prandtl, Hill)",
    purpose=("A limit load with a singular point at the end of the punch; it is the same with and without friction."),
    setup=(
        "Plane strain, rigid-perfectly plastic with shear strength k, a punch of half-width one on a body large "
        "enough for the mechanism: half of it, 4 wide and 2 deep, uniform. T6 and T3 as in `rough_platens`."
    ),
    asked=asked(NAMES, 0.01),
    counted="elements along the punch's half-width",
    meshes=(4, 8, 16),
    run=runner(tuple(NAMES)),
    marched=False,
)
