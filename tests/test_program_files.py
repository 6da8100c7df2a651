"""Programs for other solvers: out of a march, into a file and back to the last bit; what is no such file is refused."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bipot.conic.clarabel import Clarabel
from bipot.conic.file import FileError
from bipot.conic.problem import ConicProgram, ConicSolution
from bipot.conic.solver import Accuracy
from bipot.conic.stored import load
from bipot.conic.through_cvxpy import Cvxpy
from bipot.errors import BipotError, SceneError
from bipot.exchange import conic_program
from bipot.forms import Dissipation, Newton, Penalty, Tangent, Uzawa
from bipot.marching import march
from bipot.programs.conic import TangentProgram
from bipot.programs.data import Block, Term
from bipot.programs.penalty import PenaltyProgram
from bipot.scene.loads import Traction
from bipot.schedule import Schedule
from tests.scenes import posed, run, scene

PAGE = Path(__file__).parents[1] / "docs" / "comparison.md"
FORMS = (Tangent(), Dissipation(), Penalty(1e6, 1e6), Uzawa(1e8, 1e8))
TIGHT, TIGHTEST = Accuracy(1e-11), Accuracy(1e-12)


def same(one, other):
    """Bit by bit; a statement is not stored."""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.tobytes() == other.tobytes()
    if hasattr(one, "indptr"):
        parts = ("data", "indices", "indptr")
        return one.shape == other.shape and all(same(getattr(one, p), getattr(other, p)) for p in parts)
    return one == other


def same_program(one, other):
    """All that a program is posed of."""
    rows = zip(one.rows, other.rows, strict=True)
    return (
        all(same(getattr(one, name), getattr(other, name)) for name in ("P", "q", "blocks"))
        and all(same(value, getattr(b, name)) for a, b in rows for name, value in vars(a).items())
        and other.statement is None
    )


@pytest.fixture(params=FORMS, ids=lambda form: form.name.value)
def program(request):
    """That which the sixth increment at mu = 0.3 ends with."""
    return conic_program(run(0.3)[5], request.param)


def test_a_program_comes_back_to_the_last_bit(program, tmp_path):
    conic = program.conic()
    conic.save(tmp_path / "program", None)
    found, answer = load(tmp_path / "program")
    assert isinstance(found, ConicProgram)
    assert answer is None
    assert same_program(conic, found)


def test_an_answer_comes_back_with_its_residuals(program, tmp_path):
    given, _ = Clarabel().solve(program.conic(), TIGHT)
    given.program.save(tmp_path / "program.npz", given)
    found, answer = load(tmp_path / "program.npz")
    assert isinstance(answer, ConicSolution)
    assert answer.program is found
    assert same(given.x, answer.x)
    assert all(same(z, answer.dual[term]) for term, z in given.dual.items())
    assert (given.outcome, given.iterations, given.timing) == (answer.outcome, answer.iterations, answer.timing)
    assert same(given.residuals(), answer.residuals())
    assert answer.error() < 1e-9


def test_a_loaded_program_has_the_same_optimum_by_another_solver(program, tmp_path):
    given, _ = Clarabel().solve(program.conic(), TIGHT)
    given.program.save(tmp_path / "program.npz")
    found, _ = load(tmp_path / "program.npz")
    other, _ = Cvxpy().solve(found, TIGHT)
    assert found.cost(other.x) == pytest.approx(given.program.cost(given.x), rel=1e-9)


def test_objectives_of_statement_and_standard_form_differ_by_the_constant(program):
    answer, _ = Clarabel().solve(program.conic(), TIGHT)
    stated = program.statement()
    stated.problem.solve(solver="CLARABEL")
    before = stated.problem.value
    constant = stated.constant()
    assert stated.problem.objective.value == pytest.approx(before, rel=1e-15)
    assert abs(before - constant - answer.program.cost(answer.x)) < 1e-7 * abs(before)
    assert (constant == 0) == isinstance(program, TangentProgram | PenaltyProgram)


@pytest.mark.parametrize("form", [Tangent(), Dissipation()])
def test_the_minimiser_of_an_increments_program_is_its_displacement(form):
    iterate = run(0.3)[5].solved.iterate
    answer, _ = Clarabel().solve(conic_program(run(0.3)[5], form).conic(), TIGHT)
    u = answer.block("dU") * iterate.increment.units.length
    assert np.abs(u - iterate.x).max() < 1e-5 * np.abs(iterate.x).max()


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name.value)
def test_a_loaded_body_that_nothing_touches_has_its_programs_too(form, tmp_path):
    *_, accepted = march(scene(tools=(), loads=(Traction("top", (0.0, -20.0)),)), Schedule(2))
    program = conic_program(accepted, form)
    given, _ = Clarabel().solve(program.conic(), TIGHT)
    given.program.save(tmp_path / "program.npz", given)
    assert load(tmp_path / "program.npz")[1] is not None
    iterate, u = accepted.solved.iterate, given.block("dU")
    length = iterate.increment.units.length
    assert np.abs(u * length - iterate.x).max() < 1e-7 * np.abs(iterate.x).max()


def test_multipliers_outside_their_cone_are_measured():
    answer, _ = Clarabel().solve(posed(0.3).dissipation.conic(), TIGHT)
    assert answer.dual_violation() < 1e-12
    gap = answer.dual["gap"].copy()
    gap[0] = -1.0
    assert replace(answer, dual={**answer.dual, "gap": gap}).dual_violation() == 1.0


def test_a_point_outside_a_second_order_cone_is_measured():
    """The bounds of the plastic strains' lengths, an eighth below the lengths themselves."""
    answer, _ = Clarabel().solve(posed(0.3).dissipation.conic(), TIGHT)
    program = answer.program
    cone = next(rows for rows in program.rows if rows.term is Term.YIELD)
    length = np.linalg.norm(cone.at(answer.x).reshape(-1, cone.width)[:, 1:], axis=1)
    x = answer.x.copy()
    x[program.blocks[Block.PLASTIC_NORM]] = length * 7 / 8
    assert replace(answer, x=x).primal_residual() == pytest.approx(length.max() / 8, rel=1e-9)


def test_a_form_without_a_conic_program_is_refused():
    with pytest.raises(SceneError, match=r"form = Newton"):
        conic_program(run(0.3)[5], Newton())


def test_the_multipliers_of_a_solved_statement_are_those_of_its_solution(program):
    answer, _ = Cvxpy().solve(program.conic(), TIGHT)
    stated = program.statement()
    stated.problem.solve(solver="CLARABEL", tol_gap_abs=1e-10, tol_gap_rel=1e-10, tol_feas=1e-10)
    for term in stated.constraints:
        assert np.abs(stated.dual(term) - answer.dual[term]).max() < 1e-6 * np.abs(answer.dual[term]).max()
    assert stated.value == stated.problem.value
    with pytest.raises(SceneError, match=r"term = 'gaps': must be one of .*"):
        stated.dual("gaps")


def changed(tmp_path, **changes):
    """A file with other fields, None for one that is left out."""
    given, _ = Clarabel().solve(posed(0.3).tangent.conic(), TIGHT)
    given.program.save(tmp_path / "whole.npz", given)
    with np.load(tmp_path / "whole.npz") as file:
        fields = {**{name: file[name] for name in file.files}, **changes}
    np.savez(tmp_path / "changed.npz", **{name: value for name, value in fields.items() if value is not None})
    return tmp_path / "changed.npz"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kind": np.array("conic program")}, "is of kind conic program: it must be 'bipot conic program 1'"),
        ({"kind": None}, "is of kind None"),
        ({"q": None}, "has no 'q'"),
        ({"residuals": None}, "has no 'residuals'"),
        ({"q": np.array([object()])}, "without pickles"),
        ({"b": np.array(["1.0"])}, "'b' is of type <U3"),
        ({"q": np.zeros((2, 2))}, r"shape \(2, 2\)"),
        ({"optimum": np.array([np.nan])}, "'optimum' holds NaN or inf"),
        ({"cones": np.array(["circle"] * 3)}, "'circle' is not a valid Cone"),
        ({"lengths": np.array([1, 1, 1])}, "do not fit together: lengths"),
        ({"widths": np.array([1, 7, 1])}, "do not fit together: widths"),
        ({"terms": np.array(["gap", "gap", "tie"])}, "do not fit together: terms"),
        ({"stops": np.array([5, 10**6])}, "do not fit together: stops"),
        ({"starts": np.array([0, 10**6])}, "do not fit together: starts"),
        ({"blocks": np.array(["dU", "dU"])}, "do not fit together: blocks"),
        ({"A_indices": np.array([10**6])}, "do not fit together"),
        ({"x": np.zeros(3)}, "do not fit together: x"),
        ({"outcome": np.array(["perfect"])}, "'perfect' is not a valid Claim"),
        ({"optimum": np.array([0.0])}, "its answer has optimum"),
        ({"residuals": np.array([0.0, 0.0, 0.0, 1.0])}, "its answer has residuals"),
    ],
    ids=lambda given: "" if isinstance(given, str) else "-".join(given),
)
def test_what_is_no_such_file_is_refused_by_name(changes, words, tmp_path):
    with pytest.raises(BipotError, match=words) as refusal:
        load(changed(tmp_path, **changes))
    assert isinstance(refusal.value, FileError)
    assert "changed.npz" in str(refusal.value)


def test_a_length_below_zero_is_refused_though_the_sum_is_right(tmp_path):
    rows = sum(len(r.b) for r in posed(0.3).tangent.conic().rows)
    with pytest.raises(FileError, match="do not fit together: lengths"):
        load(changed(tmp_path, lengths=np.array([rows + 1, -1, 0])))


def test_an_answer_to_another_program_is_refused(tmp_path):
    """It has other residuals than it was stored with."""
    path = changed(tmp_path, q=posed(0.3).tangent.conic().q * 1.001)
    with pytest.raises(FileError, match="its answer has"):
        load(path)


@pytest.mark.parametrize("content", [None, b"", b"P, q, A, b", b"PK\x03\x04 cut", b"\x93NUMPY"])
def test_other_files_are_refused_by_name(content, tmp_path):
    path = tmp_path / "other.npz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FileError, match=r"other\.npz cannot be read as a npz file"):
        load(path)


def test_a_file_cut_short_or_with_a_wrong_byte_is_refused(tmp_path):
    given, _ = Clarabel().solve(posed(0.3).tangent.conic(), TIGHT)
    path = tmp_path / "whole.npz"
    given.program.save(path, given)
    whole = path.read_bytes()
    for content in (whole[:-100], whole[:500] + bytes([whole[500] ^ 1]) + whole[501:]):
        path.write_bytes(content)
        with pytest.raises(FileError):
            load(path)


def test_the_pages_program_is_saved_and_solved_elsewhere(tmp_path, monkeypatch, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, PAGE.name, "exec"), {})
    statement, standard = map(float, capsys.readouterr().out.split())
    assert abs(statement - standard) < 1e-7 * abs(standard)
    assert load(tmp_path / "increment.npz")[1] is not None
