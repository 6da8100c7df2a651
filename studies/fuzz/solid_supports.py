"""What holds and cuts drawn bodies in space: sides along their normals, supports between the axes, some driven."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot.errors import SceneError
from bipot.meshes.mesh import Mesh
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.tool import FlatTool
from bipot.typing import Vector
from studies.fuzz.driven import motion_amplitude
from studies.fuzz.meshes import Rng

SIDES = (("left", 0), ("front", 1), ("base", 2))
"""Of a brick, with the axes of their normals."""

LEANING, ASLANT = 0.15, 0.25
"""Of the bodies have a side that leans, and a support between the axes."""

TRIES = 6


def leaning(rng: Rng, mesh: Mesh) -> Mesh:
    """Some bodies sheared along one axis: the side across it leans, all other sides stay in their planes."""
    if rng.random() >= LEANING:
        return mesh
    x, (side, other) = mesh.nodes.copy(), [(0, 1), (0, 2), (1, 2)][rng.integers(3)]
    x[:, side] += float(rng.uniform(-0.4, 0.4)) * x[:, other]
    return Mesh(x, mesh.elements, mesh.boundaries)


def sides(mesh: Mesh) -> list[tuple[str, int | Vector]]:
    """The three sides of a brick in planes through the origin, with their normals: axes, or unit vectors."""
    out = list[tuple[str, int | Vector]]()
    for name, axis in SIDES:
        x = mesh.nodes[mesh.boundary_nodes(name)]
        _, sizes, ways = np.linalg.svd(x / np.abs(mesh.nodes).max())
        straight = np.abs(x[:, axis]).max() <= 1e-12 * mesh.size
        normal = ways[2] / np.linalg.norm(ways[2])
        out.append((name, axis if straight or sizes[2] > 1e-12 else tuple((normal * np.sign(normal[axis])).tolist())))
    return out


def supports(rng: Rng, mesh: Mesh, tools: tuple[FlatTool, ...]) -> tuple[Support, ...]:
    """Any of three sides along their normals, some of them, a clamped base, or nothing; no base on a tool."""
    based = any("base" in tool.candidates for tool in tools)
    held = [Support(name, along) for name, along in sides(mesh) if not (based and name == "base")]
    kind = rng.choice(
        ["all", "some", "clamped", "none"], p=[0.6, 0.15, 0.1, 0.15] if based else [0.7, 0.15, 0.13, 0.02]
    )
    if kind == "none":
        return ()
    if kind == "clamped":
        return tuple(held) if based else tuple(Support("base", axis) for axis in range(3))
    if kind == "some":
        held = [support for support in held if support.boundary == "base" or rng.random() < 0.5]
    if rng.random() < 0.15:
        held += [Support(*[("back", 1), ("right", 0), ("back", 0)][rng.integers(3)])]
    return tuple(held)


def aslant(rng: Rng, scene: Scene) -> Scene:
    """Some scenes with a support that is, or is now, between the axes, at rest or driven.

    What the library refuses is drawn again, or left as it was.
    """
    if rng.random() >= ASLANT:
        return scene
    touched = {name for tool in scene.tools for name in tool.candidates}
    names = list(scene.mesh.boundaries)
    weights = np.array([0.3 if name in touched else 1.0 for name in names])
    for _ in range(TRIES):
        boundary, way = str(rng.choice(names, p=weights / weights.sum())), rng.normal(size=3)
        if rng.random() < 0.2:
            # Next to an axis, or to another support.
            way = np.eye(3)[rng.integers(3)] + 10.0 ** rng.uniform(-8, -1) * way
        x, y, z = (way / np.linalg.norm(way)).tolist()
        others = tuple(s for s in scene.supports if s.boundary != boundary or isinstance(s, Symmetry))
        kept = scene.supports if rng.random() < 0.3 else others
        far = scene.mesh.size * 10.0 ** rng.uniform(-6, -1)
        moves = rng.random() < 0.4
        support = Prescribed(boundary, (x, y, z), far, motion_amplitude(rng)) if moves else Support(boundary, (x, y, z))
        try:
            return replace(scene, supports=(*kept, support))
        except SceneError:
            continue
    return scene
