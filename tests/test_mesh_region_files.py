"""Regions in files of meshes: groups and sets of cells, there and back."""

import meshio
import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from tests.scenes import refused

CORE = [0, 1, 3, 4]

PLANE = block(3.0, 2.0, 3, 3)

ENDINGS = {
    "msh 4.1": (".msh", "gmsh"),
    "msh 2.2": (".msh", "gmsh22"),
    "vtu": (".vtu", None),
    "vtk": (".vtk", None),
    "xdmf": (".xdmf", None),
    "inp": (".inp", None),
}

NAMELESS = ("vtu", "vtk", "xdmf")


def parted(mesh=PLANE, **regions):
    """The mesh with a core and a shell between whose elements its own go to and fro, unless other regions are given."""
    shell = np.setdiff1d(np.arange(len(mesh.elements)), CORE)
    return Mesh(mesh.nodes, mesh.elements, mesh.boundaries, regions or {"core": CORE, "shell": shell})


def back(mesh, kind, tmp_path):
    """The mesh from a file; of files without names its own are given to the numbers."""
    ending, written = ENDINGS[kind]
    path = tmp_path / f"a{ending}"
    mesh.to_meshio().write(path, file_format=written)
    names = {name: k for k, name in enumerate([*mesh.boundaries, *mesh.regions], 1)}
    return Mesh.from_meshio(path, names=names if kind in NAMELESS else None)


def assert_same(found, mesh):
    """The same elements in the same order, with the same regions, and boundaries at the same places."""
    # Gmsh's files have the nodes in another order.
    np.testing.assert_allclose(found.nodes[found.elements], mesh.nodes[mesh.elements], rtol=1e-12, atol=1e-14)
    assert {name: members.tolist() for name, members in found.regions.items()} == {
        name: members.tolist() for name, members in mesh.regions.items()
    }
    assert set(found.boundaries) == set(mesh.boundaries)
    for name in mesh.boundaries:
        middles = [np.sort(m.nodes[m.boundary(name)].mean(axis=1), axis=0) for m in (found, mesh)]
        np.testing.assert_allclose(*middles, atol=1e-12)


def grouped(body=(1, 1, 2, 2, 2, 1, 1, 1, 1), top=1, fields=None, key="gmsh:physical"):
    """The mesh as one of meshio: numbers of its elements in ``body``, and of its top."""
    edges = PLANE.boundary("top")
    cells = [("quad", PLANE.elements), ("line", edges)]
    return meshio.Mesh(PLANE.nodes, cells, cell_data={key: [np.array(body), np.full(3, top)]}, field_data=fields)


@pytest.mark.parametrize("kind", ENDINGS)
@pytest.mark.parametrize(
    "mesh",
    [
        parted(),
        parted(PLANE.to(Element.Q8)),
        parted(block(3.0, 2.0, 3, 2, element=Element.T6)),
        parted(brick(1.0, 1.0, 1.0, 2, 2, 2)),
        parted(brick(1.0, 1.0, 1.0, 2, 1, 1, element=Element.T10)),
        parted(middle=[4]),
        parted(all=np.arange(9)),
        parted(block(1.0, 1.0, 2, 1), one=[0], other=[1]),
    ],
    ids=["Q4", "Q8", "T6", "H8", "T10", "one element", "all elements", "no node of its own"],
)
def test_regions_come_back_from_files(mesh, kind, tmp_path):
    if kind == "xdmf" and mesh.element.quadratic:
        pytest.skip("meshio does not read quadratic cells beside others from XDMF")
    assert_same(back(mesh, kind, tmp_path), mesh)


def test_meshes_of_meshio_give_the_same_mesh():
    mesh = parted(core=CORE, shell=[2, 5], overlapping=[0, 2], top=[8], again=CORE)
    found = Mesh.from_meshio(mesh.to_meshio())
    assert_same(found, mesh)


@pytest.mark.parametrize("kind", ["inp", "msh 4.1"])
def test_regions_that_overlap_are_sets_of_cells_alone(kind, tmp_path):
    """No file has a part of a region under its name: of numbers an element has one."""
    mesh = parted(core=CORE, crossing=[4, 5], rest=[6, 7])
    kept = mesh if kind == "inp" else parted(core=CORE, rest=[6, 7])
    assert_same(back(mesh, kind, tmp_path), kept)


def test_elements_of_one_region_after_the_other_are_two_blocks():
    given = parted(low=range(5), high=range(5, 9)).to_meshio()
    assert [(cells.type, len(cells.data)) for cells in given.cells] == [("quad", 5), ("quad", 4), *[("line", 3)] * 4]
    assert [len(PLANE.to_meshio().cells), PLANE.to_meshio().cell_sets] == [5, {}]


def test_groups_of_cells_are_regions_by_name_or_number():
    assert Mesh.from_meshio(grouped()) == Mesh.from_meshio(grouped(key="medit:ref"))
    assert Mesh.from_meshio(grouped()) == Mesh.from_meshio(grouped(key="mine"), tag="mine")
    found = Mesh.from_meshio(grouped(fields={"core": np.array([2, 2]), "lid": np.array([1, 1])}))
    assert list(found.boundaries) == ["lid"]
    assert {name: members.tolist() for name, members in found.regions.items()} == {
        "1": [0, 1, 5, 6, 7, 8],
        "core": [2, 3, 4],
    }


def test_the_number_zero_is_no_region():
    found = Mesh.from_meshio(grouped(body=[0, 0, 3, 0, 0, 3, 0, 0, 0]))
    assert {name: members.tolist() for name, members in found.regions.items()} == {"3": [2, 5]}


def test_a_region_of_all_cells_is_kept():
    assert Mesh.from_meshio(grouped(body=[4] * 9)).region("4").tolist() == list(range(9))


def test_a_number_of_lines_and_of_cells_is_that_of_a_boundary():
    found = Mesh.from_meshio(grouped(), names={"lid": 1, "core": 2})
    assert (list(found.boundaries), list(found.regions)) == (["lid"], ["core"])


def test_a_pair_says_of_which_cells_a_number_is():
    names = {"lid": (1, 1), "shell": (1, 2), "core": np.array([2, 2])}
    found = Mesh.from_meshio(grouped(), names=names)
    assert list(found.boundaries) == ["lid"]
    assert found.region("shell").tolist() == [0, 1, 5, 6, 7, 8]
    assert found.region("core").tolist() == [2, 3, 4]


@pytest.mark.parametrize("given", [7, (2, 1), (1, 3), (1, 2, 3), "1", ((1, 2), (1, 2)), (), None])
def test_a_number_that_neither_lines_nor_cells_have_is_refused(given):
    words = r"names\['x'\] = .*: must be one of the lines' gmsh:physical: \[1\], or of the cells': \[1, 2\]"
    with pytest.raises(SceneError, match=words):
        Mesh.from_meshio(grouped(), names={"x": given})


def test_groups_of_cells_of_one_name_are_refused():
    fields = {"1": np.array([2, 2])}
    refused(lambda: Mesh.from_meshio(grouped(fields=fields)), "mesh regions = .*: must be of different names")


def test_numbers_of_lines_may_come_with_others_of_the_cells():
    """As of a file that has nothing where cells have no number; where nothing else has one, they are refused."""
    for other in (np.nan, 0.5):
        given = grouped(body=[other] * 9, key="mine")
        found = Mesh.from_meshio(given, tag="mine")
        assert (list(found.boundaries), found.regions) == (["1"], {})
        given.cell_data["mine"][1][:] = 0
        refused(lambda given=given: Mesh.from_meshio(given, tag="mine"), "tag = 'mine': .*one whole number a cell")


def test_sets_of_the_body_s_cells_are_regions():
    mesh = grouped(key="mine")
    marks = np.arange(9) < 2
    mesh.cell_sets = {
        "numbers": [[3, 1, 1], None],
        "marks": [marks],
        "none": [np.zeros(9, bool), []],
        "mixed": [[1], [0]],
        "gmsh:bounding_entities": [[1], []],
        "lid": [[], np.arange(3)],
    }
    found = Mesh.from_meshio(mesh)
    assert {name: members.tolist() for name, members in found.regions.items()} == {"numbers": [1, 3], "marks": [0, 1]}
    assert list(found.boundaries) == ["lid"]


@pytest.mark.parametrize("members", [[9], [-1], [0.5], ["a"], 3], ids=str)
def test_sets_of_other_than_cells_are_refused_by_name(members):
    mesh = grouped(key="mine")
    mesh.cell_sets = {"odd": [members, None]}
    refused(lambda: Mesh.from_meshio(mesh), "mesh set 'odd'")


def test_cells_are_numbered_through_their_blocks():
    """Whatever other cells are between them, clockwise ones, and nodes of none."""
    quads = PLANE.elements.copy()
    quads[3:] = quads[3:, Element.Q4.mirrored]
    cells = [("line", PLANE.boundary("top")), ("quad", quads[:4]), ("vertex", np.array([[0]])), ("quad", quads[4:])]
    data = {"gmsh:physical": [np.ones(3, int), np.array([0, 1, 0, 2]), np.array([1]), np.array([1, 0, 2, 2, 0])]}
    points = np.vstack([PLANE.nodes, [[9.0, 9.0]]])
    found = Mesh.from_meshio(meshio.Mesh(points, cells, cell_data=data))
    assert {name: members.tolist() for name, members in found.regions.items()} == {"1": [1, 4], "2": [3, 6, 7]}
    np.testing.assert_array_equal(np.sort(found.elements), np.sort(PLANE.elements))


def inp(tmp_path, *lines):
    """A file of Abaqus with four squares in a row, the first two in one block, then the ``lines``."""
    nodes = [f"{k + 1}, {k % 5}, {k // 5}" for k in range(10)]
    squares = [f"{10 * (k + 1)}, {k + 1}, {k + 2}, {k + 7}, {k + 6}" for k in range(4)]
    heads = "*ELEMENT, TYPE=CPE4", "*ELEMENT, TYPE=CPE4, ELSET=Right"
    path = tmp_path / "a.inp"
    path.write_text("\n".join(["*NODE", *nodes, heads[0], *squares[:2], heads[1], *squares[2:], *lines, ""]))
    return {name: members.tolist() for name, members in Mesh.from_meshio(path).regions.items()}


def test_sets_of_abaqus_are_those_of_their_own_elements(tmp_path):
    """meshio alone took the set of the second block for one of the first."""
    assert inp(tmp_path) == {"Right": [2, 3]}
    assert inp(tmp_path, "*ELSET, ELSET=ends, GENERATE", "10, 40, 30") == {"Right": [2, 3], "ends": [0, 3]}


def test_a_set_of_abaqus_is_added_to_where_its_name_comes_again(tmp_path):
    lines = "*Elset, elset=some", "10,", "** more of it", "20", "*ELSET, ELSET=SOME", "40", "*ELSET, ELSET=right", "10"
    assert inp(tmp_path, *lines) == {"Right": [0, 2, 3], "some": [0, 1, 3]}


def test_sets_of_abaqus_take_in_others_by_name(tmp_path):
    lines = "*ELSET, ELSET=first", "10", "*ELSET, ELSET=all", "20, first, RIGHT, no", "*ELSET, ELSET=more", "all, more"
    assert inp(tmp_path, *lines) == {
        "Right": [2, 3],
        "first": [0],
        "all": [0, 1, 2, 3],
        "more": [0, 1, 2, 3],
    }


def test_ranges_of_elements_and_elements_on_several_lines_of_abaqus(tmp_path):
    lines = (
        "*ELSET, ELSET=some, GENERATE",
        "10, 20, 10",
        "40, 40",
        "*ELEMENT, TYPE=CPS4, elset=Last",
        "7, 5,",
        "11,12,10",
    )
    path, more = tmp_path / "a.inp", ("*NODE", *(f"{k}, {x}, {y}" for k, x, y in ((11, 5, 0), (12, 5, 1))))
    inp(tmp_path, *lines[:3])
    head, body = path.read_text().split("*ELEMENT", 1)
    path.write_text("\n".join([head + "\n".join(more[1:]), "*ELEMENT" + body.strip(), *lines[3:], ""]))
    found = Mesh.from_meshio(path).regions
    assert {name: members.tolist() for name, members in found.items()} == {
        "Right": [2, 3],
        "some": [0, 1, 3],
        "Last": [4],
    }


def test_a_file_of_abaqus_that_includes_others_has_no_sets_of_elements(tmp_path):
    (tmp_path / "more.inp").write_text("*HEADING\n")
    assert inp(tmp_path, "*INCLUDE, INPUT=more.inp") == {}
