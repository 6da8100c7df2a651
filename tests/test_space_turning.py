"""Tools that turn in space: what they see, torsion of a pressed disc, rolls, refusals, files of such runs."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader

from bipot.contact import overlap as overlaps
from bipot.contact.sampling import hat_areas, points
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Newton, Tangent
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.meshes.solids import brick, cylinder_3d
from bipot.paths import Amplitude
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.schedule import Schedule
from bipot.tools.circle import Circle
from bipot.tools.poses import Moment, Turn, rotation
from bipot.tools.revolved import Revolved, roll, sphere
from bipot.tools.surfaces import Plane
from bipot.tools.tool import FlatTool, Sampling, ShapedTool
from tests.curved import TIGHT, apart, forces, marched
from tests.scenes import named, refused
from tests.space import RUBBER, dented, rubbed

UP = (0.0, 0.0, 1.0)
AXIS = (0.6, 0.0, 0.8)
HEIGHT, SINK, MU, E = 0.5, 0.005, 0.2, 1000.0
LATER = ((0.0, 0.0), (0.1, 0.0), (1.0, 1.0))


def turned(angle):
    """The rotation about AXIS by scipy."""
    return Rotation.from_rotvec(angle * np.array(AXIS)).as_matrix()


@pytest.mark.parametrize(
    ("element", "count", "off"),
    [
        (Element.H20, 2, -0.256),
        (Element.H20, 4, -0.056),
        (Element.H20, 8, -0.013),
        (Element.H8, 2, 0.115),
        (Element.H8, 4, 0.0385),
    ],
)
def test_a_lid_that_turns_on_a_pressed_face_loses_moment_in_means(element, count, off):
    """Under a uniform pressure p all slides: mu p int r dA = 4/3 (sqrt 2 + asinh 1) mu p on a face of [-1, 1]^2."""
    mesh = brick(2.0, 2.0, 1.0, count, count, 1, element=element)
    tool = FlatTool((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.0, 0.0), ("top",), 0.1, sampling=Sampling.WEIGHTED)
    own = points(mesh, Geometry.SOLID, tool)
    arm = (own.weights @ mesh.nodes - [1.0, 1.0, 1.0])[:, :2]
    share = hat_areas(mesh.nodes, own.facets, Geometry.SOLID) if own.weighted else np.full(own.point.shape, count**-2.0)
    force = np.bincount(own.point.ravel(), weights=share.ravel())
    found = force @ np.hypot(*arm.T) / (4 / 3 * (np.sqrt(2) + np.arcsinh(1)))
    assert found - 1 == pytest.approx(off, abs=1e-3)


@pytest.mark.parametrize("by", [(0.1, -0.3, 0.2), (0.0, 0.0, 0.0)])
def test_what_the_tool_sees_is_the_difference_of_places(by):
    rng = np.random.default_rng(4)
    turn = Turn(0.9, (0.4, -0.3, 0.2), axis=AXIS)
    pose = np.concatenate([rng.uniform(-1, 1, 3), 0.7 * turn.about])
    advance = np.concatenate([rng.uniform(-1, 1, 3), 0.4 * turn.about])
    X, centre = rng.uniform(-1, 1, (20, 3)), np.array(turn.centre)
    at = [centre + p[:3] + (X - centre) @ turned(a).T for p, a in ((pose, 0.7), (pose + advance, 1.1))]
    np.testing.assert_allclose(turn.own(at[0], pose), X, atol=1e-14)
    moved = at[1] - at[0] + by
    seen = turn.own(at[0] + moved, pose + advance) - turn.own(at[0], pose)
    np.testing.assert_allclose(turn.going(at[0], moved, pose, advance), seen, atol=1e-14)
    np.testing.assert_allclose(rotation(pose[3:]), turned(0.7), atol=1e-15)
    # A point of the tool goes along the chord, beside what the centre goes.
    chord = at[1] - at[0] - advance[:3]
    np.testing.assert_allclose(turn.swept(at[0], pose, advance), chord, atol=1e-14)
    np.testing.assert_allclose(turn.carried((at[0] + at[1]) / 2, pose, advance), chord, atol=1e-14)


def twisted(n: int = 2, angle: float = 0.02, turn: bool = True) -> Scene:
    """An elastic disc of nu = 0 held at its base, under a plane that presses it and then turns about its normal."""
    at = (0.0, 0.0, HEIGHT)
    spun = Turn(angle, at, Amplitude(LATER), axis=UP) if turn else None
    path = ((0.0, 0.0), (0.1, 1.0), (1.0, 1.0))
    lid = ShapedTool(Plane(at, (0.0, 0.0, -1.0)), (0.0, 0.0, -SINK), ("top",), MU, path, turn=spun)
    mesh = cylinder_3d(1.0, HEIGHT, n, n, 2, quarter=False)
    held = tuple(Support("base", d) for d in range(3))
    return Scene(mesh, Geometry.SOLID, Elastic(Elasticity(E, 0.0)), held, (lid,))


@cache
def torsion(form):
    return list(march(twisted(), Schedule(5), Control(form)))


def moments(accepted):
    """Moment over (2/3) mu N R of each increment, N the normal force."""
    return np.array([1.5 * a.tool_moment(0) / (MU * -a.tool_forces[0, 2]) for a in accepted])


def test_a_disc_that_is_twisted_under_pressure_slips_all_over_at_two_thirds_of_mu_n_r():
    """Every slip is around the axis, and friction against it; a coarse mesh has less than a percent too much."""
    end = torsion(Newton())[-1]
    assert moments([end])[0] == pytest.approx(1.0, abs=0.02)
    contacts, r = end.solved.iterate.increment.system.candidates, end.solved.r
    x = end.state.nodes[contacts.node]
    vectors = contacts.vectors(r, end.solved.iterate.frames)
    far = np.linalg.norm(x[:, :2], axis=1)
    off = far > 1e-9
    around = np.cross(UP, x)[off] / far[off, None]
    np.testing.assert_allclose(np.vecdot(vectors[off], around), MU * -vectors[off, 2], rtol=0.01)
    assert end.energies.friction > 0
    assert abs(end.energies.energy_error) < 5e-3
    np.testing.assert_allclose(end.tool_forces[0, :2], 0.0, atol=1e-7 * abs(end.tool_forces[0, 2]))


@pytest.mark.parametrize("form", [Tangent(), pytest.param(Dissipation(), marks=pytest.mark.slow)], ids=named)
def test_forms_agree_in_torsion(form):
    assert apart(moments(torsion(form)), moments(torsion(Newton()))) < 1e-6


@pytest.mark.slow
def test_on_finer_meshes_the_moment_tends_to_that_of_a_disc_as_its_stick_radius_goes_to_zero():
    """M = (2/3) mu N R (1 - (a/R)^3 / 4), a = mu p h / (G theta): of a body that is long, here nearly so."""
    ends = [list(march(twisted(n), Schedule(10), Control(Newton())))[-1] for n in (2, 4, 6)]
    off = np.abs(moments(ends) - 1)
    assert (off[1:] < 0.5 * off[:-1]).all()
    assert off[-1] < 2e-3


@pytest.mark.slow
def test_a_roll_that_turns_across_a_slab_is_the_circle_that_turns_in_plane_strain():
    R, path = 0.6, ((0.0, 0.0), (0.5, 1.0), (1.0, 1.0))
    later = Amplitude(((0.0, 0.0), (0.5, 0.0), (1.0, 1.0)))
    circle = ShapedTool(
        Circle((0.45, 1.0 + R), R), (0.0, -0.05), ("top",), 0.3, path, turn=Turn(0.3, (0.45, 1.0 + R), later)
    )
    plane = Scene(
        block(1.0, 1.0, 3, 3), Geometry.PLANE_STRAIN, RUBBER, tuple(Support("base", d) for d in (0, 1)), (circle,)
    )
    centre = (0.45, 0.0, 1.0 + R)
    # The third axis of a plane, from x to y, is minus the second of space, from x to z.
    across = Turn(0.3, centre, later, axis=(0.0, -1.0, 0.0))
    cylinder = ShapedTool(roll(centre, (0.0, 1.0, 0.0), R), (0.0, 0.0, -0.05), ("top",), 0.3, path, turn=across)
    held = *(Support("base", d) for d in (0, 2)), Support("front", 1), Support("back", 1)
    space = Scene(brick(1.0, 0.5, 1.0, 3, 1, 3), Geometry.SOLID, RUBBER, held, (cylinder,))
    one, other = (marched(scene, increments=6, bounds=TIGHT) for scene in (plane, space))
    assert apart(2 * forces(other)[:, [0, 2]], forces(one)) < 1e-8
    assert 2 * other[-1].tool_moment(0) == pytest.approx(one[-1].tool_moment(0), rel=1e-8)
    assert abs(one[-1].tool_moment(0)) > 1.0
    assert 2 * other[-1].energies.friction == pytest.approx(one[-1].energies.friction, rel=1e-7)


def test_a_sphere_that_turns_with_the_body_at_rest_drags_it_along_and_one_that_does_not_turn_has_no_moment():
    ball = sphere((0.45, 0.55, 1.6), 0.6)
    spun = rubbed(ball, travel=(0.0, 0.0, -0.05), turn=Turn(0.5, (0.45, 0.55, 1.6), axis=(0.0, 1.0, 0.0)))
    last = marched(spun, increments=6)[-1]
    # The lowest point of what turns about y goes back along x.
    force = last.tool_forces[0]
    assert force[0] < -0.1 * abs(force[2])
    most = 0.6 * 0.2 * last.solved.r[:, 0].sum()
    assert 0.9 * most < last.tool_moment(0) < most * (1 + 1e-9)
    assert marched(rubbed(ball), increments=2)[-1].tool_moment(0) == 0.0


def test_what_no_turn_may_do_in_space_is_refused_by_name():
    refused(lambda: Turn(0.1, (0.0, 0.0, 0.0)), "turn.axis")
    refused(lambda: Turn(0.1, (0.0, 0.0, 0.0), axis=(0.0, 1.0)), "turn.axis")
    refused(lambda: Turn(0.1, (0.0, 0.0, 0.0), axis=(0.0, 1.0, 1.0)), "turn.axis")
    refused(lambda: Turn(0.1, (0.0, 0.0), axis=UP), "turn.axis")
    refused(lambda: Turn(0.1, (0.0, 0.0, 0.0), driven_by=Moment(1.0), axis=UP), "turn.angle = 0.1: must be zero")
    wrong: Any = Turn(0.1, (0.0, 0.0))
    refused(lambda: rubbed(turn=wrong), r"tools\[0\].turn")
    refused(lambda: dented(turn=Turn(0.1, (0.0, 0.0, 3.0), axis=UP)), r"tools\[0\].turn")


def test_a_tool_that_turns_too_far_in_an_increment_is_cut():
    scene = twisted(angle=1.2)
    scene = replace(scene, tools=(replace(scene.tools[0], mu=0.0),))
    assert len(list(march(scene, Schedule(2), Control(Newton())))) > 2


def test_a_run_under_turning_tools_and_spheres_is_read_back_and_goes_on_to_the_last_bit(tmp_path):
    torus = Revolved(Circle((0.3, 0.2), 0.2), (0.5, 0.5, 1.0), UP)
    turn = Turn(0.2, (0.5, 0.5, 1.2), axis=AXIS)
    scene = rubbed(torus, travel=(0.0, 0.0, -0.05), path=((0.0, 0.0), (1.0, 1.0)), turn=turn)
    with Recorder(tmp_path, scene, (), {}, {}) as out:
        whole = list(march(scene, Schedule(3, first=0.05, settling=1, growth=4.0), Control(Newton())))
        for increment in whole:
            out.record(increment)
    history = open_results(tmp_path)
    lines = history.at().tools
    assert len(lines) > 12
    centre = np.array(turn.centre)
    points = np.concatenate([line.points for line in lines]) + np.array([0.0, 0.0, 0.05])
    rest = centre + (points - centre) @ turned(0.2)
    np.testing.assert_allclose(torus.distance(rest).gap, 0.0, atol=1e-12)
    reader = vtkHDFReader()
    reader.SetFileName(str(tmp_path / "tools.vtkhdf"))
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetNumberOfCells() == len(lines)
    assert vtk_to_numpy(grid.GetPoints().GetData()).shape == points.shape
    after = next(
        march(scene, Schedule(3, first=0.05, settling=1, growth=4.0), Control(Newton()), history.course(len(whole) - 2))
    )
    np.testing.assert_array_equal(after.state.nodes, whole[-1].state.nodes)
    np.testing.assert_array_equal(after.state.forces, whole[-1].state.forces)


def test_overlap_is_looked_for_between_the_edges_of_faces_too():
    """A small sphere on the middle of a face, whose nodes and edges are off it."""
    scene = dented(sphere((0.25, 0.25, 1.3), 0.3), elements=2)
    nodes = scene.mesh.nodes
    placed = np.array([[0.0, 0.0, -0.05, 0.0, 0.0, 0.0]])
    assert overlaps.overlap(scene, nodes, placed) * scene.mesh.size == pytest.approx(0.05, rel=1e-9)
