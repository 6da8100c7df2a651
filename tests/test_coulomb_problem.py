"""Problems, their files and their measures: closed forms, planted errors, the storage layouts of FCLIB."""

import os
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse

from bipot import coulomb
from bipot.errors import SceneError
from bipot.laws.coulomb import Status, de_saxce_shift

GENERATED = Path(__file__).parent / "data" / "fclib"
REAL = Path(os.environ.get("FCLIB_PROBLEMS", Path(__file__).parents[2] / "shared" / "fclib" / "problems"))
FILES = sorted(GENERATED.glob("*.hdf5"))


def one_contact(q, mu=0.5):
    return coulomb.CoulombProblem(W=np.eye(len(q)), q=q, mu=mu, dim=len(q))


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"mu": -0.1}, "mu"),
        ({"mu": np.inf}, "mu"),
        ({"dim": 4}, "dim"),
        ({"q": [1.0]}, r"q\.shape"),
        ({"q": [np.nan, 1.0]}, "q"),
        ({"W": np.ones((2, 3))}, "W.shape"),
        ({"W": np.full((2, 2), np.inf)}, "W"),
        ({"W": np.eye(3), "q": np.zeros(3)}, "contact rows"),
    ],
)
def test_bad_problems_are_refused_by_name(change, named):
    with pytest.raises(SceneError, match=named):
        coulomb.CoulombProblem(**{"W": np.eye(2), "q": [1.0, 2.0], "mu": 0.3, "dim": 2, **change})


def test_a_problem_keeps_its_own_arrays():
    W, q = sparse.csr_array(np.eye(2)), np.array([1.0, 2.0])
    problem = coulomb.CoulombProblem(W=W, q=q, mu=0.3, dim=2)
    W.data[0], q[0] = 5.0, 5.0
    np.testing.assert_array_equal(problem.velocity(np.ones(2)), [2.0, 3.0])
    for array in (problem.W.data, problem.q, problem.mu):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 5.0


def test_reduction_agrees_with_the_dense_formula():
    rng = np.random.default_rng(0)
    root, H = rng.normal(size=(7, 7)), rng.normal(size=(7, 6))
    M, f, w = root @ root.T + np.eye(7), rng.normal(size=7), rng.normal(size=6)
    bodies = coulomb.GlobalCoulombProblem(M=M, H=H, f=f, w=w, mu=0.3, dim=3)
    local = bodies.reduced()
    np.testing.assert_allclose(local.W.toarray(), H.T @ np.linalg.inv(M) @ H, atol=1e-12)
    r = rng.normal(size=6)
    np.testing.assert_allclose(local.velocity(r), H.T @ bodies.state(r) + w, atol=1e-11)


def test_symmetric_and_antisymmetric_parts_add_up():
    problem = coulomb.CoulombProblem(W=[[1.0, 2.0], [4.0, 3.0]], q=[1.0, 1.0], mu=0.1, dim=2)
    assert problem.asymmetry == pytest.approx(0.5)
    parts = problem.symmetric_part().toarray(), problem.antisymmetric_part().toarray()
    np.testing.assert_allclose(parts[0], parts[0].T)
    np.testing.assert_allclose(parts[1], -parts[1].T)
    np.testing.assert_allclose(sum(parts), problem.W.toarray())


def by_hand(problem, r, rho=1.0, length=1.0):
    """The natural map of the README, contact by contact, on the problem (rho W, q/length)."""
    W, q, r = rho * problem.W.toarray(), problem.q / length, r / (rho * length)
    u, d, total = W @ r + q, problem.dim, 0.0
    for c, mu in enumerate(problem.mu):
        rc, uc = r[d * c : d * c + d], u[d * c : d * c + d].copy()
        uc[0] += mu * np.linalg.norm(uc[1:])
        y = rc - uc
        size = np.linalg.norm(y[1:])
        if size <= mu * y[0]:
            projected = y
        elif mu * size <= -y[0]:
            projected = 0 * y
        else:
            height = (y[0] + mu * size) / (1 + mu**2)
            projected = np.r_[height, mu * height * y[1:] / size]
        total += np.sum((rc - projected) ** 2)
    return np.sqrt(total) / max(np.linalg.norm(q), np.linalg.norm(r), np.linalg.norm(u))


@given(st.integers(0, 10_000), st.sampled_from([2, 3]))
def test_residuals_agree_with_the_definition_by_hand(seed, dim):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3 * dim, 3 * dim))
    problem = coulomb.CoulombProblem(root @ root.T, rng.normal(size=3 * dim), rng.uniform(0.1, 1, 3), dim)
    r = rng.normal(size=3 * dim)
    length = np.linalg.norm(problem.q)
    assert coulomb.natural_residual(problem, r) == pytest.approx(by_hand(problem, r), rel=1e-9)
    unit_free = by_hand(problem, r, problem.force_scale, length)
    assert coulomb.unit_free_residual(problem, r) == pytest.approx(unit_free, rel=1e-9)


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
def test_the_unit_free_residual_does_not_know_units(force, length):
    rng = np.random.default_rng(1)
    root, q, r = rng.normal(size=(6, 6)), rng.normal(size=6), rng.normal(size=6)
    base = coulomb.CoulombProblem(root @ root.T, q, 0.4, 3)
    other = coulomb.CoulombProblem(root @ root.T * (length / force), q * length, 0.4, 3)
    expected = coulomb.unit_free_residual(base, r)
    assert coulomb.unit_free_residual(other, r * force) == pytest.approx(expected, rel=1e-9)


def answer(problem, r):
    return coulomb.CoulombSolution(problem, np.array(r), coulomb.Outcome.CONVERGED, "planted", "", 0, 0.0)


def test_planted_errors_are_measured_at_their_size():
    # exact: r = (1, 0.5), u = (0, -2): sliding backwards at mu = 0.5
    exact = answer(one_contact([-1.0, -2.5]), [1.0, 0.5])
    assert max(exact.residual(), exact.cone_violation(), exact.dual_cone_violation()) < 1e-15
    assert exact.bipotential_gap() == pytest.approx(0.0, abs=1e-15)
    outside = answer(exact.problem, [1.0, 0.7])
    assert outside.cone_violation() == pytest.approx(0.2)
    closing = answer(exact.problem, [0.9, 0.45])
    assert closing.dual_cone_violation() == pytest.approx(0.1)
    # mu r_n |u_t| + r_n u_n + r_t u_t = 0.5*1.0*1.6 + 0 + 0.9*(-1.6) for the wrong tangential force
    wrong = answer(exact.problem, [1.0, 0.9])
    assert wrong.bipotential_gap() == pytest.approx(abs(0.5 * 1.6 - 0.9 * 1.6))


@given(st.integers(0, 10_000), st.sampled_from([2, 3]))
def test_the_natural_map_bounds_the_bipotential_gap(seed, dim):
    # the projection p = r - F has (r - rho v - p) . p = 0, v the shifted u: rho v . r = F . (r - F) + rho v . F
    rng = np.random.default_rng(seed)
    root, r = rng.normal(size=(3 * dim, 3 * dim)), rng.normal(size=3 * dim)
    problem = coulomb.CoulombProblem(root @ root.T, rng.normal(size=3 * dim), rng.uniform(0.1, 1, 3), dim)
    measured, rho = answer(problem, r), problem.force_scale
    u, q = np.linalg.norm(measured.u), np.linalg.norm(problem.q)
    F = measured.unit_free_residual() * max(rho * q, np.linalg.norm(r), rho * u)
    bound = F * (np.linalg.norm(r) + F + rho * np.linalg.norm(de_saxce_shift(by(measured.u, dim), problem.mu)))
    assert measured.bipotential_gap() <= bound / rho * (1 + 1e-12)


def by(vector, dim):
    return vector.reshape(-1, dim)


def test_status_of_each_contact():
    problem = coulomb.CoulombProblem(np.eye(6), [-1.0, 0.2, 1.0, 3.0, -1.0, 2.0], 0.5, 2)
    exact = answer(problem, [1.0, -0.2, 0.0, 0.0, 1.0, -0.5])
    assert exact.residual() < 1e-15
    assert exact.status().tolist() == [Status.STICK, Status.OPEN, Status.SLIP]
    assert answer(problem, [1.0, -0.2, 0.0, 0.0, 1.0, -0.2]).status()[2] == Status.UNDECIDED


@pytest.mark.parametrize("noise", [0.0, 1e-11])
def test_contacts_that_all_stick_are_told_so(noise):
    """Their velocities are what a solver leaves of them, and none is a slip; an open contact afar changes nothing."""
    near = coulomb.CoulombProblem(np.eye(4), [-1.0, 0.2, -1.0, -0.1], 0.5, 2)
    assert answer(near, [1.0, -0.2 + noise, 1.0 - noise, 0.1]).status().tolist() == [Status.STICK] * 2
    assert (coulomb.solve(near).status() == Status.STICK).all()
    beside = coulomb.CoulombProblem(np.eye(6), [-1.0, 0.2, 1e12, 0.0, -1.0, 0.7], 0.5, 2)
    found = answer(beside, [1.0, -0.2, 0.0, 0.0, 1.0, -0.5]).status().tolist()
    assert found == [coulomb.Status.STICK, coulomb.Status.OPEN, coulomb.Status.SLIP]


def test_a_converged_answer_of_zero_load_does_not_divide_by_zero():
    still = answer(one_contact([0.0, 0.0]), [0.0, 0.0])
    assert (still.residual(), still.bipotential_gap()) == (0.0, 0.0)


def stored(path, layout, matrix):
    """A local file with its matrix in the given layout, written by hand."""
    with h5py.File(path, "w") as file:
        group = file.create_group("fclib_local")
        group["spacedim"], group["vectors/q"], group["vectors/mu"] = [2], [1.0, 2.0], [0.3]
        W = group.create_group("W")
        W["m"], W["n"], W["nz"] = [2], [2], [layout["nz"]]
        for key in "pix":
            W[key] = layout[key]
        W["nzmax"] = [len(layout["x"])]
    return coulomb.read_fclib(path)


MATRIX = np.array([[5.0, 7.0], [0.0, 2.0]])
LAYOUTS = [
    # two entries add to 5, and what lies beyond nz is not read
    {"nz": 4, "i": [0, 0, 0, 1, 1], "p": [0, 0, 1, 1, 0], "x": [4.0, 1.0, 7.0, 2.0, 99.0]},
    {"nz": -1, "p": [0, 1, 3], "i": [0, 0, 1], "x": [5.0, 7.0, 2.0]},
    {"nz": -2, "p": [0, 2, 3], "i": [0, 1, 1], "x": [5.0, 7.0, 2.0]},
]


@pytest.mark.parametrize("layout", LAYOUTS, ids=["triplets", "columns", "rows"])
def test_every_matrix_layout_is_read(tmp_path, layout):
    problem = stored(tmp_path / "a.hdf5", layout, MATRIX)
    assert isinstance(problem, coulomb.CoulombProblem)
    np.testing.assert_array_equal(problem.W.toarray(), MATRIX)


def test_unknown_layouts_and_files_are_refused(tmp_path):
    with pytest.raises(coulomb.FclibError, match="nz = -3"):
        stored(tmp_path / "a.hdf5", {**LAYOUTS[2], "nz": -3}, MATRIX)
    (tmp_path / "text.hdf5").write_text("not a file of this kind")
    for read in (coulomb.read_fclib, coulomb.read_solution):
        with pytest.raises(coulomb.FclibError, match=r"text\.hdf5"):
            read(tmp_path / "text.hdf5")
    with pytest.raises(coulomb.FclibError, match=r"W/nz: its shape = \(1, 0\): must be \(1,\)"):
        stored(tmp_path / "b.hdf5", {**LAYOUTS[2], "nz": []}, MATRIX)
    with h5py.File(tmp_path / "empty.hdf5", "w"):
        pass
    with pytest.raises(coulomb.FclibError, match="fclib_local"):
        coulomb.read_fclib(tmp_path / "empty.hdf5")
    bodies = coulomb.GlobalCoulombProblem(np.eye(2), np.eye(2), np.ones(2), np.ones(2), 0.3, 2)
    coulomb.write_fclib(tmp_path / "g.hdf5", bodies)
    with h5py.File(tmp_path / "g.hdf5", "a") as file:
        file.create_group("fclib_global/G")
    with pytest.raises(coulomb.FclibError, match="bilateral"):
        coulomb.read_fclib(tmp_path / "g.hdf5")


def test_write_then_read_returns_the_problem(tmp_path):
    rng = np.random.default_rng(2)
    local = coulomb.CoulombProblem(sparse.random_array((6, 6), density=0.5, rng=rng), rng.normal(size=6), [0.1, 0.2], 3)
    u, r = rng.normal(size=6), rng.normal(size=6)
    coulomb.write_fclib(tmp_path / "l.hdf5", local, title="a title", solution={"u": u, "r": r})
    back = coulomb.read_fclib(tmp_path / "l.hdf5")
    assert isinstance(back, coulomb.CoulombProblem)
    np.testing.assert_array_equal(back.W.toarray(), local.W.toarray())
    np.testing.assert_array_equal(np.r_[back.q, back.mu, back.dim], np.r_[local.q, local.mu, local.dim])
    np.testing.assert_array_equal(coulomb.read_solution(tmp_path / "l.hdf5")["r"], r)
    bodies = coulomb.GlobalCoulombProblem(3 * np.eye(4), rng.normal(size=(4, 2)), rng.normal(size=4), u[:2], 0.3, 2)
    coulomb.write_fclib(tmp_path / "g.hdf5", bodies)
    again = coulomb.read_fclib(tmp_path / "g.hdf5")
    assert isinstance(again, coulomb.GlobalCoulombProblem)
    np.testing.assert_allclose(again.reduced().W.toarray(), bodies.reduced().W.toarray(), rtol=1e-15)
    assert coulomb.read_solution(tmp_path / "g.hdf5") == {}


def test_our_files_have_the_entries_of_files_written_by_others(tmp_path):
    mine, other = tmp_path / "mine.hdf5", FILES[0]
    coulomb.write_fclib(mine, coulomb.reduced(coulomb.read_fclib(other)))
    with h5py.File(mine) as a, h5py.File(other) as b:
        names, kinds = {}, {}
        for file, store in ((a, names), (b, kinds)):
            file.visititems(lambda name, item, store=store: store.update({name: getattr(item, "dtype", None)}))
        for name, kind in kinds.items():
            assert name in names
            assert kind is None or kind.kind == names[name].kind


@pytest.mark.skipif(not REAL.is_dir(), reason=f"no folder of FCLIB problems at {REAL} (set FCLIB_PROBLEMS)")
def test_every_real_file_is_read():
    problems = [coulomb.read_fclib(path) for path in sorted(REAL.glob("*.hdf5"))]
    assert len(problems) >= 41
    assert {problem.dim for problem in problems} == {2, 3}
    assert {type(problem) for problem in problems} == {coulomb.CoulombProblem, coulomb.GlobalCoulombProblem}
