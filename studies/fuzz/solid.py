"""A random body in space marched and judged: each increment by measures of its own, the run by its variants."""

from __future__ import annotations

from functools import partial

import numpy as np

from bipot.certificate import Bounds
from bipot.marching import Accepted
from bipot.scene.scene import Scene
from bipot.scene.supports import Symmetry
from bipot.typing import Floats
from studies.fuzz.judge import DISAGREEMENT, DISSIPATES, Ran, known, run
from studies.fuzz.metals import bulk_and_shear
from studies.fuzz.record import reported_unique
from studies.fuzz.regional import draw_solid_regional
from studies.fuzz.row import Row, concluded, ended
from studies.fuzz.scenes import Drawn
from studies.fuzz.solid_claims import refuted
from studies.fuzz.solid_contacts import touching
from studies.fuzz.solid_measures import SolidMeasures, measure
from studies.fuzz.solid_scenes import draw_solid
from studies.fuzz.solid_shaped import draw_solid_shaped
from studies.fuzz.solid_unfolded import unfolded
from studies.fuzz.solid_variants import SolidVariant, variants

TEN = 10.0
BOUNDS = Bounds()
LIMITS = {
    "equilibrium": TEN * BOUNDS.equilibrium,
    "yielding": TEN * BOUNDS.yield_violation,
    "elastic": TEN * BOUNDS.equilibrium,
    "penetration": TEN * BOUNDS.penetration,
    "past": TEN * BOUNDS.cone_violation,
    "between": 1.3,
    "disc": TEN * 1e-6,
    "placed": 1e-12,
    "balance": TEN * BOUNDS.equilibrium,
    "stated": 1e-9,
    "energies": 1e-9,
}
"""Ten times the library's bounds; what it has none for is held to round-off, or to equilibrium's.

What faces are in tools between their nodes is theirs but for what the library's sparser places miss of it.
"""

OF_THE_LAW = ("penetration", "disc")
"""Asked of forms that pose Coulomb's law."""

BLURRED = ("equilibrium", "disc", "elastic", "balance", "energies", "stated")
"""What is not asked of an increment that the library says is below its resolution, where it may be."""

FAINT = 1e-4
"""Stress over what the motion would make as elastic strain, below which round-off may be above the bounds."""

IDLE = 1e-14
"""Stress over what contact forces would make, below which it is their round-off: supports take all of them."""

STRAIGHT = -1e-8
"""Least det J over its mean: a corner between faces on one tool is straight to ten times what the library lets pass."""


def judge_solid(seed: int, others: bool = True) -> Row:
    """The row of a seed's body in space; ``others`` says whether its variants are run too."""
    return ended(known("solid", seed, draw_solid, partial(_judged, others=others)))


def judge_solid_shaped(seed: int, others: bool = True) -> Row:
    """The same of the seed's body under tools that are not flat."""
    return ended(known("solid shaped", seed, draw_solid_shaped, partial(_judged, others=others)))


def judge_solid_regional(seed: int, others: bool = True) -> Row:
    """The same of the seed's body of several materials."""
    return ended(known("solid regional", seed, draw_solid_regional, partial(_judged, others=others)))


def _others(drawn: Drawn, seed: int) -> list[SolidVariant]:
    """What the scene is run as besides, about one plane of symmetry unfolded, if it has any.

    Penalties are a law of every point's, which a plane of symmetry would halve.
    """
    planes = [support for support in drawn.scene.supports if isinstance(support, Symmetry)]
    chosen = planes[seed % len(planes)] if planes and drawn.form != "penalty" else None
    return variants(drawn.scene, seed) + ([] if chosen is None else [unfolded(drawn.scene, chosen)])


def measured(ran: Ran) -> list[SolidMeasures]:
    """The measures of every accepted increment."""
    largest, energy, before, out = 0.0, 0.0, np.zeros(4), list[SolidMeasures]()
    for accepted in ran.steps:
        largest = max(largest, float(np.abs(accepted.state.forces).max(initial=0.0)))
        out.append(measure(ran.scene, accepted, largest, energy, before))
        energy, stated = out[-1].largest_energy, accepted.energies
        before = np.array([stated.work, stated.elastic, stated.plastic, stated.friction])
    return out


def excuses(scene: Scene, accepted: Accepted) -> tuple[str, ...]:
    """What is not asked of an increment: all BLURRED where stress is nearly none, the disc where contact forces are.

    Only where the library says that equilibrium or the law is below resolution.
    """
    below = {"equilibrium", "law"} & set(accepted.solved.certificate.below_resolution(BOUNDS))
    (bulk, shear), state, size = bulk_and_shear(scene), accepted.state, scene.mesh.size
    moved = max(float(np.abs(state.du).max()), float(np.abs(accepted.solved.iterate.tool_travel).max(initial=0.0)))
    stress, pushed = float(np.abs(state.stress).max()), float(np.abs(state.forces).max(initial=0.0))
    faint = FAINT * float((3 * bulk + 2 * shear).max()) * moved / size
    if below and stress < max(faint, IDLE * pushed / size**2):
        return BLURRED
    return ("disc",) if "law" in below and pushed < faint * size**2 else ()


def broken(m: SolidMeasures, exact: bool, excused: tuple[str, ...] = ()) -> list[str]:
    """The measures beyond their limits, in words, but those ``excused``."""
    blurred, excused = excused == BLURRED, excused + (() if exact else OF_THE_LAW)
    names = [name for name in LIMITS if name not in excused]
    out = [f"{name} {getattr(m, name):.1e}" for name in names if not getattr(m, name) <= LIMITS[name]]
    if not m.orientation > STRAIGHT:
        out.append(f"orientation {m.orientation:.1e}")
    shares = {"plastic": m.plastic, "friction": m.friction} if exact else {"plastic": m.plastic}
    # Of a body that stands as it did, both are zeros of round-off.
    negative = {} if blurred else {name: share for name, share in shares.items() if not share >= DISSIPATES}
    return out + [f"{name} dissipation {share:.1e}" for name, share in negative.items()]


def faults(ran: Ran, exact: bool) -> tuple[list[str], list[SolidMeasures]]:
    """What is wrong with the increments of a run and with the claim that ends it, if any, and their measures."""
    found = measured(ran)
    wrong = [
        f"increment {k}: {what}"
        for k, (m, accepted) in enumerate(zip(found, ran.steps, strict=True), 1)
        for what in broken(m, exact, excuses(ran.scene, accepted))
    ]
    return wrong + ([] if ran.claim is None else refuted(ran.scene, ran.claim)), found


def nodal_forces(scene: Scene, accepted: Accepted) -> Floats:
    """Contact forces (tools, a, 3) as vectors on nodes, with the friction of nodes that supports hold there."""
    c, count = touching(scene, accepted), len(scene.mesh.nodes)
    vectors = c.vectors(c.rubbed(accepted.state.forces))
    own = c.tool[c.owner] == np.arange(len(scene.tools))[:, None]
    return np.array([c.on_nodes(np.where(mine[:, None], vectors, 0.0), count) for mine in own])


def disagreement(base: Ran, other: Ran, seen: SolidVariant, resolution: float) -> float:
    """Largest difference of nodal forces over the runs' largest, while both took the same increments to one answer.

    Forces within twice the ``resolution`` are not told apart.
    """
    off, most = 0.0, 0.0
    for a, b in zip(base.steps, other.steps, strict=False):
        same = abs(a.state.tau - b.state.tau) <= 1e-12
        if not (same and reported_unique(a) and reported_unique(b) and seen.tells(b.state.nodes)):
            break
        mine = seen.comparable(nodal_forces(base.scene, a))
        theirs = nodal_forces(other.scene, b)[: len(mine), seen.number] @ seen.turn / (seen.force * seen.weight)
        off = max(off, float(np.abs(mine - theirs).max(initial=0.0)) - 2 * resolution)
        most = max(most, float(np.abs(mine).max(initial=0.0)))
    return off / most if off else 0.0


def _judged(row: Row, drawn: Drawn, others: bool) -> Row:
    return judged(row, drawn, _others(drawn, row.seed) if others else [])


def judged(row: Row, drawn: Drawn, others: list[SolidVariant]) -> Row:
    """The row of a scene with its ``others``."""
    base, exact = run(drawn, drawn.scene), drawn.form != "penalty"
    wrong, found = faults(base, exact)
    worst, resolution = 0.0, max((m.resolution for m in found), default=0.0)
    for seen in others:
        other = run(drawn, seen.scene)
        worst = max(worst, off := disagreement(base, other, seen, resolution))
        wrong += [f"{seen.name}: {what}" for what in faults(other, exact)[0][:1]]
        if not off <= DISAGREEMENT:
            wrong.append(f"{seen.name}: forces differ by {off:.1e}")
    error = abs(base.steps[-1].energies.energy_error) if base.steps else 0.0
    return concluded(
        row,
        wrong,
        base.reason,
        f"energy error {error:.1e}",
        increments=len(base.steps),
        residuals=[m.equilibrium for m in found],
        laws=[m.disc for m in found] if exact else [float("nan")],
        disagreement=worst,
    )
