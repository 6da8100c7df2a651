"""The figure of the upset block, from runs of its study: what it shows is what they hold."""

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.quiver import Quiver

from bipot.laws.coulomb import Status
from bipot.results import open as open_results
from paper_figs import fig_block
from studies import block

MUS = ("0.1", "0.3")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    out = tmp_path_factory.mktemp("block")
    asked = ["--elements", "3", "--increments", "4", "--reduction", "0.2", "--mu", *MUS]
    assert block.main([*asked, "--out", str(out)]) == 0
    return out


def test_pressures_slips_and_sticking_nodes_are_those_of_the_runs(results):
    (figure,) = fig_block.figures(results).values()
    *panels, bar = figure.axes
    assert [ax.get_title()[:3] for ax in panels] == ["(a)", "(b)", "(c)", "(d)"]
    largest = 0.0
    for mu, ax in zip(MUS, panels[1::2], strict=True):
        step = open_results(results / f"mu{mu}").at()
        pressure, status = step.nodal("contact_pressure"), step.nodal("status")
        largest = max(largest, np.nanmax(pressure))
        carried = step.nodal("contact_force")[:, 2] < 0
        (arrows,) = [one for one in ax.collections if isinstance(one, Quiver)]
        assert arrows.N == (carried & (status == Status.SLIP)).sum() > 0
        slips = np.column_stack([arrows.U, arrows.V])
        assert (np.vecdot(slips, arrows.XY) > 0).any()
        np.testing.assert_allclose(arrows.XY, step.nodes[carried & (status == Status.SLIP), :2])
        stuck, _ = ax.lines
        assert len(stuck.get_xdata()) == (carried & (status == Status.STICK)).sum()
        limits = np.array([ax.get_xlim(), ax.get_ylim()])
        ends = arrows.XY + slips
        assert (ends > limits[:, 0]).all()
        assert (ends < limits[:, 1]).all()
    assert bar.get_ylim() == pytest.approx((0.0, largest))
    assert "MPa" in bar.get_ylabel()
    pyplot.close("all")


@pytest.mark.slow
def test_it_is_written_and_says_what_is_missing(results, tmp_path):
    fig_block.main(["--results", str(results), "--out", str(tmp_path)])
    assert {path.suffix for path in tmp_path.iterdir()} == {".png", ".pdf"}
    with pytest.raises(SystemExit, match=r"no results; run: python -m studies\.block"):
        fig_block.main(["--results", str(tmp_path)])
