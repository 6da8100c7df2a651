"""The two convex programs as cvxpy statements: the readable twins of :mod:`bipot.coulomb.conic`."""

from __future__ import annotations

from typing import NamedTuple

import cvxpy as cp
import numpy as np

from bipot.coulomb.problem import CoulombProblem
from bipot.laws.tensors import FloatArray


class Statement(NamedTuple):
    """A cvxpy problem and its variable, the forces (c, d)."""

    program: cp.Problem
    forces: cp.Variable


def _energy(problem: CoulombProblem, r: cp.Variable, shift: FloatArray) -> cp.Expression:
    """½ r · W r + (q + shift n) · r with the symmetric part of W."""
    W = cp.psd_wrap(problem.symmetric_part().toarray())
    flat = cp.reshape(r, (problem.size,), order="C")
    return 0.5 * cp.quad_form(flat, W) + problem.q @ flat + shift @ r[:, 0]


def tresca_statement(problem: CoulombProblem, threshold: FloatArray) -> Statement:
    """Program min ½ r·W r + q·r  subject to  r_n >= 0, |r_t| <= threshold (c,)."""
    r = cp.Variable((problem.contacts, problem.dim))
    discs = [cp.norm(r[:, 1:], axis=1) <= threshold, r[:, 0] >= 0]
    return Statement(cp.Problem(cp.Minimize(_energy(problem, r, np.zeros(problem.contacts))), discs), r)


def de_saxce_statement(problem: CoulombProblem, shift: FloatArray) -> Statement:
    """Program min ½ r·W r + (q + shift n)·r  subject to  |r_t| <= mu r_n; shift = mu |u_t| (c,) at Coulomb's
    fixed point.

    shift = 0 is the associated relaxation.
    """
    r = cp.Variable((problem.contacts, problem.dim))
    cone = [cp.norm(r[:, 1:], axis=1) <= cp.multiply(problem.mu, r[:, 0]), r[:, 0] >= 0]
    return Statement(cp.Problem(cp.Minimize(_energy(problem, r, shift)), cone), r)
