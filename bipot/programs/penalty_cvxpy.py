r"""The penalised program as (29) states it, with the fictitious increments as variables, in cvxpy.

    minimise  1/2 |L dU|^2 - f . dU + sum_c [ t_n0 (v_n - du_n) + K_n/2 (du_n - v_n)^2 ]
                                    + sum_c [ t_t0 . (v_t - du_t) + s |v_t| + K_t/2 |du_t - v_t|^2 ]
    subject to  v_n >= -max(g0, 0)

on the condensed unknowns, L' L being their stiffness. Squares stand as sums of squares of what is scaled by L and
sqrt(K_c): interior points take those three digits further than the same as quadratic forms. In the plane |v_t| is an
absolute value, two linear rows: as cones of two rows, points that stick (apex against interior) made interior points
break down at a tolerance of 1e-12, where the linear rows still answer at 1e-14. The terms in -t_0 . du are those of
(17), see :mod:`bipot.laws.penalised`.
"""

from __future__ import annotations

import time

import cvxpy as cp
import numpy as np

from bipot.conic.problem import Outcome, Timing
from bipot.conic.solver import Accuracy
from bipot.conic.through_cvxpy import Stated, solve_stated
from bipot.errors import ProgramError
from bipot.programs.data import Block, Term
from bipot.programs.penalty import Minimum, PenaltyProgram
from bipot.typing import Floats


def fictitious(program: PenaltyProgram, accuracies: tuple[Accuracy, ...]) -> Minimum:
    """Minimise through cvxpy and Clarabel to the first of ``accuracies`` that is claimed met.

    When none is, the answer of least residual stands, as almost solved. Iterations and seconds are those of all
    attempts. Raises ProgramError and its kin when no attempt gave an answer.
    """
    began = time.perf_counter()
    small, condensed = program.condensed()
    stated = statement(small)
    iterations, timing = 0, Timing(build=time.perf_counter() - began)
    answers: list[Floats] = []
    failure = ProgramError("no accuracy was asked for")
    for accuracy in accuracies:
        try:
            outcome, count, spent = solve_stated(stated, accuracy)
        except ProgramError as failed:
            failure = failed
            continue
        iterations, timing = iterations + count, timing + spent
        answers.append(np.asarray(stated.blocks[Block.DISPLACEMENT].value))
        if outcome is Outcome.SOLVED:
            return Minimum(condensed.recover(answers[-1]), outcome, iterations, timing)
    if not answers:
        raise failure
    best = min(answers, key=lambda u: float(np.abs(small.gradient(u)).max()))
    return Minimum(condensed.recover(best), Outcome.ALMOST, iterations, timing)


def statement(program: PenaltyProgram) -> Stated:
    """(29) as one writes it; the dual of its constraint is t_n."""
    terms = program.contact
    rows, f = terms.rows, terms.rows.frictional
    dU, v_n, v_t = cp.Variable(len(program.f)), cp.Variable(rows.count), cp.Variable(rows.slip.shape)
    lag_n = rows.G_n @ dU + (rows.gap - terms.start_gap) - v_n
    lag_t = cp.reshape(rows.G_t @ dU, rows.slip.shape, order="C") + rows.slip - v_t
    length = cp.abs(v_t[:, 0]) if rows.tangents == 1 else cp.norm(v_t, 2, axis=1)
    cost = (
        -terms.t_0[:, 0] @ lag_n
        + cp.sum_squares(np.sqrt(terms.k_n / 2) * lag_n)
        - cp.sum(cp.multiply(terms.t_0[f, 1:], lag_t))
        + terms.threshold @ length
        + cp.sum_squares(np.sqrt(terms.k_t / 2) * lag_t)
    )
    closed = v_n >= -np.maximum(terms.start_gap, 0.0)
    energy = cp.sum_squares(square_root(np.asarray(program.K)) @ dU) / 2 - program.f @ dU
    problem = cp.Problem(cp.Minimize(energy + cost), [closed])
    return Stated(problem, {Block.DISPLACEMENT: dU}, {Term.FICTITIOUS: closed})


def square_root(K: Floats) -> Floats:
    """L with L' L = K. By eigenvalues: in homogeneous perfect flow K is singular, and Cholesky would refuse it."""
    values, vectors = np.linalg.eigh(K)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
