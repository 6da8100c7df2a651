"""Regions of meshes: what is kept of them, what is equal, and what is refused."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
import skfem

from bipot.errors import SceneError
from bipot.meshes.elements import Element, elements_of
from bipot.meshes.extrusion import extruded
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.meshes.solids import brick
from tests.scenes import refused

BLOCK = block(3.0, 2.0, 3, 2)

REGIONS = {"left half": [3, 0, 1], "right": np.arange(6) > 3, "corner": np.array([0], dtype=np.uint8)}


def parted(mesh=BLOCK, **regions):
    return Mesh(mesh.nodes, mesh.elements, mesh.boundaries, regions or REGIONS)


def middles(mesh, members):
    return mesh.nodes[mesh.elements[members][:, : mesh.element.corners]].mean(axis=1)


def test_regions_are_element_numbers_in_ascending_order():
    """However they are given; they may overlap, and leave elements out."""
    mesh = parted()
    assert {name: members.tolist() for name, members in mesh.regions.items()} == {
        "left half": [0, 1, 3],
        "right": [4, 5],
        "corner": [0],
    }
    for members in mesh.regions.values():
        assert members.dtype == np.intp
        assert not members.flags.writeable
    np.testing.assert_array_equal(mesh.region("right"), [4, 5])
    assert BLOCK.regions == {}


def test_regions_are_copies():
    given = np.array([2, 1])
    mesh = parted(core=given)
    given[:] = 5
    assert mesh.region("core").tolist() == [1, 2]
    with pytest.raises(TypeError):
        mesh.regions["core"] = given


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([], "empty': must be at least one element"),
        ([False] * 6, "empty"),
        ([True] * 5, r"marks \(5,\)': must be one of each element, \(6,\)"),
        (np.ones((6, 1), bool), "marks"),
        ([0, 6], r"element \[6\]': must be in \[0, 6\)"),
        ([-1], r"element \[-1\]"),
        ([2, 0, 2], r"element \[2\]': must be there once"),
        ([0.0, 1.0], "float64"),
        ([[0, 1]], "element numbers"),
        (3, "element numbers"),
        ("core", "element numbers"),
        (None, "element numbers"),
        ([[0], [1, 2]], "array of numbers"),
        (np.ma.masked_array([0, 1], [False, True]), "masked"),
    ],
    ids=str,
)
def test_what_is_no_region_is_refused_by_name(given, words):
    with pytest.raises(SceneError, match=f"mesh region 'core'.*{words}"):
        parted(core=given)


@pytest.mark.parametrize("name", [3, None, ("a", "b")])
def test_names_of_regions_are_text(name):
    with pytest.raises(SceneError, match=r"mesh region .*: must be a str"):
        replace(BLOCK, regions={name: [0]})


@pytest.mark.parametrize("given", [[0, 1], None, "core"])
def test_regions_are_a_mapping(given):
    with pytest.raises(SceneError, match=r"mesh.regions = .*: must be a Mapping"):
        replace(BLOCK, regions=given)


def test_an_unknown_region_is_refused_with_the_known_ones():
    refused(lambda: parted().region("core"), "region = 'core': must be one of .*'corner', 'left half', 'right'")
    refused(lambda: parted().region("core", "material"), "material = 'core': must be one of")
    refused(lambda: parted().region(1), "region = 1: must be a str")
    refused(lambda: BLOCK.region("core"), "region = 'core': must be one of the mesh, which has none: name elements")


def test_meshes_of_other_regions_are_not_equal():
    one, same = parted(core=[1, 0], shell=[2]), parted(shell=[2], core=[0, 1])
    assert one == same
    assert hash(one) == hash(same)
    for other in (BLOCK, parted(core=[0, 1]), parted(core=[0], shell=[2]), parted(core=[0, 1], rest=[2])):
        assert one != other
    # A boundary is no region of its name.
    assert parted(top=[0]) != BLOCK


@pytest.mark.parametrize("copied", [lambda mesh: pickle.loads(pickle.dumps(mesh)), copy.deepcopy, copy.copy])
def test_regions_are_pickled_and_copied(copied):
    mesh = parted()
    assert copied(mesh) == mesh
    np.testing.assert_array_equal(copied(mesh).region("right"), [4, 5])


def test_regions_are_named_in_words():
    assert repr(parted()).endswith("; boundaries base, left, right, top; regions corner, left half, right)")
    assert "region" not in repr(BLOCK)


@pytest.mark.parametrize("element", [*elements_of(2), *elements_of(3)])
def test_other_elements_have_the_same_regions(element):
    flat = element.dimension == 2
    straight = Element.T3 if flat else Element.T4
    if element.shape.cube:
        straight = Element.Q4 if flat else Element.H8
    mesh = block(3.0, 2.0, 3, 2, element=straight) if flat else brick(3.0, 2.0, 1.0, 2, 2, 1, element=straight)
    right = middles(mesh, np.arange(len(mesh.elements)))[:, 0] > 1.6
    mesh = parted(mesh, right=right, rest=~right)
    for other in (mesh.to(element), mesh.to(element).to(straight)):
        assert set(other.regions) == {"right", "rest"}
        assert (middles(other, other.region("right"))[:, 0] > 1.6).all()
        assert (middles(other, other.region("rest"))[:, 0] < 1.6).all()


@pytest.mark.parametrize("element", [Element.Q4, Element.T3])
def test_what_stands_above_a_region_is_of_it(element):
    flat = block(3.0, 2.0, 3, 2, element=element)
    left = middles(flat, np.arange(len(flat.elements)))[:, 0] < 1
    parts = parted(flat, left=left)._parts
    solid = Mesh(*extruded(parts, np.array([0.0, 1.0, 3.0])))
    corners = solid.nodes[solid.elements]
    np.testing.assert_array_equal(solid.region("left"), np.flatnonzero((corners[..., 0] <= 1).all(axis=1)))


@pytest.mark.parametrize("kind", [skfem.MeshQuad, skfem.MeshTri])
def test_subdomains_of_scikit_fem_are_regions(kind):
    """Triangles that are numbered clockwise are turned where they are."""
    given = kind.init_tensor(np.linspace(0, 1, 4), np.linspace(0, 1, 3))
    mesh = Mesh.from_skfem(given.with_subdomains({"low": lambda x: x[1] < 0.5, "some": np.array([4, 2])}))
    assert mesh.region("some").tolist() == [2, 4]
    low = middles(mesh, np.arange(len(mesh.elements)))[:, 1] < 0.5
    np.testing.assert_array_equal(mesh.region("low"), np.flatnonzero(low))


def test_an_empty_subdomain_of_scikit_fem_is_refused():
    given = skfem.MeshQuad().with_subdomains({"none": np.empty(0, int)})
    with pytest.raises(SceneError, match="mesh region 'none' = 'empty'"):
        Mesh.from_skfem(given)


def test_interfaces_lie_between_elements_that_are_not_in_the_same_regions():
    """Each once, on either side of which the element of a region has a neighbour of another, or of none."""
    mesh = block(3.0, 2.0, 3, 2, element=Element.Q8)
    sets = {tuple(np.sort(nodes)) for nodes in parted(mesh, core=[0], body=np.arange(6)).interfaces}
    assert len(sets) == 2
    first = mesh.elements[0]
    assert all(np.isin(nodes, first).all() for nodes in sets)
    assert {tuple(np.round(mesh.nodes[list(nodes)].mean(axis=0), 12)) for nodes in sets} == {(1.0, 0.5), (0.5, 1.0)}
    assert len(parted(mesh, low=[0, 1, 2]).interfaces) == len(parted(mesh, low=[0, 1, 2], high=[3, 4, 5]).interfaces)
    assert parted(mesh, body=np.arange(6)).interfaces.shape == mesh.interfaces.shape == (0, 3)
    solid = brick(2.0, 1.0, 1.0, 2, 1, 1)
    (face,) = parted(solid, left=[0]).interfaces
    np.testing.assert_allclose(solid.nodes[face, 0], 1.0)
