"""The state of the forms that pose a program in every pass: which candidates get rows, and what friction freezes.

What the exact conic forms have in common is here, too: the solution of a program, Newton on the quadratic model, and
the remaining error.

Tools driven by forces or moments are held by a spring where nothing else in a program resists them. A program that is
solved through its stiffness alone (`delassus`) needs one for every such tool; `newton` has a spring of its own. The
spring has no tension at the iterate, so that each pass is a proximal-point step: its pull vanishes as the passes
converge, and the solution of the increment is free of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from bipot.checks.examined import driving
from bipot.conic.problem import Claim, Timing
from bipot.conic.solver import Accuracy, ConicSolver, answered_to_less
from bipot.contact.closeness import near_tools
from bipot.errors import InfeasibleProgram, require
from bipot.forms.base import Cache, FormName
from bipot.iterate import Iterate
from bipot.laws.coulomb import force_threshold, natural_map
from bipot.programs.conic import TangentProgram, couple
from bipot.programs.data import Block, ContactRows, Stopwatch, Units
from bipot.programs.dissipation import DissipationProgram
from bipot.programs.fixed_point import Coupling, Frozen, Safeguard, image
from bipot.programs.newton import Model
from bipot.programs.terms import ContactTerms
from bipot.response import TangentKind
from bipot.typing import Bools, Floats, max_abs

UNPUSHED = 1e-9
"""Work of loads on rigid motions of length one, over the loads, that is round-off."""

SOFT = 1e-5
"""The stiffness of the spring over that of the tool's elastic support."""

UNBALANCED = 1e-2
"""The part of a driving force that may be unbalanced at a tool that the body holds, and not a spring alone."""

SHIFTED = "no displacement satisfies the cones of friction with the shift of the last pass frozen in them"
"""Why a program with a frozen shift has no solution. The gaps may have one: it says nothing of tools and supports."""


@dataclass(frozen=True)
class Posed:
    """The candidates ``near`` (c,) their tool, their contact ``rows``, the coupling of friction, units of the program.

    ``distance`` is how far the last iterate is from equilibrium and law on these rows, None if unknown; ``rose`` says
    that the last pass did not reduce it.
    """

    cache: Cache
    units: Units
    near: Bools
    rows: ContactRows
    coupling: Coupling
    distance: float | None = None
    rose: bool = False

    @staticmethod
    def of(iterate: Iterate, r: Floats, cache: Cache, rule: Safeguard | None = None) -> Posed:
        """The state before the first pass; with a ``rule`` passes may also freeze De Saxce's shift, else the threshold.

        Where loads push along a motion that supports leave free, the shift comes first: thresholds by smaller forces
        might not hold the body, and the program would have no minimum. Where friction is capped, the threshold takes
        over after one pass.

        Candidates within a few lengths of a tool at the predicted end get rows, and the others once they touch; all get
        rows where body or tool may move by any distance.
        """
        rows, units, system = iterate.rows, iterate.increment.units, iterate.increment.system
        near = near_tools(rows, iterate.x, units.length)
        if system.rigid.size or iterate.translated.size:
            # A body or tool that supports do not hold may move as far as the next contact.
            near = np.ones_like(near)
        capped, shifts, rule = system.candidates.capped, rule is not None, rule or Safeguard()
        pushed = _pushed(iterate)
        if pushed:
            rule = replace(rule, first=Frozen.SHIFT)
        if capped:
            # The shift belongs to a cone. With caps it can only start, and only if Coulomb's law acts everywhere.
            shifts &= pushed and bool(np.isfinite(rows.mu[rows.rubs]).all())
        coupling = Coupling.start(image(rows, r, iterate.x), rule, shifts)
        return Posed(cache, units, near, rows.take(near), coupling)

    def at(self, iterate: Iterate) -> Posed:
        """The state with the rows of an iterate, including candidates that have penetrated their tool."""
        entering = ~self.near & (iterate.motion[:, 0] < 0)
        if not entering.any():
            return self.turned(iterate)
        near = self.near | entering
        return replace(self, near=near, rows=iterate.rows.take(near), distance=None)

    def turned(self, iterate: Iterate) -> Posed:
        """The state with the same candidates' rows at an iterate; at flat tools without caps they never change."""
        candidates = iterate.increment.system.candidates
        changes = candidates.curved or candidates.capped
        return replace(self, rows=iterate.rows.take(self.near)) if changes else self

    def terms(self, iterate: Iterate, r: Floats) -> ContactTerms:
        """The contact terms of the next program, with threshold or shift frozen; r (c, d) are all last forces."""
        coupling, active = self.coupling, self.near[iterate.rows.frictional]
        if coupling.shift is None:
            return ContactTerms(self.rows, coupling.value[active], None)
        return ContactTerms(self.rows, self.rows.threshold(r[self.near]), coupling.shift[active])

    def spread(self, r: Floats) -> Floats:
        """Forces (c, d) of all candidates from those that have rows."""
        out = np.zeros((len(self.near), r.shape[1]))
        out[self.near] = r
        return out

    def after(self, iterate: Iterate, r: Floats, exact: bool, distance: float | None = None) -> Posed:
        """The state after a pass to ``iterate`` and all forces r (c, d); ``exact`` if its answer froze nothing."""
        frozen = image(iterate.rows, r, iterate.x)
        coupling = self.coupling.update(frozen, exact)
        if coupling.shift is not None and iterate.increment.system.candidates.capped:
            coupling = replace(Coupling.start(frozen, coupling.rule, second=False), report=coupling.report)
        rose = distance is not None and self.distance is not None and distance >= self.distance
        return replace(self, coupling=coupling, distance=distance, rose=rose)


def _pushed(iterate: Iterate) -> bool:
    """Whether loads, or forces on tools, do work on a rigid motion that supports leave free.

    Otherwise every program has a minimum, even if contacts carry nothing.
    """
    system = iterate.increment.system
    if not system.rigid.size:
        return False
    work = system.rigid_at(iterate.increment.start.nodes).T @ iterate.load
    return iterate.translated.size > 0 or max_abs(work) > UNPUSHED * float(np.linalg.norm(iterate.load))


@dataclass(frozen=True)
class Raw:
    """An answer in the program's own units, the solver's claim and cost, and whether friction is exact."""

    u: Floats
    r: Floats
    outcome: Claim
    iterations: int
    timing: Timing
    exact: bool = False


class Tried(NamedTuple):
    """An iterate with all forces r (c, d), its distance from equilibrium and law, and whether its step was whole."""

    iterate: Iterate
    r: Floats
    distance: float
    whole: bool = True


def solved(
    program: TangentProgram | DissipationProgram, name: FormName, solver: ConicSolver, accuracy: Accuracy, cache: Cache
) -> Raw:
    """Solve the program of the form of that name, whose ``solver`` keeps reusable data in the cache.

    Raises:
        InfeasibleProgram, UnboundedProgram, ProgramError, BrokenSolver: as of
            :func:`~bipot.conic.solver.answered_to_less`.
    """
    try:
        answer, handle = answered_to_less(solver, program.conic(), accuracy, cache.handles.get(name))
    except InfeasibleProgram as found:
        if program.contact.shift is None:
            raise
        # Where every displacement that closes a gap slips by more than the shift allows, the gaps alone have solutions.
        raise InfeasibleProgram(SHIFTED) from found
    cache.handles[name] = handle
    r = program.contact.contact_forces(answer)
    return Raw(answer.block(Block.DISPLACEMENT), r, answer.outcome, answer.iterations, answer.timing)


def tangent_program(
    iterate: Iterate, terms: ContactTerms, state: Posed, kind: TangentKind, clock: Stopwatch
) -> TangentProgram:
    """The tangent program of a pass, dimensionless."""
    with clock:
        K = iterate.stiffness(kind)
    program = TangentProgram(K, K @ iterate.x - iterate.residual, terms).scaled(state.units)
    if not iterate.translated.size:
        return program
    return softly_held(program, iterate, state, unresisted(program.contact, iterate))


def exact_model(iterate: Iterate, r: Floats, state: Posed, clock: Stopwatch) -> Model:
    """The exact linearisation of equilibrium at an iterate and forces r (c, d), dimensionless; unsymmetric."""
    units = state.units
    with clock:
        K = iterate.increment.system.body.space.matrix(iterate.tangent(r))
    f = (K @ iterate.x - iterate.residual) / units.force
    return Model(K * (units.length / units.force), f, state.rows.scaled(units))


def in_the_air(iterate: Iterate, r: Floats) -> bool:
    """Whether contact forces r (c, d) leave some of what drives a tool unbalanced: no exact linearisation holds it."""
    if not iterate.translated.size:
        return False
    beside = iterate.increment.system.body.space.beside
    unbalanced, given = np.abs(beside(iterate.residual - iterate.rows.forces(r))), np.abs(beside(iterate.load))
    # Wrong contact forces times their arms may be far above a moment; of a roll that nothing turns they are the scale.
    return bool((unbalanced > UNBALANCED * np.where(given > 0, given, driving(iterate, r))).any())


def coupled(model: Model, iterate: Iterate, r: Floats, state: Posed) -> tuple[Floats, Floats] | None:
    """The dimensionless displacement and forces (f, d) that Newton with exact friction finds on the ``model``.

    It starts from the iterate and forces r (c, d); None if it does not reach a solution.
    """
    units, frames = state.units, state.cache.frames(model.rows, iterate)
    return couple(model, iterate.x / units.length, r[state.near] / units.force, frames)


def distance_of(iterate: Iterate, r: Floats, state: Posed) -> float:
    """The largest component of the residuals of equilibrium and of the exact law, in the units of the program."""
    return max(map(max_abs, _missed(iterate, r, state)))


def error_of(iterate: Iterate, r: Floats, state: Posed) -> float:
    """The norm of the residuals of equilibrium and law over that of the contact forces; inf if these are zero.

    A candidate that was not near, and had no rows, may have gone into its tool.
    """
    present = float(np.linalg.norm(r)) / state.units.force
    sunk = np.minimum(iterate.motion[~state.near, 0], 0.0) / state.units.length
    return math.hypot(*map(np.linalg.norm, (*_missed(iterate, r, state), sunk))) / present if present else math.inf


def _missed(iterate: Iterate, r: Floats, state: Posed) -> tuple[Floats, Floats]:
    """The residual (n,) of equilibrium and the natural map (k, d) of the exact law, in the units of the program."""
    units, rows, near = state.units, state.turned(iterate).rows, r[state.near]
    residual = (iterate.residual - rows.forces(near)) / units.force
    motion, force = iterate.motion[state.near] / units.length, near / units.force
    law = natural_map(force, motion, rows.mu, 1.0, rows.cap / units.force, force_threshold(force))
    return residual, np.where(rows.tied[:, None], motion, law)


def require_solver(solver: object, field: str) -> None:
    """Raise SceneError unless the ``solver`` of a form is a ConicSolver, and not its class."""
    made = isinstance(solver, ConicSolver) and not isinstance(solver, type)
    require(made, field, solver, "a ConicSolver, e.g. Clarabel() or Cvxpy('SCS')")


def softly_held(program: TangentProgram, iterate: Iterate, state: Posed, tools: Bools) -> TangentProgram:
    """The program with a spring on the chosen ones of the driven coordinates, ``tools`` (m,)."""
    if not tools.any():
        return program
    K, f = sprung(program.K, program.f, iterate, state, tools)
    return replace(program, K=K, f=f)


def sprung(
    K: sp.csc_matrix, f: Floats, iterate: Iterate, state: Posed, tools: Bools, length: float = 1.0, force: float = 1.0
) -> tuple[sp.csc_matrix, Floats]:
    """K and f with springs on the chosen ``tools`` (m,), times units of ``length`` and ``force``."""
    space, (spring, tension) = iterate.increment.system.body.space, _springs(iterate, state, tools)
    K, f = sp.csc_matrix(K, copy=True), f.copy()
    # A sum of sparse matrices would drop stored zeros, which belong to the run's pattern.
    K.data[space.diagonal] += spring * (force / length)
    f[len(space.free) :] += tension * force
    return K, f


def softly_placed(program: DissipationProgram, iterate: Iterate, state: Posed) -> DissipationProgram:
    """The program with a spring on the driven coordinates that nothing resists."""
    tools = unresisted(program.contact, iterate)
    if not tools.any():
        return program
    spring, tension = _springs(iterate, state, tools)
    free = np.zeros(iterate.x.size - tools.size)
    force = program.force + np.append(free, tension)
    return replace(program, force=force, spring=np.append(free, spring))


def _springs(iterate: Iterate, state: Posed, tools: Bools) -> tuple[Floats, Floats]:
    """Dimensionless stiffness (m,) of the springs on the chosen ``tools`` (m,), and their force (m,) at x = 0."""
    units = state.units
    spring = SOFT * tools * iterate.increment.system.tool_stiffness * (units.length / units.force)
    return spring, spring * iterate.translated / units.length


def unresisted(terms: ContactTerms, iterate: Iterate) -> Bools:
    """Which driven coordinates (m,) are in no row: their tools press against no contact and rub against none yet."""
    count = iterate.translated.size
    dragged, _ = terms.tangent_rows(terms.sliding | terms.stuck | terms.coned)
    # With curved tools rows store zeros.
    resisted = [G.indices[G.data != 0] for G in (terms.rows.G_n, dragged)]
    first = iterate.x.size - count
    return ~np.isin(first + np.arange(count), np.concatenate(resisted))
