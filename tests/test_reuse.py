"""Clarabel updated instead of set up anew, condensation from one factorisation, and what the dissipation form costs."""

import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from benchmarks.dissipation import recorded, stages, with_plastic_variable
from bipot.certificate import Bounds
from bipot.conic.clarabel import Clarabel, clarabel, solve_once
from bipot.conic.problem import Timing
from bipot.conic.solver import Accuracy
from bipot.conic.through_cvxpy import Cvxpy, solve_stated
from bipot.control.attempting import attempt_increment
from bipot.errors import ProgramError, SceneError
from bipot.forms import Cache, Dissipation, Newton, Tangent
from bipot.forms.posed import tangent_program
from bipot.increment import Limits
from bipot.iterate import Increment
from bipot.laws.flow import Integration
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.paper import upsetting
from bipot.programs import condensation
from bipot.programs.condensation import condense
from bipot.programs.conic import TangentProgram
from bipot.programs.data import Block, ContactRows, Stopwatch
from bipot.programs.terms import ContactTerms
from bipot.response import TangentKind
from bipot.scene.scene import Geometry
from bipot.scene.supports import Support
from bipot.tools.tool import FlatTool
from tests.scenes import plastic_strain, posed

TIGHT = Accuracy(1e-11)


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


@pytest.fixture(scope="module")
def passes():
    """Passes of a short run on 4 x 4 elements."""
    return recorded(0.3, 4)


@pytest.mark.parametrize("form", [Tangent, Dissipation])
def test_updated_programs_have_the_answers_of_the_cvxpy_statement(form, passes):
    """Polished, as the toolkit uses them: to 1e-7 in displacement and force, on programs sent one after another."""
    cache = Cache()
    reused = set()
    for seen in passes[1::3]:
        fast = first_step(form(), seen, cache)
        slow = first_step(form(solver=Cvxpy()), seen, Cache())
        assert relative(fast.iterate.x, slow.iterate.x) < 1e-7
        assert relative(fast.r, slow.r) < 1e-7
        reused.add(id(cache.handles[form.name]))
    assert len(reused) == 1


def first_step(form, seen, cache):
    """The pass that was seen, posed, with what its increment had frozen by then but nothing else of its past."""
    return form.step(seen.iterate, seen.r, replace(seen.state, cache=cache, rose=True, distance=np.inf))[0]


def tangent(seen):
    terms = seen.state.terms(seen.iterate, seen.r)
    return condense(tangent_program(seen.iterate, terms, seen.state, TangentKind.CONSISTENT, Stopwatch())).program


def dissipation_program(seen):
    return Dissipation().program(seen.iterate, seen.r, seen.state)


def least_cost(stated):
    """The minimum, without the constant that the conic program leaves out."""
    constant = stated.constant()
    solve_stated(stated, TIGHT)
    return stated.problem.value - constant


@pytest.mark.parametrize("program_of", [tangent, dissipation_program], ids=["tangent", "dissipation"])
def test_raw_answers_of_updated_programs_are_those_of_the_statement(program_of, passes):
    """Where none is set up anew; no polish mends a wrong number. A cost to the tolerance leaves unknowns its root."""
    last, accuracy = None, np.sqrt(TIGHT.tolerance)
    for number, program in enumerate(map(program_of, passes[2::3])):
        conic = program.conic()
        updated, handle = Clarabel().solve(conic, TIGHT, last)
        assert (handle is last) == (number > 0)
        last = handle
        stated, _ = Cvxpy().solve(conic, TIGHT)
        assert conic.cost(updated.x) == pytest.approx(least_cost(program.statement()), rel=1e-8)
        assert relative(updated.block(Block.DISPLACEMENT), stated.block(Block.DISPLACEMENT)) < accuracy
        assert relative(*(program.contact.contact_forces(answer) for answer in (updated, stated))) < accuracy
        assert relative(updated.x, solve_once(conic, TIGHT).x) < accuracy


@pytest.mark.parametrize("form", [Tangent(), Dissipation()], ids=lambda form: form.name.value)
def test_steps_carry_the_response_they_were_judged_by(form, passes):
    step = first_step(form, passes[2], Cache())
    again = step.iterate.increment.at(step.iterate.x)
    np.testing.assert_array_equal(step.iterate.response.internal, again.response.internal)


def test_halvings_below_zero_are_refused():
    with pytest.raises(SceneError, match=r"tangent\.halvings"):
        Tangent(halvings=-1)


def test_a_pattern_is_set_up_once_and_a_new_one_anew():
    program = posed(0.3).dissipation
    _, first = Clarabel().solve(program.conic(), TIGHT)
    assert Clarabel().solve(program.conic(), TIGHT, first)[1] is first
    assert Clarabel().solve(program.conic(), Accuracy(1e-9), first)[1] is not first
    assert Clarabel("faer").solve(program.conic(), TIGHT, first)[1] is not first
    tangent = posed(0.3).tangent.conic()
    answer, _ = Clarabel().solve(tangent, TIGHT, first)
    np.testing.assert_array_equal(answer.x, solve_once(tangent, TIGHT).x)


@pytest.mark.parametrize("status", ["AlmostSolved", "NumericalError"])
def test_what_an_update_does_not_solve_is_set_up_afresh(status):
    """The equilibration of the last program may not suit the next."""
    program = posed(0.3).tangent.conic()
    expected, last = Clarabel().solve(program, TIGHT)
    claim = SimpleNamespace(status=getattr(clarabel.SolverStatus, status), x=expected.x * 0, z=np.zeros(200))
    claim.iterations = 1
    last.clarabel = SimpleNamespace(update=lambda **_: None, solve=lambda: claim)
    np.testing.assert_array_equal(Clarabel().solve(program, TIGHT, last)[0].x, expected.x)


def test_matrices_that_are_the_same_objects_are_not_sent_again():
    """But they are after others of the same pattern have been."""
    program = posed(0.3).tangent.conic()
    other = replace(program, P=2 * program.P, rows=tuple(replace(r, A=1.5 * r.A) for r in program.rows))
    last = None
    for given in (program, replace(program, q=0.9 * program.q), other, program):
        answer, last = Clarabel().solve(given, TIGHT, last)
        np.testing.assert_allclose(answer.x, solve_once(given, TIGHT).x, atol=1e-6 * np.abs(answer.x).max())


def test_a_solve_that_was_lost_is_booked_as_a_solve(monkeypatch):
    """On a clock that only the lost solve moves."""
    seconds = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: seconds[0])

    def lost():
        seconds[0] += 1.0
        return SimpleNamespace(status=clarabel.SolverStatus.NumericalError)

    program = posed(0.3).tangent.conic()
    _, last = Clarabel().solve(program, TIGHT)
    last.clarabel = SimpleNamespace(update=lambda **_: None, solve=lost)
    assert Clarabel().solve(program, TIGHT, last)[0].timing == Timing(build=0.0, solve=1.0)


def test_newton_keeps_nothing_of_another_attempt_from_the_same_state():
    """What was given up with a large merit is no merit to fall below, nor its factor one to go on with."""
    scene = upsetting(mu=0.3, elements=2, reduction=0.1)
    system = system_of(scene)
    state = next(march(scene, Schedule(20), Control(Newton(), ()))).state

    def attempt(tau, passes, cache):
        control = Control(Newton(), (), Limits(passes=passes), integration=Integration.BACKWARD_EULER)
        return attempt_increment(Increment(system, state, tau), control, cache, 0.0)

    used = Cache()
    assert attempt(1.0, 1, used).solved is None
    again, first = attempt(0.1, 40, used), attempt(0.1, 40, Cache())
    assert again.passes == first.passes
    np.testing.assert_array_equal(again.solved.r, first.solved.r)


def test_plastic_strain_as_the_variable_is_the_same_program():
    program = posed(0.3).dissipation
    ours, other = solve_once(program.conic(), TIGHT), solve_once(with_plastic_variable(program), TIGHT)
    assert relative(program.contact.contact_forces(other), program.contact.contact_forces(ours)) < 1e-7
    plastic = other.block(Block.ELASTIC_DEVIATOR)
    assert relative(plastic, plastic_strain(program, ours).ravel()) < 1e-5


@pytest.mark.serial
def test_building_and_sending_a_dissipation_program_take_less_than_a_fifth_of_its_solution():
    """On the seed paper's mesh; a median of ratios within passes, so that a busy machine slows both parts of each."""
    found = stages(recorded(0.3, 10)[:8])
    assert found.overhead < 0.2
    assert np.median(found.transfer) < np.median(found.anew)


def test_condensation_is_the_schur_complement():
    program = posed(0.3).tangent
    condensed = condense(program)
    K, kept = program.K.toarray(), condensed.kept
    inner = np.setdiff1d(np.arange(len(K)), kept)
    back = np.linalg.solve(K[np.ix_(inner, inner)], np.column_stack([K[np.ix_(inner, kept)], program.f[inner]]))
    cross = K[np.ix_(kept, inner)]
    assert relative(condensed.program.K, K[np.ix_(kept, kept)] - cross @ back[:, :-1]) < 1e-12
    assert relative(condensed.program.f, program.f[kept] - cross @ back[:, -1]) < 1e-12
    u = np.random.default_rng(0).normal(size=len(kept))
    x = condensed.recover(u)
    np.testing.assert_array_equal(x[kept], u)
    assert relative(x[inner], back[:, -1] - back[:, :-1] @ u) < 1e-10


def chain(stiffness, kept):
    """Springs in a row, free at both ends, with a contact on the unknown ``kept``."""
    n = len(stiffness) + 1
    K = np.zeros((n, n))
    for i, k in enumerate(stiffness):
        K[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    G = sp.csr_matrix((np.ones(1), ([0], [kept])), shape=(1, n))
    none = sp.csr_matrix((0, n))
    bare = np.empty(0, int), np.zeros(1), np.full(1, np.inf), np.zeros(1, bool)
    rows = ContactRows(G, np.ones(1), none, np.zeros((0, 1)), *bare)
    return TangentProgram(sp.csc_matrix(K), np.arange(float(n)), ContactTerms(rows, np.zeros(0)))


def test_condensation_of_a_body_that_only_its_contacts_hold():
    """S = 0 (perfect flow has it so): exact, though the whole matrix is singular."""
    condensed = condense(chain([2.0, 1.0, 4.0], kept=3))
    assert condensed.program.K == pytest.approx(0.0, abs=1e-14)
    assert condensed.program.f == pytest.approx(6.0)
    # from the end inwards: forces 0, 0 + 1, 0 + 1 + 2 in the springs
    np.testing.assert_allclose(condensed.recover(np.array([0.5])), [0.5 + 0.75 + 1.0, 2.25, 1.25, 0.5], atol=1e-14)


def test_condensation_refuses_a_part_that_nothing_holds():
    program = chain([2.0, 1.0, 4.0], kept=3)
    K = program.K.toarray()
    K[0], K[:, 0] = 0.0, 0.0
    with pytest.raises(ProgramError, match="moves without resistance"):
        condense(TangentProgram(sp.csc_matrix(K), program.f, program.contact))


def test_programs_are_condensed_where_that_makes_them_smaller_with_the_same_answers(monkeypatch):
    """A flat block, all of whose upper face touches, by interior points alone: the fixed point of friction by both."""
    scene = replace(
        upsetting(mu=0.1, elements=1),
        mesh=block(12.0, 2.0, 12, 2, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        supports=(Support("base", 1), Support("left", 0)),
        tools=(FlatTool((0.0, 2.0), (0.0, -1.0), (0.0, -0.01), ("top",), 0.1),),
    )
    assert condensation.pays(posed(0.3).tangent)
    limits = Limits(Bounds(equilibrium=1e-9), passes=60)

    def forces(smaller):
        monkeypatch.setattr(condensation, "SMALLER", smaller)
        steps = march(scene, Schedule(2), Control(Tangent(coupled=False), (), limits))
        return [a.solved.r for a in steps]

    for whole, condensed in zip(forces(0.0), forces(np.inf), strict=True):
        assert relative(whole, condensed) < 1e-7
