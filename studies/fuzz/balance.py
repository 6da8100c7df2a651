"""Forces and moments of tools, loads and supports on the modelled part, judged: they are in balance, and as stated.

What the body carries inside has no resultant and no moment, so that what acts on it from outside has none either: on a
ring along its axis.
"""

from __future__ import annotations

import numpy as np

from bipot.certificate import Bounds
from bipot.control.accepted import Accepted
from bipot.fem.strain import Configuration
from bipot.scene.scene import Scene
from studies.fuzz.placed import drives, poses
from studies.fuzz.record import Pushed, is_round_off, loads_at
from studies.independent.data import EPS, Setting, mandel_to_full
from studies.independent.element import element_forces, place
from studies.independent.outline import cross

SUMS = 1e-9
"""Sums of the same numbers in another order differ by less than this over the sum of their sizes."""

BALANCED = 10 * Bounds().equilibrium
"""Ten times what the library lets nodes lack, over the sum of the sizes of all forces of elements."""

VANISHING = float(np.sqrt(np.finfo(np.float64).tiny))
"""A force below this has no square, hence no size: of a body that nothing touches."""


def unbalanced(scene: Scene, setting: Setting, accepted: Accepted, pushed: Pushed) -> list[str]:
    """What is wrong with the balance of the modelled part, and with the moments of tools that turn, in words."""
    return _moments(scene, accepted, pushed) + _lacking(scene, setting, accepted, pushed)


def _moments(scene: Scene, accepted: Accepted, pushed: Pushed) -> list[str]:
    out = list[str]()
    for k, (tool, pose) in enumerate(zip(scene.tools, poses(scene, accepted.state), strict=True)):
        if tool.turn is None:
            continue
        own = pushed.tool == k
        arm = accepted.state.nodes[pushed.node[own]] - tool.turn.centre - pose[:2]
        moment = float(cross(arm, pushed.forces[own]).sum())
        sizes = float((np.linalg.norm(arm, axis=1) * np.linalg.norm(pushed.forces[own], axis=1)).sum())
        off = abs(moment - accepted.tool_moment(k))
        if not off <= SUMS * sizes:
            out.append(f"moment of tool {k} off by {off:.1e}")
        for drive in drives(scene):
            asked = drive.at(accepted.state.tau)
            mine = drive.number == k and drive.spin and not is_round_off(accepted, asked)
            if mine and not abs(moment - asked) <= BALANCED * max(sizes, abs(asked)):
                out.append(f"tool {k} is turned by another moment, {moment:.6g} and not {asked:.6g}")
    return out


def _lacking(scene: Scene, s: Setting, accepted: Accepted, pushed: Pushed) -> list[str]:
    if "equilibrium" in accepted.solved.certificate.below_resolution(Bounds()):
        return []
    start, end = accepted.start, accepted.state
    paper = scene.configuration is Configuration.PAPER
    balanced = s.rest if s.small else start.nodes if paper else end.nodes
    loads = loads_at(scene, s, balanced, end.tau)[0]
    reactions = accepted.solved.iterate.reactions(accepted.solved.r)
    total = pushed.nodal + loads + reactions
    placed = place(balanced, s.elements, s.quadrature, s.axisymmetric)
    sizes = np.linalg.norm(element_forces(placed, mandel_to_full(end.stress)), axis=-1).sum()
    # What supports take of loads at once is a difference; what tools take so sets the scale of equilibrium there.
    cancelled = float(np.linalg.norm(loads, axis=1).sum() + np.linalg.norm(reactions, axis=1).sum())
    taken = np.minimum(np.linalg.norm(loads, axis=1), np.linalg.norm(pushed.nodal, axis=1)).sum()
    most = BALANCED * max(float(sizes), float(np.linalg.norm(total, axis=1).sum())) + EPS * cancelled + VANISHING
    most += Bounds().equilibrium * float(taken)
    force = total.sum(axis=0) * ((0.0, 1.0) if s.axisymmetric else (1.0, 1.0))
    moment = 0.0 if s.axisymmetric else float(cross(balanced - balanced.mean(axis=0), total).sum()) / s.size
    what = {"forces": float(np.abs(force).max()), "moments": abs(moment)}
    return [f"{name} do not balance, by {off:.1e} of {most / BALANCED:.1e}" for name, off in what.items() if off > most]
