"""Solvers on small problems whose every solution is known, or that there is none."""

import numpy as np
import pytest

from bipot import coulomb
from bipot.errors import InfeasibleProgram, SceneError

FINE = coulomb.Limits(tol=1e-12, seconds=10.0)

NODE = np.linalg.inv([[2.0, -1.0], [-1.0, 1.0]])
A, B = -464.2665883420583, 236.5081445699369
C, D = -464.2662921766746, 461.6596337492515
HYPERSTATIC = [
    [936.5610022253570, A, -915.2908496264952, A],
    [C, B, D, B],
    [-915.2908496264952, 461.6593375138678, 936.5610022253570, 461.6593375138678],
    [C, B, D, B],
]
KNOWN = {
    "one node": (NODE, NODE @ [-1, -1.2], 0.5, [1.466666666666667, 0.733333333333333], [0, -0.466666666666667]),
    "Gauss-Seidel cycles": (
        [[15, 11, 4, 7], [11, 17, 11, 8], [4, 11, 11, 4], [7, 8, 4, 9]],
        [-1, 0, -1, -3],
        1.0,
        np.array([4, -4, 11, 11]) / 137,
        np.array([0, 185, 0, -272]) / 137,
    ),
    "convex programs cycle": (
        [[28, -5, -12, -10], [-5, 17, -12, -5], [-12, -12, 22, 7], [-10, -5, 7, 10]],
        [-4, 1, -4, -4],
        1.0,
        np.array([204, 204, 188, 188]) / 139,
        np.array([0, -609, 0, -420]) / 139,
    ),
}


def known(name):
    W, q, mu, r, u = KNOWN[name]
    return coulomb.CoulombProblem(W, q, mu, 2), np.asarray(r), np.asarray(u)


@pytest.mark.parametrize("name", KNOWN)
def test_unique_solutions_are_found(name):
    problem, r, u = known(name)
    answer = coulomb.solve(problem, FINE)
    assert answer.converged
    np.testing.assert_allclose(answer.r, r, atol=1e-10)
    np.testing.assert_allclose(answer.u, u, atol=1e-10)
    assert len(coulomb.enumerate_modes(problem)) == 1


def test_the_hyperstatic_case_is_solved_where_it_is_defined():
    q = [-1.179087309965789, -8.407368208001527] * 2
    answer = coulomb.solve(coulomb.CoulombProblem(HYPERSTATIC, q, 0.01, 2), FINE)
    assert answer.converged
    np.testing.assert_allclose(answer.u[1::2], -8.546463, atol=5e-7)
    np.testing.assert_allclose(answer.r, [0.05577943, 0.00055779, 0.05522441, 0.00055224], atol=1e-8)


def test_gauss_seidel_cycles_with_exact_contacts_and_is_not_believed():
    problem, _, _ = known("Gauss-Seidel cycles")
    answer = coulomb.run(coulomb.GaussSeidel(local=150, sweeps=1), problem, coulomb.Limits(iterations=25))
    assert answer.outcome is coulomb.Outcome.ITERATION_LIMIT
    assert answer.residual() > 1e-2
    assert "more steps" in answer.reason


def test_undamped_convex_programs_cycle_and_damping_mends_it():
    problem, r, _ = known("convex programs cycle")
    limits = coulomb.Limits(tol=1e-10, iterations=150)
    assert not coulomb.run(coulomb.DeSaxceFixedPoint(coulomb.Damped()), problem, limits).converged
    damped = coulomb.run(coulomb.DeSaxceFixedPoint(coulomb.Damped(0.5)), problem, limits)
    np.testing.assert_allclose(damped.r, r, atol=1e-9)
    assert 50 <= damped.iterations <= 75
    mixed = coulomb.run(coulomb.DeSaxceFixedPoint(), problem, limits)
    assert mixed.converged
    assert mixed.iterations < 20


def three_solutions():
    return coulomb.CoulombProblem(NODE, NODE @ [-1, 1.2], 1.5, 2)


def test_three_solutions_are_reported_as_three():
    report = coulomb.multiplicity(three_solutions())
    assert report.multiple
    assert report.exhaustive
    assert report.reason.startswith("3 solutions")
    found = sorted(tuple(np.round(answer.u, 12) + 0.0) for answer in report.solutions)
    np.testing.assert_allclose(found, [(0, 0), (0, 0.6), (0.2, 1.4)], atol=1e-12)
    forces = sorted(tuple(answer.r) for answer in report.solutions)
    np.testing.assert_allclose(forces, [(0, 0), (0.4, -0.6), (1, -1.2)], atol=1e-12)


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


def opposed(clearance):
    """One dof and its tangent between two opposed contacts; ``clearance`` is the sum of both gaps."""
    H = np.array([[1.0, 0, -1, 0], [0, 1, 0, 1]])
    w = np.array([clearance / 2, 0.0, clearance / 2, 0.0])
    return coulomb.GlobalCoulombProblem(np.eye(2), H, [0.3, 0.5], w, 0.2, 2)


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


def test_existence_has_three_values():
    assert coulomb.existence(opposed(0.1)).verdict is coulomb.Existence.EXISTS
    # u = (s - 1, s) leaves the dual cone at mu = 2 everywhere, though u_n >= 0 is possible
    line = coulomb.CoulombProblem(np.ones((2, 2)), [-1.0, 0.0], 2.0, 2)
    assert coulomb.existence(line).verdict is coulomb.Existence.UNKNOWN
    idle = coulomb.existence(coulomb.CoulombProblem(np.ones((2, 2)), [0.0, 1.0], 2.0, 2))
    assert idle.verdict is coulomb.Existence.EXISTS
    skew = coulomb.existence(coulomb.CoulombProblem([[2.0, 1.0], [0.0, 2.0]], [-1.0, 0.0], 0.1, 2))
    assert skew.verdict is coulomb.Existence.UNKNOWN
    assert "symmetric" in skew.reason


def test_a_singular_newton_matrix_fails_in_words():
    problem = coulomb.CoulombProblem(np.zeros((4, 4)) + np.kron(np.ones((2, 2)), np.eye(2)), [-1.0, 0, -1, 0], 0.2, 2)
    answer = coulomb.run(coulomb.Newton(), problem)
    assert answer.outcome is coulomb.Outcome.FAILED
    assert "singular" in answer.reason
    assert coulomb.solve(problem).converged


def test_starting_at_the_answer_takes_no_step():
    problem, r, _ = known("one node")
    answer = coulomb.run(coulomb.Uzawa(), problem, coulomb.Limits(tol=1e-10), start=r)
    assert (answer.iterations, answer.converged) == (0, True)
    with pytest.raises(SceneError, match=r"start\.shape"):
        coulomb.run(coulomb.Uzawa(), problem, start=np.zeros(3))


def test_the_best_iterate_is_returned_not_the_last():
    problem, _, _ = known("Gauss-Seidel cycles")
    solver = coulomb.GaussSeidel(local=50, sweeps=1)
    runs = [coulomb.run(solver, problem, coulomb.Limits(iterations=n)).residual() for n in range(6)]
    assert runs == sorted(runs, reverse=True)


def test_a_cycle_is_ended_by_patience():
    problem, _, _ = known("convex programs cycle")
    answer = coulomb.run(coulomb.DeSaxceFixedPoint(coulomb.Damped()), problem, coulomb.Limits(patience=30))
    assert answer.outcome is coulomb.Outcome.STALLED
    assert answer.iterations < 150
    assert "no progress in 30 steps" in answer.reason
