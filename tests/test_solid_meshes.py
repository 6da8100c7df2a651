"""Meshes of space: makers, faces, conversions, files, and what is refused by name."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from bipot.errors import SceneError
from bipot.fem.elements import RULES, tabulated
from bipot.fem.kinematics import gradients
from bipot.fem.reduction import Geometry
from bipot.fem.surface import outward_area
from bipot.meshes.elements import Element
from bipot.meshes.facets import Facets
from bipot.meshes.layout import Layout
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick, cylinder_3d, ring_3d
from tests.solids import SOLIDS, curved

meshio = pytest.importorskip("meshio")

NORMALS = {
    "left": (-1, 0, 0),
    "right": (1, 0, 0),
    "front": (0, -1, 0),
    "back": (0, 1, 0),
    "base": (0, 0, -1),
    "top": (0, 0, 1),
}


def volume(mesh):
    table = tabulated(mesh.element, RULES[mesh.element][-1])
    return gradients(mesh.nodes, mesh.elements, table, Geometry.SOLID).volume.sum()


@pytest.mark.parametrize("element", SOLIDS)
def test_a_brick_has_its_volume_and_six_sides_that_look_outward(element):
    mesh = brick(3.0, 2.0, 1.0, 3, 2, 2, grading=(2.0, 1.0, 0.5), element=element)
    assert mesh.element is element
    assert volume(mesh) == pytest.approx(6.0, rel=1e-13)
    areas = {name: outward_area(mesh.nodes, mesh.boundary(name), Geometry.SOLID).sum(axis=(0, 1)) for name in NORMALS}
    sides = {"left": 2, "right": 2, "front": 3, "back": 3, "base": 6, "top": 6}
    for name, normal in NORMALS.items():
        np.testing.assert_allclose(areas[name], sides[name] * np.array(normal), atol=1e-13)
    assert sum(map(len, mesh.boundaries.values())) == len(mesh.outline)
    x = np.unique(mesh.to(Element.H8 if element.shape.cube else Element.T4).nodes[:, 0])
    assert (x[3] - x[2]) / (x[1] - x[0]) == pytest.approx(2.0)


@pytest.mark.parametrize("element", SOLIDS)
@pytest.mark.parametrize("quarter", [True, False])
def test_a_cylinder_comes_to_its_volume(element, quarter):
    """Straight sides as the square of the segments' length, arcs as the fourth power."""
    exact, errors = np.pi * 4 * 3 / (4 if quarter else 1), []
    for n in (2, 4):
        mesh = cylinder_3d(2.0, 3.0, n, 1, 1, element=element, quarter=quarter)
        errors.append(1 - volume(mesh) / exact)
        side = mesh.nodes[mesh.boundary_nodes("side"), :2]
        np.testing.assert_allclose(np.linalg.norm(side, axis=1), 2.0, rtol=1e-14)
        assert set(mesh.boundaries) == {"base", "top", "side"} | ({"left", "front"} if quarter else set())
        assert sum(map(len, mesh.boundaries.values())) == len(mesh.outline)
    assert errors[0] / errors[1] == pytest.approx(16 if element.quadratic else 4, rel=0.05)
    flat = cylinder_3d(2.0, 3.0, 4, 1, 1, element=element, quarter=quarter, curved=False)
    assert 1 - volume(flat) / exact == pytest.approx(1 - np.sin(np.pi / 16) / (np.pi / 16), rel=1e-9)


@pytest.mark.parametrize("element", SOLIDS)
@pytest.mark.parametrize("curved", [True, False])
def test_a_circle_that_is_not_inscribed_has_its_own_area(element, curved):
    how = {"element": element, "curved": curved, "inscribed": False}
    assert volume(cylinder_3d(2.0, 3.0, 2, 1, 1, **how)) == pytest.approx(3 * np.pi, rel=1e-12)
    assert volume(ring_3d(1.0, 2.0, 4.0, 3, 2, 1, **how)) == pytest.approx(3 * np.pi, rel=1e-12)


@pytest.mark.parametrize("element", SOLIDS)
def test_a_quarter_of_a_ring_has_six_sides_on_its_circles_and_planes(element):
    mesh = ring_3d(1.0, 3.0, 2.0, 4, 2, 2, grading=(2.0, 1.0), element=element)
    assert volume(mesh) == pytest.approx(4 * np.pi, rel=1e-4 if element.quadratic else 0.03)
    radius = np.linalg.norm(mesh.nodes[:, :2], axis=1)
    for name, exact in {"bore": 1.0, "side": 3.0}.items():
        np.testing.assert_allclose(radius[mesh.boundary_nodes(name)], exact, rtol=1e-14)
    for name, axis in {"left": 0, "front": 1, "base": 2}.items():
        assert not mesh.nodes[mesh.boundary_nodes(name), axis].any()
    assert sum(map(len, mesh.boundaries.values())) == len(mesh.outline)
    outside = outward_area(mesh.nodes, mesh.boundary("bore"), Geometry.SOLID).sum(axis=(0, 1))
    assert (outside[:2] < 0).all()
    sizes = np.diff(np.unique(radius[mesh.boundary_nodes("front")].round(12)))
    assert sizes[-1] / sizes[0] == pytest.approx(2.0)


@pytest.mark.parametrize("element", SOLIDS)
def test_a_whole_ring_is_four_times_its_quarter(element):
    how = {"grading": (2.0, 1.0), "element": element}
    mesh, quarter = ring_3d(1.0, 3.0, 2.0, 2, 2, 1, quarter=False, **how), ring_3d(1.0, 3.0, 2.0, 2, 2, 1, **how)
    assert len(mesh.elements) == 4 * len(quarter.elements)
    assert volume(mesh) == pytest.approx(4 * volume(quarter), rel=1e-13)
    radius = np.linalg.norm(mesh.nodes[:, :2], axis=1)
    for name, exact in {"bore": 1.0, "side": 3.0}.items():
        np.testing.assert_allclose(radius[mesh.boundary_nodes(name)], exact, rtol=1e-14)
    assert set(mesh.boundaries) == {"bore", "side", "base", "top"}
    assert sum(map(len, mesh.boundaries.values())) == len(mesh.outline)


def test_rings_of_a_cylinder_are_graded():
    mesh = cylinder_3d(1.0, 1.0, 1, 4, 1, grading=(0.25, 1.0))
    x = np.sort(mesh.nodes[(np.abs(mesh.nodes[:, 1:]) < 1e-12).all(axis=1), 0])
    sizes = np.diff(x)[1:]
    np.testing.assert_allclose(sizes[1:] / sizes[:-1], 0.25 ** (1 / 3), rtol=1e-12)


@pytest.mark.parametrize("element", SOLIDS)
def test_mirror_images_numbered_the_other_way_are_the_same_body(element):
    mesh = curved(element)
    image = mesh.nodes * (-1, 1, 1)
    other = Mesh(image, mesh.elements[:, element.mirrored], mesh.boundaries)
    assert volume(other) == pytest.approx(volume(mesh), rel=1e-13)
    area = outward_area(other.nodes, other.boundary("right"), Geometry.SOLID).sum(axis=(0, 1))
    own = outward_area(mesh.nodes, mesh.boundary("right"), Geometry.SOLID).sum(axis=(0, 1))
    np.testing.assert_allclose(area, own * (-1, 1, 1), atol=1e-13)


@pytest.mark.parametrize("element", [Element.H20, Element.T10])
def test_elements_are_made_into_others_of_their_shape(element):
    mesh = brick(2.0, 1.0, 1.0, 2, 1, 1, element=element)
    straight = mesh.to(Element.H8 if element.shape.cube else Element.T4)
    again = straight.to(element)
    assert again.element is element
    np.testing.assert_array_equal(np.sort(again.nodes, axis=0), np.sort(mesh.nodes, axis=0))
    for name in mesh.boundaries:
        assert len(straight.boundary(name)) == len(mesh.boundary(name))
    with pytest.raises(SceneError, match=r"with the [48] corners"):
        mesh.to(Element.Q8)


def test_neighbours_share_a_face_that_they_number_opposite_ways():
    mesh = brick(2.0, 1.0, 1.0, 2, 1, 1)
    facets = Facets.of(mesh.elements, Element.H8)
    assert facets.shared.sum() == 1
    assert not facets.crowded.size
    twisted = mesh.elements.copy()
    twisted[1] = twisted[1, Element.H8.mirrored]
    with pytest.raises(SceneError, match=r"face \[.*of one element a side"):
        Mesh(mesh.nodes, twisted)


@pytest.mark.parametrize("element", SOLIDS)
@pytest.mark.parametrize("ending", [".msh", ".vtu", ".inp"])
def test_a_file_there_and_back_is_the_same_mesh(element, ending, tmp_path):
    mesh = curved(element)
    path = tmp_path / f"a{ending}"
    mesh.to_meshio().write(path, **({"file_format": "gmsh"} if ending == ".msh" else {}))
    names = {name: number for number, name in enumerate(mesh.boundaries, 1)} if ending == ".vtu" else None
    read = Mesh.from_meshio(path, tag="gmsh:physical" if ending == ".vtu" else None, names=names)
    # Gmsh's file has the nodes in another order.
    np.testing.assert_allclose(read.nodes[read.elements], mesh.nodes[mesh.elements], rtol=1e-12, atol=1e-14)
    assert set(read.boundaries) == set(mesh.boundaries)
    for name in mesh.boundaries:
        middles = [np.sort(m.nodes[m.boundary(name)].mean(axis=1), axis=0) for m in (read, mesh)]
        np.testing.assert_allclose(*middles, atol=1e-12)


@pytest.mark.parametrize(
    "mesh",
    [
        block(1.0, 1.0, 1, 1),
        block(1.0, 1.0, 1, 1, element=Element.T3),
        brick(1.0, 1.0, 1.0, 1, 2, 2),
        brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.H20),
    ],
    ids=["Q4", "T3", "H8", "H20"],
)
@pytest.mark.parametrize("ending", [".msh", ".inp"])
def test_a_body_with_all_nodes_on_its_boundaries_comes_back_from_a_file(mesh, ending, tmp_path):
    path = tmp_path / f"a{ending}"
    twice = Mesh(mesh.nodes, mesh.elements, {**mesh.boundaries, "again": mesh.boundaries["top"]})
    twice.to_meshio().write(path, **({"file_format": "gmsh"} if ending == ".msh" else {}))
    read = Mesh.from_meshio(path)
    assert len(read.nodes) == len(mesh.nodes)
    np.testing.assert_allclose(read.nodes[read.elements], mesh.nodes[mesh.elements], rtol=1e-12, atol=1e-14)
    assert set(read.boundaries) == set(twice.boundaries)
    for name in twice.boundaries:
        ways = [np.sort(m.nodes[m.boundary(name)].mean(axis=1), axis=0) for m in (read, twice)]
        np.testing.assert_allclose(ways[0], ways[1], atol=1e-12)


@pytest.mark.parametrize(
    ("given", "element"),
    [(skfem.MeshHex().refined(1), Element.H8), (skfem.MeshTet().refined(1), Element.T4)],
    ids=["hex", "tet"],
)
def test_meshes_of_scikit_fem_come_with_their_boundaries(given, element):
    mesh = Mesh.from_skfem(given.with_defaults())
    assert mesh.element is element
    assert volume(mesh) == pytest.approx(1.0, rel=1e-13)
    assert set(mesh.boundaries) == {"left", "right", "bottom", "top", "front", "back"}
    assert sum(map(len, mesh.boundaries.values())) == len(mesh.outline)


def cube(**boundaries):
    """One H8 with boundaries as given."""
    return Mesh(Element.H8.places, np.arange(8)[None], {name: np.array(some) for name, some in boundaries.items()})


HEXAHEDRON = (np.array(Element.H8.places), [("hexahedron", np.array([[0, 1, 3, 2, 4, 5, 6, 7]]))])


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda: brick(1.0, 1.0, 1.0, 0, 1, 1), "n_x = 0"),
        (lambda: brick(1.0, -1.0, 1.0, 1, 1, 1), "depth = -1.0"),
        (lambda: brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.Q4), "element = 'Q4': must be one of space"),
        (lambda: brick(1.0, 1.0, 1.0, 1, 1, 1, grading=(1.0, 1.0)), "grading = .*3 numbers"),
        (lambda: brick(1.0, 1.0, 1.0, 10**4, 10**4, 10**4), "n_x = 10000: must be so few"),
        (lambda: cylinder_3d(1.0, 1.0, 1, 1, 1, quarter=2), "quarter = 2"),  # pyright: ignore[reportArgumentType]
        (lambda: cylinder_3d(1.0, 1.0, 1, 10**9, 1), "n_r = 1000000000: must be so few"),
        (lambda: cylinder_3d(1.0, 1.0, 1, 1, 1, element=Element.T6), "element = 'T6'"),
        (lambda: cylinder_3d(1.0, 1.0, 1, 1, 1, inscribed=2), "inscribed = 2"),  # pyright: ignore[reportArgumentType]
        (lambda: ring_3d(2.0, 2.0, 1.0, 1, 1, 1), "inner = 2.0: must be < outer = 2.0"),
        (lambda: ring_3d(1.0, 2.0, 1.0, 0, 1, 1), "n_around = 0"),
        (lambda: Mesh.from_meshio(meshio.Mesh(*HEXAHEDRON)), "node order of cell"),
        (lambda: Mesh(np.zeros((4, 4)), np.arange(4)[None]), r"mesh.nodes = .*\(nodes, 3\) in space"),
        (lambda: Mesh(Element.H8.places, np.arange(6)[None]), r"\(1, 6\).*\(n, 4\): T4, .*\(n, 20\): H20"),
        (lambda: cube(top=[[0, 1, 2, 6]]), "the nodes of one face"),
        (lambda: cube(top=[[4, 5, 6]]), r"\(n, 4\): a face of H8"),
        (lambda: cube(top=[[4, 5, 6, 7], [7, 6, 5, 4]]), "a face twice"),
    ],
)  # fmt: skip
def test_what_makes_no_mesh_of_space_is_refused_by_name(made, words):
    with pytest.raises(SceneError, match=words):
        made()


def test_layouts_of_rectangles_are_unchanged_by_those_who_extrude_them():
    """A brick's base is the rectangle's own mesh, node by node."""
    flat = brick(3.0, 2.0, 1.0, 3, 2, 1).boundary("base")
    assert len(flat) == Layout.TENSOR.count(3, 2)
