"""Forms under curved tools: rows and tangents are derivatives, Newton is quadratic, all of the exact law agree."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Delassus, Dissipation, Newton, Penalty, Tangent, Uzawa
from bipot.forms.base import Cache, FormName
from bipot.forms.newton import Reuse
from bipot.forms.penalty import contact_penalty
from bipot.iterate import Increment
from bipot.laws.flow import Integration
from bipot.laws.hardening import Perfect
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.limit_analysis import limit_load
from bipot.marching import Control, march
from bipot.scene.loads import Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.system import system_of
from bipot.tools.circle import Circle
from bipot.tools.poses import Turn
from bipot.tools.profiles import flat_punch
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, ShapedTool
from bipot.typing import times
from tests.curved import TIGHT, apart, dragged, forces, marched, pressed
from tests.scenes import PLANES, named


def start_of(scene, rng, tau=0.5):
    """An increment from rest, unknowns nearby and forces of any size on all candidates."""
    system = system_of(scene)
    increment = Increment(system, system.rest(), tau)
    r = 1e3 * rng.uniform(-1, 1, (len(system.candidates.node), 2))
    r[~increment.rows.rubs, 1] = 0.0
    return increment, 0.01 * rng.uniform(-1, 1, increment.size), r


def derivative(f, x, v, h=1e-5):
    """Of f at x along v, by Richardson's rule on central differences."""
    one, two = ((f(x + k * h * v) - f(x - k * h * v)) / (2 * k * h) for k in (1, 2))
    return (4 * one - two) / 3


def check_derivatives(increment, x, r, rng, turning=True):
    """Of motion, by rows and by what they leave out in space, and of what is unbalanced, where forces r turn.

    The part of the tangent that turns forces with their frames is far above what is asked, or none.
    """
    here = increment.at(x)
    space, rows = increment.system.body.space, here.rows
    K = space.matrix(here.tangent(r))
    straight = space.matrix(here.tangent(np.zeros_like(r)))

    def motion(y):
        return increment.at(y).motion

    def unbalanced(y):
        there = increment.at(y)
        return there.residual - there.rows.forces(r)

    for _ in range(3):
        v = rng.uniform(-1, 1, len(x))
        expected = rows.motion(x + v) - rows.motion(x)
        if here.measured is not None:
            expected = times(here.measured.rows, expected)
        np.testing.assert_allclose(derivative(motion, x, v), expected, atol=1e-9)
        np.testing.assert_allclose(derivative(unbalanced, x, v), K @ v, atol=1e-9 * np.abs(K @ v).max())
        assert (np.abs((K - straight) @ v).max() > 1e-5 * np.abs(K @ v).max()) == turning


SURFACES = (
    Circle((0.1, 1.5), 0.5),
    Circle((-0.3, -1.5), 2.9, concave=True),
    flat_punch((0.0, 1.0), 0.6, 2.0, 0.2),
)
TURNS = (None, Turn(0.3, (0.2, 1.1)))


@pytest.mark.parametrize("geometry", PLANES)
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("turn", TURNS, ids=["still", "turning"])
def test_rows_and_newtons_tangent_are_derivatives(geometry, surface, turn):
    """Of motion, and of what is unbalanced, where contact forces turn: by Richardson's rule."""
    rng = np.random.default_rng(7)
    if turn is not None and geometry is Geometry.AXISYMMETRIC:
        pytest.skip("a tool is all around the axis")
    scene = pressed(geometry, surface, elements=2)
    if turn is not None:
        free = dragged(elements=2)
        scene = replace(free, tools=(replace(free.tools[0], surface=surface, turn=turn),))
    increment, x, r = start_of(scene, rng)
    here = increment.at(x)
    np.testing.assert_allclose(here.rows.motion(x), here.motion, rtol=0, atol=1e-16)
    check_derivatives(increment, x, r, rng)


def test_newtons_steps_are_quadratic_and_would_not_be_without_the_curvature(monkeypatch):
    """An elastic block under a small sphere-like punch that slides: a step from a distance e ends at some e^2."""
    rubber = Elastic(Elasticity(1e3, 0.3))
    scene = dragged(material=rubber, mu=0.3)
    scene = replace(scene, tools=(replace(scene.tools[0], surface=Circle((0.4, 1.2), 0.2)),))
    last = marched(scene, increments=20, bounds=TIGHT)[-1]
    increment, end, r = last.solved.iterate.increment, last.solved.iterate.x, last.solved.r
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


@pytest.mark.parametrize("geometry", PLANES)
@pytest.mark.parametrize("form", [Tangent(), Dissipation()], ids=named)
def test_forms_of_the_exact_law_agree(geometry, form):
    one, other = marched(pressed(geometry), bounds=TIGHT), marched(pressed(geometry), form, bounds=TIGHT)
    assert apart(forces(other), forces(one)) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("geometry", PLANES)
def test_delassus_agrees_within_the_default_bounds(geometry):
    """Asked for less, and of a body that does not flow: with fewer cuts the increments are others."""
    rubber = Elastic(Elasticity(1e3, 0.3))
    one, other = (marched(pressed(geometry, material=rubber), form) for form in (Newton(), Delassus()))
    assert apart(forces(other), forces(one)) < 1e-5


@pytest.mark.slow
def test_forms_agree_where_the_punch_goes_aside():
    whole = [
        forces(marched(dragged(), form, increments=16, bounds=TIGHT)) for form in (Newton(), Tangent(), Dissipation())
    ]
    assert abs(whole[0][-1, 0]) > 0.05 * abs(whole[0][-1, 1])
    assert apart(whole[1], whole[0]) < 1e-8
    assert apart(whole[2], whole[0]) < 1e-8


def beside_flat_ones() -> Scene:
    """Three tools, one of them flat, on a block that slides on its base."""
    scene = dragged()
    wall = FlatTool((0.0, 0.0), (1.0, 0.0), (0.0, 0.0), ("left",), 0.1)
    roll = ShapedTool(Circle((2.0, 0.5), 1.0), (-0.02, 0.0), ("right",), 0.1)
    return replace(scene, supports=(Support("base", 1),), tools=(*scene.tools, roll, wall))


def over_a_held_node() -> Scene:
    """A punch goes aside over a node that is held along that: its tangent is held, until it is not."""
    scene = pressed()
    held = Support("base", 1), Support("left", 0)
    return replace(scene, supports=held, tools=(replace(scene.tools[0], travel=(0.1, -0.05)),))


SORTS = {
    "beside flat tools": beside_flat_ones,
    "over a held node": over_a_held_node,
    "welded": lambda: dragged(mu=float("inf")),
    "in a hollow": lambda: pressed(surface=Circle((0.0, -1.98), 3.0, concave=True), travel=(0.0, -0.05)),
    "under a torus": lambda: pressed(Geometry.AXISYMMETRIC, Circle((0.5, 1.3), 0.3), (0.0, -0.05)),
    "aside of symmetry": lambda: pressed(surface=Circle((0.5, 1.4), 0.4), travel=(0.1, -0.05)),
    "in the paper's configuration": lambda: replace(pressed(), configuration=Configuration.PAPER),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SORTS)
def test_forms_agree_on_scenes_of_all_sorts(name):
    """Each with the others behind it, as marches are by default."""
    one, other = (
        list(
            march(
                SORTS[name](),
                Schedule(15, first=0.01, settling=1, growth=4.0),
                Control(form, integration=Integration.BACKWARD_EULER),
            )
        )
        for form in (Newton(), Tangent())
    )
    assert one[-1].form is FormName.NEWTON
    assert apart(forces(other)[-1], forces(one)[-1]) < 1e-6
    for accepted in one:
        assert max(accepted.solved.certificate.ratios(Bounds()).values()) <= 1


@pytest.mark.slow
def test_newton_takes_no_more_passes_than_where_nodes_land_on_a_flat_punch():
    """The curvature costs none: landings do, which a punch flat on the whole block has not, but one that is tilted."""
    tilted = pressed(surface=Plane((1.0, 1.0), (-0.1 / np.hypot(0.1, 1.0), -1.0 / np.hypot(0.1, 1.0))))
    spent = [np.mean([a.solved.passes for a in marched(scene, increments=20)]) for scene in (pressed(), tilted)]
    assert spent[0] <= spent[1] + 1


@pytest.mark.slow
def test_penalised_forms_see_the_true_gap():
    """Uzawa's is the exact answer; the penalty's penetrates by its force over the penalty, and tends to it."""
    scene = pressed(mu=0.0, material=Elastic(Elasticity(1e4, 0.3)))
    exact = forces(marched(scene))[-1]
    K = 10 * contact_penalty(system_of(scene).candidates)
    assert apart(forces(marched(scene, Uzawa(K, K)))[-1], exact) < 1e-5
    near, nearer = (marched(scene, Penalty(k, k)) for k in (K, 100 * K))
    assert apart(forces(nearer)[-1], exact) < 0.05 * apart(forces(near)[-1], exact) < 1e-2
    last = near[-1].solved
    pushes, share = last.r[:, 0] > 0, last.iterate.increment.system.candidates.share
    np.testing.assert_allclose(last.r[pushes, 0], -K * (share * last.iterate.motion[:, 0])[pushes], rtol=1e-9)


def lifted(travel=(0.0, 0.0)) -> Scene:
    """A block without hardening that a traction pushes up against a circle which touches one node of its top."""
    scene = pressed(
        surface=Circle((0.5, 1.5), 0.5), travel=travel, material=VonMises(Elasticity(210e3, 0.3), Perfect(300.0))
    )
    return replace(scene, supports=(Support("left", 0),), loads=(Traction("base", (0.0, 150.0)),))


def test_limit_loads_are_those_of_the_given_shape_wherever_the_circle_goes():
    """Normals are those where contacts touch, not where the tool's path ends."""
    resting, going = limit_load(lifted()).multiple, limit_load(lifted((0.3, 0.0))).multiple
    np.testing.assert_allclose(going, resting, rtol=1e-9)
