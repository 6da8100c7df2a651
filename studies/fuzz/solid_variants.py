"""A body in space seen otherwise: in other units, with its axes exchanged, mirrored, turned, and numbered otherwise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bipot.meshes.mesh import Mesh
from bipot.scene.loads import BodyForce, Load, PointForce, Pressure, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.typing import Floats, Ints
from studies.fuzz.metals import metals_in
from studies.fuzz.solid_turned import Turned
from studies.independent.solid import places

TURNED = 0.5
"""Of the scenes are turned by any angle, the others' axes exchanged."""


@dataclass(frozen=True)
class SolidVariant:
    """A scene that is the original seen otherwise: original vectors are vectors[number] @ turn over their unit.

    ``number`` (a,) is each original node's here, ``turn`` (3, 3) a rotation or reflection. Forces of tools on nodes
    (tools, a, 3) are ``weight`` times the original ones.
    """

    name: str
    scene: Scene
    number: Ints
    turn: Floats
    length: float = 1.0
    force: float = 1.0
    weight: Floats | float = 1.0

    def comparable(self, forces: Floats) -> Floats:
        """What of the original's forces of tools on nodes (tools, a, 3) this has too."""
        return forces

    def tells(self, nodes: Floats) -> bool:
        """Whether an answer with these ``nodes`` (a, 3) tells anything of the original."""
        return True


def variants(scene: Scene, seed: int) -> list[SolidVariant]:
    """One of each kind, drawn from ``seed``; of two scenes one is turned by any angle, the other as axes allow it."""
    rng = np.random.default_rng([seed, 21])
    turn = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)
    if rng.random() < TURNED:
        turn = _any_turn(rng)
    nodes, elements = rng.permutation(len(scene.mesh.nodes)), rng.permutation(len(scene.mesh.elements))
    return [
        in_units(scene, 10.0 ** rng.uniform(-3, 3), 10.0 ** rng.uniform(-6, 6)),
        turned(scene, turn),
        renumbered(scene, nodes, elements, rng),
    ]


def in_units(scene: Scene, length: float, stress: float) -> SolidVariant:
    """Lengths times ``length``, stresses times ``stress``."""
    mesh, force = scene.mesh, stress * length**2
    seen = Turned(np.eye(3), length=length)

    def load(one: Load) -> Load:
        if isinstance(one, Pressure):
            return replace(one, pressure=one.pressure * stress)
        assert isinstance(one, BodyForce | Traction | PointForce)
        unit = stress / length if isinstance(one, BodyForce) else stress if isinstance(one, Traction) else force
        return replace(one, vector=_times(one.vector, unit))

    def support(one: Support) -> Support:
        return replace(one, displacement=one.displacement * length) if isinstance(one, Prescribed) else one

    other = replace(
        metals_in(scene, stress),
        mesh=Mesh(mesh.nodes * length, mesh.elements, mesh.boundaries, mesh.regions),
        tools=tuple(seen.tool(tool, force) for tool in scene.tools),
        supports=tuple(map(support, scene.supports)),
        loads=tuple(map(load, scene.loads)),
    )
    return SolidVariant("units", other, np.arange(len(mesh.nodes)), np.eye(3), length, force)


def turned(scene: Scene, turn: Floats) -> SolidVariant:
    """The new vector of v is ``turn`` v: axes exchanged and reversed, or any rotation or reflection.

    Frames of friction are others, and supports along axes are along none where these stay none.
    """
    mesh, seen = scene.mesh, Turned(turn)
    order = np.arange(mesh.element.nodes) if np.linalg.det(turn) > 0 else mesh.element.mirrored
    other = replace(
        scene,
        mesh=Mesh(mesh.nodes @ turn.T + 0.0, mesh.elements[:, order], mesh.boundaries, mesh.regions),
        tools=tuple(map(seen.tool, scene.tools)),
        supports=tuple(map(seen.support, scene.supports)),
        loads=tuple(map(seen.load, scene.loads)),
    )
    return SolidVariant("exchanged" if seen.exchanges else "turned", other, np.arange(len(mesh.nodes)), turn)


def _any_turn(rng: np.random.Generator) -> Floats:
    """Any rotation, or one with a reflection."""
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q * np.sign(np.diag(R))


def renumbered(scene: Scene, nodes: Ints, elements: Ints, rng: np.random.Generator) -> SolidVariant:
    """Node a becomes ``nodes[a]``; elements in the order ``elements``, each begun at a corner drawn by ``rng``."""
    mesh = scene.mesh
    x = np.empty_like(mesh.nodes)
    x[nodes] = mesh.nodes
    cells = nodes[mesh.elements[elements]]
    turns = symmetries(mesh.element.nodes)
    cells = np.take_along_axis(cells, turns[rng.integers(len(turns), size=len(cells))], axis=1)
    boundaries = {name: nodes[faces] for name, faces in mesh.boundaries.items()}
    tools = tuple(
        replace(
            tool,
            mu_at={int(nodes[a]): mu for a, mu in tool.mu_at.items()},
            shear_at={int(nodes[a]): m for a, m in tool.shear_at.items()},
        )
        for tool in scene.tools
    )
    loads = tuple(
        replace(load, node=int(nodes[load.node])) if isinstance(load, PointForce) else load for load in scene.loads
    )
    regions = {name: np.flatnonzero(np.isin(elements, members)) for name, members in mesh.regions.items()}
    other = replace(scene, mesh=Mesh(x, cells, boundaries, regions), tools=tools, loads=loads)
    return SolidVariant("renumbered", other, nodes, np.eye(3))


def symmetries(count: int) -> Ints:
    """Orders (s, count) of an element's nodes by which it is itself turned: 24 of a brick, 12 of a tetrahedron."""
    x = places(count)
    middle, cube = x[: 8 if count in (8, 20) else 4].mean(axis=0), count in (8, 20)
    corners = x[: 8 if cube else 4] - middle
    if cube:
        maps = [np.eye(3)[list(p)] * np.array(s) for p in np.ndindex(3, 3, 3) for s in _signs() if len(set(p)) == 3]
    else:
        base = (corners[1:] - corners[0]).T
        orders = [p for p in np.ndindex(4, 4, 4, 4) if len(set(p)) == 4]
        maps = [(corners[list(p[1:])] - corners[p[0]]).T @ np.linalg.inv(base) for p in orders]
    turns = [A for A in maps if np.linalg.det(A) > 0]
    moved = [(x - middle) @ A.T + middle for A in turns]
    return np.array([np.abs(y[:, None] - x).sum(axis=2).argmin(axis=1) for y in moved])


def _signs() -> list[tuple[int, int, int]]:
    return [(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]


def _times(vector: tuple[float, ...], factor: float) -> tuple[float, ...]:
    return tuple(v * factor for v in vector)
