r"""The penalised program as (29) states it, with the fictitious increments as variables, in cvxpy.

    minimise  1/2 |L dU|^2 - f . dU + sum_c [ t_n0 (v_n - du_n) + K_n/2 (du_n - v_n)^2 ]
                                    + sum_c [ t_t0 . (v_t - du_t) + s |v_t| + K_t/2 |du_t - v_t|^2 ]
    subject to  v_n >= -max(g0, 0)

on the condensed unknowns, L' L being their stiffness. Squares stand as sums of squares of what is scaled by L and
sqrt(K_c): interior points take those three digits further than the same as quadratic forms. The terms in -t_0 . du
are those of (17), see :mod:`bipot.laws.penalised`.
"""

from __future__ import annotations

import time

import cvxpy as cp
import numpy as np
from numpy.typing import NDArray

from bipot.programs.clarabel import Accuracy
from bipot.programs.conic import _square_root
from bipot.programs.data import Timing
from bipot.programs.penalty import Minimum, PenaltyProgram
from bipot.programs.statement import ContactStatement, Stated, solve_stated
from bipot.programs.terms import ContactTerms

Floats = NDArray[np.float64]


def fictitious(program: PenaltyProgram, accuracy: Accuracy) -> Minimum:
    """Minimise through cvxpy and Clarabel. Raises ProgramError and its kin."""
    began = time.perf_counter()
    small, condensed = program.condensed()
    stated = statement(small)
    built = Timing(build=time.perf_counter() - began)
    outcome, iterations, timing = solve_stated(stated, accuracy)
    return Minimum(condensed.recover(np.asarray(stated.dU.value)), outcome, iterations, built + timing)


def statement(program: PenaltyProgram) -> Stated:
    """(29) as one writes it; the dual of its constraint is t_n."""
    terms = program.contact
    rows, f = terms.rows, terms.rows.frictional
    dU, v_n, v_t = cp.Variable(len(program.f)), cp.Variable(rows.count), cp.Variable(rows.slip.shape)
    lag_n = rows.G_n @ dU + (rows.gap - terms.start_gap) - v_n
    lag_t = cp.reshape(rows.G_t @ dU, rows.slip.shape, order="C") + rows.slip - v_t
    cost = (
        -terms.t_0[:, 0] @ lag_n
        + cp.sum_squares(np.sqrt(terms.k_n / 2) * lag_n)
        - cp.sum(cp.multiply(terms.t_0[f, 1:], lag_t))
        + terms.threshold @ cp.norm(v_t, 2, axis=1)
        + cp.sum_squares(np.sqrt(terms.k_t / 2) * lag_t)
    )
    contact = ContactStatement(
        ContactTerms(rows, terms.threshold), cost, v_n >= -np.maximum(terms.start_gap, 0.0), None, None
    )
    energy = cp.sum_squares(_square_root(np.asarray(program.K)) @ dU) / 2 - program.f @ dU
    return Stated(cp.Problem(cp.Minimize(energy + cost), contact.constraints), dU, contact)
