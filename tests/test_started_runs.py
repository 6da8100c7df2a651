"""A run that begins where another had come to: its step 0 is the step it goes on from, in every configuration."""

import numpy as np
import pytest

from bipot import (
    Configuration,
    Elasticity,
    FlatTool,
    Geometry,
    Linear,
    Scene,
    Schedule,
    Support,
    VonMises,
    block,
    march,
)
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.results.columns import INCREMENT

AVERAGED = ("stress", "plastic_strain", "mises", "pressure", "peeq")
TOOL = FlatTool((0.0, 2.0), (0.0, -1.0), (0.02, -0.2), ("top",), mu=0.2)


@pytest.mark.parametrize("configuration", Configuration)
def test_averages_of_step_zero_have_the_weights_of_the_step_it_goes_on_from(tmp_path, configuration):
    scene = Scene(
        mesh=block(3.0, 2.0, 4, 3),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(70_000.0, 0.33), Linear(100.0, 700.0)),
        supports=(Support("base", 0), Support("base", 1)),
        tools=(TOOL,),
        configuration=configuration,
    )
    with Recorder(tmp_path / "whole", scene, (INCREMENT,), {}, {}) as recorder:
        for accepted in march(scene, Schedule(4, first=0.05)):
            recorder.record(accepted)
    whole = open_results(tmp_path / "whole")
    with Recorder(tmp_path / "rest", scene, (INCREMENT,), {}, {}, start=whole.end):
        pass
    rest = open_results(tmp_path / "rest")
    begun, there = rest.at(rest.times[0], by="tau"), whole.snapshot()
    assert np.ptp(there.cell("peeq")) > 0.01
    for name in AVERAGED:
        np.testing.assert_array_equal(begun.cell(name), there.cell(name), err_msg=name)
        np.testing.assert_array_equal(begun.nodal(name), there.nodal(name), err_msg=name)
