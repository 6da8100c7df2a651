"""Meshes: counts, orientation, boundaries, refusals."""

import numpy as np
import pytest

from bipot.errors import SceneError
from bipot.fem.elements import Quadrature, tabulated
from bipot.fem.kinematics import gradients
from bipot.fem.reduction import Geometry
from bipot.meshes.cells import Fine
from bipot.meshes.elements import Element
from bipot.meshes.layout import Layout
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block, cylinder, ring
from bipot.meshes.solids import brick


def test_cylinder_counts_and_orientation():
    mesh = cylinder(5.0, 4.0, 3, 2, element=Element.Q8)
    assert mesh.nodes.shape == (12 + 17, 2)
    assert mesh.elements.shape == (6, 8)
    table = tabulated(Element.Q8, Quadrature.GAUSS2)
    area = gradients(mesh.nodes, mesh.elements, table, Geometry.PLANE_STRAIN).volume
    np.testing.assert_allclose(area / table.weights, 20.0 / 6)


def test_first_reference_axis_is_the_first_of_space():
    mesh = cylinder(3.0, 1.0, 1, 1, element=Element.Q8)
    J = mesh.nodes[mesh.elements[0]].T @ tabulated(Element.Q8, Quadrature.GAUSS2).gradients[0]
    np.testing.assert_allclose(J, np.diag([3.0, 1.0]), atol=1e-14)


@pytest.mark.parametrize(
    ("name", "axis", "value"), [("axis", 0, 0.0), ("side", 0, 5.0), ("base", 1, 0.0), ("top", 1, 4.0)]
)
def test_boundaries_lie_where_their_name_says(name, axis, value):
    mesh = cylinder(5.0, 4.0, 3, 2, element=Element.Q8)
    edges = mesh.boundary(name)
    assert len(edges) == (2 if axis == 0 else 3)
    np.testing.assert_allclose(mesh.nodes[edges][..., axis], value)
    ends, middle = mesh.nodes[edges[:, [0, 2]]], mesh.nodes[edges[:, 1]]
    np.testing.assert_allclose(ends.mean(axis=1), middle)


def test_ring_and_block_have_their_own_names():
    assert set(ring(1.5, 3.0, 1.0, 2, 2, element=Element.Q8).boundaries) == {"bore", "side", "base", "top"}
    assert set(block(1.0, 1.0, 1, 1, element=Element.Q8).boundaries) == {"left", "right", "base", "top"}


def test_size_is_the_largest_extent():
    assert cylinder(5.0, 7.0, 1, 1, element=Element.Q8).size == 7.0


@pytest.mark.parametrize("ratio", [8.0, 0.2])
@pytest.mark.parametrize(
    ("make", "start", "names"),
    [
        (lambda grading: cylinder(7.0, 3.0, 3, 4, grading, element=Element.Q8), 0.0, ("axis", "side")),
        (lambda grading: block(7.0, 3.0, 3, 4, grading, element=Element.Q8), 0.0, ("left", "right")),
        (lambda grading: ring(2.0, 9.0, 3.0, 3, 4, grading, element=Element.Q8), 2.0, ("bore", "side")),
    ],
)
def test_sizes_grow_by_one_factor_to_the_asked_ratio(make, start, names, ratio):
    mesh = make((ratio, 1 / ratio))
    for name, axis, count in (("base", 0, 3), (names[0], 1, 4)):
        ends = np.unique(mesh.nodes[mesh.boundary(name)[:, [0, 2]]][..., axis])
        sizes = np.diff(ends)
        asked = (ratio, 1 / ratio)[axis]
        np.testing.assert_allclose(sizes[1:] / sizes[:-1], asked ** (1 / (count - 1)))
        assert len(mesh.boundary(name)) == count
    np.testing.assert_array_equal(mesh.nodes.min(axis=0), [start, 0.0])
    np.testing.assert_array_equal(mesh.nodes.max(axis=0), [start + 7.0, 3.0])


@pytest.mark.parametrize("layout", Layout)
def test_a_fine_end_has_elements_of_one_size_and_the_others_grow_by_one_factor_from_it(layout):
    mesh = cylinder(7.0, 3.0, 3, 9, (0.5, Fine(0.6, 5)), layout=layout)
    for name, count in (("side", 9), ("axis", 9 + (layout is Layout.FANNED))):
        sizes = np.diff(np.unique(mesh.nodes[mesh.boundary_nodes(name), 1]))
        assert len(sizes) == count
        np.testing.assert_allclose(sizes[-5:], 0.12)
        factors = sizes[:-5] / sizes[1:-4]
        np.testing.assert_allclose(factors, factors[0])
        assert factors[0] > 1
    np.testing.assert_array_equal(np.ptp(mesh.nodes, axis=0), [7.0, 3.0])


def test_a_fine_end_may_be_as_fine_as_the_rest():
    np.testing.assert_allclose(Fine(0.5, 4).ends(0.0, 1.0, 8), np.linspace(0.0, 1.0, 9), atol=1e-15)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Fine(0.0, 2), "fine.length = 0.0"),
        (lambda: Fine("1", 2), "fine.length = '1': must be a number"),
        (lambda: Fine(1.0, 0), "fine.elements = 0"),
        (lambda: Fine(1.0, 1.5), "fine.elements = 1.5"),
        (lambda: block(1.0, 1.0, 3, 4, (1.0, Fine(1.0, 2))), "fine.length = 1.0: must be below that of the side"),
        (lambda: block(1.0, 1.0, 3, 4, (1.0, Fine(0.5, 4))), "fine.elements = 4: must be below the side's own"),
        (lambda: block(1.0, 1.0, 3, 4, (1.0, Fine(0.9, 1))), "fine.length = 0.9: must be such that 3 no smaller"),
        (lambda: block(1.0, 1.0, 3, 4, (1.0, Fine(1e-8, 3))), "fine.elements = 3: must be of at least"),
        (lambda: brick(1.0, 1.0, 1.0, 2, 2, 4, (1.0, 1.0, Fine(0.5, 3))), "grading = .*must be a number"),
        (lambda: brick(1.0, 1.0, 1.0, 4, 2, 2, (Fine(0.5, 3), 1.0, 1.0)), "grading = .*must be a number"),
    ],
)
def test_fine_ends_that_are_none_are_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_without_grading_nothing_changes():
    """Bit for bit: no uniform mesh goes through powers and sums."""
    plain, given = block(0.7, 0.3, 7, 3, element=Element.Q8), block(0.7, 0.3, 7, 3, grading=(1, 1), element=Element.Q8)
    np.testing.assert_array_equal(plain.nodes, given.nodes)
    np.testing.assert_array_equal(np.unique(plain.nodes[plain.elements[:, :4], 0]), np.linspace(0.0, 0.7, 8))


@pytest.mark.parametrize("grading", [0.0, -1.0, np.inf, np.nan, "2", True, None, 1e300, 1e-300])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_grading_that_is_none_is_refused(grading, axis):
    given = [1.0, 1.0]
    given[axis] = grading
    with pytest.raises(SceneError, match="grading"):
        block(1.0, 1.0, 3, 3, tuple(given), element=Element.Q8)


@pytest.mark.parametrize("grading", [2.0, (1.0,), (1.0, 1.0, 1.0), "ab"])
def test_gradings_are_a_pair(grading):
    with pytest.raises(SceneError, match="grading"):
        ring(1.0, 2.0, 1.0, 2, 2, grading, element=Element.Q8)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: cylinder(-1.0, 1.0, 1, 1, element=Element.Q8), "radius = -1.0"),
        (lambda: cylinder(1.0, float("nan"), 1, 1, element=Element.Q8), "height = nan"),
        (lambda: cylinder(1.0, 1.0, 0, 1, element=Element.Q8), "n_r = 0"),
        (lambda: ring(2.0, 1.0, 1.0, 1, 1, element=Element.Q8), "outer = 1.0"),
        (
            lambda: block(1.0, 1.0, 1, 1, element=Element.H8),
            r"element = 'H8': must be one of a plane, of \['T3', 'T6', ",
        ),
        (lambda: cylinder(1.0, 1.0, 1, 1, element=Element.Q8).boundary("lid"), "boundary = 'lid'"),
        (
            lambda: Mesh(np.array([[0, 0], [1, 0], [1, 1], [0, 1]]), [[0, 1, 2, 3]]).boundary("lid"),
            "boundary = 'lid': must be one of the mesh, which has",
        ),
        (lambda: Mesh(np.full((8, 2), np.nan), np.arange(8)[None]), "mesh.nodes"),
        (lambda: Mesh(np.zeros((7, 2)), np.arange(8)[None]), "node index"),
        (lambda: Mesh(np.zeros((8, 2)), np.arange(8)[None], {"top": np.empty((0, 3), int)}), "'top'"),
        (lambda: Mesh(np.zeros((8, 2)), np.empty((0, 8), int)), "at least one element"),
    ],
)
def test_bad_meshes_are_refused_by_name(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_a_mesh_is_printed_in_words_however_large_it_is():
    """And with it a scene: printed in full they were pages of numbers."""
    assert repr(block(1.0, 1.0, 40, 30)) == "Mesh(1200 Q4 elements, 1271 nodes; boundaries base, left, right, top)"
    assert repr(Mesh([(0, 0), (1, 0), (0, 1)], [(0, 1, 2)])) == "Mesh(1 T3 elements, 3 nodes; boundaries none)"


def test_boundaries_are_added_to_those_of_a_mesh_as_to_a_dictionary():
    mesh = block(2.0, 1.0, 4, 1)
    top = mesh.boundary("top")
    more = Mesh(mesh.nodes, mesh.elements, mesh.boundaries | {"below": top[:2]})
    assert set(more.boundaries) == {"left", "right", "base", "top", "below"}


def test_meshes_are_equal_where_all_their_numbers_are():
    one, same, other = block(6.0, 4.0, 4, 3), block(6.0, 4.0, 4, 3), block(6.0, 4.5, 4, 3)
    fewer = Mesh(one.nodes, one.elements, {"top": one.boundary("top")})
    assert one == same
    assert hash(one) == hash(same)
    assert one != other
    assert one != fewer
    assert one != 3
    assert {one: 1}[same] == 1
