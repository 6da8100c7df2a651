"""The fanned layout of bricks: what it consists of, with every element."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest

from bipot.fem.elements import RULES, tabulated
from bipot.fem.kinematics import gradients
from bipot.fem.orientation import scaled_jacobians
from bipot.fem.reduction import Geometry
from bipot.meshes import cells
from bipot.meshes.elements import Element
from bipot.meshes.layout import Layout
from bipot.meshes.solids import brick
from tests.scenes import refused
from tests.solids import SOLIDS

FANNED = Layout.FANNED
COUNTS = [(1, 1, 1), (1, 3, 2), (3, 2, 4)]
SIZES, GRADING = (3.0, 2.0, 1.0), (0.2, 1.0, 7.0)
FACES = {"left": (0, 0), "right": (0, 1), "front": (1, 0), "back": (1, 1), "base": (2, 0), "top": (2, 1)}


def fanned(counts, element=Element.H8, grading=GRADING):
    n, m, k = counts
    return brick(*SIZES, n, m, k, grading, element, FANNED)


def holding(mesh, nodes):
    """How many elements have all these nodes."""
    return int(np.isin(mesh.elements, nodes).sum(axis=1).tolist().count(len(nodes)))


@pytest.mark.parametrize("element", SOLIDS)
@pytest.mark.parametrize("counts", COUNTS)
def test_fanned_elements_fill_the_box_and_three_share_its_corner(element, counts):
    mesh, (n, m, k) = fanned(counts, element), counts
    parts = 1 if element.shape.cube else 6
    assert mesh.element is element
    assert len(mesh.elements) == FANNED.count(*counts) * parts == (n * m * k + n * m + n * k + m * k) * parts
    assert scaled_jacobians(mesh.nodes, mesh.elements).min() > 0.1
    volume = gradients(mesh.nodes, mesh.elements, tabulated(element, RULES[element][-1]), Geometry.SOLID).volume
    assert volume.sum() == pytest.approx(6.0, rel=1e-13)
    (corner,) = np.flatnonzero((mesh.nodes == SIZES).all(axis=1))
    assert holding(mesh, [corner]) == 3 * parts


@pytest.mark.parametrize("counts", COUNTS)
def test_two_hexahedra_share_every_edge_between_far_faces(counts):
    mesh = fanned(counts)
    for first, second in combinations(("right", "back", "top"), 2):
        edge = np.intersect1d(mesh.boundary_nodes(first), mesh.boundary_nodes(second))
        (axis,) = {0, 1, 2} - {FACES[first][0], FACES[second][0]}
        edge = edge[np.argsort(mesh.nodes[edge, axis])]
        assert len(edge) == counts[axis] + 1
        assert {holding(mesh, pair) for pair in pairwise(edge)} == {2}


@pytest.mark.parametrize("element", SOLIDS)
@pytest.mark.parametrize("counts", COUNTS)
def test_faces_are_complete_and_on_their_planes(element, counts):
    mesh = fanned(counts, element)
    halves = 1 if element.shape.cube else 2
    assert list(mesh.boundaries) == list(FACES)
    assert sum(map(len, mesh.boundaries.values())) == len(mesh.outline)
    for name, (axis, far) in FACES.items():
        others = [n for along, n in enumerate(counts) if along != axis]
        assert len(mesh.boundary(name)) == halves * (Layout.TENSOR if far else FANNED).count(*others)
        assert (mesh.nodes[mesh.boundary(name)][..., axis] == far * SIZES[axis]).all()


def test_far_faces_are_graded_as_those_between_lines_are_and_near_ones_have_one_more():
    mesh, plain = fanned((3, 2, 4)), brick(*SIZES, 3, 2, 4, GRADING)
    top, flat = (np.sort(of.nodes[of.boundary_nodes("top")], axis=0) for of in (mesh, plain))
    np.testing.assert_array_equal(top, flat)
    along, finer = mesh.nodes[mesh.boundary_nodes("base"), 0], brick(*SIZES, 4, 2, 4, GRADING)
    assert np.isin(finer.nodes[:, 0], along).all()


def test_a_face_of_symmetry_is_laid_out_as_a_rectangle_is():
    """The section through the middle of a block is the fanned one of the plane."""
    mesh = fanned((3, 2, 4))
    assert len(mesh.boundary("left")) == FANNED.count(2, 4)
    assert len(mesh.boundary("base")) == FANNED.count(3, 2)


def test_the_layout_left_out_is_the_one_between_lines():
    for element in SOLIDS:
        plain, named = (
            brick(*SIZES, 2, 1, 2, element=element),
            brick(*SIZES, 2, 1, 2, (1, 1, 1), element, Layout.TENSOR),
        )
        np.testing.assert_array_equal(plain.nodes, named.nodes)
        np.testing.assert_array_equal(plain.elements, named.elements)


@pytest.mark.parametrize("layout", ["fanned", None, True, Element.H8])
def test_what_is_no_layout_is_refused_by_name(layout):
    refused(lambda: brick(*SIZES, 2, 2, 2, layout=layout), "layout = .*must be a Layout")


def test_counts_and_gradings_are_refused_as_without_a_layout():
    refused(lambda: fanned((2, 0, 2)), "n_y = 0")
    refused(lambda: fanned((2, 2, 2.5)), "n_z = 2.5")
    refused(lambda: fanned((2, 2, 2), grading=(1.0, 0.0, 1.0)), "grading = 0.0")
    refused(lambda: fanned((2, 2, 2), grading=(1.0, 1.0)), "grading = .*3 numbers")
    refused(lambda: fanned((10**4, 10**4, 10**5)), "n_z = 100000: must be so few")


def test_room_is_asked_for_what_there_will_be(monkeypatch):
    """Three by three by three H8 have 27 cells between planes and 54 fanned."""
    monkeypatch.setattr(cells, "memory", lambda: 53 * cells.BYTES_A_NODE)
    assert len(brick(*SIZES, 3, 3, 3).elements) == 27
    refused(lambda: fanned((3, 3, 3)), "n_x = 3: must be so few")
