"""Meshes of every plane element: makers, changes of element, files there and back, refusals by name."""

import re
from pathlib import Path

import meshio
import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.fem.elements import RULES, tabulated, tabulated_at
from bipot.fem.kinematics import gradients
from bipot.fem.projection import VOLUMES
from bipot.fem.reduction import Geometry
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element, elements_of
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, cylinder, ring
from tests.scenes import refused, scene

PAGE = Path(__file__).parents[1] / "docs" / "scenes.md"
ALIKE = {3: (Element.T3, Element.T6), 4: (Element.Q4, Element.Q8, Element.Q9)}


def test_the_page_has_every_element_with_its_rules_and_volume_changes():
    rows = re.findall(
        r"^\| `([A-Z]+\d+)` \| (\d) \| `(\w+)` \| (\d+) \| (.*) \| (.*) \|$", PAGE.read_text("utf-8"), re.MULTILINE
    )
    told = {
        name: (int(n), cell, int(vtk), *(re.findall(r"`(\w+)`", words) for words in lists))
        for name, n, cell, vtk, *lists in rows
    }
    ends = {"line": 2, "line3": 3, "triangle": 3, "triangle6": 6, "quad": 4, "quad8": 8}
    assert told == {
        e.name: (ends[e.facet], e.cell, e.vtk, [r.name for r in RULES[e]], [v.name for v in VOLUMES[e]])
        for e in Element
    }


def native(element):
    return block(1.0, 1.0, 3, 2, element=element)


def forces(mesh):
    return np.array([a.tool_forces for a in march(scene(mesh=mesh), Schedule(2), Control())])


def area(mesh):
    table = tabulated(mesh.element, RULES[mesh.element][0])
    return gradients(mesh.nodes, mesh.elements, table, Geometry.PLANE_STRAIN).volume


@pytest.mark.parametrize("element", elements_of(2))
@pytest.mark.parametrize("grading", [(1.0, 1.0), (4.0, 0.3)])
def test_makers_fill_the_rectangle_with_any_element(element, grading):
    for mesh in (
        block(3.0, 2.0, 3, 2, grading, element),
        cylinder(3.0, 2.0, 3, 2, grading, element),
        ring(1.0, 4.0, 2.0, 3, 2, grading, element),
    ):
        assert mesh.element is element
        assert len(mesh.elements) == 6 * (2 if element.corners == 3 else 1)
        assert area(mesh).min() > 0
        assert area(mesh).sum() == pytest.approx(6.0, rel=1e-14)
        assert {name: edges.shape for name, edges in mesh.boundaries.items()} == {
            name: (3 if name in ("base", "top") else 2, element.edges.shape[1]) for name in mesh.boundaries
        }
        np.testing.assert_allclose(mesh.nodes[mesh.boundary("top")][..., 1], 2.0)


def test_diagonals_alternate():
    mesh = block(2.0, 2.0, 2, 2, element=Element.T3)
    _, count = np.unique(mesh.elements, return_counts=True)
    centre = int(np.flatnonzero((mesh.nodes == 1.0).all(axis=1))[0])
    assert count[centre] == 8


@pytest.mark.parametrize(("source", "target"), [(a, b) for kin in ALIKE.values() for a in kin for b in kin])
def test_a_mesh_goes_over_to_another_element_of_its_shape(source, target):
    assert_same(native(source).to(target), native(target))


def assert_same(mesh, other):
    np.testing.assert_allclose(mesh.nodes[mesh.elements], other.nodes[other.elements], rtol=0, atol=1e-15)
    assert list(mesh.boundaries) == list(other.boundaries)
    for name in mesh.boundaries:
        np.testing.assert_allclose(mesh.nodes[mesh.boundary(name)], other.nodes[other.boundary(name)], atol=1e-15)


def test_curved_edges_are_kept_by_a_centre_that_is_added():
    """Eight-node shapes at the middle: the nine nodes span the same geometry."""
    curved = native(Element.Q8)
    nodes = curved.nodes + 0.03 * np.sin(7 * curved.nodes[:, ::-1])
    eight = Mesh(nodes, curved.elements)
    nine = eight.to(Element.Q9)
    points = np.random.default_rng(0).random((5, 2))
    places = [
        np.einsum("qk,ekd->eqd", np.column_stack(shapes(points, mesh.element)), mesh.nodes[mesh.elements])
        for mesh in (eight, nine)
    ]
    np.testing.assert_allclose(places[0], places[1], rtol=0, atol=1e-14)


def shapes(points, element):
    return tabulated_at(element, points).values.T


@pytest.mark.parametrize("ending", [".msh", ".inp", ".vtu", ".vtk"])
@pytest.mark.parametrize("element", elements_of(2))
def test_a_file_there_and_back_gives_the_forces_of_the_native_mesh(element, ending, tmp_path):
    mesh = native(element)
    path = tmp_path / f"a{ending}"
    mesh.to_meshio().write(path, **({"file_format": "gmsh"} if ending == ".msh" else {}))
    named = ending in (".vtu", ".vtk")
    back = Mesh.from_meshio(path, names={name: k for k, name in enumerate(mesh.boundaries, 1)} if named else None)
    assert back.element is element
    assert sorted(back.boundaries) == sorted(mesh.boundaries)
    expected = forces(mesh)
    # Some files write sixteen digits: with nodes a bit apart, Newton ends elsewhere within the bound on equilibrium.
    np.testing.assert_allclose(forces(back), expected, rtol=0, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("element", elements_of(2))
def test_boundaries_that_are_no_edges_and_orders_that_are_none_are_refused(element):
    mesh = native(element)
    edges = dict(mesh.boundaries)
    inside = mesh.elements[:1, : element.edges.shape[1]]
    diagonal = [int(mesh.elements[0, 0]), int(mesh.elements[-1, 0])]
    if not element.quadratic:
        refused(lambda: Mesh(mesh.nodes, mesh.elements, {"top": [diagonal]}), "mesh boundary 'top'.*of one edge")
        wide = np.insert(edges["top"], 1, 0, axis=1)
        refused(lambda: Mesh(mesh.nodes, mesh.elements, {"top": wide}), r"'top'.*of shape \(n, 2\): an edge of")
    else:
        refused(lambda: Mesh(mesh.nodes, mesh.elements, {"top": inside}), "mesh boundary 'top'.*of one edge")
        ends = edges["top"][:, [0, 2]]
        refused(lambda: Mesh(mesh.nodes, mesh.elements, {"top": ends}), r"'top'.*of shape \(n, 3\): an edge of")
    clockwise = Mesh(mesh.nodes, mesh.elements[:, element.mirrored], edges)
    refused(lambda: scene(mesh=clockwise), "mesh: element .* number nodes anticlockwise")
    given = mesh.to_meshio()
    given.cells[0].data = np.roll(mesh.elements, 1, axis=1)[:, [1, 0, *range(2, element.nodes)]]
    if element is Element.T3:
        assert Mesh.from_meshio(given).element is element
    else:
        refused(lambda: Mesh.from_meshio(given), "mesh node order of cell|mesh boundary")


@pytest.mark.parametrize("element", elements_of(2))
def test_mixed_meshes_and_edges_of_another_kind_are_refused(element):
    given = native(element).to_meshio()
    other = Element.Q4 if element.corners == 3 else Element.T3
    cells = [(block_.type, block_.data) for block_ in given.cells]
    mixed = meshio.Mesh(given.points, [*cells, (other.cell, given.cells[0].data[:1, : other.nodes])])
    with pytest.raises(SceneError, match=rf"mesh cells = \[.*{other.cell}.*all of one kind"):
        Mesh.from_meshio(mixed)
    lost = meshio.Mesh(given.points, [cells[0], ("line", np.array([[0, len(given.points) - 1]]))])
    lost.cell_data = {"gmsh:physical": [np.zeros(len(cells[0][1]), int), np.array([1])]}
    with pytest.raises(SceneError, match=r"mesh boundary '1' = \[\[0, .*edges of cells"):
        Mesh.from_meshio(lost)


def test_three_nodes_of_a_straight_edge_are_no_edge_of_one_without_middle():
    given = native(Element.Q8).to_meshio()
    given.cells[0].type, given.cells[0].data = "quad", given.cells[0].data[:, :4]
    with pytest.raises(SceneError, match=r"mesh boundary 'left'.*edges of cells"):
        Mesh.from_meshio(given)


def test_triangles_make_no_quadrilaterals():
    refused(lambda: native(Element.T3).to(Element.Q4), "element = 'Q4': must be with the 3 corners of T3")
    refused(lambda: native(Element.Q8).to(Element.T6), "element = 'T6': must be with the 4 corners of Q8")
    refused(lambda: native(Element.Q8).to("q4"), "element = 'q4': must be an Element, e.g. Element.Q4")
    refused(lambda: block(1.0, 1.0, 1, 1, element="t3"), "element = 't3': must be an Element, e.g. Element.T3")
