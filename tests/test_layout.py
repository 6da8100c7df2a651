"""Layouts of rectangles: what the fanned one consists of, with every element, and what it is for."""

import numpy as np
import pytest

from bipot.fem.elements import RULES, tabulated
from bipot.fem.kinematics import gradients
from bipot.fem.projection import VolumeChange
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.marching import Control, Schedule, march
from bipot.meshes import cells
from bipot.meshes.elements import Element, elements_of
from bipot.meshes.layout import Layout
from bipot.meshes.sections import block, cylinder, ring
from bipot.paper import upsetting
from tests.scenes import refused

FANNED = Layout.FANNED
COUNTS = [(1, 1), (1, 4), (3, 1), (2, 5), (4, 4)]


def volumes(mesh):
    """Of elements (e, q), by weights that are all positive: as positive as their Jacobian determinants."""
    table = tabulated(mesh.element, RULES[mesh.element][0])
    assert (table.weights > 0).all()
    return gradients(mesh.nodes, mesh.elements, table, Geometry.PLANE_STRAIN).volume


def corner_of(mesh, *sides):
    (corner,) = set.intersection(*(set(mesh.boundary_nodes(side).tolist()) for side in sides))
    return corner


@pytest.mark.parametrize("element", elements_of(2))
@pytest.mark.parametrize("counts", COUNTS)
@pytest.mark.parametrize("grading", [(1.0, 1.0), (0.2, 7.0)])
def test_fanned_elements_fill_the_rectangle_and_two_share_the_corner(element, counts, grading):
    n, m = counts
    made = {
        ("top", "right"): block(3.0, 2.0, n, m, grading, element, FANNED),
        ("top", "side"): cylinder(3.0, 2.0, n, m, grading, element, FANNED),
        ("side", "top"): ring(1.0, 4.0, 2.0, n, m, grading, element, FANNED),
    }
    for sides, mesh in made.items():
        assert mesh.element is element
        assert len(mesh.elements) == ((n + 1) * (m + 1) - 1) * (2 if element.corners == 3 else 1)
        assert volumes(mesh).min() > 0
        assert volumes(mesh).sum() == pytest.approx(6.0, rel=1e-14)
        corner = corner_of(mesh, *sides)
        np.testing.assert_array_equal(mesh.nodes[corner], mesh.nodes.max(axis=0))
        assert (mesh.elements == corner).sum() == 2


@pytest.mark.parametrize("element", elements_of(2))
@pytest.mark.parametrize("counts", COUNTS)
def test_boundaries_are_complete_and_in_order(element, counts):
    n, m = counts
    mesh = block(3.0, 2.0, n, m, (0.2, 7.0), element, FANNED)
    expected = {"left": (0, 0.0, m + 1), "right": (0, 3.0, m), "base": (1, 0.0, n + 1), "top": (1, 2.0, n)}
    assert list(mesh.boundaries) == list(expected)
    for name, (axis, place, count) in expected.items():
        edges = mesh.boundary(name)
        assert edges.shape == (count, element.edges.shape[1])
        assert (mesh.nodes[edges][..., axis] == place).all()
        np.testing.assert_array_equal(edges[1:, 0], edges[:-1, -1])
        along = mesh.nodes[np.append(edges[:, 0], edges[-1, -1]), 1 - axis]
        assert (along[0], along[-1]) == (0.0, (3.0, 2.0)[1 - axis])
        sizes = np.diff(along)
        ratio = (0.2, 7.0)[1 - axis]
        assert sizes[-1] / sizes[0] == pytest.approx(ratio if count > 1 else 1.0)
        np.testing.assert_allclose(sizes[1:] / sizes[:-1], ratio ** (1 / max(count - 1, 1)))
    mesh.require_outer("all", *expected)


def test_the_one_with_one_element_a_side_is_three_quadrilaterals():
    mesh = block(2.0, 2.0, 1, 1, layout=FANNED)
    corners = {frozenset(map(tuple, mesh.nodes[cell].tolist())) for cell in mesh.elements}
    middle, corner = (1.0, 1.0), (2.0, 2.0)
    assert corners == {
        frozenset({(0.0, 0.0), (1.0, 0.0), middle, (0.0, 1.0)}),
        frozenset({(0.0, 1.0), middle, corner, (0.0, 2.0)}),
        frozenset({(1.0, 0.0), (2.0, 0.0), corner, middle}),
    }


def test_the_layout_left_out_is_the_one_between_lines():
    for element in elements_of(2):
        plain, named = block(3.0, 2.0, 3, 2, element=element), block(3.0, 2.0, 3, 2, (1, 1), element, Layout.TENSOR)
        np.testing.assert_array_equal(plain.nodes, named.nodes)
        np.testing.assert_array_equal(plain.elements, named.elements)
    assert len(upsetting(mu=0.1, elements=3).mesh.elements) == 9


@pytest.mark.parametrize("layout", ["fanned", None, True, Element.Q4])
def test_what_is_no_layout_is_refused_by_name(layout):
    for make in (
        lambda: block(1.0, 1.0, 2, 2, layout=layout),
        lambda: cylinder(1.0, 1.0, 2, 2, layout=layout),
        lambda: ring(1.0, 2.0, 1.0, 2, 2, layout=layout),
        lambda: upsetting(mu=0.1, layout=layout),
    ):
        refused(make, "layout = .*must be a Layout")


def test_counts_and_gradings_are_refused_as_without_a_layout():
    refused(lambda: block(1.0, 1.0, 0, 2, layout=FANNED), "n_x = 0")
    refused(lambda: block(1.0, 1.0, 2, 2.5, layout=FANNED), "n_y = 2.5")
    refused(lambda: block(1.0, 1.0, 2, 2, (0.0, 1.0), layout=FANNED), "grading = 0.0")
    refused(lambda: block(1.0, 1.0, 2, 2, 3.0, layout=FANNED), "grading = 3.0: must be a pair")
    refused(lambda: upsetting(mu=0.1, elements=10**5, layout=FANNED), "elements = 100000: must be so few")


def test_room_is_asked_for_what_there_will_be(monkeypatch):
    """Three by three Q4 have 9 cells in lines and 15 fanned."""
    monkeypatch.setattr(cells, "memory", lambda: 14 * cells.BYTES_A_NODE)
    assert block(1.0, 1.0, 3, 3).elements.shape == (9, 4)
    refused(lambda: block(1.0, 1.0, 3, 3, layout=FANNED), "n_x = 3: must be so few")


@pytest.mark.parametrize("element", [Element.Q8, Element.Q9])
def test_a_quadratic_projected_element_is_not_folded_in_a_fanned_corner(element):
    """Where :class:`Layout.TENSOR` ends at a fold (tests/test_accuracy_mesh.py)."""
    scene = upsetting(mu=0.3, elements=3, element=element, volume=VolumeChange.P1, layout=FANNED)
    steps = list(march(scene, Schedule(9, first=0.001 / 0.45, settling=1, growth=4.0), Control(Newton(), ())))
    assert steps[-1].state.tau == 1.0
    side = np.setdiff1d(scene.mesh.boundary_nodes("side"), scene.mesh.boundary_nodes("top"))
    heights = steps[-1].state.nodes[side, 1]
    assert (np.abs(heights - 2.75) < 1e-9).any(), (
        "no node of the side has landed: the corner was not asked for anything"
    )
