"""Conic solvers behind one interface: the same objective, residuals of our own, and nothing imported unasked."""

import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import clarabel
import numpy as np
import pytest
import scipy.sparse as sp

from bipot.conic.clarabel import Clarabel
from bipot.conic.problem import Cone, ConicProgram, Rows
from bipot.conic.qoco import Qoco
from bipot.conic.solver import LESS, Accuracy
from bipot.conic.through_cvxpy import BROUGHT, Cvxpy, cone_solvers
from bipot.errors import ProgramError, SceneError, StalledProgram
from bipot.forms import Dissipation, FormName
from bipot.marching import Control, Schedule, march
from bipot.paper import upsetting
from bipot.programs.data import Term
from studies.solvers import compared, recorded
from tests.scenes import posed, refused

TIGHT = Accuracy(1e-11)


@pytest.mark.parametrize("form", [FormName.TANGENT, FormName.DISSIPATION])
def test_all_solvers_find_one_objective_and_pass_our_residuals(form):
    """On ten programs of an upsetting."""
    for row in compared(recorded(form, 2, 3), form.value):
        bound = 1e-4 if row.solver == "cvxpy:scs" else 1e-7
        assert row.programs == 10
        assert row.objective < bound
        assert row.error < bound


def test_the_error_of_a_solution_is_that_of_its_worst_part():
    answer, _ = Clarabel().solve(posed(0.3).dissipation.conic(), TIGHT)
    force = {**answer.dual, Term.GAP: 1.01 * answer.dual[Term.GAP]}
    assert answer.error() < 1e-9
    assert replace(answer, dual=force).error() > 1e-4
    assert replace(answer, x=1.001 * answer.x).error() > 1e-4


@pytest.mark.parametrize("solver", [Cvxpy(), Cvxpy("SCS"), Qoco()], ids=str)
def test_programs_without_a_statement_are_stated_by_their_data(solver):
    program = posed(0.3).dissipation.conic()
    bare = replace(program, statement=None)
    accuracy = Accuracy(1e-6, 100_000)
    stated, bare = (solver.solve(given, accuracy)[0] for given in (program, bare))
    assert program.cost(bare.x) == pytest.approx(program.cost(stated.x), rel=1e-4)
    assert bare.error() < 1e-4


def test_where_a_solver_stalls_on_the_way_to_a_fine_answer_a_form_asks_for_less(monkeypatch):
    """Interior points may lose in the last iterations what they had found: Newton's steps find it again."""
    made = clarabel.DefaultSolver
    asked = []

    def short(P, q, A, b, cones, settings):
        asked.append(settings.tol_feas)
        stalled = SimpleNamespace(status=clarabel.SolverStatus.InsufficientProgress)
        return SimpleNamespace(solve=lambda: stalled) if settings.tol_feas < LESS else made(P, q, A, b, cones, settings)

    scene, schedule = upsetting(mu=0.3, elements=2, reduction=0.02), Schedule(1)
    (whole,) = march(scene, schedule, Control(Dissipation(), ()))
    monkeypatch.setattr(clarabel, "DefaultSolver", short)
    with pytest.raises(StalledProgram, match="stopped with InsufficientProgress"):
        Clarabel().solve(posed(0.3).dissipation.conic(), TIGHT)
    asked.clear()
    (almost,) = march(scene, schedule, Control(Dissipation(), ()))
    assert asked[:2] == [Dissipation().accuracy.tolerance, LESS]
    assert almost.solved.almost > 0
    np.testing.assert_allclose(almost.tool_forces, whole.tool_forces, rtol=1e-7)


def test_what_qoco_cannot_solve_is_a_program_error():
    program = posed(0.3).tangent.conic()
    shut = [replace(r, b=r.b - 1e3) if r.term == Term.GAP else r for r in program.rows]
    apart = [replace(r, term="apart", A=-r.A, b=-r.b - 1e3) for r in program.rows if r.term == Term.GAP]
    with pytest.raises(ProgramError, match="conic solver stopped with QOCO"):
        Qoco().solve(replace(program, rows=(*shut, *apart)), TIGHT)


def test_of_a_program_with_new_numbers_all_that_are_new_are_sent():
    """The least |x - c| above a plane for each axis, at its foot: one matrix, vector or cost after another changes."""

    def planes(*slopes, least=1.0, weight=1.0, cost=0.0):
        rows = tuple(
            Rows(f"x{k}", Cone.NONNEGATIVE, sp.csr_matrix(([slope], ([0], [k])), shape=(1, 2)), np.array([-least]))
            for k, slope in enumerate(slopes)
        )
        P = sp.csc_matrix(np.diag([weight, weight]))
        return ConicProgram(P, np.full(2, -cost), rows, {"x": slice(0, 2)})

    solver, handle = Clarabel(), None
    first, second = planes(1.0, 1.0), planes(1.0, 4.0)
    kept = replace(first, rows=(first.rows[0], second.rows[1]))
    for program, x in (
        (first, (1.0, 1.0)),
        (kept, (1.0, 0.25)),
        (second, (1.0, 0.25)),
        (replace(second, rows=planes(2.0, 4.0, least=2.0).rows), (1.0, 0.5)),
        (planes(2.0, 4.0, least=2.0, weight=2.0, cost=6.0), (3.0, 3.0)),
        (planes(2.0, 4.0, least=2.0, weight=5.0, cost=6.0), (1.2, 1.2)),
    ):
        last = handle
        answer, handle = solver.solve(program, Accuracy(), handle)
        np.testing.assert_allclose(answer.x, x, rtol=1e-6)
        assert last is None or handle is last
        assert 0 < answer.timing.solve < 60
        assert answer.primal_residual() >= 0
    assert solver.solve(replace(second, rows=second.rows[:1]), Accuracy(), handle)[1] is not handle


def test_a_method_that_clarabel_does_not_know_is_refused():
    with pytest.raises(SceneError, match=r"clarabel\.method = 'lu'"):
        Clarabel("lu")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Clarabel(np.zeros(2)), r"clarabel\.method = array.*: must be a str"),
        (lambda: Clarabel(seconds="1"), r"clarabel\.seconds = '1': must be a number"),
        (lambda: Clarabel(seconds=True), r"clarabel\.seconds = True"),
        (lambda: Clarabel(seconds=float("nan")), r"clarabel\.seconds = nan: must be > 0"),
        (lambda: Cvxpy(None), r"cvxpy\.name = None: must be a str"),
        (lambda: Cvxpy("superlu"), r"cvxpy\.name = 'superlu': must be one of CLARABEL, SCS.*, which are installed"),
        (lambda: Cvxpy("scs"), r"cvxpy\.name = 'scs': must be one of CLARABEL, SCS"),
        (lambda: Cvxpy("OSQP"), r"cvxpy\.name = 'OSQP': must be one of"),
    ],
)
def test_what_names_no_solver_and_limits_no_time_is_refused(make, words):
    """Of a name that is none a march went on by its fallbacks, in silence."""
    with pytest.raises(SceneError, match=words):
        make()


@pytest.mark.slow
def test_what_cvxpy_brings_along_is_known_without_importing_it():
    code = "import sys; from bipot import Cvxpy; Cvxpy(), Cvxpy('SCS'); print('cvxpy' in sys.modules)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "False"
    assert set(BROUGHT) <= set(cone_solvers())


@pytest.mark.parametrize("method", ["qdldl", "faer"])
def test_the_method_of_the_linear_systems_does_not_move_the_answer(method):
    program = posed(0.3).dissipation.conic()
    (one, _), (other, _) = (Clarabel(m).solve(program, TIGHT) for m in ("auto", method))
    assert program.cost(one.x) == pytest.approx(program.cost(other.x), rel=1e-9)
    assert np.abs(one.x - other.x).max() < 1e-5 * np.abs(one.x).max()


SLOW_TO_IMPORT = {
    "cvxpy",
    "h5py",
    "matplotlib",
    "qoco",
    "scipy.optimize",
    "scipy.sparse.csgraph",
    "scipy.spatial",
    "scipy.special",
    "skfem",
    "tqdm",
}


def test_the_library_imports_nothing_that_takes_long_before_it_is_needed():
    """What scipy.sparse loads for itself, as some versions do csgraph, is not the library's."""
    loaded = "import scipy.sparse, sys; own = set(sys.modules); import bipot"
    code = f"{loaded}; print(sorted({SLOW_TO_IMPORT!r} & (set(sys.modules) - own)))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"


SQUARE = sp.csc_matrix(np.eye(2))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"b": np.zeros(1)}, r"rows.A = 'of shape \(2, 2\)': must be of 1 rows, as rows.b"),
        ({"b": [0.0, 0.0]}, "rows.b = 'list': must be an array of numbers with one axis"),
        ({"A": np.eye(2)}, "rows.A = 'ndarray': must be a sparse matrix"),
        ({"cone": "nonnegative"}, "rows.cone = 'nonnegative': must be a Cone, e.g. Cone.NONNEGATIVE"),
        ({"cone": Cone.SECOND_ORDER, "width": 3}, "rows.b = 'of 2 numbers': must be of a multiple of 3, the width"),
        ({"cone": Cone.SECOND_ORDER, "width": 0}, "rows.width = 0: must be >= 1"),
        ({"term": None}, "rows.term = None: must be a str"),
    ],
)
def test_rows_that_do_not_fit_are_refused(changes, words):
    """QOCO and cvxpy left out a cone of more rows than there were, and claimed the answer solved."""
    refused(lambda: replace(Rows("x", Cone.NONNEGATIVE, SQUARE.tocsr(), np.zeros(2)), **changes), words)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"q": np.zeros(1)},
            r"program.P = 'of shape \(2, 2\)': must be a sparse matrix of shape \(1, 1\), as program.q",
        ),
        ({"q": [0.0, 0.0]}, "program.q = 'list': must be an array"),
        ({"P": np.eye(2)}, "program.P = 'ndarray': must be a sparse matrix"),
        ({"rows": None}, "program.rows = None: must be a tuple of Rows"),
        ({"blocks": None}, "program.blocks = None: must be a Mapping"),
        ({"blocks": {"x": slice(0, 9)}}, r"program.blocks, x = slice\(0, 9, None\): must be a slice of whole numbers"),
    ],
)
def test_programs_that_do_not_fit_are_refused(changes, words):
    refused(lambda: replace(ConicProgram(SQUARE, np.zeros(2), (), {"x": slice(0, 2)}), **changes), words)


def test_two_blocks_of_rows_of_one_name_are_refused():
    """Through cvxpy the first was left out: x = -1 for x >= 0."""
    least = Rows("x", Cone.NONNEGATIVE, SQUARE.tocsr(), np.zeros(2))
    most = replace(least, A=-least.A, b=np.ones(2))
    refused(
        lambda: ConicProgram(SQUARE, np.ones(2), (least, most), {}), "program.rows = .*: must be of a different term"
    )
    wide = replace(least, A=sp.csr_matrix(np.ones((2, 3))))
    refused(lambda: ConicProgram(SQUARE, np.ones(2), (wide,), {}), "program.rows, A of x = .*: must be of 2 columns")
