"""Random scenes for the fuzz study: body, material, supports, tools, path, form, each drawn from one seed.

A drawn scene is small (a few elements, a few increments) but its numbers are not: sizes and stresses over many orders,
travels from a billionth of the body on, materials from rubber-like ratios E/sigma_Y to ones that never yield, bodies
held by tools alone or by nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np

from bipot.errors import SceneError
from bipot.fem.elements import RULES
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.flow import Integration
from bipot.laws.hardening import Hardening, Linear, Perfect, Tabulated, Voce
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Schedule
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.paths import Amplitude, Path
from bipot.scene.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.revolved import Revolved
from bipot.tools.surfaces import Surface
from bipot.tools.tool import FlatTool, Sampling
from bipot.typing import Vector
from studies.fuzz.driven import forced, prescribed
from studies.fuzz.meshes import Rng, distorted, in_other_elements, made, rule, volume
from studies.fuzz.numbers import friction, gap_at_rest
from studies.fuzz.points import sampled

FORMS = ("tangent", "tangent-cvxpy", "uncoupled", "dissipation", "newton", "delassus", "penalty", "uzawa")
SHARES = (0.22, 0.08, 0.06, 0.16, 0.24, 0.1, 0.07, 0.07)
MU, GAP = (0.15, 0.5, 0.25, 0.1), (0.6, 0.2, 0.06, 0.14)
"""How probable each kind of friction and of gap at rest is (:mod:`studies.fuzz.numbers`)."""
FORMING = 0.09
"""Travels above this times the size are taken in smaller increments."""


@dataclass(frozen=True)
class Drawn:
    """A scene with how it is marched. ``body`` is block, cylinder or ring."""

    body: str
    scene: Scene
    schedule: Schedule
    form: str
    integration: Integration

    @property
    def kind(self) -> str:
        """The body, its surfaces that are not flat, how contact is posed, what drives it beside tools on paths."""
        forced = any(tool.driven_by is not None for tool in self.scene.tools)
        moved = any(isinstance(support, Prescribed) for support in self.scene.supports)
        weighted = any(tool.sampling is Sampling.WEIGHTED for tool in self.scene.tools)
        faces = sorted({_named(tool.face) for tool in self.scene.tools if not tool.flat})
        turning = any(tool.turn is not None for tool in self.scene.tools)
        capped = any(tool.capped for tool in self.scene.tools)
        moments = any(tool.turn is not None and tool.turn.driven_by is not None for tool in self.scene.tools)
        aslant = any(not isinstance(support.direction, int) for support in self.scene.supports)
        drives = " turning" * turning + " by force" * forced + " by moment" * moments + " by supports" * moved
        drives += " aslant" * aslant
        return " ".join([self.body, *faces]) + " weighted" * weighted + " capped" * capped + drives


def _named(face: Surface) -> str:
    """What a surface is, and what of it goes around an axis."""
    own = type(face).__name__.lower()
    return f"{own}-{type(face.meridian).__name__.lower()}" if isinstance(face, Revolved) else own


def draw(seed: int) -> Drawn:
    """The scene of ``seed``; always the same."""
    rng = np.random.default_rng([seed, 0])
    body = str(rng.choice(["block", "cylinder", "ring"], p=[0.45, 0.35, 0.2]))
    size, stress = 10.0 ** rng.uniform(-6, 6), 10.0 ** rng.uniform(-3, 12)
    mesh = in_other_elements(np.random.default_rng([seed, 4]), distorted(rng, made(rng, body, size)))
    travel = size * _travel(rng)
    tools = sampled(np.random.default_rng([seed, 9]), mesh, _tools(rng, body, mesh, travel))
    scene = Scene(
        mesh=mesh,
        geometry=Geometry.PLANE_STRAIN if body == "block" else Geometry.AXISYMMETRIC,
        material=drawn_material(rng, stress),
        supports=_supports(rng, body, tools),
        tools=tools,
        quadrature=rule(np.random.default_rng([seed, 5]), mesh, str(rng.choice([q.value for q in RULES[Element.Q8]]))),
        configuration=Configuration(rng.choice(["midpoint", "paper"], p=[0.75, 0.25])),
    )
    scene = replace(scene, volume=volume(np.random.default_rng([seed, 8]), mesh))
    scene = _loaded(np.random.default_rng([seed, 3]), scene, stress)
    scene = cut_by_planes(np.random.default_rng([seed, 4]), scene)
    scene = prescribed(np.random.default_rng([seed, 7]), forced(np.random.default_rng([seed, 6]), scene))
    form = str(rng.choice(FORMS, p=SHARES))
    integration = Integration.BDF2 if rng.random() < 0.75 else Integration.BACKWARD_EULER
    return Drawn(body, scene, _schedule(rng, tools, travel > FORMING * size), form, integration)


def _loaded(rng: Rng, scene: Scene, stress: float) -> Scene:
    """Two of five scenes with one or two loads, up to what makes the body yield, sometimes in small strain."""
    if rng.random() < 0.6:
        return scene
    mesh, edges = scene.mesh, [name for name in scene.mesh.boundaries if name not in ("axis", "base")]
    area = mesh.size if scene.geometry is Geometry.PLANE_STRAIN else mesh.size**2

    def load() -> Load:
        size, boundary = stress * 10.0 ** rng.uniform(-5, -0.3), str(rng.choice(edges))
        way = size * rng.uniform(-1, 1, 2)
        if scene.geometry is Geometry.AXISYMMETRIC:
            way[0] *= rng.random() < 0.5
        vector, amplitude = (float(way[0]), float(way[1])), _amplitude(rng)
        kind = rng.choice(["pressure", "traction", "body", "point"], p=[0.45, 0.25, 0.2, 0.1])
        if kind == "pressure":
            return Pressure(boundary, float(size * rng.choice([1, 1, 1, -1])), amplitude)
        if kind == "traction":
            return Traction(boundary, vector, amplitude)
        if kind == "body":
            return BodyForce((vector[0] / mesh.size, vector[1] / mesh.size), amplitude)
        node = int(rng.choice(mesh.boundary_nodes(*edges)))
        return PointForce(node, (0.1 * area * vector[0], 0.1 * area * vector[1]), amplitude)

    small = rng.random() < 0.25
    return replace(
        scene,
        loads=tuple(load() for _ in range(int(rng.integers(1, 3)))),
        configuration=Configuration.SMALL if small else scene.configuration,
    )


HELD = ("left", 0), ("base", 1)
"""Sides and the normals along which they are held."""


def cut_by_planes(
    rng: Rng,
    scene: Scene,
    normals: Collection[tuple[str, int | Vector]] = HELD,
    part: float = 0.5,
) -> Scene:
    """Sides that are held along their normal, a ``part`` of them planes of symmetry where the scene allows it."""
    for support in scene.supports:
        if (support.boundary, support.direction) in normals and rng.random() < part:
            plane = Symmetry(support.boundary, support.direction)
            try:
                scene = replace(scene, supports=tuple(plane if s == support else s for s in scene.supports))
            except SceneError:
                continue
    return scene


def _amplitude(rng: Rng) -> Amplitude:
    """Once, there and back, at once."""
    every = (
        ((0.0, 0.0), (1.0, 1.0)),
        ((0.0, 0.0), (0.5, 1.0), (1.0, float(rng.uniform(-0.5, 0.5)))),
        ((0.0, 0.0), (0.25, 1.0), (1.0, 1.0)),
        ((0.0, 1.0), (1.0, 1.0)),
    )
    return Amplitude(every[rng.choice(4, p=[0.5, 0.25, 0.15, 0.1])])


def _travel(rng: Rng) -> float:
    """Over the size: from a billionth on, and often enough to fold elements."""
    exponents = [rng.uniform(-9, -4), rng.uniform(-4, -1), np.log10(rng.uniform(0.1, 0.35))]
    return 10.0 ** float(rng.choice(exponents, p=[0.28, 0.44, 0.28]))


def drawn_material(rng: Rng, stress: float) -> VonMises:
    """``stress`` is the yield stress; E over it 50 to 1e4, sometimes to 1e12."""
    young = stress * 10.0 ** (rng.uniform(4, 12) if rng.random() < 0.2 else rng.uniform(np.log10(50), 4))
    poisson = float(rng.choice([rng.uniform(-0.5, 0.2), rng.uniform(0.2, 0.4), 0.49, 0.499, 0.4999]))
    curves: list[Callable[[], Hardening]] = [
        lambda: Perfect(stress),
        lambda: Linear(stress, stress * 10.0 ** rng.uniform(-2, 1)),
        lambda: Voce(stress, stress * rng.uniform(0, 2), 10.0 ** rng.uniform(-1, 2), stress * rng.uniform(0, 0.5)),
        lambda: Tabulated((0.0, 0.02, 0.2), (stress, stress * 1.2, stress * rng.uniform(1.2, 2))),
    ]
    return VonMises(Elasticity(young, poisson), curves[rng.integers(len(curves))]())


def _supports(rng: Rng, body: str, tools: tuple[FlatTool, ...]) -> tuple[Support, ...]:
    """Symmetry, clamps, unilateral contact alone where there are two tools, and seldom nothing at all.

    A base on a tool is not held.
    """
    two, based = len(tools) > 1, any("base" in tool.candidates for tool in tools)
    axis = (Support("axis", 0),) if body == "cylinder" else ()
    sideways = {"block": "left", "ring": "bore"}.get(body)
    base = () if based else (Support("base", 1),)
    kind = rng.choice(
        ["symmetric", "base", "clamped", "none"], p=[0.5, 0.15, 0.1, 0.25] if two else [0.7, 0.15, 0.12, 0.03]
    )
    if kind == "none":
        return axis
    if kind == "clamped":
        return (*axis, *base) if based else (*axis, *base, Support("base", 0))
    return (*axis, *base, Support(sideways, 0)) if kind == "symmetric" and sideways else (*axis, *base)


def _tools(rng: Rng, body: str, mesh: Mesh, travel: float) -> tuple[FlatTool, ...]:
    """A punch from above, sometimes inclined; sometimes with a base that slides or a wall."""
    side = "right" if body == "block" else "side"
    punch = _punch(rng, body, mesh, travel, ("top", side) if rng.random() < 0.6 else ("top",))
    kind = rng.choice(["alone", "base", "wall"], p=[0.6, 0.25, 0.15])
    if kind == "alone":
        return (punch,)
    if kind == "wall":
        push = -travel * rng.uniform(0, 1) if rng.random() < 0.5 else 0.0
        gap = gap_at_rest(rng, mesh.size, travel, GAP)
        return punch, _tool(mesh, (-1.0, 0.0), (push, 0.0), (side,), gap, friction(rng, MU), _path(rng))
    if body != "block" or rng.random() < 0.5:
        return punch, _tool(mesh, (0.0, 1.0), (0.0, 0.0), ("base",), 0.0, friction(rng, MU), punch.path)
    along = (rng.uniform(-1, 1) * travel, 0.0)
    if rng.random() < 0.3:
        return punch, _tool(mesh, (0.0, 1.0), along, ("base",), 0.0, friction(rng, MU), punch.path)
    held, later = ((0.0, 0.0), (0.5, 1.0), (1.0, 1.0)), ((0.0, 0.0), (0.5, 0.0), (1.0, 1.0))
    return replace(punch, path=held), _tool(mesh, (0.0, 1.0), along, ("base",), 0.0, friction(rng, MU), later)


def _punch(rng: Rng, body: str, mesh: Mesh, travel: float, boundaries: tuple[str, ...]) -> FlatTool:
    """From above, straight or inclined, sometimes moving sideways too, sometimes with friction node by node."""
    angle = rng.uniform(-0.2, 0.2) if rng.random() < 0.25 else 0.0
    slide = rng.uniform(-1, 1) * travel if body == "block" and rng.random() < 0.4 else 0.0
    normal, gap = (float(np.sin(angle)), -float(np.cos(angle))), gap_at_rest(rng, mesh.size, travel, GAP)
    punch = _tool(mesh, normal, (slide, -travel), boundaries, gap, friction(rng, MU), _path(rng))
    if punch.welded or rng.random() < 0.7:
        return punch
    nodes = mesh.boundary_nodes(*boundaries)
    return replace(punch, mu_at={int(a): float(rng.uniform(0, 1)) for a in rng.choice(nodes, size=len(nodes) // 2 + 1)})


def _tool(
    mesh: Mesh,
    normal: tuple[float, float],
    travel: tuple[float, float],
    boundaries: tuple[str, ...],
    gap: float,
    mu: float,
    path: Path,
) -> FlatTool:
    """A plane ``gap`` away from the nearest node of its boundaries."""
    nodes = mesh.nodes[mesh.boundary_nodes(*boundaries)]
    nearest = nodes[np.argmin(nodes @ np.array(normal))]
    point = nearest - gap * np.array(normal)
    return FlatTool((float(point[0]), float(point[1])), normal, travel, boundaries, mu, path)


def _path(rng: Rng) -> tuple[tuple[float, float], ...]:
    """Once, partly back, all the way back and again, hold."""
    paths = (
        ((0.0, 0.0), (1.0, 1.0)),
        ((0.0, 0.0), (0.5, 1.0), (1.0, rng.uniform(0, 1))),
        ((0.0, 0.0), (0.4, 1.0), (0.7, -0.1), (1.0, 1.2)),
        ((0.0, 0.0), (0.6, 1.0), (1.0, 1.0)),
    )
    return paths[rng.choice(4, p=[0.6, 0.18, 0.12, 0.1])]


def _schedule(rng: Rng, tools: tuple[FlatTool, ...], forming: bool) -> Schedule:
    """2 to 5 increments, twice that in ``forming``; with or without a start-up; landing on the paths' bends or not."""
    increments = int(rng.integers(2, 6)) * (2 if forming else 1)
    first = float(rng.choice([0.0, 10.0 ** rng.uniform(-2.5, -1.5)], p=[0.7, 0.3]))
    bends = sorted({tau for tool in tools for tau, _ in tool.path if 0 < tau < 1})
    landings = tuple(bends) if rng.random() < 0.7 else ()
    try:
        return Schedule(increments, first=first, settling=1, growth=4.0, landings=landings)
    except SceneError:
        return Schedule(increments, landings=landings)
