"""Limit load of a block between rough parallel platens, against the slip lines."""

from __future__ import annotations

from studies.verification.case import Case, Subject
from studies.verification.limit_loads import asked, runner

NAMES = {f"block {ratio}": f"p/k, w/h = {ratio}" for ratio in (1, 2, 4)}

CASE = Case(
    name="rough_platens",
    subject=Subject.LIMITS,
    source="closed form: slip lines of a block between rough parallel platens",
    purpose="The limit load of a body that sticks to its tools, by the kinematic program of `bipot.limit_load`.",
    setup=(
        "Plane strain, rigid-perfectly plastic with shear strength k, platens of width w on a block of the same "
        "width and height h, full sticking; a quarter, uniform. T6 with the mean of its volume change is nearly "
        "exact. T3 has constant strain and preserves the volume everywhere, so its value is a strict upper bound of "
        "the limit load."
    ),
    asked=asked(NAMES, 0.01),
    counted="elements along half the height",
    meshes=(4, 8, 16),
    run=runner(tuple(NAMES)),
    marched=False,
    note="Other elements, refined meshes and extrapolated values are on [the page on elements](elements.md).",
)
