"""Upsetting under Coulomb friction between what is proved of its force, and beside the slab's."""

from __future__ import annotations

from bipot import Element, Schedule, VolumeChange, upsetting
from studies.closed_forms import PAPER
from studies.verification.case import Asked, Case, Sense, Subject, Watch

REDUCTION = 0.45
FIRST = 0.001
"""First increments as a fraction of the height."""


def run(elements: int, watch: Watch) -> list[float]:
    """Forces at mu = 0.1, three times, and at mu = 0.3, as often."""
    out = list[float]()
    for mu in (0.1, 0.3):
        kind = {"element": Element.Q4, "volume": VolumeChange.P0}
        scene = upsetting(mu=mu, reduction=REDUCTION, elements=elements, **kind)
        last = watch.end(scene, Schedule(90, first=FIRST / REDUCTION))
        out += 3 * [float(-last.tool_force(0)[1])]
    return out


def bracket(mu: float) -> tuple[Asked, Asked]:
    """What no friction and full sticking leave."""
    return (
        Asked(f"mu = {mu:g}: F, frictionless", float(PAPER.exact_force(REDUCTION)), 0.0, Sense.AT_LEAST),
        Asked(f"mu = {mu:g}: F, sticking cylinder", float(PAPER.sticking_bound(REDUCTION)), 0.0, Sense.AT_MOST),
    )


CASE = Case(
    name="upsetting_bracket",
    subject=Subject.UPSETTING,
    source="derived: frictionless force, upper bound of the sticking cylinder, slab with Coulomb slip",
    purpose=(
        "With friction there is no closed solution, but there are bounds: the frictionless force from below, and "
        "from above the power of a sticking body that remains a cylinder. The slab theory is accurate where "
        "everything slips (mu = 0.1) and too high where the cylinder barrels (mu = 0.3)."
    ),
    setup=(
        "The cylinder of `upsetting_exact` to 45 %, Q4 with the mean of its volume change, 90 increments after a "
        "start-up. Full sticking: p/sigma_Y = 1 + 2 R/(3 sqrt3 h); slab: p/sigma_Y = 2 (e^x - 1 - x)/x^2, x = 2 mu "
        "R/h. The bounds are those for the cylindrical shape."
    ),
    asked=(
        *bracket(0.1),
        Asked("mu = 0.1: F, slab", float(PAPER.slab_force(REDUCTION, 0.1)), 0.05),
        *bracket(0.3),
        Asked("mu = 0.3: F, slab", float(PAPER.slab_force(REDUCTION, 0.3)), 0.0, Sense.AT_MOST),
    ),
    counted="elements along the radius",
    meshes=(10, 20, 40),
    run=run,
    note=(
        "The limits of refined meshes, with error bands, are on [the page on elements](elements.md). They too are "
        "below the slab at mu = 0.1, where the cylinder barrels a little."
    ),
)
