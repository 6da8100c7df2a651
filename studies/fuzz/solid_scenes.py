"""Random bodies in space for the fuzz study: small bricks of every element, held, cut, loaded and pressed at random."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot.errors import SceneError
from bipot.fem.elements import Quadrature
from bipot.fem.projection import VOLUMES
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.laws.flow import Integration
from bipot.laws.hardening import Linear, Perfect, Voce
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Schedule
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.solids import brick
from bipot.paths import Amplitude, Path
from bipot.scene.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool
from bipot.typing import Floats
from studies.flat import flat
from studies.fuzz.numbers import friction, gap_at_rest
from studies.fuzz.scenes import Drawn, cut_by_planes
from studies.fuzz.solid_points import faces_of, in_means, weighted
from studies.fuzz.solid_supports import aslant, leaning, sides, supports
from studies.independent.solid import orientation

Rng = np.random.Generator

FORMS = ("tangent", "dissipation", "newton", "delassus", "penalty", "uzawa")
SHARES = (0.25, 0.17, 0.33, 0.1, 0.07, 0.08)
MU, GAP = (0.12, 0.55, 0.23, 0.1), (0.65, 0.2, 0.06, 0.09)
"""How probable each kind of friction and of gap at rest is (:mod:`studies.fuzz.numbers`)."""

ELEMENTS = (Element.H8, Element.H20, Element.T10, Element.T4)
OF_EACH = (0.4, 0.25, 0.25, 0.1)

LEAST_JACOBIAN = 0.05
"""Of a distorted mesh, over the mean of its element."""

CAPPED = (0.7, 0.15, 0.15)
"""How probable friction without a cap is, and of constant shear, and with a cap."""

FORMING = 0.09
"""Travels above this times the size are taken in smaller increments."""


def draw_solid(seed: int) -> Drawn:
    """The body in space of ``seed``; always the same."""
    rng = np.random.default_rng([seed, 20])
    size, stress = 10.0 ** rng.uniform(-6, 6), 10.0 ** rng.uniform(-3, 12)
    mesh = leaning(np.random.default_rng([seed, 22]), _distorted(rng, _made(rng, size)))
    travel = size * 10.0 ** float(rng.choice([rng.uniform(-8, -4), rng.uniform(-4, -1), np.log10(0.2)]))
    tools = weighted(np.random.default_rng([seed, 23]), mesh, _tools(rng, mesh, travel))
    scene = Scene(
        mesh=mesh,
        geometry=Geometry.SOLID,
        material=drawn_solid_material(rng, stress),
        supports=supports(rng, mesh, tools),
        tools=tools,
        quadrature=Quadrature.GAUSS3 if mesh.element.shape.cube and rng.random() < 0.15 else None,
        configuration=Configuration(rng.choice(["midpoint", "paper"], p=[0.75, 0.25])),
        volume=VOLUMES[mesh.element][rng.integers(len(VOLUMES[mesh.element]))] if rng.random() < 0.4 else None,
    )
    scene = _pressed(rng, cut_by_planes(rng, _loaded(rng, scene, stress), sides(scene.mesh), 0.65), stress)
    scene = aslant(np.random.default_rng([seed, 24]), scene)
    # What penalised forms and Delassus' refuse by their nature says nothing of bodies in space.
    welded = any(tool.welded for tool in scene.tools)
    form = str(rng.choice(FORMS[:3] if welded else FORMS, p=None if welded else SHARES))
    integration = Integration.BDF2 if rng.random() < 0.75 else Integration.BACKWARD_EULER
    increments = int(rng.integers(2, 4)) * (2 if travel > FORMING * size else 1)
    first = float(rng.choice([0.0, 0.02], p=[0.6, 0.4]))
    if form != "delassus":
        capping = np.random.default_rng([seed, 25])
        scene = replace(scene, tools=tuple(_capped(capping, mesh, flat(tool)) for tool in scene.tools))
    return Drawn(
        mesh.element.value, scene, Schedule(increments, first=first, settling=1, growth=4.0), form, integration
    )


def _made(rng: Rng, size: float) -> Mesh:
    """A brick of 1 to 3 elements a side, quadratic ones of fewer."""
    element = ELEMENTS[rng.choice(len(ELEMENTS), p=OF_EACH)]
    counts = rng.integers(1, 3 if element.quadratic else 4, 3).tolist()
    if element is Element.H20 and sorted(counts)[1] == 1:
        # The eight points of its own rule leave a row of single ones motions without strain.
        counts[:2] = 2, 2
    if element is Element.T10 and max(counts) == 1:
        # The middles of all six of a cube are in one plane: they may have a motion without strain.
        counts[0] = 2
    extents = size * 2.0 ** rng.uniform(-1.2, 0.0, 3)
    grading = tuple(2.0 ** rng.uniform(-1, 1, 3)) if rng.random() < 0.4 else (1.0, 1.0, 1.0)
    return brick(*extents.tolist(), *counts, grading=grading, element=element)


def _distorted(rng: Rng, mesh: Mesh) -> Mesh:
    """Nodes moved, those of a plane side within it, as long as Jacobians stay positive everywhere; sides may bend."""
    if rng.random() < 0.4:
        return mesh
    x, extent = mesh.nodes, np.ptp(mesh.nodes, axis=0)
    spread = extent.min() / (2 if mesh.element.quadratic else 1) / len(mesh.elements) ** (1 / 3)
    bends = rng.random() < 0.3
    shift = rng.uniform(-1, 1, x.shape) * spread
    for axis in range(3):
        low, high = (np.isclose(x[:, axis], end, atol=1e-9 * extent[axis]) for end in (0.0, x[:, axis].max()))
        # Planes of symmetry and bases stay plane; a side that bends does so away from the others.
        shift[low | (high & (axis == 2 or not bends)), axis] = 0.0
    for part in (0.3, 0.15, 0.05):
        nodes = x + part * shift
        if orientation(nodes, mesh.elements) > LEAST_JACOBIAN:
            return Mesh(nodes, mesh.elements, mesh.boundaries)
    return mesh


def _tools(rng: Rng, mesh: Mesh, travel: float) -> tuple[FlatTool, ...]:
    """A punch from above, often askew; sometimes a base or a wall beside."""
    askew = 0.2 * rng.normal(size=2) if rng.random() < 0.3 else np.zeros(2)
    mu = friction(rng, MU)
    # A weld that goes sideways is torn off the sides that supports hold.
    aside = rng.random() < (0.1 if np.isinf(mu) else 0.4)
    way = np.array([*(rng.uniform(-1, 1, 2) * aside), -1.0]) * travel
    sides = ("top", "right", "back")[: 1 if rng.random() < 0.5 else 3]
    punch = _tool(mesh, np.array([*askew, -1.0]), way, sides, gap_at_rest(rng, mesh.size, travel, GAP), mu, _path(rng))
    if not punch.welded and rng.random() < 0.2:
        nodes = mesh.boundary_nodes(*sides)
        chosen = rng.choice(nodes, size=len(nodes) // 2 + 1, replace=False)
        punch = replace(punch, mu_at={int(a): float(rng.uniform(0, 1)) for a in chosen})
    kind = rng.choice(["alone", "base", "wall"], p=[0.55, 0.3, 0.15])
    if kind == "base":
        along = np.array([*rng.uniform(-1, 1, 2), 0.0]) * travel * (rng.random() < 0.4)
        return punch, _tool(mesh, np.array([0.0, 0.0, 1.0]), along, ("base",), 0.0, friction(rng, MU), punch.path)
    if kind == "wall":
        push = np.array([-travel * rng.uniform(0, 1), 0.0, 0.0])
        gap = gap_at_rest(rng, mesh.size, travel, GAP)
        return punch, _tool(mesh, np.array([-1.0, 0.0, 0.0]), push, ("right",), gap, friction(rng, MU), _path(rng))
    return (punch,)


def _tool(
    mesh: Mesh, normal: Floats, travel: Floats, sides: tuple[str, ...], gap: float, mu: float, path: Path
) -> FlatTool:
    """A plane ``gap`` away from the nearest node of its boundaries."""
    n, nodes = normal / np.linalg.norm(normal), mesh.nodes[mesh.boundary_nodes(*sides)]
    point = nodes[np.argmin(nodes @ n)] - gap * n
    return FlatTool(tuple(point.tolist()), tuple(n.tolist()), tuple((travel + 0.0).tolist()), sides, mu, path)


def _capped(rng: Rng, mesh: Mesh, tool: FlatTool) -> FlatTool:
    """Friction as it is, or of constant shear, or capped by it, at some nodes by another part or not at all."""
    kind = str(rng.choice(("none", "constant", "capped"), p=CAPPED))
    if kind == "none" or tool.welded or in_means(tool, faces_of(mesh, tool)):
        return tool
    shear = float(rng.choice([0.0, rng.uniform(0, 1), 1.0], p=[0.05, 0.85, 0.1]))
    if kind == "constant":
        return replace(tool, mu=np.inf, mu_at={}, shear=shear)
    nodes = mesh.boundary_nodes(*tool.candidates)
    some = rng.choice(nodes, size=len(nodes) // 2) if rng.random() < 0.4 else nodes[:0]
    return replace(
        tool, shear=shear, shear_at={int(a): float(rng.choice([rng.uniform(0, 1), np.inf], p=[0.8, 0.2])) for a in some}
    )


def _path(rng: Rng) -> Path:
    """Once, partly back, all the way back and again, hold, one direction after the other."""
    paths: tuple[Path, ...] = (
        ((0.0, 0.0), (1.0, 1.0)),
        ((0.0, 0.0), (0.5, 1.0), (1.0, float(rng.uniform(0, 1)))),
        ((0.0, 0.0), (0.4, 1.0), (0.7, -0.1), (1.0, 1.2)),
        ((0.0, 0.0), (0.6, 1.0), (1.0, 1.0)),
        ((0.0, 0.0), (0.5, (0.0, 0.0, 1.0)), (1.0, (1.0, 1.0, 1.0))),
    )
    return paths[rng.choice(5, p=[0.55, 0.15, 0.1, 0.08, 0.12])]


def drawn_solid_material(rng: Rng, stress: float) -> VonMises:
    """``stress`` is the yield stress; E over it 50 to 1e4, sometimes to 1e12."""
    young = stress * 10.0 ** (rng.uniform(4, 12) if rng.random() < 0.15 else rng.uniform(np.log10(50), 4))
    poisson = float(rng.choice([rng.uniform(-0.5, 0.2), rng.uniform(0.2, 0.4), 0.49, 0.4999]))
    curve = (Perfect(stress), Linear(stress, stress * 10.0 ** rng.uniform(-2, 1)), Voce(stress, stress, 5.0))
    return VonMises(Elasticity(young, poisson), curve[rng.integers(3)])


def _loaded(rng: Rng, scene: Scene, stress: float) -> Scene:
    """Three of ten scenes with one or two loads, sometimes in small strain."""
    if rng.random() < 0.7:
        return scene
    mesh, sides = scene.mesh, ("top", "right", "back")

    def load() -> Load:
        size, side = stress * 10.0 ** rng.uniform(-5, -0.3), str(rng.choice(sides))
        x, y, z = (size * rng.uniform(-1, 1, 3)).tolist()
        kind = rng.choice(["pressure", "traction", "body", "point"], p=[0.45, 0.25, 0.2, 0.1])
        amplitude = Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, float(rng.uniform(-0.5, 1.0)))))
        if kind == "pressure":
            return Pressure(side, size * float(rng.choice([1, 1, -1])), amplitude)
        if kind == "traction":
            return Traction(side, (x, y, z), amplitude)
        if kind == "body":
            return BodyForce((x / mesh.size, y / mesh.size, z / mesh.size), amplitude)
        part = 0.05 * mesh.size**2
        return PointForce(int(rng.choice(mesh.boundary_nodes(*sides))), (part * x, part * y, part * z), amplitude)

    loads = tuple(load() for _ in range(int(rng.integers(1, 3))))
    return replace(
        scene, loads=loads, configuration=Configuration.SMALL if rng.random() < 0.25 else scene.configuration
    )


def _pressed(rng: Rng, scene: Scene, stress: float) -> Scene:
    """One scene of eight with its punch driven by a force, one of eight with a side that is driven instead of held."""
    which, punch = rng.random(), scene.tools[0]
    try:
        if which < 0.125 and isinstance(punch, FlatTool):
            size = stress * scene.mesh.size**2 * 10.0 ** rng.uniform(-3, 0)
            x, y, z = (-size * np.array(punch.normal)).tolist()
            driven = replace(punch, travel=(0.0, 0.0, 0.0), driven_by=Force((-x, -y, -z)))
            return replace(scene, tools=(driven, *scene.tools[1:]))
        if which < 0.25 and scene.supports:
            k = int(rng.integers(len(scene.supports)))
            held = scene.supports[k]
            way = scene.mesh.size * float(rng.choice([-1, 1])) * 10.0 ** rng.uniform(-5, -1)
            other = Prescribed(held.boundary, held.direction, way)
            return replace(scene, supports=(*scene.supports[:k], other, *scene.supports[k + 1 :]))
    except SceneError:
        pass
    return scene
