"""Meshes of files: the native mesh again, with its boundaries and forces."""

import meshio
import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from tests.scenes import scene

NATIVE = block(1.0, 1.0, 3, 2, element=Element.Q8)

NAMES = {name: k + 1 for k, name in enumerate(NATIVE.boundaries)}

AS_MESHERS = [0, 2, 1]


def in_space(nodes, z=0.0):
    return np.column_stack([nodes, np.full(len(nodes), z)])


def numbered(kinds=("quad8", "line3"), key="gmsh:physical", z=0.0):
    """The native mesh as one of meshio, boundaries by number; ``kinds`` name its cells and lines."""
    quads = NATIVE.elements[:, : {"quad": 4, "quad8": 8}[kinds[0]]]
    lines = [NATIVE.boundary(name)[:, AS_MESHERS[: {"line": 2, "line3": 3}[kinds[1]]]] for name in NAMES]
    tags = [np.zeros(len(quads), int), *(np.full(len(e), k) for e, k in zip(lines, NAMES.values(), strict=True))]
    cells = [(kinds[0], quads), *((kinds[1], edges) for edges in lines)]
    data = {key: tags, "gmsh:geometrical": tags} if key.startswith("gmsh") else {key: tags}
    fields = {name: np.array([k, 1]) for name, k in NAMES.items()} if key.startswith("gmsh") else {}
    place = np.array([[2, 0]] * len(NATIVE.nodes))
    for name, number in NAMES.items():
        place[NATIVE.boundary_nodes(name)] = 1, number
    entities = {"gmsh:dim_tags": place} if key.startswith("gmsh") else {}
    return meshio.Mesh(in_space(NATIVE.nodes, z), cells, entities, data, fields)


def with_sets():
    """The native mesh as one of meshio, boundaries as sets of nodes, and sets of other uses."""
    sets = {name: NATIVE.boundary_nodes(name) for name in NAMES} | {"CORNER": np.array([0])}
    return meshio.Mesh(in_space(NATIVE.nodes), [("quad8", NATIVE.elements)], point_sets=sets)


def assert_native(mesh, boundaries=tuple(NAMES)):
    assert sorted(mesh.boundaries) == sorted(boundaries)
    np.testing.assert_allclose(mesh.nodes[mesh.elements], NATIVE.nodes[NATIVE.elements], rtol=0, atol=1e-15)
    for name in boundaries:
        own, native = (np.unique(m.nodes[m.boundary(name)[:, 1]].round(9), axis=0) for m in (mesh, NATIVE))
        np.testing.assert_array_equal(own, native)


def forces(mesh):
    return np.array([a.tool_forces for a in march(scene(mesh=mesh), Schedule(2), Control())])


def written(path, mesh, **options):
    mesh.write(path, **options)
    return path


@pytest.fixture
def files(tmp_path):
    """The native mesh written by meshio, and what reads it."""
    by_number = {"tag": "boundary", "names": NAMES}
    return {
        "msh 4.1": (written(tmp_path / "new.msh", numbered(), file_format="gmsh"), {}),
        "msh 2.2": (written(tmp_path / "old.msh", numbered(), file_format="gmsh22"), {}),
        "inp": (written(tmp_path / "a.inp", with_sets()), {}),
        "vtk": (written(tmp_path / "a.vtk", numbered(key="boundary")), by_number),
        "vtu": (written(tmp_path / "a.vtu", numbered(key="boundary")), by_number),
    }


@pytest.mark.parametrize("kind", ["msh 4.1", "msh 2.2", "inp", "vtk", "vtu"])
def test_a_file_gives_the_native_mesh_and_its_forces(kind, files):
    path, options = files[kind]
    mesh = Mesh.from_meshio(path, **options)
    assert_native(mesh)
    native = forces(NATIVE)
    np.testing.assert_allclose(forces(mesh), native, rtol=0, atol=1e-12 * np.abs(native).max())


def test_numbers_without_names_are_the_names():
    mesh = Mesh.from_meshio(numbered(key="medit:ref"))
    assert sorted(mesh.boundaries) == ["1", "2", "3", "4"]
    assert len(mesh.boundary(str(NAMES["top"]))) == len(NATIVE.boundary("top"))


def test_sets_of_line_cells_are_boundaries_and_sets_of_others_are_not():
    given = numbered(key="mine")
    nothing = [np.empty(0, int)] * 5
    sets = {name: [*nothing[:k], np.arange(len(given.cells[k].data))] for name, k in NAMES.items()}
    given.cell_sets = sets | {"all": [np.arange(6), *nothing[1:]]}
    assert_native(Mesh.from_meshio(given))


@pytest.mark.parametrize("line", ["line", "line3"])
def test_lines_of_either_kind_are_edges(line):
    assert_native(Mesh.from_meshio(numbered(kinds=("quad8", line))))


def test_edges_with_the_middle_in_the_middle_are_edges():
    """So Gmsh writes them for Abaqus."""
    given = numbered()
    cells = [(b.type, b.data if b.dim == 2 else b.data[:, [0, 2, 1]]) for b in given.cells]
    assert_native(Mesh.from_meshio(meshio.Mesh(given.points, cells, {}, given.cell_data, given.field_data)))


def test_straight_cells_get_their_mid_sides_on_request():
    given = Mesh.from_meshio(numbered(kinds=("quad", "line")))
    assert given.element is Element.Q4
    mesh = given.to(Element.Q8)
    assert sorted(mesh.boundaries) == sorted(NAMES)
    np.testing.assert_allclose(mesh.nodes[mesh.elements], NATIVE.nodes[NATIVE.elements], atol=1e-15)
    np.testing.assert_allclose(forces(mesh), forces(NATIVE), rtol=1e-9)


def test_sets_of_corners_are_boundaries_of_straight_cells():
    corners = np.unique(NATIVE.elements[:, :4])
    sets = {name: np.intersect1d(NATIVE.boundary_nodes(name), corners) for name in NAMES}
    given = meshio.Mesh(NATIVE.nodes, [("quad", NATIVE.elements[:, :4])], point_sets=sets)
    mesh = Mesh.from_meshio(given)
    assert {name: len(edges) for name, edges in mesh.boundaries.items()} == {
        name: len(edges) for name, edges in NATIVE.boundaries.items()
    }


def test_a_set_with_a_node_inside_is_no_boundary():
    corners = np.unique(NATIVE.elements[:, :4])
    top = np.intersect1d(NATIVE.boundary_nodes("top"), corners)
    inside = np.setdiff1d(corners, [node for name in NAMES for node in NATIVE.boundary_nodes(name)])[:1]
    assert inside.size
    sets = {"top": top, "top and more": np.concatenate([top, inside])}
    given = meshio.Mesh(NATIVE.nodes, [("quad", NATIVE.elements[:, :4])], point_sets=sets)
    assert list(Mesh.from_meshio(given).boundaries) == ["top"]


def test_nine_nodes_clockwise_and_nodes_of_no_cell():
    """Cells numbered clockwise are turned, and a node of none is dropped, the ninth where others are asked for."""
    centre = NATIVE.nodes[NATIVE.elements[:, :4]].mean(axis=1)
    nine = np.column_stack([NATIVE.elements, len(NATIVE.nodes) + np.arange(6)])
    nine[::2] = nine[::2][:, [0, 3, 2, 1, 7, 6, 5, 4, 8]]
    given = numbered(z=7.5)
    cells = [("quad9", nine), *((block.type, block.data) for block in given.cells[1:])]
    points = in_space(np.vstack([NATIVE.nodes, centre, [[5.0, 5.0]]]), 7.5)
    mesh = Mesh.from_meshio(meshio.Mesh(points, cells, cell_data=given.cell_data, field_data=given.field_data))
    assert mesh.element is Element.Q9
    assert_native(mesh.to(Element.Q8))


def test_abaqus_kinds_of_one_shape_are_read(tmp_path):
    """meshio alone knows shells there: solids of plane strain or of revolution were refused."""
    text = written(tmp_path / "a.inp", with_sets()).read_text()
    assert "TYPE=S8R5" in text
    for kind in ("CAX8", "cpe8r", "CPS8R", "CPE8RH"):
        (tmp_path / "b.inp").write_text(text.replace("TYPE=S8R5", f"type={kind}"))
        assert_native(Mesh.from_meshio(tmp_path / "b.inp"))


def test_an_abaqus_file_may_include_another(tmp_path):
    text = written(tmp_path / "body.inp", with_sets()).read_text()
    head = text.split("*NSET", 1)[0]
    (tmp_path / "body.inp").write_text(head)
    (tmp_path / "all.inp").write_text("*HEADING\n*INCLUDE, INPUT=body.inp\n")
    assert len(Mesh.from_meshio(tmp_path / "all.inp").elements) == len(NATIVE.elements)
    (tmp_path / "lost.inp").write_text("*HEADING\n*INCLUDE, INPUT=nothing.inp\n")
    with pytest.raises(SceneError, match=r"nothing\.inp"):
        Mesh.from_meshio(tmp_path / "lost.inp")


def test_sets_given_as_yes_and_no_are_boundaries():
    mesh = numbered()
    mesh.cell_data, mesh.field_data = {}, {}
    mesh.cell_sets = {"chosen": [None, np.ones(len(mesh.cells[1].data), bool), *[None] * (len(mesh.cells) - 2)]}
    assert set(Mesh.from_meshio(mesh).boundaries) == {"chosen"}


def test_field_data_that_name_no_group_are_passed_over():
    given = brick(1.0, 1.0, 1.0, 1, 1, 1)
    cells = [("hexahedron", given.elements), ("quad", given.edges("top"))]
    tags = {"gmsh:physical": [np.array([1]), np.array([7])]}
    mesh = meshio.Mesh(given.nodes, cells, cell_data=tags, field_data={"q": 5})
    assert list(Mesh.from_meshio(mesh).boundaries) == ["7"]
