"""Scenes of several parts in space marched and judged: each increment by independent measures, the run by its variants.

Measures are those of any body in space (:mod:`studies.fuzz.solid_measures`), with the study's own points between parts
(:mod:`studies.fuzz.solid_parts_contacts`). Beside them normals, the column ``overlap``, and the balance of forces and
moments on each part are looked at, and the work of supports is a sum of its own.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from bipot.contact.overlap import overlap
from bipot.control.accepted import Accepted
from bipot.scene.scene import Scene
from bipot.typing import Floats, vdot
from studies.fuzz.balance import BALANCED, SUMS
from studies.fuzz.judge import DISAGREEMENT, Ran, known, run
from studies.fuzz.parts_held import parts_of
from studies.fuzz.record import reported_unique
from studies.fuzz.row import Row, concluded, ended
from studies.fuzz.scenes import Drawn
from studies.fuzz.solid import BLURRED, broken, excuses
from studies.fuzz.solid_held import freed, prescribed_at
from studies.fuzz.solid_loads import loads_at
from studies.fuzz.solid_measures import Known, SolidMeasures, full, measure
from studies.fuzz.solid_parts import draw_solid_parts
from studies.fuzz.solid_parts_contacts import Between, between_parts
from studies.fuzz.solid_variants import SolidVariant, variants
from studies.independent.solid import element_forces, nodal, place

NORMAL = 1e-10
"""Unit vectors that differ by less are one: round-off of the areas that they are means over."""

DEEPER = 1e-11
"""Depths that differ by less of the size of the numbers of places are one."""


def judge_solid_parts(seed: int, others: bool = True) -> Row:
    """The row of a seed's scene; ``others`` says whether it is run seen otherwise too."""
    return ended(known("solid parts", seed, draw_solid_parts, partial(_judged, others=others)))


def faults(ran: Ran) -> tuple[list[str], list[SolidMeasures]]:
    """What is wrong in a run, in words, and the measures of its increments."""
    largest, energy, before, wrong, out = 0.0, 0.0, np.zeros(4), list[str](), list[SolidMeasures]()
    reactions = np.zeros(ran.scene.mesh.nodes.shape)
    for k, accepted in enumerate(ran.steps, 1):
        largest = max(largest, float(np.abs(accepted.state.forces).max(initial=0.0)))
        found, begun = between_parts(ran.scene, accepted), reactions
        reactions = _reactions(ran.scene, accepted, found)
        driven = prescribed_at(ran.scene, accepted.state.tau) - prescribed_at(ran.scene, accepted.start.tau)
        work = vdot((begun + reactions) / 2, driven)
        unsure = found.work + float(found.forces @ np.linalg.norm(accepted.state.du, axis=1))
        own = Known(found.contact, work, found.forces, unsure)
        out.append(measure(ran.scene, accepted, largest, energy, before, own))
        excused = excuses(ran.scene, accepted)
        said = broken(out[-1], True, excused) + _beside(ran.scene, accepted, found)
        said += [] if excused == BLURRED else _balance(ran.scene, accepted, found)
        wrong += [f"increment {k}: {what}" for what in said]
        energy, stated = out[-1].largest_energy, accepted.energies
        before = np.array([stated.work, stated.elastic, stated.plastic, stated.friction])
    return wrong, out


def _internal(scene: Scene, accepted: Accepted) -> Floats:
    """Forces (e, k, 3) of elements on their nodes at the end."""
    x = accepted.solved.iterate.balanced
    return element_forces(place(x, scene.mesh.elements, scene.rule.value), full(accepted.state.stress))


def _reactions(scene: Scene, accepted: Accepted, found: Between) -> Floats:
    """Forces (a, 3) of supports: what nodes that they hold lack."""
    count, c = len(scene.mesh.nodes), found.contact
    lacking = nodal(scene.mesh.elements, _internal(scene, accepted), count) - loads_at(scene, accepted, 1)
    lacking -= c.on_nodes(c.vectors(accepted.state.forces), count)
    return lacking - np.einsum("aij,aj->ai", freed(scene), lacking)


def _beside(scene: Scene, accepted: Accepted, found: Between) -> list[str]:
    """Normals, and the overlap told, that are not the study's own."""
    out, nodes = list[str](), accepted.state.nodes
    if not found.normal <= NORMAL:
        out.append(f"normals are off by {found.normal:.1e}")
    told, blur = overlap(scene, nodes, accepted.poses), DEEPER * float(np.abs(nodes).max()) / scene.mesh.size
    if not abs(told - found.overlap) <= blur + SUMS * found.overlap:
        out.append(f"overlap is told as {told:.3e}, not {found.overlap:.3e}")
    return out


def _balance(scene: Scene, accepted: Accepted, found: Between) -> list[str]:
    """Parts on which supports, as told, loads and contacts are not in balance, in force or moment."""
    out, c, x = list[str](), found.contact, accepted.solved.iterate.balanced
    loads, pushed = loads_at(scene, accepted, 1), c.vectors(accepted.state.forces)
    acting = accepted.reactions + loads + c.on_nodes(pushed, len(x))
    sizes = np.linalg.norm(loads, axis=1).sum() + np.linalg.norm(pushed, axis=1).sum()
    scale = float(np.linalg.norm(_internal(scene, accepted), axis=2).sum() + sizes)
    for name, members in parts_of(scene).items():
        arm, own = x[members] - x[members].mean(axis=0), acting[members]
        moment = np.cross(arm, own).sum(axis=0) / scene.mesh.size
        off = max(*np.abs(own.sum(axis=0)), *np.abs(moment)) - float(found.forces[members].sum())
        if not off <= BALANCED * scale:
            out.append(f"what acts on {name} is off balance by {off / scale:.1e}")
    return out


def disagreement(base: Ran, other: Ran, seen: SolidVariant) -> tuple[float, int]:
    """Largest difference of tools' forces over the runs' largest force, and of how many increments.

    Compared is while both take the same increments to answers that are reported to be the only ones.
    """
    off, size, count = 0.0, 0.0, 0
    for a, b in zip(base.steps, other.steps, strict=False):
        if abs(a.state.tau - b.state.tau) > 1e-12 or not (reported_unique(a) and reported_unique(b)):
            break
        count += 1
        off = max(off, float(np.abs(a.tool_forces - b.tool_forces @ seen.turn / seen.force).max()))
        size = max(size, float(np.abs(a.state.forces).max()))
    return off / size if size else 0.0, count


def _judged(row: Row, drawn: Drawn, others: bool) -> Row:
    base = run(drawn, drawn.scene)
    (wrong, found), worst = faults(base), 0.0
    for seen in variants(drawn.scene, row.seed) if others else ():
        other = run(drawn, seen.scene)
        off, count = disagreement(base, other, seen)
        worst = max(worst, off)
        wrong += [f"{seen.name}: {what}" for what in faults(other)[0][:1]]
        if not off <= DISAGREEMENT:
            wrong.append(f"{seen.name}, {count} increments: forces differ by {off:.1e}")
    error = abs(base.steps[-1].energies.energy_error) if base.steps else 0.0
    return concluded(
        row,
        wrong,
        base.reason,
        f"energy error {error:.1e}",
        increments=len(base.steps),
        residuals=[m.equilibrium for m in found],
        laws=[m.disc for m in found],
        disagreement=worst,
    )
