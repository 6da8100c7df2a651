"""Supports between the axes of space: a scene turned as a whole keeps what the law determines."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Newton
from bipot.laws.flow import Integration
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.limit_analysis import limit_load
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.solids import brick
from bipot.results import Existing, Recorder
from bipot.results.columns import INCREMENT
from bipot.scene.loads import Traction
from bipot.scene.scene import Scene
from bipot.scene.supports import Prescribed, Support, Symmetry
from bipot.tools.poses import Force
from bipot.tools.tool import FlatTool
from tests.curved import STEEL, apart
from tests.golden import FORMS, Case
from tests.solids import turned
from tests.space import dented, turned_scene

Q = turned((1.0, -2.0, 3.0), 0.8)
SCHEDULE = Schedule(3, first=0.05, settling=1, growth=3)
PLANES = Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)
BASE = tuple(Support("base", axis) for axis in range(3))


def held(supports, tools=(), element=Element.H8, **changes):
    return Scene(brick(1.0, 1.0, 1.0, 2, 2, 2, element=element), Geometry.SOLID, STEEL, supports, tools, **changes)


def platen(travel=(0.0, 0.0, -0.1), **changes):
    return FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), travel, ("top",), 0.3, **changes)


WALLS = Support("right", (0.8, 0.36, 0.48)), Prescribed("top", (0.48, 0.6, -0.64), 0.05)

SCENES = {
    "an eighth under a platen": held(PLANES, (platen(),)),
    "a quarter under a sphere": dented(elements=2),
    "driven aslant along a slant": held((*BASE, *WALLS)),
    "a platen that a force drives": held(PLANES, (platen((0.0, 0.0, 0.0), driven_by=Force((0.0, 0.0, -1500.0))),)),
    "quadratic tetrahedra along a slant": held((*BASE, *WALLS), element=Element.T10),
}
BOTH = list(SCENES)[:3]


def ends(name, form):
    """The last increments of a scene and of the scene turned, which went through the same ones."""
    out = []
    for scene in (SCENES[name], turned_scene(SCENES[name], Q)):
        own, control = FORMS[form](Case(scene, SCHEDULE, Integration.BACKWARD_EULER))
        out.append(list(march(own, SCHEDULE, control)))
    assert [a.state.tau for a in out[0]] == [a.state.tau for a in out[1]]
    return [marched[-1] for marched in out]


def resisted(accepted):
    """What supports and tools take of each node (a, 3): on a plane of symmetry, where a node sticks, what each of them
    takes along its normal is open."""
    contacts, r = accepted.solved.iterate.increment.system.candidates, accepted.solved.r
    out = accepted.solved.iterate.reactions(r).copy()
    np.add.at(out, contacts.node, contacts.vectors(r, accepted.solved.iterate.frames))
    return out


def energies(accepted):
    return [getattr(accepted.energies, name) for name in ("work", "elastic", "plastic", "friction")]


FLAT = "an eighth under a platen"
CASES = [
    *((name, "newton", 1e-9) for name in SCENES),
    *((name, "tangent", 1e-9) for name in BOTH),
    # An interior-point method ends where its own accuracy does.
    *((name, "dissipation", 1e-8) for name in BOTH),
    *((FLAT, form, 1e-8) for form in ("delassus", "penalty", "uzawa")),
]


@pytest.mark.parametrize(("name", "form", "bound"), CASES)
def test_a_scene_turned_in_space_keeps_its_forces(name, form, bound):
    straight, slanted = ends(name, form)
    assert straight.energies.plastic > 0.1 * straight.energies.work
    assert apart(resisted(slanted) @ Q, resisted(straight)) < bound
    assert apart(straight.state.nodes, slanted.state.nodes @ Q) < bound
    assert apart(energies(slanted), energies(straight)) < bound
    assert apart(slanted.mises, straight.mises) < bound
    for k in range(len(straight.tool_forces)):
        assert apart(slanted.tool_force(k) @ Q, straight.tool_force(k)) < bound


def test_limit_loads_in_space_are_those_of_the_scene_that_is_turned():
    perfect = VonMises(Elasticity(2e5, 0.3), Perfect(300.0))
    held_up, shear = (*PLANES, Support("right", (0.8, 0.36, 0.48))), np.array([20.0, 10.0, -100.0])
    scene = Scene(
        brick(1.0, 1.0, 1.0, 2, 2, 2), Geometry.SOLID, perfect, held_up, loads=(Traction("top", tuple(shear)),)
    )
    slanted = replace(turned_scene(scene, Q), loads=(Traction("top", tuple(Q @ shear)),))
    free = replace(scene, supports=PLANES)
    multiples = [limit_load(one).multiple for one in (scene, slanted, free)]
    assert multiples[1] == pytest.approx(multiples[0], rel=1e-7)
    assert multiples[0] > 1.05 * multiples[2]


def test_a_run_with_slants_in_space_goes_on_from_its_file_to_the_last_bit(tmp_path):
    scene, whole = SCENES["driven aslant along a slant"], []
    with Recorder(tmp_path, scene, (INCREMENT,), {}, {}) as out:
        for accepted in march(scene, SCHEDULE, Control(Newton())):
            whole.append(accepted)
            if accepted.number <= 2:
                out.record(accepted)
    with Recorder(tmp_path, scene, (INCREMENT,), {}, {}, existing=Existing.RESUME) as out:
        again = list(march(scene, SCHEDULE, Control(Newton()), start=out.start))
    assert len(again) == len(whole) - 2
    np.testing.assert_array_equal(again[-1].state.nodes, whole[-1].state.nodes)


def test_what_a_slant_of_space_holds_and_drives_is_along_it_alone():
    """Everything is held of a corner on three slants; of a node of one wall the displacement along its normal."""
    wall, driven = (np.array(support.direction) for support in WALLS)
    scene = SCENES["driven aslant along a slant"]
    *_, last = march(scene, SCHEDULE, Control(Newton()))
    moved, mesh = last.displacement, scene.mesh
    np.testing.assert_allclose(moved[mesh.boundary_nodes("right")] @ wall, 0.0, atol=1e-15)
    np.testing.assert_allclose(moved[mesh.boundary_nodes("top")] @ driven, 0.05, rtol=1e-14)
    alone = np.setdiff1d(mesh.boundary_nodes("right"), mesh.boundary_nodes("top", "base"))
    taken = last.solved.iterate.reactions(last.solved.r)[alone]
    assert np.abs(taken @ wall).min() > 0.1
    np.testing.assert_allclose(taken, np.outer(taken @ wall, wall), atol=1e-9)


def test_a_direction_of_a_plane_is_refused_in_space_and_the_other_way_round():
    with pytest.raises(SceneError, match=r"support\.direction = \(0\.6, 0\.8\): must be of 3 numbers"):
        held((*BASE, Support("right", (0.6, 0.8))))
    with pytest.raises(SceneError, match=r"support\.direction = .*: must be a unit vector"):
        Support("right", (0.6, 0.8, 0.1))


@pytest.mark.parametrize("form", [Newton(), Dissipation()], ids=lambda form: form.name.value)
@pytest.mark.parametrize("mu", [0.6, np.inf])
def test_what_supports_and_a_tool_hold_both_is_the_supports_share_along_any_direction(mu, form):
    """A node that sticks to the platen on a wall pushes this alone: nothing of the tool's force is open."""
    walls = Support("left", 0), Support("front", 1), Support("base", 2)
    scene, out = held(walls, (replace(platen(), mu=mu),)), []
    for one in (scene, turned_scene(scene, Q)):
        *_, last = march(one, SCHEDULE, Control(form, ()))
        assert last.solved.undetermined == ()
        out.append(last)
    straight, slanted = out
    assert apart(slanted.tool_force(0) @ Q, straight.tool_force(0)) < 1e-7
    assert abs(straight.tool_force(0)[0]) > 0.1 * abs(straight.tool_force(0)[2])


APART = ((0.0, 0.0), (0.5, (0.0, 0.0, 1.0)), (1.0, (1.0, 1.0, 1.0)))
ALONG = (0.0, 0.03, -0.1)


def by_components(Q, travel=ALONG):
    """The platen, pressed first and slid then, turned: its way is in multiples of each component's own."""
    path = tuple((tau, tuple((Q @ (np.array(multiple) * travel)).tolist())) for tau, multiple in APART)
    turned_up = tuple((Q @ (0.0, 0.0, 1.0)).tolist())
    down = tuple((-np.array(turned_up)).tolist())
    return FlatTool(turned_up, down, (1.0, 1.0, 1.0), ("top",), 0.3, path=path)


def test_a_tool_that_planes_cut_may_go_by_components_as_long_as_it_stays_along_them():
    out = []
    for turn in (np.eye(3), Q):
        scene = turned_scene(held((Symmetry("left", 0), *BASE)), turn)
        *_, last = march(replace(scene, tools=(by_components(turn),)), Schedule(4), Control(Newton()))
        out.append(last)
    straight, slanted = out
    assert apart(slanted.tool_force(0) @ Q, straight.tool_force(0)) < 1e-9
    assert straight.tool_force(0)[1] > 0.1 * abs(straight.tool_force(0)[2])
    with pytest.raises(SceneError, match=r"tools\[0\]\.travel = .*: must be without a component"):
        replace(scene, tools=(by_components(Q, (1e-6, 0.03, -0.1)),))


@pytest.mark.slow
def test_what_a_curved_tool_and_a_slant_share_is_called_open():
    """Slips along the wall are round-off there: the tool's force is the straight scene's, or it is said to be open."""
    ball = dented(elements=2, mu=0.8, travel=(0.0, 0.0, -0.06))
    scene = replace(ball, supports=(Support("left", 0), Support("front", 1), Support("base", 2)))
    straight, slanted = (
        list(march(one, SCHEDULE, Control(Newton(), ())))[-1] for one in (scene, turned_scene(scene, Q))
    )
    assert apart(resisted(slanted) @ Q, resisted(straight)) < 1e-7
    assert straight.solved.undetermined == ()
    assert slanted.solved.undetermined or apart(slanted.tool_force(0) @ Q, straight.tool_force(0)) < 1e-7
