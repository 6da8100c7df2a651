"""Nothing wrong is called solved: an enumeration of all modes, written here, against every answer and refusal."""

from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog

from bipot import coulomb
from bipot.errors import InfeasibleProgram, SceneError

SOLVERS = [
    coulomb.ProximalPoint(),
    coulomb.ProximalPoint(coulomb.NaturalMap()),
    coulomb.Newton(),
    coulomb.Newton(levenberg=1e-6),
    coulomb.TrescaFixedPoint(),
    coulomb.TrescaFixedPoint(coulomb.Damped()),
    coulomb.DeSaxceFixedPoint(),
    coulomb.GaussSeidel(),
    coulomb.Uzawa(),
]

BRIEF = coulomb.Limits(iterations=150, seconds=5.0)


def no_solution(dim=2):
    """u = (s - 1, s), s = r_n + r_t, at mu = 2: sticking asks s = 1 and s = 0, slipping s = 1 and s = -r_n."""
    W = np.eye(dim)
    W[:2, :2] = 1.0
    return coulomb.CoulombProblem(W, [-1.0] + [0.0] * (dim - 1), 2.0, dim)


def runaway():
    """Solved by a moderate force, with another direction in which forces run away at a constant residual of 0.5."""
    W = [[18, 12, -12, 12], [12, 8, -8, 8], [-12, -8, 8, -8], [12, 8, -8, 8]]
    return coulomb.CoulombProblem(W, [-1, 0, 2, -2], 2.0, 2)


def solution_by_modes(W, q, mu):
    """A force that solves a plane problem, by one linear program a mode; None where every mode is empty."""
    axes = np.eye(q.size)
    for modes in product(["open", "stick", "left", "right"], repeat=mu.size):
        equal, below = [], []
        for k, mode in enumerate(modes):
            n, t = 2 * k, 2 * k + 1
            if mode == "open":
                equal += [(axes[n], 0), (axes[t], 0)]
                below += [(-W[n], q[n])]
            elif mode == "stick":
                equal += [(W[n], -q[n]), (W[t], -q[t])]
                below += [(-axes[n], 0), (axes[t] - mu[k] * axes[n], 0), (-axes[t] - mu[k] * axes[n], 0)]
            else:
                way = {"left": -1, "right": 1}[mode]
                equal += [(W[n], -q[n]), (axes[t] + way * mu[k] * axes[n], 0)]
                below += [(-axes[n], 0), (-way * W[t], way * q[t])]
        (E, e), (G, g) = zip(*equal, strict=True), zip(*below, strict=True)
        found = linprog(np.zeros(q.size), np.array(G), g, np.array(E), e, bounds=(None, None))
        if found.status == 0:
            return found.x
    return None


def obeys_the_law(W, q, mu, r, tol=1e-7):
    """Contact by contact, as the law is spoken; W, q and r of order one to ten."""
    u = W @ r + q
    for (r_n, r_t), (u_n, u_t), m in zip(r.reshape(-1, 2), u.reshape(-1, 2), mu, strict=True):
        opened = max(abs(r_n), abs(r_t)) <= tol and u_n >= -tol
        sticks = max(abs(u_n), abs(u_t)) <= tol and abs(r_t) <= m * r_n + tol
        slips = abs(u_n) <= tol and r_n >= -tol and abs(r_t + m * r_n * np.sign(u_t)) <= tol * (1 + m)
        if not (opened or sticks or slips):
            return False
    return True


def random_problem(rng, deficient):
    """Up to three contacts, whole numbers: singular matrices are exactly singular."""
    c = int(rng.integers(1, 4))
    columns = int(rng.integers(1, 2 * c)) if deficient else 2 * c
    root = rng.integers(-3, 4, size=(2 * c, columns)).astype(float)
    return root @ root.T, rng.integers(-4, 5, size=2 * c).astype(float), rng.choice([0.0, 0.3, 1.0, 2.0], size=c)


@pytest.mark.parametrize("count", [30, pytest.param(300, marks=pytest.mark.slow)])
def test_random_problems_against_the_enumeration_of_their_modes(count):
    rng = np.random.default_rng(7)
    counts = {"solved": 0, "refused": 0, "not converged": 0}
    for k in range(count):
        W, q, mu = random_problem(rng, deficient=k % 2 == 0)
        known = solution_by_modes(W, q, mu)
        try:
            answer = coulomb.solve(coulomb.CoulombProblem(W, q, mu, 2), coulomb.Limits(seconds=20.0, patience=200))
        except InfeasibleProgram:
            assert known is None
            counts["refused"] += 1
            continue
        assert answer.converged == (known is not None), (k, answer.reason)
        assert not answer.converged or obeys_the_law(W, q, mu, answer.r), k
        assert answer.converged or "has no solution" in answer.reason
        counts["solved" if answer.converged else "not converged"] += 1
    assert min(counts["not converged"], counts["refused"]) >= count // 60


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: solver.name)
def test_no_single_solver_converges_where_no_solution_exists(solver):
    for problem in (no_solution(2), no_solution(3)):
        answer = coulomb.run(solver, problem, BRIEF)
        assert not answer.converged
        assert answer.residual() > 0.1
    problem = runaway()
    answer = coulomb.run(solver, problem, BRIEF)
    assert not answer.converged or obeys_the_law(problem.W.toarray(), problem.q, problem.mu, answer.r)


@pytest.mark.slow
def test_an_unsolvable_problem_ends_in_words():
    answer = coulomb.solve(no_solution())
    assert not answer.converged
    assert "has no solution" in answer.reason
    space = coulomb.solve(no_solution(3), coulomb.Limits(patience=100))
    assert not space.converged
    assert "Whether a solution exists is not known" in space.reason


@pytest.mark.slow
def test_a_solution_beside_runaway_forces_is_found():
    answer = coulomb.solve(runaway())
    assert answer.converged
    np.testing.assert_allclose(answer.r, [0, 0, 0.25, 0.5], atol=1e-9)
    np.testing.assert_allclose(answer.u, [2, 2, 0, 0], atol=1e-9)


NEARLY_OPPOSED = np.array([[1.0, 0, 1e-9 - 1, 0], [0, 1, 0, 0], [1e-9 - 1, 0, 1, 0], [0, 0, 0, 1]])
"""Two normal forces that all but balance: what closes both contacts takes 1e8 of them."""


@pytest.mark.parametrize(
    ("W", "q", "tol"),
    [
        ([[2.0, 1.0], [1.0, 3.0]], [-1.3, 0.7], 1e-17),  # more than numbers of such digits can meet
        (NEARLY_OPPOSED, [-1.0, 0, 0.9, 0], 1e-10),  # forces whose round-off is larger
    ],
)
def test_that_there_is_no_solution_is_not_told_where_round_off_hides_it(W, q, tol):
    problem = coulomb.CoulombProblem(W, q, 0.3, 2)
    answer = coulomb.solve(problem, coulomb.Limits(tol=tol, iterations=20, patience=5))
    assert not answer.converged
    assert "has no solution" not in answer.reason
    assert "A solution exists: some velocity lies inside the dual cone." in answer.reason
    report = coulomb.enumerate_modes(problem, tol)
    assert (report.solutions, report.doubtful) == ((), True)
    assert "as near to one as can be told" in report.reason
    assert not coulomb.enumerate_modes(no_solution()).doubtful
    assert coulomb.enumerate_modes(problem, 1e-7).solutions


def test_what_misses_a_mode_by_a_little_is_doubtful():
    """Sticking asks of s = r_n + r_t that it be 1 and, by so little less that files do not tell, 1 - 1e-9."""
    report = coulomb.enumerate_modes(coulomb.CoulombProblem(np.ones((2, 2)), [-1.0, 1e-9 - 1.0], 2.0, 2))
    assert (report.solutions, report.doubtful) == ((), True)


def test_forces_of_much_round_off_are_doubtful():
    """Two forces of 1e10 that balance, whose round-off is above 1e-7."""
    W = np.where(NEARLY_OPPOSED == 1e-9 - 1, 1e-11 - 1, NEARLY_OPPOSED)
    report = coulomb.enumerate_modes(coulomb.CoulombProblem(W, [-1.0, 0, 0.9, 0], 0.0, 2))
    assert (report.solutions, report.doubtful) == ((), True)


def coupled(rng, dim, singular):
    n = dim * int(rng.integers(2, 9))
    root = rng.normal(size=(n, n // 2 if singular else n))
    return root @ root.T / n + (0.0 if singular else 0.1) * np.eye(n), rng.normal(size=n)


@pytest.mark.slow
def test_contacts_of_very_different_scales_are_solved():
    rng = np.random.default_rng(11)
    for k in range(40):
        dim = 2 + k % 2
        W, q = coupled(rng, dim, singular=k % 4 < 2)
        c = q.size // dim
        mu, own = rng.choice([0.0, 0.2, 0.5], size=c), np.repeat(10.0 ** rng.uniform(-6, 6, c), dim)
        plain, scaled = (coulomb.CoulombProblem(own[:, None] ** p * W * own**p, q * own**p, mu, dim) for p in (0, 1))
        answer = coulomb.solve(scaled, coulomb.Limits(seconds=10.0))
        assert answer.converged, (k, answer.reason)
        # the same force, in the units of the plain problem, solves that
        assert coulomb.residual(plain, answer.r * own) <= 1e-9
        np.testing.assert_array_equal(coulomb.solve(scaled).status(1e-6), coulomb.solve(plain).status(1e-6))


@pytest.mark.slow
def test_very_large_and_no_friction_in_one_problem():
    rng = np.random.default_rng(3)
    for k in range(30):
        c = int(rng.integers(2, 4))
        root = rng.normal(size=(2 * c, 2 * c))
        W, q = root @ root.T + 0.5 * np.eye(2 * c), rng.normal(size=2 * c)
        mu = np.r_[0.0, 1e6, rng.choice([1e-3, 10.0, 1e3, 1e6], size=c - 2)]
        answer = coulomb.solve(coulomb.CoulombProblem(W, q, mu, 2), coulomb.Limits(seconds=10.0))
        assert answer.converged == (solution_by_modes(W, q, mu) is not None), (k, answer.reason)
        assert not answer.converged or obeys_the_law(W, q, mu, answer.r), k


@pytest.mark.parametrize("seconds", [1e-9, 1e-6])
def test_no_time_at_all_is_said(seconds):
    answer = coulomb.solve(coulomb.CoulombProblem(np.eye(2), [-1.0, 0.1], 0.3, 2), coulomb.Limits(seconds=seconds))
    assert answer.outcome is coulomb.Outcome.TIME_LIMIT
    assert "more time" in answer.reason
    np.testing.assert_array_equal(answer.r, 0.0)
    with pytest.raises(SceneError, match=r"seconds = 0\.0: must be > 0"):
        coulomb.Limits(seconds=0.0)


def test_a_singular_mode_holds_two_velocities_and_all_between():
    W = [[0, 0, 0, 0], [0, 1, 0, -2], [0, 0, 0, 0], [0, -2, 0, 4]]
    report = coulomb.multiplicity(coulomb.CoulombProblem(W, [0, 4, 3, -2], 2.0, 2))
    assert report.exhaustive
    assert report.continuum
    assert report.reason.startswith("2 solutions")
    found = sorted(tuple(answer.u.round(9) + 0.0) for answer in report.solutions)
    np.testing.assert_allclose(found, [(0, 0, 3, 6), (0, 4, 3, -2)], atol=1e-9)
    assert coulomb.multiplicity(no_solution()).reason.startswith("No solution")


@pytest.mark.parametrize("q", [(0.0, 1.0), (0.0, 0.0)])
def test_a_range_of_velocities_without_an_end_is_a_range(q):
    # sliding one way costs the normal force nothing and is sped up by it: every r = f (1, -1) solves, u_t = q_t + 2 f
    problem = coulomb.CoulombProblem([[1, 1], [3, 1]], q, 1.0, 2)
    assert all(coulomb.residual(problem, np.array([f, -f])) < 1e-14 for f in (0.0, 0.1, 1.0, 10.0))
    report = coulomb.multiplicity(problem)
    assert report.multiple
    assert report.continuum


@pytest.mark.parametrize("unit", [1e-12, 1e-8, 1.0, 1e8])
def test_units_do_not_matter_where_no_contact_has_a_positive_diagonal(unit):
    W = np.array([[-2, 4, -2, 0], [-4, -4, -2, 2], [-1, 1, 1, -1], [0, 1, -1, -1]], dtype=np.float64)
    sticking = np.array([1.0, -0.239, 0.0, 0.0])
    problem = coulomb.CoulombProblem(unit * W, -unit * W @ sticking, [0.8, 0.114], 2)
    np.testing.assert_allclose(problem.contact_unit, np.sqrt(unit * np.array([2.0, 1.0])), rtol=1e-12)
    assert len(coulomb.enumerate_modes(problem).solutions) == 3
