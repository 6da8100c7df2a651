"""Curved tools that forces press: marches as by paths, balances recomputed; the tangent of all that is driven."""

import itertools
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.fem.reduction import Geometry
from bipot.forms import Delassus, Dissipation, Newton, Tangent
from bipot.forms.newton import Reuse
from bipot.increment import Limits
from bipot.iterate import Increment
from bipot.laws.flow import Integration
from bipot.marching import Control, march
from bipot.paths import Amplitude
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.surfaces import Plane
from tests.curved import TIGHT, apart, check_differences, dragged, forces, marched, pressed
from tests.scenes import refused

EXACT = replace(TIGHT, tool_equilibrium=1e-11)


@cache
def by_path(geometry):
    """A punch that goes its path."""
    return tuple(marched(pressed(geometry), increments=20, bounds=EXACT))


def by_force(geometry) -> Scene:
    """The punch driven by the force that it had on its path."""
    scene, whole = pressed(geometry), by_path(geometry)
    pushes = [(a.state.tau, float(a.tool_force(0)[1] / whole[-1].tool_force(0)[1])) for a in whole]
    force = Force((0.0, float(whole[-1].tool_force(0)[1])), Amplitude(((0.0, 0.0), *pushes)))
    return replace(scene, tools=(replace(scene.tools[0], travel=(0.0, 0.0), driven_by=force),))


@cache
def pushed(geometry):
    """That march by Newton."""
    return tuple(marched(by_force(geometry), increments=20, bounds=EXACT))


@pytest.mark.slow
@pytest.mark.parametrize("geometry", [Geometry.PLANE_STRAIN, Geometry.AXISYMMETRIC])
def test_a_punch_pressed_by_the_force_of_its_path_goes_the_path(geometry):
    one, other = by_path(geometry), pushed(geometry)
    gone = [a.tool_pose(0)[1] for a in other]
    np.testing.assert_allclose(gone, [-0.1 * a.state.tau for a in one], atol=1e-9)
    assert apart(forces(other), forces(one)) < 1e-8
    for a, b in zip(one, other, strict=True):
        np.testing.assert_allclose(b.state.nodes, a.state.nodes, atol=1e-9)
    # The work of a force that grows over what the punch goes; the same by either.
    np.testing.assert_allclose(other[-1].energies.work, one[-1].energies.work, rtol=1e-8)
    np.testing.assert_allclose(other[-1].energies.energy_error, one[-1].energies.energy_error, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("form", [Tangent(), Dissipation(), Delassus()], ids=lambda form: form.name.value)
def test_forms_agree_under_a_punch_that_a_force_presses(form):
    other = marched(by_force(Geometry.PLANE_STRAIN), form, increments=20)
    there = {round(a.state.tau, 9): a for a in other}
    one = pushed(Geometry.PLANE_STRAIN)
    # Of a force that is given the travel is the answer. Past a cut, but of the first contact, it is of other steps.
    ends = {round(a.state.tau, 9) for a in one}
    cut = min((tau for tau in there if tau > 0.1 and tau not in ends), default=1.0)
    alike = [a for a in one if a.state.tau <= cut]
    assert len(alike) >= 16
    gone = [there[round(a.state.tau, 9)].tool_pose(0)[1] for a in alike]
    assert apart(gone, [a.tool_pose(0)[1] for a in alike]) < 1e-4
    np.testing.assert_allclose(
        [there[round(a.state.tau, 9)].tool_forces[0, 1] for a in one], forces(one)[:, 1], rtol=1e-6
    )


def test_a_force_that_grows_many_times_as_fast_where_nodes_land_takes_few_passes():
    """The body resists more there: from what it went before, so many times as fast, Newton strayed."""
    control = Control(Newton(), (), Limits(EXACT), integration=Integration.BACKWARD_EULER)

    def begun(scene):
        return list(itertools.islice(march(scene, Schedule(20, first=0.01), control), 6))

    scene = pressed(Geometry.AXISYMMETRIC)
    one = begun(scene)
    pushes = [(a.state.tau, float(a.tool_force(0)[1])) for a in one]
    force = Force((0.0, -1.0), Amplitude(((0.0, 0.0), *((tau, -push) for tau, push in pushes), (1.0, -pushes[-1][1]))))
    other = begun(replace(scene, tools=(replace(scene.tools[0], travel=(0.0, 0.0), driven_by=force),)))
    assert max(a.solved.iterate.increment.past.quicker for a in other) > 50
    assert [a.cuts for a in other] == [0] * len(one)
    assert max(a.passes for a in other) < 10
    np.testing.assert_allclose([a.tool_pose(0)[1] for a in other], [-0.1 * a.state.tau for a in one], atol=1e-9)


@pytest.mark.slow
def test_newton_converges_quadratically_under_a_punch_that_a_force_presses():
    """With a new matrix in every pass, by the last three errors of an increment that are above round-off."""
    errors = dict[float, list[float]]()

    def observe(trial):
        errors.setdefault(trial.iterate.increment.tau, []).append(trial.step.error)

    newton, once = Newton(Reuse(0.0)), Integration.BACKWARD_EULER
    control = Control(newton, (), Limits(EXACT), integration=once)
    list(march(by_force(Geometry.PLANE_STRAIN), Schedule(20, first=0.01), control, observe=observe))
    last = [[e for e in one if e > 1e-12][-3:] for one in errors.values()]
    orders = [np.log(e[2] / e[1]) / np.log(e[1] / e[0]) for e in last if len(e) == 3 and e[0] < 1e-2 and e[1] < e[0]]
    assert len(orders) >= 5
    assert np.median(orders) > 1.6


DRIVEN: dict[str, dict[str, Any]] = {
    "a circle by a force": {"driven_by": Force((0.0, -100.0))},
    "a circle by a moment": {"turn": Turn(0.0, (0.4, 3.0), driven_by=Moment(5.0))},
    "a circle about another centre": {"turn": Turn(0.0, (0.1, 2.2), driven_by=Moment(5.0))},
    "by both": {"driven_by": Force((0.0, -100.0)), "turn": Turn(0.0, (0.1, 2.2), driven_by=Moment(5.0))},
    "a plane by a moment": {
        "surface": Plane((0.4, 1.0), (0.0, -1.0)),
        "turn": Turn(0.0, (0.4, 1.0), driven_by=Moment(5.0)),
    },
}


@pytest.mark.parametrize(
    "aslant", [(), (Support("right", (0.6, 0.8)), Support("left", (0.8, -0.6)))], ids=["", "slant"]
)
@pytest.mark.parametrize("name", DRIVEN)
def test_the_tangent_is_that_of_differences(name, aslant):
    """The balance of nodes and tools at frozen forces, and gaps, by every unknown; of nodes along own axes too."""
    scene = dragged(elements=2)
    scene = replace(scene, supports=(*scene.supports, *aslant))
    tool = replace(scene.tools[0], travel=(0.1, 0.0), path=((0, 0), (1, 1)), **DRIVEN[name])
    system = system_of(replace(scene, tools=(tool,)))
    increment, rng = Increment(system, system.rest(), 0.3), np.random.default_rng(0)
    x, count = 1e-3 * rng.normal(size=increment.size), len(system.body.scene.drives)
    x[-count:] = 2e-2
    assert np.isin(system.candidates.node, system.body.space.axes.nodes).any() == bool(aslant)
    r = (
        1e3
        * rng.normal(size=(len(system.candidates.node), 2))
        * np.column_stack([np.ones(len(system.candidates.node)), system.candidates.tangent_free])
    )
    K = check_differences(increment, x, r)
    np.testing.assert_allclose(K[-count:], K[:, -count:].T, atol=1e-9 * np.abs(K).max())


def test_what_no_drive_may_be_is_refused():
    wrong: Any = "much"
    refused(lambda: Moment(np.nan), "moment.value")
    refused(lambda: Moment(wrong), "moment.value = 'much': must be a number")
    refused(lambda: Moment(1e70), "moment.value")
    refused(lambda: Moment(1.0, wrong), "moment.amplitude")
    refused(lambda: Turn(0.0, (0.0, 0.0), driven_by=wrong), "turn.driven_by")
    refused(lambda: Turn(0.1, (0.0, 0.0), driven_by=Moment(1.0)), "turn.angle = 0.1: must be zero where a moment")
    down = Force((0.0, -1.0))
    refused(lambda: pressed(driven_by=down), "tool.travel .* across the force")
    refused(lambda: pressed(Geometry.AXISYMMETRIC, travel=(0.0, 0.0), driven_by=Force((1.0, -1.0))), "along the axis")
    refused(lambda: pressed(travel=(0.0, 0.0), driven_by=Force((0.5, -1.0))), r"tools\[0\].driven_by")
    inside = Circle((0.0, 2.99), 2.0)
    refused(
        lambda: pressed(surface=inside, travel=(0.0, 0.0), driven_by=down), r"tools\[0\].surface .* a force drives it"
    )
    turn = Turn(0.0, (0.4, 3.0), driven_by=Moment(1.0))
    refused(lambda: pressed(turn=replace(turn, centre=(0.0, 3.0))), r"tools\[0\].turn")
    into = Circle((0.4, 2.99), 2.0)
    scene = dragged()
    refused(lambda: replace(scene, tools=(replace(scene.tools[0], surface=into, turn=turn),)), "a moment drives it")


@pytest.mark.slow
def test_bounds_are_kept_by_every_increment():
    for accepted in pushed(Geometry.PLANE_STRAIN):
        assert max(accepted.solved.certificate.ratios(Bounds()).values()) <= 1
