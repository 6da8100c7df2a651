"""Candidates of an accepted increment in plain arrays: of flat tools by their planes, of shaped ones by outlines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bipot.fem.strain import Configuration
from bipot.scene.scene import Scene
from bipot.state import State
from bipot.tools.deformable import AnyTool
from bipot.tools.tool import FlatTool
from bipot.typing import Bools, Floats, Ints
from studies.fuzz.placed import (
    gone,
    poses,
    taken_along,
    tools_at,
    tools_gone,
    turned_by_moments,
)
from studies.fuzz.points import Points, edges_of, points_of
from studies.fuzz.riding import ridden
from studies.fuzz.surfaces import outlines
from studies.independent.candidates import Contacts, Curved
from studies.independent.data import Setting
from studies.independent.element import place
from studies.independent.riding import Ridden
from studies.independent.sampling import Parts
from studies.independent.shear import Edges, carried, mean_shear
from studies.independent.tools import Going, OnWay, Rigid, met


def displacement(start: State, end: State) -> Floats:
    """That of the increment (a, d) as the state at its end has it; none where it is the start itself."""
    return np.zeros_like(end.nodes) if start is end else end.du


def rigid(scene: Scene, number: int, start: State, end: State) -> Rigid | None:
    """A shaped tool in the increment, None of a flat one."""
    tool = scene.tools[number]
    if isinstance(tool, FlatTool):
        return None
    centre = np.zeros(2) if tool.turn is None else np.array(tool.turn.centre)
    begun, ended = poses(scene, start)[number], poses(scene, end)[number]
    by_moment = float(turned_by_moments(scene, end.translated)[number])
    return Rigid(outlines(tool.face), centre, begun, ended, gone(scene, start, end)[number], by_moment)


def shaped(scene: Scene, start: State, end: State) -> tuple[Rigid, ...]:
    """All shaped tools."""
    found = (rigid(scene, k, start, end) for k in range(len(scene.tools)))
    return tuple(tool for tool in found if tool is not None)


def contacts(scene: Scene, setting: Setting, points: Points, start: State, end: State) -> Contacts:
    """The ``points`` in the increment from ``start`` to ``end``."""
    cap, before = (_caps(scene, setting, points, state) for state in (end, start))
    return replace(facing(scene, setting, points, start, end), cap=cap, cap_before=before)


def facing(scene: Scene, setting: Setting, points: Points, start: State, end: State) -> Contacts:
    """The same without caps: it is not asked what friction they may carry."""
    node, tool = points.node, points.tool
    parts, shapes = Parts.of(points.weights), [rigid(scene, k, start, end) for k in range(len(scene.tools))]
    each = tool[parts.owner]
    flat = [own if isinstance(own, FlatTool) else None for own in scene.tools]
    normal = np.array([(0.0, 1.0) if own is None else own.normal for own in flat]).reshape(-1, 2)
    point = np.array([(0.0, 0.0) if own is None else own.point for own in flat]).reshape(-1, 2)
    mu = np.array([scene.tools[k].mu_at.get(int(a), scene.tools[k].mu) for a, k in zip(node, tool, strict=True)])
    ways = ridden(scene, setting, (start, end), shapes)
    planes = Contacts(
        node=node,
        weights=points.weights,
        rubs=points.rubs,
        tool=tool,
        normal=normal[each],
        mu=mu,
        offset=np.vecdot(normal, point + tools_at(scene, start))[each],
        offset_end=np.vecdot(normal, point + tools_at(scene, end))[each],
        motion=tools_gone(scene, start, end)[each],
        taken=np.zeros((len(each), 2)),
    )
    for k in range(len(scene.tools)):
        own = each == k
        planes.taken[own] = _asked(scene, start, end, parts.node[own], ways[k])(np.ones((int(own.sum()), 1)))
    return planes if None not in flat else _met(scene, setting, planes, (start, end), ways)


def _asked(scene: Scene, start: State, end: State, node: Ints, way: Ridden) -> OnWay:
    """How nodes of a body at rest go that supports and, along a ``way``, other tools take along."""
    by_supports, x = taken_along(scene, start.tau, end.tau)[node], start.nodes[node]
    return lambda fraction: fraction * by_supports + way.after(x, fraction)


def _met(
    scene: Scene, setting: Setting, planes: Contacts, ends: tuple[State, State], ways: Sequence[Ridden]
) -> Contacts:
    """Candidates of which those of shaped tools have the planes that are tangent to these."""
    start, end = ends
    fields = start.nodes, end.nodes, displacement(start, end)
    at, after, du = (nodal[planes.parts.node] for nodal in fields)
    normal, motion = planes.normal.copy(), planes.motion.copy()
    offset, offset_end, curved = planes.offset.copy(), planes.offset_end.copy(), _as_if_flat(planes)
    for k in range(len(scene.tools)):
        tool, own = rigid(scene, k, start, end), planes.met == k
        if tool is None or not own.any():
            continue
        asked = _asked(scene, start, end, planes.parts.node[own], ways[k])
        going = Going(Parts.of(planes.weights[planes.tool == k]), at[own], after[own], du[own], asked)
        found = met(tool, going, setting.whole)
        (curved.normal[own], normal[own]), motion[own] = found.normal, found.gone
        offset[own] = np.vecdot(found.normal[0], at[own]) - found.gap[0]
        offset_end[own] = np.vecdot(found.normal[1], after[own]) - found.gap[1]
        tangent, beside = normal[own][:, ::-1] * (1.0, -1.0), du[own] - found.gone
        curved.opened[own] = found.opened - np.vecdot(normal[own], beside)
        curved.slid[own] = found.slip - np.vecdot(tangent, beside)
        curved.places[own] = tool.extent
        curved.blurred[own] = np.where(found.blurred, tool.extent + np.abs(after[own]).max(axis=1), 0.0)
        curved.apart[planes.tool == k], curved.left[planes.tool == k] = found.apart, found.left
        curved.past[own] = found.past
        curved.stretch[0][own], curved.stretch[1][own] = found.stretch
    return replace(planes, normal=normal, motion=motion, offset=offset, offset_end=offset_end, curved=curved)


def _as_if_flat(planes: Contacts) -> Curved:
    """What nodes have beside their planes where no tool is curved."""
    count = len(planes.normal)
    return Curved(
        normal=planes.normal.copy(),
        stretch=(np.ones(count), np.ones(count)),
        opened=np.zeros(count),
        slid=np.zeros(count),
        blurred=np.zeros(count),
        apart=np.zeros(len(planes.node), dtype=bool),
        left=np.full(len(planes.node), np.inf),
        past=np.zeros(count, dtype=bool),
        places=np.zeros(count),
    )


def _caps(scene: Scene, setting: Setting, points: Points, end: State) -> Floats:
    """What the shear yield stress lets friction carry (c,) where an increment ends."""
    shear = np.array([_share(scene.tools[k], int(a)) for a, k in zip(points.node, points.tool, strict=True)])
    out = np.full(len(points.node), np.inf)
    if not np.isfinite(shear).any():
        return out
    paper = scene.configuration is Configuration.PAPER
    balanced = setting.rest if setting.small else end.nodes - end.du if paper else end.nodes
    volume = place(balanced, setting.elements, setting.quadrature, setting.axisymmetric).volume
    strength = mean_shear(setting.yield_stress(end.peeq), volume)
    for k, tool in enumerate(scene.tools):
        own: Bools = np.isfinite(shear) & (points.tool == k)
        if own.any():
            every = points_of(scene, setting, tool)
            gap, edges = every.weights @ _gaps(scene, k, end), _edges(scene, tool, every.ends)
            most = carried(edges, gap, strength, balanced, end.nodes, setting.axisymmetric)
            out[own] = shear[own] * most[points.number[own]]
    return out


def _share(tool: AnyTool, node: int) -> float:
    return tool.shear_at.get(node, tool.shear)


def _gaps(scene: Scene, number: int, end: State) -> Floats:
    """Of all nodes (a,) at the end."""
    tool, shape = scene.tools[number], rigid(scene, number, end, end)
    if isinstance(tool, FlatTool):
        return (end.nodes - np.array(tool.point) - tools_at(scene, end)[number]) @ np.array(tool.normal)
    assert shape is not None
    return shape.near(shape.seen(end.nodes, shape.ended))[0].gap


def _edges(scene: Scene, tool: AnyTool, points: Ints) -> Edges:
    nodes = edges_of(scene, tool)
    whole = (nodes[:, None, :, None] == scene.mesh.elements[None, :, None, :]).any(axis=-1).all(axis=-1)
    return Edges(nodes, np.argmax(whole, axis=1), points)
