"""The interface of a solver, and the loop that runs all of them.

A solver is a small frozen object: ``init`` makes a state from a starting force, ``step`` makes the next one.
The loop measures every iterate against the law, keeps the best, and stops on the tolerance, on time, on the
number of steps, or when the state says it cannot go on. No solver decides for itself that it has converged.

Solvers see problems of order one: each contact in units of its own, then all loads in the length of the load.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from scipy import sparse

from bipot.basics.definite import by_units
from bipot.coulomb.problem import LARGEST, Affine, CoulombProblem, column_count
from bipot.coulomb.solution import CoulombSolution, Judgement, Outcome, judge, known_force
from bipot.errors import ProgramError, require, require_count, require_type
from bipot.typing import Floats, make_floats, max_abs

# Above this many rows and below this part of entries that are stored a sparse factorisation beats a dense one.
DENSE_ROWS = 300
DENSE_FILLING = 0.2


def blocks(W: sparse.csr_array, dim: int) -> sparse.bsr_array:
    """W (dc, dc) in blocks of contacts; every diagonal block is there, zero or not."""
    entries, each = sparse.coo_array(W), np.arange(column_count(W))
    places = tuple(np.concatenate([along, each]) for along in entries.coords)
    with_diagonal = sparse.coo_array((np.append(entries.data, np.zeros(each.size)), places), shape=W.shape)
    out = sparse.bsr_array(sparse.csr_array(with_diagonal), blocksize=(dim, dim))
    out.sort_indices()
    return out


@dataclass(frozen=True, eq=False)
class ScaledProblem(Affine):
    """Scaled problem u' = W' r' + q' with r = force r', u = length u' row by row: |q'| = 1, each contact's mean
    diagonal of W' is 1.

    With w the mean diagonal of a contact's block (its unit squared), force = β/√w and length = β √w,
    β = |q/√w|. Each is the same for all rows of a contact and K_mu is a cone, so the law does not change.
    ``W`` is dense where dense algebra is faster; ``blocks`` are those of a sparse W, None for a dense one.
    """

    W: Floats | sparse.csr_array
    q: Floats
    mu: Floats
    dim: int
    force: Floats
    length: Floats
    blocks: sparse.bsr_array | None

    def unscale(self, r: Floats) -> Floats:
        """Force in the units of the problem it came from."""
        return self.force * r


def scale(problem: CoulombProblem) -> ScaledProblem:
    """The problem in its own units; |q| counts as 1 where q = 0."""
    unit = np.repeat(problem.contact_unit, problem.dim)
    q = problem.q / unit
    size = float(np.linalg.norm(q)) or 1.0
    W = by_units(problem.W, unit)
    if problem.size <= DENSE_ROWS or W.nnz > DENSE_FILLING * problem.size**2:
        stored, by_contacts = W.toarray(), None
    else:
        stored, by_contacts = W, blocks(W, problem.dim)
    return ScaledProblem(stored, q / size, problem.mu, problem.dim, size / unit, size * unit, by_contacts)


class SolverState:
    """One iterate: the scaled force r (dc,), and why no further step is useful (None while one is)."""

    r: Floats
    stalled: str | None = None


S = TypeVar("S", bound=SolverState)


@runtime_checkable
class Solver(Protocol[S]):
    """init and step; ``name`` labels results."""

    @property
    def name(self) -> str:
        """Label in results."""
        ...

    def init(self, problem: ScaledProblem, r: Floats) -> S:
        """State at the scaled force r (dc,)."""
        ...

    def step(self, problem: ScaledProblem, state: S) -> S:
        """The next state: one factorisation, one program, or a few sweeps; short, for time limits to hold."""
        ...


@dataclass(frozen=True)
class Limits:
    """When to stop: residual ``tol`` (:func:`bipot.coulomb.solution.residual`), steps, wall-clock seconds.

    A run also stops where ``patience`` steps have not brought the smallest residual down by a hundredth. No clock
    decides unless ``seconds`` are given: the same problem then has the same answer on a machine of any speed.
    """

    tol: float = 1e-10
    iterations: int = 100_000
    seconds: float = math.inf
    patience: int = 1000

    def __post_init__(self) -> None:
        make_floats(self, tol="> 0", seconds="> 0")
        require_count(self.iterations, "iterations", 0)
        require_count(self.patience, "patience")


_ADVICE = {
    Outcome.ITERATION_LIMIT: "more steps, or another solver, may help",
    Outcome.TIME_LIMIT: "more time, or another solver, may help",
    Outcome.STALLED: "solve() chains other solvers after it",
    Outcome.FAILED: "solve() chains other solvers after it",
}


def _sentence(name: str, outcome: Outcome, found: Judgement, tol: float, detail: str) -> str:
    error = found.residual
    if outcome is Outcome.CONVERGED:
        return f"{name} reached residual {error:.1e} <= {tol:.1e}."
    because = f": {detail}" if detail else ""
    if found.resolution > tol:
        because += f", its forces so large that round-off of W r alone is {found.resolution:.1e} of the load"
    return f"{name} stopped at residual {error:.1e} > {tol:.1e} ({outcome.value}){because}; {_ADVICE[outcome]}."


def run(
    solver: Solver[S],
    problem: CoulombProblem,
    limits: Limits | None = None,
    start: Floats | None = None,
    clock: Callable[[], float] = perf_counter,
) -> CoulombSolution:
    """Run one solver from ``start`` (dc,) (zero by default) and return its best iterate, measured.

    The iterate with the smallest residual is returned, converged or not; a step that raises ProgramError or
    LinAlgError ends the run with outcome FAILED and its message.
    """
    require_type(solver, Solver, "solver")
    require_type(problem, CoulombProblem, "problem")
    require_type(limits, Limits, "limits", optional=True)
    began, limits = clock(), limits or Limits()
    scaled = scale(problem)
    given = np.zeros(problem.size) if start is None else known_force(problem, start, "start")
    begun = given / scaled.force
    largest = max_abs(begun)
    require(largest <= LARGEST, "start", f"numbers up to {largest:.3g} of the load", f"at most {LARGEST:g}")
    watched = _Watched(problem, scaled, limits, begun)
    if watched.converged:
        outcome, detail = Outcome.CONVERGED, ""
    else:
        outcome, detail = _stepped(solver, watched, lambda: clock() - began > limits.seconds)
    reason = _sentence(solver.name, outcome, watched.found, limits.tol, detail)
    r = scaled.unscale(watched.best)
    return CoulombSolution(problem, r, outcome, solver.name, reason, watched.steps, clock() - began)


class _Watched:
    """The ``steps`` of a run so far, its ``best`` iterate as a scaled force (dc,), and what was ``found`` of that."""

    def __init__(self, problem: CoulombProblem, scaled: ScaledProblem, limits: Limits, r: Floats) -> None:
        self.problem, self.scaled, self.limits = problem, scaled, limits
        self.best, self.found, self.steps = r, judge(problem, scaled.unscale(r)), 0
        self._progress, self._since = self.found.residual, 0

    @property
    def converged(self) -> bool:
        return self.found.residual <= self.limits.tol

    def ends_at(self, state: SolverState) -> tuple[Outcome, str] | None:
        """Count a step to ``state``: the outcome and its detail if the run ends there, else None."""
        self.steps += 1
        if np.all(np.isfinite(state.r)):
            # Forces that run away may overflow in the problem's units: they are judged as far from the law.
            with np.errstate(over="ignore"):
                reached = judge(self.problem, self.scaled.unscale(state.r))
            if reached.residual < self.found.residual:
                self.best, self.found = state.r, reached
        if self.converged:
            return Outcome.CONVERGED, ""
        if self.found.residual < 0.99 * self._progress:
            self._progress, self._since = self.found.residual, self.steps
        if self.steps - self._since >= self.limits.patience:
            return Outcome.STALLED, f"no progress in {self.limits.patience} steps"
        return None if state.stalled is None else (Outcome.STALLED, state.stalled)


def _stepped(solver: Solver[S], watched: _Watched, is_late: Callable[[], bool]) -> tuple[Outcome, str]:
    """Take steps from the best iterate so far until the run ends: its outcome and detail."""
    state = solver.init(watched.scaled, watched.best)
    while watched.steps < watched.limits.iterations:
        if is_late():
            return Outcome.TIME_LIMIT, ""
        try:
            # a step far outside overflows harmlessly: its merit is inf and it is not taken
            with np.errstate(over="ignore", invalid="ignore"):
                state = solver.step(watched.scaled, state)
        except (ProgramError, np.linalg.LinAlgError) as failure:
            return Outcome.FAILED, str(failure).rstrip(".")
        if (ended := watched.ends_at(state)) is not None:
            return ended
    return Outcome.ITERATION_LIMIT, ""
