"""Slopes by parameters: of loose answers, and by parameters of any kind of number."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from bipot import (
    Bounds,
    Control,
    Elasticity,
    FlatTool,
    Geometry,
    Integration,
    Limits,
    Newton,
    Pressure,
    Scene,
    SceneError,
    Schedule,
    ShapedTool,
    Support,
    Swift,
    Symmetry,
    Traction,
    VonMises,
    block,
    brick,
    cylinder,
    march,
    sensitivities,
    sphere,
)
from tests.test_sensitivity import driven_round

EULER = Control(Newton(), integration=Integration.BACKWARD_EULER)


def metal(strength=600.0):
    return VonMises(Elasticity(210e3, 0.3), Swift(strength, 0.002, 0.2))


def upset(mu=0.1, strength=600.0, travel=-1.0):
    lid = FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, travel), ("top", "side"), mu=mu)
    supports = Support("axis", 0), Symmetry("base", 1)
    return Scene(cylinder(5.0, 5.0, 4, 4), Geometry.AXISYMMETRIC, metal(strength), supports, (lid,))


def test_with_loose_bounds_they_are_those_of_exact_answers():
    at, schedule = {"mu": 0.1, "strength": 600.0}, Schedule(4, 0.02, settling=1, growth=4.0)
    bounds = Bounds(equilibrium=1e-3, law=1e-3, penetration=1e-4, cone_violation=1e-3, relative_gap=1e-3)
    loose = replace(EULER, limits=Limits(bounds))
    (*_, (_, found)), (*_, (_, exact)) = (sensitivities(upset, at, schedule, control) for control in (loose, EULER))
    for name in at:
        expected = exact[name].tool_forces
        np.testing.assert_allclose(found[name].tool_forces, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("value", [np.float32(600.0), Fraction(600), 600])
def test_a_parameter_is_any_real_number(value):
    """It is changed in double precision, which is finer than a single one's."""
    ((_, found),), ((_, expected),) = (
        sensitivities(lambda strength: upset(strength=strength), {"strength": strength}, Schedule(1), EULER)
        for strength in (value, 600.0)
    )
    assert (found["strength"].nodes == expected["strength"].nodes).all()


def test_a_parameter_may_be_much_larger_than_the_size_at_which_it_matters():
    """A lid whose height is counted from 10^6 below: h is what remains of it in the sum."""
    beyond, sizes = 1e6, {"depth": 1.0}
    ((_, far),) = sensitivities(
        lambda depth: upset(travel=beyond - depth), {"depth": beyond + 1}, Schedule(1), EULER, sizes
    )
    ((_, near),) = sensitivities(lambda depth: upset(travel=-depth), {"depth": 1.0}, Schedule(1), EULER, sizes)
    np.testing.assert_allclose(far["depth"].tool_forces, near["depth"].tool_forces, rtol=1e-7)


def turned_back(when, back=0.9):
    """A lid that is lifted from the pseudo-time ``when`` on."""
    scene = upset()
    return replace(scene, tools=(replace(scene.tools[0], path=((0.0, 0.0), (when, 1.0), (1.0, back))),))


def test_a_time_at_which_a_path_turns_is_no_parameter():
    """Increments end where the path of the given scene turns: in between, a later turn would not be reached."""
    with pytest.raises(SceneError, match=r"scene_of, when changed.kinks = .*: must be \(0.5,\)"):
        sensitivities(turned_back, {"when": 0.5}, Schedule(4, 0.02, settling=1, growth=4.0), EULER)


def test_how_far_a_path_goes_back_is_a_parameter_also_from_where_it_goes_straight_on():
    """The changed path has a corner where the given one has none."""

    def scene_of(half):
        scene = upset()
        return replace(scene, tools=(replace(scene.tools[0], path=((0.0, 0.0), (0.5, half), (1.0, 1.0))),))

    slopes = [found["half"] for _, found in sensitivities(scene_of, {"half": 0.5}, Schedule(4, landings=(0.5,)), EULER)]
    assert [slope.smooth for slope in slopes] == [True] * 4
    assert -slopes[1].tool_forces[0, 1] > 1e3


def tilted_in_plane(angle, mu=0.0):
    """A lid that leaves the axis of a plane: its rows act on unknowns on which they did not."""
    lid = FlatTool((3.0, 4.0), (np.sin(angle), -np.cos(angle)), (0.05, -0.2), ("top",), mu=mu)
    supports = Support("base", 0), Support("base", 1)
    return Scene(block(6.0, 4.0, 5, 4), Geometry.PLANE_STRAIN, metal(), supports, (lid,))


def tilted(angle, mu=0.3, supports=()):
    """The same in space, where tangents could be others from there on."""
    normal = (np.sin(angle), 0.0, -np.cos(angle))
    lid = FlatTool((2.0, 2.0, 3.0), normal, (0.1, 0.05, -0.2), ("top",), mu=mu)
    held = (*(Support("base", i) for i in range(3)), *supports)
    return Scene(brick(4.0, 4.0, 3.0, 2, 2, 1), Geometry.SOLID, metal(), held, (lid,))


def dented(width, mu=0.2):
    """A ball over the corner of a square block, seen from which the normal has two components alike."""
    ball = ShapedTool(sphere((0.0, 0.0, 9.0), 6.0), (0.0, 0.0, -0.3), ("top",), mu=mu)
    supports = Symmetry("base", 2), Symmetry("left", 0), Symmetry("front", 1)
    loads = Pressure("right", 20.0), Traction("back", (0.0, 7.0, 0.0))
    return Scene(brick(width, 4.0, 3.0, 3, 3, 2), Geometry.SOLID, metal(), supports, (ball,), loads=loads)


@pytest.mark.parametrize(
    ("scene_of", "name", "value", "size"),
    [
        (tilted_in_plane, "angle", 0.0, 0.02),
        (tilted, "angle", 0.0, 0.02),
        (dented, "width", 4.0, 4.0),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_where_rows_or_their_frames_would_jump_slopes_are_those_of_two_marches(scene_of, name, value, size):
    schedule, h = Schedule(2, 0.1), 1e-4 * size
    exact = replace(EULER, limits=Limits(Bounds(equilibrium=1e-13, law=1e-12)))
    *_, (_, found) = sensitivities(scene_of, {name: value}, schedule, exact, {name: size})
    more, less = ([*march(scene_of(**{name: value + s}), schedule, exact)][-1] for s in (h, -h))
    for known, slope in (
        ((more.tool_forces - less.tool_forces) / (2 * h), found[name].tool_forces),
        ((more.state.stress - less.state.stress) / (2 * h), found[name].stress),
    ):
        assert np.abs(slope - known).max() <= 3e-5 * np.abs(known).max()
    assert found[name].smooth
    assert found[name].resolved


def test_where_friction_comes_to_act_on_an_unknown_there_is_no_slope():
    """On a side that is held along x a level lid rubs along y alone, a tilted one downwards, too."""

    def scene_of(angle):
        return tilted(angle, supports=(Support("left", 0),))

    _, found = next(sensitivities(scene_of, {"angle": 0.0}, Schedule(1), EULER, {"angle": 0.02}))
    assert not found["angle"].smooth


def test_an_answer_to_which_steps_have_not_come_is_not_resolved(monkeypatch):
    """Two steps beside caps of friction, whose change Newton's matrix leaves out."""

    def scene_of(travel):
        scene = upset(mu=0.4, travel=travel)
        return replace(scene, tools=(replace(scene.tools[0], shear=0.3),))

    asked = scene_of, {"travel": -1.0}, Schedule(4, 0.02, settling=1, growth=4.0), EULER
    assert all(found["travel"].resolved for _, found in sensitivities(*asked))
    monkeypatch.setattr("bipot.beside.ENOUGH", 1.0)
    monkeypatch.setattr("bipot.sensitivity.LEFT", 1e-5)
    assert not all(found["travel"].resolved for _, found in sensitivities(*asked))


def test_two_steps_suffice_beneath_a_tool_that_a_moment_turns(monkeypatch):
    """Newton's matrix has how slips turn with the tool: without that a second step would not do."""
    at, schedule = {"moment": 2000.0}, Schedule(3, 0.1, settling=1, growth=4.0)
    (*_, (_, found)) = sensitivities(driven_round, at, schedule, EULER)
    monkeypatch.setattr("bipot.beside.STEPS", 2)
    (*_, (_, after_two)) = sensitivities(driven_round, at, schedule, EULER)
    nodes = found["moment"].nodes
    np.testing.assert_allclose(after_two["moment"].nodes, nodes, atol=1e-7 * np.abs(nodes).max())
