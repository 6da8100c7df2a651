"""Bodies in space under tools that are not flat: curved, turning about axes, with friction that the yield stress caps.

Each is the body of the same seed under flat tools, of which one or all get another surface: balls and bowls, rolls,
barrels, cones, punches, rings, several of these, or a plane that turns (:mod:`studies.fuzz.solid_shapes`). It looks
where the flat one looked, and is put as far off the body as that was, on planes of symmetry or beside. Of some the
forces that press them and the moments that turn them are given (:mod:`studies.fuzz.solid_led`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry
from bipot.tools.deformable import AnyTool
from bipot.tools.poses import Turn
from bipot.tools.tool import FlatTool, ShapedTool
from bipot.typing import Floats
from studies.flat import flat
from studies.fuzz.meshes import Rng
from studies.fuzz.scenes import Drawn, cut_by_planes
from studies.fuzz.shaped import ALONE, AMPLITUDES, UNCAPPED, capped, lowered, tried
from studies.fuzz.solid_held import planes_of
from studies.fuzz.solid_led import led
from studies.fuzz.solid_points import faces_of, in_means
from studies.fuzz.solid_scenes import FORMS, draw_solid
from studies.fuzz.solid_shapes import drawn as drawn_shape
from studies.fuzz.solid_supports import sides
from studies.fuzz.solid_surfaces import CUT, faces
from studies.fuzz.solid_turned import Turned
from studies.independent.revolved import Round, nearest

SYMMETRIC, TURNING = 0.6, 0.5
"""Of the bodies that planes cut have tools that these cut too; of the tools that may turn do."""

EXACT = FORMS[:3]
"""Forms that solve for whatever drives a tool."""

MOST = 0.6
"""Of the angles (radians) that tools turn by."""


def draw_solid_shaped(seed: int) -> Drawn:
    """The body in space of ``seed`` under other tools; always the same.

    Raises:
        SceneError: no draw made a scene that the library takes.
    """
    rng, drawn = np.random.default_rng([seed, 30]), draw_solid(seed)

    def made() -> Scene:
        shaped = _shaped(rng, drawn.scene, caps=drawn.form not in UNCAPPED)
        return led(np.random.default_rng([seed, 31]), shaped)

    scene = tried(made)
    led_by = any(t.driven_by is not None or (t.turn is not None and t.turn.driven_by is not None) for t in scene.tools)
    # What penalised forms and Delassus' refuse by their nature says nothing of tools in space.
    form = str(rng.choice(EXACT)) if led_by and drawn.form not in EXACT else drawn.form
    return replace(drawn, scene=scene, form=form)


def _shaped(rng: Rng, scene: Scene, caps: bool) -> Scene:
    """The scene with other tools, whose friction is capped if there are to be ``caps``.

    Sides that are held are planes of symmetry, or not, as the tools let them.
    """
    symmetric = bool(rng.random() < SYMMETRIC)
    held = tuple(Support(s.boundary, s.direction) if isinstance(s, Symmetry) else s for s in scene.supports)
    planes = [(way, float((scene.mesh.nodes[inside] @ way).mean())) for way, inside in planes_of(scene)]
    every = range(len(scene.tools))
    chosen = [int(rng.choice(every))] if len(every) > 1 and rng.random() < ALONE else list(every)
    tools = list[AnyTool](scene.tools)
    for k in chosen:
        tool = _tool(rng, scene, flat(tools[k]), planes if symmetric else [])
        corners = faces_of(scene.mesh, tool)
        nodes = np.unique(corners[:, : corners.shape[1] // 2] if in_means(tool, corners) else corners)
        tools[k] = capped(rng, tool, nodes) if caps and not tool.capped else tool
    if symmetric:
        return replace(scene, tools=tuple(tools))
    other = replace(scene, supports=held, tools=tuple(tools))
    return cut_by_planes(rng, other, sides(scene.mesh)) if planes else other


def _tool(rng: Rng, scene: Scene, tool: FlatTool, planes: list[tuple[Floats, float]]) -> ShapedTool:
    """A shaped tool for a flat one, its own mirror image in those of the ``planes`` that cut the latter."""
    x, normal = scene.mesh.nodes[scene.mesh.boundary_nodes(*tool.candidates)], np.array(tool.normal)
    cut = [(way, at) for way, at in planes if abs(float(way @ normal)) <= CUT]
    axes = _axes(rng, normal, [way for way, _ in cut])
    extent = max(float(np.ptp(x @ axes[:, :2], axis=0).max()), 0.3 * scene.mesh.size)
    foot, travel = x[rng.integers(len(x))], np.array(tool.travel)
    for way, at in cut:
        foot, travel = foot - (foot @ way - at) * way, travel - (travel @ way) * way
    turns = not cut and tool.driven_by is None
    local, gap = drawn_shape(rng, extent, bool(cut), turns), float(((x - tool.point) @ normal).min())
    own = faces(Turned(axes, foot).surface(local))
    least = lowered(lambda by: float(nearest(own, x - by * normal).gap.min()), gap, 2 * scene.mesh.size)
    surface = Turned(axes, foot + least * normal).surface(local)
    shaped = ShapedTool(
        surface,
        tuple((travel + 0.0).tolist()),
        tool.candidates,
        tool.mu,
        tool.path,
        tool.mu_at,
        tool.driven_by,
        tool.sampling,
        tool.shear,
        tool.shear_at,
    )
    lid = not any(isinstance(face, Round) for face in own) and len(own) == 1
    if not lid and (tool.driven_by is not None or rng.random() >= TURNING):
        return shaped
    return _turning(rng, shaped, (foot, normal), [way for way, _ in cut], extent)


def _axes(rng: Rng, normal: Floats, cut: list[Floats]) -> Floats:
    """The rotation (3, 3) of what is above a body to where it looks along ``normal``: x along a plane's normal."""
    way = cut[int(rng.integers(len(cut)))] if cut else rng.normal(size=3)
    first = way - (way @ normal) * normal
    first = first / np.linalg.norm(first)
    return np.column_stack([first, np.cross(-normal, first), -normal])


def _turning(rng: Rng, tool: ShapedTool, at: tuple[Floats, Floats], cut: list[Floats], extent: float) -> ShapedTool:
    """The tool as it turns, if planes of symmetry let it; ``at`` are the foot of it and the normal there."""
    if len(cut) > 1:
        return tool
    (foot, normal), own = at, faces(tool.surface)[0]
    centre, axis = foot + rng.uniform(-1, 0.5) * extent * normal, cut[0] if cut else rng.normal(size=3)
    kind = str(rng.choice(["own", "drill", "any"], p=[0.5, 0.25, 0.25]))
    if kind == "own" and isinstance(own, Round) and (not cut or np.linalg.norm(np.cross(own.axis, cut[0])) <= CUT):
        centre, axis = own.middle, own.axis
    elif kind == "drill" and not cut:
        axis = normal
    way = float(np.linalg.norm(tool.travel)) or 1e-3 * extent
    angle = min(way / extent * 10.0 ** rng.uniform(-1.5, 0.5), MOST) * float(rng.choice([-1.0, 1.0]))
    amplitude = AMPLITUDES[rng.choice(3, p=[0.6, 0.25, 0.15])]
    unit = tuple((axis / np.linalg.norm(axis)).tolist())
    return replace(tool, turn=Turn(angle, tuple(centre.tolist()), amplitude, axis=unit))
