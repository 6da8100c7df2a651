"""Whether a problem has more than one solution: by several starts, or by every mode of a small plane problem.

A mode is open, stick or slip either way at each contact, 4^c systems in all. In it the law is linear, E r = e and G r
<= g, a polyhedron of forces. Where E is regular it is one point or empty. Where E is singular, a linear program says
whether it is empty, and two more give the range of each velocity that E leaves free. An endless range, possible only
if W is not that of an energy, is cut off at the length of the load. All numbers are those of the scaled problem; a
point counts if it passes the residual.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy import linalg, sparse

from bipot.coulomb.problem import CoulombProblem
from bipot.coulomb.proximal import ProximalPoint
from bipot.coulomb.solution import CoulombSolution, Outcome, judge
from bipot.coulomb.solver import Limits, run, scale
from bipot.errors import require, require_count, require_positive, require_type
from bipot.laws.coulomb import Status
from bipot.laws.projections import project_cone
from bipot.typing import Floats, max_abs, require_within

MOST_CONTACTS = 6
_CHOICES = ((Status.OPEN, 0), (Status.STICK, 0), (Status.SLIP, 1), (Status.SLIP, -1))
_RANK = 1e-12
# What a linear program leaves open of its rows, and what a row may miss of 0 to count as active.
_FEASIBLE, _ACTIVE = 1e-10, 1e-8
# Residual, or multiple of what round-off leaves of it, from which on a force is certainly none of the mode.
_CERTAIN, _BLURRED = 1e-7, 1e3
# How far beyond a point an endless range of velocities is cut off; the load is of length one.
_BEYOND = 1.0
# What linprog returns where there is no least cost: found unbounded, or unbounded or infeasible without telling which.
_ENDLESS = (3, 4)

Mode = tuple[tuple[Status, int], ...]


class Polyhedron(NamedTuple):
    """E r = e, G r <= g; E (2c, 2c), G (k, 2c)."""

    E: Floats
    e: Floats
    G: Floats
    g: Floats


@dataclass(frozen=True, eq=False)
class MultiplicityReport:
    """Solutions with different velocities u. ``exhaustive`` says whether every mode was tried, ``continuum``
    whether some mode holds a whole range of velocities. Its ends are then among the solutions, and in the place of an
    end that is missing a velocity farther along it. ``doubtful`` says whether a force that is none of the solutions may
    be one: it is as near to a mode as round-off tells, or as 1e-7 of the load, though not as near as was asked.

    Forces may differ at the same u where W is singular: that is hyperstatic, not multiple, and not counted.
    """

    solutions: tuple[CoulombSolution, ...]
    exhaustive: bool
    continuum: bool = False
    doubtful: bool = False

    @property
    def multiple(self) -> bool:
        """Whether two different answers to the same problem were found."""
        return len(self.solutions) > 1

    @property
    def reason(self) -> str:
        """One sentence."""
        how = "all modes enumerated" if self.exhaustive else "from several starts"
        found = len(self.solutions)
        if not found:
            doubt = ", though a force is as near to one as can be told" if self.doubtful else ""
            return f"No solution found ({how}){doubt}."
        word = "solution" if found == 1 else "solutions with different velocities"
        between = ", with others all the way between some of them" if self.continuum else ""
        return f"{found} {word} found ({how}){between}; a solver returns one of them, by its start."


def _polyhedron(W: Floats, q: Floats, mu: Floats, mode: Mode) -> Polyhedron:
    """The law of a mode, contact by contact: slip of sign s has r_t = -s mu r_n and s u_t >= 0."""
    rows: list[tuple[Floats, float]] = []
    bounds: list[tuple[Floats, float]] = []
    axes = np.eye(q.size)
    for k, (status, sign) in enumerate(mode):
        n, t = 2 * k, 2 * k + 1
        size = 1.0 + mu[k]
        if status is Status.OPEN:
            rows += [(axes[n], 0.0), (axes[t], 0.0)]
            bounds.append((-W[n], q[n]))
            continue
        rows.append((W[n], -q[n]))
        bounds.append((-axes[n], 0.0))
        if status is Status.STICK:
            rows.append((W[t], -q[t]))
            bounds += [((side * axes[t] - mu[k] * axes[n]) / size, 0.0) for side in (1, -1)]
        else:
            rows.append(((axes[t] + sign * mu[k] * axes[n]) / size, 0.0))
            bounds.append((-sign * W[t], sign * q[t]))
    parts = (*zip(*rows, strict=True), *zip(*bounds, strict=True))
    return Polyhedron(*(np.array(part) for part in parts))


def _vertex(region: Polyhedron, cost: Floats, within: Floats | None = None) -> Floats | None:
    """A force of least cost, sharpened on the rows that are active there; None where there is none.

    Where no cost is the least, the force costs less than the force ``within`` the region, by the length of the load.
    """
    # scipy.optimize takes long to import, and only small problems that a solver failed on come here.
    from scipy.optimize import linprog

    options = {"primal_feasibility_tolerance": _FEASIBLE, "dual_feasibility_tolerance": _FEASIBLE}
    found: Any = linprog(
        cost, region.G, region.g, region.E, region.e, bounds=(None, None), method="highs", options=options
    )
    if found.status in _ENDLESS and within is not None:
        cut = region._replace(G=np.vstack([region.G, -cost]), g=np.r_[region.g, _BEYOND - cost @ within])
        return _vertex(cut, cost)
    if found.status != 0:
        return None
    r = np.asarray(found.x, dtype=np.float64)
    active = np.abs(region.G @ r - region.g) <= _ACTIVE * (1.0 + np.abs(r).max())
    A, b = np.vstack([region.E, region.G[active]]), np.r_[region.e, region.g[active]]
    return r - np.linalg.lstsq(A, A @ r - b, rcond=_RANK)[0]


def _points(W: Floats, region: Polyhedron) -> Iterator[Floats]:
    """The force of a regular mode; of a singular one a force and the ends of each velocity's range."""
    E, e = region.E, region.e
    r, _, rank, _ = np.linalg.lstsq(E, e, rcond=_RANK)
    yield np.asarray(r, dtype=np.float64)
    if rank == e.size:
        return
    first = _vertex(region, np.zeros(e.size))
    if first is None:
        return
    yield first
    free = np.abs(W @ linalg.null_space(E, rcond=_RANK)).max(axis=1, initial=0.0)
    for row in W[free > _ACTIVE]:
        for end in (_vertex(region, row, first), _vertex(region, -row, first)):
            if end is not None:
                yield end


def _distinct(answers: list[CoulombSolution], apart: float) -> tuple[CoulombSolution, ...]:
    """The first answer of each u, velocities in contact units differing by more than ``apart`` relative to |q|."""
    kept: list[CoulombSolution] = []
    for answer in answers:
        rows = np.repeat(answer.problem.contact_unit, answer.problem.dim)
        size = apart * max(float(np.linalg.norm(answer.problem.q / rows)), float(np.finfo(np.float64).tiny))
        if all(float(np.linalg.norm((answer.u - other.u) / rows)) > size for other in kept):
            kept.append(answer)
    return tuple(kept)


def enumerate_modes(problem: CoulombProblem, tol: float = 1e-10, apart: float = 1e-6) -> MultiplicityReport:
    """Every velocity that solves a plane problem, mode by mode (open, stick, slip either way at each contact).

    4^c modes, so c <= 6 and dim = 2, else SceneError. Different means velocities ``apart`` relative to |q|; forces may
    differ at the same velocity where W is singular. Where a mode holds a range of velocities its ends are listed.
    """
    require_type(problem, CoulombProblem, "problem")
    require_positive(tol=tol)
    require_within(apart, "apart", ">= 0")
    require(problem.dim == 2, "dim", problem.dim, "2, where modes are finite in number")
    require(problem.contacts <= MOST_CONTACTS, "contacts", problem.contacts, f"<= {MOST_CONTACTS}")
    scaled, began = scale(problem), perf_counter()
    W = sparse.csr_array(scaled.W).toarray()
    answers: list[CoulombSolution] = []
    continuum = doubtful = False
    for mode in product(_CHOICES, repeat=problem.contacts):
        name = " ".join(status.name.lower() for status, _ in mode)
        held: list[CoulombSolution] = []
        for point in _points(W, _polyhedron(W, scaled.q, problem.mu, mode)):
            r = scaled.unscale(point)
            off = judge(problem, r)
            if off.residual <= tol:
                spent = perf_counter() - began
                held.append(CoulombSolution(problem, r, Outcome.CONVERGED, "modes", f"Mode {name}.", 0, spent))
            elif off.residual <= max(_CERTAIN, _BLURRED * off.resolution):
                doubtful = True
        continuum = continuum or len(_distinct(held, apart)) > 1
        answers += held
    return MultiplicityReport(_distinct(answers, apart), True, continuum, doubtful)


def _starts(problem: CoulombProblem, count: int) -> list[Floats]:
    """No force, full stick, and ``count`` random forces in the cone, of the size that stops u = q."""
    stick = np.linalg.lstsq(problem.W.toarray(), -problem.q, rcond=1e-10)[0]
    size = max_abs(stick) or problem.force_scale
    rng = np.random.default_rng(0)
    random = [rng.normal(size=(problem.contacts, problem.dim)) * size for _ in range(count)]
    guesses = [problem.by_contact(stick), *random]
    return [np.zeros(problem.size), *(project_cone(r, problem.mu).ravel() for r in guesses)]


def multiplicity(
    problem: CoulombProblem, starts: int = 8, limits: Limits | None = None, apart: float = 1e-6
) -> MultiplicityReport:
    """Solutions found from no force, full stick and ``starts`` random forces, or by all modes: of c <= 6 in a plane.

    Two solutions differ where their velocities do, in units of contacts, by more than ``apart`` relative to |q|.
    """
    require_type(problem, CoulombProblem, "problem")
    require_type(limits, Limits, "limits", optional=True)
    require_count(starts, "starts", 0)
    require_within(apart, "apart", ">= 0")
    if problem.dim == 2 and problem.contacts <= MOST_CONTACTS:
        return enumerate_modes(problem, apart=apart)
    answers = [run(ProximalPoint(), problem, limits, start) for start in _starts(problem, starts)]
    return MultiplicityReport(_distinct([a for a in answers if a.converged], apart), exhaustive=False)
