"""Status and recovered tractions of increments."""

from dataclasses import replace

import numpy as np
import pytest

from bipot.contact.closeness import LEAST_MOTION
from bipot.fem.surface import facet_mass
from bipot.forms import Newton, Tangent
from bipot.iterate import Increment
from bipot.laws.coulomb import CARRIES, Status
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.traction import SLIP_TOLERANCE, contact_edges, traction, tractions
from studies.recovered import consistent_tractions, edge_tractions
from tests.scenes import last, scene, tool

FAST = Control(Tangent())
PRESSED = upsetting(mu=0.3, elements=3, reduction=0.1)


@pytest.fixture(scope="module")
def sticky():
    """An increment at mu = 0.3 with sticking, slipping and open candidates, and its system."""
    scene = upsetting(mu=0.3, elements=4, reduction=0.2)
    *_, last = march(scene, Schedule(4, first=0.005), FAST)
    return system_of(scene), last


def test_status_agrees_with_forces_and_motion(sticky):
    _, last = sticky
    result = last.traction
    motion, r = last.solved.rows.motion(last.solved.response.x), last.solved.r
    is_ = {s: result.status == s for s in Status}
    assert is_[Status.STICK].any()
    assert is_[Status.SLIP].any()
    assert is_[Status.OPEN].any()
    assert not is_[Status.UNDECIDED].any()
    np.testing.assert_allclose(np.abs(r[is_[Status.SLIP], 1]), 0.3 * r[is_[Status.SLIP], 0], rtol=1e-6)
    assert (r[is_[Status.SLIP], 1] * motion[is_[Status.SLIP], 1] < 0).all()
    assert (np.abs(r[is_[Status.STICK], 1]) < 0.3 * r[is_[Status.STICK], 0]).all()
    assert (motion[is_[Status.OPEN], 0] > 0).all()
    assert (np.linalg.norm(r[is_[Status.OPEN]], axis=1) <= result.force_tol).all()


def test_tractions_obey_sign_and_cone_where_the_consistent_ones_do_not(sticky):
    system, last = sticky
    r, nodes = last.solved.r, last.state.nodes
    result = last.traction
    p, tau = result.recovered_pressure, result.recovered_shear
    line = ~np.isnan(p)
    assert (p[line] >= 0).all()
    assert (np.abs(tau[line]) <= 0.3 * p[line]).all()
    # A slipping node is on the envelope, because the quotient is that of the forces.
    slip = line & (result.status == Status.SLIP)
    np.testing.assert_allclose(np.abs(tau[slip]), 0.3 * p[slip], rtol=1e-6)
    pressure, shear = consistent_tractions(system.candidates, nodes, r, r[:, 0] > result.force_tol)
    np.testing.assert_array_equal(np.isnan(pressure), ~line)
    assert (np.abs(shear[line]) > 0.3 * pressure[line] + 1.0).any()


def test_round_off_of_the_forces_does_not_leave_the_cone(sticky):
    """An open node on the line with a pull of a billionth, a slipping one beyond its limit by as much."""
    system, last = sticky
    r, scale = last.solved.r.copy(), np.abs(last.solved.r).max()
    result = last.traction
    slip = np.flatnonzero(result.status == Status.SLIP)
    r[slip[0], 1] *= 1 + 1e-9
    r[slip[1]] = -1e-9 * scale, 1e-9 * scale
    p, tau = tractions(system.candidates, last.state.nodes, r, last.solved.r[:, 0] > result.force_tol)
    assert p[slip[1]] == tau[slip[1]] == 0
    assert abs(tau[slip[0]]) == 0.3 * p[slip[0]]


def test_thresholds_are_relative_and_kept_beside_the_data(sticky):
    _, last = sticky
    solved, times = last.solved, (last.start.tau, last.state.tau)
    result = last.traction
    assert result.force_tol == CARRIES * np.linalg.norm(solved.r, axis=1).max()
    assert result.slip_tol == pytest.approx(SLIP_TOLERANCE * 0.2 * 5 * (times[1] - times[0]), rel=1e-12)
    larger = traction(solved.iterate, 1e3 * solved.r)
    np.testing.assert_array_equal(larger.status, result.status)
    np.testing.assert_allclose(larger.recovered_pressure, 1e3 * result.recovered_pressure, rtol=1e-12)


def test_slip_counts_from_a_fraction_of_the_motion_along_a_bent_path():
    """A hundredth of the stroke back in a quarter of the path: 25 times less than travel times tau; then rest."""
    punch = replace(PRESSED.tools[0], path=((0.0, 0.0), (0.5, 1.0), (0.75, 0.99), (1.0, 0.99)))
    scene = replace(PRESSED, tools=(punch,))
    steps = list(march(scene, Schedule(4, first=0.005, landings=(0.5, 0.75)), FAST))
    for a in steps:
        tolerance, resting = a.traction.slip_tol, a.start.tau >= 0.75
        body = np.linalg.norm(a.state.du, axis=1).max()
        moved = max(body, LEAST_MOTION * 5) if resting else np.hypot(*punch.moved(a.start.tau, a.state.tau))
        assert tolerance == pytest.approx(SLIP_TOLERANCE * moved, rel=1e-12)
    back = [a.traction.slip_tol for a in steps if 0.5 <= a.start.tau < 0.75]
    assert sum(back) == pytest.approx(SLIP_TOLERANCE * 0.01 * 0.5, rel=1e-9)


def test_a_body_that_moves_between_resting_tools_has_its_own_length(sticky):
    system, last = sticky
    still, x = Increment(system, last.start, last.start.tau), last.solved.response.x
    largest = np.linalg.norm(last.state.du, axis=1).max()
    assert still.at(x).length == pytest.approx(largest, rel=1e-15)
    assert still.at(0 * x).length == LEAST_MOTION * 5


def test_edge_means_carry_the_punch_force_exactly_and_within_the_law(sticky):
    system, last = sticky
    scene, r = system.body.scene, last.solved.r
    nodes = last.state.nodes[system.candidates.node]
    closed = r[:, 0] > last.traction.force_tol
    edges = contact_edges(system.candidates, 0, closed)
    means = edge_tractions(nodes, edges, scene.geometry, r)
    area = facet_mass(nodes, edges, scene.geometry).sum(axis=(1, 2))
    np.testing.assert_allclose(area @ means, r.sum(axis=0), rtol=1e-12)
    assert (means[:, 0] > 0).all()
    assert (np.abs(means[:, 1]) <= 0.3 * means[:, 0] * (1 + 1e-9)).all()


def test_a_weld_that_pulls_sticks():
    """By the law of contact alone it would be open: its force is below zero."""
    lifting = tool(travel=(0.0, 1e-4), mu=np.inf)
    lifted = last(scene(tools=(lifting,)), Schedule(1), Newton())
    assert (lifted.solved.r[:, 0] < 0).all()
    assert (lifted.traction.status == Status.STICK).all()
    assert (lifted.traction.recovered_pressure[np.isfinite(lifted.traction.recovered_pressure)] == 0).all()


def test_a_node_that_cannot_move_along_its_tool_has_no_shear_for_any_forces():
    """The corner beside the support of the left side: what friction is there acts on no unknown."""
    pressed = last(scene(), Schedule(1), Newton()).solved
    contacts = pressed.iterate.increment.system.candidates
    held = np.flatnonzero(~contacts.tangent_free)
    assert len(held) == 1
    planted = pressed.r.copy()
    planted[:, 1] = 0.05 * planted[:, 0]
    _, shear = tractions(contacts, pressed.iterate.balanced, planted, planted[:, 0] > 0)
    assert np.flatnonzero(shear == 0).tolist() == held.tolist()
