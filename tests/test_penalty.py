"""The penalised program: one convex function, four ways to its minimum, and the march that uses it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from bipot.conic.problem import Claim
from bipot.conic.solver import Accuracy
from bipot.conic.through_cvxpy import solve_stated
from bipot.errors import IncrementFailed, ProgramError, SceneError
from bipot.forms import Optimiser, Penalty, Uzawa, contact_penalty
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.programs.data import Block, ContactRows, Term
from bipot.programs.penalty import PenaltyProgram, PenaltyTerms
from bipot.programs.penalty_newton import newton
from bipot.programs.penalty_optimisers import fictitious
from bipot.tools.poses import Force
from bipot.tools.revolved import sphere
from studies.optimisers import ALLOWED, compare
from studies.runs import condition
from tests.curved import STEEL
from tests.scenes import path, posed
from tests.space import rubbed

# (n, t_1 ..) of four candidates, three of them frictional.
COUNT, FRICTIONAL = 4, np.array([0, 1, 3])


def program(seed, d):
    """A random program with every kind of point: closed, open, penetrating, sticking, sliding, frictionless."""
    rng = np.random.default_rng(seed)
    n, width = 9, d - 1
    A = rng.normal(size=(n, n))
    rows = ContactRows(
        sp.csr_matrix(rng.normal(size=(COUNT, n))),
        rng.normal(size=COUNT),
        sp.csr_matrix(rng.normal(size=(len(FRICTIONAL) * width, n))),
        rng.normal(size=(len(FRICTIONAL), width)),
        FRICTIONAL,
        np.array([0.3, 0.3, 0.0, 0.3]),
        np.full(COUNT, np.inf),
        np.zeros(COUNT, bool),
    )
    t_0 = rng.normal(size=(COUNT, d))
    t_0[:, 0] = np.abs(t_0[:, 0])
    threshold = rng.uniform(0.0, 2.0, len(FRICTIONAL))
    k_n, k_t = rng.uniform(1.0, 50.0, COUNT), rng.uniform(1.0, 50.0, len(FRICTIONAL))
    terms = PenaltyTerms(rows, rng.normal(size=COUNT), t_0, threshold, k_n, k_t)
    return PenaltyProgram(A @ A.T + np.eye(n), rng.normal(size=n), terms)


def smooth(terms, x, margin=1e-3):
    """Whether no candidate is within ``margin`` of a kink of its traction."""
    du, f = terms.motion(x), terms.rows.frictional
    push = terms.t_0[:, 0] - terms.k_n * (np.maximum(terms.start_gap, 0) + du[:, 0])
    pull = np.linalg.norm(terms.t_0[f, 1:] - terms.k_t[:, None] * du[f, 1:], axis=1) - terms.threshold
    return min(np.abs(push).min(), np.abs(pull).min()) > margin


@pytest.mark.parametrize("d", [2, 3])
@given(seed=st.integers(0, 10_000))
def test_gradient_and_hessian_are_those_of_the_value(d, seed):
    """Central differences of value and gradient, in a random direction, away from the kinks."""
    psi = program(seed, d)
    rng = np.random.default_rng(seed + 1)
    x, v = rng.normal(size=(2, len(psi.f)))
    if not smooth(psi.contact, x):
        return
    h = 1e-6
    slope = (psi.value(x + h * v) - psi.value(x - h * v)) / (2 * h)
    assert psi.gradient(x) @ v == pytest.approx(slope, rel=1e-6, abs=1e-5)
    bend = (psi.gradient(x + h * v) - psi.gradient(x - h * v)) / (2 * h)
    np.testing.assert_allclose(psi.hessian(x) @ v, bend, rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("d", [2, 3])
@given(seed=st.integers(0, 10_000))
@settings(max_examples=10)
def test_newton_finds_the_minimum_from_anywhere(d, seed):
    """Starts far away end at one point, where the gradient vanishes and every neighbour is higher."""
    psi = program(seed, d)
    rng = np.random.default_rng(seed + 2)
    ends = [newton(psi, 10 * rng.normal(size=len(psi.f))) for _ in range(3)]
    for end in ends:
        assert end.outcome is Claim.SOLVED
        np.testing.assert_allclose(end.x, ends[0].x, atol=1e-8)
    x = ends[0].x
    assert np.abs(psi.gradient(x)).max() < 1e-8
    assert psi.value(x + 0.1 * rng.normal(size=len(x))) > psi.value(x)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_the_fictitious_increments_of_29_give_the_envelopes(d, seed):
    """Stated with v as variables: same minimum value, same point, and the dual of v_n >= -max(g0, 0) is t_n."""
    psi = program(seed, d)
    stated = psi.statement()
    solve_stated(stated, Accuracy(1e-12))
    x = newton(psi, np.zeros(len(psi.f))).x
    assert stated.problem.value == pytest.approx(psi.value(x), abs=1e-7)
    np.testing.assert_allclose(stated.blocks[Block.DISPLACEMENT].value, x, atol=1e-6)
    np.testing.assert_allclose(stated.constraints[Term.FICTITIOUS].dual_value, psi.contact.forces(x)[:, 0], atol=1e-5)


def test_condensing_changes_nothing():
    given = posed(0.3)
    t_0 = np.tile([40.0, -5.0], (given.rows.count, 1))
    points, ones = len(t_0), np.ones(len(given.rows.frictional))
    terms = PenaltyTerms(given.rows, np.zeros(points), t_0, 9 * ones, np.full(points, 1e4), 1e4 * ones)
    psi = PenaltyProgram(
        given.tangent.K * given.units.force / given.units.length, np.zeros(len(given.tangent.f)), terms
    )
    small, condensed = psi.scaled(given.units).condensed()
    whole = newton(psi.scaled(given.units), np.zeros(len(psi.f))).x
    part = newton(small, np.zeros(len(small.f))).x
    np.testing.assert_allclose(condensed.recover(part), whole, atol=1e-10 * np.abs(whole).max())
    H = psi.hessian(whole)
    assert condition(H) == pytest.approx(np.linalg.cond(H.toarray(), 1), rel=0.5)


@pytest.mark.slow
def test_the_optimisers_agree_on_every_pass_of_every_increment():
    """10 % at mu = 0.3, K = 30 E/h."""
    compared = compare(elements=3, increments=2)
    for optimiser, allowed in ALLOWED.items():
        differences = [difference for difference, *_ in compared.spent[optimiser]]
        assert len(differences) > 50
        assert max(differences) < allowed
    assert not any(almost for *_, almost in compared.spent[Optimiser.CVXPY])
    assert max(difference for difference, *_ in compared.spent[Optimiser.CVXPY]) < 1e-7


def test_an_interior_point_that_cannot_do_what_is_asked_does_what_it_can():
    psi = program(3, 3)
    x = newton(psi, np.zeros(len(psi.f))).x
    found = fictitious(psi, (Accuracy(1e-12, iterations=3), Accuracy(1e-10)))
    assert found.outcome is Claim.SOLVED
    np.testing.assert_allclose(found.x, x, atol=1e-4)
    with pytest.raises(ProgramError, match="stopped with"):
        fictitious(psi, (Accuracy(1e-12, iterations=3),))


@cache
def ended(form, mu=0.3):
    """The increments of a short penalised upsetting by 20 %."""
    scene = upsetting(mu=mu, reduction=0.2, elements=3)
    return tuple(march(scene, path(0.2, 4), Control(form, ())))


def test_penetration_is_what_the_penalty_allows():
    """Every force is K_n times its penetration, after any number of increments."""
    K = 2e6
    for accepted in ended(Penalty(K, K)):
        gap = accepted.solved.rows.motion(accepted.solved.response.x)[:, 0]
        r = accepted.solved.r[:, 0]
        np.testing.assert_allclose(r, K * np.maximum(-gap, 0), atol=1e-8 * r.max())
        assert accepted.solved.certificate.penetration == pytest.approx(r.max() / K / 5.0)
        assert accepted.solved.posed < 1e-8


def test_sticking_points_creep_by_force_over_penalty():
    """t_t + K_t times the slip since first contact, where the disc was never reached; sliding points meet mu t_n."""
    K, mu = 2e6, 0.6
    increments = ended(Penalty(K, K), mu)
    slip = sum(a.solved.rows.motion(a.solved.response.x)[:, 1] for a in increments)
    ratio = np.array([np.abs(a.solved.r[:, 1]) - mu * a.solved.r[:, 0] for a in increments])
    touching = increments[-1].solved.r[:, 0] > 0
    stuck = (ratio < -1e-3).all(axis=0) & touching & (slip != 0)
    assert stuck.any()
    np.testing.assert_allclose(increments[-1].solved.r[stuck, 1], -K * slip[stuck], rtol=1e-7)
    within = 2e-8 * increments[-1].solved.r.max()
    assert (ratio[-1] < within).all()
    assert (np.abs(ratio[-1, touching]) < within).any()


def test_a_penetration_that_carries_nothing_yet_is_pushed_back():
    """At rest, 1e-3 deep: t_n0 = -K_n g0, without the tool having moved."""
    scene = upsetting(mu=0.0, reduction=0.2, elements=2)
    raised = replace(scene, tools=(replace(scene.tools[0], point=(0.0, 4.999), travel=(0.0, -1e-9)),))
    (accepted,) = march(raised, Schedule(1), Control(Penalty(1e5, 1e5), ()))
    gap = accepted.solved.rows.motion(accepted.solved.response.x)[:, 0]
    r = accepted.solved.r[:, 0]
    assert r.max() > 1.0
    np.testing.assert_allclose(r, 1e5 * np.maximum(-gap, 0), atol=1e-9 * r.max())


def test_the_default_penalty_is_e_over_h_times_the_mean_nodal_area():
    """Nine nodes on a disc of radius 5, edges of 1.25: pi 25 E / (1.25 * 9)."""
    candidates = system_of(upsetting(mu=0.1, elements=4)).candidates
    assert contact_penalty(candidates) == pytest.approx(np.pi * 25 * 210e3 / 1.25 / 9, rel=1e-12)
    assert contact_penalty(candidates, 7.0) == pytest.approx(7 * contact_penalty(candidates), rel=1e-14)


@pytest.mark.parametrize("form", [Penalty, Uzawa])
@pytest.mark.parametrize("bad", [0.0, -1.0, np.inf, np.nan, 1e101, 5e-324])
def test_bad_penalties_are_refused(form, bad):
    with pytest.raises(SceneError, match="K_n = "):
        form(bad, 1.0)
    with pytest.raises(SceneError, match="K_t = "):
        form(1.0, bad)


@pytest.mark.parametrize("factor", [1.0, 3.0, 100.0, 300.0, 1e3])
@pytest.mark.parametrize("form", [Penalty, Uzawa])
def test_a_tool_that_falls_onto_the_body_is_caught_at_any_penalty(form, factor):
    """While all contacts are open nothing holds the tool: some passes ended with residuals of up to 9e10."""
    ball, force = sphere((0.45, 0.55, 1.65), 0.6), Force((0.0, 0.0, -30.0))
    fallen = rubbed(ball, material=STEEL, travel=(0.0, 0.0, 0.0), driven_by=force)
    K = contact_penalty(system_of(fallen).candidates, factor)
    accepted = next(march(fallen, Schedule(4, first=0.01, settling=1, growth=4.0), Control(form(K, K), (), cuts=0)))
    np.testing.assert_allclose(accepted.tool_force(0), (0.0, 0.0, -0.3), atol=1e-4)
    gap = accepted.scene.tools[0].distance(accepted.state.nodes, accepted.poses[0]).min()
    assert gap == pytest.approx(0.0 if form is Uzawa else -0.3 / K, rel=1e-2, abs=1e-10), "held by one node"


def test_a_welded_tool_is_refused_in_words():
    scene = upsetting(mu=np.inf, reduction=0.2, elements=2)
    with pytest.raises(IncrementFailed, match=r"do not weld .*\. Take another form, or give it fallbacks\.$"):
        list(march(scene, path(0.2, 1), Control(Penalty(1e5, 1e5), (), cuts=0)))


def test_uzawa_with_a_small_penalty_asks_for_a_larger_one():
    small = Control(Uzawa(1e4, 1e4), (), cuts=0)
    with pytest.raises(IncrementFailed, match="Raise K_n and K_t"):
        list(march(upsetting(mu=0.2, reduction=0.1, elements=2), Schedule(2), small))
