"""Cattaneo and Mindlin in a plane: two elastic cylinders that are pressed together and then shifted."""

from __future__ import annotations

import numpy as np

from bipot import (
    Amplitude,
    DeformableTool,
    Elastic,
    Elasticity,
    Geometry,
    Prescribed,
    Scene,
    Schedule,
    Support,
    together,
)
from bipot.typing import Floats
from studies.verification.case import Asked, Case, Subject, Watch
from studies.verification.indentation import FINE
from studies.verification.two_bodies import borne, cylinder_end, half_width, turned

RADIUS, ELASTIC, MU, PRESS = 20.0, Elasticity(200_000.0, 0.3), 0.3, 100.0
STAR = ELASTIC.young / (1 - ELASTIC.poisson**2) / 2
SINK, SHIFT = 3.4e-3, 7.9e-4
"""How far the upper cylinder's middle goes down, and then aside."""


def extent(force: float) -> float:
    """a^2 = 4 P R/(pi E*), R half of each radius.

    >>> round(extent(100.0), 7)
    0.1076405
    """
    return float(np.sqrt(2 * force * RADIUS / np.pi / STAR))


def stuck(force: float, pull: float) -> float:
    """c = a sqrt(1 - Q/(mu P)).

    >>> round(stuck(100.0, 15.0), 7)
    0.0761133
    """
    return extent(force) * float(np.sqrt(1 - pull / (MU * force)))


def shear(x: Floats, force: float, pull: float) -> Floats:
    """q = mu p0 (sqrt(1 - x^2/a^2) - c/a sqrt(1 - x^2/c^2)), the second root where |x| < c, p0 = 2 P/(pi a).

    >>> shear(extent(100.0) * np.array([0.0, 0.5, 0.9]), 100.0, 15.0).round(2).tolist()
    [51.97, 64.94, 77.34]
    """
    a, c = extent(force), stuck(force, pull)
    inner, outer = (np.sqrt(np.maximum(1 - (x / each) ** 2, 0.0)) for each in (c, a))
    return MU * 2 * force / np.pi / a * (outer - c / a * inner)


AT = {"0": lambda a, c: 0.0, "a/2": lambda a, c: a / 2, "c": lambda a, c: c, "0.9 a": lambda a, c: 0.9 * a}
"""Places at which the shear stress is compared, by half-width and stick half-width."""


def shifted(n: int) -> Scene:
    """Halves of the cylinders with 3 n/4 and ``n`` (a multiple of 8) equal elements to 1.3 a on each side."""
    a = extent(PRESS)
    parts = {
        "upper": cylinder_end(RADIUS, a, 3 * n // 4, half=True),
        "lower": turned(cylinder_end(RADIUS, a, n, half=True)),
    }
    pressed, aside = Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 1.0))), Amplitude(((0.0, 0.0), (0.5, 0.0), (1.0, 1.0)))
    return Scene(
        mesh=together(parts),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(ELASTIC),
        supports=(
            *(Support("lower/top", axis) for axis in range(2)),
            Prescribed("upper/top", 1, -SINK, pressed),
            Prescribed("upper/top", 0, SHIFT, aside),
        ),
        tools=(DeformableTool(("lower/base",), ("upper/base",), MU),),
    )


def run(n: int, watch: Watch) -> list[float]:
    """Half-widths of contact and stick, largest pressure, shear at four places and everywhere."""
    last = watch.end(shifted(n), Schedule(8, first=0.02))
    found, size = borne(last), FINE * extent(PRESS) / (3 * n // 4)
    pull, force = np.abs(last.tool_force(0)).tolist()
    a, c = extent(force), stuck(force, pull)
    middle = float(np.average(found.x[:, 0], weights=found.r[:, 0]))
    x, friction = found.x[:, 0] - middle, np.abs(found.traction[:, 1])
    left = MU * found.r[:, 0] - np.abs(found.r[:, 1])
    error = (friction - shear(x, force, pull)) ** 2 @ found.area / (shear(x, force, pull) ** 2 @ found.area)
    at = [np.interp([-where(a, c), where(a, c)], x, friction).mean() for where in AT.values()]
    return [
        half_width(x, found.r[:, 0], size) / a,
        float(found.pressure.max()) / (2 * force / np.pi / a),
        half_width(x, left, size) / c,
        *(float(q / shear(np.array(where(a, c)), force, pull)) for q, where in zip(at, AT.values(), strict=True)),
        float(np.sqrt(error)),
    ]


TOLERANCES = {"a": 0.01, "p0": 0.01, "stick half-width": 0.02} | {f"q at {where}": 0.05 for where in AT}

CASE = Case(
    name="cattaneo_mindlin",
    subject=Subject.TWO_BODIES,
    source="closed form (Hertz; Cattaneo; Mindlin, in a plane)",
    purpose="Partial slip between two elastic bodies: the outer part of the contact slips, its middle sticks.",
    setup=(
        "Two cylinders of one elastic material, R = 20, E = 200000, nu = 0.3, mu = 0.3, in plane strain, Q4. Half "
        "of each is modelled, up to its middle plane, with 3 n/4 and n equal elements to 1.3 a on each side. The "
        "middle of the upper one goes down by 0.0034, at first in small increments, at which the force is nearly P "
        "= 100 per length and a = 0.1076405, then aside by 0.00079 in four, at which Q is nearly mu P/2. The "
        "references are those for the forces P and Q found: a^2 = 2 P R/(pi E*), p0 = 2 P/(pi a), c = a sqrt(1 - "
        "Q/(mu P)), q = mu p0 (sqrt(1 - x^2/a^2) - c/a sqrt(1 - x^2/c^2)), the second root in the sticking part "
        "alone; 1/E* = 2 (1 - nu^2)/E. The half-width is found as in `hertz_two_bodies`, that of the sticking part "
        "likewise from mu p - |q|, which is distributed over it as the pressure of a contact of that width. x "
        "counts from the mean place of the contact forces. q at a place is the mean of both sides, linear between "
        "nodes; its error everywhere is the root mean square of q less its reference, over that of the reference."
    ),
    asked=(
        *(Asked(f"{name} over its closed form", 1.0, tolerance) for name, tolerance in TOLERANCES.items()),
        Asked("error of q", 0.0, 0.1),
    ),
    counted="equal elements to 1.3 a",
    meshes=(8, 16, 32),
    run=run,
    note=(
        "The error of q is that of the pressure where it slips: it falls with the first power of the elements' "
        "size, and alternates from candidate to candidate as in `contact_patch`, since the meshes do not match."
    ),
)
