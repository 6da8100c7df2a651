"""A scene without tools: at rest by every form, springback from a stressed start, results without tool columns."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.conic.through_cvxpy import Cvxpy
from bipot.control.landing import Locate
from bipot.control.reason import ReasonKind
from bipot.energy import Energies
from bipot.errors import ProgramError, SceneError
from bipot.exchange import contact_problem
from bipot.forms import Delassus, Dissipation, FormName, Newton, Optimiser, Penalty, Tangent, Uzawa, contact_penalty
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.results.columns import COURSE, FLOW_GAP, INCREMENT, MIN_JACOBIAN, OVERLAP, certificate, energies
from bipot.scene.supports import Support
from bipot.state import State
from tests.scenes import path, scene

BARE = scene(tools=())
FORMS = (Tangent(), Tangent(solver=Cvxpy()), Dissipation(), Newton(), Penalty(1e5, 1e5), Uzawa(1e5, 1e5))
FORMS += tuple(Penalty(1e5, 1e5, optimiser) for optimiser in Optimiser)


def certified(accepted):
    return all(ratio <= 1 for ratio in accepted.solved.certificate.ratios(Bounds()).values())


@pytest.mark.parametrize("form", FORMS, ids=repr)
def test_a_held_body_without_tools_stays_at_rest_by_every_form(form):
    run = list(march(BARE, Schedule(2), Control(form, (), locate=Locate())))
    assert [a.state.tau for a in run] == [0.5, 1.0]
    for accepted in run:
        assert certified(accepted)
        assert accepted.unique
        assert accepted.energies == Energies()
        assert accepted.tool_forces.shape == (0, 2)
        np.testing.assert_array_equal(accepted.state.nodes, BARE.mesh.nodes)
        assert not accepted.state.stress.any()


def test_the_form_that_solves_contact_problems_alone_says_that_there_is_none():
    first = next(march(BARE, Schedule(2), Control(Delassus())))
    assert first.form is FormName.NEWTON
    assert [reason.kind for reason in first.reasons] == [ReasonKind.UNSUITED]
    assert first.reason == "delassus: nothing may touch the body: there is no contact problem"
    assert first.unique


@pytest.mark.parametrize(("supports", "free"), [((Support("base", 1),), "1 rigid motion"), ((), "3 rigid motions")])
def test_the_position_of_a_body_that_nothing_holds_is_said_to_be_undetermined(supports, free):
    first = next(march(scene(tools=(), supports=supports), Schedule(1), Control(Dissipation())))
    assert first.solved.undetermined == (f"position in {free}",)
    np.testing.assert_allclose(first.state.nodes, BARE.mesh.nodes, rtol=0, atol=1e-15)


@cache
def pressed(mu):
    """A cylinder after upsetting by a tenth, and the state at its end with the tools taken away."""
    full = upsetting(mu=mu, reduction=0.1, elements=3)
    *_, end = march(full, path(0.1, 4), Control(Newton(), (Tangent(), Dissipation())))
    return full, released(end.state)


def released(state: State) -> State:
    """The same body at the start of another path, with nothing on it."""
    still = {"du": np.zeros_like(state.du), "length": 0.0, "flow": None}
    return replace(state, tau=0.0, gap=np.empty(0), forces=np.empty((0, 2)), **still)


def relaxed(mu, form):
    full, start = pressed(mu)
    run = list(march(replace(full, tools=()), Schedule(2), Control(form), start))
    assert all(map(certified, run))
    # Nothing is left to move.
    assert run[-1].passes <= 2
    assert not run[-1].solved.certificate.below_resolution(Bounds())
    return run


def test_without_friction_the_body_springs_back_to_no_stress():
    """Uniaxial stress sigma_Y is released: the height grows by exp(sigma_Y/E), the radius by exp(- nu sigma_Y/E)."""
    start = pressed(0.0)[1]
    end = relaxed(0.0, Newton())[-1].state
    assert np.abs(start.stress).max() == pytest.approx(300.0, rel=1e-6)
    assert np.abs(end.stress).max() < 1e-4 * 300.0
    growth = end.nodes.max(axis=0) / start.nodes.max(axis=0)
    np.testing.assert_allclose(np.log(growth), np.array([-0.3, 1.0]) * 300.0 / 210e3, rtol=1e-3)


def test_under_friction_residual_stress_is_left_the_same_by_both_forms_and_by_a_tool_that_leaves():
    """Nearly all of the way back is elastic: how the tool goes does not matter."""
    newton, dissipation = (relaxed(0.3, form)[0].state for form in (Newton(), Dissipation()))
    np.testing.assert_allclose(newton.stress, dissipation.stress, atol=1e-5 * 300.0)
    np.testing.assert_allclose(newton.nodes, dissipation.nodes, atol=1e-8)
    full, start = pressed(0.3)
    tool = full.tools[0]
    back = replace(tool, point=(0.0, 4.5), travel=(0.0, 0.05))
    system = system_of(replace(full, tools=(back,)))
    *_, end = march(full, path(0.1, 4), Control(Newton(), (Tangent(), Dissipation())))
    leaving = replace(end.state, tau=0.0, gap=system.candidates.distance(end.state.nodes, np.zeros((1, 2))))
    *_, left = march(system.body.scene, Schedule(10), start=leaving)
    assert not left.tool_forces.any()
    np.testing.assert_allclose(left.state.stress, newton.stress, atol=2e-3 * 300.0)
    assert 0.5 < np.abs(newton.stress).max() / np.abs(start.stress).max() < 0.9


def test_results_are_written_and_read_back(tmp_path):
    full, start = pressed(0.0)
    bare = replace(full, tools=())
    columns = (INCREMENT, *COURSE, FLOW_GAP, OVERLAP, MIN_JACOBIAN, *energies("J", 1e-3), *certificate("J", 1e-3))
    with Recorder(tmp_path / "run", bare, columns, {}, {}, start=start) as recorder:
        for accepted in march(bare, Schedule(2), start=recorder.start):
            recorder.record(accepted)
    state = open_results(tmp_path / "run").state()
    assert state.forces.shape == (0, 2)
    np.testing.assert_array_equal(state.nodes, accepted.state.nodes)
    assert list(march(bare, Schedule(2), start=state)) == []


def test_what_needs_a_contact_says_so():
    system = system_of(BARE)
    accepted = next(march(BARE, Schedule(1)))
    with pytest.raises(SceneError, match=r"scene\.tools = \(\): must be at least one"):
        contact_penalty(system.candidates)
    with pytest.raises(ProgramError, match="there is no contact problem"):
        contact_problem(accepted)
