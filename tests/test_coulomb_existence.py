"""What is said about the existence of a solution before any is sought holds: against the modes, and by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bipot import coulomb
from bipot.errors import SceneError
from studies.verification.discrete import opposed
from tests.test_coulomb_soundness import solution_by_modes

EXISTS, UNKNOWN = coulomb.Existence.EXISTS, coulomb.Existence.UNKNOWN


def test_existence_has_three_values():
    assert coulomb.existence(opposed(0.1)).verdict is EXISTS
    # u = (s - 1, s) leaves the dual cone at mu = 2 everywhere, though u_n >= 0 is possible
    line = coulomb.CoulombProblem(np.ones((2, 2)), [-1.0, 0.0], 2.0, 2)
    assert coulomb.existence(line).verdict is UNKNOWN
    idle = coulomb.existence(coulomb.CoulombProblem(np.ones((2, 2)), [0.0, 1.0], 2.0, 2))
    assert idle.verdict is EXISTS


def beside(W, stiffness):
    """Contacts of W, and one of that flexibility that they do not know of."""
    whole = np.zeros((len(W) + 2, len(W) + 2))
    whole[:-2, :-2], whole[-2:, -2:] = W, stiffness * np.eye(2)
    return whole


@pytest.mark.parametrize(
    ("W", "q", "mu"),
    [
        (np.array([[1.0, 1.0], [3.0, 2.0]]), [-1.0, 3.0], 1.0),
        (beside([[1.0, 1.0], [3.0, 2.0]], 1e8), [-1.0, 3.0, -1.0, 0.0], 1.0),
        (np.array([[2.0, 4.0], [4.0, 2.0]]), [-2.0, 0.0], 2.0),
        (np.array([[-4.0, 0.0], [0.0, -4.0]]), [-3.0, 2.0], 2.0),
    ],
)
def test_existence_is_not_claimed_where_no_mode_holds(W, q, mu):
    problem = coulomb.CoulombProblem(W, q, mu, 2)
    assert not coulomb.enumerate_modes(problem).solutions
    report = coulomb.existence(problem)
    assert report.verdict is UNKNOWN
    assert report.reason.startswith("W is not positive semidefinite")
    with pytest.raises(SceneError, match="W"):
        coulomb.solve_associated(problem)


@pytest.mark.parametrize(
    ("W", "q"),
    [
        (np.diag([-1e-7, 1.0]), [-1.0, 0.0]),  # pulling would open it
        ([[1.0, 0, 9e-4, 0], [0, 1, 0, 0], [9e-4, 0, -1e-7, 0], [0, 0, 0, 1]], [0.0, 0, -1, 0]),
    ],
)
def test_what_is_semidefinite_to_a_few_digits_is_not_told_to_have_a_solution(W, q):
    """Velocities inside the dual cone need forces at which those digits matter; no force opens the contacts."""
    problem = coulomb.CoulombProblem(W, q, 0.3, 2)
    assert problem.semidefinite
    assert not coulomb.enumerate_modes(problem).solutions
    report = coulomb.existence(problem)
    assert report.verdict is UNKNOWN
    assert "not to enough digits" in report.reason


def test_existence_asks_of_bodies_what_the_theorem_supposes():
    bodies = coulomb.GlobalCoulombProblem([[1.0, 2.0], [2.0, 1.0]], np.eye(2), [-1.0, 0.0], [0.0, 0.0], 0.1, 2)
    report = coulomb.existence(bodies)
    assert report.verdict is UNKNOWN
    assert report.reason.startswith("M is not positive definite")


@given(st.integers(0, 100_000))
@settings(max_examples=30)
def test_existence_needs_no_symmetry(seed):
    """Where the symmetric part is semidefinite and some velocity of it is inside the dual cone, some mode holds."""
    rng = np.random.default_rng(seed)
    n, mu = 2 * int(rng.integers(1, 3)), float(rng.choice([0.0, 0.3, 2.0]))
    root, skew = rng.integers(-2, 3, (n, int(rng.integers(1, n + 1)))), rng.integers(-2, 3, (n, n))
    W, q = np.asarray(root @ root.T + skew - skew.T, dtype=float), rng.integers(-3, 4, n).astype(float)
    bodies = coulomb.GlobalCoulombProblem(3.0 * np.eye(n) + skew - skew.T, root[:, [0] * n], q, q, mu, 2)
    for problem in (coulomb.CoulombProblem(W, q, mu, 2), bodies):
        if coulomb.existence(problem).verdict is EXISTS:
            local = coulomb.reduced(problem)
            assert solution_by_modes(local.W.toarray(), local.q, local.mu) is not None
    assert coulomb.existence(coulomb.CoulombProblem(np.eye(n) + skew - skew.T, -1.0 - q**2, mu, 2)).verdict is EXISTS


def test_digits_that_matter_at_the_forces_of_a_velocity_inside_are_counted():
    """W is short of semidefinite by 1e-6 of a draw that no mode holds; its velocity is inside with the digits, too."""
    rng = np.random.default_rng(1202)
    n = 2 * int(rng.integers(1, 4))
    root = rng.normal(size=(n, int(rng.integers(1, n + 1))))
    v = rng.normal(size=n) * (rng.random(n) < 0.6)
    W = root @ root.T - np.outer(v, v) * 10.0 ** rng.uniform(-7, -5.5)
    problem = coulomb.CoulombProblem(W, rng.normal(size=n), 0.5, 2)
    report = coulomb.enumerate_modes(problem)
    assert not report.solutions
    assert not report.doubtful
    assert coulomb.existence(problem).verdict is UNKNOWN
