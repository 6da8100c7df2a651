"""Hard cases that are programs, not marches: limit loads under force control, and fixed points that cycle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from bipot.conic.clarabel import solve
from bipot.conic.solver import Accuracy
from bipot.errors import UnboundedProgram
from bipot.fem.strain import Configuration
from bipot.forms import FormName
from bipot.laws.coulomb import bipotential_gap, natural_map
from bipot.marching import system_of
from bipot.programs.conic import TangentProgram
from bipot.programs.data import Block, ContactRows, Units
from bipot.programs.dissipation import ROOT, DissipationProgram, PlasticModel
from bipot.programs.fixed_point import Coupled, Coupling, Safeguard, image
from bipot.programs.polish import polish
from bipot.programs.terms import ContactTerms
from bipot.scene import Scene, upsetting
from bipot.typing import Floats
from studies.hard_scenes import Outcome

ACCURACY = Accuracy(1e-10)
FARKAS = 1e-6
LIMIT_LOAD = 300.0 * np.pi * 5.0**2
"""sigma_Y pi R^2 of the cylinder."""
SETTLED = 1e-8
RULE = Safeguard()


class Ended(NamedTuple):
    """How a case ended: outcome, passes, relative gap, fallbacks, and what was said on the way."""

    outcome: Outcome
    passes: int
    gap: float
    fallbacks: int = 0
    said: str = ""


@dataclass(frozen=True)
class ProgramCase:
    """A named case of one increment or program, and how it must end."""

    name: str
    form: FormName
    expected: Outcome
    run: Callable[[], Ended]


def program_cases() -> list[ProgramCase]:
    """Case 14."""
    return [
        ProgramCase(f"14 {name}", FormName.TANGENT, Outcome.CERTIFIED, lambda W=W, q=q, mu=mu: coupled(W, q, mu))
        for name, W, q, mu in DISCRETE
    ]


def limit_scene() -> Scene:
    """The cylinder without friction, its geometry frozen, pressed on its top only."""
    scene = upsetting(mu=0.0, elements=4, configuration=Configuration.PAPER)
    return replace(scene, tools=(replace(scene.tools[0], candidates=("top",)),))


def no_contact(unknowns: int) -> ContactTerms:
    """Contact terms of no candidate."""
    empty, none = sp.csr_matrix((0, unknowns)), np.zeros(0)
    rows = ContactRows(empty, none, empty, np.zeros((0, 1)), np.zeros(0, np.intp), none, np.zeros(0, bool))
    return ContactTerms(rows, none)


def limit_program(factor: float) -> tuple[DissipationProgram, Units]:
    """The frictionless cylinder under ``factor`` times its limit load sigma_Y pi R^2, geometry frozen.

    The punch is a free unknown, the last: all nodes of the top move down with it.
    """
    scene = limit_scene()
    system = system_of(scene)
    space = system.body.space
    state = system.rest()
    model = system.body.plastic_model(system.body.respond(state, np.zeros(space.size)))
    top = space.position[2 * scene.mesh.boundary_nodes("top") + 1]
    own = np.setdiff1d(np.arange(space.size), top)
    T = sp.csr_matrix(
        (
            np.concatenate([np.ones(len(own)), -np.ones(len(top))]),
            (np.concatenate([own, top]), np.concatenate([np.arange(len(own)), np.full(len(top), len(own))])),
        ),
        shape=(space.size, len(own) + 1),
    )
    model = replace(model, volumetric=model.volumetric @ T, deviatoric=model.deviatoric @ T)
    force = np.zeros(len(own) + 1)
    force[-1] = factor * LIMIT_LOAD
    units = Units(5.0 * 300.0 / 210_000.0, 5.0, 300.0, 5.0**3)
    return DissipationProgram(model, force, no_contact(len(force))), units


def force_controlled(factor: float) -> Ended:
    """Solve; certified when equilibrium and yield hold, unbounded when the ray is a collapse mechanism."""
    program, units = limit_program(factor)
    scaled = program.scaled(units)
    try:
        answer = solve(scaled.conic(), ACCURACY)
    except UnboundedProgram as unbounded:
        v = np.asarray(unbounded.ray)[: len(scaled.force)]
        farkas = Farkas.of(scaled.model, v, float(scaled.force @ v))
        return Ended(farkas.outcome, 1, 0.0, said=f"{unbounded}; {farkas}")
    m = scaled.model
    x = answer.block(Block.DISPLACEMENT)
    elastic = answer.block(Block.ELASTIC_DEVIATOR).reshape(m.stress.shape)
    deviator = m.stress + 2 * m.shear * elastic
    pressure = m.pressure + m.bulk * (m.volumetric @ x + m.trace_0)
    internal = m.volumetric.T @ (m.weight * pressure) + m.deviatoric.T @ (m.weight[:, None] * deviator).ravel()
    balance = float(np.abs(internal - scaled.force).max() / scaled.force.max())
    excess = float((np.sqrt(1.5) * np.linalg.norm(deviator, axis=1) / m.threshold).max()) - 1
    plastic = scaled.plastic_strain(answer)
    gap = ROOT * m.threshold * np.linalg.norm(plastic, axis=1) - np.sum(deviator * plastic, axis=1)
    work = abs(float(scaled.force @ x))
    met = balance <= 1e-6 and excess <= 1e-6
    return Ended(Outcome.CERTIFIED if met else Outcome.FAILED, 1, float(m.weight @ np.abs(gap)) / work)


@dataclass(frozen=True)
class Farkas:
    """What makes a motion v of a body a collapse mechanism, everything over the gain of the load.

    ``volume`` is the largest change of volume (as work of sigma_Y), ``dissipated`` what plastic flow takes, and
    ``overtaken`` how far the punch passes a node, over its own way.
    """

    volume: float
    dissipated: float
    overtaken: float = 0.0

    @classmethod
    def of(cls, m: PlasticModel, v: Floats, gain: float, overtaken: float = 0.0) -> Farkas:
        """Of the motion v (n,) that gains ``gain``; one that gains nothing is no mechanism."""
        if not gain > 0:
            return cls(np.inf, np.inf, overtaken)
        change = np.abs(m.volumetric @ v).max() * m.weight.sum() * m.threshold.max()
        flow = np.linalg.norm((m.deviatoric @ v).reshape(m.stress.shape), axis=1)
        dissipated = float(ROOT * (m.weight * m.threshold) @ flow)
        return cls(float(change) / gain, dissipated / gain, overtaken)

    @property
    def holds(self) -> bool:
        """No volume changes, less is dissipated than gained, no node is overtaken."""
        return self.volume <= FARKAS and self.dissipated < 1 and self.overtaken <= FARKAS

    @property
    def outcome(self) -> Outcome:
        """Of a run above the limit load that ended with this motion."""
        return Outcome.UNBOUNDED if self.holds else Outcome.FAILED

    def __str__(self) -> str:
        return (
            f"{'a' if self.holds else 'not a'} mechanism: volume {self.volume:.1e}, dissipation {self.dissipated:.9f} "
            f"of the load's gain, nodes overtaken by {self.overtaken:.1e}"
        )


DISCRETE = (
    (
        "Gauss-Seidel cycles",
        np.array([[15.0, 11, 4, 7], [11, 17, 11, 8], [4, 11, 11, 4], [7, 8, 4, 9]]),
        np.array([-1.0, 0, -1, -3]),
        1.0,
    ),
    (
        "De Saxce cycles",
        np.array([[28.0, -5, -12, -10], [-5, 17, -12, -5], [-12, -12, 22, 7], [-10, -5, 7, 10]]),
        np.array([-4.0, 1, -4, -4]),
        1.0,
    ),
    (
        "threshold cycles",
        np.array([[10.0, 4, 14, 2], [4, 20, -4, -7], [14, -4, 32, 12], [2, -7, 12, 11]]),
        np.array([-2.0, -3, -3, -1]),
        1.0,
    ),
)
"""Name, W, q, mu. The first two are published; the third is a search's. Each has one solution."""


@dataclass(frozen=True)
class Small:
    """A pass on a small problem: forces and motions (c, 2), their distance from the law, how they were coupled."""

    r: Floats
    u: Floats
    distance: float
    coupled: Coupled


def coupled(W: Floats, q: Floats, mu: float, passes: int = 200) -> Ended:
    """The increment's own coupling code on u = W r + q, until Coulomb's law holds."""
    for number, small in enumerate(islice(passes_of(W, q, mu), passes), start=1):
        if small.distance <= SETTLED:
            gap = np.abs(bipotential_gap(small.u, small.r, mu)).sum() / np.abs(small.r * small.u).sum()
            return Ended(Outcome.CERTIFIED, number, float(gap))
    return Ended(Outcome.FAILED, passes, np.inf)


def passes_of(W: Floats, q: Floats, mu: float, rule: Safeguard = RULE) -> Iterator[Small]:
    """Pass after pass. The distance is that of the natural map, over the largest force."""
    K, c = np.asarray(np.linalg.inv(W), dtype=np.float64), len(q) // 2
    identity = sp.csr_matrix(np.eye(2 * c))
    zero, rho = np.zeros(c), 2 * c / float(np.trace(W))
    rows = ContactRows(identity[::2], zero, identity[1::2], zero[:, None], np.arange(c), zero + mu, zero > 0)
    coupling = Coupling.start(image(rows, np.zeros((c, 2)), q), rule)
    while True:
        program = TangentProgram(K, K @ q, ContactTerms(rows, coupling.value, coupling.shift))
        answer = solve(program.conic(), ACCURACY)
        x, r = polish(program, answer.block(Block.DISPLACEMENT), program.contact.contact_forces(answer))
        u = rows.motion(x)
        coupling = coupling.update(image(rows, r, x))
        distance = float(np.abs(natural_map(r, u, mu, rho)).max() / np.abs(r).max(initial=1e-300))
        yield Small(r, u, distance, coupling.report)
