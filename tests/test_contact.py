"""From geometry to contact operators, and the contact patch test."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.conic.through_cvxpy import Cvxpy
from bipot.contact.chosen import candidates
from bipot.contact.closeness import LEAST_MOTION, NEAR, REACH, TOUCHES, carries, near_tools, touches
from bipot.fem.reduction import Geometry
from bipot.forms import Tangent
from bipot.increment import Limits
from bipot.iterate import Increment
from bipot.laws.coulomb import CARRIES
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.paper import upsetting
from bipot.response import body_space
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.tool import FlatTool
from tests.scenes import DIRECT, fresh, path, rows_between

TIGHT = Control(DIRECT, limits=Limits(Bounds(equilibrium=1e-11)))


def test_candidates_are_top_and_side_without_the_held_base_node():
    system = fresh(0.3, elements=3)
    mesh = system.body.scene.mesh
    expected = np.setdiff1d(mesh.boundary_nodes("top", "side"), mesh.boundary_nodes("base"))
    np.testing.assert_array_equal(system.candidates.node, expected)


def test_friction_rows_only_where_the_tangent_is_free():
    """The axis node cannot slip; without friction there are no rows at all."""
    system = fresh(0.3, elements=3)
    rows = rows_between(system.candidates, system.rest().gap, 0.0, 0.1)
    mesh = system.body.scene.mesh
    axis = np.isin(system.candidates.node, mesh.boundary_nodes("axis"))
    np.testing.assert_array_equal(rows.frictional, np.flatnonzero(~axis))
    smooth = fresh(0.0, elements=3)
    assert rows_between(smooth.candidates, smooth.rest().gap, 0.0, 0.1).G_t.shape[0] == 0


def test_gap_and_slip_operators_measure_the_motion():
    """Gap and slip of a random displacement equal those of the moved nodes against the moved tool."""
    rng = np.random.default_rng(0)
    c, s = np.cos(0.4), np.sin(0.4)
    tool = FlatTool((0.2, 1.1), (-s, -c), (0.05, -0.1), ("top",), 0.3)
    scene = block_scene((tool,))
    space_ = body_space(scene)
    points = candidates(scene, space_)
    rows = rows_between(points, points.distance(scene.mesh.nodes, scene.travel(0.0, 0.25)), 0.25, 0.75)
    x = rng.normal(size=space_.size) * 0.01
    moved = (scene.mesh.nodes + space_.spread(x))[points.node]
    plane = np.array(tool.point) + 0.75 * np.array(tool.travel)
    normal, tangent = np.array(tool.normal), np.array([tool.normal[1], -tool.normal[0]])
    motion = rows.motion(x)
    np.testing.assert_allclose(motion[:, 0], (moved - plane) @ normal, atol=1e-15)
    slip = (space_.spread(x)[points.node] - 0.5 * np.array(tool.travel)) @ tangent
    np.testing.assert_allclose(motion[:, 1], slip, atol=1e-15)
    work = rng.normal(size=motion.shape)
    virtual = rows.motion(2 * x) - motion
    assert rows.forces(work) @ x == pytest.approx(float(np.sum(work * virtual)))


def test_welded_points_are_tied_while_touching_and_frictionless_before():
    system = fresh(np.inf, elements=3)
    mesh = system.body.scene.mesh
    rows = rows_between(system.candidates, system.rest().gap, 0.0, 0.1)
    on_top = np.isin(system.candidates.node, mesh.boundary_nodes("top"))
    np.testing.assert_array_equal(rows.tied, on_top)
    assert set(rows.frictional) <= set(np.flatnonzero(on_top))
    assert np.all(np.isinf(rows.threshold(np.zeros((rows.count, 2)))))


def test_forces_on_the_tools_are_dual_to_their_travel():
    """A tool that travels by d changes gaps and slips: the forces' work on that is minus its force times d."""
    rng = np.random.default_rng(1)
    tools = [FlatTool((0.2, 1.1), (-np.sin(a), -np.cos(a)), (0.05, -0.1), ("top",), 0.3) for a in (0.4, -0.7)]
    still = [replace(tool, travel=(0.0, 0.0)) for tool in tools]
    scene = block_scene(tuple(tools))
    points, resting = (system_of(replace(scene, tools=tuple(t))).candidates for t in (tools, still))
    r = rng.normal(size=(len(points.node), 2))
    gap, x = points.distance(scene.mesh.nodes, scene.travel(0.0, 0.25)), rng.normal(size=points.space.size)
    moved, stayed = (rows_between(c, gap, 0.25, 0.75).motion(x) for c in (points, resting))
    forces, travel = points.sums(points.vectors(r)), scene.travel(0.25, 0.75)
    np.testing.assert_allclose(travel, np.tile([0.025, -0.05], (2, 1)), rtol=1e-14)
    for k in range(2):
        mine = points.tool == k
        assert np.vdot(r[mine], (moved - stayed)[mine]) == pytest.approx(-forces[k] @ travel[k], rel=1e-12)
    np.testing.assert_allclose(points.vectors(r).sum(axis=0), forces.sum(axis=0), rtol=1e-12)


def test_a_tool_far_from_the_body_is_no_scale():
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.1), ("top",), 0.3)
    far = replace(tool, point=(0.0, 1.0 + 1.01 * REACH * 2.0), travel=(0.0, 7.0))
    for tools, expected in (((tool, far), 0.1), ((far, tool), 0.1), ((far,), 0.0)):
        scene = block_scene(tools)
        system = system_of(scene)
        increment = Increment(system, system.rest(), 1.0)
        x = np.full(system.body.space.size, 1e-3)
        assert increment.reach == pytest.approx(expected)
        assert increment.at(x).length == pytest.approx(expected or np.sqrt(2) * 1e-3)
        assert increment.at(0 * x).length == pytest.approx(expected or LEAST_MOTION * 2.0)


def test_what_is_closed_and_what_is_near():
    r = np.array([[3.0, 4.0], [6 * CARRIES, 0.0], [4 * CARRIES, 1.0], [0.0, 0.0]])
    assert carries(r).tolist() == [True, True, False, False]
    assert carries(r, noise=1.0).tolist() == [True, False, False, False]
    assert not carries(np.zeros((2, 2))).any()
    assert touches(np.array([-1.0, 1.9 * TOUCHES, 2.1 * TOUCHES]), 2.0).tolist() == [True, True, False]
    scene = block_scene((FlatTool((0.0, 1.2), (0.6, -0.8), (0.0, -0.1), ("top",), 0.3),))
    points = system_of(scene).candidates
    rows = rows_between(points, points.distance(scene.mesh.nodes, scene.travel(0.0, 0.0)), 0.0, 1.0)
    x = np.zeros(points.space.size)
    order = np.sort(rows.gap)
    assert near_tools(rows, x, order[2] / NEAR).sum() == 3
    assert near_tools(rows, x, 0.0).sum() == 1
    tied = replace(rows, tied=rows.gap == order[-1])
    assert near_tools(tied, x, 0.0).sum() == 2


def block_scene(tools, poisson=0.3):
    return Scene(
        block(2.0, 1.0, 3, 2, element=Element.Q8),
        Geometry.PLANE_STRAIN,
        VonMises(Elasticity(1000.0, poisson), Perfect(1e6)),
        (Support("left", 0), Support("base", 1)),
        tools,
    )


def test_contact_patch_uniform_pressure_is_transmitted_exactly():
    """A flat frictionless tool on an elastic block: uniaxial stress under plane strain, the same at every point."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.002), ("top",), 0.0)
    (accepted,) = march(block_scene((tool,)), Schedule(1), TIGHT)
    stress = accepted.state.stress
    np.testing.assert_allclose(stress, np.broadcast_to(stress[0, 0], stress.shape), atol=1e-8)
    assert stress[0, 0, 0] == pytest.approx(0.0, abs=1e-8)
    log = np.log(1 - 0.002)
    assert stress[0, 0, 1] == pytest.approx(1000 / (1 - 0.09) * log, rel=1e-5)
    assert accepted.solved.r[:, 0].sum() == pytest.approx(-stress[0, 0, 1] * accepted.state.nodes[:, 0].max())


def test_a_nodes_forces_follow_the_consistent_weights_of_the_patch():
    """Uniform pressure on quadratic edges: 1/6, 2/3, 1/6 of each edge's load."""
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.002), ("top",), 0.0)
    scene = block_scene((tool,))
    (accepted,) = march(scene, Schedule(1), TIGHT)
    points = system_of(scene).candidates
    order = np.argsort(scene.mesh.nodes[points.node, 0])
    r = accepted.solved.r[order, 0]
    np.testing.assert_allclose(r / r.sum(), np.array([1, 4, 2, 4, 2, 4, 1]) / 18, atol=1e-9)


def test_a_tool_that_moves_sideways_drags_by_coulomb_friction():
    """Pressed first, then slid: the shear force equals mu times the normal force once everything slips."""
    down = FlatTool((0.0, 1.0), (0.0, -1.0), (0.05, -0.002), ("top",), 0.2)
    *_, last = march(block_scene((down,), poisson=0.0), Schedule(10), Control(DIRECT))
    r = last.solved.r[last.solved.rows.frictional]
    assert abs(r[:, 1].sum()) == pytest.approx(0.2 * r[:, 0].sum(), rel=1e-9)
    assert last.energies.friction > 0


def test_the_cvxpy_back_end_gives_the_same_increments():
    scene = upsetting(mu=0.3, reduction=0.02, elements=3)
    direct = list(march(scene, path(0.02, 2), Control(DIRECT)))
    stated = list(march(scene, path(0.02, 2), Control(Tangent(solver=Cvxpy()))))
    for a, b in zip(direct, stated, strict=True):
        np.testing.assert_allclose(a.state.nodes, b.state.nodes, atol=1e-8)
        np.testing.assert_allclose(a.solved.r, b.solved.r, atol=1e-6 * np.abs(b.solved.r).max())
