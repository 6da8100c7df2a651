"""Nothing wrong is called solved: against an enumeration of all modes written here, and against planted traps."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from bipot import coulomb
from bipot.coulomb.judgement import judge, nearest_law
from bipot.errors import InfeasibleProgram

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


@given(st.integers(0, 10_000), st.sampled_from([2, 3]))
def test_the_judgement_does_not_know_the_units_of_a_contact(seed, dim):
    rng = np.random.default_rng(seed)
    W, q = coupled(rng, dim, singular=False)
    c = q.size // dim
    r, own = rng.normal(size=q.size), np.repeat(10.0 ** rng.uniform(-6, 6, c), dim)
    expected = judge(coulomb.CoulombProblem(W, q, 0.4, dim), r)
    other = judge(coulomb.CoulombProblem(own[:, None] * W * own, q * own, 0.4, dim), r / own)
    np.testing.assert_allclose(other, expected, rtol=1e-9)


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
    assert len(coulomb.enumerate_modes(problem)) == 3


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
