"""What faces what, and what goes through it, by hand."""

import numpy as np

from bipot.tools.pieces import crossed, pieces


def test_a_node_that_goes_through_an_edge_is_found():
    """From below an edge that runs to the left, as one of a part above: deep into it, or out on its other side."""
    nodes = np.array([[0.0, 0.0], [2.0, 0.0], [0.5, -0.3], [5.0, -0.3]])
    edges, points = np.array([[0, 1]]), np.array([2, 3])
    for up, found in ((0.31, None), (1.0, (2, [0, 1])), (9.0, (2, [0, 1]))):
        moved = nodes.copy()
        moved[2:, 1] += up
        assert crossed(nodes, moved, points, edges) == found
    # Seen from the edge that moves instead.
    moved = nodes.copy()
    moved[:2, 1] -= 1.0
    assert crossed(nodes, moved, points, edges) == (2, [0, 1])


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
