"""Scenes of several parts marched and judged: increments by the independent measures, runs by those in other views.

What faces what, and the means there, are those of :mod:`studies.independent.facing` in the configuration at the end;
everything else is measured as in scenes of one body. Where a mean vanishes single places overlap: what lies beside is
not asked.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from bipot.scene.scene import Scene
from bipot.state import State
from bipot.tools.deformable import DeformableTool
from bipot.typing import Bools, Floats, Ints
from studies.fuzz.judge import DISAGREEMENT, Ran, broken, energy_error, excuses, known, run
from studies.fuzz.parts import View, draw_parts, views
from studies.fuzz.parts_held import carried
from studies.fuzz.parts_stated import deeper, misstated, unspent
from studies.fuzz.record import IN_PLANE, reported_unique, setting_of, step_at
from studies.fuzz.row import Row, concluded, ended
from studies.fuzz.scenes import Drawn
from studies.independent.candidates import Contacts
from studies.independent.data import Setting
from studies.independent.facing import Seen, seen
from studies.independent.increment import Measures, measure

FAR = 1e3
"""Gap, over the body's size, of what faces nothing."""


def judge_parts(seed: int, others: bool = True) -> Row:
    """The row of a seed's scene of several parts; ``others`` says whether it is run in other views too."""
    return ended(known("parts", seed, draw_parts, partial(_judged, others=others)))


def means(scene: Scene, nodes: Floats) -> list[Seen]:
    """The points of each tool with nodes at ``nodes`` (a, 2)."""
    out = []
    for tool in scene.tools:
        assert isinstance(tool, DeformableTool)
        one, other = (_edges(scene, names) for names in (tool.candidates, tool.surface))
        out.append(seen(scene.mesh.nodes, nodes, one, other, scene.ring, welded=tool.welded))
    return out


def overlap_of(scene: Scene, nodes: Floats) -> float:
    """The largest depth of any side in the one that it faces, along normals of either, over the size."""
    deepest = 0.0
    for tool in scene.tools:
        assert isinstance(tool, DeformableTool)
        one, other = (_edges(scene, names) for names in (tool.candidates, tool.surface))
        for sides in ((one, other), (other, one)):
            deepest = max(deepest, -seen(scene.mesh.nodes, nodes, *sides, scene.ring).lowest)
    return deepest / scene.mesh.size


def contacts_of(scene: Scene, setting: Setting, start: State, end: State) -> Contacts:
    """All points in the increment from ``start`` to ``end``.

    Gaps of the start are those of its own means, but of those of the end where a point faces nothing, or a rounded end,
    at one of both ends; unless it bears forces at both.
    """
    found, at_start = means(scene, end.nodes), means(scene, start.nodes)
    tool = np.repeat(np.arange(len(found)), [len(of.node) for of in found])
    node, weights, normal, part, off = _joined(found)
    normal, inside = _in_planes(setting, node, normal)
    mu = [scene.tools[k].mu_at.get(int(a), scene.tools[k].mu) for a, k in zip(node, tool, strict=True)]
    owner, a = np.nonzero(weights)
    away = np.where(part > 0, off, FAR * setting.size - np.vecdot(normal, end.nodes[node]))
    apart = np.where(_own(scene, tool)[owner, a], -away[owner], 0.0)
    none = np.zeros((len(owner), 2))
    _, earlier, way, faced, farther = _joined(at_start)
    way, _ = _in_planes(setting, node, way)
    here, there = (np.vecdot(n, w @ start.nodes) for n, w in ((normal, weights), (way, earlier)))
    held = start.forces.any(axis=1) & end.forces.any(axis=1) & (part > 0) & (faced > 0)
    meets, met = (part > 0) & (off == 0), (faced > 0) & (farther == 0)
    before = np.where(held | meets & met, there + farther, here + away)
    come = (part > 0) & ~met & ~held
    gone = (faced > 0) & ~meets & ~held & ~come
    slips = [
        np.where(inside, 0.0, np.vecdot(n[:, ::-1] * (1.0, -1.0), w @ end.du))
        for n, w in ((normal, weights), (way, earlier))
    ]
    long = np.abs(slips[0]) + np.maximum(before, 0.0)
    passing = np.where(gone, 1.0, np.where(come & (long > 0), np.abs(slips[0]) / np.where(long > 0, long, 1.0), 0.0))
    return Contacts(
        node,
        weights,
        ~inside,
        tool,
        normal[owner],
        np.array(mu),
        apart,
        apart,
        none,
        carried(scene, start.tau, end.tau)[a],
        before=before,
        passing=passing,
        gone=np.where(gone, slips[1], np.nan),
    )


def _own(scene: Scene, tool: Ints) -> Bools:
    """Which nodes (p, a) are on the side of points at a ``tool`` (p,): of this side weights sum to one."""
    own = np.zeros((len(tool), len(scene.mesh.nodes)), dtype=bool)
    for k, one in enumerate(scene.tools):
        own[np.ix_(tool == k, np.unique(_edges(scene, one.candidates)))] = True
    return own


def _in_planes(setting: Setting, node: Ints, normal: Floats) -> tuple[Floats, Bools]:
    """Normals (p, 2) of points at a ``node`` (p,), and which are in planes of symmetry or at an axis: so are normals.

    There nothing slips: beyond, it would the other way.
    """
    out, inside = normal.copy(), np.zeros(len(node), dtype=bool)
    for direction, position in setting.mirrors:
        there = np.abs(setting.rest[node, direction] - position) <= IN_PLANE * setting.size
        out[there, direction] = 0.0
        inside |= there
    return out / np.linalg.norm(out, axis=1)[:, None], inside


def _joined(found: list[Seen]) -> tuple[Ints, Floats, Floats, Floats, Floats]:
    """The points of all tools: their nodes, weights, normals, parts, and how much farther off these are."""
    every = zip(*((of.node, of.weights, of.normal, of.part, of.farther) for of in found), strict=True)
    node, weights, normal, part, off = (np.concatenate(of) for of in every)
    return node, weights, normal, part, off


def measured(ran: Ran) -> list[Measures]:
    """The independent measures of every accepted increment."""
    setting, largest, energy, out = setting_of(ran.scene), 0.0, 0.0, list[Measures]()
    nobody = _nobody(len(setting.rest))
    for accepted in ran.steps:
        largest = max(largest, float(np.abs(accepted.state.forces).max(initial=0.0)))
        at = contacts_of(ran.scene, setting, accepted.start, accepted.state), nobody
        step = step_at(ran.scene, setting, accepted, largest, *at)
        out.append(measure(setting, replace(step, energy=energy)))
        energy = max(energy, *map(abs, out[-1].energies))
    return out


def _nobody(count: int) -> Contacts:
    """No candidates, of a mesh with ``count`` nodes."""
    none, number, vectors = np.empty(0), np.empty(0, np.intp), np.empty((0, 2))
    weights, rubs = np.empty((0, count)), np.empty(0, dtype=bool)
    return Contacts(number, weights, rubs, number, vectors, none, none, none, vectors, vectors)


def _edges(scene: Scene, names: tuple[str, ...]) -> Ints:
    """Edges (f, n) of boundaries from end to end, with the body on their left."""
    out, cells = list[Ints](), scene.mesh.elements
    corners = 3 if cells.shape[1] in (3, 6) else 4
    for edge in np.concatenate([scene.mesh.boundaries[name] for name in names]):
        (element,) = np.flatnonzero(np.isin(cells, edge).sum(axis=1) == len(edge))
        around = cells[element, :corners].tolist()
        follows = around[(around.index(edge[0]) + 1) % corners] == edge[-1]
        out.append(edge if follows else edge[::-1])
    return np.array(out)


def wrong_in(ran: Ran, found: list[Measures]) -> list[str]:
    """What is wrong in a run with these measures, in words."""
    scene, setting = ran.scene, setting_of(ran.scene)
    points = [contacts_of(scene, setting, accepted.start, accepted.state) for accepted in ran.steps]
    depths = [overlap_of(scene, accepted.state.nodes) for accepted in ran.steps]
    out = [
        f"increment {k}: {what}"
        for k, (m, e) in enumerate(zip(found, excuses(ran), strict=True), 1)
        for what in broken(m, True, e)
    ]
    return (
        out
        + misstated(scene, setting, ran.steps, points)
        + deeper(scene, ran.steps, depths)
        + unspent(ran.scene, ran.steps, found)
    )


def disagreement(base: Ran, other: Ran, view: View) -> tuple[float, float, int]:
    """Largest difference of contact forces and of displacements over the runs' largest, and of how many increments."""
    force = view.stress * view.length ** (2 if base.scene.ring else 1)
    off, size, moved, most, count = 0.0, 0.0, 0.0, 0.0, 0
    for a, b in zip(base.steps, other.steps, strict=False):
        if abs(a.state.tau - b.state.tau) > 1e-12 or not (reported_unique(a) and reported_unique(b)):
            break
        count += 1
        mine, theirs = a.tool_forces, b.tool_forces @ view.matrix.T / force
        off, size = max(off, float(np.abs(mine - theirs).max())), max(size, float(np.abs(a.state.forces).max()))
        u, v = a.displacement, view.back(b.displacement) / view.length
        blur = 8 * float(np.finfo(np.float64).eps) * float(np.abs(base.scene.mesh.nodes).max())
        moved, most = max(moved, float(np.abs(u - v).max()) - blur), max(most, float(np.abs(u).max()))
    return off / size if size else 0.0, max(moved, 0.0) / most if most else 0.0, count


def _judged(row: Row, drawn: Drawn, others: bool) -> Row:
    base = run(drawn, drawn.scene)
    found = measured(base)
    wrong, worst = wrong_in(base, found), 0.0
    for view in views(drawn.scene, row.seed) if others else ():
        other = run(drawn, view.of(drawn.scene))
        force, move, count = disagreement(base, other, view)
        worst = max(worst, force, move)
        where = f"{view.name}, {count} increments"
        wrong += [f"{where}: {what}" for what in wrong_in(other, measured(other))[:1]]
        if not force <= DISAGREEMENT:
            wrong.append(f"{where}: forces differ by {force:.1e}")
    return concluded(
        row,
        wrong,
        base.reason,
        f"energy error {energy_error(found):.1e}",
        increments=len(base.steps),
        residuals=[m.equilibrium for m in found],
        laws=[m.law for m in found],
        disagreement=worst,
    )
