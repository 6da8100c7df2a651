"""Marches whose paths turn, hold and go on: the flow that is carried on, and what it dissipates."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot import (
    Control,
    Elasticity,
    FlatTool,
    Geometry,
    Locate,
    Newton,
    Perfect,
    Scene,
    Schedule,
    Symmetry,
    VonMises,
    brick,
    march,
    upsetting,
)
from bipot.control.attempting import Dissipated
from bipot.errors import IncrementFailed
from bipot.forms import Tangent
from bipot.laws.flow import Integration
from tests.scenes import Listed, run

REDUCTION = 0.02


SCENE = upsetting(mu=0.1, reduction=REDUCTION, elements=4)


FIRST = 0.001 / REDUCTION


CLOSE = 1e-7
"""What a ratio measured, not known, may change in a force: backward Euler misses ten times that at least."""


def with_punch(scene, **changes):
    return replace(scene, tools=(replace(scene.tools[0], **changes), *scene.tools[1:]))


def marched(scene, schedule, integration=Integration.BDF2, form=None, start=None):
    return list(march(scene, schedule, Control(form or Newton(), integration=integration), start))


def forces(steps):
    return np.array([-a.tool_forces[0, 1] for a in steps])


def dissipation(a):
    """sigma : de_p (e, q) at the end of an increment, de_p as the states carry it."""
    before = a.solved.response.kinematics.turned(a.start.plastic_strain)
    return np.vecdot(a.state.stress, a.state.plastic_strain - before)


def test_a_punch_that_starts_inside_the_body_presses_on_as_with_backward_euler():
    """The first increment removes 0.1 mm of penetration, in a hundredth of which the tools move by the others."""
    scene = with_punch(upsetting(mu=0.3, reduction=0.006, elements=4), point=(0.0, 4.9))
    euler, bdf = (marched(scene, Schedule(6), integration) for integration in Integration)
    np.testing.assert_allclose(forces(bdf)[:5], [25056, 25087, 25118, 25148, 25178], atol=1)
    np.testing.assert_allclose(forces(bdf), forces(euler), rtol=1e-5)
    np.testing.assert_allclose([a.energies.elastic for a in bdf], [a.energies.elastic for a in euler], rtol=1e-3)


@pytest.mark.parametrize("increments", [4, 10, 20])
def test_where_a_path_turns_by_an_angle_forces_are_those_of_the_new_direction(increments):
    """A cube pressed along z, then along x, without friction: rigid-plastic, the two flows are at 60 degrees."""
    tools = (
        FlatTool((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (-0.2, 0.0, 0.0), ("right",), 0.0, ((0, 0), (0.5, 0), (1, 1))),
        FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.2), ("top",), 0.0, ((0, 0), (0.5, 1), (1, 1))),
    )
    supports = Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)
    steel = VonMises(Elasticity(210e3, 0.3), Perfect(100.0))
    scene = Scene(brick(1.0, 1.0, 1.0, 1, 1, 1), Geometry.SOLID, steel, supports, tools)
    after = [a for a in marched(scene, Schedule(increments, landings=(0.5,))) if a.state.tau > 0.5]
    for a in after:
        width, _, height = np.ptp(a.state.nodes, axis=0)
        pushed = -a.tool_forces[0, 0] * width, -a.tool_forces[1, 2] * height
        np.testing.assert_allclose(pushed, np.array([2.0, 1.0]) * 100.0 / np.sqrt(3), rtol=0.06)


@pytest.mark.parametrize("increments", [20, 21, 40, 80])
@pytest.mark.parametrize("locate", [None, Locate()])
def test_where_a_whole_face_has_landed_forces_are_those_of_the_new_direction(increments, locate):
    """A cube pressed along z until its side meets a wall: then plane strain, sigma_Y/sqrt(3) on the wall, twice on top.

    The landing is somewhere in the first increment with a force on the wall; the second begins behind it.
    """
    tools = (
        FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.4), ("top",), 0.0),
        FlatTool((1.05, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), ("right",), 0.0),
    )
    supports = Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)
    steel = VonMises(Elasticity(210e3, 0.3), Perfect(100.0))
    scene = Scene(brick(1.0, 1.0, 1.0, 1, 1, 1), Geometry.SOLID, steel, supports, tools)
    control = Control(Newton(), locate=locate)
    met = [a for a in march(scene, Schedule(increments, first=1 / 400), control) if a.tool_forces[1, 0] < 0]
    _, second, *others = met
    # Where the landing is not located, the first increment has turned the flow in part already.
    for a, within in ((second, 0.06 if locate else 0.025), *((other, 0.02) for other in others)):
        width, depth, height = np.ptp(a.state.nodes, axis=0)
        pressures = -a.tool_forces[1, 0] / (depth * height), -a.tool_forces[0, 2] / (width * depth)
        np.testing.assert_allclose(pressures, np.array([1.0, 2.0]) * 100.0 / np.sqrt(3), rtol=within)


@cache
def turning():
    """A punch that turns back, and a tool a metre away that goes on."""
    scene = with_punch(SCENE, candidates=("top",), path=((0.0, 0.0), (0.5, 1.0), (1.0, 0.9)))
    far = FlatTool((1000.0, 0.0), (-1.0, 0.0), (-10.0, 0.0), ("side",), 0.1)
    return replace(scene, tools=(*scene.tools, far)), Schedule(10, first=FIRST, settling=2, landings=(0.5,))


def test_a_tool_that_touches_nothing_does_not_hide_that_the_punch_turns_back():
    scene, schedule = turning()
    steps = marched(scene, schedule, form=Tangent())
    (top,) = (a for a in steps if a.state.tau == 0.5)
    unloading = [a for a in steps if a.state.tau > 0.5]
    assert top.state.flow.strain.any(axis=-1).all()
    assert forces(unloading)[0] < 0.9 * forces([top])[0]
    for a in unloading:
        np.testing.assert_array_equal(a.state.peeq, top.state.peeq)
        assert not a.state.flow.strain.any()


def test_while_the_punch_holds_nothing_happens_and_then_the_flow_goes_on():
    scene = with_punch(SCENE, path=((0.0, 0.0), (0.4, 0.8), (0.7, 0.8), (1.0, 1.1)))
    schedule = Schedule(20, first=FIRST, settling=2, landings=(0.4, 0.7))
    euler, bdf = (marched(scene, schedule, integration) for integration in Integration)
    (top,) = (a for a in bdf if a.state.tau == 0.4)
    held = [a for a in bdf if 0.4 < a.state.tau <= 0.7]
    assert len(held) > 3
    np.testing.assert_allclose(forces(held), forces([top])[0], rtol=1e-7)
    for a in held:
        np.testing.assert_allclose(a.state.peeq, top.state.peeq, atol=1e-7 * top.state.flow.peeq.max())
    np.testing.assert_allclose(forces(bdf)[5:], forces(euler)[5:], rtol=1e-5)


@pytest.mark.parametrize("slower", [1.0, 0.5, 0.2])
def test_how_fast_the_path_is_run_through_does_not_matter(slower):
    """The same travels of the punch, once in even pseudo-time and once in increments of one length."""
    bend = 0.5 / (0.5 + 0.5 * slower)
    even = with_punch(SCENE, path=((0.0, 0.0), (1.0, 1.0)))
    bent = with_punch(SCENE, path=((0.0, 0.0), (0.5, bend), (1.0, 1.0)))
    schedule = Schedule(16, first=0.05, settling=2, landings=(0.5,))
    travels = np.interp(schedule.times(), (0, 0.5, 1), (0, bend, 1))
    evenly = Listed(1, ends=tuple(travels.tolist()))
    np.testing.assert_allclose(forces(marched(bent, schedule)), forces(marched(even, evenly)), rtol=CLOSE)


def test_a_march_resumed_where_the_punch_turns_back_carries_nothing_on():
    scene, schedule = turning()
    whole = marched(scene, schedule, form=Tangent())
    (top,) = (a.state for a in whole if a.state.tau == 0.5)
    resumed = marched(scene, schedule, form=Tangent(), start=top)
    np.testing.assert_allclose(forces(resumed), forces(whole)[-len(resumed) :], rtol=1e-5)
    assert all((a.state.peeq == top.peeq).all() for a in resumed)


@pytest.mark.parametrize(
    ("scene", "schedule"),
    [
        (with_punch(upsetting(mu=0.3, reduction=0.006, elements=4), point=(0.0, 4.9)), Schedule(6)),
        (upsetting(mu=0.3, elements=5), Schedule(10, first=0.001 / 0.45)),
    ],
    ids=["inside", "folding"],
)
def test_no_point_dissipates_less_than_nothing(scene, schedule):
    plastic = [dissipation(a) for a in marched(scene, schedule)]
    assert min(d.min() for d in plastic) > -1e-12 * max(d.max() for d in plastic)


def test_dissipation_is_that_of_the_energies_and_its_sign_is_told():
    steps = run(0.3)
    a = steps[-1]
    found = Dissipated.of(a.start, a.solved)
    assert found.plastic == pytest.approx(np.vdot(a.solved.response.kinematics.volume, dissipation(a)), rel=1e-12)
    assert found.plastic > 0
    assert found.friction > 0
    assert found.scale > found.plastic
    assert not found.negative(1e-7, friction=True)
    backwards = Dissipated.of(a.start, replace(a.solved, r=a.solved.r * (1, -1)))
    assert backwards.friction == -found.friction
    assert "friction's dissipation is negative" in str(backwards.negative(1e-7, friction=True))
    assert not backwards.negative(1e-7, friction=False)
    less = replace(
        a.start, plastic_strain=a.start.plastic_strain + 2 * (a.state.plastic_strain - a.start.plastic_strain)
    )
    said = str(Dissipated.of(less, a.solved).negative(1e-7, friction=True))
    assert said.startswith("plastic dissipation is neg")


def test_what_a_weld_leaves_of_zero_is_no_friction():
    """Its slip is round-off of the motion, and its force may be any."""
    (a,) = marched(with_punch(SCENE, mu=np.inf), Schedule(1))
    at = a.solved.iterate
    blurred = replace(a.solved, iterate=at.increment.at(at.x * (1 + 1e-6)))
    assert Dissipated.of(a.start, blurred).friction == 0.0


def test_a_march_whose_dissipation_is_negative_ends_in_words(monkeypatch):
    monkeypatch.setattr(Dissipated, "of", staticmethod(lambda *_: Dissipated(-1.0, 0.0, 1.0)))
    with pytest.raises(IncrementFailed, match="plastic dissipation is negative"):
        next(march(SCENE, Schedule(2), Control(Newton(), (), cuts=0)))


def test_a_body_that_turns_round_is_solved_without_its_last_flow():
    """Where a path turns its rates are others; elastic release by a fifth of it takes no failed attempt."""
    scene = with_punch(upsetting(mu=0.1, reduction=0.3, elements=4), path=((0.0, 0.0), (0.5, 1.0), (1.0, 0.9)))
    back = next(a for a in march(scene, Schedule(4), Control(Newton())) if a.state.tau > 0.5)
    assert back.passes <= 8
    assert not back.reasons
    assert not back.solved.response.returned.plastic.any()
    assert np.all(back.tool_forces == 0)


def test_flow_that_goes_on_past_a_corner_of_the_path_is_carried_on():
    """At two thirds of the speed before: the flow is the last one by the ratio of travels, not of pseudo-times."""
    scene = with_punch(SCENE, path=((0.0, 0.0), (0.5, 0.6), (1.0, 1.0)))
    steps = marched(scene, Schedule(40))
    corner = next(a for a in steps if abs(a.start.tau - 0.5) < 1e-9)
    straight = marched(
        SCENE, Listed(1, ends=tuple(float(np.interp(a.state.tau, (0, 0.5, 1), (0, 0.6, 1))) for a in steps))
    )
    assert corner.solved.response.state is not corner.start
    np.testing.assert_allclose(forces(steps), forces(straight), rtol=1e-5)


@pytest.mark.parametrize("mu", [0.3, np.inf])
def test_the_scale_of_dissipation_is_the_energy_taken_up_and_stored(mu):
    """By E and nu: twice the stored energy is ((1 + nu) sigma : sigma - nu (tr sigma)^2)/E. A weld dissipates none."""
    a = run(mu)[-1]
    sigma, kin = a.state.stress, a.solved.response.kinematics
    young, nu = 210_000.0, 0.3
    stored = ((1 + nu) * (sigma**2).sum(axis=-1) - nu * sigma[..., :3].sum(axis=-1) ** 2) / (2 * young)
    taken = np.abs((sigma * kin.strain).sum(axis=-1))
    found = Dissipated.of(a.start, a.solved)
    assert found.scale == pytest.approx(float((kin.volume * (taken + stored)).sum()), rel=1e-9)
    assert (found.friction == 0.0) == np.isinf(mu)
