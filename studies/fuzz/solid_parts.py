"""Scenes of the fuzz study of two or three parts in space that touch each other.

Bricks of hexahedra or tetrahedra lie on each other, turned about the vertical and meshed otherwise, along a plane, a
slope or an arch. The uppermost is pressed, slides along the one below in any direction or is lifted again; one between
two others is held by contact alone. Sides may be loaded, and inner nodes of faces moved in them, so that squares are no
parallelograms. Either side, or both, may have the candidates.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.flow import Integration
from bipot.marching import Schedule
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.solids import brick
from bipot.meshes.together import together
from bipot.paths import Amplitude
from bipot.scene.loads import Load, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.tools.deformable import DeformableTool
from bipot.typing import Floats
from studies.fuzz.meshes import Rng
from studies.fuzz.numbers import friction
from studies.fuzz.parts import FORMS, MU, SHARES, metal, path
from studies.fuzz.scenes import Drawn

THREE, APART, TETRAHEDRA, QUADRATIC, TURNED, SHIFTED, LOADED = 0.15, 0.2, 0.35, 0.15, 0.4, 0.4, 0.3
"""How probable three parts, a gap at rest, tetrahedra, quadratic ones and as many quadratic bricks, parts about the
vertical, moved nodes and loads are."""

SHIFT = 0.2
"""How far nodes within a face are moved at most, over the length of an edge."""


def draw_solid_parts(seed: int) -> Drawn:
    """The scene of ``seed``; always the same."""
    rng = np.random.default_rng([seed, 24])
    while True:
        try:
            return _drawn(rng)
        except SceneError:
            # Parts that are drawn into each other.
            continue


def _drawn(rng: Rng) -> Drawn:
    size, stress = 10.0 ** rng.uniform(-6, 6), 10.0 ** rng.uniform(-3, 12)
    drawn = rng.random()
    bricks = Element.H8 if drawn < 1 - QUADRATIC else Element.H20
    element = Element.T10 if drawn < QUADRATIC else Element.T4 if drawn < TETRAHEDRA else bricks
    names = ("low", "up", "top")[: 3 if rng.random() < THREE else 2]
    shape, low, parts = _shape(rng), 0.0, dict[str, Mesh]()
    gap = rng.uniform(0, 0.01) if rng.random() < APART else 0.0
    for name in names:
        high = rng.uniform(0.3, 1.0)
        x, part = _part(rng, name == "low", high, element)
        x[:, 2] += low + shape(x)
        parts[name] = Mesh(x * size, part.elements, part.boundaries)
        low += high + gap
    travel = 10.0 ** rng.uniform(-5, -1.3) + gap
    scene = Scene(
        mesh=together(parts),
        geometry=Geometry.SOLID,
        material=metal(rng, stress, 0.0),
        supports=_supports(rng, names, travel * size),
        tools=tuple(_tool(rng, below, above) for below, above in pairwise(names)),
        regions={name: metal(rng, stress, 1.0) for name in names[1:]},
        loads=_loads(rng, names, stress),
        configuration=Configuration(rng.choice(["midpoint", "paper", "small"], p=[0.6, 0.2, 0.2])),
    )
    form = str(rng.choice(FORMS, p=SHARES))
    integration = Integration.BDF2 if rng.random() < 0.75 else Integration.BACKWARD_EULER
    body = element.value + " free" * (len(names) == 3)
    return Drawn(body, scene, Schedule(int(rng.integers(2, 4))), form, integration)


def _part(rng: Rng, lowest: bool, high: float, element: Element) -> tuple[Floats, Mesh]:
    """A brick, and where its nodes (a, 3) are from above: the lowest at the origin, others over it or its sides."""
    n, m = rng.integers(1, 4, 2).tolist()
    wide, deep = rng.uniform(1.0, 2.0, 2) if lowest else rng.uniform(0.4, 1.2, 2)
    part = brick(float(wide), float(deep), high, n, m, int(rng.integers(1, 3)), element=element)
    x = part.nodes.copy()
    if rng.random() < SHIFTED:
        inner = (x[:, :2] > 1e-9).all(axis=1) & (x[:, 0] < wide * (1 - 1e-9)) & (x[:, 1] < deep * (1 - 1e-9))
        x[inner, :2] += SHIFT * rng.uniform(-1, 1, (int(inner.sum()), 2)) * (wide / n, deep / m)
    if not lowest:
        angle = rng.uniform(0, 2 * np.pi) * (rng.random() < TURNED)
        c, s = np.cos(angle), np.sin(angle)
        x[:, :2] = (x[:, :2] - (wide / 2, deep / 2)) @ np.array([[c, s], [-s, c]]) + rng.uniform(0.3, 0.9, 2)
    return x, part


def _shape(rng: Rng) -> Callable[[Floats], Floats]:
    """How high all places are above where they are in bricks, by x and y: not, along a slope, or an arch."""
    slope, arch = rng.uniform(-0.3, 0.3, 2) * (rng.random() < 0.3), rng.uniform(-0.2, 0.2, 2) * (rng.random() < 0.3)
    return lambda x: x[:, :2] @ slope + (x[:, :2] * (1 - x[:, :2])) @ arch


def _tool(rng: Rng, low: str, up: str) -> DeformableTool:
    """With either side's candidates, sometimes beside its edges, too."""
    one, other = (f"{low}/top",), (f"{up}/base",)
    if rng.random() < 0.3:
        other += (f"{up}/left", f"{up}/front")[: int(rng.integers(1, 3))]
    if rng.random() < 0.4:
        one, other = other, one
    return DeformableTool(one, other, friction(rng, MU))


def _supports(rng: Rng, names: tuple[str, ...], travel: float) -> tuple[Support, ...]:
    """The lowest part is held at its base, the highest one moves at its top, what is between is free."""
    slide = np.zeros(2) if rng.random() < 0.4 else rng.uniform(-1.5, 1.5, 2) * travel
    top = f"{names[-1]}/top"
    held = [Support("low/base", axis) for axis in range(3)]
    aside = [Prescribed(top, axis, float(far)) for axis, far in enumerate(slide)]
    return *held, Prescribed(top, 2, -travel, Amplitude(path(rng))), *aside


def _loads(rng: Rng, names: tuple[str, ...], stress: float) -> tuple[Load, ...]:
    if rng.random() >= LOADED:
        return ()
    where, size = f"{rng.choice(names)}/right", stress * 10.0 ** rng.uniform(-4, -0.5)
    if rng.random() < 0.6:
        return (Pressure(where, size * float(rng.choice([1, -1]))),)
    return (Traction(where, tuple((size * rng.uniform(-1, 1, 3)).tolist())),)
