"""Mesh files and meshes of meshio that give no plane mesh, and the words with which they are refused."""

import sys

import meshio
import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.meshes.mesh import Mesh
from bipot.meshes.solids import brick
from tests.scenes import refused
from tests.test_mesh_files import NATIVE, in_space, numbered, with_sets


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


def test_names_without_numbers_are_refused():
    with pytest.raises(SceneError, match=r"names = {1: 'top'}: must be names with their numbers, as {'top': 3}"):
        Mesh.from_meshio(numbered(key="mine"), tag="mine", names={1: "top"})
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


@pytest.mark.parametrize("members", [[99], [len(numbered().cells[1].data)], [-1], [0.5], ["a"], 3], ids=str)
def test_sets_of_no_cells_are_refused_by_name(members):
    mesh = numbered()
    mesh.cell_sets = {"odd": [None, members, *[None] * (len(mesh.cells) - 2)]}
    with pytest.raises(SceneError, match="mesh set 'odd'"):
        Mesh.from_meshio(mesh)


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
