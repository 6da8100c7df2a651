"""Scales, units and numbering: what once let wrong answers be certified."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import Control, FlatTool, Geometry, Perfect, Scene, Schedule, Support, VonMises, march, upsetting
from bipot.certificate import Bounds
from bipot.fem.strain import Configuration
from bipot.forms import Delassus, Dissipation, Newton, Tangent
from bipot.laws.von_mises import Elasticity
from bipot.marching import system_of
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from tests.scenes import rows_between

FORMS = (Newton(), Tangent(), Dissipation(), Delassus())
EXACT = pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name.value)


def last(scene, schedule, form):
    return tuple(march(scene, schedule, Control(form, ())))[-1]


def force(accepted):
    return float(np.abs(accepted.tool_forces[0, 1]))


@EXACT
@pytest.mark.parametrize("yield_stress", [1e5, 1e12])
def test_an_elastic_answer_does_not_depend_on_the_yield_stress(form, yield_stress):
    """At 1e12 the dissipation form was once 81 % off, certified to 2e-9."""
    scene = upsetting(mu=0.3, reduction=0.01, elements=4, hardening=Perfect(yield_stress))
    assert force(last(scene, Schedule(5, first=0.05), form)) == pytest.approx(175_721.8576, rel=1e-7)


@EXACT
@pytest.mark.parametrize("reduction", [1e-6, 1e-9, 1e-12])
def test_tiny_travel_gives_the_elastic_stiffness_and_is_certified_sharply(form, reduction):
    """Force over travel tends to a constant; no measure hides behind round-off."""
    scene = upsetting(mu=0.3, reduction=reduction, elements=3)
    accepted = last(scene, Schedule(5, first=0.05, settling=1, growth=4.0), form)
    stiff = upsetting(mu=0.3, reduction=1e-6, elements=3)
    expected = force(last(stiff, Schedule(5, first=0.05, settling=1, growth=4.0), Newton())) * reduction / 1e-6
    assert force(accepted) == pytest.approx(expected, rel=2e-6)
    assert accepted.solved.certificate.below_resolution(Bounds()) == ()


def clamped(length, stress):
    """The scene whose contact forces once differed by 29 % between units, with gaps of 4e-13 and 8e-8."""
    tool = FlatTool((0.0, 4 * length), (0.0, -1.0), (0.0, -0.08 * length), ("top", "left", "right"), 0.3)
    return Scene(
        block(3 * length, 4 * length, 3, 4, element=Element.Q8),
        Geometry.PLANE_STRAIN,
        VonMises(Elasticity(200 * stress, 0.4999), Perfect(0.02 * stress)),
        (Support("base", 0), Support("base", 1)),
        (tool,),
        configuration=Configuration.PAPER,
    )


@EXACT
def test_contact_forces_agree_between_units_in_a_nearly_incompressible_body(form):
    def forces(length, stress):
        # The discrete solvers do not all get there: then the fallback does.
        runs = march(
            clamped(length, stress), Schedule(2, first=0.02, settling=1, growth=4.0), Control(form, (Dissipation(),))
        )
        return np.array([a.solved.r for a in runs]) / (stress * length)

    own, other = forces(1.0, 1.0), forces(1e-3, 1e6)
    assert np.abs(own - other).max() < 1e-6 * np.abs(own).max()


def renumbered(mesh, seed):
    rng = np.random.default_rng(seed)
    old = rng.permutation(len(mesh.nodes))
    new = np.argsort(old)
    edges = {name: new[e] for name, e in mesh.boundaries.items()}
    return Mesh(mesh.nodes[old], rng.permutation(new[mesh.elements]), edges), new


def loose(mesh, mu):
    """A block that nothing but its two platens holds."""
    sides = ("left", "right")
    above = FlatTool((0.0, 2.0), (0.0, -1.0), (0.0, -0.1), ("top", *sides), mu)
    below = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base", *sides), mu)
    return Scene(mesh, Geometry.PLANE_STRAIN, VonMises(Elasticity(200.0, 0.3), Perfect(1.0)), (), (above, below))


@pytest.mark.parametrize("form", [Newton(), Tangent(), Dissipation()], ids=lambda form: form.name.value)
def test_a_body_held_by_its_platens_alone_takes_the_least_motion_and_says_so(form):
    moved = []
    for seed in range(2):
        mesh, new = renumbered(block(3.0, 2.0, 3, 2, element=Element.Q8), seed)
        accepted = tuple(march(loose(mesh, 0.0), Schedule(4, first=0.02, settling=1, growth=4.0), Control(form)))
        assert all(a.solved.undetermined == ("position in 1 rigid motion",) for a in accepted)
        moved.append((accepted[-1].state.nodes - mesh.nodes)[new])
    np.testing.assert_allclose(moved[0], moved[1], atol=1e-8)
    assert abs(moved[0][:, 0].mean()) < 1e-12


def test_friction_that_sticks_determines_the_position():
    accepted = tuple(
        march(loose(block(3.0, 2.0, 3, 2, element=Element.Q8), 0.5), Schedule(3, first=0.02, settling=1, growth=4.0))
    )
    assert all(a.solved.undetermined == () for a in accepted)


def test_tools_that_share_their_nodes_share_their_forces_and_it_is_said():
    """Two tools in one place: only the sum of their forces is determined."""
    scene = upsetting(mu=0.3, reduction=0.01, elements=2)
    punch = replace(scene.tools[0], candidates=("top",))
    accepted = last(
        replace(scene, tools=(punch, punch)), Schedule(5, first=0.05, settling=1, growth=4.0), Dissipation()
    )
    candidates, r = system_of(replace(scene, tools=(punch, punch))).candidates, accepted.solved.r
    pushed = np.unique(candidates.node[r[:, 0] > 1e-6 * r.max()])
    assert {f"forces at node {node}" for node in pushed} <= set(accepted.solved.undetermined)
    assert last(scene, Schedule(5, first=0.05, settling=1, growth=4.0), Dissipation()).solved.undetermined == ()


@pytest.mark.parametrize("form", [Newton(), Tangent(), Dissipation()], ids=lambda form: form.name.value)
def test_a_body_without_force_is_certified_while_tools_come_and_go(form):
    """Approach, press, lift off and go on: the body carries nothing but round-off at both ends."""
    scene = upsetting(mu=0.2, reduction=0.01, elements=2, hardening=Perfect(1e4))
    tool = scene.tools[0]
    away = replace(tool, point=(0.0, 5.02), path=((0.0, 0.0), (0.8, 1.0), (1.0, -1.0)))
    accepted = tuple(march(replace(scene, tools=(away,)), Schedule(20), Control(form, ())))
    forces = np.array([a.solved.r[:, 0].sum() for a in accepted])
    assert forces.max() > 1e3
    assert np.all(forces[[0, -1]] <= 1e-12 * forces.max())
    # What is left is that of the closed path of strain, which a rate of stress does not forget altogether.
    assert np.abs(accepted[-1].state.stress).max() <= 1e-6 * np.abs(accepted[15].state.stress).max()


def test_the_stored_increment_is_sharper_than_its_positions():
    """A travel of 1e-12 of the size keeps four digits in the positions, sixteen in displacement and gaps."""
    scene = upsetting(mu=0.3, reduction=1e-12, elements=2)
    accepted = last(scene, Schedule(3), Newton())
    start, end, system = accepted.start, accepted.state, system_of(scene)
    rows = rows_between(system.candidates, start.gap, start.tau, end.tau)
    stored = rows.motion(end.du.ravel()[system.body.space.free])[:, 0]
    travel = np.abs(scene.tools[0].moved(start.tau, end.tau)).max()
    np.testing.assert_allclose(stored, end.gap, atol=1e-15 * travel)
    closed = end.forces[:, 0] > 0
    assert np.abs(end.gap[closed]).max() < 1e-9 * travel
    by_position = system.candidates.distance(end.nodes, system.body.scene.travel(0.0, end.tau))
    assert np.abs(by_position[closed]).max() > 1e-6 * travel


def test_a_state_cannot_be_written_to():
    accepted = last(upsetting(mu=0.3, reduction=0.01, elements=1), Schedule(1), Newton())
    for name in ("nodes", "stress", "plastic_strain", "peeq", "forces", "gap", "du"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(accepted.state, name)[...] = 0.0
