"""Scenes made to deceive: held nodes in a tool's way, bodies in parts, open axes, tools that have no part in it."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.errors import IncrementFailed, SceneError
from bipot.fem.kinematics import Geometry
from bipot.forms import Dissipation, Newton, Tangent
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity
from bipot.march import Control, Schedule, march
from bipot.mesh import Mesh, block
from bipot.scene import FlatTool, Material, Scene, Support, upsetting

STEEL = Material(Elasticity(210e3, 0.3), Perfect(300.0))
PUNCH = FlatTool(point=(0.0, 10.0), normal=(0.0, -1.0), travel=(0.0, -1.0), candidates=("top",), mu=0.1)


def pressed(*supports: Support, punch: FlatTool = PUNCH) -> Scene:
    return Scene(block(10.0, 10.0, 2, 2), Geometry.PLANE_STRAIN, STEEL, supports, (punch,))


@pytest.mark.parametrize("form", [Tangent(), Dissipation(), Newton()], ids=lambda form: form.name.value)
def test_a_punch_does_not_pass_through_a_held_node(form):
    """The corner is held, so it is no unknown of the contacts; it is in the punch's way all the same."""
    scene = pressed(Support("base", 1), Support("left", 0), Support("right", 1))
    with pytest.raises(IncrementFailed, match=r"tools\[0\] is driven into node \d+, which a support holds"):
        list(march(scene, Schedule(2), Control(form, (), cuts=1)))


def test_a_punch_that_stays_away_from_held_nodes_presses():
    """The held corner is touched when the increment ends, and not entered."""
    punch = replace(PUNCH, point=(0.0, 10.1), travel=(0.0, -0.1))
    scene = pressed(Support("base", 1), Support("left", 0), Support("right", 1), punch=punch)
    *_, last = march(scene, Schedule(2))
    assert max(last.solved.certificate.ratios(Bounds()).values()) <= 1


def test_a_held_node_inside_a_tool_is_measured():
    """Where nothing is asked, the penetration is still told."""
    scene = pressed(Support("base", 1), Support("left", 0), Support("right", 1))
    accepted = next(march(scene, Schedule(2), Control(limits=replace(Control().limits, bounds=Bounds.none()))))
    assert accepted.solved.certificate.penetration == pytest.approx(0.05)


@pytest.mark.parametrize("shift", [(20.0, 0.0), (10.0, 10.0)], ids=["apart", "by a corner"])
def test_a_mesh_of_several_parts_is_refused(shift):
    """What holds the first part leaves the second where it likes, and no test of the whole body's motions sees it."""
    one = block(10.0, 10.0, 2, 2)
    nodes, elements = (
        np.vstack([one.nodes, one.nodes + shift]),
        np.vstack([one.elements, one.elements + len(one.nodes)]),
    )
    _, first, which = np.unique(nodes, axis=0, return_index=True, return_inverse=True)
    with pytest.raises(SceneError, match="one body: element 4 shares no edge"):
        Mesh(nodes[first], which.ravel()[elements])


@pytest.mark.parametrize("geometry", [Geometry.AXISYMMETRIC])
def test_an_axis_that_may_open_is_refused(geometry):
    """A displacement across the axis that is not zero there has no finite hoop strain.

    Two cones pressed into a disc opened a hole there, with a half to a sixth of the force.
    """
    scene = upsetting(mu=0.3, elements=2)
    with pytest.raises(SceneError, match=r"node \d+ on the axis"):
        replace(scene, supports=(Support("base", 1),))
    block_ = block(10.0, 10.0, 1, 1)
    punch = replace(PUNCH, travel=(0.0, -0.1))
    with pytest.raises(SceneError, match=r"node \d+ on the axis"):
        Scene(block_, geometry, STEEL, (Support("base", 1),), (punch,))
    assert Scene(block_, Geometry.PLANE_STRAIN, STEEL, (Support("base", 1),), (punch,))


@pytest.mark.parametrize("travel", [1e3, 1e9, 1e15])
def test_a_tool_that_has_no_part_in_it_changes_nothing(travel):
    """Scales, round-off and units are of the tools that may be touched, not of one that runs far away."""
    scene, schedule = upsetting(mu=0.3, elements=2, reduction=0.01), Schedule(2, first=0.05, settling=1)
    away = FlatTool((0.0, 1e20), (0.0, -1.0), (0.0, -travel), ("top",), 0.0)
    alone = list(march(scene, schedule))
    with_it = list(march(replace(scene, tools=(*scene.tools, away)), schedule))
    assert len(with_it) == len(alone)
    for a, b in zip(alone, with_it, strict=True):
        assert b.solved.certificate.below_resolution(Bounds()) == ()
        np.testing.assert_allclose(b.state.forces[: len(a.state.forces)], a.state.forces, atol=1e-5 * 3e4)
        assert b.unique == a.unique


def test_a_path_that_does_not_begin_where_the_tool_is_is_refused():
    """The point says where the tool is at the start: a first multiple other than zero would say something else."""
    with pytest.raises(SceneError, match="path"):
        replace(PUNCH, path=((0.0, 1.0), (1.0, 2.0)))


def test_a_body_far_from_the_origin_is_refused():
    """At 1e11 sizes from it positions keep four digits of the body: forces were off by 5e-5, and nothing said so."""
    one = block(10.0, 10.0, 2, 2)
    assert Mesh(one.nodes + 1e6, one.elements, one.boundaries).size == 10.0
    with pytest.raises(SceneError, match="of the origin"):
        Mesh(one.nodes + 1e12, one.elements, one.boundaries)
