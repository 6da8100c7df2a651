"""How an increment ends that cannot be solved: as a certificate or as a sentence, never as a raw exception."""

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest

from bipot.checks import refusals
from bipot.checks.diagnosis import cornered
from bipot.checks.free import free
from bipot.conic.solver import Accuracy
from bipot.conic.through_cvxpy import Cvxpy, solve_stated
from bipot.control import attempting
from bipot.coulomb import CoulombProblem
from bipot.errors import IncrementFailed, NotConverged, ProgramError, Refused
from bipot.fem.reduction import Geometry
from bipot.forms import (
    Delassus,
    Dissipation,
    FormName,
    Newton,
    Optimiser,
    Penalty,
    Tangent,
    Uzawa,
    delassus,
)
from bipot.increment import Limits
from bipot.iterate import Increment
from bipot.laws.hardening import Linear, Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import cylinder
from bipot.paper import upsetting
from bipot.programs.condensation import Reduced
from bipot.scene.loads import Traction
from bipot.scene.supports import Support
from bipot.tools.profiles import Union, wedge
from bipot.tools.surfaces import Plane
from bipot.tools.tool import ShapedTool
from studies import upsetting as study
from tests.scenes import posed, scene, tool

INF = float("inf")


UNDER = tool(point=(0.0, 0.0), normal=(0.0, 1.0), travel=(0.0, 0.0), candidates=("base",))


CUT_ONCE = Control(cuts=1)
GIVES_UP = Control(Newton(), (), Limits(passes=1), cuts=0)
"""One pass is never enough to meet the bounds."""


def last_words(scene, control=CUT_ONCE):
    """The message of the march's failure."""
    with pytest.raises(IncrementFailed) as failed:
        list(march(scene, Schedule(2), control))
    assert failed.value.state is not None
    return str(failed.value)


def unloaded(system):
    """How the system at rest may move where no load pushes it."""
    v = free(Increment(system, system.rest(), 0.0), np.zeros_like(system.rest().nodes))
    return None if v is None else system.body.space.spread(v)


def test_a_solver_that_stops_without_an_answer_is_a_program_error(monkeypatch):
    def stops(*_, **__):
        raise cp.SolverError("Solver 'CLARABEL' failed.")

    stated = posed().dissipation.statement()
    monkeypatch.setattr(cp.Problem, "solve", stops)
    with pytest.raises(ProgramError, match="conic solver stopped without an answer"):
        solve_stated(stated, Accuracy())


@pytest.mark.slow
@pytest.mark.parametrize(
    "size",
    [["--elements", "1", "--increments", "2", "--reduction", "0.1"], ["--fast"]],
    ids=["tiny", "fast"],
)
def test_huge_friction_from_the_command_line_ends_with_an_answer_or_a_sentence(size, tmp_path, capsys):
    """It escaped as ``cvxpy.error.SolverError``, without state, fallback or cut."""
    code = study.main(["--mu", "1e9", *size, "--out", str(tmp_path)])
    assert code in (0, 2)
    assert code == 0 or capsys.readouterr().err.startswith("error: increment from tau")


def test_a_solver_that_always_breaks_down_leaves_the_state_and_is_cut(monkeypatch):
    def stops(*_, **__):
        raise cp.SolverError("Solver 'CLARABEL' failed.")

    monkeypatch.setattr(cp.Problem, "solve", stops)
    form = Tangent(solver=Cvxpy())
    words = last_words(scene(), Control(form, (), cuts=1))
    assert "stopped without an answer" in words
    fallen = next(march(scene(), Schedule(2), Control(form, (Newton(),))))
    assert fallen.form is Newton.name
    assert "stopped without an answer" in fallen.reason


@pytest.mark.parametrize(
    ("changes", "motion"),
    [
        ({}, None),
        ({"supports": (Support("base", 1),)}, None),
        ({"supports": (Support("base", 1),), "tools": (tool(mu=0.0),)}, (1, 0)),
        ({"supports": (Support("left", 0),)}, (0, -1)),
        ({"supports": (), "tools": (tool(), UNDER)}, None),
        (
            {
                "supports": (),
                "tools": (tool(mu=0.0), tool(mu=0.0, point=(0.0, 0.0), normal=(0.0, 1.0), candidates=("base",))),
            },
            (1, 0),
        ),
        ({"supports": (Support("left", 0),), "tools": (tool(mu=0.0), UNDER)}, None),
        # A weld neither opens nor slips.
        ({"supports": (), "tools": (replace(UNDER, mu=INF),)}, None),
    ],
)
def test_free_motion(changes, motion):
    made = system_of(scene(**changes))
    found = unloaded(made)
    if motion is None:
        assert found is None
    else:
        assert found is not None
        np.testing.assert_allclose(
            found * np.sign(found @ motion)[:, None], np.tile(motion, (len(found), 1)), atol=1e-9
        )


def test_a_free_body_may_turn_too():
    """Pushed from above and held along one point's motion only, the body turns away."""
    made = system_of(scene(supports=()))
    assert unloaded(made) is not None


def test_about_an_axis_only_the_axial_shift_is_rigid():
    geometry = {"geometry": Geometry.AXISYMMETRIC, "mesh": cylinder(1.0, 1.0, 2, 2, element=Element.Q8)}
    loose = system_of(scene(**geometry, supports=(Support("axis", 0),)))
    moved = unloaded(loose)
    assert moved is not None
    np.testing.assert_allclose(moved, np.tile((0, -1), (len(moved), 1)), atol=1e-9)
    held = system_of(scene(**geometry, supports=(Support("axis", 0), Support("base", 1))))
    assert unloaded(held) is None
    assert unloaded(system_of(upsetting(mu=0.0))) is None


def test_a_body_that_starts_inside_a_tool_is_named_as_that():
    words = last_words(scene(tools=(tool(point=(0.0, 0.1)),)))
    assert "The body starts inside tools[0], node" in words
    assert "by 0.9: move the tool off the body, or the mesh." in words
    assert "more increments" not in words


def test_a_slight_overlap_at_rest_is_not_the_cause_where_tools_go_much_farther():
    """The tool goes by nine tenths of the height at once, a hundred thousand times the overlap."""
    words = last_words(scene(tools=(tool(point=(0.0, 1.0 - 1e-5), travel=(0.0, -0.9)),)), Control(cuts=0))
    assert "starts inside" not in words
    assert "more increments" in words


def test_a_body_held_by_nothing_is_named_as_that():
    """Frictionless between two tools: it slides away along them."""
    across = tool(mu=0.0, point=(0.0, 0.0), normal=(0.0, 1.0), travel=(0.0, 0.0), candidates=("base",))
    words = last_words(scene(supports=(), tools=(tool(mu=0.0), across)), GIVES_UP)
    assert "Nothing holds the body against moving along (1, 0)" in words
    assert "more increments" not in words


@pytest.mark.parametrize("load", [(0.0, 1.0), (0.0, -1.0)])
def test_a_load_on_a_body_that_nothing_holds_is_no_limit_load(load):
    """Whichever way it pushes, the body goes there as a whole; less of the load would not be carried either."""
    loads = (Traction("top", load),)
    words = last_words(scene(supports=(Support("left", 0),), tools=(), loads=loads), GIVES_UP)
    assert f"Nothing holds the body against moving along (0, {load[1]:.0f})" in words
    words = last_words(scene(supports=(), tools=(), loads=loads), GIVES_UP)
    assert f"Nothing holds the body against moving along (0, {load[1]:.0f}): add" in words


@pytest.mark.parametrize("load", [(1.0, -1.0), (1.0, 0.0), (-0.05, -1.0)])
def test_a_load_along_a_smooth_floor_is_held_by_nothing_though_it_presses_the_body_down(load):
    floor = tool(mu=0.0, point=(0.0, 0.0), normal=(0.0, 1.0), travel=(0.0, 0.0), candidates=("base",))
    words = last_words(scene(supports=(), tools=(floor,), loads=(Traction("top", load),)), GIVES_UP)
    assert f"Nothing holds the body against moving along ({np.sign(load[0]):.0f}, 0)" in words


def test_a_body_that_runs_away_is_refused(monkeypatch):
    """The punch moves it by 2.4 % of size and travel; ten times them is no usual end."""
    monkeypatch.setattr(refusals, "RUNAWAY", 0.03)
    next(march(scene(), Schedule(2), CUT_ONCE))
    monkeypatch.setattr(refusals, "RUNAWAY", 1e-3)
    assert "the body runs away by 0.0" in last_words(scene())


def test_where_the_scene_shows_no_reason_more_increments_are_advised():
    words = last_words(scene(), GIVES_UP)
    assert words.endswith("Use more increments, or a mesh that is less distorted there.")


@pytest.mark.parametrize(("room", "crushed"), [(0.01, True), (1.0, False)])
def test_a_body_that_fills_its_die_is_told_how_much_volume_it_has_lost(room, crushed):
    """A wall beside it leaves less room than the volume that a punch displaces."""
    wall = tool(point=(1.0 + room, 0.0), normal=(-1.0, 0.0), travel=(0.0, 0.0), candidates=("right",))
    filled = scene(tools=(tool(travel=(0.0, -0.1)), wall))
    state = list(march(filled, Schedule(10, landings=(0.9,)), Control(Newton())))[-2].state
    with pytest.raises(IncrementFailed) as failed:
        list(march(filled, Schedule(1), GIVES_UP, start=state))
    assert ("has lost 8% of its volume: give it more room" in str(failed.value)) == crushed


def test_a_foam_that_loses_volume_as_it_flows_freely_does_not_fill_a_die():
    """Its yield stress is a fifth of its modulus: it lost a third of its volume with nothing at its sides."""
    foam = VonMises(Elasticity(100.0, 0.0), Linear(20.0, 1.0))
    pressed = scene(material=foam, tools=(tool(travel=(0.0, -0.4), mu=0.0),))
    state = list(march(pressed, Schedule(4, landings=(0.9,)), Control(Newton())))[-2].state
    assert system_of(pressed).body.space.gradients(state.nodes).volume.sum() < 0.9
    with pytest.raises(IncrementFailed) as failed:
        list(march(pressed, Schedule(1), GIVES_UP, start=state))
    assert "lost" not in str(failed.value)


def test_what_one_form_refuses_says_more_than_that_the_next_one_does_not_converge(monkeypatch):
    def tried(increment, form, *rest):
        raise Refused("no answer", "Do it.") if form.name is FormName.NEWTON else NotConverged("cycles")

    monkeypatch.setattr(attempting, "solve_facing", tried)
    scene = upsetting(mu=0.0, reduction=0.01, elements=1)
    with pytest.raises(IncrementFailed, match=r"failed \(newton: no answer\)\. Do it\."):
        next(march(scene, Schedule(1), Control(Newton(), (Tangent(),), cuts=0)))


def test_where_round_off_of_the_volume_change_is_the_cause_a_lower_poisson_s_ratio_is_advised():
    words = last_words(scene(material=VonMises(Elasticity(210e3, 0.4999999), Perfect(1e-3))), GIVES_UP)
    assert "Lower Poisson's ratio: at 1 - 2 nu = 2e-07" in words


@pytest.mark.parametrize("form", [Penalty(1e5, 1e5), Uzawa(1e5, 1e5), Penalty(1e5, 1e5, Optimiser.CVXPY), Delassus()])
def test_forms_that_do_not_weld_say_so(form):
    assert "weld" in last_words(scene(tools=(tool(mu=INF),)), Control(form, (), cuts=0))


def test_delassus_does_not_work_on_a_stiffness_that_is_round_off():
    """The contact problem of a body that only its contacts hold was 1e16 large, and no solver had time enough."""
    words = last_words(scene(supports=(), tools=(tool(), UNDER)), Control(Delassus(), (), cuts=0))
    assert "delassus: the stiffness is singular" in words
    fallen = next(march(scene(supports=(), tools=(tool(), UNDER)), Schedule(2), Control(Delassus())))
    assert fallen.form is Newton.name
    assert not fallen.strayed


def unsolvable(program):
    """None of its contacts can slip the way it must."""
    c = program.contact.rows.count
    W = np.kron(np.ones((c, c)) / c + np.eye(c), np.ones((2, 2)))
    return Reduced(CoulombProblem(W, [-1.0, 0.0] * c, 2.0, 2), program.f, np.zeros((len(program.f), 2 * c)))


def test_delassus_gives_up_by_steps_and_not_by_the_clock(monkeypatch):
    """It took 9 to 16 s a pass, a share of what time was left."""
    monkeypatch.setattr(delassus, "reduce", unsolvable)
    words = last_words(scene(), Control(Delassus(), (), cuts=0))
    assert "tresca-Anderson stopped at residual" in words
    assert "time" not in words


def test_dissipation_and_tangent_do_weld():
    for form in (Tangent(), Dissipation(), Newton()):
        *_, last = march(scene(tools=(tool(mu=INF),)), Schedule(1, first=0.1, settling=1), Control(form, ()))
        assert last.state.tau == 1


def in_a_die(face, travel):
    """A cylinder, its base on the floor, in a die of that face that comes down."""
    held = Support("axis", 0), Support("base", 1)
    tools = (ShapedTool(face, (0.0, -travel), ("top", "side"), 0.0),)
    return scene(mesh=cylinder(1.0, 1.0, 2, 2), geometry=Geometry.AXISYMMETRIC, supports=held, tools=tools)


def test_a_node_in_a_sharp_corner_of_a_die_is_told():
    """The top goes on, the wall stops it, and one surface pushes along one of their normals."""
    die = Union((Plane((0.0, 1.0), (0.0, -1.0)), Plane((1.001, 0.0), (-1.0, 0.0))))
    with pytest.raises(IncrementFailed, match=r"Node 8 is at a sharp corner of tools\[0\].*give the corner a fillet"):
        list(march(in_a_die(die, 0.01), Schedule(4), Control(Newton(), (), cuts=1)))


def test_a_sharp_tip_on_the_axis_is_not_told():
    pressed = in_a_die(wedge((0.0, 1.0), 80.0, 4.0, 0.0), 0.004)
    accepted = next(march(pressed, Schedule(2), Control(Newton())))
    assert accepted.state.forces[:, 0].max() > 0
    assert cornered(Increment(system_of(pressed), accepted.state, 1.0)) is None
