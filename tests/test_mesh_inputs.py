"""Meshes that once changed the model in silence are converted, or refused by name."""

import pickle

import numpy as np
import pytest

from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from bipot.scene.loads import PointForce, Pressure, Traction
from bipot.scene.supports import Support
from tests.scenes import refused, scene, tool


def renumbered(mesh, **changes):
    return Mesh(**({"nodes": mesh.nodes, "elements": mesh.elements, "boundaries": mesh.boundaries} | changes))


SQUARE = block(1.0, 1.0, 2, 2, element=Element.Q8)


def as_meshers(edges):
    """End, end, middle."""
    return edges[:, [0, 2, 1]]


@pytest.mark.parametrize("order", [(0, 2, 1), (2, 0, 1), (1, 0, 2), (2, 1, 0)])
def test_edges_in_the_order_of_mesh_files_are_converted(order):
    """Taken for end, middle, end they gave pressures of -198 to 1025 where 226 to 431 is right."""
    mesh = renumbered(SQUARE, boundaries={name: edges[:, list(order)] for name, edges in SQUARE.boundaries.items()})
    for name, edges in SQUARE.boundaries.items():
        assert {frozenset(edge) for edge in edges.tolist()} == {frozenset(e) for e in mesh.boundary(name).tolist()}
        np.testing.assert_array_equal(mesh.boundary(name)[:, 1], edges[:, 1])


@pytest.mark.parametrize("kind", [np.uint64, np.uint8, np.int32, np.int64])
def test_node_numbers_of_any_integer_type_give_one_mesh(kind):
    mesh = renumbered(
        SQUARE,
        elements=SQUARE.elements.astype(kind),
        boundaries={name: edges.astype(kind) for name, edges in SQUARE.boundaries.items()},
    )
    assert mesh.elements.dtype == np.intp
    assert mesh.boundary_nodes("top", "left").dtype == np.intp
    np.testing.assert_array_equal(scene(mesh=mesh).holding.held, scene().holding.held)


def doubled():
    return np.vstack([SQUARE.elements, SQUARE.elements[1:2]])


def turned():
    """A second time the same element, its nodes numbered from another corner."""
    return np.vstack([SQUARE.elements, SQUARE.elements[1:2][:, [1, 2, 3, 0, 5, 6, 7, 4]]])


def with_node(x=0.5, y=2.0):
    return np.vstack([SQUARE.nodes, [x, y]])


def overlapping():
    """A ninth of the nodes more: a larger element laid over the first along their common edge."""
    nodes, first = SQUARE.nodes, SQUARE.elements[0]
    far = nodes[first[[2, 3, 5, 6, 7]]] + [0.1, 0.2]
    new = np.arange(len(nodes), len(nodes) + 5)
    over = [first[0], first[1], new[0], new[1], first[4], new[2], new[3], new[4]]
    return {"nodes": np.vstack([nodes, far]), "elements": np.vstack([SQUARE.elements, over])}


def unmerged():
    """Two elements of one edge, each with a mid-side node of its own where only one is on it."""
    wide = block(2.0, 1.0, 1, 1, element=Element.Q8)
    nodes = np.vstack([wide.nodes, [[0.5, -1], [1.0, -1], [0.0, -1], [0.0, -0.5], [1.0, -0.5], [0.5, 0.0]]])
    a, b = wide.elements[0][:2]
    mid, k = wide.elements[0][4], len(wide.nodes)
    lower = [k + 2, k + 1, mid, a, k, k + 4, k + 5, k + 3]
    assert b != mid
    return {"nodes": nodes, "elements": np.vstack([wide.elements, lower]), "boundaries": {}}


TOP = SQUARE.boundary("top")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"elements": doubled()}, r"mesh.elements = 'element \[4\]': must be there once"),
        ({"elements": turned()}, r"mesh.elements = 'element \[4\]': must be there once"),
        (overlapping(), "mesh.elements = 'edge .*': must be of one element a side"),
        (unmerged(), "mesh.elements = 'mid-side node .*': must be on one edge, and no corner"),
        ({"elements": np.zeros((1, 8), int)}, "of 8 different nodes"),
        ({"nodes": with_node()}, r"mesh.nodes = 'node \[21\]': must be a node of an element"),
        ({"nodes": with_node(), "boundaries": {"top": [[0, 21, 1]]}}, r"mesh.nodes = 'node \[21\]'"),
        ({"elements": SQUARE.elements.astype(float)}, "mesh.elements node index = 'of type float64'"),
        ({"elements": SQUARE.elements[:, :4]}, r"mesh.nodes = 'node \[9\]': must be a node of an element"),
        ({"elements": SQUARE.elements[:, :7]}, r"mesh.elements = .*\(4, 7\).*of shape \(n, 3\): T3, .*\(n, 9\): Q9"),
        ({"elements": SQUARE.elements - 1}, r"mesh.elements node index = \[-1\]"),
        ({"nodes": SQUARE.nodes[:, :1]}, r"mesh.nodes = .*\(21, 1\).*numbers of shape .* in a plane"),
        ({"nodes": np.full((21, 2), "a")}, "mesh.nodes"),
        ({"boundaries": {"top": TOP.astype(float)}}, "mesh boundary 'top' node index = 'of type float64'"),
        ({"boundaries": {"top": TOP[:, :2]}}, "mesh boundary 'top' = 'shape"),
        ({"boundaries": {"top": np.vstack([TOP, TOP[:1]])}}, "mesh boundary 'top' = 'an edge twice'"),
        ({"boundaries": {"top": np.vstack([TOP, TOP[:1, [2, 1, 0]]])}}, "mesh boundary 'top' = 'an edge twice'"),
        ({"boundaries": {"top": SQUARE.elements[:1, :3]}}, "must be the nodes of one edge of an element"),
        ({"boundaries": {1: TOP}}, "mesh.boundaries, a name = 1: must be a str"),
        ({"boundaries": [1]}, "mesh.boundaries = .*: must be a Mapping"),
    ],
)
def test_meshes_that_are_none_are_refused_by_name(changes, words):
    refused(lambda: renumbered(SQUARE, **changes), words)


@pytest.mark.parametrize("name", [[], None, 1, {}])
def test_names_of_boundaries_that_are_no_strings_are_refused(name):
    for asked in (SQUARE.boundary, SQUARE.boundary_nodes, SQUARE.edges, SQUARE.surface):
        refused(lambda asked=asked: asked(name), "boundary = .*: must be a str")


def test_no_boundary_at_all_is_refused():
    for asked in (SQUARE.boundary_nodes, SQUARE.edges, SQUARE.owners):
        refused(asked, r"boundaries = \(\): must be at least one name")


def test_a_mesh_cannot_be_changed_and_does_not_follow_what_it_was_made_of():
    nodes, edges = SQUARE.nodes.copy(), {"top": TOP.copy()}
    mesh = Mesh(nodes, SQUARE.elements, edges)
    nodes[:] = 0.0
    edges["top"][:] = 0
    edges["side"] = TOP
    np.testing.assert_array_equal(mesh.nodes, SQUARE.nodes)
    np.testing.assert_array_equal(mesh.boundary("top"), TOP)
    assert list(mesh.boundaries) == ["top"]
    for array in (mesh.nodes, mesh.elements, mesh.boundary("top"), scene().holding.held):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(TypeError):
        mesh.boundaries["top"] = TOP
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(mesh)).boundary("top"), TOP)


def inner_edge(mesh):
    """One edge between two elements, as end, middle, end."""
    first, second = mesh.elements[:2]
    for k in range(4):
        edge = [first[k], first[4 + k], first[(k + 1) % 4]]
        if np.isin(edge, second).all():
            return np.array([edge])
    raise AssertionError


def test_a_tool_may_not_touch_an_edge_inside_the_body_nor_one_edge_by_two_names():
    edges = dict(SQUARE.boundaries)
    inside = renumbered(SQUARE, boundaries=edges | {"inside": inner_edge(SQUARE)})
    refused(lambda: scene(mesh=inside, tools=(tool(candidates=("top", "inside")),)), "lies between two")
    again = renumbered(SQUARE, boundaries=edges | {"lid": TOP[:1]})
    refused(lambda: scene(mesh=again, tools=(tool(candidates=("top", "lid")),)), "boundaries without a common edge")
    assert scene(mesh=inside, supports=(Support("inside", 1),)).holding.numbers.size == 3


@pytest.mark.parametrize(
    ("load", "field"),
    [(Traction("inside", (0.0, 1.0)), r"traction\.boundary"), (Pressure("inside", 1.0), r"pressure\.boundary")],
)
def test_a_load_may_not_act_on_an_edge_inside_the_body(load, field):
    """It would act on one of two elements, or on both."""
    inside = renumbered(SQUARE, boundaries=dict(SQUARE.boundaries) | {"inside": inner_edge(SQUARE)})
    refused(lambda: scene(mesh=inside, loads=(load,)), rf"{field}.*lies between two")


def test_the_first_number_beyond_the_nodes_is_no_node():
    assert scene(loads=(PointForce(len(SQUARE.nodes) - 1, (0.0, 1.0)),)).loads
    refused(lambda: scene(loads=(PointForce(len(SQUARE.nodes), (0.0, 1.0)),)), r"point force\.node")


def test_a_masked_coordinate_is_refused():
    mesh = block(1.0, 1.0, 1, 1)
    nodes = np.ma.masked_array(mesh.nodes, mask=mesh.nodes == 1.0)
    refused(lambda: Mesh(nodes, mesh.elements), r"mesh.nodes = 'with masked values'")
