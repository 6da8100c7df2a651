"""Landings: a block that a rigid side punch meets at a time known in closed form, and the options' refusals."""

from functools import cache

import numpy as np
import pytest

from bipot.control.attempt import Attempt
from bipot.control.landing import Locate, locate
from bipot.errors import SceneError
from bipot.fem.reduction import Geometry
from bipot.forms import Dissipation, Newton
from bipot.iterate import Increment
from bipot.laws.hardening import Perfect
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march, system_of
from bipot.meshes.elements import Element
from bipot.meshes.sections import block
from bipot.scene.scene import Scene
from bipot.scene.supports import Support
from bipot.tools.tool import FlatTool

GAP, TRAVEL = 0.0037, 0.01
LANDS = GAP / TRAVEL
HOW = Locate()


def scene(*gaps, path=((0.0, 0.0), (1.0, 1.0))):
    """A unit block at rest that flat tools meet from above, each after its own gap."""
    tools = tuple(FlatTool((0.0, 1.0 + gap), (0.0, -1.0), (0.0, -TRAVEL), ("top",), 0.0, path) for gap in gaps)
    material = VonMises(Elasticity(210e3, 0.3), Perfect(1e6))
    supports = (Support("base", 1), Support("left", 0))
    return Scene(block(1.0, 1.0, 1, 1, element=Element.Q8), Geometry.PLANE_STRAIN, material, supports, tools)


def run(asked, increments=5, how=HOW):
    return tuple(march(asked, Schedule(increments), Control(Newton(), (Dissipation(),), locate=how)))


@cache
def located():
    return run(scene(GAP))


def test_the_increment_is_cut_to_the_landing():
    cut = [a for a in located() if a.landed is not None]
    assert len(cut) == 1
    assert cut[0].state.tau == pytest.approx(LANDS, abs=HOW.tolerance / 5)
    assert cut[0].state.tau <= LANDS
    assert cut[0].reason == f"cut to the landing of node {cut[0].landed} at tau = {cut[0].state.tau:.6g}"
    assert cut[0].cuts == 0
    assert not cut[0].state.forces.any()


def test_every_pass_that_the_search_takes_is_counted():
    seen = []
    control = Control(Newton(), (Dissipation(),), locate=HOW)
    steps = list(march(scene(GAP), Schedule(5), control, observe=seen.append))
    assert sum(a.passes for a in steps) == len(seen)
    assert next(a for a in steps if a.landed is not None).passes > 1


def test_the_rest_of_the_increment_goes_on_closed_and_every_time_is_kept():
    taus = [a.state.tau for a in located()]
    np.testing.assert_allclose(np.delete(taus, 1), [0.2, 0.4, 0.6, 0.8, 1.0], rtol=1e-14)
    assert (located()[2].state.forces[:, 0] > 0).all()
    force = [a.state.forces[:, 0].sum() for a in located()]
    # Small strain of an elastic block: the force grows with the travel after the landing.
    assert force[2] / force[-1] == pytest.approx((0.4 - LANDS) / (1 - LANDS), rel=0.05)


def test_without_the_option_the_landing_stays_inside_its_increment():
    whole = run(scene(GAP), how=None)
    assert [a.landed for a in whole] == [None] * 5
    np.testing.assert_allclose(whole[-1].state.forces, located()[-1].state.forces, rtol=2e-3)


@pytest.mark.parametrize("part", [0.4 * HOW.margin, 1 - 0.4 * HOW.margin])
def test_landings_near_the_ends_of_an_increment_leave_it_whole(part):
    assert all(a.landed is None for a in run(scene(TRAVEL * (1 + part) / 5)))


def test_the_first_of_several_landings_is_the_event_and_the_next_one_follows():
    """The two sides of the block's corner: one tool from above, one from the right that comes later."""
    above, later = 0.003, 0.0036
    asked = scene(above)
    right = FlatTool((1.0 + later, 0.0), (-1.0, 0.0), (-TRAVEL, 0.0), ("right",), 0.0)
    both = Scene(asked.mesh, asked.geometry, asked.material, asked.supports, (*asked.tools, right))
    accepted = tuple(march(both, Schedule(5), Control(Dissipation(), (), locate=HOW)))
    cut = [a.state.tau for a in accepted if a.landed is not None]
    # The block bulges towards the second tool, so that comes a little before its own gap is used up.
    assert cut[0] == pytest.approx(above / TRAVEL, abs=HOW.tolerance / 5)
    assert above / TRAVEL < cut[1] < later / TRAVEL
    assert len(cut) <= 1 + len(both.mesh.boundary_nodes("right"))


def test_a_search_that_fails_leaves_the_increment_whole():
    asked = scene(GAP)
    system, (first, second) = system_of(asked), run(asked, how=None)[:2]

    failed = Attempt(None, Newton.name, 3, [])
    increment, nobody = Increment(system, first.state, second.state.tau), np.zeros(len(second.solved.r), dtype=bool)
    found = locate(increment, second.solved, lambda tau: failed, HOW, nobody)
    assert found == (None, 3)


def test_a_known_candidate_is_not_located_again():
    asked = scene(GAP)
    system, (first, second) = system_of(asked), run(asked, how=None)[:2]
    increment, everyone = Increment(system, first.state, second.state.tau), np.ones(len(second.solved.r), dtype=bool)
    assert locate(increment, second.solved, pytest.fail, HOW, everyone) == (None, 0)


@pytest.mark.parametrize("wrong", [{"tolerance": 0.0}, {"tolerance": 1.0}, {"solves": 0}, {"margin": 0.5}])
def test_options_out_of_range_are_refused(wrong):
    with pytest.raises(SceneError, match=next(iter(wrong))):
        Locate(**wrong)
