"""A block between platens on which it slips, against the slab."""

from __future__ import annotations

import numpy as np

from bipot import (
    Configuration,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    Symmetry,
    VonMises,
    block,
)
from studies.verification.case import Asked, Case, Subject, Watch

PAIRS = ((4, 0.05), (4, 0.10), (8, 0.05), (8, 0.10))
"""Widths over heights, and coefficients."""


def slab(ratio: float, mu: float) -> float:
    """Mean p/2k where all slips."""
    y = mu * ratio
    return float(np.expm1(y) / y)


def pressed(ratio: float, mu: float, n: int) -> Scene:
    """A quarter of a block of height one and k = 1, upset by a tenth."""
    return Scene(
        mesh=block(ratio / 2, 0.5, round(ratio * n / 2), n // 2, element=Element.Q4),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(1000.0, 0.3), Perfect(float(np.sqrt(3.0)))),
        supports=(Symmetry("left", 0), Symmetry("base", 1)),
        tools=(FlatTool((0.0, 0.5), (0.0, -1.0), (0.0, -0.05), ("top",), mu),),
        configuration=Configuration.SMALL,
    )


def run(n: int, watch: Watch) -> list[float]:
    """The plateau of each pair."""
    ends = ((ratio, watch.end(pressed(ratio, mu, n), Schedule(20))) for ratio, mu in PAIRS)
    return [float(-end.tool_force(0)[1] / (2 * ratio)) for ratio, end in ends]


CASE = Case(
    name="slipping_platens",
    subject=Subject.LIMITS,
    source="derived: slab with Coulomb slip, a trend to a few per cent",
    purpose=("The friction hill of a thin block that slips on its platens, on the plateau of a march."),
    setup=(
        "Plane strain, perfect plasticity, shear strength k, E = 577 sigma_Y, width over height w/h = 4 and 8, mu = "
        "0.05 and 0.1, small strain, twenty increments to a tenth of the height; Q4 with the mean of its volume "
        "change. Mean p/2k = (e^y - 1)/y, y = mu w/h. The slab theory assumes the same pressure through the height, "
        "so it is accurate for thin blocks and little friction."
    ),
    asked=tuple(Asked(f"p/2k, w/h = {ratio}, mu = {mu:g}", slab(ratio, mu), 0.03) for ratio, mu in PAIRS),
    counted="elements through the height",
    meshes=(8, 16, 32),
    run=run,
    note=(
        "The remaining difference does not decrease with the mesh: it is the error of the slab theory, and grows "
        "with the friction."
    ),
)
