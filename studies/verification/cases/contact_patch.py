"""The patch test of contact: bodies whose meshes do not match, under the same pressure everywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot import (
    Bounds,
    DeformableTool,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    Limits,
    Prescribed,
    Pressure,
    Scene,
    Schedule,
    Support,
    Symmetry,
    block,
    brick,
    together,
)
from bipot.typing import Floats
from studies.verification.case import CONTROL, Asked, Case, Subject, Watch
from studies.verification.two_bodies import borne, mapped

ELASTIC = Elasticity(1.0, 0.3)
TIGHT = replace(CONTROL, limits=Limits(bounds=Bounds(equilibrium=1e-11)))
SHORTER, INCREMENTS = 0.02, 2
"""Part by which blocks become shorter in both directions, and the equal increments of it."""

SLOPES = {"straight": 0.0, "inclined": 0.4}
PRESSURE = 0.05
"""Inside and outside of the rings."""

FRICTION = 0.0, 0.3

SOLIDS = Element.H8, Element.H20, Element.T4, Element.T10


def blocks(slope: float, n: int, mu: float) -> Scene:
    """Blocks 1 wide, from 0 to 2, with 2 n and 3 n elements along the interface, that all sides make shorter."""

    def interface(x: Floats) -> Floats:
        return 1 + slope * (x - 0.5)

    parts = {
        "low": mapped(block(1.0, 1.0, 2 * n, 2 * n), lambda x, s: (x, s * interface(x))),
        "high": mapped(block(1.0, 1.0, 3 * n, 2 * n), lambda x, s: (x, interface(x) + s * (2 - interface(x)))),
    }
    left = [Support(f"{part}/left", 0) for part in parts]
    right = [Prescribed(f"{part}/right", 0, -SHORTER) for part in parts]
    return Scene(
        mesh=together(parts),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(ELASTIC),
        supports=(*left, *right, Support("low/base", 1), Prescribed("high/top", 1, -2 * SHORTER)),
        tools=(DeformableTool(("high/base",), ("low/top",), mu),),
    )


def rings(n: int, mu: float, element: Element = Element.Q4) -> Scene:
    """Quarters of rings, r = 0.5, 1 and 1.5, with 2 n and 3 n elements around, under the pressure on both sides."""

    def around(r: Floats, turn: Floats) -> tuple[Floats, Floats]:
        return r * np.cos(np.pi / 2 * turn), r * np.sin(np.pi / 2 * turn)

    parts = {
        "inner": mapped(block(0.5, 1.0, n, 2 * n, element=element), lambda s, turn: around(s + 0.5, turn)),
        "outer": mapped(block(0.5, 1.0, n, 3 * n, element=element), lambda s, turn: around(s + 1.0, turn)),
    }
    return Scene(
        mesh=together(parts),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(ELASTIC),
        supports=tuple(Symmetry(f"{part}/{end}", d) for part in parts for end, d in (("base", 1), ("top", 0))),
        tools=(DeformableTool(("outer/left",), ("inner/right",), mu),),
        loads=(Pressure("inner/left", PRESSURE), Pressure("outer/right", PRESSURE)),
    )


def cubes(n: int, element: Element) -> Scene:
    """Quarters of n/2 and 3 n/4 elements a side and n/4 high, on each other in space, pressed with friction."""
    sides = n // 2, 3 * n // 4
    low, high = (brick(1.0, 1.0, 0.5, side, side, n // 4, element=element) for side in sides)
    parts = {"low": low, "high": replace(high, nodes=high.nodes + np.array([0.0, 0.0, 0.5]))}
    held = [Symmetry(f"{part}/{side}", axis) for part in parts for side, axis in (("left", 0), ("front", 1))]
    return Scene(
        mesh=together(parts),
        geometry=Geometry.SOLID,
        material=Elastic(ELASTIC),
        supports=(*held, Support("low/base", 2), Prescribed("high/top", 2, -SHORTER)),
        tools=(DeformableTool(("high/base",), ("low/top",), 0.3),),
    )


def uneven(scene: Scene, watch: Watch) -> float:
    """The largest difference of a component of stress from its mean, over the largest mean."""
    stress = watch.end(scene, Schedule(INCREMENTS), TIGHT).state.stress
    mean = stress.mean(axis=(0, 1))
    return float(np.abs(stress - mean).max() / np.abs(mean).max())


def closed_pressure() -> float:
    """2 (K + G/3) times the sum of what increments take off lengths, over the mean of these in each.

    >>> round(closed_pressure(), 12)
    0.038850876626
    """
    lengths = 1 - SHORTER * np.linspace(0.0, 1.0, INCREMENTS + 1)
    strain = 2 * float(((lengths[:-1] - lengths[1:]) / (lengths[:-1] + lengths[1:])).sum())
    return 2 * (ELASTIC.bulk + ELASTIC.shear / 3) * strain


def off(scene: Scene, pressure: float, watch: Watch) -> tuple[float, float, float]:
    """Largest error of a candidate's pressure, largest shear, and error of the mean pressure, over the pressure."""
    found = borne(watch.end(scene, Schedule(INCREMENTS), TIGHT))
    error, shear = (found.traction / pressure - (1.0, 0.0)).T
    return float(np.abs(error).max()), float(np.abs(shear).max()), float(np.average(error, weights=found.area))


def run(n: int, watch: Watch) -> list[float]:
    """Largest error and shear on straight interfaces, then those of the circular one, by friction."""
    closed = closed_pressure()
    flat = [max(off(blocks(slope, n, mu), closed, watch)[:2]) for slope in SLOPES.values() for mu in FRICTION]
    (plain, _, mean), (rough, shear, _) = (off(rings(n, mu), PRESSURE, watch) for mu in FRICTION)
    curved, along, _ = off(rings(n, 0.3, Element.Q8), PRESSURE, watch)
    space = [uneven(cubes(n, element), watch) for element in SOLIDS]
    return [*flat, plain, rough, shear, mean, curved, along, *space]


CASE = Case(
    name="contact_patch",
    subject=Subject.TWO_BODIES,
    source="closed form: uniform pressure (Taylor and Papadopoulos)",
    purpose=(
        "The patch test of contact: what one body bears uniformly the other one bears uniformly, though the meshes do "
        "not match."
    ),
    setup=(
        "Plane strain, E = 1, nu = 0.3, Q4, mu = 0 and 0.3, two increments. Blocks from 0 to 1 in x and to 2 in y, "
        "of two parts with 2 n and 3 n elements along a straight interface, at y = 1 or y = 1 + 0.4 (x - 0.5): "
        "their sides become 2 % shorter in both directions, so that both parts are under one pressure, that of "
        "uniform shortening. Quarters of rings, r from 0.5 to 1 and to 1.5, with n elements through each and 2 n "
        "and 3 n around: a pressure of 0.05 acts on their inside and outside. The pressure of a candidate is its "
        "force over int psi dA. Compared are the largest error of any candidate's pressure and the largest shear "
        "stress, both over the pressure. On straight interfaces the larger of the two is asked to be zero to 1e-9, "
        "with equilibrium to 1e-11. Circular interfaces are two polygons, which leave gaps of up to 1/(8 R) times "
        "the square of an edge; with Q8 they are parabolas. In space cubes of n/2 and 3 n/4 elements a side, H8, "
        "H20, T4 or T10, are pressed on each other, mu = 0.3: compared is the largest difference of a stress from its "
        "mean."
    ),
    asked=(
        *(Asked(f"{name}, mu = {mu:g}", 0.0, 1e-9) for name in SLOPES for mu in FRICTION),
        Asked("circular, mu = 0: pressure", 0.0, 0.005),
        Asked("circular, mu = 0.3: pressure", 0.0, 0.005),
        Asked("circular, mu = 0.3: shear", 0.0, 1e-5),
        Asked("circular, mu = 0: mean pressure", 0.0, 1e-3),
        Asked("circular, Q8, mu = 0.3: pressure", 0.0, 5e-4),
        Asked("circular, Q8, mu = 0.3: shear", 0.0, 1e-5),
        *(Asked(f"in space, {element.name}: stress", 0.0, 1e-9) for element in SOLIDS),
    ),
    counted="n",
    meshes=(4, 8, 16),
    run=run,
    note=(
        "On the circular interface of Q4 the pressure alternates between candidates that face a node of the other "
        "side and those that face the middle of an edge: the gaps to be closed, of second order in the size of "
        "edges, need strains of first order in elements of that size. The mean pressure is of second order; shear "
        "falls faster. The parabolas of Q8 leave gaps of order four."
    ),
)
