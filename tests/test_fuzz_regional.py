"""Scenes of several materials in the fuzz study: draws, variants, and planted errors."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import Elastic
from studies.fuzz import judge, solid
from studies.fuzz.judge import Ran, run
from studies.fuzz.metals import bulk_and_shear, metals, yield_stress_of
from studies.fuzz.regional import draw_regional, draw_solid_regional
from studies.fuzz.row import Outcome
from studies.fuzz.solid_unfolded import unfolded as solid_unfolded
from studies.fuzz.solid_variants import variants as solid_variants
from studies.fuzz.unfolded import unfolded
from studies.fuzz.variants import variants
from tests.scenes import with_course

PLANE, SOLID = 14, 8
"""Seeds of scenes that end certified; that in the plane has a region that never yields."""


def test_scenes_have_one_or_two_regions_and_are_always_the_same():
    scenes = [draw_regional(seed).scene for seed in range(9)]
    counts = [len(scene.regions) for scene in scenes]
    assert set(counts) == {1, 2}
    assert any(isinstance(own, Elastic) for scene in scenes for own in scene.regions.values())
    assert any(len(set(map(id, metals(scene)))) == 3 for scene in scenes)
    assert scenes[3] == draw_regional(3).scene


def check_kept(scene, others, whole):
    """Elements have the metals that they had, in other units, in another order, and twice."""
    own = metals(scene)
    units, seen, renumbered = others[:3]
    here, there = (np.concatenate(bulk_and_shear(one), axis=1) for one in (scene, units.scene))
    scale = float(there[0, 0] / here[0, 0])
    np.testing.assert_allclose(there, scale * here, rtol=1e-12)
    some = np.full((len(own), 1), 0.1)
    np.testing.assert_allclose(yield_stress_of(units.scene)(some), scale * yield_stress_of(scene)(some), rtol=1e-12)
    assert metals(seen.scene) == own
    middles = {tuple(sorted(renumbered.number[e])): metal for e, metal in zip(scene.mesh.elements, own, strict=True)}
    for element, metal in zip(renumbered.scene.mesh.elements, metals(renumbered.scene), strict=True):
        assert middles[tuple(sorted(element))] == metal
    for other in whole:
        assert metals(other.scene) == own + own


def test_variants_have_the_materials_of_the_scene():
    scenes = [draw_regional(seed).scene for seed in (4, 7, 8, 10)]
    for scene in scenes:
        check_kept(scene, variants(scene, 1), unfolded(scene))
    assert any(unfolded(scene) for scene in scenes)


def test_variants_have_the_materials_of_a_body_in_space():
    for seed in (1, 4, 6):
        scene = draw_solid_regional(seed).scene
        planes = [support for support in scene.supports if type(support).__name__ == "Symmetry"]
        check_kept(scene, solid_variants(scene, 1), [solid_unfolded(scene, planes[0])] if planes else [])


def exchanged(scene):
    """The scene with another material in its regions: that of the body."""
    return replace(scene, regions={})


def test_a_wrong_material_is_found():
    drawn = draw_regional(PLANE)
    ran = run(drawn, drawn.scene)
    assert not ran.reason
    assert not any(judge.broken(m, True) for m in judge.measured(ran))
    found = [what for m in judge.measured(Ran(exchanged(drawn.scene), ran.steps, "")) for what in judge.broken(m, True)]
    assert any(what.startswith("elastic") for what in found)


def test_a_wrong_material_in_space_is_found():
    drawn = draw_solid_regional(SOLID)
    ran = run(drawn, drawn.scene)
    assert solid.faults(ran, True)[0] == []
    assert any("elastic" in what for what in solid.faults(Ran(exchanged(drawn.scene), ran.steps, ""), True)[0])


def test_flow_of_what_never_yields_is_found():
    drawn = draw_regional(PLANE)
    ran = run(drawn, drawn.scene)
    elements = [k for k, own in enumerate(metals(drawn.scene)) if isinstance(own, Elastic)]
    last = ran.steps[-1]
    assert (last.state.peeq[elements] == 0).all()
    plastic = last.state.plastic_strain.copy()
    plastic[elements[0], 0, :2] += (1e-4, -1e-4)
    steps = [*ran.steps[:-1], with_course(last, state=replace(last.state, plastic_strain=plastic))]
    assert judge.measured(ran)[-1].flow <= judge.LIMITS["flow"]
    assert judge.measured(replace(ran, steps=steps))[-1].flow > 1e-5


@pytest.mark.parametrize(("judged", "seed"), [(judge.judge_regional, PLANE), (solid.judge_solid_regional, SOLID)])
def test_such_scenes_are_certified(judged, seed):
    row = judged(seed)
    assert row.outcome is Outcome.CERTIFIED
    assert row.kind.split()[0] in ("regional", "solid")
