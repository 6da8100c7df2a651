"""What the library says of the whole body, judged: forces of whole tools and energies, by sums of its own.

The images that planes of symmetry make are counted here a second time.
"""

from __future__ import annotations

import numpy as np

from bipot.certificate import Bounds
from bipot.fem.reduction import Geometry
from bipot.marching import Accepted
from bipot.scene.scene import Scene
from bipot.typing import Floats
from studies.fuzz.balance import SUMS, unbalanced
from studies.fuzz.placed import directions, drives, planes, poses, tools_gone
from studies.fuzz.record import Pushed, pushed_by, setting_of
from studies.fuzz.surfaces import cut
from studies.fuzz.variants import Variant
from studies.independent.data import EPS
from studies.independent.increment import Measures

LEAST = float(np.finfo(np.float64).tiny)
"""Energies below have lost their digits: what round-off moves in a body that nothing touches (seed 730299)."""
DRIVES = 1e-6
"""Ten times the library's bound on equilibrium: what a whole tool's force may be off the one that drives it."""


def images(scene: Scene) -> int:
    """How many images make the whole body."""
    return 2 ** len(planes(scene))


def tool_forces(scene: Scene, pushed: Pushed) -> tuple[Floats, Floats]:
    """Forces (tools, d) of the whole tools by nodal sums, and the sums (tools,) of the sizes of the nodal forces."""
    forces = np.zeros((len(scene.tools), 2))
    np.add.at(forces, pushed.tool, pushed.forces)
    sizes = np.zeros(len(scene.tools))
    np.add.at(sizes, pushed.tool, np.linalg.norm(pushed.forces, axis=1))
    for across, position in planes(scene):
        for k, tool in enumerate(scene.tools):
            if cut(tool, across, position):
                forces[k] *= 2 * (np.arange(2) != across)
                sizes[k] *= 2
    if scene.geometry is Geometry.AXISYMMETRIC:
        forces[:, 0] = 0.0
    return forces, sizes


def misstated(scene: Scene, steps: list[Accepted], measures: list[Measures]) -> list[str]:
    """Forces of whole tools and energies of the whole body that the library states otherwise, in words."""
    out, largest, terms, before, setting = list[str](), 0.0, 0.0, np.zeros(4), setting_of(scene)
    rubbed = False
    for k, (accepted, measure) in enumerate(zip(steps, measures, strict=True), 1):
        pushed = pushed_by(scene, setting, accepted)
        forces, sizes = tool_forces(scene, pushed)
        off = np.array([accepted.tool_force(i) for i in range(len(scene.tools))]).reshape(-1, 2) - forces
        wrong = np.flatnonzero(np.abs(off).max(axis=1) > SUMS * sizes)
        out += [f"increment {k}: force of tool {i} off by {np.abs(off[i]).max():.1e}" for i in wrong[:1]]
        said = misled(scene, accepted, sizes) + unbalanced(scene, setting, accepted, pushed)
        out += [f"increment {k}: {what}" for what in said]
        now = energies(accepted)
        own = np.array(measure.energies) * images(scene)
        largest = max(largest, float(np.abs(now).max()), float(np.abs(own).max()))
        terms += measure.terms * images(scene)
        # Friction on what supports hold is in the library's energies alone, also that of the start, which counts half;
        # below resolution forces are round-off.
        told = not (pushed.rubs or rubbed) and "equilibrium" not in accepted.solved.certificate.below_resolution(
            Bounds()
        )
        error = float(np.abs(now - before - own).max()) if told else 0.0
        if error > SUMS * largest + EPS * terms + LEAST:
            out.append(f"increment {k}: energies off by {error / largest:.1e} of the largest")
        before, rubbed = now, pushed.rubs
    return out


def misled(scene: Scene, accepted: Accepted, sizes: Floats) -> list[str]:
    """Tools whose force on the whole body is not that which drives them, or that have gone elsewhere, in words.

    ``sizes`` (tools,) are the sums of those of the forces on their candidates.
    """
    out = list[str]()
    for drive in drives(scene):
        k, asked = drive.number, drive.at(accepted.state.tau)
        if drive.spin:
            continue
        off = abs(float(accepted.tool_force(k) @ directions(scene)[k]) - asked)
        if not off <= DRIVES * asked + SUMS * sizes[k]:
            out.append(f"tool {k} is driven by another force, off by {off / asked:.1e} of it")
    own, stated = tools_gone(scene, accepted.start, accepted.state), accepted.solved.iterate.tool_travel
    apart = np.abs(own - stated).max(axis=1, initial=0.0)
    out += [f"tool {k} goes otherwise, by {apart[k]:.1e}" for k in np.flatnonzero(apart > SUMS * np.abs(own).max())]
    turned = np.array([accepted.tool_pose(k)[-1] for k in range(len(scene.tools))])
    angles = poses(scene, accepted.state)[:, 2]
    off = np.abs(angles - turned)
    return out + [f"tool {k} turns otherwise, by {off[k]:.1e}" for k in np.flatnonzero(off > SUMS * np.abs(angles))]


def energies(accepted: Accepted) -> Floats:
    """Work, elastic, plastic, friction (4,) so far, as the library states them."""
    stated = accepted.energies
    return np.array([stated.work, stated.elastic, stated.plastic, stated.friction])


def difference(
    base: list[Accepted], other: list[Accepted], scene: Scene, seen: Variant, unsure: float, terms: float = 0.0
) -> Floats:
    """Largest differences (2,) of whole tools' forces and of energies over the runs' largest, of increments in pairs.

    Each nodal force is known to ``unsure``, and its work to that times what moves; the work is summed of terms of the
    size ``terms``.
    """
    off, largest, setting, blurred = np.zeros(2), np.zeros(2), setting_of(scene), 0.0
    unsure *= images(scene) * len(scene.mesh.nodes)
    for a, b in zip(base, other, strict=True):
        sizes = tool_forces(scene, pushed_by(scene, setting, a))[1]
        for k, size in enumerate(sizes):
            force = np.abs(a.tool_force(k) - seen.back(b.tool_force(k)) / seen.force).max()
            off[0] = max(off[0], force - unsure)
            largest[0] = max(largest[0], size)
        mine = energies(a)
        moved = max(float(np.abs(part).max(initial=0.0)) for part in (a.state.du, tools_gone(scene, a.start, a.state)))
        blurred += unsure * moved
        apart = np.abs(mine - energies(b) / (seen.force * seen.length)).max()
        off[1] = max(off[1], apart - EPS * terms - blurred)
        largest[1] = max(largest[1], np.abs(mine).max())
    return np.divide(off, largest, out=np.zeros(2), where=largest > 0)
