"""Forces that drive tools of a drawn scene, and supports that move: each from a stream of its own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.deformable import AnyTool
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool
from bipot.typing import Floats
from studies.flat import axis_of, flat_tools
from studies.fuzz.meshes import Rng

FORCED, PRESCRIBED = 1 / 6, 1 / 7
"""Of the scenes have a tool that a force drives, and a support that moves."""

KINDS = ("normal", "mixed", "oblique", "tangential")
CUT = 1e-9
TRIES = 4


def forced(rng: Rng, scene: Scene) -> Scene:
    """One of six scenes with a tool that a force drives, sometimes two: up to a little above what yields the body.

    What the library refuses of it is refused.
    """
    if rng.random() >= FORCED:
        return scene
    tools, count = list(flat_tools(scene)), len(scene.tools)
    first = 0 if rng.random() < 0.75 else int(rng.integers(count))
    force = _force(rng, scene, tools[first])
    tools[first] = force
    if count > 1 and rng.random() < 0.35:
        other = 1 - first
        answer = force.driven_by if force.driven_by is not None and rng.random() < 0.6 else None
        tools[other] = _force(rng, scene, tools[other]) if answer is None else _against(tools[other], answer)
    return replace(scene, tools=tuple(tools))


def _force(rng: Rng, scene: Scene, tool: FlatTool) -> FlatTool:
    """The tool driven by a force along its normal, oblique or along its tangent, with a path across it."""
    planes = {axis_of(s) for s in scene.supports if isinstance(s, Symmetry)}
    cut = [d for d in planes if abs(tool.normal[d]) < CUT]
    ring = scene.geometry is Geometry.AXISYMMETRIC
    kind = str(rng.choice(KINDS, p=[0.5, 0.2, 0.15, 0.15]))
    normal = np.array(tool.normal)
    tangent = np.array([normal[1], -normal[0]]) * rng.choice([-1.0, 1.0])
    length, gone = math.hypot(*tool.travel) or 1e-3 * scene.mesh.size, float(normal @ tool.travel)
    share, reach = float(rng.uniform(0.05, 1.3)), float(rng.uniform(-1, 1)) * length
    angle = float(rng.uniform(0.1, 0.5 * np.pi)) if rng.random() < 0.3 else float(rng.uniform(0.02, 0.4))
    sideways = bool(cut) or (ring and abs(normal[1]) > 0.5)
    if sideways or (ring and abs(normal[1]) < CUT):
        # The plane, or the ring, leaves one direction: along the normal of a punch, the tangent of a wall.
        kind = "normal" if sideways and rng.random() < 0.97 else "tangential"
    way = {
        "normal": normal,
        "mixed": normal,
        "oblique": np.cos(angle) * normal + np.sin(angle) * tangent,
        "tangential": tangent,
    }[kind]
    if ring and sideways and kind == "normal":
        way = np.array([0.0, np.sign(normal[1])])
    across = np.array([way[1], -way[0]])
    travel = {"normal": 0.0, "mixed": reach, "oblique": 0.0, "tangential": gone * float(normal @ across)}[kind] * across
    # Friction carries a share of what presses, which the path does here.
    size = share * carried(scene, tool) * 2 ** len(cut)
    if kind == "tangential":
        young = scene.material.elasticity.young
        pressed = min(1.0, young * length / (scene.mesh.size * float(scene.material.yield_stress(0.0))))
        size *= float(min(tool.mu, 0.6) or 0.1) * pressed
    return replace(tool, travel=_pair(travel), driven_by=Force(_pair(size * way), force_amplitude(rng)))


def _against(tool: FlatTool, force: Force) -> FlatTool:
    """The tool driven by the opposite force, where that does not pull it off."""
    way = -np.array(force.vector)
    if way @ tool.normal <= 0:
        return tool
    across = np.array([way[1], -way[0]]) / np.hypot(*way)
    return replace(
        tool, travel=_pair(float(across @ tool.travel) * across), driven_by=replace(force, vector=_pair(way))
    )


def carried(scene: Scene, tool: AnyTool) -> float:
    """The yield stress on the first boundary of the tool: on its width, or its ring."""
    nodes = scene.mesh.nodes[scene.mesh.boundary_nodes(tool.candidates[0])]
    (left, low), (right, high) = nodes.min(axis=0), nodes.max(axis=0)
    width, height = float(right - left), float(high - low)
    if scene.geometry is Geometry.AXISYMMETRIC:
        area = max(float(np.pi * (right**2 - left**2)), float(2 * np.pi * right * height))
    else:
        area = max(width, height)
    return area * float(scene.material.yield_stress(0.0))


def force_amplitude(rng: Rng) -> Amplitude:
    """Once, held, partly unloaded, there and back and above, at once."""
    every = (
        ((0.0, 0.0), (1.0, 1.0)),
        ((0.0, 0.0), (0.4, 1.0), (1.0, 1.0)),
        ((0.0, 0.0), (0.5, 1.0), (1.0, float(rng.uniform(0.05, 0.9)))),
        ((0.0, 0.0), (0.3, 1.0), (0.6, 0.2), (1.0, 1.05)),
        ((0.0, 1.0), (1.0, 1.0)),
    )
    return Amplitude(every[rng.choice(5, p=[0.45, 0.15, 0.25, 0.08, 0.07])])


def prescribed(rng: Rng, scene: Scene) -> Scene:
    """One of seven scenes with a boundary that a support drives along an axis, mostly one that no tool may touch.

    Of some draws the first that the library takes: where two supports ask a corner for two motions it does not.
    """
    if rng.random() >= PRESCRIBED:
        return scene
    touched = {name for tool in scene.tools for name in tool.candidates}
    names = [name for name in scene.mesh.boundaries if name != "axis"]
    for _ in range(TRIES):
        weights = np.array([0.15 if name in touched else 1.0 for name in names])
        boundary, direction = str(rng.choice(names, p=weights / weights.sum())), int(rng.integers(2))
        far = scene.mesh.size * 10.0 ** rng.uniform(-6, -1) * float(rng.choice([-1.0, 1.0]))
        support = Prescribed(boundary, direction, far, motion_amplitude(rng))
        others = tuple(s for s in scene.supports if not _same(s, support))
        try:
            return replace(scene, supports=(*others, support))
        except SceneError:
            continue
    return scene


def _same(support: Support, other: Support) -> bool:
    return (support.boundary, support.direction) == (other.boundary, other.direction)


def motion_amplitude(rng: Rng) -> Amplitude:
    """Once, held, partly or all the way back and beyond."""
    every = (
        ((0.0, 0.0), (1.0, 1.0)),
        ((0.0, 0.0), (0.5, 1.0), (1.0, 1.0)),
        ((0.0, 0.0), (0.5, 1.0), (1.0, float(rng.uniform(-0.5, 0.8)))),
    )
    return Amplitude(every[rng.choice(3, p=[0.6, 0.15, 0.25])])


def _pair(vector: Floats) -> tuple[float, float]:
    """Two numbers, without signed zeros."""
    return float(vector[0]) + 0.0, float(vector[1]) + 0.0
