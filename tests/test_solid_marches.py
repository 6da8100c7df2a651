"""Bodies in space without tools: closed forms, every form, follower pressure, energies, and files."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import reference
from vtkmodules.vtkIOHDF import vtkHDFReader

from bipot import (
    BodyForce,
    Configuration,
    Control,
    Dissipation,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    Linear,
    Mesh,
    Newton,
    Perfect,
    PointForce,
    Prescribed,
    Pressure,
    Recorder,
    Scene,
    SceneError,
    Schedule,
    Support,
    Symmetry,
    Tangent,
    Traction,
    VolumeChange,
    VonMises,
    brick,
    cylinder_3d,
    march,
)
from bipot.fem.elements import RULES, tabulated
from bipot.results import open as open_results
from studies.verification.cases import quarter_cylinder
from tests.solids import SOLIDS, turned

STEEL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 1000.0))
PLANES = (Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2))


def pressed(element, form):
    """An eighth of a block between smooth platens, shortened by 5 %: its last increment."""
    mesh = brick(2.0, 3.0, 4.0, 1, 2, 1, element=element)
    scene = Scene(mesh, Geometry.SOLID, STEEL, (*PLANES, Prescribed("top", 2, -0.2)))
    return list(march(scene, Schedule(4), Control(form)))


@pytest.mark.parametrize("element", SOLIDS)
def test_uniaxial_compression_is_homogeneous_in_every_form(element):
    """Stress from the strain of equal steps at midpoints; energy of the whole body, eight times what is modelled."""
    forms = (Newton(), Tangent(), Dissipation())
    ends = [pressed(element, form)[-1] for form in forms]
    E, H, Y = 210e3, 1000.0, 300.0
    strain = sum(0.05 / (4 - 0.05 * (k + 0.5)) for k in range(4))
    exact = (Y + H * strain) / (1 + H / E)
    for end in ends:
        stress = end.state.stress
        np.testing.assert_allclose(stress[..., 2], -exact, rtol=1e-6)
        np.testing.assert_allclose(np.delete(stress, 2, axis=-1), 0.0, atol=1e-6 * exact)
        assert end.solved.certificate.equilibrium < 1e-6
        assert end.solved.certificate.yield_violation < 1e-12
        top = end.solved.iterate.increment.system.body.scene.mesh.boundary_nodes("top")
        force = end.solved.iterate.reactions(end.solved.r)[top, 2].sum()
        deep = end.state.nodes[:, 0].max() * end.state.nodes[:, 1].max()
        assert force == pytest.approx(-exact * deep, rel=1e-6)
    energies = [end.course.energies for end in ends]
    volume = 8 * 24.0
    assert energies[0].elastic == pytest.approx(exact**2 / (2 * E) * volume, rel=1e-2)
    assert energies[0].plastic == pytest.approx(energies[0].work - energies[0].elastic, rel=1e-2)
    for other in energies[1:]:
        assert other.work == pytest.approx(energies[0].work, rel=1e-7)


def test_a_block_turned_in_space_gives_the_same_stresses_turned():
    """By a follower pressure, and with supports that hold its rigid motions alone."""
    Q, ends = turned((1.0, 2.0, 3.0), 1.1), []
    for turn in (np.eye(3), Q):
        mesh = brick(2.0, 2.0, 2.0, 1, 1, 1)
        mesh = Mesh(mesh.nodes @ turn.T, mesh.elements, mesh.boundaries)
        scene = Scene(mesh, Geometry.SOLID, STEEL, (), loads=(Pressure("top", 310.0), Pressure("base", 310.0)))
        ends.append(list(march(scene, Schedule(2), Control(Newton())))[-1])
    straight, other = (end.state.mises for end in ends)
    np.testing.assert_allclose(straight, other, rtol=1e-7)
    np.testing.assert_allclose(straight, 310.0, rtol=1e-3)


def test_a_pressurised_thick_cylinder_has_lame_s_stresses_and_bore():
    """A quarter of a disc with a hole, nu = 0.3, in plane strain: elements refined, errors fall as their square."""
    young, inner, outer, p = 1000.0, 1.0, 2.0, 1.0
    exact = (1.3 / young) * p * inner**2 / (outer**2 - inner**2) * (0.4 * inner + outer**2 / inner)
    errors = {}
    for element, counts in ((Element.H8, (3, 6)), (Element.H20, (1, 2)), (Element.T10, (2, 4))):
        for n in counts:
            mesh = bent(brick(1.0, 1.0, 0.3, n, 2 * n, 1, element=element), inner)
            scene = Scene(
                mesh,
                Geometry.SOLID,
                Elastic(Elasticity(young, 0.3)),
                (Symmetry("front", 1), Symmetry("back", 0), Symmetry("base", 2), Support("top", 2)),
                loads=(Pressure("left", p),),
                configuration=Configuration.SMALL,
            )
            (end,) = march(scene, Schedule(1), Control(Newton()))
            bore = mesh.boundary_nodes("left")
            grown = np.linalg.norm(end.state.nodes[bore, :2], axis=1) - inner
            errors.setdefault(element, []).append(abs(grown.mean() / exact - 1))
    for element, (coarse, fine) in errors.items():
        assert fine < coarse / 3
        assert fine < (0.01 if element is Element.H8 else 0.003)


def bent(mesh, inner):
    """Block coordinates as radius less ``inner`` and as angle over a right one."""
    r, angle = inner + mesh.nodes[:, 0], np.pi / 2 * mesh.nodes[:, 1]
    return Mesh(
        np.column_stack([r * np.cos(angle), r * np.sin(angle), mesh.nodes[:, 2]]), mesh.elements, mesh.boundaries
    )


@pytest.mark.parametrize("element", [Element.H8, Element.H20, Element.T10])
def test_loads_have_their_resultants(element):
    mesh = brick(2.0, 3.0, 4.0, 1, 1, 1, element=element)
    loads = (
        BodyForce((1.0, 2.0, 3.0)),
        Traction("right", (0.0, 0.0, 5.0)),
        PointForce(3, (7.0, 0.0, 0.0)),
        Pressure("top", 2.0),
    )
    holds = tuple(Support("base", k) for k in range(3))
    rule, volume = RULES[element][-1], VolumeChange.AS_IS
    scene = Scene(mesh, Geometry.SOLID, STEEL, holds, loads=loads, quadrature=rule, volume=volume)
    (end,) = march(scene, Schedule(1), Control(Newton()))
    load = end.solved.iterate.nodal_load
    expected = np.array([24 + 7, 48, 72 + 5 * 12 - 2 * 6])
    np.testing.assert_allclose(load.sum(axis=0), expected, rtol=2e-3)
    reactions = end.solved.iterate.reactions(end.solved.r)
    np.testing.assert_allclose(reactions.sum(axis=0), -load.sum(axis=0), rtol=1e-6)


def test_a_rough_block_s_limit_load_falls_with_the_mesh_towards_the_strict_bounds():
    """A cube between platens that hold it: 1.0316 <= p/Y <= 1.0569, from 6 elements a side on inside."""
    found = [rough(n) for n in (2, 4)]
    assert found[0] > found[1] > 1.0569
    assert found[1] == pytest.approx(1.0603, abs=1e-4)


@pytest.mark.slow
def test_a_rough_block_s_limit_load_is_within_the_strict_bounds():
    assert 1.0316 < rough(8) < rough(6) < 1.0569
    assert 1.553 < rough(12, 3, 4.0) < 1.747


def rough(n, n_z=None, width=1.0):
    """Mean pressure over the yield stress where all of an eighth of a block flows."""
    mesh = brick(width / 2, width / 2, 0.5, n, n, n_z or n)
    holds = (*PLANES, Support("top", 0), Support("top", 1), Prescribed("top", 2, -0.02))
    material = VonMises(Elasticity(200e3, 0.3), Perfect(300.0))
    scene = Scene(mesh, Geometry.SOLID, material, holds, configuration=Configuration.SMALL)
    end = list(march(scene, Schedule(8), Control(Newton())))[-1]
    force = end.solved.iterate.reactions(end.solved.r)[mesh.boundary_nodes("top"), 2].sum()
    return -force / (width**2 / 4 * 300.0)


@pytest.mark.parametrize("element", SOLIDS)
def test_a_run_is_read_back_by_vtk_and_marched_on(element, tmp_path):
    mesh = cylinder_3d(1.0, 1.0, 1, 1, 1, element=element)
    scene = Scene(mesh, Geometry.SOLID, STEEL, (*PLANES, Prescribed("top", 2, -0.05)))
    with Recorder(tmp_path, scene, (), {}, {}) as out:
        accepted = []
        for increment in march(scene, Schedule(3), Control(Newton())):
            out.record(increment)
            accepted.append(increment)
    history, end = open_results(tmp_path), accepted[-1]
    assert history.mesh.element is element
    np.testing.assert_array_equal(history.mesh.elements, mesh.elements)
    np.testing.assert_array_equal(history.mesh.boundary("side"), mesh.boundary("side"))
    np.testing.assert_array_equal(history.state().stress, end.state.stress)
    again = list(march(scene, Schedule(3), Control(Newton()), start=history.state(1)))
    np.testing.assert_allclose(again[-1].state.nodes, end.state.nodes, rtol=1e-6)
    reader = vtkHDFReader()
    reader.SetFileName(str(tmp_path / "run.vtkhdf"))
    reader.UpdateInformation()
    reader.UpdateTimeStep(end.state.tau)
    grid, rule = reader.GetOutput(), tabulated(element, RULES[element][0])
    np.testing.assert_allclose(vtk_to_numpy(grid.GetPoints().GetData()), end.state.nodes)
    stress = vtk_to_numpy(grid.GetCellData().GetArray("stress"))
    np.testing.assert_allclose(stress[:, 2], end.state.stress[..., 2].mean(axis=1), rtol=1e-3)
    for e, nodes in enumerate(mesh.elements):
        assert grid.GetCellType(e) == element.vtk
        for point, place in zip(rule.points, rule.values @ end.state.nodes[nodes], strict=True):
            x, weights = [0.0] * 3, [0.0] * element.nodes
            grid.GetCell(e).EvaluateLocation(reference(0), point.tolist(), x, weights)
            np.testing.assert_allclose(x, place, rtol=1e-12, atol=1e-14)


def test_a_quarter_of_a_cylinder_has_the_axisymmetric_force():
    """By six segments of the circle's area; on the circle they would lose more than that."""
    found = []
    for scene in (quarter_cylinder.meridian(8), quarter_cylinder.quarter(6)):
        steps = islice(
            march(scene, Schedule(15, first=0.001 / 0.45, settling=1, growth=4.0), Control(Newton(), ())), 14
        )
        found.append(np.array([(step.state.tau, -step.tool_force(0)[-1]) for step in steps]))
    (tau, flat), (other, solid) = (rows.T for rows in found)
    np.testing.assert_array_equal(other, tau)
    np.testing.assert_allclose(solid, flat, rtol=5e-3)
    chords = np.sin(np.pi / 12) / (np.pi / 12)
    assert (chords * solid < 0.993 * flat).all()


BRICK = brick(1.0, 1.0, 1.0, 1, 1, 1)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"geometry": Geometry.PLANE_STRAIN}, "scene.geometry = .*PLANE_STRAIN.*must be SOLID"),
        ({"loads": (BodyForce((0.0, 1.0)),)}, r"body force.vector = \(0.0, 1.0\): must be of 3 numbers"),
        ({"loads": (Traction("top", (0.0, 1.0)),)}, "traction.vector"),
        ({"loads": (PointForce(0, (0.0, 1.0)),)}, "point force.vector"),
        ({"supports": (Symmetry("top", 1),)}, "symmetry.boundary = 'top'"),
        ({"supports": (Support("side", 1),)}, "boundary = 'side'"),
    ],
)
def test_what_does_not_fit_a_body_in_space_is_refused_by_name(changes, words):
    scene = Scene(BRICK, Geometry.SOLID, STEEL, ())
    with pytest.raises(SceneError, match=words):
        replace(scene, **changes)
