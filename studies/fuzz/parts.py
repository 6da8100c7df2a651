"""Scenes of the fuzz study of two or three parts in a plane that touch each other, and the same in other views.

Parts lie on each other, as blocks or rings, and meet along a flat line, an arch or a ramp; the upper one ends before
the lower one, or beyond it. The upper one is pressed, and slides or is lifted again, and sides may be loaded. Either
side, or both, may have the candidates. A scene is drawn as numbers, of which any :class:`View` makes a scene: in other
units, mirrored, turned, or with other numbers for nodes and elements.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.flow import Integration
from bipot.laws.material import Elastic, Material
from bipot.marching import Schedule
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.together import together
from bipot.paths import Amplitude
from bipot.scene.loads import Load, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.deformable import DeformableTool
from bipot.typing import Floats, Ints
from studies.fuzz.meshes import Rng
from studies.fuzz.metals import metals_in
from studies.fuzz.numbers import friction
from studies.fuzz.scenes import Drawn, drawn_material
from studies.fuzz.variants import ACROSS

FORMS, SHARES = ("newton", "tangent", "dissipation", "delassus"), (0.5, 0.25, 0.15, 0.1)
MU = (0.25, 0.5, 0.25, 0.0)
"""How probable each kind of friction is (:mod:`studies.fuzz.numbers`), where not all is welded."""

WELDED, STRAIGHT = 0.15, 1e-12
"""How probable welds of all parts of a scene in a plane or on a meridian are, and the largest gaps at rest over its
size that only seem to be: interfaces are straight."""

THREE, RINGS, APART, TRIANGLES, LOADED = 0.2, 0.3, 0.2, 0.25, 0.3
"""How probable three parts, bodies on a meridian, a gap at rest, triangles and loads are."""

QUADRATIC, GRADED, FREE, HALVES = 0.6, 0.3, 0.5, 0.2
"""How probable middle nodes, elements of a part that are not equally wide, a middle part that nothing holds, and parts
of which a plane of symmetry cuts half away, or which an axis goes through, are.
"""

GRADING = 0.3
"""The largest part of a part's width by which the places of its nodes are off, four times that at its middle."""

STIFF = 1e5
"""Young's modulus over the yield stress, at most."""


@dataclass(frozen=True)
class View:
    """A scene with lengths times ``length`` and stresses times ``stress``, mirrored or not, turned by an ``angle``.

    Nodes and elements have their numbers by the seed ``order``, if there is one.
    """

    name: str
    length: float = 1.0
    stress: float = 1.0
    mirrored: bool = False
    angle: float = 0.0
    order: int | None = None

    @property
    def matrix(self) -> Floats:
        """What vectors (..., 2) of the original are multiplied by from the right, but for their unit."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.diag([-1.0 if self.mirrored else 1.0, 1.0]) @ np.array([[c, s], [-s, c]])

    def numbers(self, count: int) -> Ints:
        """The original number (n,) of each of ``count`` nodes, or elements."""
        return np.arange(count) if self.order is None else np.random.default_rng([self.order, count]).permutation(count)

    def of(self, scene: Scene) -> Scene:
        """The scene in this view."""
        mesh = scene.mesh
        nodes, elements = self.numbers(len(mesh.nodes)), self.numbers(len(mesh.elements))
        now = np.argsort(nodes)
        cells = now[mesh.elements[elements]]
        if self.mirrored:
            # Rules on squares may not be the same along both of their axes, which stay as they are.
            square, count = mesh.element.corners == 4, mesh.element.nodes
            cells = cells[:, ACROSS[0][:count] if square else mesh.element.mirrored]
        regions = {name: np.flatnonzero(np.isin(elements, members)) for name, members in mesh.regions.items()}
        x = mesh.nodes[nodes] @ self.matrix * self.length
        other = Mesh(x, cells, {name: now[edges] for name, edges in mesh.boundaries.items()}, regions)
        return replace(
            metals_in(scene, self.stress),
            mesh=other,
            supports=tuple(map(self._support, scene.supports)),
            loads=tuple(map(self._load, scene.loads)),
        )

    def back(self, vectors: Floats) -> Floats:
        """Nodal vectors (a, 2) of this view as those of the original, but for their unit."""
        return (vectors @ self.matrix.T)[np.argsort(self.numbers(len(vectors)))]

    def _support(self, support: Support) -> Support:
        way = np.array(support.along(2)) @ self.matrix
        straight = np.abs(way).max() == 1.0
        direction = int(np.argmax(np.abs(way))) if straight else (float(way[0]), float(way[1]))
        if not isinstance(support, Prescribed):
            return replace(support, direction=direction)
        sign = float(way.sum()) if straight else 1.0
        return replace(support, direction=direction, displacement=sign * support.displacement * self.length)

    def _load(self, load: Load) -> Load:
        if isinstance(load, Pressure):
            return replace(load, pressure=load.pressure * self.stress)
        assert isinstance(load, Traction)
        vector = np.array(load.vector) @ self.matrix * self.stress
        return replace(load, vector=(float(vector[0]), float(vector[1])))


def views(scene: Scene, seed: int) -> list[View]:
    """One of each kind; what is on a meridian is neither mirrored nor turned."""
    rng = np.random.default_rng([seed, 22])
    units = View("units", 10.0 ** rng.uniform(-3, 3), 10.0 ** rng.uniform(-6, 6))
    turned = View("turned", angle=float(rng.uniform(0.1, 6.0)))
    flat = [View("mirrored", mirrored=True), turned] if scene.geometry is Geometry.PLANE_STRAIN else []
    # The study's planes of symmetry are along axes.
    flat = flat[:1] if scene.planes else flat
    return [units, View("renumbered", order=seed), *flat]


def draw_parts(seed: int) -> Drawn:
    """The scene of ``seed``; always the same."""
    rng, more = np.random.default_rng([seed, 20]), np.random.default_rng([seed, 23])
    while True:
        try:
            return _drawn(rng, more)
        except SceneError:
            # Parts that are drawn into each other.
            continue


def _drawn(rng: Rng, more: Rng) -> Drawn:
    ring, size, stress = rng.random() < RINGS, 10.0 ** rng.uniform(-6, 6), 10.0 ** rng.uniform(-3, 12)
    element = _element(more, triangles=rng.random() < TRIANGLES)
    count = 3 if rng.random() < THREE else 2
    shape = _shape(rng)
    parts, low, names = dict[str, Mesh](), 0.0, ("low", "up", "top")[:count]
    gap = rng.uniform(0, 0.01) if rng.random() < APART else 0.0
    halves = more.random() < HALVES
    inner = rng.uniform(0.2, 2.0) * (not halves) if ring else 0.0
    left, wide = 0.0, rng.uniform(1.0, 2.0)
    for name in names:
        high, n, m = rng.uniform(0.3, 1.0), int(rng.integers(1, 8)), int(rng.integers(1, 4))
        part = block(wide, high, n, m, element=element)
        x = part.nodes.copy()
        x[:, 0] = _graded(more, x[:, 0] / wide) * wide
        x += np.array([left + inner, low])
        x[:, 1] += shape((x[:, 0] - inner) / 2)
        parts[name] = Mesh(x * size, part.elements, part.boundaries)
        low += high + gap
        left, wide = (left, wide) if ring and rng.random() < 0.3 else (rng.uniform(0.0, 0.6), rng.uniform(0.3, 1.2))
        left *= not halves
    mesh, free = together(parts), count == 3 and (more.random() < FREE or halves)
    travel = 10.0 ** rng.uniform(-5, -1.3) + gap
    scene = Scene(
        mesh=mesh,
        geometry=Geometry.AXISYMMETRIC if ring else Geometry.PLANE_STRAIN,
        material=metal(rng, stress, 0.0),
        supports=_supports(rng, names[::2] if free else names, ring or halves, travel * size)
        + (tuple((Support if ring else Symmetry)(f"{name}/left", 0) for name in names) if halves else ()),
        tools=tuple(_tool(rng, low, up, halves) for low, up in pairwise(names)),
        regions={name: metal(rng, stress, 1.0) for name in names[1:]},
        loads=_loads(rng, names, stress),
        configuration=Configuration(rng.choice(["midpoint", "paper", "small"], p=[0.6, 0.2, 0.2])),
    )
    form = str(rng.choice(FORMS, p=SHARES))
    integration = Integration.BDF2 if rng.random() < 0.75 else Integration.BACKWARD_EULER
    first = float(rng.choice([0.0, 10.0 ** rng.uniform(-2.5, -1.5)], p=[0.7, 0.3]))
    increments = int(rng.integers(2, 7))
    try:
        schedule = Schedule(increments, first=first, settling=1, growth=4.0)
    except SceneError:
        schedule = Schedule(increments)
    body = (
        f"{'ring' if ring else 'block'} {element.value}"
        + " quadratic" * element.quadratic
        + " free" * free
        + " half" * halves
    )
    welded = replace(scene, tools=tuple(replace(tool, mu=np.inf) for tool in scene.tools))
    bends = [np.abs(tool.seeming).max() for tool in welded.tools if isinstance(tool, DeformableTool)]
    if more.random() < WELDED and max(bends) <= STRAIGHT * mesh.size:
        scene, body = welded, body + " welded"
    return Drawn(body, scene, schedule, form, integration)


def _element(rng: Rng, triangles: bool) -> Element:
    """With or without middle nodes."""
    quadratic, nine = rng.random(2) < (QUADRATIC, 0.5)
    if triangles:
        return Element.T6 if quadratic else Element.T3
    return (Element.Q9 if nine else Element.Q8) if quadratic else Element.Q4


def _graded(rng: Rng, s: Floats) -> Floats:
    """Places s (a,) from 0 to 1, or others nearer to one end; middle nodes are off the middle then."""
    by = rng.uniform(-GRADING, GRADING) * (rng.random() < GRADED)
    return s + by * s * (1 - s)


def _shape(rng: Rng) -> Callable[[Floats], Floats]:
    """How high all places are above where they are in blocks, by x: not, along a ramp, or an arch."""
    slope, arch = rng.uniform(-0.4, 0.4) * (rng.random() < 0.3), rng.uniform(-0.4, 0.4) * (rng.random() < 0.4)
    return lambda x: slope * x + 4 * arch * x * (1 - x)


def metal(rng: Rng, stress: float, spread: float) -> Material:
    """Parts differ by up to some hundreds in stiffness; one much stiffer than it is strong resolves nothing."""
    while True:
        own = drawn_material(rng, stress * 10.0 ** rng.uniform(-spread, spread))
        if own.elasticity.young < STIFF * float(own.yield_stress(np.zeros(1))[0]):
            return Elastic(own.elasticity) if rng.random() < 0.3 * spread else own


def _tool(rng: Rng, low: str, up: str, halves: bool) -> DeformableTool:
    """With either side's candidates, sometimes beside its ends, too."""
    one, other = (f"{low}/top",), (f"{up}/base",)
    if rng.random() < 0.4:
        beside = (f"{up}/left", f"{up}/right")[: int(rng.integers(1, 3))]
        other += (f"{up}/right",) if halves else beside
    if rng.random() < 0.4:
        one, other = other, one
    return DeformableTool(one, other, friction(rng, MU))


def _supports(rng: Rng, names: tuple[str, ...], ring: bool, travel: float) -> tuple[Support, ...]:
    """The lowest part is held at its base, the highest one moves at its top, of ``names`` others at their left."""
    press = Amplitude(path(rng))
    held: list[Support] = [Support("low/base", 0), Support("low/base", 1)]
    held += [Support(f"{name}/left", axis) for name in names[1:-1] for axis in range(2)]
    slide = 0.0 if ring or rng.random() < 0.4 else float(rng.uniform(-2, 2)) * travel
    return *held, Prescribed(f"{names[-1]}/top", 1, -travel, press), Prescribed(f"{names[-1]}/top", 0, slide)


def path(rng: Rng) -> tuple[tuple[float, float], ...]:
    """Once, there and part of the way back, at once and then held."""
    every = (
        ((0.0, 0.0), (1.0, 1.0)),
        ((0.0, 0.0), (0.5, 1.0), (1.0, float(rng.uniform(-0.5, 0.9)))),
        ((0.0, 0.0), (0.5, 1.0), (1.0, 1.0)),
    )
    return every[rng.choice(3, p=[0.5, 0.25, 0.25])]


def _loads(rng: Rng, names: tuple[str, ...], stress: float) -> tuple[Load, ...]:
    if rng.random() >= LOADED:
        return ()
    where, size = f"{rng.choice(names)}/right", stress * 10.0 ** rng.uniform(-4, -0.5)
    if rng.random() < 0.6:
        return (Pressure(where, size * float(rng.choice([1, -1]))),)
    return (Traction(where, (0.0, size * float(rng.uniform(-1, 1)))),)
