"""What is made of a march with every plane element: files, resumption, plots, problems for other codes, every form."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import reference
from vtkmodules.vtkIOHDF import vtkHDFReader

from bipot import plot
from bipot.contact.overlap import overlap
from bipot.exchange import conic_program, contact_problem
from bipot.fem.elements import RULES, tabulated
from bipot.forms import Dissipation, FormName, Newton, Penalty, Tangent
from bipot.laws.hardening import Linear
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import elements_of
from bipot.meshes.sections import block
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.traction import SLIP_TOLERANCE, contact_edges
from studies.recovered import edge_tractions
from tests.scenes import scene

mpl.use("Agg")


def pressed(element):
    material = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 2000.0))
    return scene(mesh=block(1.0, 1.0, 3, 2, element=element), material=material)


@pytest.fixture(scope="module", params=elements_of(2))
def run(request, tmp_path_factory):
    """The element, its scene, three increments and the folder that holds them."""
    given, folder = pressed(request.param), tmp_path_factory.mktemp("results") / request.param.value
    with Recorder(folder, given, (), {}, {}) as out:
        accepted = []
        for increment in march(given, Schedule(3), Control(Newton())):
            out.record(increment)
            accepted.append(increment)
    return request.param, given, accepted, folder


def test_the_mesh_is_read_back_and_the_march_goes_on_from_the_file(run):
    element, given, accepted, folder = run
    history = open_results(folder)
    assert history.mesh.element is element
    assert history.scene["element"] == element.value
    assert history.scene["quadrature"] == RULES[element][0].value
    np.testing.assert_array_equal(history.mesh.elements, given.mesh.elements)
    np.testing.assert_array_equal(history.mesh.boundary("top"), given.mesh.boundary("top"))
    np.testing.assert_array_equal(history.state().stress, accepted[-1].state.stress)
    again = list(march(given, Schedule(3), Control(Newton()), start=history.state(1)))
    np.testing.assert_allclose(again[-1].tool_forces, accepted[-1].tool_forces, rtol=1e-6)
    assert open_results(folder).end.state.tau == 1.0


def test_vtk_has_the_cells_with_our_shape_functions(run):
    element, given, accepted, folder = run
    reader = vtkHDFReader()
    reader.SetFileName(str(folder / "run.vtkhdf"))
    reader.UpdateInformation()
    reader.UpdateTimeStep(accepted[-1].state.tau)
    grid, rule = reader.GetOutput(), tabulated(element, RULES[element][0])
    np.testing.assert_allclose(vtk_to_numpy(grid.GetPoints().GetData())[:, :2], accepted[-1].state.nodes)
    for e, nodes in enumerate(given.mesh.elements):
        assert grid.GetCellType(e) == element.vtk
        for point, place in zip(rule.points, rule.values @ accepted[-1].state.nodes[nodes], strict=True):
            x, weights = [0.0] * 3, [0.0] * element.nodes
            grid.GetCell(e).EvaluateLocation(reference(0), [*point, 0.0], x, weights)
            np.testing.assert_allclose(x[:2], place, rtol=1e-12)


def test_plots_draw_every_edge_as_it_is(run):
    element, given, accepted, _ = run
    nodes, ax = accepted[-1].state.nodes, Figure().add_subplot()
    lines = plot.mesh(nodes, given.mesh.elements, ax)
    count = len(given.mesh.elements) * element.corners
    outer = sum(len(edges) for edges in given.mesh.boundaries.values())
    assert len(lines.get_segments()) == (count + outer) / 2
    edges = given.mesh.boundary("top")
    drawn = plot.curved(nodes, edges, pieces=2)
    np.testing.assert_allclose(drawn[:, [0, -1]], nodes[edges[:, [0, -1]]])
    middle = nodes[edges[:, 1]] if element.quadratic else nodes[edges].mean(axis=1)
    np.testing.assert_allclose(drawn[:, 1], middle, atol=1e-15)
    assert len(plot.boundary(nodes, edges, ax).get_segments()) == len(edges)


def test_overlap_and_edge_tractions_hold_what_the_forces_say(run):
    element, given, accepted, _ = run
    system, last = system_of(given), accepted[-1]
    deepest = overlap(given, last.state.nodes, given.travel(0.0, 1.0))
    assert 0 <= deepest < (1e-3 if element.quadratic else SLIP_TOLERANCE)
    r, candidates = last.solved.r, system.candidates
    edges = contact_edges(candidates, 0, r[:, 0] > 0)
    assert edges.shape == given.mesh.boundary("top").shape
    nodes = last.state.nodes[candidates.node]
    means = edge_tractions(nodes, edges, given.geometry, r)
    length = np.linalg.norm(nodes[edges[:, -1]] - nodes[edges[:, 0]], axis=1)
    np.testing.assert_allclose(length @ means, r.sum(axis=0), rtol=1e-6)


def test_problems_for_other_codes_are_those_of_the_increment(run):
    _, _, accepted, _ = run
    found = contact_problem(accepted[-1])
    u = found.problem.velocity(found.r)
    assert np.abs(u.reshape(-1, 2)[:, 0]).max() < 1e-6
    assert conic_program(accepted[-1], Tangent()).conic().q.size > 0


@pytest.mark.parametrize("form", [Tangent(), Dissipation(), Penalty(1e6, 1e6)], ids=lambda form: type(form).__name__)
@pytest.mark.parametrize("element", elements_of(2))
def test_every_form_takes_every_element(form, element):
    exact = list(march(pressed(element), Schedule(2), Control(Newton())))
    found = list(march(pressed(element), Schedule(2), Control(form)))
    assert found[-1].form is not FormName.NEWTON
    rel = 1e-2 if isinstance(form, Penalty) else 1e-6
    np.testing.assert_allclose(found[-1].tool_forces[0, 1], exact[-1].tool_forces[0, 1], rtol=rel)
