"""The volume that the geometry update keeps in frictionless upsetting, against what it must lose."""

from __future__ import annotations

import numpy as np

from bipot import Accepted, Configuration, Schedule, upsetting
from studies.verification.case import Asked, Case, Subject, Watch

REDUCTION = 0.45
STIFF = 3e9
"""Young's modulus over which the yield stress is 1e-7: nearly rigid-plastic."""


def paper(increments: int) -> float:
    """V/V0 where strain is that of B on the start of each increment: height falls by e, radius grows by e/2."""
    e = fractions(increments)
    return float(np.prod((1 - e) * (1 + e / 2) ** 2))


def midpoint(increments: int) -> float:
    """The same of B on its middle: strain e/(1 - e/2) along the axis, half of it along the radius."""
    e = fractions(increments)
    half = e / (1 - e / 2) / 4
    return float(np.prod((1 - e) * ((1 + half) / (1 - half)) ** 2))


def fractions(increments: int) -> np.ndarray:
    """By what part of its height at the start each increment upsets."""
    heights = np.linspace(1.0, 1 - REDUCTION, increments + 1)
    return -np.diff(heights) / heights[:-1]


def kept(accepted: Accepted) -> float:
    """Volume of the cylinder over that at rest."""
    rest, now = (
        np.ptp(nodes, axis=0) for nodes in (accepted.state.nodes - accepted.displacement, accepted.state.nodes)
    )
    return float((now[0] / rest[0]) ** 2 * now[1] / rest[1])


def run(increments: int, watch: Watch) -> list[float]:
    """V/V0 by both configurations."""
    out = []
    for configuration in (Configuration.PAPER, Configuration.MIDPOINT):
        scene = upsetting(mu=0.0, reduction=REDUCTION, elements=1, young=STIFF, configuration=configuration)
        out.append(kept(watch.end(scene, Schedule(increments))))
    return out


CASE = Case(
    name="volume_kept",
    subject=Subject.UPSETTING,
    source="closed form: what equal steps of a linear strain make of a volume",
    purpose=(
        "Plastic flow preserves the volume, but an increment of displacement with a linear strain does not. On the "
        "configuration at its start it loses 3 e^2/4 a step (e: the fraction of the height), on the middle "
        "configuration e^3/16. The update must lose exactly this."
    ),
    setup=(
        "The cylinder of `upsetting_exact` with E = 3e9 MPa, to 45 % in equal increments, one Q8, by"
        " `Configuration.PAPER` and `Configuration.MIDPOINT`."
    ),
    asked=(Asked("V/V0, start of the increment", paper, 1e-6), Asked("V/V0, middle of the increment", midpoint, 1e-6)),
    counted="increments",
    meshes=(5, 10, 45, 450),
    run=run,
)
