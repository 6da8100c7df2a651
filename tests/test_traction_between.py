"""Recovered tractions at deformable tools that end a little beyond a node of the candidates."""

import numpy as np
import pytest

from bipot import (
    Control,
    DeformableTool,
    Element,
    Geometry,
    Newton,
    Prescribed,
    Scene,
    Schedule,
    Support,
    block,
    march,
    together,
)
from bipot.system import system_of
from bipot.traction import multipliers, tractions
from tests.deformable import ELASTIC, STEEL, shifted


def beyond(by, element=Element.Q4, **friction):
    """A block whose ends are ``by`` beyond two nodes of a longer one, which it presses."""
    low, up = block(3.0, 1.0, 3, 2, element=element), block(1.0 + 2 * by, 0.5, 2, 1, element=element)
    mesh = together({"low": low, "up": shifted(up, 1.0 - by, 1.0)})
    held = Support("low/base", 0), Support("low/base", 1), Support("up/top", 0), Prescribed("up/top", 1, -0.002)
    tools = (DeformableTool(("up/base",), ("low/top",), **{"mu": 0.2, **friction}),)
    return Scene(mesh, Geometry.PLANE_STRAIN, STEEL, held, tools, regions={"up": ELASTIC})


def faced_part(candidates):
    (points,) = candidates.points
    assert points.faced is not None
    return points.faced.part


def areas(candidates, nodes):
    """Of straight sides, int psi_p dA (c,) over the part that faces the tool."""
    (points,) = candidates.points
    ends = nodes[points.facets]
    half = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2
    return faced_part(candidates) * np.bincount(points.point.ravel(), np.repeat(half, 2))


@pytest.mark.parametrize("by", [0.08, 0.1])
def test_a_point_of_which_a_sliver_faces_the_tool_has_the_traction_beside_it(by):
    """Its force is over an area that is as small as one likes; tractions still have the forces' resultant."""
    (accepted,) = march(beyond(by, Element.Q8), Schedule(1), Control(Newton(), ()))
    candidates, nodes = accepted.solved.iterate.increment.system.candidates, accepted.solved.iterate.balanced
    found, r = accepted.traction, accepted.state.forces
    part = faced_part(candidates)
    few = (part > 0) & (part < 0.05)
    assert few.sum() == 2
    assert r[few, 0].max() > 0.01 * r[:, 0].max()
    # The mean is the resultant, over a width of one.
    assert np.nanmax(found.recovered_pressure) < 2 * r[:, 0].sum()
    assert (abs(found.recovered_shear[few]) <= 0.2 * found.recovered_pressure[few]).all()
    sums = areas(candidates, nodes) @ multipliers(candidates, 0, nodes, r)
    np.testing.assert_allclose(sums, r.sum(axis=0), rtol=1e-9, atol=1e-9 * r.max())


def test_what_is_added_up_has_the_limit_of_all_of_it():
    """All points slide, at one of two beside each other with half the friction; what is open has no traction."""
    scene = beyond(0.01)
    node = int(system_of(scene).candidates.node[2])
    scene = beyond(0.01, mu_at={node: 0.1})
    candidates, nodes = system_of(scene).candidates, scene.mesh.nodes
    area = areas(candidates, nodes)
    r = np.stack([area, candidates.mu * area], axis=1)
    r[0] = 0.0
    pressure, shear = tractions(candidates, nodes, r, r[:, 0] > 0)
    np.testing.assert_allclose(pressure, [0.0, 1.0, 1.0, 1.0], rtol=1e-12)
    whole = (r[2, 1] + r[3, 1]) / (area[2] + area[3])
    np.testing.assert_allclose(shear, [0.0, 0.2, whole, whole], rtol=1e-12)


def test_a_contact_within_one_edge_has_its_own_traction():
    scene = beyond(-0.495)
    candidates, nodes = system_of(scene).candidates, scene.mesh.nodes
    area = areas(candidates, nodes)
    r = np.zeros((4, 2))
    r[:, 0] = 7.0 * area
    np.testing.assert_allclose(faced_part(candidates)[1:3], 0.005)
    np.testing.assert_allclose(multipliers(candidates, 0, nodes, r)[1:3, 0], 7.0)
