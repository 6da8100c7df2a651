"""Shaped tools in space against what is known: a plane, a meridian, a path for a force, forms, frames and images."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.fem.reduction import Geometry
from bipot.forms import Newton, Tangent
from bipot.laws.flow import Integration
from bipot.marching import Control, march
from bipot.meshes.sections import block, cylinder
from bipot.meshes.solids import brick, cylinder_3d
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.tools import surfaces
from bipot.tools.circle import Circle
from bipot.tools.poses import Force
from bipot.tools.profiles import flat_punch
from bipot.tools.revolved import Revolved, cone, roll, sphere
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, ShapedTool
from tests.curved import STEEL, TIGHT, apart, forces, marched
from tests.scenes import named
from tests.solids import turned
from tests.space import POINTED, RUBBER, dented, mirrored_scene, rubbed, turned_scene

UP = (0.0, 0.0, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("form", [Newton(), Tangent()], ids=named)
def test_forms_agree_and_the_law_holds_where_the_sphere_goes_askew(form):
    """Slip, friction and cone recomputed from where nodes and sphere are: great circles, unit tangents."""
    scene = rubbed(mu=0.3)
    last = marched(scene, form, increments=8, bounds=TIGHT)[-1]
    contacts, r = last.solved.iterate.increment.system.candidates, last.solved.r
    centres = [np.add(POINTED.point, scene.travel(0.0, s.tau)[0]) for s in (last.start, last.state)]
    before, after = (s.nodes[contacts.node] - c for s, c in zip((last.start, last.state), centres, strict=True))
    gap = np.linalg.norm(after, axis=1) - 0.6
    np.testing.assert_allclose(last.state.gap, gap, atol=1e-13)
    touched = (r[:, 0] > 0) & (last.start.gap < 1e-9)
    assert touched.sum() >= 1
    m, n = (v[touched] / np.linalg.norm(v[touched], axis=1)[:, None] for v in (before, after))
    angle = np.arctan2(np.linalg.norm(np.cross(m, n), axis=1), np.vecdot(m, n))
    way = np.vecdot(m, n)[:, None] * n - m
    slip = 0.6 * angle[:, None] * way / np.linalg.norm(way, axis=1)[:, None]
    vectors = contacts.vectors(r, last.solved.iterate.frames)[touched]
    push = np.vecdot(vectors, n)
    rubbing = -0.3 * push[:, None] * slip / np.linalg.norm(slip, axis=1)[:, None]
    np.testing.assert_allclose(vectors - push[:, None] * n, rubbing, atol=1e-6 * push.max())
    assert apart(forces([last])[-1], forces(marched(scene, increments=8, bounds=TIGHT))[-1]) < 1e-8
    assert last.energies.friction > 0


@pytest.mark.parametrize("angle", [0.4, pytest.param(2.0, marks=pytest.mark.slow)])
def test_frames_turned_by_any_angle_change_nothing(monkeypatch, angle):
    """Of all candidates by another angle each."""
    scene = rubbed(mu=0.3)
    one = marched(scene, increments=6, bounds=TIGHT)

    def other(normal):
        out = surfaces.frames(normal)
        turns = angle * np.arange(1, len(out) + 1)[:, None]
        first, second = out[:, 1].copy(), out[:, 2].copy()
        out[:, 1] = np.cos(turns) * first + np.sin(turns) * second
        out[:, 2] = np.cos(turns) * second - np.sin(turns) * first
        return out

    monkeypatch.setattr("bipot.tools.slips.frames", other)
    two = marched(scene, increments=6, bounds=TIGHT)
    r, turned_r = one[-1].solved.r, two[-1].solved.r
    assert np.abs(r - turned_r).max() > 0.1 * np.abs(r[:, 1:]).max()
    assert apart(forces(two), forces(one)) < 1e-9
    np.testing.assert_allclose(two[-1].state.nodes, one[-1].state.nodes, atol=1e-11)


def welded(travel=(0.05, 0.02, -0.06)):
    """A plastic block on a plane that welds it, under a sphere that comes down askew: nothing is aligned."""
    scene = rubbed(elements=2, material=STEEL, mu=0.3, travel=travel, path=((0.0, 0.0), (1.0, 1.0)))
    base = ShapedTool(Plane((0.0, 0.0, 0.0), UP), (0.0, 0.0, 0.0), ("base",), np.inf)
    return replace(scene, supports=(), tools=(*scene.tools, base))


@pytest.mark.slow
def test_a_scene_turned_or_mirrored_as_a_whole_has_the_same_forces():
    Q = turned((1.0, 2.0, -0.5), 0.8)
    scene = welded()
    one = forces(marched(scene, increments=3, bounds=TIGHT))
    assert apart(forces(marched(turned_scene(scene, Q), increments=3, bounds=TIGHT)) @ Q, one) < 1e-8
    mirrored = forces(marched(mirrored_scene(scene), increments=3, bounds=TIGHT))
    assert apart(mirrored * (-1.0, 1.0, 1.0), one) < 1e-8


@pytest.mark.slow
def test_a_large_sphere_tends_to_the_plane():
    flat = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.05), ("top",), 0.2)
    scene = dented(elements=2)
    plane = forces(marched(replace(scene, tools=(flat,)), increments=4))
    off = []
    for R in (1e4, 1e6):
        ball = dented(sphere((0.0, 0.0, 1.0 + R), R), (0.0, 0.0, -0.05), elements=2)
        off.append(apart(forces(marched(ball, increments=4)), plane))
    assert off[1] < 0.02 * off[0] < 1e-3


def slab(space):
    """A block whose base is held under a circle that presses and goes aside; in space it is one element deep."""
    R, path = 0.6, ((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0)))
    if not space:
        tool = ShapedTool(Circle((0.45, 1.0 + R), R), (0.15, -0.05), ("top",), 0.3, path)
        mesh, held = block(1.0, 1.0, 4, 4), tuple(Support("base", d) for d in (0, 1))
        return Scene(mesh, Geometry.PLANE_STRAIN, STEEL, held, (tool,))
    surface = roll((0.45, -3.0, 1.0 + R), (0.0, 1.0, 0.0), R)
    path = ((0.0, 0.0), (0.5, (0.0, 0.0, 1.0)), (1.0, (1.0, 1.0, 1.0)))
    tool = ShapedTool(surface, (0.15, 0.0, -0.05), ("top",), 0.3, path)
    held = *(Support("base", d) for d in (0, 2)), Support("front", 1), Support("back", 1)
    return Scene(brick(1.0, 0.5, 1.0, 4, 1, 4), Geometry.SOLID, STEEL, held, (tool,))


@pytest.mark.slow
def test_a_cylinder_across_a_slab_of_one_element_is_the_circle_in_plane_strain():
    """Slips, friction and all: of half the thickness, half the force, increment by increment."""
    plane, space = (marched(slab(kind), increments=9, bounds=TIGHT) for kind in (False, True))
    assert len(plane) == len(space)
    assert apart(2 * forces(space)[:, [0, 2]], forces(plane)) < 1e-8
    assert np.abs(forces(space)[:, 1]).max() < 1e-8 * np.abs(forces(space)).max()
    for one, other in zip(plane, space, strict=True):
        assert 2 * other.energies.friction == pytest.approx(one.energies.friction, rel=1e-7, abs=1e-12)
    assert plane[-1].energies.friction > 0
    slid = np.abs(plane[-1].solved.iterate.motion[plane[-1].solved.r[:, 0] > 0, 1])
    assert slid.max() > 0.005


@pytest.mark.slow
def test_a_force_presses_a_sphere_as_far_as_a_path_does():
    path = marched(dented(material=RUBBER, travel=(0.0, 0.0, -0.05)), increments=5, bounds=TIGHT)[-1]
    force = Force(tuple(path.tool_force(0).tolist()))
    scene = dented(material=RUBBER, travel=(0.0, 0.0, 0.0), driven_by=Force((0.0, 0.0, -force.size)))
    last = marched(scene, increments=5, bounds=TIGHT)[-1]
    # The slips on the way are others, increment by increment.
    assert last.state.translation[0] == pytest.approx(0.05, rel=2e-3)
    assert last.tool_force(0)[2] == pytest.approx(path.tool_force(0)[2], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    "surface",
    [
        roll((0.5, 0.0, 1.4), (0.6, 0.8, 0.0), 0.4),
        cone((0.45, 0.55, 0.95), UP, 60.0, 5.0, 0.3),
        pytest.param(Revolved(Circle((1.0, 0.4), 0.4), (0.5, 0.5, 1.0), UP), marks=pytest.mark.slow),
        pytest.param(Revolved(flat_punch((0.0, 0.0), 0.8, 2.0, 0.2), (0.5, 0.5, 1.0), UP), marks=pytest.mark.slow),
    ],
    ids=["roll", "cone", "torus", "punch"],
)
def test_forms_agree_under_surfaces_of_all_sorts(surface):
    scene = rubbed(surface, elements=2 if isinstance(surface.meridian, Plane) else 3, material=STEEL)
    control = [Control(form, integration=Integration.BACKWARD_EULER) for form in (Newton(), Tangent())]
    one, other = (list(march(scene, Schedule(6, first=0.01, settling=1, growth=4.0), c)) for c in control)
    assert apart(forces(other)[-1], forces(one)[-1]) < 1e-5
    for accepted in one:
        assert max(accepted.solved.certificate.ratios(Bounds()).values()) <= 1


@pytest.mark.slow
def test_a_sphere_dents_a_block_in_space_as_it_dents_a_ring_on_a_meridian():
    """Coarse, and of other elements: forces differ by the meshes, by a few percent."""

    ball = dented(material=RUBBER, travel=(0.0, 0.0, -0.1), mu=0.0)
    quarter = replace(ball, mesh=cylinder_3d(1.0, 1.0, 3, 3, 4))
    solid = marched(quarter, increments=4)[-1].tool_force(0)[2]
    punch = ShapedTool(Circle((0.0, 3.0), 2.0), (0.0, -0.1), ("top",), 0.0)
    held = Support("base", 1), Support("axis", 0)
    ring = Scene(cylinder(1.0, 1.0, 6, 4), Geometry.AXISYMMETRIC, RUBBER, held, (punch,))
    assert solid == pytest.approx(marched(ring, increments=4)[-1].tool_force(0)[1], rel=0.03)
