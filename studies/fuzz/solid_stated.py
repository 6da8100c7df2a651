"""Forces and moments of whole tools, loads and supports in space: in balance, and as the library states them."""

from __future__ import annotations

import numpy as np

from bipot.control.accepted import Accepted
from bipot.scene.scene import Scene
from bipot.tools.deformable import DeformableTool
from bipot.typing import Floats, vdot
from studies.fuzz.record import is_round_off
from studies.fuzz.solid_placed import asked_of, axis_of, cuts, pose
from studies.fuzz.solid_touching import Touching
from studies.independent.data import EPS

DRIVEN = 1e-3
"""Ten times the library's bound on the balance of driven tools is this far above that on sums."""


def over(value: float, scale: float) -> float:
    """0/0 is 0."""
    return (float(value / scale) if scale > 0 else float("inf")) if value else 0.0


def balance(accepted: Accepted, scene: Scene, c: Touching, loads: Floats, sizes: float) -> float:
    """Resultant and moment of what acts on the modelled part: its supports' part as the library states it."""
    iterate = accepted.solved.iterate
    total = loads + iterate.reactions(accepted.solved.r)
    total = total + c.on_nodes(c.vectors(c.rubbed(accepted.state.forces)), len(total))
    x = iterate.balanced - iterate.balanced.mean(axis=0)
    moment = np.cross(x, total).sum(axis=0) / scene.mesh.size
    scale = max(float(np.linalg.norm(total, axis=1).sum()), float(sizes))
    return over(max(np.abs(total.sum(axis=0)).max(), np.abs(moment).max()), scale)


def stated(scene: Scene, accepted: Accepted, c: Touching) -> float:
    """Whole tools' forces and moments against sums of nodal ones, and against what drives them; where tools are."""
    worst, vectors, state = 0.0, c.vectors(c.rubbed(accepted.state.forces)), accepted.state
    for k, tool in enumerate(scene.tools):
        mine, planes = c.tool[c.owner] == k, cuts(scene, tool)
        if isinstance(tool, DeformableTool):
            mine &= np.isin(c.part, scene.mesh.boundary_nodes(*tool.candidates))
        own, whole = vectors[mine], 2.0 ** len(planes)
        force, scale = own.sum(axis=0), whole * float(np.linalg.norm(own, axis=1).sum())
        for way, _ in planes:
            force = 2 * (force - (force @ way) * way)
        worst = max(worst, over(np.abs(accepted.tool_force(k) - force).max(), scale))
        worst = max(worst, _misplaced(accepted, k, pose(scene, k, state)))
        along, turned = asked_of(scene, k, state.tau)
        if tool.driven_by is not None:
            way = np.array(tool.driven_by.vector) / np.linalg.norm(tool.driven_by.vector)
            worst = max(worst, DRIVEN * over(abs(float(force @ way) - along), max(along, scale)))
        if tool.turn is not None:
            arm = state.nodes[c.part[mine]] - np.array(tool.turn.centre) - pose(scene, k, state)[:3]
            moment = whole * vdot(axis_of(tool), np.cross(arm, own).sum(axis=0))
            sizes = whole * float((np.linalg.norm(arm, axis=1) * np.linalg.norm(own, axis=1)).sum())
            worst = max(worst, over(abs(accepted.tool_moment(k) - moment), sizes))
            if tool.turn.driven_by is not None and not is_round_off(accepted, turned):
                worst = max(worst, DRIVEN * over(abs(moment - turned), max(abs(turned), sizes)))
    return worst


def _misplaced(accepted: Accepted, k: int, own: Floats) -> float:
    """How far the pose that the library states of a tool is from the study's ``own`` (4,), over how far it may go."""
    tool, by = accepted.scene.tools[k], float(np.abs(accepted.state.translation).max(initial=0.0))
    off = accepted.tool_pose(k) - np.append(own[:3], own[3] * axis_of(tool))
    turned = 0.0 if tool.turn is None else abs(tool.turn.angle)
    gone = max(float(np.abs(own[:3]).max()), float(np.abs(tool.travel).max()), by)
    return max(over(np.abs(off[:3]).max(), gone), over(np.abs(off[3:]).max(), max(turned, abs(float(own[3])))))


def jumped(accepted: Accepted) -> float:
    """How far coordinates of driven tools are from where the increment has taken them, beyond round-off."""
    begun, ended, by = accepted.start.translation, accepted.state.translation, accepted.state.translated
    blur = EPS * (np.abs(begun) + np.abs(ended))
    return float(np.maximum(np.abs(ended - begun - by) - blur, 0.0).max(initial=0.0))


def past(accepted: Accepted, c: Touching, largest: float) -> float:
    """The largest force of who ends past an open end of a tool, over the largest of the run."""
    forces = np.linalg.norm(accepted.state.forces, axis=1)
    return over(float(forces[c.past].max(initial=0.0)), largest)
