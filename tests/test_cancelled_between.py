"""Friction that means between parts leave out where slips in a mean have several directions, told by a column."""

import numpy as np
import pytest

from bipot import (
    Control,
    DeformableTool,
    Elastic,
    Elasticity,
    Geometry,
    Newton,
    Plane,
    Prescribed,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Turn,
    block,
    brick,
    march,
    together,
)
from bipot.meshes.elements import Element
from bipot.results.columns import CANCELLED
from bipot.system import system_of
from tests.deformable import ELASTIC, shifted

MU = 0.05
SOFT = Elastic(Elasticity(2e4, 0.45))


def last(scene):
    *_, accepted = march(scene, Schedule(2), Control(Newton(), ()))
    return accepted, CANCELLED.value(system_of(scene), accepted)


@pytest.mark.parametrize(("lower", "upper"), [(4, 6), (5, 2)])
def test_below_a_soft_block_that_spreads_it_is_what_points_within_the_means_would_add(lower, upper):
    """By the motion of both sides at fine places along the line between them, which stays straight."""
    mesh = together({"low": block(2.0, 1.0, lower, 2), "up": shifted(block(2.0, 1.0, upper, 2), 0.0, 1.0)})
    held = Support("low/base", 0), Support("low/base", 1), Support("up/top", 0), Prescribed("up/top", 1, -0.02)
    tools = (DeformableTool(("up/base",), ("low/top",), MU),)
    accepted, found = last(Scene(mesh, Geometry.PLANE_STRAIN, ELASTIC, held, tools, regions={"up": SOFT}))
    x, du = accepted.state.nodes, accepted.state.du
    own, other = (np.unique(mesh.boundary(name)) for name in ("low/top", "up/base"))
    own, other = (side[np.argsort(x[side, 0])] for side in (own, other))
    ends = max(x[own[0], 0], x[other[0], 0]), min(x[own[-1], 0], x[other[-1], 0])
    s = ends[0] + (np.arange(200_000) + 0.5) / 200_000 * (ends[1] - ends[0])
    slip = np.interp(s, x[own, 0], du[own, 0]) - np.interp(s, x[other, 0], du[other, 0])
    lost = 0.0
    candidates = accepted.solved.iterate.increment.system.candidates
    for node, force in zip(candidates.node, accepted.state.forces[:, 0], strict=True):
        psi = np.interp(s, x[own, 0], (own == node).astype(float))
        lost += MU * force * (psi @ abs(slip) - abs(psi @ slip)) / psi.sum()
    work = abs(accepted.solved.iterate.work(accepted.solved.r))
    assert lost > 1e-5 * work
    assert found == pytest.approx(lost / (work + lost), rel=0.02)


def test_below_a_block_in_space_that_turns_it_is_the_part_of_the_moment_that_is_left_out():
    """One face above another of the same four nodes: slips r, whose means have the length of the mean of x."""
    low, up = (brick(1.0, 1.0, 0.5, 1, 1, 1, element=Element.H8) for _ in range(2))
    mesh = together({"low": shifted(low, -0.5, -0.5, -0.5), "up": shifted(up, -0.5, -0.5, 0.0)})
    top = (0.0, 0.0, 0.5)
    turn = Turn(0.1, top, axis=(0.0, 0.0, 1.0))
    lid = ShapedTool(Plane(top, (0.0, 0.0, -1.0)), (0.0, 0.0, -1e-6), ("up/top",), np.inf, turn=turn)
    tools = lid, DeformableTool(("up/base",), ("low/top",), 1e-6)
    held = tuple(Support("low/base", d) for d in range(3))
    scene = Scene(mesh, Geometry.SOLID, Elastic(Elasticity(1e9, 0.0)), held, tools)
    (accepted,) = march(scene, Schedule(1), Control(Newton(), ()))
    found = CANCELLED.value(system_of(scene), accepted)
    force = accepted.tool_force(1)[2]
    mean = 0.382597858  # of the distance from the middle of a square
    lost = 1e-6 * -force * 0.1 * (mean - np.sqrt(2) / 6)
    work = abs(accepted.solved.iterate.work(accepted.solved.r))
    assert found == pytest.approx(lost / (work + lost), rel=0.05)
