"""Averages at nodes have single precision, whose range is not that of stresses: no unit may lose or overflow them."""

import numpy as np
import pytest

from bipot import Elasticity, FlatTool, Geometry, Perfect, Scene, Schedule, Support, VonMises, block, march
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.results.columns import INCREMENT


@pytest.mark.parametrize("young", [1e-50, 1e-21, 1e-19, 1e3, 1e19, 1e21, 1e50])
def test_averages_at_nodes_are_the_same_in_every_unit_of_stress(tmp_path, young):
    """A block that is compressed evenly, whose equivalent stress is its yield stress at every node."""
    scene = Scene(
        mesh=block(1.0, 1.0, 2, 2),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(young, 0.3), Perfect(1e-3 * young)),
        supports=(Support("left", 0), Support("base", 1)),
        tools=(FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.01), ("top",), mu=0.0),),
    )
    with Recorder(tmp_path, scene, (INCREMENT,), {}, {}) as recorder:
        for accepted in march(scene, Schedule(2)):
            recorder.record(accepted)
    run = open_results(tmp_path)
    np.testing.assert_allclose(run.nodal("mises") / young, 1e-3, rtol=1e-6)
    np.testing.assert_allclose(run.nodal("stress_zz") / run.cell("stress_zz")[0], 1.0, rtol=1e-6)
    assert run.nodal("pressure").min() > 0
