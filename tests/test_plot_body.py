"""Elements of an accepted increment in one colour each."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from bipot import Control, Element, Newton, Schedule, march, plot, upsetting
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
