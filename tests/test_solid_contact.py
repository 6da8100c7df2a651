"""Flat tools in space: every form on discs of two tangents, turned frames, planes of symmetry, refusals."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from vtkmodules.vtkIOHDF import vtkHDFReader

from bipot import (
    Circle,
    Control,
    Dissipation,
    Elastic,
    Elasticity,
    Element,
    FlatTool,
    Force,
    Geometry,
    Linear,
    Mesh,
    Newton,
    Scene,
    SceneError,
    Schedule,
    ShapedTool,
    Support,
    Symmetry,
    Tangent,
    VonMises,
    brick,
    march,
    plot,
)
from bipot.checks.free import free
from bipot.forms import Delassus, Penalty, Uzawa
from bipot.iterate import Increment
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.system import system_of
from bipot.tools import meeting, slips
from bipot.tools.surfaces import frames
from tests.solids import turned

STEEL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 500.0))
PLANES = (Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2))
SIDES = ("top", "right", "back")


def upset(mu=0.2, n=2, element=Element.H8):
    """An eighth of a cube under a punch."""
    punch = FlatTool((0.0, 0.0, 5.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.1), SIDES, mu)
    return Scene(brick(5.0, 5.0, 5.0, n, n, n, element=element), Geometry.SOLID, STEEL, PLANES, (punch,))


@cache
def solved(form):
    return list(march(upset(), Schedule(4, first=0.05, settling=1, growth=4.0), Control(form, ())))[-1]


@pytest.mark.parametrize(
    "form", [Tangent(), Dissipation(), Delassus(), Uzawa(1e8, 1e8)], ids=lambda form: type(form).__name__
)
def test_every_exact_form_finds_the_same_forces_and_the_certificate_holds(form):
    newton, other = solved(Newton()), solved(form)
    np.testing.assert_allclose(other.tool_forces, newton.tool_forces, rtol=1e-6, atol=1e-6)
    certificate = other.solved.certificate
    assert max(certificate.law, certificate.cone_violation, certificate.relative_gap) < 1e-6
    r, slip = newton.solved.r, newton.solved.iterate.motion[:, 1:]
    sliding = (np.linalg.norm(slip, axis=1) > 1e-5) & (r[:, 0] > 1.0)
    assert sliding.sum() >= 3
    along = slip[sliding] / np.linalg.norm(slip[sliding], axis=1)[:, None]
    np.testing.assert_allclose(r[sliding, 1:], -0.2 * r[sliding, :1] * along, rtol=1e-5, atol=1e-3)
    assert newton.energies.friction > 0
    assert abs(newton.energies.energy_error) < 1e-2


def test_the_penalised_form_comes_near():
    soft = solved(Penalty(1e6, 1e6))
    np.testing.assert_allclose(soft.tool_forces[0, 2], solved(Newton()).tool_forces[0, 2], rtol=5e-3)


def test_nodes_of_planes_of_symmetry_carry_no_friction_across_them():
    """The diagonal is a plane of symmetry too, though none that the scene knows of."""
    end = solved(Newton())
    contacts = end.solved.iterate.increment.system.candidates
    vectors, x = (
        contacts.vectors(end.solved.r),
        end.solved.iterate.increment.system.body.scene.mesh.nodes[contacts.node],
    )
    for d in (0, 1):
        np.testing.assert_allclose(vectors[x[:, d] == 0.0, d], 0.0, atol=1e-12)
    assert not end.solved.undetermined
    assert end.tool_forces[0, 0] == pytest.approx(end.tool_forces[0, 1], rel=1e-8)


def dragged(Q):
    """A block welded below and rubbed above by a punch that presses and goes askew, all of it turned by Q."""
    mesh = brick(2.0, 2.0, 2.0, 2, 2, 2)
    mesh = Mesh((mesh.nodes - 1.0) @ Q.T, mesh.elements, mesh.boundaries)

    def tool(z, normal, travel, boundary, mu):
        vectors = [tuple((Q @ np.array(v)).tolist()) for v in ((0.0, 0.0, z), (0.0, 0.0, normal), travel)]
        unit = tuple((np.array(vectors[1]) / np.linalg.norm(vectors[1])).tolist())
        return FlatTool(vectors[0], unit, vectors[2], (boundary,), mu)

    tools = tool(-1.0, 1.0, (0.0, 0.0, 0.0), "base", np.inf), tool(1.0, -1.0, (0.02, 0.01, -0.01), "top", 0.3)
    return Scene(mesh, Geometry.SOLID, STEEL, (), tools)


def test_turned_in_space_with_all_tools_a_scene_has_the_same_forces_turned():
    """Frames are others, and aligned with nothing."""
    Q = turned((1.0, 2.0, -0.5), 0.8)
    schedule, control = Schedule(3, first=0.1, settling=1, growth=4.0), Control(Newton(), ())
    ends = [list(march(dragged(turn), schedule, control))[-1] for turn in (np.eye(3), Q)]
    scale = np.abs(ends[0].tool_forces).max()
    np.testing.assert_allclose(ends[1].tool_forces, ends[0].tool_forces @ Q.T, atol=1e-7 * scale)
    slip = ends[0].solved.iterate.motion[:, 1:]
    assert (np.abs(slip) > 1e-5).all(axis=1).any()


@pytest.mark.parametrize("form", [Newton(), Tangent(), Dissipation()], ids=lambda form: type(form).__name__)
def test_frames_turned_about_the_normal_change_nothing(form, monkeypatch):
    """By another angle at every call's every candidate of a punch that drags the block askew."""
    schedule, control, ends = Schedule(3, first=0.1, settling=1, growth=4.0), Control(form, ()), []
    for spread in (0.0, 1.7):
        for module in (meeting, slips):
            monkeypatch.setattr(module, "frames", lambda normal, spread=spread: spun(normal, spread))
        ends.append(list(march(dragged(np.eye(3)), schedule, control))[-1])
    one, other = ends
    assert not np.allclose(one.solved.r, other.solved.r, rtol=1e-2)
    exact = form == Newton()
    scale = np.abs(one.tool_forces).max()
    np.testing.assert_allclose(other.tool_forces, one.tool_forces, rtol=0, atol=(1e-9 if exact else 1e-7) * scale)
    np.testing.assert_allclose(other.state.nodes, one.state.nodes, rtol=0, atol=1e-9 if exact else 1e-7)


def spun(normal, spread):
    """The library's frames, the tangents turned about the normal by an angle of their own each."""
    found = frames(normal)
    angle = spread * np.arange(1, 1 + normal[..., 0].size).reshape(normal.shape[:-1])
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    first, second = found[..., 1, :], found[..., 2, :]
    return np.stack([found[..., 0, :], c * first + s * second, c * second - s * first], axis=-2)


def test_frames_of_space_are_orthonormal_and_right_handed():
    rng = np.random.default_rng(0)
    normal = np.vstack([rng.normal(size=(50, 3)), np.eye(3), -np.eye(3)])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    found = frames(normal)
    np.testing.assert_allclose(found @ found.swapaxes(1, 2), np.broadcast_to(np.eye(3), found.shape), atol=1e-15)
    np.testing.assert_allclose(np.linalg.det(found), 1.0, rtol=1e-14)
    np.testing.assert_array_equal(found[:, 0], normal)


@pytest.mark.parametrize(("mu", "moves"), [(0.0, True), (0.3, False)])
def test_what_no_support_holds_a_closed_contact_with_friction_holds_along_both_tangents(mu, moves):
    held = upset(mu)
    floor = FlatTool((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), ("base",), mu)
    roof = replace(held.tools[0], candidates=("top",))
    scene = replace(held, supports=(), tools=(floor, roof))
    system = system_of(scene)
    v = free(Increment(system, system.rest(), 0.0), np.zeros_like(scene.mesh.nodes))
    assert (v is not None) == moves
    if v is None:
        return
    motion = system.body.space.spread(v)
    assert np.abs(motion[:, :2]).max() == pytest.approx(1.0, rel=0.5)
    np.testing.assert_allclose(motion[:, 2], 0.0, atol=1e-12)


def test_a_force_presses_an_elastic_block_without_friction_to_a_uniform_pressure():
    """A column of nu = 0.3 between a smooth plane and a punch that a force drives: approach F h/(E A), pressure F/A."""
    force = Force((0.0, 0.0, -60.0))
    punch = FlatTool((0.0, 0.0, 4.0), (0.0, 0.0, -1.0), (0.0, 0.0, 0.0), ("top",), 0.0, driven_by=force)
    mesh = brick(2.0, 3.0, 4.0, 2, 2, 2)
    scene = Scene(
        mesh,
        Geometry.SOLID,
        Elastic(Elasticity(1e5, 0.3)),
        (Symmetry("base", 2), Support("left", 0), Support("front", 1)),
        (punch,),
    )
    (end,) = march(scene, Schedule(1), Control(Newton()))
    np.testing.assert_allclose(end.state.stress[..., 2], -10.0, rtol=1e-3)
    assert end.state.translation[0] == pytest.approx(60.0 * 4.0 / (1e5 * 6.0), rel=1e-3)
    pressure = end.traction.recovered_pressure
    np.testing.assert_allclose(pressure, 10.0, rtol=1e-3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"travel": (0.0, -0.1)}, r"tool.travel = \(0.0, -0.1\): must be of 3 numbers"),
        ({"point": (0.0, 5.0)}, r"tool.point = \(0.0, 5.0\): must be of 3 numbers"),
        ({"normal": (0.0, 0.0, -2.0)}, "tool.normal = .*a unit vector"),
        ({"path": ((0.0, 0.0), (1.0, (1.0, 1.0)))}, "tool.path = .*as many numbers as the travel"),
        ({"driven_by": Force((0.0, -1.0))}, "tool.driven_by = .*of 3 numbers"),
        ({"candidates": ("base",)}, r"tools\[0\].candidates"),
    ],
)
def test_tools_that_do_not_fit_a_body_in_space_are_refused_by_name(changes, words):
    scene = upset(n=1)
    with pytest.raises(SceneError, match=words):
        replace(scene, tools=(replace(scene.tools[0], **changes),))


def test_tools_of_a_plane_are_refused_on_a_body_in_space():
    scene = upset(n=1)
    flat = FlatTool((0.0, 5.0), (0.0, -1.0), (0.0, -0.1), ("top",), 0.1)
    with pytest.raises(SceneError, match=r"tools\[0\].travel = .*of 3 numbers"):
        replace(scene, tools=(flat,))
    with pytest.raises(SceneError, match=r"tools\[0\].surface = Circle.*a plane, or what is Revolved"):
        replace(scene, tools=(ShapedTool(Circle((0.0, 6.0), 1.0), (0.0, 0.0, 0.0), ("top",), 0.1),))


def test_a_run_under_a_tool_is_read_back_with_the_tool_as_a_square_and_is_not_drawn_flat(tmp_path):
    scene = upset()
    with Recorder(tmp_path, scene, (), {}, {}) as out:
        for increment in march(scene, Schedule(2), Control(Newton(), ())):
            out.record(increment)
    history = open_results(tmp_path)
    last = history.at()
    (square,) = last.tools
    np.testing.assert_allclose(square.points[:, 2], 5.0 - 0.1, rtol=1e-12)
    assert (np.ptp(square.points, axis=0)[:2] > 10.0).all()
    reader = vtkHDFReader()
    reader.SetFileName(str(tmp_path / "tools.vtkhdf"))
    reader.Update()
    assert reader.GetOutput().GetNumberOfCells() == 1
    forces = last.nodal("contact_force")
    np.testing.assert_allclose(forces.sum(axis=0)[2], increment.solved.iterate.tool_forces(increment.solved.r)[0, 2])
    for draw in (lambda: plot.contour(history), lambda: plot.contact_traction(history)):
        with pytest.raises(SceneError, match="of a body in a plane"):
            draw()
