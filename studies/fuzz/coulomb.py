r"""Random discrete Coulomb problems for the fuzz study, judged by a recomputed law and an enumeration of modes.

A problem u = W r + q is small but awkward: integer or float entries, rank deficient or unsymmetric W, contacts scaled
by up to a million each way, coefficients from 0 to 1e6. An answer reported CONVERGED is measured with every contact in
the unit of its own block's size d_c (u/d_c, r d_c): velocities over max(|q|, |u|), never over r.

In the plane the modes of a contact (open, stick, slip either way) are polyhedra. A linear program per combination
finds the least violation t of the velocity conditions by forces that obey the rest exactly: a solution exists where
some t is zero, none where every t is not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import linprog

from bipot import coulomb
from bipot.errors import BipotError, InfeasibleProgram
from bipot.typing import Floats
from studies.fuzz.row import Outcome, Row, ended

TOLERANCE = 1e-10
LAW = 10 * TOLERANCE
"""Ten times the tolerance the solver is asked for."""

POSSIBLE, IMPOSSIBLE = 1e-9, 1e-6
"""Least violation over |q| below which the enumeration says that a solution exists, above which that none does."""

MOST_CONTACTS = 3
"""Of a plane problem for its modes to be enumerated."""

SOLVERS: dict[str, coulomb.Solver[Any] | None] = {
    "auto": None,
    "proximal": coulomb.ProximalPoint(),
    "newton": coulomb.Newton(),
    "gauss-seidel": coulomb.GaussSeidel(),
    "tresca": coulomb.TrescaFixedPoint(),
    "de-saxce": coulomb.DeSaxceFixedPoint(),
    "uzawa": coulomb.Uzawa(),
}
SHARES = (0.7, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05)


@dataclass(frozen=True)
class Posed:
    """u = W r + q, coefficient mu (c,), in ``dim`` dimensions, and the solver that is asked."""

    W: Floats
    q: Floats
    mu: Floats
    dim: int
    solver: str


def draw(seed: int) -> Posed:
    """The problem of ``seed``; always the same."""
    rng = np.random.default_rng([seed, 1])
    dim = 2 if rng.random() < 0.65 else 3
    c = int(rng.integers(1, 4) if dim == 2 else rng.integers(1, 7))
    size, whole = dim * c, rng.random() < 0.5

    def entries(*shape: int) -> Floats:
        return rng.integers(-3, 4, shape).astype(np.float64) if whole else rng.normal(size=shape)

    rank = int(rng.integers(1, size + 1)) if rng.random() < 0.5 else size
    H = entries(size, rank)
    W, q = H @ H.T, entries(size)
    if rng.random() < 0.2:
        # Not symmetric, as a Newton step in large deformation makes it.
        W = W + 0.3 * entries(size, size) if not whole else W + entries(size, size)
    if rng.random() < 0.3:
        # The load of a motion: inside the range of W, so that sticking everywhere is possible.
        q = W @ entries(size)
    if rng.random() < 0.25:
        d = np.repeat(10.0 ** rng.uniform(-6, 6, c), dim)
        W, q = W * np.outer(d, d), q * d
    kinds = [0.0, rng.uniform(0.05, 1), 2.0, 10.0 ** rng.uniform(-3, 6)]
    mu = np.array([kinds[k] for k in rng.choice(4, size=c, p=[0.15, 0.4, 0.25, 0.2])])
    return Posed(W, q, mu, dim, str(rng.choice(list(SOLVERS), p=SHARES)))


def units(W: Floats, dim: int) -> Floats:
    """d_c (c,), the root of the mean diagonal of each contact's block; 1 where that is not positive."""
    mean = np.diag(W).reshape(-1, dim).mean(axis=1)
    return np.sqrt(np.where(mean > 0, mean, 1.0))


def scaled(posed: Posed) -> Posed:
    """The problem with each contact in its own unit: the law is isotropic and does not change."""
    d = np.repeat(units(posed.W, posed.dim), posed.dim)
    return replace(posed, W=posed.W / np.outer(d, d), q=posed.q / d)


def law_error(posed: Posed, r: Floats) -> float:
    """How far r is from the law in the contacts' own units, over max(|q|, |u|), what round-off can make taken off.

    The largest over the contacts of the distance to the nearest of the law's cases, a force counting as a velocity:

        open   max(|r|, (-u_n)+),    stick   max(|u|, cone violation),
        slip   max(|u_n|, |u_t - s e|, |r - f (1, -mu e)|),  s, f >= 0.

    No coefficient multiplies a velocity: the natural map would call a stick wrong by mu times what it still slips.
    """
    own, eps = scaled(posed), float(np.finfo(np.float64).eps)
    f = r * np.repeat(units(posed.W, posed.dim), posed.dim)
    u = own.W @ f + own.q
    blur = 16 * eps * (np.abs(own.W) @ np.abs(f) + np.abs(own.q)).reshape(-1, posed.dim).sum(axis=1)
    scale = max(float(np.linalg.norm(own.q)), float(np.linalg.norm(u)))
    f, u = f.reshape(-1, posed.dim), u.reshape(-1, posed.dim)
    size = np.linalg.norm(f, axis=1)
    outside = np.maximum(np.linalg.norm(f[:, 1:], axis=1) - posed.mu * f[:, 0], -f[:, 0])
    unsure = 16 * eps * size
    # Exact slip along e has r on the ray (1, -mu e) and u_t along e: the direction of the slip and that against the
    # friction are tried, so that a slip too small to tell its direction does not multiply its error by the force.
    slips = np.min([_off_slip(f, u, posed.mu, t, unsure, blur) for t in (u[:, 1:], -f[:, 1:])], axis=0)
    cases = [
        np.maximum(size, -u[:, 0] - blur),
        np.maximum(np.linalg.norm(u, axis=1) - blur, outside - unsure),
        slips,
    ]
    worst = max(float(np.min(cases, axis=0).max()), 0.0)
    return worst / scale if scale > 0 else worst


def _off_slip(f: Floats, u: Floats, mu: Floats, t: Floats, unsure: Floats, blur: Floats) -> Floats:
    """How far (c,) forces and velocities (c, d) are from exact slip along t (c, d - 1)."""
    length = np.linalg.norm(t, axis=1)[:, None]
    e = np.divide(t, length, out=np.eye(1, t.shape[1]).repeat(len(t), axis=0), where=length > 0)
    ray = np.column_stack([np.ones(len(mu)), -mu[:, None] * e]) / np.sqrt(1 + mu**2)[:, None]
    force = f - np.maximum(np.vecdot(f, ray), 0.0)[:, None] * ray
    slip = u[:, 1:] - np.maximum(np.vecdot(u[:, 1:], e), 0.0)[:, None] * e
    parts = [np.abs(u[:, 0]) - blur, np.linalg.norm(slip, axis=1) - blur, np.linalg.norm(force, axis=1) - unsure]
    return np.stack(parts).max(axis=0)


def least_violation(posed: Posed) -> float:
    """Least violation over |q| of the velocity conditions among all modes of a plane problem; 0 where one is solved."""
    own = scaled(posed)
    size = float(np.abs(own.q).max()) or 1.0
    least = np.inf
    for modes in product(("open", "stick", "slip+", "slip-"), repeat=len(own.mu)):
        least = min(least, _mode_violation(own.W, own.q / size, own.mu, modes))
        if least <= POSSIBLE:
            break
    return least


def _mode_violation(W: Floats, q: Floats, mu: Floats, modes: tuple[str, ...]) -> float:
    """min t: forces in the mode's part of the cone, |u_i| <= t where u_i must vanish, u_i >= -t where it has a sign.

    Unknowns (a, b, t): forces with sides, a >= 0 being r_n (sliding), or the two edges of the cone (sticking).
    """
    columns, vanish, signed = [], [], []
    for k, (mode, m) in enumerate(zip(modes, mu, strict=True)):
        n, t = 2 * k, 2 * k + 1
        edges = {"open": [], "stick": [m, -m] if m > 0 else [0.0], "slip+": [-m], "slip-": [m]}[mode]
        columns += [W[:, n] + way * W[:, t] for way in edges]
        (signed if mode == "open" else vanish).append((n, 1.0))
        if mode == "stick":
            vanish.append((t, 1.0))
        elif mode != "open":
            signed.append((t, 1.0 if mode == "slip+" else -1.0))
    A = np.column_stack(columns) if columns else np.zeros((len(q), 0))
    # Forces along an edge have no unit: unit columns keep large coefficients from drowning the others.
    A = A / np.maximum(np.linalg.norm(A, axis=0), np.finfo(float).tiny)
    below = [(-s * A[i], s * q[i]) for i, s in [*vanish, *signed]] + [(A[i], -q[i]) for i, _ in vanish]
    rows = np.array([np.append(row, -1.0) for row, _ in below])
    answer = linprog(
        np.append(np.zeros(A.shape[1]), 1.0),
        A_ub=rows,
        b_ub=np.array([bound for _, bound in below]),
        bounds=(0, None),
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    return float(answer.x[-1]) if answer.status == 0 else np.inf


def judge_coulomb(seed: int) -> Row:
    """The row of a seed's problem."""
    return ended(_known(seed))


def _known(seed: int) -> Iterator[Row]:
    yield (row := Row(seed, "coulomb", "", Outcome.RAW, "", 0, 0.0, 0.0, 0.0, 0.0))
    posed = draw(seed)
    yield (row := replace(row, kind=f"coulomb {posed.dim}D {len(posed.mu)}", form=posed.solver))
    yield _judged(row, posed)


def _judged(row: Row, posed: Posed) -> Row:
    problem = coulomb.CoulombProblem(W=posed.W, q=posed.q, mu=posed.mu, dim=posed.dim)  # type: ignore[arg-type]
    limits = coulomb.Limits(tol=TOLERANCE, iterations=2000, seconds=1.0)
    solver = SOLVERS[posed.solver]
    try:
        answer = coulomb.solve(problem, limits) if solver is None else coulomb.run(solver, problem, limits)
    except InfeasibleProgram as none:
        least = _oracle(posed)
        wrong = least is not None and least <= POSSIBLE
        outcome = Outcome.WRONG if wrong else Outcome.REFUSED
        return replace(row, outcome=outcome, reason=f"{'solvable, yet ' if wrong else ''}{none}")
    except BipotError as error:
        return replace(row, outcome=Outcome.REFUSED, reason=f"{type(error).__name__}: {error}")
    row = replace(row, increments=1, worst_residual=answer.residual(), worst_law=law_error(posed, answer.r))
    if not answer.converged:
        return replace(row, outcome=Outcome.REFUSED, increments=0, reason=answer.reason)
    if not row.worst_law <= LAW:
        return replace(row, outcome=Outcome.WRONG, reason=f"converged with law {row.worst_law:.1e}{_said(posed)}")
    least = _oracle(posed)
    if least is not None and least > IMPOSSIBLE:
        return replace(row, outcome=Outcome.WRONG, reason=f"converged where every mode is off by {least:.1e}")
    return replace(row, outcome=Outcome.CERTIFIED)


def _oracle(posed: Posed) -> float | None:
    """The least violation where the modes can be enumerated, else None."""
    return least_violation(posed) if posed.dim == 2 and len(posed.mu) <= MOST_CONTACTS else None


def _said(posed: Posed) -> str:
    least = _oracle(posed)
    return "" if least is None else f"; least violation of all modes {least:.1e}"
