"""What the library tells of scenes of several parts, judged: forces, moments, energies and how far parts overlap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bipot.certificate import Bounds
from bipot.contact.overlap import overlap
from bipot.control.accepted import Accepted
from bipot.scene.scene import Scene
from bipot.typing import Floats
from studies.fuzz.balance import BALANCED, SUMS
from studies.fuzz.parts_held import parts_of
from studies.fuzz.record import loads_at
from studies.fuzz.whole import LEAST, energies, images
from studies.independent.candidates import Contacts
from studies.independent.data import EPS, Setting, mandel_to_full
from studies.independent.element import element_forces, place
from studies.independent.increment import Measures

ROUND_OFF = 1e-12
"""Over the size of the numbers of places: depths that differ by less are one."""


def misstated(scene: Scene, setting: Setting, steps: Sequence[Accepted], points: Sequence[Contacts]) -> list[str]:
    """What is told of an increment otherwise than by the study's own ``points``, in words."""
    out = list[str]()
    for k, (accepted, c) in enumerate(zip(steps, points, strict=True), 1):
        said = _forces(scene, accepted, c) + _balance(scene, setting, accepted, c)
        out += [f"increment {k}: {what}" for what in said]
    return out


def _forces(scene: Scene, accepted: Accepted, c: Contacts) -> list[str]:
    """Tools' forces that are not those on the candidates, and sides that do not push each other by the same."""
    pushed, out = c.vectors(accepted.state.forces), list[str]()
    size = float(np.abs(pushed).sum())
    for k, (tool, told) in enumerate(zip(scene.tools, accepted.tool_forces, strict=True)):
        own = np.isin(c.parts.node, scene.mesh.boundary_nodes(*tool.candidates))
        sides = [pushed[(c.met == k) & side].sum(axis=0) for side in (own, ~own)]
        if not (off := np.abs(sides[0] - told).max()) <= SUMS * size:
            out.append(f"the force of tools[{k}] is told {off / size:.1e} wrong")
        if not (off := np.abs(sides[0] + sides[1]).max()) <= SUMS * size:
            out.append(f"forces on the sides of tools[{k}] differ by {off / size:.1e}")
    return out


def _balance(scene: Scene, s: Setting, accepted: Accepted, c: Contacts) -> list[str]:
    """Parts on which supports, as told, loads and contacts are not in balance, in force or moment.

    On a meridian it is the force along the axis.
    """
    if "equilibrium" in accepted.solved.certificate.below_resolution(Bounds()):
        return []
    x, pushed, out = accepted.solved.iterate.balanced, c.vectors(accepted.state.forces), list[str]()
    loads, sizes = loads_at(scene, s, x, accepted.state.tau)
    acting = accepted.reactions + loads + c.on_nodes(pushed)
    inner = element_forces(place(x, s.elements, s.quadrature, scene.ring), mandel_to_full(accepted.state.stress))
    scale = float(np.linalg.norm(inner, axis=2).sum() + sizes.sum() + np.linalg.norm(pushed, axis=1).sum())
    for name, members in parts_of(scene).items():
        arm, own = x[members] - x[members].mean(axis=0), acting[members]
        turning = float((arm[:, 0] * own[:, 1] - arm[:, 1] * own[:, 0]).sum()) / s.size
        force = own.sum(axis=0)
        off = abs(force[1]) if scene.ring else max(*np.abs(force), abs(turning))
        if not off <= BALANCED * scale:
            out.append(f"what acts on {name} is off balance by {off / scale:.1e}")
    return out


def deeper(scene: Scene, steps: Sequence[Accepted], own: Sequence[float]) -> list[str]:
    """Increments of which the column ``overlap`` is not the study's ``own``, in words."""
    out = list[str]()
    for k, (accepted, mine) in enumerate(zip(steps, own, strict=True), 1):
        told = overlap(scene, accepted.state.nodes, accepted.poses)
        blur = ROUND_OFF * float(np.abs(accepted.state.nodes).max()) / scene.mesh.size
        if not abs(told - mine) <= blur + SUMS * mine:
            out.append(f"increment {k}: overlap is told as {told:.3e}, not {mine:.3e}")
    return out


def unspent(scene: Scene, steps: Sequence[Accepted], measures: Sequence[Measures]) -> list[str]:
    """Increments of which the energies are not the study's own, in words."""
    out, before, largest, terms = list[str](), np.zeros(4), 0.0, 0.0
    for k, (accepted, measure) in enumerate(zip(steps, measures, strict=True), 1):
        now, own = energies(accepted) / images(scene), np.array(measure.energies)
        largest, terms = max(largest, *np.abs(now), *np.abs(own)), terms + measure.terms
        error = _largest(now - before - own)
        told = "equilibrium" not in accepted.solved.certificate.below_resolution(Bounds())
        if told and error > SUMS * largest + EPS * terms + LEAST:
            out.append(f"increment {k}: energies off by {error / largest:.1e} of the largest")
        before = now
    return out


def _largest(values: Floats) -> float:
    return float(np.abs(values).max())
