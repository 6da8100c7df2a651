"""A run that begins where another had come to: its step 0 is the step it goes on from, in every configuration."""

import numpy as np
import pytest
from matplotlib.figure import Figure

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
    plot,
)
from bipot.errors import ResultsError
from bipot.hdf5 import journal
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.results.columns import INCREMENT
from tests.recording import recorder

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
        for accepted in march(scene, Schedule(4, first=0.05, settling=1, growth=4.0)):
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


def test_increments_are_called_by_their_numbers_in_the_march(tmp_path, marched, monkeypatch):
    with recorder(tmp_path / "run", start=marched[3].course) as out:
        out.record(marched[4])
        assert out.on_disk == 5
        out.record(marched[5])
        monkeypatch.setattr(journal, "_put", full)
        with pytest.raises(ResultsError, match="increments up to 6 are recorded; make room"):
            out.record(marched[6])
    run = open_results(tmp_path / "run")
    assert (len(run), run["increment"].tolist()) == (2, [5, 6])
    ax = Figure().add_subplot()
    plot.contour(run, "mises", ax=ax)
    assert ax.get_title().startswith("increment 6, reduction")


def test_a_picture_of_a_start_that_carries_forces_does_not_say_that_nothing_touches(tmp_path, marched):
    with recorder(tmp_path / "run", start=marched[3].course) as out:
        out.record(marched[4])
    run = open_results(tmp_path / "run")
    begun = run.at(run.times[0], by="tau")
    assert np.abs(begun.nodal("contact_force")).max() > 1.0
    ax = Figure().add_subplot()
    plot.contact_traction(run, begun.tau, ax, by="tau")
    assert [text.get_text() for text in ax.texts] == ["tractions of the start are not known"]


def full(*_):
    """What a full disk says."""
    raise OSError(28, "No space left on device")
