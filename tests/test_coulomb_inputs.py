"""What is no problem, force, solver or setting of the discrete library is refused by name when it is given."""

import numpy as np
import pytest

from bipot import coulomb
from bipot.errors import SceneError
from tests.scenes import refused

PROBLEM = coulomb.CoulombProblem(np.eye(2), [-1.0, 0.1], 0.3, 2)
GLOBAL = coulomb.GlobalCoulombProblem(np.eye(2), np.eye(2), [-1.0, 0.1], [0.0, 0.0], 0.3, 2)
JUNK = (None, "a", 1.5, True, [], {}, np.zeros(2), coulomb.CoulombProblem)

ASKED = (
    coulomb.existence,
    coulomb.multiplicity,
    coulomb.enumerate_modes,
    coulomb.solve_associated,
    coulomb.solve,
    coulomb.reduced,
    lambda problem: coulomb.run(coulomb.ProximalPoint(), problem),
    lambda problem: coulomb.residual(problem, np.zeros(2)),
    lambda problem: coulomb.write_fclib("nowhere.hdf5", problem),
)


@pytest.mark.parametrize("asked", ASKED)
def test_what_is_no_problem_is_refused(asked):
    for junk in JUNK:
        refused(lambda junk=junk: asked(junk), "problem = .*: must be a CoulombProblem")


@pytest.mark.parametrize("measure", [coulomb.residual, coulomb.natural_residual, coulomb.unit_free_residual])
@pytest.mark.parametrize(
    ("force", "words"),
    [
        ("a", "r = 'of type <U1': must be numbers"),
        (None, "r = 'of type object'"),
        ([None, 1.0], "r = 'of type object'"),
        ([1j, 0.0], "r = 'of type complex128'"),
        ([[1.0], [1.0, 2.0]], "r: must be an array of numbers"),
        (1.0, r"r.shape = \(\): must be \(2,\)"),
        ((1.0, 2.0, 3.0), r"r.shape = \(3,\): must be \(2,\)"),
        (np.zeros((1, 2)), r"r.shape = \(1, 2\)"),
        ([1.0, np.nan], "r = 'a force with NaN or inf': must be finite"),
        ([np.inf, 0.0], "r = 'a force with NaN or inf'"),
    ],
)
def test_what_is_no_force_is_not_measured(measure, force, words):
    refused(lambda: measure(PROBLEM, force), words)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"q": [[-1.0, 0.1]]}, r"q.shape = \(1, 2\): must be \(2,\)"),
        ({"q": [[-1.0], [0.1]]}, r"q.shape = \(2, 1\): must be \(2,\)"),
        ({"q": [-1.0]}, r"q.shape = \(1,\): must be \(2,\)"),
        ({"q": np.ma.masked_array([-1.0, 0.1], [True, False])}, "q = 'with masked values': must be numbers throughout"),
        ({"mu": np.ma.masked}, "mu = 'with masked values': must be numbers throughout"),
        ({"mu": [[0.3]]}, r"mu.shape = \(1, 1\): must be \(1,\)"),
        ({"W": np.ma.masked_array(np.eye(2), np.eye(2))}, "W = 'with masked values'"),
    ],
)
def test_numbers_of_another_shape_or_masked_are_refused(given, words):
    asked = {"W": np.eye(2), "q": [-1.0, 0.1], "mu": 0.3, "dim": 2} | given
    refused(lambda: coulomb.CoulombProblem(**asked), words)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"q": [-1e-200, 0.0]}, "largest number of q = 1e-200: must be of a magnitude from 1e-60"),
        ({"q": [1e61, 0.0]}, "largest number of q = 1e.61: must be of a magnitude"),
        ({"W": 1e-300 * np.eye(2)}, "largest entry of W = 1e-300: must be of a magnitude"),
        ({"W": 1e90 * np.eye(2)}, "largest entry of W = 1e.90: must be of a magnitude"),
        (
            {"W": np.diag([1.0, 1.0, 1e-90, 1e-90]), "q": np.ones(4)},
            "mean diagonal of W at contact 1 = .*e-9",
        ),
        ({"mu": 1e61}, "mu = 1e.61: must be <= 1e.60"),
    ],
)
def test_units_in_which_squares_vanish_or_overflow_are_refused(given, words):
    """A load of 1e-200 was called solved by no force, and forces of 1e300 ended in NaN."""
    refused(lambda: coulomb.CoulombProblem(**({"W": np.eye(2), "q": [-1.0, 0.1], "mu": 0.3, "dim": 2} | given)), words)


@pytest.mark.parametrize("compliance", [1e-59, 1e59])
@pytest.mark.parametrize("load", [1e-59, 1e59])
def test_all_other_units_are_taken_by_every_stage(compliance, load):
    """Two contacts on one degree of freedom: the first stage fails, and the next begins at forces of up to 1e118."""
    W = np.kron(np.ones((2, 2)), np.eye(2)) * compliance
    problem = coulomb.CoulombProblem(W, np.array([-1.0, 0.4, -1.0, 0.4]) * load, 0.3, 2)
    chain = (
        coulomb.Stage(coulomb.Uzawa(passes=1), 1.0, warm=True),
        coulomb.Stage(coulomb.ProximalPoint(), 1.0, warm=True),
    )
    answer = coulomb.solve(problem, coulomb.Limits(patience=2, iterations=60), chain=chain)
    assert answer.converged
    np.testing.assert_allclose(answer.r[::2].sum(), load / compliance, rtol=1e-9)
    assert answer.natural_residual() < np.inf
    assert answer.unit_free_residual() < 1e-9
    assert coulomb.Status.SLIP in answer.status()


def test_forces_are_measured_however_they_are_written():
    assert coulomb.residual(PROBLEM, [1, 0]) == coulomb.residual(PROBLEM, np.array([1.0, 0.0]))
    assert coulomb.residual(PROBLEM, np.full(2, 1e300)) == np.inf
    refused(lambda: GLOBAL.state("a"), "r = 'of type <U1': must be numbers")


@pytest.mark.parametrize("read", [coulomb.read_fclib, coulomb.read_solution])
def test_what_is_no_path_is_not_read(read):
    for junk in (None, b"x", 1, [], {}, np.zeros(2)):
        refused(lambda junk=junk: read(junk), "path = .*: must be a path")
    refused(lambda: read("nowhere.hdf5", largest=1.5), "largest = 1.5: must be a whole number")


def test_what_is_no_path_or_solution_is_not_written(tmp_path):
    refused(lambda: coulomb.write_fclib(None, PROBLEM), "path = None: must be a path")
    refused(lambda: coulomb.write_fclib(tmp_path / "a", PROBLEM, solution=3), "solution = 3: must be a Mapping or None")
    refused(lambda: coulomb.write_fclib(tmp_path / "a", PROBLEM, title=None), "title = None: must be a str")
    refused(lambda: coulomb.write_fclib(tmp_path / "a", PROBLEM, solution={"r": "a"}), r"solution\['r'\] = 'of type")
    assert not list(tmp_path.iterdir())


NUMBERS = {
    coulomb.AlartCurnier: ("step",),
    coulomb.NaturalMap: ("step",),
    coulomb.Damped: ("weight",),
    coulomb.Anderson: ("weight", "growth"),
    coulomb.GaussSeidel: ("relaxation",),
    coulomb.Newton: ("levenberg",),
    coulomb.ProximalPoint: ("weight", "accuracy", "relax", "cautious"),
    coulomb.ConicSettings: ("tol", "seconds", "regularisation"),
    coulomb.Limits: ("tol", "seconds"),
}
COUNTS = {
    coulomb.Anderson: ("depth",),
    coulomb.GaussSeidel: ("local", "sweeps"),
    coulomb.LineSearch: ("memory",),
    coulomb.ProximalPoint: ("memory",),
    coulomb.Uzawa: ("passes",),
    coulomb.Limits: ("iterations", "patience"),
}
OBJECTS = {
    coulomb.Newton: {"function": "a ContactFunction", "search": "a LineSearch"},
    coulomb.ProximalPoint: {"function": "a ContactFunction"},
    coulomb.TrescaFixedPoint: {"acceleration": "an Acceleration", "settings": "a ConicSettings"},
    coulomb.DeSaxceFixedPoint: {"acceleration": "an Acceleration", "settings": "a ConicSettings"},
    coulomb.Uzawa: {"corrector": "a bool"},
}


def each(table):
    return [(kind, field) for kind, fields in table.items() for field in fields]


@pytest.mark.parametrize(("kind", "field"), each(NUMBERS))
def test_settings_that_are_no_numbers_are_refused(kind, field):
    for junk in (None, "1", 1j, [], {}, True, np.zeros(2), np.array("q"), 10**400):
        refused(lambda junk=junk: kind(**{field: junk}), f"{field} = .*: must be (a number|one that a float can hold)")
    refused(lambda: kind(**{field: float("nan")}), f"{field} = nan: must be")


@pytest.mark.parametrize(("kind", "field"), each(COUNTS))
def test_settings_that_are_no_counts_are_refused(kind, field):
    for junk in (None, "1", 1.5, float("inf"), [], True, np.zeros(2), np.float64(2.0)):
        refused(lambda junk=junk: kind(**{field: junk}), f"{field} = .*: must be a whole number")
    refused(lambda: kind(**{field: 10**400}), f"{field} = 'a number of many digits': must be <=")


@pytest.mark.parametrize(("kind", "field"), each(OBJECTS))
def test_parts_of_solvers_are_refused_by_kind(kind, field):
    for junk in (None, "a", 1.5, [], coulomb.AlartCurnier, int):
        refused(lambda junk=junk: kind(**{field: junk}), f"{field} = .*: must be {OBJECTS[kind][field]}")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: coulomb.AlartCurnier(step=np.inf), "step = inf: must be finite and > 0"),
        (lambda: coulomb.ProximalPoint(relax=np.inf), "relax = inf: must be finite and > 1"),
        (lambda: coulomb.ProximalPoint(weight=np.inf), "weight = inf: must be finite and > 0"),
        (lambda: coulomb.Newton(levenberg=np.inf), "levenberg = inf: must be finite and >= 0"),
        (lambda: coulomb.ConicSettings(regularisation=np.inf), "regularisation = inf: must be finite"),
        (lambda: coulomb.Stage(3, 1.0, warm=True), "stage.solver = 3: must be a Solver"),
        (lambda: coulomb.Stage(coulomb.Uzawa, 1.0, warm=True), "stage.solver = .*: must be a Solver"),
        (lambda: coulomb.Stage(coulomb.Uzawa(), "a", warm=True), "stage.share = 'a': must be a number"),
        (lambda: coulomb.Stage(coulomb.Uzawa(), 1.5, warm=True), r"stage.share = 1.5: must be in \(0, 1\]"),
        (lambda: coulomb.Stage(coulomb.Uzawa(), 1.0, None), "stage.warm = None: must be a bool"),
        (lambda: coulomb.solve(PROBLEM, chain=(coulomb.Uzawa(),)), r"chain\[0\] = .*: must be a Stage"),
        (lambda: coulomb.run("newton", PROBLEM), "solver = 'newton': must be a Solver"),
        (lambda: coulomb.solve(PROBLEM, start="a"), "start = 'of type <U1': must be numbers"),
        (lambda: coulomb.solve(PROBLEM, start=[np.nan, 0.0]), "start = 'a force with NaN or inf'"),
        (lambda: coulomb.solve(PROBLEM, start=[1e200, 0.0]), "start = 'numbers up to .* of the load': must be at"),
        (lambda: coulomb.solve_associated(PROBLEM, 3), "settings = 3: must be a ConicSettings or None"),
        (lambda: coulomb.multiplicity(PROBLEM, starts=1.5), "starts = 1.5: must be a whole number"),
        (lambda: coulomb.multiplicity(PROBLEM, limits=3), "limits = 3: must be a Limits or None"),
        (lambda: coulomb.multiplicity(PROBLEM, apart="a"), "apart = 'a': must be a number"),
        (lambda: coulomb.enumerate_modes(PROBLEM, tol="a"), "tol = 'a': must be a number"),
        (lambda: coulomb.enumerate_modes(PROBLEM, tol=np.inf), "tol = inf: must be finite and > 0"),
        (lambda: coulomb.enumerate_modes(PROBLEM, apart="a"), "apart = 'a': must be a number"),
        (lambda: coulomb.enumerate_modes(PROBLEM, apart=np.nan), "apart = nan: must be >= 0"),
        (lambda: coulomb.solve(PROBLEM).status("a"), "tol = 'a': must be a number"),
        (lambda: coulomb.solve(PROBLEM).status(np.nan), "tol = nan: must be >= 0"),
        (lambda: coulomb.existence(PROBLEM, "a"), "seconds = 'a': must be a number"),
    ],
)
def test_what_is_asked_of_a_problem_is_refused_by_name(make, words):
    refused(make, words)


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.longdouble])
def test_scalars_of_numpy_solve_as_their_own_numbers_do(kind):
    chain = [
        coulomb.Stage(coulomb.ProximalPoint(coulomb.AlartCurnier(as_(kind(0.7))), as_(kind(0.3))), 1.0, warm=True)
        for as_ in (float, kind)
    ]
    one, other = (coulomb.solve(PROBLEM, coulomb.Limits(kind(1e-6)), chain=(stage,)) for stage in chain)
    assert chain[0] == chain[1]
    assert one.r.dtype == other.r.dtype == np.float64
    np.testing.assert_array_equal(one.r, other.r)


def test_one_solution_is_not_multiple():
    for report in (coulomb.enumerate_modes(PROBLEM), coulomb.multiplicity(PROBLEM)):
        assert len(report.solutions) == 1
        assert report.exhaustive
        assert not report.multiple
        assert not report.continuum


def test_a_solver_may_be_anyones():
    class Own:
        name = "own"

        def init(self, problem, r):
            return coulomb.Uzawa().init(problem, r)

        def step(self, problem, state):
            return coulomb.Uzawa().step(problem, state)

    assert coulomb.run(Own(), PROBLEM).converged
    with pytest.raises(SceneError, match=r"stage\.solver"):
        coulomb.Stage(Own, 1.0, warm=True)
