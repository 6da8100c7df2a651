"""One program, several routes: cvxpy statement, direct Clarabel, condensed, polished. All agree to 1e-7."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from bipot.conic.clarabel import Clarabel, solve_once
from bipot.conic.problem import Cone
from bipot.conic.solver import Accuracy
from bipot.conic.through_cvxpy import Cvxpy
from bipot.errors import InfeasibleProgram, SceneError, UnboundedProgram
from bipot.forms.base import Cache, FormName
from bipot.forms.posed import solved
from bipot.programs.condensation import condense
from bipot.programs.conic import TangentProgram, couple, polish
from bipot.programs.data import Block, ContactRows, Term, Units
from bipot.programs.newton import Linearised, Model
from bipot.programs.terms import ContactTerms
from tests.newton_models import rows_of
from tests.scenes import plastic_strain, posed

TIGHT = Accuracy(1e-11)


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


def answered(program, solver):
    answer, _ = solver.solve(program.conic(), TIGHT)
    return answer.block(Block.DISPLACEMENT), program.contact.contact_forces(answer)


def direct(program):
    return answered(program, Clarabel())


def stated(program):
    return answered(program, Cvxpy())


def routes(program):
    """(x, r) of the full program and of the condensed one, direct and stated."""
    condensed = condense(program)
    small = [route(condensed.program) for route in (direct, stated)]
    return (direct(program), stated(program), *((condensed.recover(u), r) for u, r in small))


def dense(program):
    return TangentProgram(program.K.toarray(), program.f, ContactTerms(program.contact.rows, program.contact.threshold))


@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_condensed_full_cvxpy_and_direct_clarabel_agree(mu):
    """Polished, as the toolkit uses them, to 1e-7 in displacement and force."""
    program = posed(mu).tangent
    x, r = polish(dense(program), *direct(program))
    for other in routes(program):
        other_x, other_r = polish(dense(program), *other)
        assert relative(other_x, x) < 1e-7
        assert relative(other_r, r) < 1e-7


def test_a_polish_that_runs_away_gives_back_what_it_began_with(monkeypatch):
    """Of next to singular matrices steps grow until squares overflow: fuzz seed 49 of bodies under shaped tools."""
    program = dense(posed(0.3).tangent)
    x, r = direct(program)
    whole = Linearised.step
    monkeypatch.setattr(Linearised, "step", lambda self, *at: tuple(1e60 * part for part in whole(self, *at)))
    np.testing.assert_array_equal(polish(program, x, 1.1 * r)[0], x)


def test_an_answer_that_is_out_of_all_bounds_is_not_polished():
    """Its squares overflow: a solver of a user's own may return anything, which the certificate then refuses."""
    program = dense(posed(0.3).tangent)
    x, r = direct(program)
    for far in (1e300, np.inf, np.nan):
        away = np.full_like(x, far)
        np.testing.assert_array_equal(polish(program, away, r)[0], away)
        assert couple(program.model, x, np.full_like(r, far)) is None


def test_interior_points_stall_at_the_axis_node_and_polishing_is_what_cures_it():
    """No force and no gap there, so no strict complementarity: raw routes differ far above their tolerance."""
    program = posed(0.3, after=3).tangent
    raw = [x for x, _ in routes(program)]
    polished = [polish(dense(program), x, r)[0] for x, r in routes(program)]
    spread = [max(relative(x, answers[0]) for x in answers[1:]) for answers in (raw, polished)]
    assert spread[0] > 100 * TIGHT.tolerance
    assert spread[1] < 1e-3 * spread[0]


@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_dissipation_statement_and_direct_agree(mu):
    """Unpolished: to 1e-7 in force; in displacement as far as the axis node's missing strictness allows."""
    program = posed(mu).dissipation
    x, r = direct(program)
    other_x, other_r = stated(program)
    assert relative(other_x, x) < np.sqrt(TIGHT.tolerance)
    assert relative(other_r, r) < 1e-7


def test_dissipation_variables_are_the_plasticity_they_stand_for():
    """e_p is trace-free by its basis, |e_p| meets its bound, and its stress is on the yield surface where e_p > 0."""
    program = posed(0.3).dissipation
    answer = solve_once(program.conic(), TIGHT)
    e_p, bound = plastic_strain(program, answer), answer.block(Block.PLASTIC_NORM)
    length = np.linalg.norm(e_p, axis=1)
    np.testing.assert_allclose(length, bound, atol=1e-8)
    model = program.model
    d = answer.block(Block.ELASTIC_DEVIATOR).reshape(e_p.shape)
    stress = model.stress + 2 * model.shear[:, None] * d
    flowing = length > 1e-4
    assert flowing.sum() > 20
    equivalent = np.sqrt(1.5) * np.linalg.norm(stress, axis=1)
    np.testing.assert_allclose(equivalent[flowing], model.threshold[flowing], rtol=1e-7)
    assert (equivalent < model.threshold * (1 + 1e-7)).all()


def test_a_solution_measures_itself():
    answer = solve_once(posed(0.3).tangent.conic(), TIGHT)
    assert answer.dual_residual() < 1e-8
    assert answer.primal_residual() < 1e-10
    assert answer.duality_gap() < 1e-8
    loose = solve_once(posed(0.3).tangent.conic(), Accuracy(1e-3))
    assert loose.duality_gap() > 1e3 * answer.duality_gap()


def test_polish_reaches_round_off_where_the_interior_point_stalls():
    """On its natural map the polished answer is exact: complementarity to 1e-13, from a loose interior point."""
    program = condense(posed(0.3).tangent).program
    u, r = direct_loose(program)
    before, after = complementarity(program, u, r), complementarity(program, *polish(program, u, r))
    assert before > 1e-7
    assert after < 1e-13


def direct_loose(program):
    answer = solve_once(program.conic(), Accuracy(1e-5))
    return answer.block(Block.DISPLACEMENT), program.contact.contact_forces(answer)


def complementarity(program, u, r):
    rows = program.contact.rows
    motion = rows.motion(u)
    stationarity = np.abs(program.K @ u - program.f - rows.forces(r)).max()
    return max(np.abs(np.minimum(r[:, 0], motion[:, 0])).max(), stationarity)


@pytest.mark.parametrize("tangents", [1, 2])
def test_a_slip_that_turns_back_ends(tangents: int) -> None:
    """Beside stiff unknowns a contact's own motion counts for much: what sticks looks as if it slid, to and fro."""
    normal, *along = np.eye(2 + tangents)[: 1 + tangents]
    rows = rows_of(normal[None], np.array(along), np.zeros(1), np.zeros(tangents), 0.3)
    model = Model(np.diag([*np.ones(1 + tangents), 1e8]), np.array([-1.0, *[0.1] * tangents, 0.0]), rows)
    found = couple(model, np.array([0.0, *[-1e-3] * tangents, 0.0]), np.array([[1.0, *[0.0] * tangents]]))
    assert found is not None
    np.testing.assert_allclose(found[0], 0.0, atol=1e-14)
    np.testing.assert_allclose(found[1], [[1.0, *[-0.1] * tangents]], atol=1e-12)


def test_couple_finds_exact_coulomb_on_the_quadratic_model():
    program = condense(posed(0.3).tangent).program
    coupled = couple(program.model, *direct_loose(program))
    assert coupled is not None
    u, r = coupled
    rows = program.contact.rows
    motion = rows.motion(u)
    gap = 0.3 * r[:, 0] * np.abs(motion[:, 1]) + (r * motion).sum(axis=1)
    assert np.abs(gap).max() < 1e-13
    assert (np.abs(r[:, 1]) <= 0.3 * r[:, 0] + 1e-13).all()
    slipping = np.abs(motion[:, 1]) > 1e-9
    assert slipping.any()
    frozen = program.contact.threshold
    assert np.abs(rows.threshold(r) - frozen).max() > 1e-4


def one_dof(gap, tied=False):
    """Two opposed candidates on one unknown: total clearance sum(gap)."""
    G = sp.csr_matrix(np.array([[1.0], [-1.0]]))
    none = sp.csr_matrix((0, 1))
    free, both = np.full(2, np.inf), np.array([tied, tied])
    rows = ContactRows(G, np.array(gap), none, np.zeros((0, 1)), np.empty(0, int), np.zeros(2), free, both)
    return TangentProgram(np.eye(1), np.zeros(1), ContactTerms(rows, np.zeros(0)))


def test_no_clearance_is_reported_infeasible_by_both_routes():
    """One unknown between two opposed contacts whose clearances, -1 and 0.5, add up to less than nothing."""
    for route in (direct, stated):
        with pytest.raises(InfeasibleProgram, match="no displacement"):
            route(one_dof((-1.0, 0.5)))


def test_a_frozen_shift_that_no_displacement_satisfies_is_not_blamed_on_the_gaps():
    """x >= 0.2 alone has solutions, x + 0.3 >= 2 |x + 1| has none: it is -0.7 >= 0 where the slip x + 1 vanishes."""
    one = sp.csr_matrix(np.ones((1, 1)))
    free, no_cap = np.zeros(1, dtype=bool), np.full(1, np.inf)
    rows = ContactRows(one, np.array([-0.2]), one, np.ones((1, 1)), np.array([0]), np.array([2.0]), no_cap, free)
    shifted = TangentProgram(np.eye(1), np.zeros(1), ContactTerms(rows, np.zeros(1), np.array([0.5])))
    with pytest.raises(InfeasibleProgram, match="cones of friction with the shift"):
        solved(shifted, FormName.TANGENT, Clarabel(), TIGHT, Cache())
    gaps = TangentProgram(np.eye(1), np.zeros(1), ContactTerms(rows, np.zeros(1)))
    assert solved(gaps, FormName.TANGENT, Clarabel(), TIGHT, Cache()).u == pytest.approx([0.2], abs=1e-8)


def test_no_stiffness_under_load_is_reported_unbounded():
    program = one_dof((1.0, 1.0))
    rows = program.contact.rows.take(np.array([True, False]))
    free = TangentProgram(np.zeros((1, 1)), np.ones(1), ContactTerms(rows, np.zeros(0)))
    for route in (direct, stated):
        with pytest.raises(UnboundedProgram, match="no minimum"):
            route(free)


def test_tied_rows_are_equalities_and_their_force_may_pull():
    program = one_dof((0.25, -0.25), tied=True)
    for route in (direct, stated):
        x, r = route(program)
        assert x == pytest.approx([-0.25], abs=1e-9)
        assert r[0, 0] - r[1, 0] == pytest.approx(-0.25, abs=1e-8)


def test_rows_of_zero_threshold_are_left_out():
    program = posed(0.3).tangent
    rows = program.contact.rows
    silent = TangentProgram(program.K, program.f, ContactTerms(rows, np.zeros(len(rows.frictional))))
    friction = next(r for r in silent.conic().rows if r.term == Term.FRICTION)
    assert friction.count == 0
    assert friction.cone is Cone.SECOND_ORDER
    _, r = direct(silent)
    assert np.all(r[:, 1] == 0)


def test_scaling_a_program_scales_its_answer():
    given, units = posed(0.3), Units(2.0, 3.0, 5.0, 7.0)
    small = condense(given.tangent).program
    x, r = polish(small, *direct(small))
    scaled = small.scaled(units)
    scaled_x, scaled_r = polish(scaled, *direct(scaled))
    assert relative(scaled_x * units.length, x) < 1e-7
    assert relative(scaled_r * units.force, r) < 1e-7
    y, s = direct(given.dissipation)
    scaled_y, scaled_s = direct(given.dissipation.scaled(units))
    assert relative(scaled_y * units.length, y) < 1e-6
    assert relative(scaled_s * units.force, s) < 1e-6


@pytest.mark.parametrize(
    ("make", "words"),
    [(lambda: Accuracy(0.0), "tolerance = 0.0"), (lambda: Accuracy(1e-9, 0), "iterations = 0")],
)
def test_bad_accuracy_is_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_forces_from_the_duals_of_shifted_cones_balance_the_program():
    """At the optimum K dU - f = G' r, with r within the cone of friction, and none where the shifted cone is open."""
    program, shift = posed(0.3).tangent, 0.05
    rows = replace(program.contact.rows, slip=np.full(program.contact.rows.slip.shape, 0.2))
    terms = ContactTerms(rows, program.contact.threshold, np.full(len(rows.frictional), shift))
    shifted = replace(program, contact=terms)
    answer = solve_once(shifted.conic(), Accuracy(1e-11))
    x, r = answer.block(Block.DISPLACEMENT), terms.contact_forces(answer)
    largest = np.abs(r).max()
    assert np.abs(r[:, 1]).max() > 1e-2 * largest
    assert np.abs(program.K @ x - program.f - rows.forces(r)).max() < 1e-7 * largest
    assert (np.abs(r[:, 1]) <= 0.3 * r[:, 0] + 1e-7 * largest).all()
    motion = rows.motion(x)[rows.frictional]
    opened = motion[:, 0] + shift - 0.3 * np.abs(motion[:, 1])
    assert opened.min() > -1e-7
    assert np.abs(opened * r[rows.frictional, 0]).max() < 1e-6 * largest
