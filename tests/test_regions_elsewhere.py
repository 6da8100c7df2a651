"""Bodies of several materials: limit loads, slopes, penalties, bodies drawn anew, run files, refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bipot import (
    Control,
    Elasticity,
    Existing,
    FlatTool,
    Force,
    Geometry,
    Integration,
    Linear,
    Newton,
    Perfect,
    Recorder,
    ResultsError,
    Scene,
    SceneError,
    Schedule,
    Symmetry,
    VonMises,
    block,
    limit_load,
    march,
    results,
    sensitivities,
    transferred,
)
from bipot.forms.penalty import contact_penalty
from bipot.laws.von_mises import RateVonMises
from bipot.system import system_of
from tests.regional import COPPER, FEW, HARD, STEEL, billet, last, lined, plane, split
from tests.scenes import refused


def test_the_limit_load_of_columns_is_that_of_their_mean_strength():
    """Frictionless in plane strain each carries 2 sigma_Y / sqrt 3; the force is that on both halves."""
    soft, strong = VonMises(STEEL.elasticity, Perfect(100.0)), VonMises(COPPER.elasticity, Perfect(300.0))
    lid = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.0), ("top",), 0.0, driven_by=Force((0.0, -1.0)))
    scene = Scene(
        mesh=split(block(1.0, 1.0, 4, 4)),
        geometry=Geometry.PLANE_STRAIN,
        material=strong,
        supports=(Symmetry("left", 0), Symmetry("base", 1)),
        tools=(lid,),
        regions={"core": soft},
    )
    assert limit_load(scene).multiple == pytest.approx(2 * 2 / math.sqrt(3) * 200.0, rel=1e-6)


def test_slopes_by_a_regions_parameters_are_those_of_two_marches():
    def of(strength, young):
        return billet(VonMises(Elasticity(young, 0.34), Linear(strength, 400.0)))

    at = {"strength": 80.0, "young": 120e3}
    control = Control(Newton(), integration=Integration.BACKWARD_EULER)
    *_, (_, slopes) = sensitivities(of, at, FEW, control)
    for name, value in at.items():
        h = 1e-5 * value
        up, down = (last(of(**{**at, name: value + d}), control).tool_force(0)[1] for d in (h, -h))
        assert slopes[name].tool_forces[0, 1] == pytest.approx((up - down) / (2 * h), rel=1e-3)
    with pytest.raises(SceneError, match="kinds of material"):
        list(sensitivities(lambda nu: billet(COPPER if nu == 0.3 else HARD), {"nu": 0.3}, FEW, control))


def test_what_is_drawn_anew_keeps_the_jump_between_materials():
    """On its own mesh, and on a finer one where fields are those of each region's own points."""
    path = (0.0, 0.0), (0.9, 1.0), (1.0, 0.9)
    scene = plane(COPPER)
    scene = replace(scene, tools=(replace(scene.tools[0], path=path, candidates=("top",)),))
    state = last(scene, schedule=Schedule(10)).state
    onto = replace(scene, mesh=replace(scene.mesh, nodes=state.nodes), tools=())
    found = transferred(state, scene, onto)
    np.testing.assert_allclose(found.state.stress, state.stress, atol=2e-3 * np.abs(state.stress).max())
    np.testing.assert_allclose(found.state.peeq, state.peeq, atol=1e-9)
    with pytest.raises(SceneError, match=r"onto\.regions"):
        transferred(state, scene, replace(onto, regions={"core": STEEL}))
    whole = {"core": np.arange(len(onto.mesh.elements))}
    with pytest.raises(SceneError, match="parts of one material"):
        transferred(state, scene, replace(onto, mesh=replace(onto.mesh, regions=whole)))


def test_penalised_contact_takes_the_stiffest_part_beneath_the_tool():
    hard, steel = (contact_penalty(system_of(plane(core)).candidates) for core in (HARD, STEEL))
    assert hard / steel == pytest.approx(600e3 / 210e3)


def test_wrong_regions_are_refused():
    scene = billet()
    words = r"scene\.regions, a name = 'shell': must be one of \['core'\]"
    refused(lambda: replace(scene, regions={"shell": STEEL}), words)
    refused(lambda: replace(scene, regions={"core": 210e3}), r"scene\.regions\['core'\]")
    refused(lambda: replace(scene, regions=STEEL), r"scene\.regions")
    rate = RateVonMises(STEEL.elasticity, STEEL.hardening)
    refused(lambda: replace(scene, regions={"core": rate}), "stress is returned")
    refused(lambda: replace(scene, material=rate), "stress is returned")
    both = {"core": scene.mesh.region("core"), "left": [0, 15]}
    twice = replace(scene, mesh=replace(scene.mesh, regions=both))
    refused(lambda: replace(twice, regions={"core": COPPER, "left": STEEL}), "of element \\[0\\]")
    elastic = replace(scene, tools=(replace(scene.tools[0], shear=0.5),))
    refused(lambda: replace(elastic, regions={"core": HARD}), "does not flow")
    with pytest.raises(SceneError, match=r"scene\.regions\['liner'\] = .*: must be one that flows at a last yield"):
        limit_load(replace(lined(4, HARD, VonMises(STEEL.elasticity, Perfect(100.0)), 1.0)))


def test_runs_say_what_is_where_and_go_on_with_the_same_alone(tmp_path):
    scene = plane(COPPER)
    units = {"length": "mm", "stress": "MPa"}
    with Recorder(tmp_path, scene, (), {}, units) as recorder:
        for accepted in march(scene, FEW):
            recorder.record(accepted)
    found = results.open(tmp_path)
    assert found.scene["regions"] == {"core": repr(COPPER)}
    np.testing.assert_array_equal(found.mesh.region("core"), scene.mesh.region("core"))
    with pytest.raises(ResultsError, match="scene"):
        Recorder(tmp_path, replace(scene, regions={"core": HARD}), (), {}, units, existing=Existing.RESUME)
