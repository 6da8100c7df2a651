"""Loads and prescribed displacements where tools touch: friction of what is driven, welds, shared forces; own loads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import IncrementFailed, SceneError
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Newton, Tangent
from bipot.laws.hardening import Linear
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.paths import Amplitude
from bipot.scene.loads import Load, PointForce, Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support
from bipot.tools.tool import FlatTool
from tests.scenes import FORMS, bar, last, named, refused


def pressed(*extra: Load, held: tuple[Support, ...] = ()) -> Scene:
    """A plastic block under a traction, its base held in both directions."""
    mesh = block(2.0, 1.0, 2, 2, element=Element.Q8)
    supports = (Support("base", 0), Support("base", 1), *held)
    material = VonMises(Elasticity(1000.0, 0.3), Linear(1.0, 100.0))
    return Scene(mesh, Geometry.PLANE_STRAIN, material, supports, loads=(Traction("top", (0.0, -1.5)), *extra))


@pytest.mark.parametrize("form", FORMS, ids=named)
@pytest.mark.parametrize(
    "load", [PointForce(0, (1e9, 1e9)), Traction("base", (1e6, 1e6))], ids=["point force", "traction"]
)
def test_a_load_on_held_nodes_goes_into_the_support_and_measures_nothing(form, load):
    alone, loaded = (last(scene, Schedule(4), form) for scene in (pressed(), pressed(load)))
    np.testing.assert_allclose(loaded.state.nodes, alone.state.nodes, rtol=0, atol=1e-8)
    assert loaded.solved.certificate.resolution.equilibrium < 1e-9


def dragging(mu: float, pulled: float) -> Scene:
    """A strip pressed on a tool at rest, both ends driven along it."""
    mesh = block(2.0, 0.5, 2, 1, element=Element.Q8)
    ends = tuple(Prescribed(name, 0, pulled, Amplitude(((0, 0), (0.5, 0), (1, 1)))) for name in ("left", "right"))
    press = Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 1.0)))
    tool = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), mu)
    loads = (Traction("top", (0.0, -3.0), press),)
    return Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(1000.0, 0.0)), ends, (tool,), loads=loads)


def test_what_a_support_drives_along_a_tool_rubs_on_it():
    """All five contacts slip, the corners by what is prescribed: the tool feels mu N, and the energies know it."""
    *_, before, end = march(dragging(0.3, 0.3), Schedule(8), Control(Newton()))
    (push, pull) = end.tool_forces[0, 1], end.tool_forces[0, 0]
    assert push == pytest.approx(6.0, rel=1e-6)
    assert pull == pytest.approx(-0.3 * push, rel=1e-9)
    reactions = end.solved.iterate.reactions(end.solved.r)
    assert reactions[:, 0].sum() == pytest.approx(0.3 * push, rel=1e-6)
    assert end.energies.friction - before.energies.friction == pytest.approx(0.3 * push * 0.3 / 4, rel=2e-2)
    assert abs(end.energies.energy_error) < 1e-2


@pytest.mark.parametrize("scene", [dragging(np.inf, 0.3)], ids=["along"])
def test_a_weld_that_a_support_tears_is_refused(scene):
    with pytest.raises(IncrementFailed, match="against the tool that it is welded to"):
        last(scene, Schedule(4), Newton())


def test_a_weld_that_a_support_lifts_is_refused():
    mesh = block(1.0, 1.0, 2, 2, element=Element.Q8)
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, 0.0), ("top",), np.inf)
    supports = (Support("base", 1), Prescribed("left", 1, -0.1), Support("right", 0))
    scene = Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(1.0, 0.3)), supports[1:], (tool,))
    with pytest.raises(IncrementFailed, match="against the tool that it is welded to"):
        last(scene, Schedule(2), Newton())


def test_a_body_turned_inside_out_is_refused_in_small_strain_too():
    scene = replace(bar(supports=(Prescribed("top", 1, -8.0),)), configuration=Configuration.SMALL)
    with pytest.raises(IncrementFailed, match="not positive"):
        last(scene, Schedule(2), Newton())


def test_a_floating_body_in_small_strain_with_loads_in_balance_is_solved():
    """Its free rotation is that of the body at rest."""
    scene = bar((Traction("top", (0.0, 300.0)), Traction("base", (0.0, -300.0))))
    scene = replace(scene, supports=(), configuration=Configuration.SMALL)
    end = last(scene, Schedule(5), Newton())
    np.testing.assert_allclose(end.state.stress[..., 1], 300.0, rtol=1e-6)
    assert end.solved.undetermined


@pytest.mark.parametrize("pulled", [0.1, 0.3, 0.7])
@pytest.mark.parametrize("mu", [0.3, np.inf])
def test_what_moves_with_its_tool_does_not_rub_on_it(mu, pulled):
    """The slip of a node driven along with the tool is round-off: no friction, and no weld is torn."""
    mesh, move = block(1.0, 1.0, 2, 2, element=Element.Q8), Amplitude(((0.0, 0.0), (0.4, 0.0), (1.0, 1.0)))
    supports = (Support("base", 1), Prescribed("top", 0, pulled, move))
    path = ((0.0, (0.0, 0.0)), (0.4, (0.0, 1.0)), (1.0, (1.0, 1.0)))
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (pulled, -0.01), ("top",), mu, path)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(1000.0, 0.3)), supports, (tool,))
    for accepted in march(scene, Schedule(5), Control(Newton())):
        assert accepted.tool_forces[0, 1] < -1.0
        assert abs(accepted.tool_forces[0, 0]) < 1e-6


def test_forces_that_two_tools_share_on_one_node_are_said_to_be_undetermined():
    """A split die: two tools on one plane, with and without friction, both under the common node, which slides."""
    mesh = block(2.0, 1.0, 4, 2, element=Element.Q8)
    edges = mesh.boundary("base")
    middle = mesh.nodes[edges[:, 1], 0]
    halves = {"near": edges[middle < 1.0], "far": edges[middle > 1.0]}
    mesh = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, **halves})
    dies = [FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), (name,), mu) for name, mu in (("near", 0.3), ("far", 0.0))]
    loads = (Traction("top", (0.0, -5.0)), Traction("top", (6.0, 0.0), Amplitude(((0.0, 0.0), (0.5, 0.0), (1.0, 1.0)))))
    spring = (Prescribed("left", 0, 0.01, Amplitude(((0.0, 0.0), (0.5, 0.0), (1.0, 1.0)))),)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(1000.0, 0.3)), spring, tuple(dies), loads=loads)
    end = last(scene, Schedule(4), Tangent())
    shared = np.intersect1d(halves["near"], halves["far"])
    assert end.solved.undetermined == (f"forces at node {shared[0]}",)
    assert not end.unique


def test_a_tool_that_slides_in_touch_without_a_force_is_solved():
    mesh = block(1.0, 1.0, 2, 2, element=Element.Q8)
    for travel in (0.01, 0.1, 0.013):
        tool = FlatTool((0.0, 1.0), (0.0, -1.0), (travel, 0.0), ("top",), 0.3)
        supports = (Support("base", 1), Support("base", 0))
        scene = Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(1000.0, 0.3)), supports, (tool,))
        for form in (Newton(), Tangent()):
            end = last(scene, Schedule(2), form)
            assert not end.solved.r.any() or np.abs(end.solved.r).max() < 1e-9


@pytest.mark.parametrize("share", [0.5, 1 - 1e-9, 1.0])
@pytest.mark.parametrize("form", [Newton(), Tangent()], ids=named)
def test_a_block_pulled_by_up_to_its_friction_stays_and_what_is_free_is_said(form, share):
    mesh = block(2.0, 1.0, 4, 2, element=Element.Q8)
    tool = FlatTool((0.0, 0.0), (0.0, 1.0), (0.0, 0.0), ("base",), 0.3)
    loads = (Traction("top", (3.0 * share, -10.0)),)
    scene = Scene(mesh, Geometry.PLANE_STRAIN, Elastic(Elasticity(210_000.0, 0.3)), (), (tool,), loads=loads)
    end = last(scene, Schedule(1), form)
    np.testing.assert_allclose(end.tool_forces[0], [-6.0 * share, 20.0], rtol=1e-6)
    assert np.abs(end.state.nodes - mesh.nodes).max() < 1e-3
    assert end.unique == (share < 1 - 1e-8)


@pytest.mark.parametrize("late", [1e-6, 5e-10, 1e-11])
def test_a_corner_right_behind_a_scheduled_time_is_landed_on(late):
    """A bar is drawn, pushed in no time and drawn again: it yields three times, in increments of any number."""
    there_and_back = Amplitude(((0.0, 0.0), (0.5, 1.0), (0.5 + late, -1.0), (1.0, 1.0)))
    steel = VonMises(Elasticity(1000.0, 0.3), Linear(10.0, 50.0))
    scene = replace(bar(supports=(Prescribed("top", 1, 0.1, there_and_back),)), material=steel)
    four, three = (last(scene, Schedule(number), Newton()).peeq.mean() for number in (4, 3))
    assert four == pytest.approx(three, rel=1e-3)


FIRST_DRAWN = Amplitude(((0, 0), (0.5, 1), (1, 0)))


@pytest.mark.parametrize(
    "points", [((0, 1), (1, 0)), *(((0, 0), (early, 1), (1, 0)) for early in (5e-10, 1e-11, 5e-324))]
)
def test_what_falls_from_the_first_moment_on_has_been_there(points):
    """A bar that is drawn at once and let off yields as one that is drawn first."""
    steel, amplitudes = VonMises(Elasticity(1000.0, 0.3), Linear(10.0, 50.0)), (Amplitude(points), FIRST_DRAWN)
    bars = (replace(bar((Traction("top", (0.0, 12.0), a),)), material=steel) for a in amplitudes)
    let_off, drawn = (last(scene, Schedule(1), Newton()) for scene in bars)
    assert drawn.peeq.min() > 0.01
    np.testing.assert_allclose(let_off.peeq, drawn.peeq, rtol=1e-6)
    assert let_off.energies.plastic == pytest.approx(drawn.energies.plastic, rel=1e-6)


def test_points_of_a_path_that_no_march_can_tell_apart_are_refused():
    jump = ((0.0, 0.0), (0.5, 1.0), (0.5 + 1e-15, -1.0), (1.0, 1.0))
    refused(lambda: Amplitude(jump), "amplitude.points = .*: must be .* tau increasing from 0 to 1, by more than 1e-12")


def test_a_march_lands_on_every_corner_of_an_amplitude():
    there_and_back = Amplitude(((0.0, 0.0), (0.3, 1.0), (1.0, 0.0)))
    scene = replace(pressed(), loads=(Traction("top", (0.0, -1.5), there_and_back),))
    steps = list(march(scene, Schedule(1), Control(Newton())))
    assert [a.state.tau for a in steps] == [0.3, 1.0]
    assert steps[-1].state.peeq.max() > 1e-3


class Short:
    """A load of one's own, of another shape than the nodes."""

    amplitude = Amplitude()

    def check(self, mesh):
        pass

    def forces(self, space):
        return np.zeros(space.mesh.nodes.shape)[1:]


def test_forces_of_a_load_of_ones_own_are_refused_where_they_are_not_those_of_nodes():
    said = r"forces of Short = '\(\d+, 2\)': must be finite, and of shape \(\d+, 2\): those of nodes"
    with pytest.raises(SceneError, match=said):
        next(march(bar((Short(),)), Schedule(1)))
