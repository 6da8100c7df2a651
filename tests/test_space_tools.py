"""Shaped tools in space: derivatives, quadratic steps, all forms under a sphere, nodes in planes of symmetry."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot.forms import Delassus, Dissipation, Newton, Penalty, Tangent, Uzawa
from bipot.forms.base import Cache
from bipot.forms.newton import Reuse
from bipot.iterate import Increment
from bipot.system import system_of
from bipot.tools.poses import Force, Turn
from bipot.tools.profiles import Profile
from bipot.tools.revolved import RING, Revolved, roll, sphere
from bipot.tools.slips import SMALL, Slip
from bipot.tools.surfaces import Plane, frames
from bipot.tools.tool import FlatTool
from tests.curved import STEEL, TIGHT, apart, forces, marched
from tests.scenes import named
from tests.space import RUBBER, dented, rubbed
from tests.test_curved_forms import check_derivatives, derivative

TURN = Turn(0.3, (0.2, 0.4, 1.1), axis=(0.6, 0.0, 0.8))

SURFACES = {
    "sphere": sphere((0.1, 0.3, 1.5), 0.5),
    "hollow": sphere((-0.3, 0.1, -1.5), 2.9, concave=True),
    "roll": roll((0.3, 0.1, 1.4), (0.6, 0.8, 0.0), 0.4),
    "plane": Plane((0.0, 0.0, 1.0), (0.0, 0.6, -0.8)),
}


def start_of(scene, rng, tau=0.5):
    """An increment from rest, unknowns nearby and forces of any size on all candidates."""
    system = system_of(scene)
    increment = Increment(system, system.rest(), tau)
    r = 1e3 * rng.uniform(-1, 1, (len(system.candidates.node), 3))
    r[~increment.rows.rubs, 1:] = 0.0
    return increment, 0.01 * rng.uniform(-1, 1, increment.size), r


def test_a_ring_of_tips_is_all_around_the_axis():
    """Of a roller with rounded edges: each is as far from the axis and from its neighbours as others are."""
    point, axis = np.array([0.3, -0.2, 1.0]), np.array([0.6, 0.0, 0.8])
    edge = Profile(((-2.0, -0.5), (-2.0, 0.5), (2.0, 0.5), (2.0, -0.5)), 0.1, closed=True)
    tips = Revolved(edge, tuple(point), tuple(axis)).tips()
    height = (tips.centre - point) @ axis
    out = tips.centre - point - height[:, None] * axis
    np.testing.assert_allclose(np.abs(height), 0.4, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(out, axis=1), 1.9, rtol=1e-12)
    for upper in (height > 0, height < 0):
        ring = np.unique(out[upper].round(9), axis=0)
        np.testing.assert_allclose(ring.sum(axis=0), 0.0, atol=1e-7)
        apart = np.linalg.norm(ring[:, None] - ring, axis=2) + 9.0 * np.eye(len(ring))
        np.testing.assert_allclose(apart.min(axis=1), 2 * 1.9 * np.sin(np.pi / RING), rtol=1e-7)


def test_a_way_from_afar_that_ends_where_it_leaves_a_ball_comes_through():
    """Over a chord of a right angle, whose normals are those where the way enters and leaves."""
    way = np.array([[0.0, 0.0, 4.0]])
    start = np.array([[np.sqrt(0.5), 0.0, np.sqrt(0.5) - 4.0]])
    assert sphere((0.0, 0.0, 0.0), 1.0).crossed(start, way).all()
    assert not sphere((0.0, 0.0, 0.0), 1.0).crossed(start, 0.7 * way).any()


def test_the_series_of_a_slip_s_arc_goes_on_as_the_closed_form():
    """Over the angle at which one gives way to the other, for its change too; far below it the slip is the arc."""

    def slip(sine):
        m, n = np.array([[sine, 0.0, np.sqrt(1 - sine**2)]]), np.array([[0.0, 0.0, 1.0]])
        flat, none = frames(n), np.zeros((1, 3))
        return Slip(np.zeros(1), m, 2.0 * (n - m), np.zeros(1), flat, np.eye(3)[None] / 2.0, none)

    below, above = (np.ravel(slip(SMALL * (1 + off))._arcs) for off in (-1e-9, 1e-9))
    np.testing.assert_allclose(below[0], above[0], rtol=1e-9)
    np.testing.assert_allclose(below[1], above[1], rtol=1e-5)
    for sine in (0.5 * SMALL, 0.99 * SMALL, 0.3):
        assert np.linalg.norm(slip(sine).components) == pytest.approx(2.0 * np.arcsin(sine), rel=1e-14)


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("turn", [None, TURN], ids=["still", "turning"])
def test_rows_motions_and_newtons_tangent_are_derivatives(name, turn):
    """Of what is unbalanced, where forces turn with their frames, and of the motion, measured beside the rows'."""
    rng = np.random.default_rng(7)
    if name == "plane" and turn is None:
        pytest.skip("a flat tool has the same rows all along")
    scene = rubbed(SURFACES[name], turn=turn)
    increment, x, r = start_of(scene, rng)
    here, contacts = increment.at(x), increment.system.candidates
    assert here.measured is not None
    # Of a plane it is the frames that turn alone, and only as the tool does.
    check_derivatives(increment, x, r, rng, turning=name != "plane")
    assert contacts.curved
    # What rows leave out is of second order: the angle that normals turn by in the increment. Cylinders have none.
    assert np.abs(here.measured.rows - np.eye(3)).max() < 0.2


def pushed_by_a_force():
    """A small sphere that goes aside while a force presses it."""
    path = ((0.0, 0.0), (1.0, 1.0))
    return rubbed(travel=(0.03, -0.02, 0.0), path=path, driven_by=Force((0.0, 0.0, -9.0)))


def check_balance(scene):
    """What is unbalanced changes as the tangent says, at the tool too, whose equation is of another size."""
    rng = np.random.default_rng(3)
    increment, x, r = start_of(scene, rng)
    K = increment.system.body.space.matrix(increment.at(x).tangent(r))

    def unbalanced(y):
        there = increment.at(y)
        return there.residual - there.rows.forces(r)

    for _ in range(3):
        v = rng.uniform(-1, 1, len(x))
        found = derivative(unbalanced, x, v)
        np.testing.assert_allclose(found, K @ v, atol=1e-9 * np.abs(found).max())
        np.testing.assert_allclose(found[-1], (K @ v)[-1], atol=1e-7 * abs(found[-1]))


def test_newtons_tangent_of_a_sphere_that_a_force_drives_is_a_derivative():
    check_balance(pushed_by_a_force())


@pytest.mark.slow
def test_newtons_steps_are_quadratic_and_would_not_be_without_the_curvatures(monkeypatch):
    scene = rubbed(sphere((0.45, 0.55, 2.0), 1.0), 4, mu=0.3)
    last = marched(scene, increments=20, bounds=TIGHT)[-1]
    increment, end, r = last.solved.iterate.increment, last.solved.iterate.x, last.solved.r
    assert (r[:, 0] > 0).sum() >= 4
    slides = np.linalg.norm(last.solved.iterate.motion[:, 1:], axis=1) > 1e-5
    assert (slides & (r[:, 0] > 0)).sum() >= 3
    way = np.random.default_rng(2).uniform(-1, 1, len(end)) * np.abs(end).max()

    def after(e):
        iterate, form = increment.at(end + e * way), Newton(Reuse(0.0))
        step, _ = form.step(iterate, r, form.init(iterate, r, Cache()))
        return np.abs(step.iterate.x - end).max() / np.abs(end).max()

    errors = np.array([after(e) for e in (1e-2, 1e-3, 1e-4)])
    assert (errors[1:] < 0.03 * errors[:-1]).all()
    monkeypatch.setattr("bipot.contact.candidates.Candidates.add_bending", lambda *_: None)
    straight = np.array([after(e) for e in (1e-2, 1e-3, 1e-4)])
    assert (straight[1:] > 0.05 * straight[:-1]).all()


@cache
def pushed(material):
    return marched(dented(material=material), increments=5, bounds=TIGHT)


FORMS = (Tangent(), Dissipation(), Delassus(), Uzawa(3e4, 3e4))

LONG = [pytest.param(form, STEEL, marks=pytest.mark.slow) for form in FORMS[1:]]


@pytest.mark.parametrize(
    ("form", "material"),
    [(FORMS[0], STEEL), *((form, RUBBER) for form in FORMS), *LONG],
    ids=lambda given: named(given) if given in FORMS else "plastic" if given is STEEL else "elastic",
)
def test_every_form_finds_the_same_forces_under_a_sphere(form, material):
    """A quarter of a block, as long as the increments are those of Newton: who cuts one goes by others on."""
    one, other = pushed(material), marched(dented(material=material), form, increments=5, bounds=TIGHT)
    same = [a.state.tau == b.state.tau for a, b in zip(one, other, strict=False)]
    kept = same.index(False) if False in same else len(same)
    assert kept >= (5 if material is STEEL and isinstance(form, Delassus | Uzawa) else 8)
    assert apart(forces(other)[:kept], forces(one)[:kept]) < 1e-6
    assert (one[kept - 1].peeq.max() > 1e-3) == (material is STEEL)


@pytest.mark.parametrize("flat", [False, True], ids=["sphere", "plane"])
def test_nodes_in_planes_of_symmetry_own_their_unknowns(flat):
    """Of their three rows the tangent across the plane is none: nothing borders Newton's matrix."""
    scene = dented(elements=3)
    if flat:
        punch = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.05), ("top",), 0.2)
        scene = replace(scene, tools=(punch,))
    system = system_of(scene)
    increment = Increment(system, system.rest(), 0.5)
    iterate = increment.at(np.zeros(increment.size))
    found = Cache().frames(iterate.rows, iterate)
    assert found.border is None
    assert (found.own[:, 0] < found.pattern.size).all()


@pytest.mark.slow
def test_the_penalised_form_comes_near():
    soft = forces(marched(dented(material=RUBBER), Penalty(1e5, 1e5), increments=5))[-1]
    assert 1e-9 < apart(soft, forces(pushed(RUBBER))[-1]) < 1e-2
