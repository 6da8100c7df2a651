"""Deformable tools: contact between two parts, beside closed forms and recomputed by hand."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from bipot import (
    Amplitude,
    Configuration,
    Control,
    DeformableTool,
    Delassus,
    Dissipation,
    Elastic,
    Elasticity,
    Existing,
    FlatTool,
    Geometry,
    IncrementFailed,
    Newton,
    Penalty,
    Perfect,
    Prescribed,
    Recorder,
    ResultsError,
    Scene,
    SceneError,
    Schedule,
    Support,
    Tangent,
    VonMises,
    block,
    march,
    results,
    together,
    transferred,
)
from bipot.results import columns
from tests.deformable import ELASTIC, STEEL, bulging, pressed, shifted, stack
from tests.scenes import refused

NEWTON = Control(Newton(), ())
FEW = Schedule(5, first=0.02, settling=1, growth=4.0)


def last(scene, control=NEWTON, schedule=FEW):
    """The last increment of a march."""
    *_, accepted = march(scene, schedule, control)
    return accepted


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("turn", [0.0, 0.4, np.pi / 2, 3.0])
@pytest.mark.parametrize(("lower", "upper"), [(3, 5), (5, 3), (4, 4), (7, 2)])
def test_a_uniform_pressure_passes_meshes_that_do_not_match(lower, upper, turn, mu):
    accepted = last(stack(lower, upper, turn=turn, mu=mu), schedule=Schedule(1))
    stress = accepted.state.stress
    assert np.ptp(stress, axis=(0, 1)).max() < 1e-6 * np.abs(stress).max()
    c, s = np.cos(turn), np.sin(turn)
    across = s**2 * stress[..., 0] + c**2 * stress[..., 1] - np.sqrt(2.0) * s * c * stress[..., 3]
    np.testing.assert_allclose(across, -210e3 / (1 - 0.3**2) * 0.01 / 2, rtol=0.02)


@pytest.mark.parametrize(
    "geometry", [Geometry.AXISYMMETRIC, pytest.param(Geometry.PLANE_STRAIN, marks=pytest.mark.slow)]
)
def test_all_forms_give_one_answer(geometry):
    scene, few = pressed(geometry=geometry, press=0.1, elements=2), Schedule(2, first=0.1, settling=1, growth=4.0)
    first = last(scene, schedule=few)
    for form in (Tangent(), Dissipation(), Delassus()):
        other = last(scene, Control(form, ()), few)
        assert other.solved.certificate.relative_gap < 1e-7
        np.testing.assert_allclose(other.tool_force(0), first.tool_force(0), rtol=1e-5)
        np.testing.assert_allclose(other.state.nodes, first.state.nodes, atol=1e-6)
    penalised = last(scene, Control(Penalty(1e8, 1e8), ()), few)
    np.testing.assert_allclose(penalised.tool_force(0), first.tool_force(0), rtol=1e-2)


def depths(one, other):
    """How far points of the polyline ``one`` (n, 2) are inside of the half-planes of the nearest edge of ``other``."""
    s = np.linspace(0, 1, 41)[:, None]
    points = np.concatenate([a + s * (b - a) for a, b in pairwise(one)])
    out = []
    for p in points:
        best = (np.inf, 0.0)
        for a, b in pairwise(other):
            t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
            off = p - (a + t * (b - a))
            best = min(best, (float(off @ off), float((b - a)[0] * off[1] - (b - a)[1] * off[0])))
        out.append(np.copysign(np.sqrt(best[0]), best[1]))
    return np.array(out)


@pytest.fixture(scope="module")
def steps():
    """The march of a pressed billet."""
    return list(march(pressed(), FEW, NEWTON))


@pytest.mark.parametrize("geometry", [Geometry.AXISYMMETRIC, Geometry.PLANE_STRAIN])
def test_forces_balance_obey_the_law_and_surfaces_do_not_overlap(geometry, steps):
    """Recomputed from nodes, nodal forces of the stress and what supports bear alone."""
    scene = pressed(geometry=geometry)
    for accepted in steps if scene.ring else march(scene, FEW, NEWTON):
        iterate, mesh = accepted.solved.iterate, scene.mesh
        space = iterate.increment.system.body.space
        contact = space.nodal(iterate.response.element_forces) - accepted.reactions
        billet, punch = (np.unique(mesh.elements[mesh.region(part)]) for part in ("billet", "punch"))
        force = np.abs(contact).max()
        assert abs(contact[billet].sum(axis=0) + contact[punch].sum(axis=0))[1] < 1e-6 * force
        np.testing.assert_allclose(contact[billet].sum(axis=0), accepted.tool_forces[0], atol=1e-5 * force)
        on = np.union1d(mesh.boundary_nodes("billet/top", "billet/side" if scene.ring else "billet/right"), [])
        assert np.abs(np.delete(contact, np.union1d(on, mesh.boundary_nodes("punch/base")).astype(int), 0)).max() < (
            1e-6 * force
        )
        r = accepted.state.forces
        assert r[:, 0].min() >= -1e-8 * r.max()
        assert (abs(r[:, 1]) <= 0.2 * r[:, 0] + 1e-8 * r.max()).all()
        x = accepted.state.nodes
        top, base = (x[np.unique(mesh.boundary(name))] for name in ("billet/top", "punch/base"))
        top, base = (line[np.argsort(line[:, 0])] for line in (top, base))
        # Means vanish, not gaps: places overlap by a small part of an element's side.
        assert depths(top, base[::-1]).max(initial=0.0) < 0.02 * 1.25


def test_work_is_what_is_stored_and_dissipated():
    scene = pressed(elements=2)
    coarse, fine = (last(scene, schedule=Schedule(n, first=0.1 / n, settling=1, growth=4.0)).energies for n in (4, 12))
    assert abs(coarse.energy_error) < 1e-3
    assert abs(fine.energy_error) < 2e-4
    assert fine.friction > 0.01 * fine.work


@pytest.mark.parametrize("increments", [12, pytest.param(48, marks=pytest.mark.slow)])
def test_a_corner_that_ploughs_is_pushed_back_by_the_slope_before_it(increments):
    """A hard block is pressed into a soft plate and dragged: a force beyond friction pays for what flows there."""
    mesh = together({"low": block(3.0, 1.0, 10, 2), "up": shifted(block(1.0, 0.5, 3, 2), 0.5, 1.0)})
    supports = (
        Support("low/base", 0),
        Support("low/base", 1),
        Prescribed("up/top", 1, -0.05, Amplitude(((0, 0), (0.25, 1), (1, 1)))),
        Prescribed("up/top", 0, 0.5, Amplitude(((0, 0), (0.25, 0), (1, 1)))),
    )
    tool = DeformableTool(("low/top",), ("up/base",), 0.1)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, STEEL, supports, (tool,), regions={"up": ELASTIC})
    accepted = last(scene, schedule=Schedule(increments))
    along, across = accepted.tool_force(0)
    assert -along > 2 * 0.1 * across
    assert accepted.energies.plastic > 0.5 * accepted.energies.work
    assert abs(accepted.energies.energy_error) < 0.25 / increments


def test_a_stiff_punch_is_a_rigid_one():
    """Its force is that of a flat tool, the more so the stiffer."""
    scene = pressed()
    tool = FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, -0.6), ("billet/top", "billet/side"), 0.2)
    rigid = Scene(
        mesh=together({"billet": scene.mesh.__class__(*_part(scene.mesh, "billet"))}),
        geometry=scene.geometry,
        material=STEEL,
        supports=scene.supports[:2],
        tools=(tool,),
    )
    force = last(rigid).tool_force(0)[1]
    stiff = [pressed(punch=Elastic(Elasticity(young, 0.0))) for young in (1e7, 1e9)]
    errors = [abs(last(of).tool_force(0)[1] / force - 1) for of in stiff]
    assert errors[1] < errors[0] < 1e-3
    assert errors[1] < 2e-4


def _part(mesh, name):
    elements = mesh.elements[mesh.region(name)]
    nodes = np.unique(elements)
    number = np.full(len(mesh.nodes), -1)
    number[nodes] = np.arange(len(nodes))
    bounds = {key.split("/")[1]: number[of] for key, of in mesh.boundaries.items() if key.startswith(name)}
    return mesh.nodes[nodes], number[elements], bounds


def test_sliding_friction_is_mu_times_the_pressing_force():
    """An upper block is pressed and dragged over a longer one, by many of its elements."""
    mesh = together({"low": block(4.0, 1.0, 13, 2), "up": shifted(block(1.0, 0.5, 3, 2), 0.5, 1.0)})
    supports = (
        Support("low/base", 0),
        Support("low/base", 1),
        Prescribed("up/top", 1, -0.002, Amplitude(((0.0, 0.0), (0.2, 1.0), (1.0, 1.0)))),
        Prescribed("up/top", 0, 1.5, Amplitude(((0.0, 0.0), (0.2, 0.0), (1.0, 1.0)))),
    )
    scene = Scene(mesh, Geometry.PLANE_STRAIN, ELASTIC, supports, (DeformableTool(("low/top",), ("up/base",), 0.3),))
    steps = list(march(scene, Schedule(10), Control(Newton())))
    force = steps[-1].tool_forces[0]
    assert -force[0] == pytest.approx(0.3 * force[1], rel=1e-3)
    assert steps[-1].state.tau == 1.0


def test_parts_come_into_contact_through_the_air_and_part_again():
    mesh = together({"low": block(1.0, 1.0, 3, 3), "up": shifted(block(0.5, 0.5, 2, 2), 0.2, 1.1)})
    supports = (
        Support("low/base", 0),
        Support("low/base", 1),
        Support("up/top", 0),
        Prescribed("up/top", 1, -0.2, Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 0.0)))),
    )
    scene = Scene(mesh, Geometry.PLANE_STRAIN, STEEL, supports, (DeformableTool(("up/base",), ("low/top",), 0.2),))
    steps = list(march(scene, Schedule(10), Control(Newton())))
    pushed = [-step.tool_forces[0, 1] for step in steps]
    assert pushed[1] == pushed[-1] == 0
    assert max(pushed) == pushed[4] > 0
    assert steps[-1].state.peeq.max() > 0.01


def test_long_increments_do_not_let_parts_pass_through_each_other():
    thin = shifted(block(1.0, 0.02, 4, 1), 0.0, 1.05)
    mesh = together({"low": block(1.0, 1.0, 3, 3), "up": thin})
    supports = Support("low/base", 0), Support("low/base", 1), Support("up/top", 0), Prescribed("up/top", 1, -0.5)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, ELASTIC, supports, (DeformableTool(("up/base",), ("low/top",), 0.0),))
    with pytest.raises(IncrementFailed):
        next(march(scene, Schedule(1), Control(Newton(), cuts=0)))


def test_other_units_and_places_change_nothing(steps):
    scene, here = pressed(), steps[-1]
    mesh = replace(scene.mesh, nodes=scene.mesh.nodes * 1e-3)
    punch = replace(scene.supports[-1], displacement=-0.6e-3)
    pascal = replace(
        STEEL, elasticity=Elasticity(210e9, 0.3), hardening=replace(STEEL.hardening, sigma_y=300e6, modulus=1e9)
    )
    there = last(
        replace(
            scene,
            mesh=mesh,
            material=pascal,
            regions={"punch": Elastic(Elasticity(210e9, 0.3))},
            supports=(*scene.supports[:-1], punch),
        )
    )
    np.testing.assert_allclose(there.state.nodes * 1e3, here.state.nodes, atol=1e-7)
    np.testing.assert_allclose(there.tool_forces, here.tool_forces, rtol=1e-6)


def test_a_stack_of_blocks_yields_where_the_weaker_does():
    """Frictionless in plane strain: 2 sigma_Y / sqrt 3 of the weaker block, by the force of the supports."""
    soft, strong = (VonMises(STEEL.elasticity, Perfect(of)) for of in (100.0, 300.0))
    scene = replace(stack(press=-0.02), material=strong, regions={"low": soft}, configuration=Configuration.SMALL)
    force = last(scene, schedule=Schedule(4)).tool_forces[0]
    assert force[1] == pytest.approx(2 / np.sqrt(3) * 100.0, rel=1e-3)


def test_a_run_is_recorded_resumed_and_read(tmp_path):
    scene, units = pressed(press=0.2, elements=2), {"length": "mm", "stress": "MPa"}
    table = (columns.INCREMENT, columns.OVERLAP)
    steps = list(march(scene, FEW, NEWTON))
    for name, few in (("whole", steps), ("part", steps[:3])):
        with Recorder(tmp_path / name, scene, table, {}, units) as recorder:
            for accepted in few:
                recorder.record(accepted)
    with Recorder(tmp_path / "part", scene, table, {}, units, existing=Existing.RESUME) as recorder:
        for accepted in march(scene, FEW, NEWTON, start=recorder.start):
            recorder.record(accepted)
    whole, part = (results.open(tmp_path / name) for name in ("whole", "part"))
    np.testing.assert_array_equal(whole.times, part.times)
    assert 0 <= whole["overlap"][-1] < 1e-3
    assert whole.scene["tools"][0]["boundaries"] == ["punch/base"]
    other = replace(scene, tools=(DeformableTool(("punch/base",), ("billet/top",), 0.2),))
    with pytest.raises(ResultsError, match="scene"):
        Recorder(tmp_path / "part", other, table, {}, units, existing=Existing.RESUME)


def test_what_does_not_fit_is_refused():
    scene = pressed()
    tool = scene.tools[0]
    refused(lambda: replace(scene, tools=()), "in parts")
    refused(lambda: replace(scene, tools=(replace(tool, surface=("punch",)),)), r"tools\[0\]\.surface")
    refused(lambda: replace(tool, candidates=("punch/base",)), "other boundaries")
    refused(lambda: DeformableTool((), ("a",), 0.1), "at least one mesh boundary")
    refused(lambda: replace(tool, met=3), "tool.met = 3")
    two = stack()
    upper = np.unique(two.mesh.elements[two.mesh.region("up")])
    deep = two.mesh.nodes.copy()
    deep[upper, 1] -= 0.01
    refused(lambda: replace(two, mesh=replace(two.mesh, nodes=deep)), "off the tool's surface")
    state = last(stack()).state
    with pytest.raises(SceneError, match=r"zero|parts"):
        transferred(state, stack(), stack())


def test_sides_that_sink_into_each_other_beside_their_means_are_refused():
    """With the candidates on the wide coarse side, the middle of the other sinks in as its two means stay closed."""
    with pytest.raises(IncrementFailed, match=r"overlap by .* make the finer side the candidates"):
        list(march(bulging(0.1), FEW, NEWTON))
    assert all(np.isfinite(last.tool_forces).all() for last in march(bulging(0.1, swapped=True), FEW, NEWTON))
