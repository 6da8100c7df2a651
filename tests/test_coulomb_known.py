"""Solvers on small problems whose every solution is known, or that there is none."""

import numpy as np
import pytest

from bipot import coulomb
from bipot.errors import InfeasibleProgram, SceneError
from studies.verification.discrete import CYCLED, HYPERSTATIC, NODE, THREE, UNDAMPED, UNIQUE, opposed, three_solutions

FINE = coulomb.Limits(tol=1e-12, seconds=10.0)


@pytest.mark.parametrize("name", UNIQUE)
def test_unique_solutions_are_found(name):
    problem, r, u, _ = UNIQUE[name]
    answer = coulomb.solve(problem, FINE)
    assert answer.converged
    np.testing.assert_allclose(answer.r, r, atol=1e-10)
    np.testing.assert_allclose(answer.u, u, atol=1e-10)
    assert len(coulomb.enumerate_modes(problem).solutions) == 1


def test_the_hyperstatic_case_is_solved_where_it_is_defined():
    answer = coulomb.solve(HYPERSTATIC.problem, FINE)
    assert answer.converged
    np.testing.assert_allclose(answer.u[1::2], HYPERSTATIC.u[1::2], atol=5e-7)
    np.testing.assert_allclose(answer.r, HYPERSTATIC.r, atol=1e-8)


def test_gauss_seidel_cycles_with_exact_contacts_and_is_not_believed():
    problem = UNIQUE[CYCLED].problem
    answer = coulomb.run(coulomb.GaussSeidel(local=150, sweeps=1), problem, coulomb.Limits(iterations=25))
    assert answer.outcome is coulomb.Outcome.ITERATION_LIMIT
    assert answer.residual() > 1e-2
    assert "more steps" in answer.reason


def test_undamped_convex_programs_cycle_and_damping_mends_it():
    problem, r, _, _ = UNIQUE[UNDAMPED]
    limits = coulomb.Limits(tol=1e-10, iterations=150)
    assert not coulomb.run(coulomb.DeSaxceFixedPoint(coulomb.Damped()), problem, limits).converged
    damped = coulomb.run(coulomb.DeSaxceFixedPoint(coulomb.Damped(0.5)), problem, limits)
    np.testing.assert_allclose(damped.r, r, atol=1e-9)
    assert 50 <= damped.iterations <= 75
    mixed = coulomb.run(coulomb.DeSaxceFixedPoint(), problem, limits)
    assert mixed.converged
    assert mixed.iterations < 20


def test_three_solutions_are_reported_as_three():
    report = coulomb.multiplicity(three_solutions())
    assert report.multiple
    assert report.exhaustive
    assert report.reason.startswith("3 solutions")
    found = sorted(tuple(np.round(answer.u, 12) + 0.0) for answer in report.solutions)
    np.testing.assert_allclose(found, THREE["u"], atol=1e-12)
    forces = sorted(tuple(answer.r) for answer in report.solutions)
    np.testing.assert_allclose(forces, THREE["r"], atol=1e-12)


def test_two_starts_give_two_answers_in_space():
    # the same node with a second, idle tangent
    W = np.zeros((3, 3))
    W[:2, :2], W[2, 2] = NODE, 1.0
    problem = coulomb.CoulombProblem(W, np.r_[NODE @ [-1, 1.2], 0.0], 1.5, 3)
    report = coulomb.multiplicity(problem, starts=4, limits=coulomb.Limits(seconds=5.0))
    assert report.multiple
    assert not report.exhaustive
    assert all(answer.residual() <= 1e-10 for answer in report.solutions)


def test_modes_are_enumerated_for_small_plane_problems_only():
    with pytest.raises(SceneError, match="dim"):
        coulomb.enumerate_modes(coulomb.CoulombProblem(np.eye(3), np.ones(3), 0.1, 3))
    with pytest.raises(SceneError, match="contacts"):
        coulomb.enumerate_modes(coulomb.CoulombProblem(np.eye(14), np.ones(14), 0.1, 2))


def test_no_solution_is_refused_with_its_reason_and_its_forces():
    bodies = opposed(-1.0)
    for problem in (bodies, bodies.reduced()):
        report = coulomb.existence(problem)
        assert report.verdict is coulomb.Existence.NONE
        assert report.forces is not None
        # the certificate, checked by hand: balanced, pushing, and doing negative work on the clearances
        assert np.all(report.forces >= 0)
        np.testing.assert_allclose(bodies.H.toarray()[:, ::2] @ report.forces, 0, atol=1e-6)
        assert bodies.w[::2] @ report.forces < -0.1
    with pytest.raises(InfeasibleProgram, match="no velocity keeps every contact from closing"):
        coulomb.solve(bodies.reduced())


def test_a_singular_newton_matrix_fails_in_words():
    problem = coulomb.CoulombProblem(np.zeros((4, 4)) + np.kron(np.ones((2, 2)), np.eye(2)), [-1.0, 0, -1, 0], 0.2, 2)
    answer = coulomb.run(coulomb.Newton(), problem)
    assert answer.outcome is coulomb.Outcome.FAILED
    assert "singular" in answer.reason
    assert coulomb.solve(problem).converged


def test_starting_at_the_answer_takes_no_step():
    problem, r, _, _ = UNIQUE["one node"]
    answer = coulomb.run(coulomb.Uzawa(), problem, coulomb.Limits(tol=1e-10), start=r)
    assert (answer.iterations, answer.converged) == (0, True)
    with pytest.raises(SceneError, match=r"start\.shape"):
        coulomb.run(coulomb.Uzawa(), problem, start=np.zeros(3))


def test_the_best_iterate_is_returned_not_the_last():
    problem = UNIQUE[CYCLED].problem
    solver = coulomb.GaussSeidel(local=50, sweeps=1)
    runs = [coulomb.run(solver, problem, coulomb.Limits(iterations=n)).residual() for n in range(6)]
    assert runs == sorted(runs, reverse=True)


def test_a_cycle_is_ended_by_patience():
    problem = UNIQUE[UNDAMPED].problem
    answer = coulomb.run(coulomb.DeSaxceFixedPoint(coulomb.Damped()), problem, coulomb.Limits(patience=30))
    assert answer.outcome is coulomb.Outcome.STALLED
    assert answer.iterations < 150
    assert "no progress in 30 steps" in answer.reason
