"""Shaped tools of a drawn scene that forces press and moments turn, supports between axes: each by a stream of its own.

Two of five scenes are to have the former, one of five the latter; all others stay as they were drawn. What the library
refuses is drawn again, or left as it was.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.tool import ShapedTool
from bipot.typing import Floats
from studies.fuzz.driven import carried, force_amplitude, motion_amplitude
from studies.fuzz.meshes import Rng
from studies.fuzz.surfaces import outlines, pair

LED, ASLANT = 0.4, 0.2
"""Of the scenes have a shaped tool that is driven, and a support between the axes."""

TRIES = 6

KINDS = "force", "moment", "both"

MOMENTS = (
    Amplitude(),
    Amplitude(((0.0, 0.0), (0.4, 0.0), (1.0, 1.0))),
    Amplitude(((0.0, 0.0), (0.4, 1.0), (1.0, -0.6))),
    Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 1.0))),
)
"""All the way, once the tool is pressed, there and to the other side, and held."""


def led(rng: Rng, scene: Scene) -> Scene:
    """Some scenes with one or two of their shaped tools driven."""
    if rng.random() >= LED:
        return scene
    shaped = [k for k, tool in enumerate(scene.tools) if isinstance(tool, ShapedTool)]
    chosen = shaped if rng.random() < 0.4 else [int(rng.choice(shaped))]
    for k in chosen:
        for _ in range(TRIES):
            try:
                tools = [_driven(rng, scene, tool) if j == k else tool for j, tool in enumerate(scene.tools)]
                scene = replace(scene, tools=tuple(tools))
                break
            except SceneError:
                continue
    return scene


def _driven(rng: Rng, scene: Scene, tool: Any) -> ShapedTool:
    """A tool driven by what is drawn: a force about along the normal where it is nearest, a moment about a centre."""
    assert isinstance(tool, ShapedTool)
    plane = scene.geometry is Geometry.PLANE_STRAIN
    kind = str(rng.choice(KINDS, p=[0.25, 0.4, 0.35])) if plane else "force"
    x, normal = _nearest(scene, tool)
    if kind != "moment":
        tool = _pressed(rng, scene, tool, normal)
    return (
        _turned(rng, scene, tool, x, normal)
        if kind != "force"
        else replace(tool, turn=None if not plane else tool.turn)
    )


def _nearest(scene: Scene, tool: ShapedTool) -> tuple[Floats, Floats]:
    """The candidate that the tool is nearest to, and the normal there (2,)."""
    x = scene.mesh.nodes[scene.mesh.boundary_nodes(*tool.candidates)]
    found = [outline.near(x) for outline in outlines(tool.surface)]
    which = int(np.argmin([near.gap.min() for near in found]))
    nearest = int(np.argmin(found[which].gap))
    return x[nearest], found[which].normal[nearest]


def _pressed(rng: Rng, scene: Scene, tool: ShapedTool, normal: Floats) -> ShapedTool:
    """Along the normal, an axis, or up to half a right angle off it, up to a little above what yields the body."""
    off = float(rng.uniform(-0.7, 0.7)) if rng.random() < 0.3 else 0.0
    way = np.array([[np.cos(off), -np.sin(off)], [np.sin(off), np.cos(off)]]) @ normal
    if scene.geometry is Geometry.AXISYMMETRIC or rng.random() < 0.5:
        # A plane of symmetry that cuts it, or the axis, leaves it one direction.
        axis = 1 if scene.geometry is Geometry.AXISYMMETRIC else int(np.argmax(np.abs(normal)))
        way = np.sign(normal[axis]) * np.eye(2)[axis]
    across = np.array([way[1], -way[0]])
    travel = float(across @ tool.travel) * across if rng.random() < 0.5 else np.zeros(2)
    size = 10.0 ** rng.uniform(-2.5, 0.1) * carried(scene, tool)
    return replace(tool, travel=pair(travel), driven_by=Force(pair(size * way), force_amplitude(rng)))


def _turned(rng: Rng, scene: Scene, tool: ShapedTool, x: Floats, normal: Floats) -> ShapedTool:
    """By nothing, or up to what friction may hold; about the middle of a round tool, or near to or far from where it is
    nearest."""
    surface, extent = tool.surface, scene.mesh.size
    round_ = isinstance(surface, Circle) and not surface.concave
    if isinstance(surface, Circle) and round_ and rng.random() < 0.6:
        centre, lever = np.array(surface.centre), surface.radius
    else:
        beside = np.array([normal[1], -normal[0]]) * float(rng.uniform(-0.5, 0.5)) * extent
        far = extent * 10.0 ** rng.uniform(-1, 1.5) * float(rng.choice([-1.0, 1.0], p=[0.8, 0.2]))
        centre, lever = x + far * normal + beside, abs(far)
    share = min(tool.mu, 0.6) * float(rng.choice([0.0, 10.0 ** rng.uniform(-5, -0.5)], p=[0.25, 0.75]))
    moment = share * 0.5 * carried(scene, tool) * lever * float(rng.choice([-1.0, 1.0]))
    driven = Moment(moment, MOMENTS[rng.choice(4, p=[0.2, 0.5, 0.2, 0.1])])
    return replace(tool, turn=Turn(0.0, pair(centre), driven_by=driven))


def aslant(rng: Rng, scene: Scene) -> Scene:
    """Some scenes with a support that is, or is now, between the axes, at rest or driven."""
    if rng.random() >= ASLANT:
        return scene
    touched = {name for tool in scene.tools for name in tool.candidates}
    names = [name for name in scene.mesh.boundaries if name != "axis"]
    weights = np.array([0.3 if name in touched else 1.0 for name in names])
    for _ in range(TRIES):
        boundary, angle = str(rng.choice(names, p=weights / weights.sum())), float(rng.uniform(0, 2 * np.pi))
        if rng.random() < 0.2:
            # Next to an axis, or to another support.
            angle = float(rng.integers(4)) * np.pi / 2 + 10.0 ** rng.uniform(-8, -1)
        along = math.cos(angle), math.sin(angle)
        others = tuple(s for s in scene.supports if s.boundary != boundary or isinstance(s, Symmetry))
        kept = scene.supports if rng.random() < 0.3 else others
        far = scene.mesh.size * 10.0 ** rng.uniform(-6, -1)
        moves = rng.random() < 0.4
        support = Prescribed(boundary, along, far, motion_amplitude(rng)) if moves else Support(boundary, along)
        try:
            return replace(scene, supports=(*kept, support))
        except SceneError:
            continue
    return scene
