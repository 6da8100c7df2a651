"""The fuzz study's forces on tools, moving supports and claims of collapse: planted errors are found, none else is."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.checks.examined import Examined
from bipot.errors import IncrementFailed, LimitPassed
from bipot.fem.elements import Quadrature
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.increment import Limits
from bipot.iterate import Increment
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.scene.loads import Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool, Sampling
from studies.fuzz import driven as fuzz_driven
from studies.fuzz import judge as fuzz_judge
from studies.fuzz import whole as fuzz_whole
from studies.fuzz.claims import Claim, claim_of, refuted
from studies.fuzz.record import setting_of, step_of
from studies.fuzz.scenes import draw
from studies.fuzz.unfolded import about
from studies.fuzz.variants import in_units, mirrored
from studies.hard_loads import limit_scene
from studies.independent.increment import measure
from tests.scenes import with_course

PLANTED = 1e-5


def pressed_block(*supports, slide=0.0, based=True, force=(0.0, -2500.0)):
    """A block under a punch that a force presses and a path slides across it, on a base that rubs."""
    material = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 500.0))
    punch = FlatTool((0.0, 10.0), (0.0, -1.0), (slide, 0.0), ("top",), 0.2, driven_by=Force(force))
    base = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.3)
    mesh, tools = block(10.0, 10.0, 2, 2, element=Element.Q8), (punch, base) if based else (punch,)
    return Scene(mesh, Geometry.PLANE_STRAIN, material, supports, tools, Quadrature.GAUSS2)


def ran(scene, increments=4):
    return fuzz_judge.Ran(scene, list(march(scene, Schedule(increments))), "")


@pytest.fixture(scope="module")
def pressed():
    """The run of a block that slides under force control."""
    return ran(pressed_block(slide=0.01))


@pytest.fixture(scope="module")
def pulled():
    """The run of a block whose right side is driven, its left held, under a punch."""
    return ran(pressed_block(Support("left", 0), Prescribed("right", 0, 0.03)))


def last_step(run, accepted=None):
    setting, accepted = setting_of(run.scene), accepted or run.steps[-1]
    return setting, step_of(run.scene, setting, accepted, float(np.abs(accepted.state.forces).max()))


def found(run, accepted=None, **changes):
    """What is said of the last increment, of ``accepted`` in its place, or with ``changes`` to what was recorded."""
    setting, step = last_step(run, accepted)
    return " ".join(fuzz_judge.broken(measure(setting, replace(step, **changes)), exact=True))


def with_state(run, **changes):
    return with_course(run.steps[-1], state=replace(run.steps[-1].state, **changes))


def misstated(run, accepted=None):
    steps = [*run.steps[:-1], accepted or run.steps[-1]]
    return " ".join(fuzz_whole.misstated(run.scene, steps, fuzz_judge.measured(run)))


@pytest.mark.parametrize("run", ["pressed", "pulled"])
def test_what_is_right_passes_and_its_energies_are_the_library_s(run, request):
    right = request.getfixturevalue(run)
    assert [fuzz_judge.broken(m, exact=True) for m in fuzz_judge.measured(right)] == [[]] * len(right.steps)
    assert misstated(right) == ""
    work, *parts = np.sum([m.energies for m in fuzz_judge.measured(right)], axis=0)
    assert abs(work - sum(parts)) < 0.05 * work


def test_a_force_off_by_little_is_found(pressed):
    _, step = last_step(pressed)
    off = replace(step.led, force=step.led.force * (1 + PLANTED))
    assert "driven 1.0e-05" in found(pressed, led=off)
    last = pressed.steps[-1]
    assert "driven by another force" in misstated(pressed, replace(last, tool_forces=last.tool_forces * (1 + PLANTED)))


def test_a_force_on_half_a_tool_is_half_of_it(pressed):
    half = ran(pressed_block(Symmetry("left", 0)), increments=2)
    assert found(half) == misstated(half) == ""
    _, step = last_step(half)
    assert step.led.force == pytest.approx(1250.0)
    assert "driven" in found(half, led=replace(step.led, force=2 * step.led.force))


@pytest.mark.parametrize("names", [("translation",), ("translated",), ("translation", "translated")])
def test_a_tool_that_is_elsewhere_is_found(pressed, names):
    state = pressed.steps[-1].state
    planted = with_state(pressed, **{name: getattr(state, name) + PLANTED for name in names})
    said = found(pressed, planted)
    assert "placed" in said or "law" in said
    if "translated" in names:
        assert "tool 0 goes otherwise" in misstated(pressed, planted)


def test_a_prescribed_node_that_is_elsewhere_is_found(pulled):
    held, state = pulled.scene.mesh.boundary_nodes("right")[:1], pulled.steps[-1].state
    for name in ("nodes", "du"):
        moved = getattr(state, name).copy()
        moved[held, 0] += PLANTED
        assert "placed" in found(pulled, with_state(pulled, **{name: moved}))
    setting, step = last_step(pulled)
    begun, ended = step.prescribed
    assert "placed" in found(pulled, prescribed=(begun, ended * (1 + PLANTED)))
    assert measure(setting, step).placed == 0.0


def test_the_work_of_driven_supports_is_counted(pulled):
    setting, step = last_step(pulled)
    begun, ended = step.prescribed
    still = measure(setting, replace(step, prescribed=(ended, ended)))
    assert still.energies[0] < 0.9 * measure(setting, step).energies[0]
    assert np.isfinite(begun).all()


@pytest.fixture(scope="module")
def claimed():
    """A cylinder under 1.1 times its limit load, and the claim that ends its march."""
    scene = limit_scene(1.1, elements=2)
    with pytest.raises(LimitPassed) as caught:
        list(march(scene, Schedule(1), Control(cuts=1)))
    return scene, claim_of(caught.value)


def test_a_claim_of_collapse_is_proved_again(claimed):
    assert claimed[1].fraction == pytest.approx(1 / 1.1, rel=1e-6)
    assert refuted(*claimed) == []


@pytest.mark.parametrize(
    ("planted", "said"),
    [
        (lambda c: {"motion": -c.motion}, "gain"),
        (lambda c: {"motion": 0.999 * c.motion}, "gains 0.999"),
        (lambda c: {"motion": c.motion * (1.0, 1.0 + 2 * PLANTED)}, "volume"),
        (lambda c: {"motion": c.motion + PLANTED * np.abs(c.motion).max() * np.array([1.0, 0.0])}, "held"),
        (lambda c: {"fraction": c.fraction - 2 * PLANTED}, "said to be carried"),
    ],
)
def test_a_false_mechanism_is_found(claimed, planted, said):
    scene, claim = claimed
    assert any(said in what for what in refuted(scene, replace(claim, **planted(claim))))


def test_a_claim_of_a_load_that_is_carried_is_found(claimed):
    scene, claim = claimed
    carried = limit_scene(0.9999, elements=2)
    longer = replace(claim, motion=claim.motion * 1.1 / 0.9999, fraction=claim.fraction * 1.1 / 0.9999)
    assert any("of the load's gain is dissipated" in what for what in refuted(carried, longer))
    hardens = VonMises(scene.material.elasticity, Linear(300.0, 1.0))
    assert any("dissipated" in what for what in refuted(replace(scene, material=hardens), claim))


def test_a_tool_that_flies_until_it_lands_proves_nothing(claimed):
    scene, claim = claimed
    away = replace(scene.tools[0], point=(0.0, 5.0 + 1e-3))
    rest = replace(claim, motion=np.zeros_like(claim.motion), fraction=0.0)
    assert any("gain" in what for what in refuted(replace(scene, tools=(away,)), rest))


def test_a_body_that_flies_until_it_lands_proves_nothing():
    """A traction presses the block towards a base a little below it."""
    scene = pressed_block(Support("left", 0), force=(0.0, -1.0))
    base, load = replace(scene.tools[1], point=(0.0, -1e-3)), Traction("top", (0.0, -1.0))
    scene = replace(scene, tools=(base,), loads=(load,))
    down = np.where(np.arange(2) == 1, -0.1, 0.0) * np.ones_like(scene.mesh.nodes)
    claim = Claim(system_of(scene).rest(), down, 0.0, 1.0)
    assert any("lands" in what for what in refuted(scene, claim))
    wall = FlatTool((10.0, 0.0), (-1.0, 0.0), (0.0, 0.0), ("right",), 0.0)
    assert refuted(replace(scene, tools=(wall,)), claim) == []


@pytest.mark.parametrize("sampling", Sampling)
@pytest.mark.parametrize(("below", "proved"), [(1500.0, True), (900.0, False)])
def test_a_body_that_is_pushed_together_with_a_tool_it_does_not_touch_yet_never_rests(below, proved, sampling):
    """Whether the punch has landed or not: it is pushed down by 1000."""
    scene = pressed_block(Support("left", 0), force=(0.0, -1000.0))
    punch, base = (replace(tool, sampling=sampling) for tool in scene.tools)
    tools = replace(punch, point=(0.0, 10.0 + 1e-3)), replace(base, driven_by=Force((0.0, below)))
    up = np.where(np.arange(2) == 1, 1 / 500, 0.0) * np.ones_like(scene.mesh.nodes)
    scene = replace(scene, tools=tools)
    assert (refuted(scene, Claim(system_of(scene).rest(), up, 0.0, 1.0)) == []) == proved


@pytest.mark.slow
def test_forces_and_motions_are_drawn_without_changing_other_scenes(monkeypatch):
    # Those of one and two Q8 with constants for their volumes are refused: they have motions nearly without strain.
    seeds = sorted({*range(710100, 710200)} - {710172, 710181})
    drawn = [draw(seed) for seed in seeds]
    shares = [sum(word in d.kind for d in drawn) / len(drawn) for word in ("by force", "by supports")]
    assert 0.08 < shares[0] < 0.25
    assert 0.07 < shares[1] < 0.25
    others = [(seed, d) for seed, d in zip(seeds, drawn, strict=True) if " by " not in d.kind]
    monkeypatch.setattr(fuzz_driven, "FORCED", 0.0)
    monkeypatch.setattr(fuzz_driven, "PRESCRIBED", 0.0)
    assert all(" by " not in draw(seed).kind for seed in seeds)
    assert len(others) > 50
    for seed, known in others:
        again = draw(seed)
        assert (again.form, again.schedule, again.scene.tools) == (known.form, known.schedule, known.scene.tools)
        assert (again.scene.supports, again.scene.loads) == (known.scene.supports, known.scene.loads)


def test_variants_turn_and_scale_what_drives():
    supports = Prescribed("right", 0, 0.03), Symmetry("base", 1)
    scene = pressed_block(*supports, based=False, force=(100.0, -2500.0))
    turned = mirrored(scene, 0).scene
    assert turned.tools[0].driven_by == Force((-100.0, -2500.0))
    assert turned.supports[0] == Prescribed("right", 0, -0.03)
    scaled = in_units(scene, 10.0, 100.0).scene
    assert scaled.tools[0].driven_by is not None
    assert scaled.tools[0].driven_by.vector == pytest.approx((1e5, -2.5e6))
    assert [s.displacement for s in scaled.supports if isinstance(s, Prescribed)] == pytest.approx([0.3])
    whole = about(scene, supports[1]).scene
    assert [tool.driven_by for tool in whole.tools] == [Force((100.0, -2500.0)), Force((100.0, 2500.0))]
    assert sum(isinstance(support, Prescribed) for support in whole.supports) == 2


def test_a_tool_that_the_plane_cuts_keeps_the_whole_force_and_a_support_s_image_goes_the_other_way():
    plane = Symmetry("left", 0)
    scene = pressed_block(plane, Prescribed("right", 0, 0.03))
    other = about(scene, plane)
    assert [tool.driven_by for tool in other.scene.tools] == [Force((0.0, -2500.0)), None]
    assert {s.displacement for s in other.scene.supports if isinstance(s, Prescribed)} == {0.03, -0.03}
    half, whole = ran(scene, 2), ran(other.scene, 2)
    assert fuzz_judge.disagreement(half, whole, other, 0.0)[0] < fuzz_judge.DISAGREEMENT
    assert whole.steps[-1].state.translation == pytest.approx(half.steps[-1].state.translation, rel=1e-6)


def test_a_tool_that_hovers_over_an_unstressed_body_is_not_excused_by_the_round_off_of_its_nodes():
    """Half way to the body, which rests: nothing carries the tool's force, and the nodes carry nothing at all."""
    scene = pressed_block(Support("left", 0), Support("base", 1), based=False)
    system = system_of(replace(scene, tools=(replace(scene.tools[0], point=(0.0, 10.1)),)))
    halfway = np.zeros(system.body.space.size)
    halfway[-1] = 0.05
    iterate = Increment(system, system.rest(), 1.0).at(halfway)
    examined = Examined(iterate, np.zeros((system.candidates.node.size, 2)), 0.0)
    assert examined.certificate.tool_equilibrium == 1.0
    assert examined.ratios()["tool_equilibrium"] > 1


def test_a_march_that_fails_while_a_tool_is_on_its_way_claims_no_collapse():
    scene = pressed_block(Support("left", 0), Support("base", 1), based=False, force=(0.0, -300.0))
    away = replace(scene, tools=(replace(scene.tools[0], point=(0.0, 10.1)),))
    assert ran(away, 2).steps[-1].tool_forces[0, 1] == pytest.approx(-300.0)
    with pytest.raises(IncrementFailed) as caught:
        list(march(away, Schedule(2), Control(Newton(), (), Limits(passes=1), cuts=0)))
    assert not isinstance(caught.value, LimitPassed)
