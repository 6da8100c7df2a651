"""Coulomb's law: its statements held against each other, the projections against their definitions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bipot.laws.coulomb import (
    Status,
    bipotential,
    bipotential_gap,
    cone_violation,
    de_saxce_shift,
    dual_cone_violation,
    incremental_bipotential,
    natural_map,
    satisfies_inverse_law,
    satisfies_law,
    status,
)
from bipot.laws.projections import DiscSlope, cone_slope, project_cone, project_disc

quick = settings(deadline=None, derandomize=True, max_examples=80)
both_dimensions = pytest.mark.parametrize("d", [2, 3])
frictions = st.sampled_from([0.0, 0.1, 0.3, 1.0, 4.0])


def vectors(d, rows=6):
    return arrays(float, (rows, d), elements=st.floats(-10.0, 10.0))


def lattice(d):
    """All pairs (du, r) on a small grid that holds exact cone boundaries: |(3, 4)| = 5 = 0.5 * 10 = 1 * 5."""
    normal, tangent = (-1.0, 0.0, 2.0), (-4.0, -3.0, 0.0, 3.0, 4.0) if d == 3 else (-5.0, 0.0, 1.0)
    axes = [normal] + [tangent] * (d - 1) + [(-1.0, 0.0, 5.0, 10.0)] + [tangent] * (d - 1)
    points = np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=-1)
    return points[:, :d], points[:, d:]


def lawful_pairs(rng, mu, d, count=30):
    """Open, sticking and sliding points built from the three cases of the law: (du, r, kind)."""
    tangents = rng.normal(size=(3 * count, d - 1))
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    kind = np.repeat([Status.OPEN, Status.STICK, Status.SLIP], count)
    push = np.where(kind == Status.OPEN, 0.0, rng.uniform(0.5, 5.0, kind.size))
    share = np.where(kind == Status.SLIP, 1.0, rng.uniform(0.0, 0.9, kind.size))
    slip = np.where(kind == Status.STICK, 0.0, rng.uniform(0.1, 3.0, kind.size))
    room = np.where(kind == Status.OPEN, rng.uniform(0.1, 2.0, kind.size), 0.0)
    du = np.column_stack([room, slip[:, None] * tangents])
    r = np.column_stack([push, -(mu * push * share)[:, None] * tangents])
    return du, r, kind


@both_dimensions
@pytest.mark.parametrize("mu", [0.0, 0.5, 1.0])
def test_five_statements_of_the_law_agree_on_a_lattice(d, mu):
    du, r = lattice(d)
    direct = satisfies_law(du, r, mu, 1e-12)
    gap = bipotential(du, r, mu) + np.sum(du * r, axis=-1)
    np.testing.assert_array_equal(direct, satisfies_inverse_law(du, r, mu, 1e-12))
    np.testing.assert_array_equal(direct, np.abs(gap) <= 1e-12)
    np.testing.assert_array_equal(direct, np.linalg.norm(natural_map(r, du, mu, 0.7), axis=-1) <= 1e-12)
    shifted = de_saxce_shift(du, mu)
    conic = (cone_violation(r, mu) + dual_cone_violation(shifted, mu) <= 1e-12) & (
        np.abs(np.sum(r * shifted, axis=-1)) <= 1e-12
    )
    np.testing.assert_array_equal(direct, conic)
    assert np.all(gap >= 0)
    slipping = direct & (np.linalg.norm(du[:, 1:], axis=-1) > 0) & (r[:, 0] > 0)
    assert slipping.any()
    assert (direct & (du[:, 0] > 0)).any()


@both_dimensions
@given(data=st.data(), mu=frictions)
@quick
def test_bipotential_inequality(d, data, mu):
    du, r = data.draw(vectors(d)), data.draw(vectors(d))
    assert np.all(bipotential(du, r, mu) + np.sum(du * r, axis=-1) >= -1e-12)
    du[:, 0] = np.abs(du[:, 0])
    admissible = project_cone(r, mu)
    gap = bipotential_gap(du, admissible, mu)
    assert np.all(gap >= -1e-12)
    value = bipotential(du, admissible, mu, tol=1e-12) + np.sum(du * admissible, axis=-1)
    np.testing.assert_allclose(gap, value, atol=1e-12)
    # A gap of 1e-6 is far above what points within 1e-9 of the law can have.
    assert not np.any(satisfies_law(du, admissible, mu, 1e-9) & (gap > 1e-6))
    assert not np.any(satisfies_inverse_law(du, admissible, mu, 1e-9) & (gap > 1e-6))


@both_dimensions
@given(seed=st.integers(0, 10_000), mu=st.floats(0.05, 3.0), rho=st.floats(0.01, 100.0))
@quick
def test_points_built_from_the_law_satisfy_every_statement(d, seed, mu, rho):
    du, r, kind = lawful_pairs(np.random.default_rng(seed), mu, d)
    assert satisfies_law(du, r, mu, 1e-12).all()
    assert satisfies_inverse_law(du, r, mu, 1e-12).all()
    np.testing.assert_allclose(bipotential_gap(du, r, mu), 0.0, atol=1e-13 * (1 + mu) * 50)
    np.testing.assert_allclose(natural_map(r, du, mu, rho), 0.0, atol=1e-13 * (1 + rho) * (1 + mu) * 10)
    np.testing.assert_array_equal(status(r, du, 0.0, mu, 1e-9, 1e-9), kind)
    # The same points with part of the opening given as a gap.
    shift = np.zeros_like(du)
    shift[:, 0] = 0.25
    np.testing.assert_array_equal(status(r, du - shift, 0.25, mu, 1e-9, 1e-9), kind)


@both_dimensions
@pytest.mark.parametrize("size", [1e-3, 1.0])
def test_planted_errors_are_seen(d, size):
    rng, mu = np.random.default_rng(0), 0.4
    du, r, kind = lawful_pairs(rng, mu, d)
    sinking, pulling, past = du.copy(), r.copy(), r.copy()
    sinking[:, 0] -= size + du[:, 0]
    pulling[:, 0] -= size + r[:, 0]
    past[:, 1:] *= 1.0 + size
    for broken_du, broken_r in ((sinking, r), (du, pulling)):
        assert not satisfies_law(broken_du, broken_r, mu, 1e-9).any()
        assert not satisfies_inverse_law(broken_du, broken_r, mu, 1e-9).any()
    slipping = kind == Status.SLIP
    assert not satisfies_law(du, past, mu, 1e-9)[slipping].any()
    assert not satisfies_inverse_law(du, past, mu, 1e-9)[slipping].any()
    np.testing.assert_allclose(cone_violation(past, mu)[slipping], (size * mu * r[:, 0])[slipping], rtol=1e-9)
    np.testing.assert_allclose(dual_cone_violation(sinking, 0.0), size, rtol=1e-12)
    reversed_slip = du * np.r_[1.0, -np.ones(d - 1)]
    expected = 2 * mu * r[:, 0] * np.linalg.norm(du[:, 1:], axis=1)
    np.testing.assert_allclose(bipotential_gap(reversed_slip, r, mu)[slipping], expected[slipping], rtol=1e-12)
    assert not satisfies_law(reversed_slip, r, mu, 1e-9)[slipping].any()


@both_dimensions
@given(data=st.data(), mu=frictions)
@quick
def test_cone_projection_is_the_nearest_point(d, data, mu):
    r, other = data.draw(vectors(d)), data.draw(vectors(d))
    p, q = project_cone(r, mu), project_cone(other, mu)
    assert np.all(cone_violation(p, mu) <= 1e-13 * 100)
    np.testing.assert_allclose(project_cone(p, mu), p, atol=1e-13)
    # Variational inequality of the nearest point, against another point of the cone.
    assert np.all(np.sum((r - p) * (q - p), axis=-1) <= 1e-11)
    distance = np.linalg.norm(r - other, axis=-1)
    assert np.all(np.linalg.norm(p - q, axis=-1) <= distance * (1 + 1e-13) + 1e-14)


@both_dimensions
@given(data=st.data(), mu=frictions)
@quick
def test_moreau_splits_into_cone_and_dual(d, data, mu):
    r = data.draw(vectors(d))
    p = project_cone(r, mu)
    # The dual of K_mu is {u_n >= mu |u_t|}, the cone of 1/mu; for mu = 0 the half space, which is K_inf.
    dual = project_cone(-r, 1.0 / mu if mu > 0 else np.inf)
    np.testing.assert_allclose(p - dual, r, atol=1e-13 * 100)
    np.testing.assert_allclose(np.sum(p * dual, axis=-1), 0.0, atol=1e-11)
    assert np.all(dual_cone_violation(dual, mu) <= 1e-11)


@pytest.mark.parametrize("d", [2, 3])
@given(data=st.data(), radius=st.sampled_from([0.0, 0.5, 3.0, np.inf]))
@quick
def test_disc_projection_is_the_nearest_point(d, data, radius):
    t, other = data.draw(vectors(d - 1)), data.draw(vectors(d - 1))
    p, q = project_disc(t, radius), project_disc(other, radius)
    assert np.all(np.linalg.norm(p, axis=-1) <= radius * (1 + 1e-15))
    np.testing.assert_allclose(project_disc(p, radius), p, rtol=1e-15, atol=1e-300)
    assert np.all(np.sum((t - p) * (q - p), axis=-1) <= 1e-12)
    assert np.all(np.linalg.norm(p - q, axis=-1) <= np.linalg.norm(t - other, axis=-1) * (1 + 1e-13) + 1e-14)


@both_dimensions
@quick
@given(st.integers(0, 10_000))
def test_slopes_are_the_derivatives_of_the_projections(d, seed):
    """By point, by radius and on the cone, where they have one."""
    rng, h = np.random.default_rng(seed), 1e-6
    r, along, mu = rng.normal(size=(6, d)), rng.normal(size=(6, d)), rng.uniform(0.0, 2.0, 6)
    t, s = r[:, 1:], np.abs(r[:, 0])
    disc = DiscSlope.at(t, s)
    ahead, behind = (project_disc(t + k * along[:, 1:], s + k * along[:, 0]) for k in (h, -h))
    slope = np.einsum("cij,cj->ci", disc.by_point, along[:, 1:]) + disc.by_radius * along[:, :1]
    np.testing.assert_allclose(slope, (ahead - behind) / (2 * h), atol=1e-5)
    ahead, behind = (project_cone(r + k * along, mu) for k in (h, -h))
    np.testing.assert_allclose(np.einsum("cij,cj->ci", cone_slope(r, mu), along), (ahead - behind) / (2 * h), atol=1e-5)


def test_slopes_on_points_without_room():
    """A disc of radius 0 moves with its radius alone, a glued one (inf) not at all; frictionless cones are rays."""
    disc = DiscSlope.at(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 4.0]]), np.array([0.0, 0.0, np.inf]))
    np.testing.assert_array_equal(disc.by_point, [np.zeros((2, 2)), np.zeros((2, 2)), np.eye(2)])
    np.testing.assert_allclose(disc.by_radius, [[0.0, 0.0], [0.6, 0.8], [0.0, 0.0]])
    ray = cone_slope(np.array([[1.0, 0.0], [1.0, 2.0], [-1.0, 0.0]]), np.zeros(3))
    np.testing.assert_array_equal(ray, [np.diag([1.0, 0.0]), np.diag([1.0, 0.0]), np.zeros((2, 2))])


@both_dimensions
@given(data=st.data(), mu=frictions)
@quick
def test_incremental_bipotential_is_the_total_one_plus_initial_work(d, data, mu):
    du, r0, r = data.draw(vectors(d)), data.draw(vectors(d)), project_cone(data.draw(vectors(d)), mu)
    du[:, 0] = np.abs(du[:, 0])
    expected = r0[:, 0] * du[:, 0] + np.sum(r0[:, 1:] * du[:, 1:], axis=-1)
    expected = expected + mu * r[:, 0] * np.linalg.norm(du[:, 1:], axis=-1)
    value = incremental_bipotential(du, r - r0, r0, mu, tol=1e-12)
    np.testing.assert_allclose(value, expected, atol=1e-10)
    du[:, 0] = -1.0
    assert np.all(np.isinf(incremental_bipotential(du, r - r0, r0, mu, tol=1e-12)))


def test_coefficients_per_point_match_one_at_a_time():
    rng = np.random.default_rng(3)
    du, r, mu = (
        rng.normal(size=(7, 3)),
        rng.normal(size=(7, 3)),
        np.array([0.0, 0.1, 0.5, 1.0, 2.0, 9.0, np.inf]),
    )
    for together in (
        lambda m, i: project_cone(r[i], m),
        lambda m, i: cone_violation(r[i], m),
        lambda m, i: dual_cone_violation(du[i], m),
        lambda m, i: bipotential_gap(du[i], r[i], m),
        lambda m, i: natural_map(r[i], du[i], m, 2.0),
        lambda m, i: de_saxce_shift(du[i], m),
        lambda m, i: bipotential(du[i], r[i], m),
        lambda m, i: status(r[i], du[i], 0.0, m, 1e-9, 1e-9),
        lambda m, i: satisfies_law(du[i], r[i], m, 0.5),
        lambda m, i: satisfies_inverse_law(du[i], r[i], m, 0.5),
    ):
        all_at_once = together(mu, slice(None))
        one_by_one = np.concatenate([together(float(mu[i]), slice(i, i + 1)) for i in range(7)])
        np.testing.assert_array_equal(all_at_once, one_by_one)


def test_glued_contact():
    inf = np.inf
    r = np.array([[2.0, 50.0], [0.0, 0.0], [-1.0, 0.0], [2.0, 50.0]])
    du = np.array([[0.0, 0.0], [1.0, 3.0], [0.0, 0.0], [0.0, 0.1]])
    np.testing.assert_array_equal(satisfies_law(du, r, inf, 1e-9), [True, True, False, False])
    np.testing.assert_array_equal(satisfies_inverse_law(du, r, inf, 1e-9), [True, True, False, False])
    np.testing.assert_array_equal(cone_violation(r, inf), [0.0, 0.0, 1.0, 0.0])
    np.testing.assert_array_equal(dual_cone_violation(du[[0, 3]], inf), [0.0, 0.1])
    np.testing.assert_array_equal(bipotential(du, r, inf), [0.0, 0.0, inf, inf])
    np.testing.assert_array_equal(project_cone(r, inf)[:, 0], [2.0, 0.0, 0.0, 2.0])
    np.testing.assert_allclose(bipotential_gap(du, r, inf), [0.0, 0.0, 0.0, 5.0])
    kinds = [Status.STICK, Status.OPEN, Status.UNDECIDED, Status.UNDECIDED]
    np.testing.assert_array_equal(status(r, du, 0.0, inf, 1e-9, 1e-9), kinds)
    np.testing.assert_allclose(natural_map(r, du, inf, 3.0)[[0, 3]], [[0.0, 0.0], [0.0, 0.3]], atol=1e-13)


@pytest.mark.parametrize(
    ("r", "du", "gap", "mu", "kind"),
    [
        ((0.0, 0.0), (0.0, 0.0), 0.0, 0.3, Status.UNDECIDED),  # grazing
        ((1.0, 0.3), (0.0, 0.0), 0.0, 0.3, Status.UNDECIDED),  # on the edge of the cone without slip
        ((1.0, 0.1), (0.0, 1.0), 0.0, 0.3, Status.UNDECIDED),  # slips inside the cone
        ((1.0, 0.0), (0.5, 0.0), 0.0, 0.3, Status.UNDECIDED),  # pushes across an open gap
        ((1.0, 0.0), (-0.5, 0.0), 0.5, 0.3, Status.STICK),
        ((1.0, 0.0), (0.0, 0.0), 0.0, 0.0, Status.SLIP),  # nothing resists
        ((0.0, 0.0), (-0.2, 9.0), 0.5, 0.3, Status.OPEN),
        ((1.0, -0.3), (0.0, 1.0), 0.0, 0.3, Status.SLIP),
    ],
)
def test_status_thresholds(r, du, gap, mu, kind):
    assert status(np.array([r]), np.array([du]), gap, mu, 1e-9, 1e-9)[0] == kind


def test_status_values_are_stored_ones():
    assert [int(s) for s in (Status.OPEN, Status.STICK, Status.SLIP, Status.UNDECIDED)] == [0, 1, 2, 3]
