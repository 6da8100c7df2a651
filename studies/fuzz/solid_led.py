"""Shaped tools of drawn bodies in space that forces press and moments turn: by a stream of its own.

Two of five scenes are to have one; what the library refuses is drawn again, or left as it was.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot.errors import SceneError
from bipot.scene.scene import Scene
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.tool import ShapedTool
from bipot.typing import Floats
from studies.fuzz.driven import force_amplitude
from studies.fuzz.led import KINDS, MOMENTS, TRIES
from studies.fuzz.meshes import Rng
from studies.fuzz.solid_placed import cuts
from studies.fuzz.solid_surfaces import faces
from studies.independent.revolved import Round, nearest

LED = 0.4
"""Of the scenes have a shaped tool that is driven."""


def led(rng: Rng, scene: Scene) -> Scene:
    """Some scenes with one of their shaped tools driven."""
    if rng.random() >= LED:
        return scene
    shaped = [k for k, tool in enumerate(scene.tools) if isinstance(tool, ShapedTool)]
    k = int(rng.choice(shaped))
    for _ in range(TRIES):
        try:
            tools = [_driven(rng, scene, tool) if j == k else tool for j, tool in enumerate(scene.tools)]
            return replace(scene, tools=tuple(tools))
        except SceneError:
            continue
    return scene


def _driven(rng: Rng, scene: Scene, tool: object) -> ShapedTool:
    """A tool driven by a force about along the normal where it is nearest, a moment about an axis, or both."""
    assert isinstance(tool, ShapedTool)
    kind, own = str(rng.choice(KINDS, p=[0.5, 0.25, 0.25])), faces(tool.surface)
    x = scene.mesh.nodes[scene.mesh.boundary_nodes(*tool.candidates)]
    seen = nearest(own, x)
    at = x[np.argmin(seen.gap)], seen.normal[np.argmin(seen.gap)]
    planes = [way for way, _ in cuts(scene, tool)]
    if kind != "moment":
        tool = _pressed(rng, scene, tool, at[1], planes)
    return tool if kind == "force" or len(planes) > 1 else _turned(rng, scene, tool, at, planes)


def _pressed(rng: Rng, scene: Scene, tool: ShapedTool, normal: Floats, planes: list[Floats]) -> ShapedTool:
    """Along the normal, or off it, in planes of symmetry that cut it; up to a little above what yields the body."""
    way = normal + (rng.uniform(-0.6, 0.6, 3) if rng.random() < 0.4 else 0.0)
    for across in planes:
        way = way - (way @ across) * across
    way, travel = way / np.linalg.norm(way), np.array(tool.travel)
    travel = (travel - (travel @ way) * way) * float(rng.random() < 0.5)
    size = 10.0 ** rng.uniform(-2.5, 0.1) * carried(scene, tool) * 2 ** len(planes)
    return replace(
        tool, travel=tuple((travel + 0.0).tolist()), driven_by=Force(tuple((size * way).tolist()), force_amplitude(rng))
    )


def _turned(rng: Rng, scene: Scene, tool: ShapedTool, at: tuple[Floats, Floats], planes: list[Floats]) -> ShapedTool:
    """By nothing, or up to about what friction holds; about its own axis, or near or far from where it is nearest."""
    (x, normal), own = at, faces(tool.surface)[0]
    axis, side = rng.normal(size=3), float(rng.choice([-1.0, 1.0], p=[0.8, 0.2]))
    far = scene.mesh.size * 10.0 ** rng.uniform(-1, 1) * side
    axis = planes[0] if planes else axis - (axis @ normal) * normal * float(rng.random() < 0.6)
    centre = x + far * normal
    if isinstance(own, Round) and rng.random() < 0.75:
        centre = own.middle
        axis = own.axis if not planes and rng.random() < 0.7 else axis
    lever = max(float(np.linalg.norm(centre - x)), 0.1 * scene.mesh.size)
    share = min(tool.mu, 0.6) * float(rng.choice([0.0, 10.0 ** rng.uniform(-3, 0.1)], p=[0.25, 0.75]))
    moment = share * _pressing(scene, tool) * lever * float(rng.choice([-1.0, 1.0]))
    driven, unit = Moment(moment, MOMENTS[rng.choice(4, p=[0.2, 0.5, 0.2, 0.1])]), axis / np.linalg.norm(axis)
    return replace(tool, turn=Turn(0.0, tuple(centre.tolist()), driven_by=driven, axis=tuple(unit.tolist())))


def _pressing(scene: Scene, tool: ShapedTool) -> float:
    """About what presses the tool: the force that drives it, or what the body answers its path with."""
    if tool.driven_by is not None:
        return tool.driven_by.size
    strain = float(np.linalg.norm(tool.travel)) / scene.mesh.size
    stress = scene.material.elasticity.young * strain / float(scene.material.yield_stress(0.0))
    return 0.1 * min(stress, 1.0) * carried(scene, tool)


def carried(scene: Scene, tool: ShapedTool) -> float:
    """About what the yield stress carries on the first boundary of the tool."""
    extents = np.sort(np.ptp(scene.mesh.nodes[scene.mesh.boundary_nodes(tool.candidates[0])], axis=0))
    return float(extents[1] * extents[2]) * float(scene.material.yield_stress(0.0))
