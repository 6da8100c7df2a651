"""What an answer of the discrete Coulomb problem is judged by: each contact by what moves it, in its own units."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bipot import coulomb
from bipot.coulomb.solution import judge, nearest_law
from tests.test_coulomb_soundness import coupled, no_solution


def beside(W, q, mu):
    """The unsolvable problem and, uncoupled or by its own load only, another contact."""
    own = no_solution()
    whole = np.zeros((4, 4))
    whole[:2, :2], whole[2:, 2:] = own.W.toarray(), W
    return coulomb.CoulombProblem(whole, np.r_[own.q, q], [2.0, mu], 2)


@pytest.mark.parametrize(
    "trap",
    [
        beside(np.eye(2), [1e12, 0.0], 0.3),  # a distant gap
        beside(np.eye(2), [-1e12, 0.0], 0.3),  # a load that presses elsewhere
        beside(np.eye(2) * 1e-24, [-1.0, 0.3], 0.3),  # a contact of another stiffness
        beside(np.eye(2), [-1.0, 1e12], 0.3),  # a fast slide
    ],
)
def test_what_is_large_elsewhere_does_not_excuse(trap):
    answer = coulomb.run(coulomb.ProximalPoint(), trap, coulomb.Limits(patience=100))
    assert not answer.converged
    assert answer.residual() > 0.1


@pytest.mark.parametrize("mu", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("coupling", [1e-30, 1e-14, -1e-12])
def test_what_is_hardly_coupled_does_not_excuse(coupling, mu):
    """The second contact is closed by a load of 1, and no force moves it; the first is under one of 1e11."""
    W = np.diag([1.0, 1.0, 0.0, 0.0])
    W[0, 2] = W[2, 0] = coupling
    problem = coulomb.CoulombProblem(W, [-1e11, 0.0, -1.0, 0.0], mu, 2)
    answer = coulomb.solve(problem, coulomb.Limits(patience=100))
    assert not answer.converged
    assert "has no solution" in answer.reason
    assert coulomb.residual(problem, np.array([1e11, 0.0, 0.0, 0.0])) > 0.1


def test_a_contact_is_not_asked_for_more_than_the_round_off_of_what_moves_it():
    """The first contact's force moves the second by 1e11, its own load of 1 is below the round-off of that."""
    W = np.array([[1.0, 0, 1, 0], [0, 1, 0, 0], [1, 0, 2, 0], [0, 0, 0, 1]])
    problem = coulomb.CoulombProblem(W, [-1e11, 0.0, -1.0 - 1e11, 0.0], 0.3, 2)
    assert coulomb.residual(problem, np.array([1e11 - 1, 0.0, 1.0, 0.0])) < 1e-15
    assert coulomb.solve(problem).converged


def test_a_fast_slide_does_not_excuse_a_missing_force():
    sliding = coulomb.CoulombProblem(np.eye(2), [-1.0, 1e12], 0.3, 2)
    assert coulomb.residual(sliding, np.zeros(2)) == pytest.approx(1.0)
    assert coulomb.residual(sliding, np.array([1.0, -0.3])) < 1e-12
    np.testing.assert_allclose(coulomb.solve(sliding).r, [1.0, -0.3], rtol=1e-9)


@given(st.integers(0, 10_000), st.sampled_from([2, 3]))
def test_the_judgement_does_not_know_the_units_of_a_contact(seed, dim):
    rng = np.random.default_rng(seed)
    W, q = coupled(rng, dim, singular=False)
    c = q.size // dim
    r, own = rng.normal(size=q.size), np.repeat(10.0 ** rng.uniform(-6, 6, c), dim)
    expected = judge(coulomb.CoulombProblem(W, q, 0.4, dim), r)
    other = judge(coulomb.CoulombProblem(own[:, None] * W * own, q * own, 0.4, dim), r / own)
    np.testing.assert_allclose(other, expected, rtol=1e-9)


def test_forces_beyond_the_resolution_are_not_converged():
    # two contacts on one degree of freedom: self-balanced forces of any size change nothing but the round-off
    problem = coulomb.CoulombProblem(np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(2)), [-1.0, 0, 1.0, 0], 0.3, 2)
    small, huge = np.array([1.0, 0, 0, 0]), np.array([1.0 + 2.0**40, 0, 2.0**40, 0])
    assert coulomb.residual(problem, small) < 1e-15
    np.testing.assert_array_equal(problem.velocity(huge), problem.velocity(small))
    told = judge(problem, huge)
    assert told.residual == told.resolution > 1e-4
    answer = coulomb.run(coulomb.Uzawa(), problem, coulomb.Limits(iterations=0), huge)
    assert not answer.converged
    assert "round-off of W r alone" in answer.reason


def test_forces_beyond_all_numbers_are_infinitely_far():
    assert coulomb.residual(no_solution(), np.array([1e200, 0.0])) == np.inf


@given(st.integers(0, 10_000), st.sampled_from([2, 3]))
def test_exact_pairs_have_no_distance_and_planted_errors_theirs(seed, dim):
    rng = np.random.default_rng(seed)
    mu, r_n, slip = rng.choice([0.0, 0.3, 1e6], size=3), rng.uniform(0.1, 1, 3), rng.normal(size=(3, dim - 1))
    along = slip / np.linalg.norm(slip, axis=1)[:, None]
    r, u = np.zeros((3, dim)), np.zeros((3, dim))
    r[1, 0], r[1, 1:] = r_n[1], 0.5 * mu[1] * r_n[1] * along[1]
    r[2, 0], r[2, 1:], u[2, 1:] = r_n[2], -mu[2] * r_n[2] * along[2], slip[2]
    u[0] = rng.uniform(0.1, 1, dim)
    size = 1.0 + np.abs(r).max()
    np.testing.assert_allclose(nearest_law(r, u, mu).distance, 0.0, atol=1e-15 * size)
    off = np.array([1e-3, 0, 0])
    pressed, apart = r.copy(), u.copy()
    pressed[:, 0] += off
    np.testing.assert_allclose(nearest_law(pressed, u, mu).distance, off, atol=1e-15 * size)
    apart[1:, 0] -= 1e-3
    np.testing.assert_allclose(nearest_law(r, apart, mu).distance, [0, 1e-3, 1e-3], atol=1e-13 * size)


@given(st.integers(0, 10_000))
def test_the_distance_in_space_is_never_too_short_and_at_most_root_two_too_long(seed):
    rng = np.random.default_rng(seed)
    r, u, mu = rng.normal(size=(5, 3)), rng.normal(size=(5, 3)), rng.uniform(0, 2, 5)
    angle = np.linspace(0, 2 * np.pi, 20_001)
    e = np.stack([np.cos(angle), np.sin(angle)])
    for k, found in enumerate(nearest_law(r, u, mu).distance):
        # slip: what is left of r off the ray (1, -mu e) and of u_t off e; stick and open need no direction
        on_ray = np.maximum(r[k, 0] - mu[k] * r[k, 1:] @ e, 0) / np.hypot(1, mu[k])
        on_slip = np.maximum(u[k, 1:] @ e, 0)
        slip = np.sqrt(u[k] @ u[k] + r[k] @ r[k] - np.max(on_ray**2 + on_slip**2))
        height = (r[k, 0] + mu[k] * np.linalg.norm(r[k, 1:])) / (1 + mu[k] ** 2)
        outside = np.linalg.norm(r[k, 1:]) > mu[k] * r[k, 0]
        nearest = max(height, 0) * np.r_[1, mu[k] * r[k, 1:] / np.linalg.norm(r[k, 1:])] if outside else r[k]
        stick = np.hypot(np.linalg.norm(u[k]), np.linalg.norm(r[k] - nearest))
        exact = min(slip, stick, np.hypot(np.linalg.norm(r[k]), min(u[k, 0], 0)))
        assert exact * (1 - 1e-6) <= found <= exact * np.sqrt(2) * (1 + 1e-6)


@pytest.mark.parametrize("diagonal", [1e-6, 1e-12])
def test_an_unsymmetric_matrix_of_small_diagonal_lends_no_unit_to_forces_outside_the_cone(diagonal):
    """By hand: r = (2, 1) slides by (0, -2). A force of (0, 1) was certified by the unit of the diagonal alone."""
    problem = coulomb.CoulombProblem(W=[[diagonal, 1.0], [-1.0, diagonal]], q=[-1.0, 0.0], mu=0.5, dim=2)
    found = coulomb.solve(problem)
    np.testing.assert_allclose(found.r, [2.0, 1.0], rtol=3 * diagonal + 1e-9)
    assert judge(problem, np.array([diagonal, 1.0])).residual > 0.1


def test_units_of_symmetric_problems_are_those_of_their_diagonals():
    rng = np.random.default_rng(5)
    A = rng.normal(size=(6, 6)) * 10.0 ** rng.uniform(-4, 4, (1, 6))
    problem = coulomb.CoulombProblem(W=A.T @ A, q=rng.normal(size=6), mu=0.3, dim=2)
    np.testing.assert_array_equal(problem.contact_unit, np.sqrt(np.diag(A.T @ A).reshape(3, 2).mean(axis=1)))
