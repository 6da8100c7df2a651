"""What faces what, and what goes through it, by hand."""

import numpy as np
import pytest

from bipot import block, brick
from bipot.tools.facing import Sides
from bipot.tools.passing import crossed
from bipot.tools.pieces import pieces
from bipot.tools.polygons import polygons
from tests.deformable import bulging
from tests.scenes import refused


def test_a_node_that_goes_through_an_edge_is_found():
    """From below an edge that runs to the left, as one of a part above: deep into it, or out on its other side."""
    nodes = np.array([[0.0, 0.0], [2.0, 0.0], [0.5, -0.3], [5.0, -0.3]])
    edges, points = np.array([[0, 1]]), np.array([2, 3])
    for up, found in ((0.31, None), (1.0, (2, [0, 1])), (9.0, (2, [0, 1]))):
        moved = nodes.copy()
        moved[2:, 1] += up
        assert crossed(nodes, moved, points, edges, np.array([np.inf])) == found
    # Seen from the edge that moves instead.
    moved = nodes.copy()
    moved[:2, 1] -= 1.0
    assert crossed(nodes, moved, points, edges, np.array([np.inf])) == (2, [0, 1])


def test_what_is_behind_another_edge_faces_nothing():
    """Of two edges over the same place the nearer counts, piece by piece."""
    nodes = np.array([[1.0, 0.0], [0.0, 0.0], [0.3, 0.1], [0.6, 0.1], [-1.0, 0.5], [2.0, 0.5], [0.0, -0.1], [1.0, 0.3]])
    one, near, far = np.array([[0, 1]]), [2, 3], [4, 5]
    found = pieces(nodes, one, np.array([near, far]), False)
    length = np.zeros(2)
    np.add.at(length, found.other, found.weight.sum(axis=1))
    np.testing.assert_allclose(length, [0.3, 0.7])
    np.testing.assert_allclose(found.lowest, np.where(found.other == 0, 0.1, 0.5))
    inclined = pieces(nodes, one, np.array([[6, 7]]), False)
    np.testing.assert_allclose(inclined.lowest, [-0.1])


def test_a_place_that_touches_the_other_side_of_a_corner_is_not_deep_in_this_one():
    """Along the normal of a side that leans, the tool that is in touch with the top is far inside of the part.

    In space the sides are a unit wide.
    """
    corners = np.array([[1.14, 0.0], [1.0, 1.0], [0.0, 0.865], [-1.0, 0.85], [0.2, 0.864], [-1.0, 0.84]])
    one, other = np.array([[0, 1], [1, 2], [2, 3]]), np.array([[5, 4]])

    def wide(edges):
        return np.stack(
            [np.insert(corners[edges[:, k]], 1, y, axis=1) for k, y in ((0, 0), (0, 1), (1, 1), (1, 0))], axis=1
        )

    for found in (pieces(corners, one, other, False), polygons(wide(one), wide(other))):
        assert np.unique(found.one).tolist() == [1, 2]
        assert found.lowest.min() > -0.03


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_side_that_turns_by_60_degrees_has_one_point_there_however_it_lies(dimension):
    """Round-off decided: a wedge in a groove bore another force in other units, and in a mirror."""
    mesh = block(2.0, 1.0, 2, 1) if dimension == 2 else brick(2.0, 1.0, 1.0, 2, 1, 1)
    x = mesh.nodes.copy()
    x[:, -1] -= np.abs(x[:, 0] - 1.0) / np.sqrt(3.0)
    top = mesh.around("top")
    for turn in np.linspace(0.0, 1.0, 20):
        c, s = np.cos(turn), np.sin(turn)
        turned = x.copy()
        turned[:, [0, -1]] = x[:, [0, -1]] @ np.array([[c, s], [-s, c]])
        assert len(Sides.of(turned, top, top).node) == 3 * 2 ** (dimension - 2)


def test_sides_that_are_deep_in_each_other_at_rest_are_refused():
    """The middle of an arc is in the edge below it, beside means that are both open."""
    refused(lambda: bulging(0.06), r"not 0\.02 in it beside nodes")
