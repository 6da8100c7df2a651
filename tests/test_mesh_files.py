"""Meshes of files: the native mesh again, or a refusal in words."""

import sys

import meshio
import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from tests.scenes import refused, scene

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


def altered(**changes):
    """The native mesh of meshio with other ``points``, ``cells``, or ``line`` (the last block's edges)."""
    given = numbered()
    cells = changes.get("cells", [(block.type, block.data) for block in given.cells])
    if "line" in changes:
        cells[-1] = ("line3", np.array([changes["line"]] * len(cells[-1][1])))
    same = len(cells) == len(given.cells)
    return meshio.Mesh(
        changes.get("points", given.points),
        cells,
        cell_data=given.cell_data if same else {},
        field_data=given.field_data,
    )


FIRST = NATIVE.elements[:1]
UNEVEN = in_space(NATIVE.nodes) + np.outer(np.arange(len(NATIVE.nodes)), [0, 0, 0.01])


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            altered(cells=[("quad8", NATIVE.elements), ("triangle", FIRST[:, :3])]),
            r"mesh cells = \['quad8', 'triangle'\]",
        ),
        (altered(cells=[("quad8", NATIVE.elements[1:]), ("quad", FIRST[:, :4])]), r"\['quad', 'quad8'\].*of one kind"),
        (altered(cells=[("polygon", FIRST[:, :5])]), "of one kind, one of"),
        (altered(cells=[("line3", NATIVE.boundary("top"))]), "mesh cells = .*there are none"),
        (altered(cells=[("hexahedron", FIRST)]), "node order of cell"),
        (altered(points=UNEVEN), "z coordinates"),
        (altered(line=(0, 1, 2)), "mesh boundary 'top' = .*edges of cells"),
        (altered(line=NATIVE.boundary("top")[0]), "mesh boundary 'top'"),
        (altered(cells=[("quad8", NATIVE.elements[:, [0, 4, 1, 5, 2, 6, 3, 7]])]), "node order of cell"),
        (altered(cells=[("quad8", NATIVE.elements[:, [0, 1, 2, 3, 5, 6, 7, 4]])]), "node order of cell"),
        (altered(cells=[("quad", NATIVE.elements[:, [0, 2, 1, 3]])]), "around a triangle or a convex"),
        (altered(points=in_space(NATIVE.nodes)[:5]), "mesh cells = 'node index"),
        (altered(points=NATIVE.nodes[:, :1]), "two or three coordinates"),
        (altered(points=in_space(NATIVE.nodes) * np.nan), "mesh nodes = 'NaN"),
        (meshio.Mesh(np.array([[0.0, 0.0]]), []), "there are none"),
        (meshio.Mesh(np.zeros((1, 3)), []), "there are none"),
        (7, "mesh = 7: must be the path"),
    ],
)
def test_what_gives_no_plane_mesh_is_refused_by_name(given, words):
    with pytest.raises(SceneError, match=words):
        Mesh.from_meshio(given)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tag": "colour"}, "tag = 'colour'.*gmsh:physical"),
        ({"tag": 3}, "tag = 3"),
        ({"names": {"lid": 9}}, r"names\['lid'\] = 9"),
        ({"names": ["top"]}, "names"),
    ],
)
def test_boundaries_that_no_line_has_are_refused(options, words):
    with pytest.raises(SceneError, match=words):
        Mesh.from_meshio(numbered(), **options)


@pytest.mark.parametrize("data", [lambda n: np.full(n, 1.5), lambda n: np.ones((n, 2)), lambda n: np.full(n, np.nan)])
def test_cell_data_of_other_than_whole_numbers_are_refused(data):
    given = numbered(key="mine")
    given.cell_data["mine"] = [data(len(block.data)) for block in given.cells]
    with pytest.raises(SceneError, match="one whole number a cell"):
        Mesh.from_meshio(given, tag="mine")


def test_an_abaqus_file_may_include_another(tmp_path):
    text = written(tmp_path / "body.inp", with_sets()).read_text()
    head = text.split("*NSET", 1)[0]
    (tmp_path / "body.inp").write_text(head)
    (tmp_path / "all.inp").write_text("*HEADING\n*INCLUDE, INPUT=body.inp\n")
    assert len(Mesh.from_meshio(tmp_path / "all.inp").elements) == len(NATIVE.elements)
    (tmp_path / "lost.inp").write_text("*HEADING\n*INCLUDE, INPUT=nothing.inp\n")
    with pytest.raises(SceneError, match=r"nothing\.inp"):
        Mesh.from_meshio(tmp_path / "lost.inp")


def test_names_without_numbers_are_refused():
    with pytest.raises(SceneError, match="names"):
        Mesh.from_meshio(with_sets(), names={"top": 1})


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.msh", "no mesh"),
        ("a.inp", "*NODE\n1, a, b\n"),
        ("a.inp", "*NODE\n1, 0, 0\n*ELEMENT, TYPE=COH2D4\n1, 1, 1, 1, 1\n"),
        ("a.vtk", "# vtk DataFile Version 5.1\nBINARY\n"),
        ("a.vtu", "<VTKFile"),
        ("a.txt", "nodes"),
    ],
)
def test_an_unreadable_file_is_refused_in_words(name, text, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(SceneError, match=f"mesh file = .*{name}.*that meshio reads"):
        Mesh.from_meshio(tmp_path / name)


def test_a_missing_file_or_a_folder_is_refused(tmp_path):
    with pytest.raises(SceneError, match=r"none\.msh.*a file that exists"):
        Mesh.from_meshio(str(tmp_path / "none.msh"))
    with pytest.raises(SceneError, match="a file that exists"):
        Mesh.from_meshio(tmp_path)


def test_without_meshio_the_words_say_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(SceneError, match=r"pip install bipot\[mesh\]"):
        Mesh.from_meshio("a.msh")


@pytest.mark.parametrize("members", [[99], [-1], [0.5], ["a"], 3], ids=str)
def test_sets_of_no_cells_are_refused_by_name(members):
    mesh = numbered()
    mesh.cell_sets = {"odd": [None, members, *[None] * (len(mesh.cells) - 2)]}
    with pytest.raises(SceneError, match="mesh set 'odd'"):
        Mesh.from_meshio(mesh)


def test_sets_given_as_yes_and_no_are_boundaries():
    mesh = numbered()
    mesh.cell_data, mesh.field_data = {}, {}
    mesh.cell_sets = {"chosen": [None, np.ones(len(mesh.cells[1].data), bool), *[None] * (len(mesh.cells) - 2)]}
    assert set(Mesh.from_meshio(mesh).boundaries) == {"chosen"}


def test_a_name_that_is_another_s_number_is_refused():
    mesh = numbered()
    mesh.field_data = {"2": np.array([1, 1])}
    with pytest.raises(SceneError, match="of different names"):
        Mesh.from_meshio(mesh)


@pytest.mark.parametrize("tags", [["a"], [1j], [np.inf]], ids=str)
def test_cell_data_that_are_no_numbers_are_refused(tags):
    mesh = numbered()
    mesh.cell_data["gmsh:physical"] = [np.array(tags * len(block.data)) for block in mesh.cells]
    with pytest.raises(SceneError, match="one whole number a cell"):
        Mesh.from_meshio(mesh)


@pytest.mark.parametrize("kind", [float, object])
def test_node_indices_that_are_no_whole_numbers_are_refused(kind):
    given = brick(1.0, 1.0, 1.0, 1, 1, 1)
    mesh = meshio.Mesh(given.nodes, [("hexahedron", given.elements.astype(np.int64))])
    mesh.cells[0].data = (given.elements + 0.4).astype(kind)
    refused(lambda: Mesh.from_meshio(mesh), "mesh cells = 'node indices of type .*': must be whole numbers")


def test_field_data_that_name_no_group_are_passed_over():
    given = brick(1.0, 1.0, 1.0, 1, 1, 1)
    cells = [("hexahedron", given.elements), ("quad", given.edges("top"))]
    tags = {"gmsh:physical": [np.array([1]), np.array([7])]}
    mesh = meshio.Mesh(given.nodes, cells, cell_data=tags, field_data={"q": 5})
    assert list(Mesh.from_meshio(mesh).boundaries) == ["7"]
