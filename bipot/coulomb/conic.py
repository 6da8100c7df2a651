"""Convex cone programs in the contact force, set up once and updated.

    min ½ r · P r + p · r    subject to    r in a product of second-order cones (fixed or with given radii)

P is the symmetric part of W plus a small multiple of I, which makes a W given with few digits positive. A proximal
centre cancels that multiple at the fixed point.

The associated relaxation is such a program, often mistaken for Coulomb's law, and kept apart by name:

    min ½ r · W r + q · r   over r in K_mu

Its solution has u in the dual cone, normal to r: sliding then *opens* the contact, u_n = mu |u_t| (dilatancy). That is
the flow rule of an associated material, not dry friction; De Saxcé's shift removes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse

from bipot.basics.definite import ROUGHLY
from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import Claim, Cone, ConicProgram, ConicSolution, Rows
from bipot.conic.proofs import unbounded
from bipot.conic.solver import Accuracy, ConicSolver, Handle
from bipot.coulomb.functions import ConeMap, ContactFunction
from bipot.coulomb.newton import Newton, merit
from bipot.coulomb.problem import CoulombProblem
from bipot.coulomb.proximal import ProximalPoint
from bipot.coulomb.solver import ScaledProblem, Solver, scale
from bipot.errors import InfeasibleProgram, ProgramError, UnboundedProgram, require, require_type
from bipot.typing import Floats, make_floats

# Least weight of the polish's proximal term, and the |F| of scaled numbers at which nothing is left to polish.
_LIGHTEST, _EXACT = 1e-10, 1e-15

UNBOUNDED = "the program in the contact forces is unbounded: some self-balanced forces meet no resistance"

# How far, over its numbers, the program must fall along a ray to count as unbounded: W has no more digits than that.
BALANCED = 1e12

# The largest tolerance asked for, however loosened, and the most iterations of the interior points.
_LOOSEST, _ITERATIONS = 9e-3, 200


@dataclass(frozen=True)
class ConicSettings:
    """Gap and feasibility tolerance, Clarabel's time limit [s], and the multiple of I added to W.

    A program not solved at ``tol`` is tried again at 100 tol, once; AlmostSolved is refused.
    Newton steps follow, because an interior-point answer is only as near as the square root of the gap where
    a force is on its cone while the multiplier vanishes, and asking for a smaller gap does not help.
    """

    tol: float = 1e-9
    seconds: float = math.inf
    regularisation: float = 1e-8

    def __post_init__(self) -> None:
        make_floats(self, tol="in (0, 0.01)", seconds="> 0", regularisation="finite and >= 0")

    def accuracy(self, loosened: float = 1.0) -> Accuracy:
        """The accuracy asked of the interior points."""
        return Accuracy(min(self.tol * loosened, _LOOSEST), _ITERATIONS)


@dataclass(eq=False)
class ForceProgram:
    """One program with its solver; ``solve`` changes the linear term and the radii only.

    Its cones are |r_t| <= top r_n + radius: ``top`` is mu for the friction cone, zero for discs of given radii.
    ``handle`` is the solver's data of the last program at the requested tolerance.
    """

    problem: ScaledProblem
    settings: ConicSettings
    solver: ConicSolver
    conic: ConicProgram
    handle: Handle = None

    def solve(self, linear: Floats, radius: Floats, centre: Floats | None = None) -> Floats:
        """The minimiser r (dc,), the regularisation around ``centre`` (default 0).

        Raises InfeasibleProgram where it is unbounded, ProgramError where unsolved.
        """
        if centre is not None:
            linear = linear - self.settings.regularisation * centre
        b = np.zeros((self.problem.mu.size, self.problem.dim))
        b[:, 0] = radius
        bare, cones = self.conic.rows
        program = replace(self.conic, q=linear, rows=(bare, replace(cones, b=b.ravel())))
        try:
            answer = self._answer(program)
        except UnboundedProgram as ray:
            raise InfeasibleProgram(UNBOUNDED) from ray
        if answer.outcome is not Claim.SOLVED:
            raise ProgramError(f"almost solved at {100 * self.settings.tol:.0e}, which is not accepted")
        return answer.x

    def _answer(self, program: ConicProgram) -> ConicSolution:
        """The answer at the requested tolerance, or to a second attempt at a hundred times that."""
        try:
            answer, self.handle = self.solver.solve(program, self.settings.accuracy(), self.handle)
            if answer.outcome is Claim.SOLVED:
                return answer
        except UnboundedProgram:
            raise
        except ProgramError:
            pass
        return self.solver.solve(program, self.settings.accuracy(100))[0]


def polished_force(problem: ScaledProblem, law: ContactFunction, r: Floats, load: Floats, steps: int = 100) -> Floats:
    """Newton passes on F(r, W r + load) = 0 from an interior-point answer; the iterate of smallest |F| is kept.

    Plain Newton comes first, which works for a regular W of any condition; then proximal Newton, with a first weight of
    the size of |F|, because W may be singular and the active sets are only approximately known.
    """
    posed = replace(problem, q=load)
    best, lowest = r, merit(posed, law, r, posed.velocity(r))
    best, lowest = _refined(Newton(law), posed, law, (best, lowest), steps)
    return _refined(ProximalPoint(law, weight=max(lowest, _LIGHTEST)), posed, law, (best, lowest), steps)[0]


def _refined(
    solver: Solver[Any], posed: ScaledProblem, law: ContactFunction, start: tuple[Floats, float], steps: int
) -> tuple[Floats, float]:
    """The iterate of smallest |F| among ``start`` and ``steps`` passes of a solver, with its |F|."""
    best, lowest = start
    state = solver.init(posed, best)
    for _ in range(steps):
        if lowest <= _EXACT or state.stalled:
            break
        try:
            state = solver.step(posed, state)
        except (ProgramError, np.linalg.LinAlgError):
            break
        reached = merit(posed, law, state.r, posed.velocity(state.r))
        if reached < lowest:
            best, lowest = state.r, reached
    return best, lowest


def force_program(problem: ScaledProblem, top: Floats, settings: ConicSettings) -> ForceProgram:
    """Set the program up: P and the cones. r_n >= 0 is a row of its own wherever the cone does not imply it."""
    diagonal = np.ones((problem.mu.size, problem.dim))
    P = sparse.csc_matrix(problem.symmetric_part() + settings.regularisation * sparse.eye_array(problem.size))
    bare = sparse.csr_matrix(sparse.eye_array(problem.size))[problem.dim * np.flatnonzero(top == 0)]
    # the zeros of diag(top, 1 … 1) are not stored, harmlessly: those rows hold the radius alone
    diagonal[:, 0] = top
    cones = sparse.csr_matrix(sparse.diags_array(diagonal.ravel()))
    rows = (
        Rows("normal", Cone.NONNEGATIVE, bare, np.zeros(len(bare.indptr) - 1)),
        Rows("cone", Cone.SECOND_ORDER, cones, np.zeros(problem.size), problem.dim),
    )
    conic = ConicProgram(P, problem.q, rows, {"r": slice(0, problem.size)})
    return ForceProgram(problem, settings, Clarabel(seconds=settings.seconds), conic)


@dataclass(frozen=True, eq=False)
class AssociatedSolution:
    """Minimiser r (dc,) of the relaxation. Not a :class:`CoulombSolution`: it solves another law."""

    problem: CoulombProblem
    r: Floats

    @property
    def u(self) -> Floats:
        """W r + q, (dc,)."""
        return self.problem.velocity(self.r)

    def residual(self) -> float:
        """The relaxation's own optimality: max(|r' - P_K(r' - u')|, ε | |W'| |r'| |) / |q'|, ε = 2.2e-16.

        Units are those of contacts (:mod:`bipot.coulomb.solution`), and the scale is the load: forces diverge where
        the program is unbounded, and would hide any error. The second part is what round-off of W r leaves unknown.
        """
        scaled = scale(self.problem)
        r = self.r / scaled.force
        lost = np.finfo(np.float64).eps * float(np.linalg.norm(abs(scaled.W) @ np.abs(r)))
        return max(merit(scaled, ConeMap(), r, scaled.velocity(r)), lost)

    def dilatancy(self) -> float:
        """Opening by sliding, the sum of u_n over contacts that carry force, length units; 0 under Coulomb's law."""
        r, u = self.problem.by_contact(self.r), self.problem.by_contact(self.u)
        return float(np.sum(np.where(r[:, 0] > 1e-9 * np.abs(r).max(initial=0.0), u[:, 0], 0.0)))


def solve_associated(problem: CoulombProblem, settings: ConicSettings | None = None) -> AssociatedSolution:
    """Solve the relaxation by one conic program and its polish.

    Where round-off or a nearly singular W leave more than ``settings.tol``, the answer's residual says so.

    Raises SceneError for an unsymmetric W or an indefinite one, InfeasibleProgram where the program is unbounded.
    """
    require_type(problem, CoulombProblem, "problem")
    require_type(settings, ConicSettings, "settings", optional=True)
    asymmetry, settings = problem.asymmetry, settings or ConicSettings()
    require(asymmetry <= ROUGHLY, "asymmetry of W", asymmetry, f"<= {ROUGHLY}: the relaxation is an energy")
    require(problem.semidefinite, "W", "indefinite", "positive semidefinite: the relaxation is a convex energy")
    scaled = scale(problem)
    found = force_program(scaled, scaled.mu, settings).solve(scaled.q, np.zeros_like(scaled.mu))
    near = polished_force(scaled, ConeMap(), found, scaled.q)
    answer = AssociatedSolution(problem, scaled.unscale(near))
    # The regularisation bounds every program; without it the forces found may be a ray along which it falls for ever.
    bare = force_program(scaled, scaled.mu, replace(settings, regularisation=0.0)).conic
    if answer.residual() > settings.tol and any(unbounded(bare, ray, BALANCED) for ray in (found, near)):
        raise InfeasibleProgram(UNBOUNDED)
    return answer
