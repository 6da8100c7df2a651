"""Plots of given arrays: elements of an accepted increment in one colour each, and what is refused instead of drawn."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from bipot import Control, Element, Newton, Schedule, block, brick, march, plot, upsetting
from tests.scenes import refused


@pytest.mark.parametrize("element", [Element.Q4, Element.Q8])
def test_elements_are_drawn_from_corner_to_corner_where_they_are(element):
    last = next(
        march(
            upsetting(mu=0.1, elements=2, reduction=0.1, element=element, volume=None), Schedule(4), Control(Newton())
        )
    )
    axes, values = Figure().subplots(), np.arange(4.0)
    faces = plot.body(last, values, axes, label="number", lw=2.0)
    drawn = [path.vertices[:4] for path in faces.get_paths()]
    np.testing.assert_array_equal(drawn, last.state.nodes[last.scene.mesh.elements[:, :4]])
    np.testing.assert_array_equal(faces.get_array(), values)
    assert faces.get_linewidth() == [2.0]
    assert [one.get_ylabel() for one in axes.figure.axes] == ["", "number"]
    refused(lambda: plot.body(last, values[:-1], axes), "values")
    refused(lambda: plot.body(last, None, axes), "values = 'of type object': must be numbers")  # type: ignore[arg-type]
    refused(lambda: plot.body(None, values, axes), "accepted = None: must be an Accepted")  # type: ignore[arg-type]


def test_arrays_that_are_no_lines_in_a_plane_are_refused_by_name():
    axes, mesh, solid = Figure().subplots(), block(1.0, 1.0, 1, 1), brick(1.0, 1.0, 1.0, 1, 1, 1)
    refused(
        lambda: plot.mesh(mesh.nodes, mesh, axes), r"(?s)elements = Mesh\(.*: must be an array .*, as mesh.elements"
    )  # type: ignore[arg-type]
    refused(lambda: plot.mesh("nodes", mesh.elements, axes), "nodes = 'nodes': must be an array of positions")  # type: ignore[arg-type]
    refused(lambda: plot.mesh(solid.nodes, solid.elements, axes), "(?s)nodes = array.*of a body in a plane")
    refused(lambda: plot.boundary(mesh.nodes, "top", axes), r"edges = 'top': must be .* or mesh.boundary\(name\)")  # type: ignore[arg-type]
    refused(lambda: plot.vectors(mesh.nodes, mesh.nodes[:1], axes), r"values = 'shape \(1, 2\)': must be \(4, 2\)")
    refused(lambda: plot.vectors(mesh.nodes, "a", axes), "values = 'a': must be an array of vectors")  # type: ignore[arg-type]
    refused(lambda: plot.force_stroke(np.zeros(2), np.zeros(3), axes), r"force = 'shape \(3,\)': must be one a stroke")
