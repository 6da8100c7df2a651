"""An increment's contact problem exported, read back, and solved by every discrete solver; the march by some."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.conic.clarabel import Clarabel
from bipot.conic.solver import Accuracy
from bipot.coulomb import (
    AlartCurnier,
    CoulombProblem,
    DeSaxceFixedPoint,
    GaussSeidel,
    Limits,
    NaturalMap,
    Newton,
    ProximalPoint,
    TrescaFixedPoint,
    Uzawa,
    read_fclib,
    read_solution,
    residual,
    run,
    solve,
)
from bipot.errors import NotConverged, ProgramError
from bipot.exchange import conic_program, contact_problem, export_fclib
from bipot.fem.reduction import Geometry
from bipot.forms import Delassus, Dissipation, Tangent
from bipot.forms import Newton as NewtonForm
from bipot.increment import Limits as Increments
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.sections import block
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool
from tests.scenes import DIRECT, STEEL, fresh, path, refused
from tests.scenes import run as upset

LIMITS = Limits(tol=1e-13, seconds=30.0)
SCENE = upsetting(mu=0.3, reduction=0.1, elements=4)


@pytest.fixture(scope="module")
def accepted():
    """The eighth increment of an upsetting at mu = 0.3, solved far below the usual bounds."""
    tight = Control(DIRECT, limits=Increments(Bounds(equilibrium=1e-12)))
    return list(march(SCENE, path(0.1, 5), tight))[7]


@pytest.fixture(scope="module")
def exported(accepted, tmp_path_factory):
    """The file it is exported to, the problem read back, and the march's own forces."""
    file = tmp_path_factory.mktemp("fclib") / "increment.hdf5"
    export_fclib(file, accepted)
    return file, read_fclib(file), contact_problem(accepted).r


def test_the_file_holds_the_problem_and_the_marchs_solution(exported):
    file, problem, r = exported
    assert isinstance(problem, CoulombProblem)
    assert problem.dim == 2
    solution = read_solution(file)
    np.testing.assert_array_equal(solution["r"], r)
    np.testing.assert_allclose(solution["u"], problem.velocity(r))
    assert residual(problem, r) < 1e-11


def test_programs_and_problems_are_shown_in_one_line_with_their_answers(accepted):
    program, problem = conic_program(accepted, Dissipation()).conic(), contact_problem(accepted).problem
    found = solve(problem)
    assert repr(problem) == f"CoulombProblem({problem.contacts} contacts, dim=2)"
    assert repr(found) == f"CoulombSolution({problem.contacts} contacts: {found.reason})"
    said = f"ConicProgram({len(program.q)} variables; rows of yield 448, gap 9, friction 16, tie 0)"
    assert repr(program) == said
    answer, _ = Clarabel().solve(program, Accuracy())
    assert repr(answer) == f"ConicSolution(solved in {answer.iterations} iterations: {said})"


def test_the_motion_of_the_reduced_problem_is_that_of_the_march(exported, accepted):
    _, problem, r = exported
    near = contact_problem(accepted).candidate
    motion = accepted.solved.rows.motion(accepted.solved.response.x)[near]
    travel = 0.5 * (accepted.state.tau - accepted.start.tau)
    np.testing.assert_allclose(problem.velocity(r).reshape(-1, 2), motion, atol=1e-9 * travel)
    assert (np.delete(accepted.solved.r, near, axis=0) == 0).all()


def test_the_motion_of_a_body_in_perfect_flow_is_that_of_the_march():
    """Forces of 1e-9 of the contact's move such a body by 1e-3 of the increment: no equilibrium is as good as that.

    Gap and slip are those of the nodes, from positions alone.
    """
    punch = FlatTool((0.0, 10.0), (0.0, -1.0), (0.0, -1.0), ("top",), mu=0.2)
    strip = Scene(
        mesh=block(20.0, 10.0, 8, 4),
        geometry=Geometry.PLANE_STRAIN,
        material=STEEL,
        supports=(Support("left", 0), Support("base", 1)),
        tools=(punch,),
    )
    *_, last = march(strip, Schedule(6, first=0.005))
    found = contact_problem(last)
    before, after = (s.nodes[strip.mesh.boundary_nodes("top")] for s in (last.start, last.state))
    gap = 10.0 - last.state.tau - after[:, 1]
    inside = after[:, 0] > 0
    problem, travel = found.problem, last.state.tau - last.start.tau
    seen = problem.velocity(found.r).reshape(-1, 2)
    assert np.abs(problem.W @ found.r).max() > 1e5 * travel
    assert (found.candidate == np.arange(len(gap))).all()
    np.testing.assert_allclose(seen[:, 0], gap, atol=1e-9 * travel)
    np.testing.assert_allclose(np.abs(seen[inside, 1]), np.abs(after - before)[inside, 0], atol=1e-9 * travel)


@pytest.fixture(scope="module")
def dwell():
    """A system whose punch presses, rests over five increments and goes back, with the increments at rest."""
    punch = replace(SCENE.tools[0], path=((0.0, 0.0), (0.5, 1.0), (0.75, 1.0), (1.0, 0.98)))
    scene = replace(SCENE, tools=(punch,))
    schedule = Schedule(16, first=0.005, landings=(0.5, 0.75))
    steps = list(march(scene, schedule, Control(NewtonForm(), (Tangent(), Dissipation()))))
    return system_of(scene), [a for a in steps if 0.5 < a.state.tau <= 0.75]


def test_every_closed_contact_of_a_dwell_is_written(dwell, tmp_path):
    """No travel, displacements from 1e-11 down to round-off: nine contacts carry force in each increment."""
    _, resting = dwell
    assert len(resting) >= 4
    for accepted in resting:
        found = contact_problem(accepted)
        closed = np.flatnonzero(accepted.solved.r[:, 0] > 0)
        assert len(closed) == 9
        assert set(closed) <= set(found.candidate)
        assert residual(found.problem, found.r) < 1e-6
        export_fclib(tmp_path / "dwell.hdf5", accepted)
        np.testing.assert_array_equal(read_solution(tmp_path / "dwell.hdf5")["r"], found.r)


def test_contacts_that_are_closed_without_force_are_written_too(dwell):
    _, (*_, last) = dwell
    idle = replace(last.solved, r=np.zeros_like(last.solved.r))
    assert len(contact_problem(replace(last, solved=idle)).candidate) == 9


def test_far_tools_leave_the_nearest_candidate():
    """Nothing touches and nothing is near: the problem is that of the nearest candidates, without force."""
    far = replace(SCENE.tools[0], point=(0.0, 50.0))
    scene = replace(SCENE, tools=(far,))
    accepted = next(march(scene, Schedule(5), Control(NewtonForm(), (Tangent(), Dissipation()))))
    found = contact_problem(accepted)
    assert 1 <= len(found.candidate) < 17
    assert not found.r.any()


SOLVERS = [TrescaFixedPoint(), DeSaxceFixedPoint(), Newton(AlartCurnier()), Newton(NaturalMap()), None]


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda s: "auto" if s is None else s.name)
def test_fixed_points_newton_and_solve_give_the_marchs_tractions(solver, exported):
    _, problem, own = exported
    answer = solve(problem, LIMITS) if solver is None else run(solver, problem, LIMITS)
    assert np.abs(answer.r - own).max() <= 1e-8 * np.abs(own).max(), answer.reason


def test_the_proximal_point_reaches_them(exported):
    _, problem, own = exported
    answer = run(ProximalPoint(), problem, Limits(tol=1e-10))
    assert answer.converged, answer.reason
    assert np.abs(answer.r - own).max() <= 1e-6 * np.abs(own).max()


@pytest.mark.slow
@pytest.mark.parametrize(("solver", "steps"), [(GaussSeidel(), 40), (Uzawa(), 400)], ids=["gauss-seidel", "uzawa"])
def test_first_order_solvers_come_nearer_and_are_named_as_not_converged(solver, steps, exported):
    """Their errors are 0.83 and 0.30 then, and half a minute does not bring them to an end."""
    _, problem, own = exported
    first, last = (run(solver, problem, Limits(tol=1e-10, iterations=n)) for n in (steps // 4, steps))
    assert np.abs(last.r - own).max() < 0.9 * min(np.abs(first.r - own).max(), np.abs(own).max())
    assert not last.converged
    assert f"{solver.name} stopped" in last.reason
    assert "iteration limit" in last.reason


@pytest.mark.parametrize("solver", [None, Newton(AlartCurnier()), ProximalPoint()], ids=["auto", "newton", "proximal"])
def test_the_march_takes_any_of_them_for_its_coupling(solver):
    control = Control(Delassus(solver), fallbacks=())
    scene = upsetting(mu=0.3, reduction=0.1, elements=4)
    for own, other in zip(upset(0.3), march(scene, path(0.1, 5), control), strict=True):
        np.testing.assert_allclose(other.solved.r, own.solved.r, atol=1e-5 * own.solved.r.max())
        np.testing.assert_allclose(other.state.nodes, own.state.nodes, atol=1e-6)


def test_a_solver_that_gives_up_fails_the_pass_with_its_own_words():
    scene = upsetting(mu=0.3, reduction=0.1, elements=2)
    control = Control(Delassus(GaussSeidel(), Limits(tol=1e-14, iterations=1)), cuts=0)
    accepted = next(march(scene, path(0.1, 5), control))
    assert accepted.form.value == "newton"
    assert "delassus: " in accepted.reason
    with pytest.raises(Exception, match="failed") as caught:
        list(march(scene, path(0.1, 5), Control(control.form, fallbacks=(), cuts=0)))
    assert not isinstance(caught.value, NotConverged)


def test_welded_points_are_refused():
    system = fresh(np.inf, reduction=0.1, elements=2)
    accepted = next(march(system.body.scene, path(0.1, 2)))
    with pytest.raises(ProgramError, match="welded"):
        contact_problem(accepted)


def test_a_tool_that_a_force_drives_is_named():
    """A support holds the body; the message said that the contacts alone do not determine the motion."""
    scene = upsetting(mu=0.1, elements=2)
    punch = replace(scene.tools[0], travel=(0.0, 0.0), driven_by=Force((0.0, -100.0)))
    accepted = next(march(replace(scene, tools=(punch,)), Schedule(1)))
    with pytest.raises(ProgramError, match="a tool that a force or moment drives"):
        contact_problem(accepted)


@pytest.mark.parametrize("asked", [contact_problem, lambda junk: conic_program(junk, Dissipation())])
def test_what_is_no_increment_is_refused(asked):
    refused(lambda: asked(None), "accepted = None: must be an Accepted")
