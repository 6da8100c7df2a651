"""Claims of collapse of bodies in space in the fuzz study: planted errors are found, none else is."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bipot.errors import LimitPassed
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Newton
from bipot.laws.hardening import Linear, Perfect, Voce
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.solids import brick
from bipot.scene.loads import Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.poses import Force, Moment, Turn
from bipot.tools.revolved import sphere
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, Sampling, ShapedTool
from studies.fuzz import solid as fuzz_solid
from studies.fuzz.claims import Claim, claim_of
from studies.fuzz.judge import Ran
from studies.fuzz.solid_claims import proofs, refuted
from studies.independent.collapse import Pressed

SIGMA, PLANTED = 300.0, 1e-5
STEEL = Elasticity(210e3, 0.3)
SIDES = Symmetry("left", 0), Symmetry("front", 1)
HELD = *SIDES, Support("base", 2)
UP = (0.0, 0.0, 1.0)
BASE = FlatTool((0.0, 0.0, 0.0), UP, (0.0, 0.0, 0.0), ("base",), 0.3)


def body(
    supports,
    load=None,
    tools=(),
    element=Element.H8,
    hardening=None,
    cells=1,
    configuration=Configuration.SMALL,
) -> Scene:
    """A cube with the side one, a traction on its top; in small strain no section grows until it bears more."""
    loads = () if load is None else (Traction("top", load),)
    mesh = brick(1.0, 1.0, 1.0, cells, cells, cells, element=element)
    material = VonMises(STEEL, hardening or Perfect(SIGMA))
    return Scene(mesh, Geometry.SOLID, material, supports, tools, configuration=configuration, loads=loads)


def punch(force, mu, **others) -> FlatTool:
    """On the top, driven by a force."""
    return FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, 0.0), ("top",), mu, driven_by=Force(force), **others)


def shaped(surface, mu, **others) -> ShapedTool:
    """On the top, as its drive asks."""
    return ShapedTool(surface, (0.0, 0.0, 0.0), ("top",), mu, **others)


def pressed(factor: float, mu: float, supports=HELD, sampling=Sampling.NODES, **others) -> Scene:
    """Under a punch with so many times what the section bears without friction: planes of symmetry leave a quarter."""
    force = (0.0, 0.0, -factor * SIGMA * (4 if supports is HELD else 1))
    return body(supports, tools=(punch(force, mu, sampling=sampling),), **others)


def claim(scene: Scene, **control) -> Claim:
    """What ends its march."""
    with pytest.raises(LimitPassed) as caught:
        list(march(scene, Schedule(1), Control(Newton(), (), cuts=0, **control)))
    found = claim_of(caught.value)
    assert found is not None
    return found


TURNED = (0.0, -np.sin(0.4), np.cos(0.4))
SCENES = {
    "stretched": lambda: body(HELD, load=(0.0, 0.0, 1.1 * SIGMA), configuration=Configuration.MIDPOINT),
    "hardened": lambda: body(HELD, load=(0.0, 0.0, 2.2 * SIGMA), hardening=Voce(SIGMA, SIGMA, 8.0)),
    "on a base": lambda: body(SIDES, load=(0.0, 0.0, -1.5 * SIGMA), tools=(BASE,), element=Element.T10, cells=2),
    "smooth": lambda: pressed(1.1, 0.0),
    "sliding": lambda: body((), load=(30.0, 20.0, -100.0), tools=(BASE,)),
    "rubbed": lambda: pressed(1.5, 0.3, cells=2),
    "aside": lambda: body((SIDES[0], *HELD[2:], Support("base", 1)), tools=(punch((0.0, 400.0, -1600.0), 0.3),)),
    "welded": lambda: pressed(2.0, np.inf, tuple(Support("base", d) for d in range(3)), cells=2),
    "in means": lambda: pressed(1.5, 0.3, sampling=Sampling.WEIGHTED, element=Element.T10),
    "driven": lambda: body(
        (*HELD, Prescribed("right", 0, 0.001)), load=(0.0, 300.0, 700.0), element=Element.T4, cells=2
    ),
    "under a ball": lambda: body(
        HELD, tools=(shaped(sphere((0.0, 0.0, 3.0), 2.0), 0.3, driven_by=Force((0.0, 0.0, -3000.0))),), cells=2
    ),
    "twisted": lambda: body(
        tuple(Support("base", d) for d in range(3)),
        tools=(
            shaped(
                Plane((0.5, 0.5, 1.0), (0.0, 0.0, -1.0)),
                np.inf,
                turn=Turn(0.0, (0.5, 0.5, 1.0), axis=UP, driven_by=Moment(400.0)),
            ),
        ),
        cells=2,
    ),
}


@cache
def claimed(name: str) -> tuple[Scene, Claim]:
    """A scene and its claim."""
    scene = SCENES[name]()
    return scene, claim(scene)


@pytest.mark.parametrize("name", SCENES)
def test_a_claim_is_proved_again(name):
    assert refuted(*claimed(name)) == []


def test_what_is_carried_is_known():
    assert claimed("stretched")[1].fraction == pytest.approx(1 / 1.1, rel=1e-6)
    assert claimed("hardened")[1].fraction == pytest.approx(1 / 1.1, rel=1e-6)
    assert claimed("smooth")[1].fraction == pytest.approx(1 / 1.1, rel=1e-6)
    assert claimed("sliding")[1].fraction == 0.0


def by_hand(scene: Scene, rises: float) -> Claim:
    """That all of the body rises, driven tools do not, and the load is not carried at all."""
    moved = rises * np.array(UP) * np.ones_like(scene.mesh.nodes)
    driven = sum(tool.driven_by is not None for tool in scene.tools)
    return Claim(system_of(scene).rest(), moved, 0.0, 1.0, np.zeros(driven))


def test_what_nothing_holds_moves_rigidly_however_much_it_hardens():
    """What a search leaves of strain beside the motion is not held against it."""
    hardens, askew = Linear(SIGMA, SIGMA), np.random.default_rng(0).normal(size=(8, 3))
    for supports in ((), (Support("base", TURNED),)):
        scene = body(supports, load=(0.0, 0.0, 1.0), hardening=hardens)
        along = np.array(UP) - (np.array(TURNED) * TURNED[2] if supports else 0.0)
        found = replace(by_hand(scene, 0.0), motion=along / along[2] + 1e-8 * askew)
        assert refuted(scene, found) == []
        assert refuted(replace(scene, supports=HELD), found) != []


PLANTS = {
    "gains": lambda c: {"motion": 0.999 * c.motion},
    "gain": lambda c: {"motion": -c.motion},
    "volume": lambda c: {"motion": c.motion * (1.0, 1.0, 1.0 + 3 * PLANTED)},
    "held": lambda c: {"motion": c.motion + 1e-3 * PLANTED * np.abs(c.motion).max()},
    "said to be carried": lambda c: {"fraction": c.fraction - 2 * PLANTED},
}


@pytest.mark.parametrize("name", ["stretched", "rubbed", "welded", "in means", "driven"])
@pytest.mark.parametrize("said", PLANTS)
def test_a_false_claim_is_found(name, said):
    scene, found = claimed(name)
    planted = replace(found, **PLANTS[said](found))
    assert any(said in what for what in refuted(scene, planted))


def test_a_motion_through_a_tool_is_found():
    scene, found = claimed("on a base")
    for way in (-3, 1, 3):
        shift = way * PLANTED * np.abs(found.motion).max() * np.array(UP)
        faults = refuted(scene, replace(found, motion=found.motion + shift))
        assert any("overtaken" in what for what in faults) == (way < 0)


def test_a_motion_that_slips_more_than_it_opens_is_found():
    scene, found = claimed("on a base")
    assert any("overtaken" in what for what in refuted(replace(scene, tools=(replace(BASE, mu=0.301),)), found))
    scene, found = claimed("rubbed")
    rougher = replace(scene, tools=(replace(scene.tools[0], mu=0.301),))
    assert any("gains" in what for what in refuted(rougher, found))


def test_a_load_that_is_carried_is_none_above_the_limit():
    scene, found = claimed("stretched")
    carried = replace(scene, loads=(Traction("top", (0.0, 0.0, 0.9999 * SIGMA)),))
    longer = replace(found, motion=found.motion * 1.1 / 0.9999, fraction=found.fraction * 1.1 / 0.9999)
    assert any("of the load's gain is dissipated" in what for what in refuted(carried, longer))
    hardens = replace(scene, material=VonMises(STEEL, Linear(SIGMA, 1.0)))
    assert any("dissipated" in what for what in refuted(hardens, found))


def test_a_body_or_a_tool_that_flies_until_it_lands_proves_nothing():
    below = replace(BASE, point=(0.0, 0.0, -1e-3))
    scene = body(SIDES, load=(0.0, 0.0, -1.0), tools=(below,))
    found = by_hand(scene, -1.0)
    assert any("lands" in what for what in refuted(scene, found))
    beside = FlatTool((2.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), ("right",), 0.0)
    assert refuted(replace(scene, tools=(beside,)), found) == []
    scene = body(HELD, tools=(replace(punch((0.0, 0.0, -1.0), 0.0), point=(0.0, 0.0, 1.001)),))
    assert any("gain" in what for what in refuted(scene, by_hand(scene, 0.0)))


@pytest.mark.parametrize(("below", "proved"), [(150.0, True), (90.0, False)])
def test_a_body_that_is_pushed_together_with_a_tool_it_does_not_touch_yet_never_rests(below, proved):
    """Whether the punch has landed or not: it is pushed down by 100."""
    above = replace(punch((0.0, 0.0, -100.0), 0.2), point=(0.0, 0.0, 1.001))
    scene = body(SIDES, tools=(above, replace(BASE, driven_by=Force((0.0, 0.0, below)))))
    assert (refuted(scene, by_hand(scene, 1 / 12.5)) == []) == proved


def test_half_of_the_force_is_on_half_of_the_tool():
    scene, found = claimed("rubbed")
    whole = replace(scene, supports=tuple(Support(s.boundary, s.direction) for s in scene.supports))
    assert proofs(whole, found)[0].gain == pytest.approx(4 * proofs(scene, found)[0].gain)


def test_a_run_that_ends_with_a_false_claim_is_wrong():
    scene, found = claimed("stretched")
    assert fuzz_solid.faults(Ran(scene, [], "LimitPassed", found), exact=True)[0] == []
    wrong = replace(found, fraction=0.5)
    assert "said to be carried" in fuzz_solid.faults(Ran(scene, [], "LimitPassed", wrong), exact=True)[0][0]


SHAPED = {
    "way": (lambda c: {"ways": (1 + 3 * PLANTED) * c.ways}, "overtaken"),
    "rest": (lambda c: {"ways": 0 * c.ways}, "gains"),
    "motion": (lambda c: {"motion": (1 - 3 * PLANTED) * c.motion}, "overtaken"),
    "carried": (lambda c: {"fraction": c.fraction - 2 * PLANTED}, "said to be carried"),
}


@pytest.mark.parametrize("name", ["under a ball", "twisted"])
@pytest.mark.parametrize("what", SHAPED)
def test_a_false_claim_under_a_tool_that_is_not_flat_is_found(name, what):
    """Of such the ways are those that are claimed."""
    scene, found = claimed(name)
    planted, said = SHAPED[what]
    assert any(said in fault for fault in refuted(scene, replace(found, **planted(found))))


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_tool_goes_until_its_last_contact_is_at_its_cone(dimension):
    """By search: beyond the way that is found f = n . (v - w d) - mu |v_t - w d_t| is below zero for ever."""
    rng = np.random.default_rng(dimension)
    for _ in range(40):
        normal, direction = (way / np.linalg.norm(way) for way in rng.normal(size=(2, dimension)))
        v, mu = rng.normal(size=(1, dimension)) + direction, rng.choice([0.0, rng.uniform(0, 2)], size=1)
        touches = np.ones(1, dtype=bool)
        way = Pressed(v, mu, touches, ~touches, normal, direction).farthest(following=False)
        w = np.linspace(-50.0, 50.0, 5001)
        left = v - np.append(w, way if np.isfinite(way) else 0.0)[:, None] * direction
        opened = left @ normal
        f = opened - mu * np.linalg.norm(left - opened[:, None] * normal, axis=1)
        if np.isinf(way):
            assert f[5000] > 0 or f[:5001].max() < 0
        elif (f[:5001] > 0).any() and abs(way) < 49:
            assert abs(f[5001]) < 1e-9 * (1 + abs(way))
            assert w[f[:5001] > 0].max() == pytest.approx(way, abs=0.03)
