"""Surfaces that the fuzz study draws for tools in space: above the plane z = 0 of a body below, one side of it long."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bipot.tools.circle import Circle
from bipot.tools.profiles import Profile, Union, flat_punch, wedge
from bipot.tools.revolved import Revolved, roll, sphere
from bipot.tools.surfaces import Plane, Surface
from bipot.typing import Floats, Vector
from studies.fuzz.meshes import Rng
from studies.fuzz.surfaces import pair

ACROSS: Vector = (1.0, 0.0, 0.0)
"""What tools are about that lie: their own mirror image in the planes x = 0 and y = 0, as those are that stand."""

TILT = 0.15
"""Of the axes of tools that stand (radians, about), unless these are to be their own mirror images."""


def _ball(rng: Rng, extent: float, centred: bool) -> Surface:
    """A sphere, from a third of the body's side to ten of them."""
    radius = extent * 10.0 ** rng.uniform(-0.5, 1.0)
    return sphere((0.0, 0.0, radius), radius)


def _bowl(rng: Rng, extent: float, centred: bool) -> Surface:
    """A hollow sphere, wider than the body."""
    radius = extent * 10.0 ** rng.uniform(0.2, 1.0)
    return sphere((0.0, 0.0, -radius), radius, concave=True)


def _roll(rng: Rng, extent: float, centred: bool) -> Surface:
    """A cylinder that lies, one of four hollow."""
    hollow = bool(rng.random() < 0.25)
    radius = extent * 10.0 ** rng.uniform(0.2 if hollow else -0.5, 1.0)
    return roll((0.0, 0.0, -radius if hollow else radius), ACROSS, radius, hollow)


def _barrel(rng: Rng, extent: float, centred: bool) -> Surface:
    """A roll of three or four diameters with fillets between them."""
    radius, steps = extent * 10.0 ** rng.uniform(-0.1, 0.6), rng.uniform(-0.15, 0.15, 4) * extent
    heights = np.array([3.0, 0.5, -0.5, -3.0]) * extent
    if centred:
        steps[2:] = steps[1::-1]
    line = tuple(pair(place) for place in np.column_stack([radius + steps, heights]))
    return Revolved(Profile(line, extent * float(rng.uniform(0.05, 0.3))), (0.0, 0.0, radius), ACROSS)


def _cone(rng: Rng, extent: float, centred: bool) -> Surface:
    """A blunt cone that stands on its round tip."""
    angle, tip = float(rng.uniform(50, 87)), extent * float(rng.uniform(0.1, 1.0))
    return Revolved(wedge((0.0, 0.0), angle, 5 * extent, tip), (0.0, 0.0, 0.0), _upright(rng, centred))


def _punch(rng: Rng, extent: float, centred: bool) -> Surface:
    """A round punch with round edges."""
    width = extent * float(rng.uniform(0.6, 3))
    line = flat_punch((0.0, 0.0), width, 3 * extent, width * float(rng.uniform(0.1, 0.45)))
    return Revolved(line, (0.0, 0.0, 0.0), _upright(rng, centred))


def _ring(rng: Rng, extent: float, centred: bool) -> Surface:
    """A torus that lies on the body, or a wheel that stands on it."""
    radius, far = extent * 10.0 ** rng.uniform(-0.4, 0.5), extent * 10.0 ** rng.uniform(-0.5, 0.5)
    if rng.random() < 0.5:
        return Revolved(Circle((far + radius, 0.0), radius), (0.0, 0.0, radius), _upright(rng, centred))
    return Revolved(Circle((far + radius, 0.0), radius), (0.0, 0.0, far + 2 * radius), ACROSS)


def _several(rng: Rng, extent: float, centred: bool) -> Surface:
    """Two balls beside each other, a ball through a plane, or two planes."""
    radius, kind = extent * 10.0 ** rng.uniform(-0.3, 0.7), int(rng.integers(3))
    apart = radius * float(rng.uniform(0.15, 1.25))
    if kind == 0:
        return Union((sphere((-apart, 0.0, radius), radius), sphere((apart, 0.0, radius), radius)))
    if kind == 1:
        height = float(rng.uniform(0.05, 0.5)) * extent
        return Union((sphere((0.0, 0.0, radius), radius), Plane((0.0, 0.0, height), (0.0, 0.0, -1.0))))
    angle = float(rng.uniform(0.02, 0.4))
    sides = [(float(sign * np.sin(angle)), 0.0, -float(np.cos(angle))) for sign in (-1.0, 1.0)]
    return Union((Plane((0.0, 0.0, 0.0), sides[0]), Plane((0.0, 0.0, 0.0), sides[1])))


def _lid(rng: Rng, extent: float, centred: bool) -> Surface:
    """A plane, which turns."""
    return Plane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))


KINDS: dict[str, Callable[[Rng, float, bool], Surface]] = {
    "ball": _ball,
    "bowl": _bowl,
    "roll": _roll,
    "barrel": _barrel,
    "cone": _cone,
    "punch": _punch,
    "ring": _ring,
    "several": _several,
    "lid": _lid,
}

SHARES = (0.2, 0.1, 0.16, 0.09, 0.1, 0.1, 0.08, 0.09, 0.08)
"""How probable each kind is; that of the lid, which has to turn, where it may."""


def drawn(rng: Rng, extent: float, centred: bool, turns: bool) -> Surface:
    """One of them: its own mirror image in both upright planes if ``centred``, a lid only where it ``turns``."""
    p = np.array(SHARES[: len(KINDS) if turns else -1])
    return KINDS[str(rng.choice(list(KINDS)[: len(p)], p=p / p.sum()))](rng, extent, centred)


def _upright(rng: Rng, centred: bool) -> Vector:
    """About along z."""
    way: Floats = np.array([0.0, 0.0, 1.0])
    if not centred:
        way[:2] = TILT * rng.normal(size=2)
    return tuple((way / np.linalg.norm(way)).tolist())
