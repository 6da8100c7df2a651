"""A random scene marched and judged: each increment by the independent measures, the run by its variants."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from bipot.certificate import Bounds
from bipot.conic.through_cvxpy import Cvxpy
from bipot.control.accepted import Accepted
from bipot.coulomb import Limits as CoulombLimits
from bipot.errors import BipotError
from bipot.fem.reduction import Geometry
from bipot.forms import Delassus, Dissipation, Form, Newton, Penalty, Tangent, Uzawa, contact_penalty
from bipot.marching import Control, march, system_of
from bipot.scene.scene import Scene
from bipot.typing import Floats
from studies.fuzz.claims import Claim, claim_of, refuted
from studies.fuzz.late import Late, until
from studies.fuzz.placed import drives
from studies.fuzz.record import forces_by_node, idle, is_round_off, reported_unique, setting_of, step_of
from studies.fuzz.regional import draw_regional
from studies.fuzz.row import Outcome, Row, concluded, ended
from studies.fuzz.scenes import Drawn, draw
from studies.fuzz.shaped import draw_shaped
from studies.fuzz.turned import turned
from studies.fuzz.unfolded import unfolded
from studies.fuzz.variants import Variant, variants
from studies.fuzz.whole import difference, images, misstated
from studies.independent.increment import Measures, measure

TEN = 10.0
BOUNDS = Bounds()
LIMITS = {
    "equilibrium": TEN * BOUNDS.equilibrium,
    "yielding": TEN * BOUNDS.yield_violation,
    "penetration": TEN * BOUNDS.penetration,
    "inside": TEN * BOUNDS.penetration,
    "past": TEN * BOUNDS.cone_violation,
    "between": 1.02,
    "driven": TEN * BOUNDS.equilibrium,
    "placed": TEN * BOUNDS.penetration,
    "law": TEN * 1e-6,
    "elastic": TEN * BOUNDS.equilibrium,
    "flow": TEN * BOUNDS.equilibrium,
}
"""Ten times the library's bounds; stresses and flow, which it has none for, are held to equilibrium's.

What tools may be ``between`` nodes is theirs but for what the densest samples miss of it.
"""

BLURRED = 1e-4
"""Round-off of elastic stress, some hundred units of it, is above a bound of 1e-7 where stress is well below this."""

BELOW_RESOLUTION = ("equilibrium", "law", "elastic", "flow", "past")
POSED_BY_ALL = ("equilibrium", "yielding", "inside", "past", "between", "driven", "placed", "elastic", "flow")
DISSIPATES = -TEN * BOUNDS.relative_gap
"""Least plastic or frictional dissipation over the largest energy of the increment."""

DISAGREEMENT = 1e-5
TURNED = 1 / 3
"""Of the scenes in plane strain are run turned too."""

SECONDS = 4.0
"""Of processor time; after these a run is left where it is, and what it accepted is judged."""

LONGEST = 40.0
"""The same within an increment (:mod:`studies.fuzz.late`)."""


@dataclass(frozen=True)
class Ran:
    """The accepted increments of a run and how it ended: a BipotError's sentence, or "", and what that claims."""

    scene: Scene
    steps: list[Accepted]
    reason: str
    claim: Claim | None = None


def control_of(drawn: Drawn, scene: Scene) -> Control:
    """The drawn form and its fallbacks, made for ``scene`` (penalties have its units)."""
    forms: dict[str, Callable[[], tuple[Form, tuple[Form, ...]]]] = {
        "tangent": lambda: (Tangent(), (Dissipation(),)),
        "tangent-cvxpy": lambda: (Tangent(solver=Cvxpy()), (Dissipation(solver=Cvxpy()),)),
        "uncoupled": lambda: (Tangent(coupled=False), ()),
        "dissipation": lambda: (Dissipation(), ()),
        "newton": lambda: (Newton(), (Tangent(), Dissipation())),
        "delassus": lambda: (Delassus(limits=CoulombLimits(tol=1e-12, iterations=200, seconds=2.0)), ()),
        "penalty": lambda: (_penalised(Penalty, scene, 10.0), ()),
        "uzawa": lambda: (_penalised(Uzawa, scene, 30.0), ()),
    }
    form, fallbacks = forms[drawn.form]()
    return Control(form, fallbacks, cuts=2, integration=drawn.integration)


def _penalised(make: Callable[[float, float], Form], scene: Scene, factor: float) -> Form:
    K = contact_penalty(system_of(scene).candidates, factor)
    return make(K, K)


def run(drawn: Drawn, scene: Scene) -> Ran:
    """March ``scene`` as drawn; BipotErrors end it in words, anything else is raised."""
    steps, began, reason, claim = list[Accepted](), time.process_time(), "", None
    try:
        for accepted in march(scene, drawn.schedule, control_of(drawn, scene), observe=until(LONGEST)):
            steps.append(accepted)
            if time.process_time() - began > SECONDS:
                reason = f"left after {SECONDS:g} s of processor time"
                break
    except Late:
        reason = f"left in an increment after {LONGEST:g} s of processor time"
    except BipotError as error:
        reason, claim = f"{type(error).__name__}: {error}", claim_of(error)
    return Ran(scene, steps, reason, claim)


def measured(ran: Ran) -> list[Measures]:
    """The independent measures of every accepted increment."""
    setting, largest, energy, out = setting_of(ran.scene), 0.0, 0.0, list[Measures]()
    for accepted in ran.steps:
        largest = max(largest, float(np.abs(accepted.state.forces).max(initial=0.0)))
        out.append(measure(setting, replace(step_of(ran.scene, setting, accepted, largest), energy=energy)))
        energy = max(energy, *map(abs, out[-1].energies))
    return out


def broken(m: Measures, exact: bool, excused: Collection[str] = ()) -> list[str]:
    """The measures that are beyond their limits, in words; a form that poses another law is asked for less.

    Where the library says that they are below its resolution, and they may be, some are ``excused``.
    """
    names = [name for name in (LIMITS if exact else POSED_BY_ALL) if name not in excused]
    out = [f"{name} {getattr(m, name):.1e}" for name in names if not getattr(m, name) <= LIMITS[name]]
    if not m.orientation > 0:
        out.append(f"orientation {m.orientation:.1e}")
    shares = {"plastic": m.plastic, "friction": m.friction} if exact else {"plastic": m.plastic}
    return out + [f"{name} dissipation {share:.1e}" for name, share in shares.items() if not share >= DISSIPATES]


def unproved(ran: Ran) -> list[str]:
    """What is wrong with the claim that the run ended with, if any."""
    return [] if ran.claim is None else refuted(ran.scene, ran.claim)


def excuses(ran: Ran) -> list[tuple[str, ...]]:
    """Which measures the library says to be below resolution in each accepted increment, and may be.

    All where stress and contact forces are BLURRED of elastic, the law where contact forces are; beside it what drives
    tools where that is nothing.
    """
    setting, out = setting_of(ran.scene), list[tuple[str, ...]]()
    for accepted in ran.steps:
        below = accepted.solved.certificate.below_resolution(BOUNDS)
        stress, forces = idle(ran.scene, setting, accepted, BLURRED)
        law = ("law",) if "law" in below and forces else ()
        undriven = all(is_round_off(accepted, drive.at(accepted.state.tau)) for drive in drives(ran.scene))
        driven = ("driven",) if law and undriven else ()
        out.append((*BELOW_RESOLUTION, *driven) if below and stress and forces else law + driven)
    return out


def energy_error(all_measures: list[Measures]) -> float:
    """|work - elastic - plastic - friction| over work at the end; 0 without work."""
    work, *parts = np.sum([m.energies for m in all_measures], axis=0) if all_measures else np.zeros(4)
    return float(abs(work - sum(parts)) / abs(work)) if work else 0.0


def disagreement(base: Ran, other: Ran, seen: Variant, resolution: float) -> tuple[float, float, int]:
    """Largest difference of forces and of displacements over the runs' largest, while both took the same increments.

    Forces within twice the ``resolution`` are not told apart. The third number is that of the increments compared. What
    is not unique, or tells nothing of the original, is not compared.
    """
    mine, theirs = setting_of(base.scene), setting_of(other.scene)
    forces, moves, count = [np.zeros(2)], [np.zeros(2)], 0
    for a, b in zip(base.steps, other.steps, strict=False):
        same = abs(a.state.tau - b.state.tau) <= 1e-12
        if not (same and reported_unique(a) and reported_unique(b) and seen.tells(b.state.nodes)):
            break
        count += 1
        r = forces_by_node(base.scene, mine, a.state)
        s = seen.nodal(forces_by_node(other.scene, theirs, b.state)[: len(r), seen.number]) / (seen.force * seen.weight)
        u = a.state.nodes - base.scene.mesh.nodes
        v = seen.nodal(b.state.nodes - other.scene.mesh.nodes)[seen.number] / seen.length
        forces.append(np.array([np.abs(r - s).max() - 2 * resolution, np.abs(r).max()]))
        moves.append(np.array([np.abs(u - v).max() - _blur(base.scene), np.abs(u).max()]))
    return _share(forces), _share(moves), count


def _blur(scene: Scene) -> float:
    """Displacements as differences of positions carry their round-off."""
    return 8 * float(np.finfo(np.float64).eps) * float(np.abs(scene.mesh.nodes).max())


def _share(pairs: list[Floats]) -> float:
    difference, size = np.max(pairs, axis=0)
    return float(difference / size) if difference > 0 and size > 0 else 0.0


def judge_scene(seed: int, others: bool = True) -> Row:
    """The row of a seed's scene; ``others`` says whether its variants are run too."""
    return ended(known("scene", seed, draw, partial(_judged, others=others)))


def judge_shaped(seed: int, others: bool = True) -> Row:
    """The same of the seed's scene with tools that are not flat."""
    return ended(known("shaped", seed, draw_shaped, partial(_judged, others=others)))


def judge_regional(seed: int, others: bool = True) -> Row:
    """The same of the seed's scene of several materials."""
    return ended(known("regional", seed, draw_regional, partial(_judged, others=others)))


def known(name: str, seed: int, drawing: Callable[[int], Drawn], judging: Callable[[Row, Drawn], Row]) -> Iterator[Row]:
    """What is known of a seed's scene: before it is drawn, before it is judged, and in the end."""
    yield (row := Row(seed, name, "", Outcome.RAW, "", 0, 0.0, 0.0, 0.0, 0.0))
    try:
        drawn = drawing(seed)
        yield (row := replace(row, kind=f"{name} {drawn.kind}", form=drawn.form))
        yield judging(row, drawn)
    except BipotError as error:
        # A scene or variant that is refused when it is made.
        yield replace(row, outcome=Outcome.REFUSED, reason=f"{type(error).__name__}: {error}")


def _others(drawn: Drawn, seed: int) -> list[Variant]:
    """What the scene is run as besides; penalties are a law of every node's, which a plane of symmetry would halve.

    Turned are bodies in plane strain alone, one of three.
    """
    rng, out = np.random.default_rng([seed, 13]), list[Variant](variants(drawn.scene, seed))
    if drawn.scene.geometry is Geometry.PLANE_STRAIN and rng.random() < TURNED:
        out.append(turned(drawn.scene, float(rng.uniform(0.05, 2 * np.pi))))
    return out + (unfolded(drawn.scene) if drawn.form != "penalty" else [])


def read(seen: Variant, ran: Ran) -> Ran:
    """A run of a variant in the terms in which it is judged."""
    steps = [
        replace(a, start=seen.read(a.start), course=replace(a.course, state=seen.read(a.state))) for a in ran.steps
    ]
    claim = ran.claim
    if claim is not None:
        ways = seen.ways(claim.ways)
        claim = replace(claim, state=seen.read(claim.state), motion=seen.read_vectors(claim.motion), ways=ways)
    return Ran(seen.read_in, steps, ran.reason, claim)


def _judged(row: Row, drawn: Drawn, others: bool) -> Row:
    base = run(drawn, drawn.scene)
    exact = drawn.form != "penalty"
    all_measures = measured(base)
    wrong = [
        f"increment {k}: {what}"
        for k, (m, e) in enumerate(zip(all_measures, excuses(base), strict=True), 1)
        for what in broken(m, exact, e)
    ]
    wrong += misstated(base.scene, base.steps, all_measures) + unproved(base)
    worst, moved, resolution = 0.0, 0.0, max((m.resolution for m in all_measures), default=0.0)
    for seen in _others(drawn, row.seed) if others else ():
        other = read(seen, run(drawn, seen.scene))
        force, move, count = disagreement(base, other, seen, resolution)
        worst, moved = max(worst, force, move), max(moved, move)
        where = f"{seen.name}, {count} increments"
        wrong += [
            f"{where}: {what}"
            for m, e in zip(measured(other), excuses(other), strict=True)
            for what in broken(m, exact, e)
        ][:1]
        wrong += [f"{where}: {what}" for what in unproved(other)[:1]]
        if not force <= DISAGREEMENT:
            wrong.append(f"{where}: forces differ by {force:.1e}")
        elif move <= DISAGREEMENT:
            terms = 2 * images(base.scene) * sum(m.terms for m in all_measures)
            whole = difference(base.steps[:count], other.steps[:count], base.scene, seen, 2 * resolution, terms)
            wrong += [
                f"{where}: {name} differ by {off:.1e}"
                for name, off in zip(("whole tools' forces", "energies"), whole, strict=True)
                if not off <= DISAGREEMENT
            ]
    said = f"energy error {energy_error(all_measures):.1e}"
    return concluded(
        row,
        wrong,
        base.reason,
        said + (f", displacements differ by {moved:.1e}" if moved > DISAGREEMENT else ""),
        increments=len(base.steps),
        residuals=[m.equilibrium for m in all_measures],
        laws=[m.law for m in all_measures] if exact else [float("nan")],
        disagreement=worst,
    )
