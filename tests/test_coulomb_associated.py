"""The associated relaxation: what it says of its own answer, and where it has none, against cvxpy and by hand."""

import cvxpy as cp
import numpy as np
import pytest

from bipot.coulomb import AssociatedSolution, CoulombProblem, solve_associated
from bipot.errors import InfeasibleProgram

FRICTION = np.array([0.0, 0.1, 0.3, 1.0])


def drawn(seed, rank):
    """A problem whose W = A A' has so much of full rank, and A."""
    rng = np.random.default_rng(seed)
    dim, contacts = int(rng.choice([2, 3])), int(rng.integers(2, 5))
    A = rng.standard_normal((dim * contacts, max(1, int(rank * dim * contacts))))
    q = rng.standard_normal(dim * contacts)
    return CoulombProblem(A @ A.T, q, rng.choice(FRICTION, contacts), dim), A


def margin(problem, A):
    """The largest t <= 1 for which some velocity A y + q is inside the dual cones by t."""
    y, t = cp.Variable(A.shape[1]), cp.Variable()
    u = cp.reshape(A @ y + problem.q, (problem.contacts, problem.dim), order="C")
    inside = u[:, 0] >= cp.multiply(problem.mu, cp.norm(u[:, 1:], 2, axis=1)) + t
    cp.Problem(cp.Maximize(t), [inside, t <= 1.0]).solve(solver=cp.CLARABEL)
    return float(t.value)


def missed(problem, r):
    """What forces r (dc,) miss of r in K, u in K* and r . u = 0, over the largest of load and force."""
    u = (problem.W @ r + problem.q).reshape(-1, problem.dim)
    f, mu = r.reshape(-1, problem.dim), problem.mu
    outside = np.linalg.norm(f[:, 1:], axis=1) - mu * f[:, 0]
    closed = mu * np.linalg.norm(u[:, 1:], axis=1) - u[:, 0]
    largest, load = np.abs(f).max() or 1.0, np.abs(problem.q).max()
    return max(outside.max() / largest, closed.max() / load, np.abs((f * u).sum(axis=1)).max() / (largest * load))


def test_a_singular_problem_has_an_answer_or_is_called_unbounded():
    """By duality it has a minimum where some velocity is in the dual cones; both kinds are among these."""
    ends = []
    for seed in range(20):
        problem, A = drawn(seed, 0.3)
        room = margin(problem, A)
        if abs(room) < 1e-3:
            continue
        ends.append(room > 0)
        if room > 0:
            answer = solve_associated(problem)
            assert answer.residual() < 1e-7
            assert missed(problem, answer.r) < 1e-6
        else:
            with pytest.raises(InfeasibleProgram, match="unbounded"):
                solve_associated(problem)
    assert 5 < sum(ends) < len(ends) - 5


@pytest.mark.parametrize("share", [1e-1, 1e-3, 1e-5])
def test_the_residual_is_that_of_a_planted_error(share):
    """Of W = 1 and forces inside their cones u is off by as much as r, and r - P(r - u) is u."""
    problem = CoulombProblem(np.eye(6), [-3.0, 0.2, 0.1, -4.0, 0.0, 0.3], 0.5, 3)
    error = share * np.array([1.0, -0.5, 0.2, 0.3, 0.1, -0.7])
    off = AssociatedSolution(problem, -problem.q + error)
    assert off.residual() == pytest.approx(np.linalg.norm(error) / np.linalg.norm(problem.q), rel=1e-9)


def test_large_forces_do_not_hide_their_error():
    """Two bodies press on each other without give: forces of 1e8 leave what closes as it is."""
    opposed = np.zeros((4, 4))
    opposed[:3:2, :3:2] = [[1.0, -1.0], [-1.0, 1.0]]
    problem = CoulombProblem(opposed + np.diag([0.0, 1.0, 0.0, 1.0]), [-1.0, 0.0, -1.0, 0.0], 0.1, 2)
    assert AssociatedSolution(problem, np.array([1e8, 0.0, 1e8, 0.0])).residual() > 0.1
    with pytest.raises(InfeasibleProgram, match="self-balanced"):
        solve_associated(problem)


@pytest.mark.parametrize("seed", range(6))
def test_what_a_nearly_singular_problem_leaves_is_told(seed):
    """Directions of W differ by 1e12 in their stiffness."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((9, 9)) * 10.0 ** rng.uniform(-3, 3, 9)
    problem = CoulombProblem(A @ A.T, rng.standard_normal(9), rng.choice(FRICTION, 3), 3)
    answer = solve_associated(problem)
    assert answer.residual() > 1e-3 * missed(problem, answer.r) - 1e-9


def test_contacts_that_no_force_moves_have_their_answer():
    still = CoulombProblem(np.zeros((2, 2)), [1.0, 0.0], 0.3, 2)
    assert still.semidefinite
    np.testing.assert_array_equal(solve_associated(still).r, 0.0)
