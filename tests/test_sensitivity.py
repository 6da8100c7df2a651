"""Slopes by parameters: beside closed forms, and beside differences of two marches that decide the same."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Circle,
    Configuration,
    Control,
    Elasticity,
    Element,
    FlatTool,
    Force,
    Geometry,
    Integration,
    Locate,
    Moment,
    Newton,
    Penalty,
    Perfect,
    Plane,
    Pressure,
    ProgramError,
    Sampling,
    Scene,
    SceneError,
    Schedule,
    ShapedTool,
    Support,
    Swift,
    Symmetry,
    Turn,
    VonMises,
    block,
    brick,
    cylinder,
    cylinder_3d,
    march,
    sensitivities,
    upsetting,
)
from bipot.certificate import Bounds
from bipot.laws.von_mises import RateVonMises

STEEL = Elasticity(210e3, 0.3)
EULER = Control(Newton(), integration=Integration.BACKWARD_EULER)
BOUNDS = Bounds(equilibrium=1e-10, law=1e-9, cone_violation=1e-10)
"""Differences of marches contain how far their answers are from the law, of which slopes are free."""

EXACT = replace(EULER, limits=replace(EULER.limits, bounds=BOUNDS))
TOLERANCES = {"tool_forces": 2e-5, "nodes": 5e-4, "stress": 5e-4, "peeq": 5e-4}


def metal(strength=600.0):
    return VonMises(STEEL, Swift(strength, 0.002, 0.2))


def punched(tool, strength=600.0, element=Element.Q4, n=4):
    """A cylinder under one tool."""
    supports = Support("axis", 0), Symmetry("base", 1)
    return Scene(cylinder(5.0, 5.0, n, n, element=element), Geometry.AXISYMMETRIC, metal(strength), supports, (tool,))


def upset(mu=0.1, sigma_y=300.0, reduction=0.2):
    scene = upsetting(mu=mu, reduction=reduction, elements=4)
    return replace(scene, material=VonMises(STEEL, Perfect(sigma_y)))


def indented(mu=0.2, radius=8.0, depth=0.3):
    return punched(ShapedTool(Circle((0.0, 5.0 + radius), radius), (0.0, -depth), ("top",), mu=mu), n=6)


def driven(mu=0.1, force=6000.0, strength=600.0):
    ball = Circle((0.0, 13.0), 8.0)
    return punched(ShapedTool(ball, (0.0, 0.0), ("top",), mu=mu, driven_by=Force((0.0, -force))), strength)


def weighted(mu=0.1, strength=600.0):
    lid = FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, -1.0), ("top", "side"), mu=mu, sampling=Sampling.WEIGHTED)
    return punched(lid, strength, Element.Q8, n=3)


def slid(mu=0.3, pressure=100.0, strength=600.0):
    """A block that is pressed and slid, and partly let off again, with a load at its side."""
    path = (0.0, 0.0), (0.5, 1.0), (1.0, 0.95)
    lid = FlatTool((0.0, 4.0), (0.0, -1.0), (0.3, -0.3), ("top",), mu=mu, path=path)
    supports = Support("base", 0), Support("base", 1)
    loads = (Pressure("right", pressure),)
    return Scene(block(6.0, 4.0, 5, 4), Geometry.PLANE_STRAIN, metal(strength), supports, (lid,), loads=loads)


def in_space(mu=0.2, strength=600.0, width=6.0):
    lid = FlatTool((0.0, 0.0, 4.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.6), ("top", "right", "back"), mu=mu)
    supports = Symmetry("base", 2), Symmetry("left", 0), Symmetry("front", 1)
    return Scene(brick(width, 5.0, 4.0, 3, 3, 2), Geometry.SOLID, metal(strength), supports, (lid,))


def twisted(mu=0.3, angle=0.4, depth=0.4):
    turn = Turn(angle, (0.0, 0.0, 3.0), axis=(0.0, 0.0, 1.0))
    lid = ShapedTool(Plane((0.0, 0.0, 3.0), (0.0, 0.0, -1.0)), (0.0, 0.0, -depth), ("top",), mu=mu, turn=turn)
    mesh, supports = cylinder_3d(4.0, 3.0, 2, 1, 2, quarter=False), tuple(Support("base", i) for i in range(3))
    return Scene(mesh, Geometry.SOLID, metal(), supports, (lid,))


def capped(shear=0.3, strength=600.0):
    """Friction of which the yield stress, and the areas of contact, change with the answer."""
    return punched(FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, -1.0), ("top",), mu=0.4, shear=shear), strength)


def dragged(shear=0.3, slide=0.3, depth=0.6):
    """Friction at its cap in space, where directions of slip turn as parameters change."""
    lid = FlatTool((0.0, 0.0, 4.0), (0.0, 0.0, -1.0), (slide, slide / 2, -depth), ("top",), mu=0.4, shear=shear)
    supports = tuple(Support("base", k) for k in range(3))
    return Scene(brick(6.0, 5.0, 4.0, 3, 3, 2), Geometry.SOLID, metal(), supports, (lid,))


def driven_round(moment=2000.0, depth=0.3):
    turn = Turn(0.0, (0.0, 0.0, 3.0), driven_by=Moment(moment), axis=(0.0, 0.0, 1.0))
    lid = twisted(depth=depth).tools[0]
    return replace(twisted(), tools=(replace(lid, turn=turn),))


def fields(accepted):
    return {
        "tool_forces": accepted.tool_forces,
        **{name: getattr(accepted.state, name) for name in list(TOLERANCES)[1:]},
    }


def differences(scene_of, at, name, schedule, control, change=1e-4):
    """Central differences of the fields by one parameter, increment by increment."""
    h = change * (abs(at[name]) or 1.0)
    more, less = ([*map(fields, march(scene_of(**{**at, name: at[name] + s}), schedule, control))] for s in (h, -h))
    return [{field: (b[field] - a[field]) / (2 * h) for field in TOLERANCES} for a, b in zip(less, more, strict=True)]


def agree(scene_of, at, schedule, control):
    """Require that slopes are smooth, and those of two marches."""
    slopes = [found for _, found in sensitivities(scene_of, at, schedule, control)]
    for name in at:
        known = differences(scene_of, at, name, schedule, control)
        assert all(found[name].smooth for found in slopes)
        assert slopes[-1][name].resolved
        for field, tolerance in TOLERANCES.items():
            largest = max(np.abs(expected[field]).max() for expected in known)
            for found, expected in zip(slopes, known, strict=True):
                assert np.abs(getattr(found[name], field) - expected[field]).max() <= tolerance * largest, (name, field)


@pytest.mark.parametrize(
    ("scene_of", "at", "increments", "first"),
    [
        (upset, {"mu": 0.1, "sigma_y": 300.0, "reduction": 0.2}, 3, 0.05),
        (indented, {"mu": 0.2, "radius": 8.0, "depth": 0.3}, 3, 0.0),
        (driven, {"mu": 0.1, "force": 6000.0, "strength": 600.0}, 3, 0.0),
        (weighted, {"mu": 0.1, "strength": 600.0}, 3, 0.02),
        (slid, {"mu": 0.3, "pressure": 100.0}, 4, 0.02),
        (in_space, {"mu": 0.2, "strength": 600.0, "width": 6.0}, 4, 0.02),
        (twisted, {"mu": 0.3, "angle": 0.4}, 2, 0.1),
        (capped, {"shear": 0.3, "strength": 600.0}, 4, 0.02),
        (dragged, {"shear": 0.3, "slide": 0.3, "depth": 0.6}, 2, 0.0),
        (driven_round, {"moment": 2000.0, "depth": 0.3}, 2, 0.1),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_slopes_are_those_of_two_marches_that_decide_the_same(scene_of, at, increments, first):
    agree(scene_of, at, Schedule(increments, first, settling=1, growth=4.0), EXACT)


def test_of_a_body_that_stays_a_cylinder_they_are_those_of_its_closed_form():
    """F = sigma_Y pi R^2/(1 - e) but for the elastic change of volume, a thousandth."""
    reduction, radius, sigma_y = 0.2, 5.0, 300.0

    def scene_of(radius, sigma_y, reduction):
        lid = FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, -5.0 * reduction), ("top",), mu=0.0)
        mesh, supports = cylinder(radius, 5.0, 3, 3), (Support("axis", 0), Symmetry("base", 1))
        return Scene(mesh, Geometry.AXISYMMETRIC, VonMises(STEEL, Perfect(sigma_y)), supports, (lid,))

    at = {"radius": radius, "sigma_y": sigma_y, "reduction": reduction}
    *_, (last, found) = sensitivities(scene_of, at, Schedule(20))
    area = np.pi * radius**2 / (1 - reduction)
    force = {"radius": 2 * sigma_y * area / radius, "sigma_y": area, "reduction": sigma_y * area / (1 - reduction)}
    for name, expected in force.items():
        assert -found[name].tool_forces[0, 1] == pytest.approx(expected, rel=3e-3), name
    # The side is at R (1 - e)^(-1/2).
    side = last.scene.mesh.boundary("side").ravel()
    np.testing.assert_allclose(found["radius"].nodes[side, 0], (1 - reduction) ** -0.5, rtol=1e-3)
    np.testing.assert_allclose(found["reduction"].nodes[side, 0], radius / 2 * (1 - reduction) ** -1.5, rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("scene_of", "at"), [(upset, {"mu": 0.1, "sigma_y": 300.0}), (indented, {"radius": 8.0})])
def test_with_flow_carried_on_they_are_about_as_near_the_truth_as_differences(scene_of, at):
    """What part of the flow is carried on changes with the parameters: differences contain that, slopes do not."""
    schedule, control = Schedule(6, 0.02, settling=1, growth=4.0), Control(Newton())
    times = schedule.times()
    fine = Schedule(96, 0.001, landings=tuple(time for time in times if 0.003 < time < 1))
    true = [found for step, found in sensitivities(scene_of, at, fine, EULER) if step.state.tau in times]
    slopes = [found for step, found in sensitivities(scene_of, at, schedule, control)]
    assert len(slopes) == len(true)
    for name in at:
        known = differences(scene_of, at, name, schedule, control)
        for field in "tool_forces", "nodes":
            exact, ours = (np.array([getattr(found[name], field) for found in each]) for each in (true, slopes))
            theirs = np.array([one[field] for one in known])
            assert np.abs(ours - exact).max() <= 1.4 * np.abs(theirs - exact).max(), (name, field)


@pytest.mark.parametrize("scene_of", [upset, in_space, weighted])
def test_where_friction_is_next_to_nothing_they_are_those_of_its_beginning(scene_of):
    schedule = Schedule(4, 0.02, settling=1, growth=4.0)
    *_, (_, found) = sensitivities(scene_of, {"mu": 1e-9}, schedule, EULER, sizes={"mu": 0.1})
    *_, (_, unresolved) = sensitivities(scene_of, {"mu": 1e-9}, schedule, EULER)
    without, with_little = (
        [step.tool_forces for step in march(scene_of(mu=mu), schedule, EULER)][-1] for mu in (0.0, 1e-4)
    )
    assert found["mu"].resolved
    assert not unresolved["mu"].resolved
    expected = (with_little - without) / 1e-4
    np.testing.assert_allclose(found["mu"].tool_forces, expected, atol=5e-3 * np.abs(expected).max())


def test_a_march_is_as_it_is_without_and_arrays_are_read_only():
    schedule, control = Schedule(4, 0.02, settling=1, growth=4.0), Control(Newton())
    beside = list(sensitivities(upset, {"mu": 0.1}, schedule, control))
    for (step, found), alone in zip(beside, march(upset(mu=0.1), schedule, control), strict=True):
        assert (step.tool_forces == alone.tool_forces).all()
        assert list(found) == ["mu"]
        with pytest.raises(ValueError, match="read-only"):
            found["mu"].nodes[0] = 0.0


@pytest.mark.parametrize(("travel", "smooth"), [(0.0, False), (-0.01, True)])
@pytest.mark.parametrize("away", [1.0, -1.0])
def test_a_contact_that_only_touches_is_between_two_pieces(travel, smooth, away):
    """A lid without force: where it goes on upwards it leaves the body, downwards it presses and slides."""

    def scene_of(way):
        return punched(FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, travel + away * way), ("top",), mu=0.1))

    _, found = next(sensitivities(scene_of, {"way": 0.0}, Schedule(1), EULER, sizes={"way": 1e-3}))
    assert found["way"].smooth is smooth


def small(scene, change):
    return replace(scene, configuration=Configuration.SMALL) if change else scene


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"scene_of": 3}, "scene_of = 3: must be a function"),
        ({"scene_of": lambda mu: mu}, "scene_of"),
        ({"at": {}}, "at = {}: must be one parameter or more"),
        ({"at": [0.1]}, "at = "),
        ({"at": {"mu": "0.1"}}, "at['mu'] = '0.1'"),
        ({"at": {"mu": np.nan}}, "at['mu'] = nan: must be finite"),
        ({"schedule": 5}, "schedule = 5"),
        ({"control": None}, "control = None"),
        ({"schedule": Schedule(accuracy=1e-3)}, "schedule.accuracy = 0.001: must be None"),
        ({"control": Control(Penalty(1.0, 1.0))}, "control.form = 'penalty'"),
        ({"scene_of": lambda mu: replace(upset(mu), material=RateVonMises(STEEL, Perfect(300.0)))}, "material = "),
        ({"scene_of": lambda mu: upset(mu) if mu == 0.1 else weighted(mu)}, "scene_of, mu changed"),
        ({"control": Control(Newton(), locate=Locate())}, "control.locate = "),
        ({"at": {1: 0.1}}, "at = {1: 0.1}"),
        ({"sizes": {"mu": 1e-12}}, "sizes['mu'] = 1e-12: must be such that 1e-06 of it is a change of 0.1"),
        ({"at": {"mu": 1e-320}}, "sizes['mu'] = 1e-320"),
        ({"scene_of": lambda mu: small(upset(mu), mu > 0.1)}, "of the same geometry, configuration, quadrature"),
        ({"scene_of": lambda mu: upset(mu if mu == 0.1 else np.inf)}, "with friction at the same of them"),
        ({"at": {"mu": 0.0}}, "sizes['mu'] = 0.0: must be finite, and not zero"),
        ({"at": {"mu": 0.0}, "sizes": {"mu": 0.1}}, "with friction at the same of them"),
        ({"sizes": {"nu": 0.1}}, "sizes = {'nu': 0.1}: must be of some of ['mu']"),
        ({"sizes": {"mu": "1"}}, "sizes['mu'] = '1'"),
        ({"sizes": 0.1}, "sizes = 0.1"),
    ],
)
def test_what_has_no_slopes_is_refused(changed, said):
    asked = {"scene_of": upset, "at": {"mu": 0.1}, "schedule": Schedule(2), "control": Control(Newton())} | changed
    with pytest.raises(SceneError) as refused:
        next(sensitivities(**asked))
    assert said in str(refused.value)


def test_of_a_body_that_nothing_holds_there_are_none():
    def scene_of(pressure):
        load = (Pressure("left", pressure), Pressure("right", pressure))
        return replace(slid(), supports=(), tools=(), loads=load)

    with pytest.raises(ProgramError):
        next(sensitivities(scene_of, {"pressure": 10.0}, Schedule(1), EULER))
