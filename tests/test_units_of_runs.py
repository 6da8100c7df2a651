"""Units of runs: no unit of stress may overflow single precision; forces of plane strain are per unit of thickness."""

import numpy as np
import pytest
from matplotlib import pyplot

from bipot import (
    Elasticity,
    FlatTool,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    Support,
    VonMises,
    block,
    cylinder,
    march,
    plot,
)
from bipot.command import info
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


@pytest.mark.parametrize(
    ("geometry", "unit"), [(Geometry.PLANE_STRAIN, "N per mm of thickness"), (Geometry.AXISYMMETRIC, "N")]
)
def test_forces_of_plane_strain_are_per_unit_of_thickness(tmp_path, geometry, unit):
    """A strip of width 2 under a stress of 50 carries 100 per unit of thickness, of whatever thickness."""
    flat = geometry is Geometry.PLANE_STRAIN
    scene = Scene(
        mesh=(block if flat else cylinder)(2.0, 1.0, 2, 2),
        geometry=geometry,
        material=VonMises(Elasticity(1e4, 0.0), Perfect(1e3)),
        supports=(Support("left" if flat else "axis", 0), Support("base", 1)),
        tools=(FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.005), ("top",), mu=0.0),),
    )
    with Recorder(tmp_path, scene, (INCREMENT,), {}, {"length": "mm", "force": "N"}) as recorder:
        for accepted in march(scene, Schedule(1)):
            recorder.record(accepted)
    run = open_results(tmp_path)
    area = 2.0 if flat else 4 * np.pi
    assert run.nodal("contact_force_y" if flat else "contact_force_z").sum() == pytest.approx(-50 * area, rel=0.02)
    told = run.fields["nodes"]
    assert [told[name]["unit"] for name in ("contact_force", "contact_pressure")] == [unit, "N/mm^2"]
    assert f"contact_force     {unit}: " in info(run)
    _, ax = pyplot.subplots()
    plot.contour(run, "contact_force", ax=ax)
    assert ax.figure.axes[1].get_ylabel() == f"|contact_force| ({unit})"
    pyplot.close()
