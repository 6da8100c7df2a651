"""What a pass of `tangent` solves, its program or the model in its place, and how far it goes along its step."""

from dataclasses import replace
from functools import cache
from itertools import islice

import numpy as np
import pytest

from bipot import (
    Control,
    Dissipation,
    Element,
    Force,
    Geometry,
    InvertedElement,
    Linear,
    Schedule,
    Tangent,
    march,
    upsetting,
)
from bipot.conic.through_cvxpy import Cvxpy
from bipot.forms import Cache
from bipot.forms.posed import Posed
from bipot.programs.fixed_point import Route
from studies.verification.cases.stick_radius import BETA, ELASTIC
from studies.verification.indentation import FAR, pressed

NEAR, ASTRAY, AWAY = 1e-5, 1e-3, 0.1
"""Distances from the solution: of the exact linearisation and of the polish alone, of the former, and of neither."""


@cache
def seen():
    """A pass in the middle of an increment in which the body flows."""
    trials = []
    scene = upsetting(mu=0.3, elements=2, reduction=0.1)
    for _ in march(
        scene, Schedule(4, first=0.01, settling=1, growth=4.0), Control(Dissipation(), ()), observe=trials.append
    ):
        pass
    return next(trial for trial in reversed(trials) if trial.state.distance is None)


def stepped(form, distance, rose=False):
    """The pass by a form that believes it is at this distance from the solution."""
    trial = seen()
    return form.step(trial.iterate, trial.r, replace(trial.state, cache=Cache(), distance=distance, rose=rose))[0]


def same(step, other):
    return np.array_equal(step.iterate.x, other.iterate.x)


def test_only_near_a_solution_does_the_exact_linearisation_take_the_place_of_the_model():
    """Far from it the energy, which is convex, leads there; so it does after a pass that led no nearer."""
    form = Tangent(halvings=0)
    model = stepped(form, None)
    assert same(stepped(form, AWAY), model)
    assert not same(stepped(form, ASTRAY), model)
    assert same(stepped(form, NEAR, rose=True), model)


def test_the_program_is_solved_where_newton_alone_may_go_astray():
    """After a pass that rose, but not next to a solution; through cvxpy always, which is there to be compared with."""
    assert stepped(Tangent(), None).iterations == 0
    assert stepped(Tangent(), NEAR, rose=True).iterations == 0
    assert stepped(Tangent(), ASTRAY, rose=True).iterations > 0
    assert all(stepped(Tangent(solver=Cvxpy()), distance).iterations > 0 for distance in (None, ASTRAY))


def test_the_polish_of_the_program_has_exact_friction_unless_it_is_to_have_none():
    assert stepped(Tangent(), ASTRAY, rose=True).coupled.route is Route.EXACT
    assert stepped(Tangent(coupled=False), None).coupled.route is Route.PLAIN


def test_what_leaves_a_part_of_a_driving_force_unbalanced_is_far_from_a_solution():
    """Equilibrium may seem near where a force is small, though nothing carries it."""
    scene = upsetting(mu=0.3, elements=2, hardening=Linear(300.0, 1000.0))
    punch = replace(scene.tools[0], travel=(0.0, 0.0), candidates=("top",), driven_by=Force((0.0, -30_000.0)))
    *_, last = march(replace(scene, tools=(punch,)), Schedule(2), Control(Tangent(), ()))
    iterate = last.solved.iterate

    def solved(part, distance):
        r = part * last.solved.r
        return Tangent(halvings=0).step(iterate, r, replace(Posed.of(iterate, r, Cache()), distance=distance))[0]

    assert not same(solved(0.995, NEAR), solved(0.995, None))
    assert same(solved(0.985, NEAR), solved(0.985, None))


@pytest.mark.parametrize("halvings", [0, 3])
def test_a_step_that_leads_away_is_halved_and_then_not_exact(halvings, monkeypatch):
    """Three times the way to the solution leads twice as far off on the other side, half of that to half as far."""
    trial = seen()
    solved = stepped(Tangent(), None)
    units = trial.state.units
    ways = 3 * (solved.iterate.x - trial.iterate.x), 3 * (solved.r - trial.r)[trial.state.near]
    answer = (trial.iterate.x + ways[0]) / units.length, (trial.r[trial.state.near] + ways[1]) / units.force
    monkeypatch.setattr("bipot.forms.tangent.coupled", lambda *_: answer)
    step = stepped(Tangent(halvings=halvings), None)
    part = 0.5 if halvings else 1.0
    np.testing.assert_allclose(step.iterate.x, trial.iterate.x + part * ways[0], rtol=1e-12)
    np.testing.assert_allclose(step.r[trial.state.near], trial.r[trial.state.near] + part * ways[1], rtol=1e-9)
    assert step.coupled.route is (Route.PLAIN if halvings else Route.EXACT)


def test_a_step_all_of_whose_trials_fold_the_body_says_so(monkeypatch):
    trial = seen()
    answer = 1e6 * np.ones_like(trial.iterate.x) * np.arange(len(trial.iterate.x)), trial.r[trial.state.near]
    monkeypatch.setattr("bipot.forms.tangent.coupled", lambda *_: answer)
    with pytest.raises(InvertedElement):
        stepped(Tangent(), None)


@pytest.mark.slow
def test_a_body_far_stiffer_away_from_the_contact_takes_no_cone_program():
    """Elements grow away from it, and on a ring with the radius: the mean stiffness says nothing of its nodes."""
    scene = pressed(Geometry.AXISYMMETRIC, 1e-3, ELASTIC, BETA, 16, Element.Q4, FAR / 10)
    steps = list(islice(march(scene, Schedule(8), Control(Tangent(), ())), 3))
    assert sum(step.passes for step in steps) <= 6
    assert steps[-1].number == 3
    assert steps[-1].state.tau == 3 / 8
