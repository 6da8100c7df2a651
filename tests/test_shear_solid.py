"""Friction capped by the shear yield stress in space: beside plane strain, revolution and torsion, by every form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bipot import Control, Elasticity, Perfect, Scene, Schedule, VonMises, march
from bipot.certificate import Bounds
from bipot.contact.sampling import nodal_areas
from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Geometry
from bipot.forms import Delassus, Dissipation, Newton, Tangent
from bipot.increment import Limits
from bipot.laws.coulomb import Status
from bipot.marching import system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block, cylinder
from bipot.meshes.solids import brick, cylinder_3d
from bipot.paths import Amplitude
from bipot.scene.supports import Support, Symmetry
from bipot.tools.circle import Circle
from bipot.tools.poses import Turn
from bipot.tools.revolved import roll
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, Sampling, ShapedTool
from tests.sheared import CONSTANT, INF, OROWAN, SHEAR, SHORT, SIGMA_Y, slab
from tests.space import dented, turned_scene

STEEL = VonMises(Elasticity(210_000.0, 0.3), Perfect(SIGMA_Y))
BRIEF = Schedule(4, first=0.01, settling=1, growth=4.0)
DOWN = (0.0, 0.0, -1.0)


def pressed_brick(mu, shear, *, deep=5.0, counts=(3, 2, 2), element=Element.H8, reduction=0.1, plane=False, **tool):
    """An eighth of a brick 16 x 2 deep x 8 pressed flat, or a slice of it whose depth is held: plane strain."""
    held = (Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2))
    sides = ("top", "right") if plane else ("top", "right", "back")
    return Scene(
        mesh=brick(8.0, deep, 4.0, *counts, element=element),
        geometry=Geometry.SOLID,
        material=STEEL,
        supports=(*held, Support("back", 1)) if plane else held,
        tools=(FlatTool((0.0, 0.0, 4.0), DOWN, (0.0, 0.0, -4.0 * reduction), sides, mu, shear=shear, **tool),),
    )


def pushed(scene, form=None, schedule=BRIEF):
    """Forces (n, 3) of the tool, all increments by one form."""
    control = Control() if form is None else Control(form, fallbacks=())
    return np.array([a.tool_forces[0] for a in march(scene, schedule, control)])


@pytest.mark.parametrize("law", [CONSTANT, OROWAN], ids=["constant", "capped"])
def test_a_slice_whose_depth_is_held_is_a_slab_in_plane_strain(law):
    flat = np.array([a.tool_forces[0, 1] for a in march(slab(*law, elements=(4, 3), reduction=0.1), BRIEF)])
    solid = pushed(pressed_brick(*law, deep=1.0, counts=(4, 1, 3), plane=True))
    np.testing.assert_allclose(solid[:, 2], flat, rtol=1e-6)


def under_a_roll(space, deep=1.0):
    """A block under a roll that presses it and goes aside, of so much depth that is held, or in plane strain."""
    path, at = ((0, 0), (0.5, (0, 1)), (1, (1, 1))), (2.0, 6.0)
    held = Support("base", 0), Support("base", 1)
    if not space:
        tool = ShapedTool(Circle(at, 4.0), (0.1, -0.06), ("top",), INF, path, shear=0.3)
        return Scene(block(4.0, 2.0, 4, 2, element=Element.Q4), Geometry.PLANE_STRAIN, STEEL, held, (tool,))
    path = ((0, 0), (0.5, (0, 0, 1)), (1, (1, 1, 1)))
    tool = ShapedTool(roll((2.0, 0.0, 6.0), (0.0, 1.0, 0.0), 4.0), (0.1, 0.0, -0.06), ("top",), INF, path, shear=0.3)
    held = Support("base", 0), Support("base", 2), Support("front", 1), Support("back", 1)
    return Scene(brick(4.0, deep, 2.0, 4, 1, 2), Geometry.SOLID, STEEL, held, (tool,))


@pytest.mark.slow
@pytest.mark.parametrize("deep", [0.02, 7.9])
def test_the_depth_of_a_slice_under_a_roll_does_not_matter(deep):
    """Nor does that of its faces, which leave the roll along the other side."""
    one, other = (list(march(under_a_roll(*which), Schedule(4)))[-1] for which in ((False,), (True, deep)))
    np.testing.assert_allclose(other.tool_forces[0, [0, 2]] / deep, one.tool_forces[0], rtol=1e-5)
    assert other.energies.friction / deep == pytest.approx(one.energies.friction, rel=1e-5)
    assert one.energies.friction > 0


def test_upright_sides_beside_a_platen_carry_no_friction():
    """Of layers that are flatter than their faces are wide."""
    forces = []
    for faces in (("top",), ("top", "right", "back")):
        tool = FlatTool(
            (0, 0, 2.0), DOWN, (0.02, 0, -0.002), faces, INF, ((0, 0), (0.5, (0, 0, 1)), (1, (1, 1, 1))), shear=0.05
        )
        held = tuple(Support("base", d) for d in range(3))
        forces.append(pushed(Scene(brick(4.0, 4.0, 2.0, 2, 2, 8), Geometry.SOLID, STEEL, held, (tool,)), None, BRIEF))
    np.testing.assert_allclose(forces[1][-1, 0], forces[0][-1, 0], rtol=1e-6)


@pytest.mark.parametrize("law", [CONSTANT, OROWAN], ids=["constant", "capped"])
@pytest.mark.parametrize(
    ("element", "sampling"),
    [(Element.H8, Sampling.NODES), (Element.T10, Sampling.NODES), (Element.H20, Sampling.WEIGHTED)],
    ids=["h8", "t10", "h20 weighted"],
)
def test_newton_tangent_and_dissipation_agree(law, element, sampling):
    counts, schedule = ((3, 2, 2), BRIEF) if element is Element.H8 else ((2, 1, 1), SHORT)
    scene = pressed_brick(*law, counts=counts, element=element, sampling=sampling, reduction=0.05)
    by_newton = pushed(scene, Newton(), schedule)
    for form in (Tangent(), Dissipation()):
        np.testing.assert_allclose(pushed(scene, form, schedule), by_newton, rtol=1e-5, atol=1e-3)


def test_corners_of_quadratic_faces_have_no_area_at_nodes():
    """The integrals of their shape functions are -1/12 of a face's area, those of middle nodes 1/3."""
    mesh = brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.H20)
    (face,), (share,) = mesh.edges("top"), nodal_areas(mesh.nodes, mesh.edges("top"), Geometry.SOLID)
    middle = np.isclose(mesh.nodes[face, :2], 0.5).any(axis=1)
    np.testing.assert_allclose(share, np.where(middle, 0.25, 0.0), atol=1e-14)


def polygon(x):
    """Area of the star-shaped polygon of corners (n, 2) in any order."""
    arm = x - x.mean(axis=0)
    x, y = arm[np.argsort(np.arctan2(arm[:, 1], arm[:, 0]))].T
    return 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def last_of(scene, schedule=BRIEF, **bounds):
    *_, last = march(scene, schedule, Control(limits=Limits(Bounds(**bounds))))
    return last


@pytest.mark.parametrize(
    ("element", "sampling"), [(Element.H8, Sampling.NODES), (Element.H20, Sampling.WEIGHTED)], ids=["h8", "h20"]
)
def test_constant_shear_is_against_the_slip_and_its_sum_that_of_the_area(element, sampling):
    m = 0.2
    scene = pressed_brick(INF, m, counts=(2, 2, 1), element=element, sampling=sampling)
    last = last_of(scene, cone_violation=1e-10)
    points, rows, r, motion = (system_of(scene).candidates, last.solved.rows, last.solved.r, last.solved.iterate.motion)
    slides = last.traction.status == Status.SLIP
    assert slides.sum() > 5
    sizes, slips = np.linalg.norm(r[slides, 1:], axis=1), np.linalg.norm(motion[slides, 1:], axis=1)
    np.testing.assert_allclose(sizes, rows.cap[slides], rtol=1e-7)
    np.testing.assert_allclose(r[slides, 1:] / sizes[:, None], -motion[slides, 1:] / slips[:, None], atol=1e-5)
    upper = np.isin(points.node, scene.mesh.boundary_nodes("top"))
    area = sum(polygon(last.state.nodes[face, :2]) for face in scene.mesh.edges("top"))
    assert rows.cap[upper].sum() == pytest.approx(m * SHEAR * area, rel=0.01)


def test_a_turned_scene_is_the_same():
    Q = Rotation.from_rotvec([0.3, -0.7, 0.5]).as_matrix()
    scene = pressed_brick(*OROWAN)
    np.testing.assert_allclose(pushed(turned_scene(scene, Q)) @ Q, pushed(scene), rtol=1e-7, atol=1e-3)


def quarter_of_a_cylinder(n):
    """A quarter of a cylinder of radius 5 and half of its height 10, in space, its volume that of the round one."""
    return Scene(
        mesh=cylinder_3d(5.0, 5.0, n, n, 2 * n, inscribed=False),
        geometry=Geometry.SOLID,
        material=STEEL,
        supports=(Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)),
        tools=(FlatTool((0.0, 0.0, 5.0), DOWN, (0.0, 0.0, -1.0), ("top", "side"), INF, shear=0.4),),
    )


def ring(n):
    """The same of revolution."""
    return Scene(
        mesh=cylinder(5.0, 5.0, 2 * n, 2 * n, element=Element.Q4),
        geometry=Geometry.AXISYMMETRIC,
        material=STEEL,
        supports=(Support("axis", 0), Symmetry("base", 1)),
        tools=(FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, -1.0), ("top", "side"), INF, shear=0.4),),
        volume=VolumeChange.P0,
    )


@pytest.mark.slow
def test_a_cylinder_in_space_is_the_one_of_revolution():
    """With constant shear, pressed by a fifth, on six segments a quarter."""
    flat = [a.tool_forces[0, 1] for a in march(ring(3), BRIEF)]
    np.testing.assert_allclose(4 * pushed(quarter_of_a_cylinder(3))[:, 2], flat, rtol=2e-3)


def test_the_torque_of_constant_shear_on_a_twisted_disc():
    """M = 2 pi m k R^3 / 3 once all of it slides; the disc stays elastic."""
    m, strong = 0.02, VonMises(Elasticity(1000.0, 0.0), Perfect(100.0))
    at, path = (0.0, 0.0, 0.5), ((0.0, 0.0), (0.1, 1.0), (1.0, 1.0))
    spun = Turn(0.02, at, Amplitude(((0.0, 0.0), (0.1, 0.0), (1.0, 1.0))), axis=(0.0, 0.0, 1.0))
    lid = ShapedTool(Plane(at, DOWN), (0.0, 0.0, -0.005), ("top",), INF, path, shear=m, turn=spun)
    mesh = cylinder_3d(1.0, 0.5, 3, 3, 2, quarter=False, inscribed=False)
    held = tuple(Support("base", d) for d in range(3))
    last = last_of(Scene(mesh, Geometry.SOLID, strong, held, (lid,)), Schedule(10))
    assert not last.state.peeq.any()
    # The punch turns the disc along: its friction's moment is against the motion of its own points.
    assert abs(last.tool_moment(0)) == pytest.approx(2 * np.pi * m * (100 / np.sqrt(3)) / 3, rel=0.02)


@pytest.mark.slow
def test_a_sphere_with_constant_shear_by_two_forms():
    """Where a tool is curved some faces lie on it in part."""
    scene = dented(mu=INF, shear=0.3)
    found = [np.array([a.tool_forces[0] for a in march(scene, Schedule(4), Control(f))]) for f in (Newton(), Tangent())]
    np.testing.assert_allclose(found[1], found[0], rtol=1e-5, atol=1e-5 * np.abs(found[0]).max())


def test_delassus_refuses_it_and_the_others_go_on():
    first = next(march(pressed_brick(*OROWAN), BRIEF, Control(Delassus(), fallbacks=(Newton(),))))
    assert first.form is Newton.name
    assert any("tool.shear" in str(reason) for reason in first.reasons)
