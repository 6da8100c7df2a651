"""The penalised forms: the seed paper's (26)-(29), and the same made exact by updating the traction (Uzawa)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import Enum
from typing import ClassVar

import numpy as np

from bipot.conic.problem import Timing
from bipot.conic.solver import Accuracy
from bipot.contact.candidates import Candidates
from bipot.contact.closeness import touches
from bipot.contact.mobility import shares
from bipot.errors import (
    LARGEST_LENGTH,
    LARGEST_STRESS,
    UnsuitedForm,
    require,
    require_magnitude,
    require_positive,
    require_type,
)
from bipot.fem.surface import facet_mass
from bipot.forms.base import Cache, FormName, Step
from bipot.forms.posed import Posed, sprung
from bipot.iterate import Iterate
from bipot.laws.penalised import default_penalty
from bipot.meshes.elements import Element
from bipot.meshes.facets import edges_of
from bipot.programs.data import Stopwatch
from bipot.programs.frames import Frames
from bipot.programs.penalty import Minimum, PenaltyProgram, PenaltyTerms
from bipot.programs.penalty_newton import newton
from bipot.programs.penalty_optimisers import fictitious, gradient_only, trust_region
from bipot.response import TangentKind
from bipot.scene.symmetry import own_share
from bipot.traction import on_line
from bipot.typing import Bools, Floats, Ints, make_floats

TIGHT = (Accuracy(1e-14), Accuracy(1e-12), Accuracy(1e-10))
"""Tolerances of interior points, tried in turn: an unattainable one makes them stop short of what they can reach."""


class Optimiser(Enum):
    """How the penalised program is minimised."""

    NEWTON = "newton"
    TRUST_REGION = "trust_region"
    GRADIENT_ONLY = "gradient_only"
    CVXPY = "cvxpy"

    def minimise(self, program: PenaltyProgram, start: Floats, frames: Frames | None = None) -> Minimum:
        """The minimiser of a dimensionless program, with the contacts' ``frames`` if known; raises ProgramError."""
        # Without contacts the program is one linear system, whatever the optimiser.
        if self is Optimiser.NEWTON or not program.contact.rows.count:
            return newton(program, start, frames)
        return _OPTIMISERS[self](program, start)


_OPTIMISERS: dict[Optimiser, Callable[[PenaltyProgram, Floats], Minimum]] = {
    Optimiser.TRUST_REGION: trust_region,
    Optimiser.GRADIENT_ONLY: gradient_only,
    Optimiser.CVXPY: lambda program, start: fictitious(program, TIGHT),
}


@dataclass(frozen=True)
class Penalised(ABC):
    """What both forms share: the penalties ``K_n``, ``K_t``, and a pass that ends at the minimiser of its program.

    ``K_n``, ``K_t`` are forces per length at one node of the whole body, finite and positive (:func:`contact_penalty`
    gives a scale); at a node of which planes of symmetry leave a part they are multiplied by that part.
    """

    K_n: float
    K_t: float
    optimiser: Optimiser = Optimiser.NEWTON
    kind: TangentKind = TangentKind.CONSISTENT

    def __post_init__(self) -> None:
        make_floats(self, K_n="finite and > 0", K_t="finite and > 0")
        for name in ("K_n", "K_t"):
            require_magnitude(getattr(self, name), name, LARGEST_STRESS * LARGEST_LENGTH)
        require_type(self.optimiser, Optimiser, "penalty.optimiser")
        require_type(self.kind, TangentKind, "penalty.kind")

    def init(self, iterate: Iterate, r: Floats, cache: Cache) -> Posed:
        """The state before the first pass."""
        return Posed.of(iterate, r, cache)

    @abstractmethod
    def program(self, iterate: Iterate, r: Floats, state: Posed) -> PenaltyProgram:
        """The pass's program in its own units."""

    def step(self, iterate: Iterate, r: Floats, state: Posed) -> tuple[Step, Posed]:
        """One proximal-Newton pass: the minimiser of its program, found from the last iterate."""
        clock, state = Stopwatch(), state.at(iterate)
        with clock:
            program = self.program(iterate, r, state)
        units = state.units
        scaled = program.scaled(units)
        frames = state.cache.frames(scaled.contact.rows, iterate)
        x, outcome, iterations, timing = self.optimiser.minimise(scaled, iterate.x / units.length, frames)
        with clock:
            there = iterate.increment.at(x * units.length)
        near = scaled.contact.forces(x)
        r = state.spread(near * units.force)
        posed = replace(scaled.contact, rows=state.turned(there).rows.scaled(units)).mismatch(x, near)
        state = state.after(there, r, exact=False)
        timing += Timing(assembly=clock.seconds)
        return Step(there, r, outcome, iterations, timing, state.coupling.report, posed), state

    def _program(self, iterate: Iterate, r: Floats, state: Posed, start_gap: Floats, t_0: Floats) -> PenaltyProgram:
        """The program for contacts that start with the gaps ``start_gap`` (f,) and the forces ``t_0`` (f, d)."""
        if state.rows.tied.any():
            raise UnsuitedForm("the penalised forms do not weld (mu = inf), but a large finite mu they take")
        K, threshold = iterate.stiffness(self.kind), state.terms(iterate, r).threshold
        f = K @ iterate.x - iterate.residual
        if (driven := np.ones(iterate.translated.size, dtype=bool)).size:
            # A penalised contact resists only once it is closed: while all are open, their rows hold no tool.
            K, f = sprung(K, f, iterate, state, driven, state.units.length, state.units.force)
        share = iterate.increment.system.candidates.share[state.near]
        K_n, K_t = self.K_n * share, self.K_t * share[state.rows.frictional]
        return PenaltyProgram(K, f, PenaltyTerms(state.rows, start_gap, t_0, threshold, K_n, K_t))


@dataclass(frozen=True)
class Penalty(Penalised):
    """(26)-(29) from the traction of the last increment: penetration t_n/K_n, elastic creep t_t/K_t of sticking points.

    The penalties are as in :class:`Penalised`. The answer must meet the penalised law that is posed; the certificate of
    the exact law is only reported.
    """

    name: ClassVar[FormName] = FormName.PENALTY

    def program(self, iterate: Iterate, r: Floats, state: Posed) -> PenaltyProgram:
        """The pass's program in the scene's units; a penetration without a force yet gets t_n0 = -K_n g0."""
        start, state = iterate.increment.start, state.at(iterate)
        t_0, start_gap = start.forces[state.near], start.gap[state.near]
        k_n = self.K_n * iterate.increment.system.candidates.share[state.near]
        t_0[:, 0] = np.where(t_0[:, 0] == 0, k_n * np.maximum(-start_gap, 0), t_0[:, 0])
        return self._program(iterate, r, state, start_gap, t_0)


@dataclass(frozen=True)
class Uzawa(Penalised):
    """The penalised law with t_0 updated in every pass: Uzawa on the bipotential's augmented Lagrangian.

    Its fixed point is the exact law at any penalty, and is reached faster with a larger one: t_n = (t_n - K_n gap)+ and
    t_t = projection of t_t - K_t du_t on the disc of radius mu t_n hold only where (12) does.
    """

    name: ClassVar[FormName] = FormName.UZAWA

    def program(self, iterate: Iterate, r: Floats, state: Posed) -> PenaltyProgram:
        """The pass's program: du_n is measured from contact, so no penetration is carried on."""
        state = state.at(iterate)
        return self._program(iterate, r, state, np.zeros(state.rows.count), r[state.near])

    def step(self, iterate: Iterate, r: Floats, state: Posed) -> tuple[Step, Posed]:
        """One proximal-Newton pass and one update of the traction, judged by the exact law."""
        step, state = super().step(iterate, r, state)
        return replace(step, posed=None), state


def contact_penalty(candidates: Candidates, factor: float = 1.0) -> float:
    """Penalty K = factor E A/(m h) of a node or weighted point, the same for all.

    E is the largest Young's modulus of elements at the tools' boundaries. A and m are the area and number of points of
    the initial contact line: the edges of candidates closed at rest, or if there are none of all candidates, or else of
    the tools' whole boundaries; h is its mean edge length. On average this is a pressure of factor E/h per penetration.
    Points and edges in planes of symmetry count by their share of the whole body's. Tributary areas instead of the mean
    A/m would vanish at an axis.

    Raises:
        SceneError: a factor that is not finite and positive, a scene without tools.
    """
    require_positive(factor=factor)
    scene = candidates.scene
    require(len(scene.tools) > 0, "scene.tools", scene.tools, "at least one: a penalty is that of a contact")
    closed = touches(candidates.distance(scene.mesh.nodes, scene.at_rest), scene.size)
    lines, count = next((lines, count) for lines, count in _lines(candidates, closed) if len(lines))
    area = facet_mass(scene.mesh.nodes, lines, scene.geometry).sum()
    # In space the edges of faces, each once.
    edges = lines[:, [0, -1]] if scene.mesh.dimension == 2 else edges_of(lines, Element.of(lines.shape[1]))[0]
    ends = scene.mesh.nodes[edges]
    h = np.average(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), weights=own_share(scene.planes, ends))
    owners = np.concatenate([scene.mesh.owners(*tool.candidates) for tool in scene.tools])
    young = np.broadcast_to(scene.materials.elasticity.young, (len(scene.mesh.elements), 1))[owners].max()
    return factor * default_penalty(float(young), float(h), float(area) / count)


def _lines(candidates: Candidates, closed: Bools) -> Iterator[tuple[Ints, float]]:
    """Edges (f, n), as node numbers, and the number of their points in the whole body.

    They are those of closed candidates, then of all candidates, then of the tools' whole boundaries.
    """
    tools, scene = range(len(candidates.points)), candidates.scene
    on_lines, may_touch = [on_line(candidates, k, closed) for k in tools], [_may_touch(candidates, k) for k in tools]
    for chosen in (on_lines, may_touch, [np.ones(len(points.point), dtype=bool) for points in candidates.points]):
        pairs = list(zip(candidates.points, chosen, strict=True))
        lines = np.concatenate([points.facets[mine] for points, mine in pairs])
        parts = [shares(scene, k, points)[np.unique(points.point[mine])] for k, (points, mine) in enumerate(pairs)]
        yield lines, sum(float(part.sum()) for part in parts)


def _may_touch(candidates: Candidates, number: int) -> Bools:
    """Which edges (f,) of the boundaries of the tool of that ``number`` have only points that are candidates.

    A node in a plane of symmetry that does not cut the tool counts as one, as it is in the whole body.
    """
    scene, points, may = candidates.scene, candidates.points[number], candidates.number[number] >= 0
    for plane in scene.planes:
        if not plane.cuts(scene.tools[number]):
            may = may | plane.holds(scene.mesh.nodes[points.node])
    return np.asarray(may[points.point].all(axis=1))
