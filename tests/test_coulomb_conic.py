"""The convex programs: cvxpy against Clarabel, interior-point answers and their polish, acceleration, derivatives."""

import cvxpy as cp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bipot import coulomb
from bipot.conic.problem import Claim, ConicSolution, Timing
from bipot.coulomb.acceleration import Past
from bipot.coulomb.conic import force_program, polished_force
from bipot.coulomb.functions import AlartCurnier, ConeMap, NaturalMap, TrescaMap
from bipot.coulomb.solver import scale
from bipot.errors import InfeasibleProgram, ProgramError, SceneError, UnboundedProgram


def problem_of(seed, dim, contacts=4):
    rng = np.random.default_rng(seed)
    n = dim * contacts
    root = rng.normal(size=(n, n))
    return coulomb.CoulombProblem(root @ root.T / n + 0.3 * np.eye(n), rng.normal(size=n), 0.4, dim)


def energy(problem, r, load):
    return 0.5 * r @ problem.W @ r + load @ r


def stated(problem, load, constraints):
    """min ½ r·W r + load·r under constraints on the forces r (c, d), as one writes it: its value and its forces."""
    r = cp.Variable((problem.contacts, problem.dim))
    flat, W = cp.reshape(r, (problem.size,), order="C"), problem.W.toarray()
    cost = 0.5 * cp.quad_form(flat, cp.psd_wrap((W + W.T) / 2)) + load @ flat
    program = cp.Problem(cp.Minimize(cost), constraints(r))
    program.solve(cp.CLARABEL)
    return program.value, r.value


@settings(max_examples=8)
@given(st.integers(0, 10_000), st.sampled_from([2, 3]))
def test_cvxpy_and_clarabel_solve_the_same_programs(seed, dim):
    problem = problem_of(seed, dim)
    scaled, given_values = scale(problem), np.random.default_rng(seed).uniform(0.0, 0.5, 4)
    none = np.zeros(4)

    value, forces = stated(problem, problem.q, lambda r: [cp.norm(r[:, 1:], axis=1) <= given_values, r[:, 0] >= 0])
    discs = force_program(scaled, none, coulomb.ConicSettings())
    r = scaled.unscale(discs.solve(scaled.q, given_values / scaled.force[::dim]))
    np.testing.assert_allclose(problem.by_contact(r), forces, atol=1e-4)
    assert energy(problem, r, problem.q) == pytest.approx(value, abs=1e-6)

    load = problem.by_contact(problem.q).copy()
    load[:, 0] += given_values
    value, forces = stated(
        problem,
        load.ravel(),
        lambda r: [cp.norm(r[:, 1:], axis=1) <= cp.multiply(problem.mu, r[:, 0]), r[:, 0] >= 0],
    )
    cones = force_program(scaled, scaled.mu, coulomb.ConicSettings())
    r = scaled.unscale(cones.solve(load.ravel() / scaled.length, none))
    np.testing.assert_allclose(problem.by_contact(r), forces, atol=1e-4)
    assert energy(problem, r, load.ravel()) == pytest.approx(value, abs=1e-6)


def test_a_program_is_updated_not_rebuilt():
    scaled = scale(problem_of(3, 3))
    program = force_program(scaled, scaled.mu, coulomb.ConicSettings())
    first = program.solve(scaled.q, np.zeros(4))
    program.solve(-scaled.q, np.zeros(4))
    np.testing.assert_allclose(program.solve(scaled.q, np.zeros(4)), first, atol=1e-9)


def without_strict_complementarity():
    """W = I and q on the boundary of the cone: r = -q is the answer, on its cone, with no multiplier."""
    q = -np.array([1.0, 0.3, 0.4, 2.0, 0.0, 1.0])
    return coulomb.CoulombProblem(np.eye(6), q, 0.5, 3)


def test_interior_point_answers_stall_and_the_polish_does_not():
    problem = without_strict_complementarity()
    scaled = scale(problem)
    errors, polished = [], []
    for tol in (1e-6, 1e-8, 1e-10, 1e-13):
        program = force_program(scaled, scaled.mu, coulomb.ConicSettings(tol=tol, regularisation=0.0))
        try:
            r = program.solve(scaled.q, np.zeros(2))
        except ProgramError:
            continue
        better = polished_force(scaled, ConeMap(), r, scaled.q, 4)
        errors.append((tol, np.linalg.norm(r + scaled.q)))
        polished.append(np.linalg.norm(better + scaled.q))
    assert len(errors) >= 3
    # asked for tol, it is off by about its root
    assert all(error > 10 * tol for tol, error in errors)
    assert max(polished) < 1e-12
    assert coulomb.solve(problem, coulomb.Limits(tol=1e-13)).residual() <= 1e-13


class Claims:
    """A solver that only claims."""

    def __init__(self):
        self.asked = []

    def solve(self, program, accuracy, last=None):
        self.asked.append(accuracy.tolerance)
        return ConicSolution(program, np.zeros(2), {}, Claim.ALMOST, 1, Timing()), None


def test_almost_solved_is_never_accepted():
    scaled = scale(coulomb.CoulombProblem(np.eye(2), [-1.0, 0.0], 0.3, 2))
    program = force_program(scaled, scaled.mu, coulomb.ConicSettings(tol=1e-9))
    program.solver = claims = Claims()
    with pytest.raises(ProgramError, match="almost solved at 1e-07"):
        program.solve(scaled.q, np.zeros(1))
    assert claims.asked == pytest.approx([1e-9, 1e-7])


def test_an_unbounded_force_program_is_infeasible_in_words():
    # pressed together without any give: nothing opens
    rigid = coulomb.CoulombProblem(np.diag([0.0, 1.0]), [-1.0, 0.0], 0.3, 2)
    scaled = scale(rigid)
    with pytest.raises(InfeasibleProgram, match="unbounded"):
        force_program(scaled, scaled.mu, coulomb.ConicSettings(regularisation=0.0)).solve(scaled.q, np.zeros(1))


def test_a_force_program_found_unbounded_at_the_looser_tolerance_is_infeasible_in_words():
    class Late:
        """Stops without an answer first, and finds a ray when asked for less."""

        def solve(self, program, accuracy, last=None):
            raise ProgramError("stopped") if accuracy.tolerance < 1e-8 else UnboundedProgram("a ray", np.ones(2))

    scaled = scale(coulomb.CoulombProblem(np.eye(2), [-1.0, 0.0], 0.3, 2))
    program = force_program(scaled, scaled.mu, coulomb.ConicSettings(tol=1e-9))
    program.solver = Late()
    with pytest.raises(InfeasibleProgram, match="forces meet no resistance"):
        program.solve(scaled.q, np.zeros(1))


def test_the_associated_relaxation_opens_by_sliding():
    # one contact, pressed by 1 and dragged by 2 at mu = 0.5
    problem = coulomb.CoulombProblem(np.eye(2), [-1.0, -2.0], 0.5, 2)
    relaxed = coulomb.solve_associated(problem)
    # projection of -q = (1, 2) on |r_t| <= r_n/2: along (1, 1/2), length (1 + 1)/1.25
    np.testing.assert_allclose(relaxed.r, [1.6, 0.8], atol=1e-12)
    assert relaxed.residual() < 1e-12
    assert relaxed.dilatancy() == pytest.approx(0.6)
    assert coulomb.residual(problem, relaxed.r) > 0.1
    np.testing.assert_allclose(coulomb.solve(problem).r, [1.0, 0.5], atol=1e-9)
    smooth = coulomb.CoulombProblem(problem.W, problem.q, 0.0, 2)
    np.testing.assert_allclose(coulomb.solve_associated(smooth).r, coulomb.solve(smooth).r, atol=1e-9)
    with pytest.raises(SceneError, match="asymmetry"):
        coulomb.solve_associated(coulomb.CoulombProblem([[1.0, 0.5], [0.0, 1.0]], [-1.0, 0.0], 0.1, 2))


FUNCTIONS = [AlartCurnier(), AlartCurnier(2.0), NaturalMap(), NaturalMap(0.5), ConeMap(), TrescaMap(np.full(6, 0.7))]


@given(st.integers(0, 10_000), st.sampled_from([2, 3]), st.sampled_from(FUNCTIONS))
def test_derivatives_agree_with_finite_differences(seed, dim, function):
    rng = np.random.default_rng(seed)
    r, u = rng.normal(size=(6, dim)), rng.normal(size=(6, dim))
    mu, h = rng.uniform(0.1, 1.5, 6), 1e-6
    rows = function.linearise(r, u, mu)
    np.testing.assert_allclose(rows.value, function.value(r, u, mu), atol=1e-14)
    dr, du = rng.normal(size=r.shape), rng.normal(size=u.shape)
    ahead = function.linearise(r + h * dr, u + h * du, mu)
    behind = function.linearise(r - h * dr, u - h * du, mu)
    expected = np.einsum("cij,cj->ci", rows.dr, dr) + np.einsum("cij,cj->ci", rows.du, du)
    measured = (ahead.value - behind.value) / (2 * h)
    # a contact within h of a kink has no derivative to compare
    smooth = np.max(np.abs(ahead.dr - behind.dr), axis=(1, 2)) < 1e-2
    np.testing.assert_allclose(measured[smooth], expected[smooth], atol=1e-5)


@given(st.integers(0, 1000))
def test_anderson_solves_a_linear_fixed_point_in_as_many_steps_as_unknowns(seed):
    rng = np.random.default_rng(seed)
    G, b = rng.normal(size=(3, 3)) * 0.3, rng.normal(size=3)
    mixing, memory, x = coulomb.Anderson(depth=3, weight=1.0, growth=1e12), Past(), np.zeros(3)
    for _ in range(6):
        memory, x = mixing.advance(memory, x, G @ x + b)
    np.testing.assert_allclose(x, np.linalg.solve(np.eye(3) - G, b), rtol=1e-5, atol=1e-7)


def test_the_safeguard_drops_the_memory_after_a_bad_step():
    mixing = coulomb.Anderson(weight=0.5, growth=2.0)
    memory, x = mixing.advance(Past(), np.array([0.0]), np.array([1.0]))
    memory, x = mixing.advance(memory, x, x + 0.4)
    assert len(memory.points) == 2
    memory, after = mixing.advance(memory, x, x + 10.0)
    assert len(memory.points) == 1
    np.testing.assert_allclose(after, x + 5.0)


@pytest.mark.parametrize("solver", [coulomb.TrescaFixedPoint, coulomb.DeSaxceFixedPoint])
def test_the_programs_of_a_fixed_point_end_at_it_without_their_polish(solver, monkeypatch):
    """That W is not symmetric is a load in them, and the multiple of I that is added to W cancels."""
    rng = np.random.default_rng(3)
    root, other = rng.normal(size=(6, 6)), rng.normal(size=(6, 6))
    problem = coulomb.CoulombProblem(root @ root.T + np.eye(6) + other - other.T, rng.normal(size=6), 0.3, 3)
    answer = coulomb.solve(problem)
    assert (answer.r != 0).any()
    scaled = scale(problem)
    settled = answer.r / scaled.force
    monkeypatch.setattr("bipot.coulomb.fixed_point.polished_force", lambda problem, law, r, load: r)
    chosen = solver(coulomb.Damped(), coulomb.ConicSettings(regularisation=1e-2))
    step = chosen.step(scaled, chosen.init(scaled, settled))
    np.testing.assert_allclose(step.r, settled, atol=1e-4 * np.abs(settled).max())
