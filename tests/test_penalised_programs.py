"""Penalised programs for other solvers: their minimum is that of the march by the penalty, whatever its size."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import Claim
from bipot.conic.solver import Accuracy
from bipot.control.control import Control
from bipot.exchange import conic_program
from bipot.forms import Penalty, Tangent, Uzawa
from bipot.laws.hardening import Linear
from bipot.marching import march
from bipot.paper import upsetting
from bipot.programs.data import Term
from bipot.programs.penalty_newton import newton
from bipot.schedule import Schedule
from tests.scenes import run

TIGHT, TIGHTEST = Accuracy(1e-11), Accuracy(1e-12)


def test_the_minimiser_of_a_penalised_program_is_the_displacement_of_a_march_by_the_penalty():
    """Of a march by the exact law the penalty's is off by what the penalty is; that of `uzawa` is not."""
    cylinder, schedule = upsetting(mu=0.3, reduction=0.02, elements=2, hardening=Linear(300.0, 3000.0)), Schedule(1)
    penalty, uzawa = Penalty(1e6, 1e6), Uzawa(1e8, 1e8)
    off = {}
    for marched, form in (penalty, penalty), (Tangent(), penalty), (Tangent(), uzawa):
        (accepted,) = march(cylinder, schedule, Control(marched, fallbacks=()))
        answer, _ = Clarabel().solve(conic_program(accepted, form).conic(), TIGHT)
        x = accepted.solved.iterate.x
        off[marched, form] = np.abs(answer.block("dU") * accepted.units.length - x).max() / np.abs(x).max()
    assert max(off[penalty, penalty], off[Tangent(), uzawa]) < 1e-5
    assert off[Tangent(), penalty] > 1e-3


@pytest.mark.parametrize("form", [Penalty(1e6, 1e6), Uzawa(1e8, 1e8)])
def test_the_standard_form_of_a_penalised_increment_has_the_minimum_of_its_envelopes(form):
    """(29) with its fictitious increments against Psi, where these are eliminated by hand.

    A fictitious increment s that should be none leaves the force z >= K s off by K s. The solver is asked for s z below
    its tolerance times the cost, so that K s is below K s z / z and below the root of K s z: most is left where a
    contact hardly pushes, at the axis.
    """
    program = conic_program(run(0.3)[5], form)
    answer, _ = Clarabel().solve(program.conic(), TIGHTEST)
    x, cost = answer.block("dU"), answer.program.cost(answer.x)
    assert program.value(x) == pytest.approx(cost + program.statement().constant(), rel=1e-10)
    r, pushed = program.contact.forces(x), answer.dual["fictitious"].ravel()
    most = program.contact.k_n.max() * TIGHTEST.tolerance * abs(cost)
    allowed = np.minimum(most / pushed, np.sqrt(most))
    assert (np.abs(pushed - r[:, 0]) < allowed + 1e-10 * np.abs(r).max()).all()
    assert np.abs(program.gradient(x)).max() < allowed.max() + 1e-10 * program.largest(x)


@pytest.mark.parametrize("penalty", [1.0, 1e4, 1e8, 1e12, 1e16])
def test_no_penalty_hides_that_an_answer_is_wrong(penalty):
    """Up to 1e10 times the stiffness, and a millionth of it: an answer of twenty times the cost was SOLVED.

    Forces out of balance where there is no contact were measured by those of contacts over the root of a low penalty.
    """
    program = conic_program(run(0.3)[5], Uzawa(penalty, penalty))
    answer, _ = Clarabel().solve(program.conic(), TIGHT)
    least = program.value(newton(program, np.zeros(len(program.f))).x)
    assert answer.outcome is Claim.SOLVED
    assert answer.program.cost(answer.x) == pytest.approx(least, rel=1e-8)
    assert answer.error() < 1e-9
    forces = {**answer.dual, Term.LAG: 1.01 * answer.dual[Term.LAG]}
    assert replace(answer, dual=forces).error() > 1e-4
    assert replace(answer, x=1.01 * answer.x).error() > 1e-4
    rows, moved = program.contact.rows, answer.x.copy()
    inside = np.diff(sp.csc_matrix(sp.vstack([rows.G_n, rows.G_t])).indptr) == 0
    moved[: len(inside)] *= np.where(inside, 1.01, 1.0)
    assert replace(answer, x=moved).error() > 0.1


def test_the_statement_of_a_sparse_penalised_program_stays_sparse():
    """Its squares are those of a root of K, which has as few entries as K's factors; cvxpy is asked what it poses."""
    program = conic_program(run(0.3)[5], Penalty(1e6, 1e6))
    data, *_ = program.statement().problem.get_problem_data("CLARABEL")
    unknowns = len(program.f)
    assert data["A"].nnz + data["P"].nnz < unknowns**2 / 3


def test_a_singular_penalised_program_is_stated_too():
    """Bars that nothing holds along their axes but the penalty: no pivots, so the root is by eigenvalues."""
    program = conic_program(run(0.3)[5], Penalty(1e6, 1e6))
    bars = sp.kron(sp.eye_array(len(program.f) // 2), [[1.0, -1.0], [-1.0, 1.0]], format="csc")
    free = replace(program, K=sp.csc_matrix(bars), f=bars @ program.f)
    answer, _ = Clarabel().solve(free.conic(), TIGHT)
    stated = free.statement()
    stated.problem.solve(solver="CLARABEL")
    assert stated.value - stated.constant() == pytest.approx(answer.program.cost(answer.x), rel=1e-6)
