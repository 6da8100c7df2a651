"""Solvers against each other, on problems of files, and against their own claims."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from bipot import coulomb
from bipot.coulomb import solver as solving
from bipot.coulomb.gauss_seidel import colouring, neighbours
from bipot.coulomb.newton import _levenberg_direction, newton_direction
from bipot.coulomb.solver import scale
from bipot.errors import SceneError

GENERATED = sorted((Path(__file__).parent / "data" / "fclib").glob("*.hdf5"))
REAL = Path(os.environ.get("FCLIB_PROBLEMS", Path(__file__).parents[2] / "shared" / "fclib" / "problems"))
SMALL = sorted(path for path in REAL.glob("*.hdf5") if path.stat().st_size < 20_000)
HARDEST = "wall_mu0p3-00060-nc209"
FINE = coulomb.Limits(tol=1e-12, seconds=10.0)


SOLVERS = [
    coulomb.ProximalPoint(),
    coulomb.ProximalPoint(coulomb.NaturalMap()),
    coulomb.Newton(levenberg=1e-4),
    coulomb.Newton(coulomb.NaturalMap(), levenberg=1e-4),
    coulomb.TrescaFixedPoint(),
    coulomb.TrescaFixedPoint(coulomb.Damped(0.7)),
    coulomb.DeSaxceFixedPoint(),
    coulomb.GaussSeidel(),
    coulomb.GaussSeidel(local=1, relaxation=0.9),
    coulomb.Uzawa(),
    coulomb.Uzawa(corrector=False),
]


def well_posed(seed, dim, skew):
    """Well conditioned, little friction: one solution."""
    rng = np.random.default_rng(seed)
    n = 4 * dim
    root, twist = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    W = 2 * np.eye(n) + 0.05 * (root @ root.T) + skew * (twist - twist.T)
    return coulomb.CoulombProblem(W, rng.normal(size=n), rng.choice([0.0, 0.1, 0.2], size=4), dim)


@settings(max_examples=6)
@given(st.integers(0, 10_000), st.sampled_from([2, 3]), st.sampled_from([0.0, 0.05]))
def test_all_solvers_agree_where_the_solution_is_unique(seed, dim, skew):
    problem = well_posed(seed, dim, skew)
    reference = coulomb.solve(problem, FINE)
    assert reference.converged
    for solver in SOLVERS:
        answer = coulomb.run(solver, problem, coulomb.Limits(tol=1e-9, seconds=10.0))
        assert answer.converged, answer.reason
        np.testing.assert_allclose(answer.r, reference.r, atol=1e-7, err_msg=solver.name)


@settings(max_examples=10)
@given(st.integers(0, 10_000), st.sampled_from([2, 3]))
def test_status_does_not_change_with_the_units(seed, dim):
    problem = well_posed(seed, dim, 0.0)
    small = coulomb.CoulombProblem(problem.W * 1e-9, problem.q * 1e-3, problem.mu, dim)
    np.testing.assert_array_equal(coulomb.solve(problem, FINE).status(1e-7), coulomb.solve(small, FINE).status(1e-7))


@pytest.mark.parametrize("path", [path for path in GENERATED if path.stem != HARDEST], ids=lambda path: path.stem)
def test_generated_problems_are_solved(path):
    problem = coulomb.reduced(coulomb.read_fclib(path))
    answer = coulomb.solve(problem)
    assert answer.converged, answer.reason
    assert max(coulomb.natural_residual(problem, answer.r), coulomb.unit_free_residual(problem, answer.r)) <= 1e-10


@pytest.mark.slow
def test_the_hardest_generated_problem_is_solved():
    answer = coulomb.solve(coulomb.reduced(coulomb.read_fclib(GENERATED[0].with_stem(HARDEST))))
    assert answer.converged, answer.reason


@pytest.mark.skipif(not SMALL, reason=f"no folder of FCLIB problems at {REAL} (set FCLIB_PROBLEMS)")
def test_small_real_problems_are_solved():
    assert len(SMALL) >= 15
    answers = [coulomb.solve(coulomb.reduced(coulomb.read_fclib(path))) for path in SMALL]
    assert [path.stem for path, answer in zip(SMALL, answers, strict=True) if not answer.converged] == []


def test_a_slow_solver_keeps_the_time_limit_and_says_so():
    problem = coulomb.reduced(coulomb.read_fclib(GENERATED[0]))
    answer = coulomb.run(coulomb.Uzawa(), problem, coulomb.Limits(tol=1e-12, seconds=0.3))
    assert answer.outcome is coulomb.Outcome.TIME_LIMIT
    assert answer.seconds < 3.0
    assert f"{answer.residual():.1e}" in answer.reason


@given(st.integers(0, 1000), st.floats(0.01, 0.3))
def test_contacts_of_one_colour_do_not_touch(seed, density):
    W = sparse.csr_array(sparse.random_array((30, 30), density=density, rng=np.random.default_rng(seed)))
    touching = neighbours(W, 3)
    colour = colouring(touching)
    i, j = touching.nonzero()
    assert np.all(colour >= 0)
    assert np.all((colour[i] != colour[j]) | (i == j))


@pytest.mark.parametrize("direction", [newton_direction, _levenberg_direction])
def test_dense_and_sparse_algebra_give_the_same_step(direction, monkeypatch):
    problem = coulomb.reduced(coulomb.read_fclib(GENERATED[6]))
    rng = np.random.default_rng(0)
    r = np.where(rng.random(problem.size) < 0.3, 0.0, rng.normal(size=problem.size))
    steps = []
    for rows in (10_000, 0):
        monkeypatch.setattr(solving, "DENSE_ROWS", rows)
        scaled = scale(problem)
        assert (scaled.blocks is None) == (rows > 0)
        lines = coulomb.AlartCurnier().linearise(scaled.by_contact(r), scaled.by_contact(scaled.velocity(r)), scaled.mu)
        assert 0 < np.sum(np.any(lines.du != 0, axis=(1, 2))) < problem.contacts
        steps.append(direction(scaled, lines, 1e-3))
    np.testing.assert_allclose(steps[0], steps[1], rtol=1e-7, atol=1e-7 * np.abs(steps[0]).max())


@pytest.mark.parametrize(
    "make",
    [
        lambda: coulomb.Limits(tol=0.0),
        lambda: coulomb.Limits(seconds=-1.0),
        lambda: coulomb.GaussSeidel(relaxation=2.0),
        lambda: coulomb.ProximalPoint(accuracy=1.0),
        lambda: coulomb.ProximalPoint(cautious=100.0),
        lambda: coulomb.Newton(levenberg=-1.0),
        lambda: coulomb.LineSearch(0),
        lambda: coulomb.AlartCurnier(step=0.0),
        lambda: coulomb.Damped(0.0),
        lambda: coulomb.Anderson(depth=0),
        lambda: coulomb.ConicSettings(tol=1.0),
        lambda: coulomb.Uzawa(passes=0),
    ],
)
def test_solver_settings_outside_their_range_are_refused(make):
    with pytest.raises(SceneError, match="must be"):
        make()


def test_relaxed_forces_stay_in_their_cones():
    problem = coulomb.CoulombProblem(np.eye(3) + 0.5, [-1.0, 2.0, 0.3], 0.3, 3)
    solver = coulomb.GaussSeidel(local=1, relaxation=1.9, sweeps=1)
    scaled = scale(problem)
    state = solver.init(scaled, np.array([1.0, 0.3, 0.0]))
    for _ in range(5):
        state = solver.step(scaled, state)
        assert np.hypot(*state.r[1:]) <= 0.3 * state.r[0] + 1e-12


def test_solve_without_time_returns_an_honest_answer():
    problem = coulomb.reduced(coulomb.read_fclib(GENERATED[0].with_stem(HARDEST)))
    answer = coulomb.solve(problem, coulomb.Limits(seconds=0.2))
    assert not answer.converged
    assert answer.solver == "auto"
    assert "more time" in answer.reason
    # On a busy machine not even one iteration may have had time.
    nothing = coulomb.residual(problem, np.zeros(problem.size))
    assert answer.residual() < nothing or (answer.iterations == 0 and answer.residual() == nothing)


def test_a_chain_that_ends_without_an_answer_says_whether_it_had_time():
    problem = coulomb.CoulombProblem(np.eye(3), [-1.0, 0.2, 0.1], 0.3, 3)
    tried = coulomb.solve(problem, coulomb.Limits(iterations=0))
    assert tried.outcome is coulomb.Outcome.ITERATION_LIMIT
    assert "No time" not in tried.reason
    late = coulomb.solve(problem, coulomb.Limits(seconds=1e-12))
    assert late.outcome is coulomb.Outcome.TIME_LIMIT
    assert late.reason.startswith("No time was left to try a solver in 1.0e-12 s")
    assert late.iterations == tried.iterations == 0


def test_forces_that_run_away_until_they_overflow_are_no_warning_and_no_answer():
    """Nothing resists the normal force; Python's warnings are errors here."""
    problem = coulomb.CoulombProblem([[0.0, 0.0], [0.0, 1.0]], [-1.0, 0.0], 0.3, 2)
    answer = coulomb.run(coulomb.Uzawa(), problem)
    assert not answer.converged
    assert np.isfinite(answer.r).all()
