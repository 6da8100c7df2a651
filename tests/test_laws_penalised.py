"""The penalised law between its primal infimum (29) and its dual, and its limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bipot.errors import SceneError
from bipot.laws.coulomb import satisfies_law
from bipot.laws.penalised import (
    default_penalty,
    normal_potential,
    normal_traction,
    tangential_potential,
    tangential_traction,
)

quick = settings(deadline=None, derandomize=True, max_examples=80)
both_dimensions = pytest.mark.parametrize("d", [2, 3])
numbers = st.floats(-3.0, 3.0)
stiffness = st.floats(0.1, 50.0)


def vectors(width):
    return arrays(float, (5, width), elements=numbers)


columns = arrays(float, 5, elements=numbers)


@given(du=columns, gap=columns, t0=st.floats(0.0, 3.0), k=stiffness, v=columns, t=columns)
@quick
def test_normal_potential_lies_between_every_primal_and_every_dual_value(du, gap, t0, k, v, t):
    open_gap = np.maximum(gap, 0.0)

    def primal(x):
        return t0 * (x - du) + 0.5 * k * (du - x) ** 2

    def dual(x):
        return -x * (open_gap + du) - (x - t0) ** 2 / (2.0 * k)

    value, traction = normal_potential(du, gap, t0, k).value, normal_traction(du, gap, t0, k)
    scale = 1e-13 * (1.0 + k) * 100
    assert np.all(value <= primal(np.maximum(v, -open_gap)) + scale)
    assert np.all(value >= dual(np.abs(t)) - scale)
    best = np.maximum(du - t0 / k, -open_gap)
    np.testing.assert_allclose(primal(best), value, atol=scale)
    np.testing.assert_allclose(dual(traction), value, atol=scale)
    np.testing.assert_allclose(traction, t0 - k * (du - best), atol=scale)


@both_dimensions
@given(data=st.data(), s=st.floats(0.0, 4.0), k=stiffness)
@quick
def test_tangential_potential_lies_between_every_primal_and_every_dual_value(d, data, s, k):
    du, t0, v, t = (data.draw(vectors(d - 1)) for _ in range(4))

    def primal(x):
        quadratic = 0.5 * k * np.sum((du - x) ** 2, axis=-1)
        return np.sum(t0 * (x - du), axis=-1) + s * np.linalg.norm(x, axis=-1) + quadratic

    def dual(x):
        return -np.sum(x * du, axis=-1) - np.sum((x - t0) ** 2, axis=-1) / (2.0 * k)

    t *= s / np.maximum(np.linalg.norm(t, axis=-1), max(s, 1e-300))[:, None]
    value, traction = tangential_potential(du, t0, s, k).value, tangential_traction(du, t0, s, k)
    scale = 1e-13 * (1.0 + k) * (1.0 + 1.0 / k) * 100
    assert np.all(value <= primal(v) + scale)
    assert np.all(value >= dual(t) - scale)
    np.testing.assert_allclose(primal(du + (traction - t0) / k), value, atol=scale)
    np.testing.assert_allclose(dual(traction), value, atol=scale)


def difference(function, x, h=1e-6):
    """Central differences of function (…, n) -> (…) or (…, m), stacked on the last axis."""
    steps = h * np.eye(x.shape[-1])
    return np.stack([(function(x + e) - function(x - e)) / (2.0 * h) for e in steps], axis=-1)


@given(du=columns, gap=columns, t0=st.floats(0.0, 3.0), k=stiffness)
@quick
def test_normal_derivatives(du, gap, t0, k):
    trial = t0 - k * (np.maximum(gap, 0.0) + du)
    du = np.where(np.abs(trial) < 1e-3 * k, du + 0.01, du)
    found = normal_potential(du, gap, t0, k)
    h = 1e-5
    up, down = normal_potential(du + h, gap, t0, k), normal_potential(du - h, gap, t0, k)
    np.testing.assert_allclose(found.gradient, (up.value - down.value) / (2 * h), atol=1e-7 * (1 + k))
    np.testing.assert_allclose(found.hessian, (up.gradient - down.gradient) / (2 * h), atol=1e-7 * (1 + k))
    np.testing.assert_array_equal(found.gradient, -normal_traction(du, gap, t0, k))


@both_dimensions
@given(data=st.data(), s=st.floats(0.1, 4.0), k=stiffness)
@quick
def test_tangential_derivatives(d, data, s, k):
    du, t0 = data.draw(vectors(d - 1)), data.draw(vectors(d - 1))
    near_kink = np.abs(np.linalg.norm(t0 - k * du, axis=-1) - s) < 1e-3 * k
    du = np.where(near_kink[:, None], t0 / k, du)
    found = tangential_potential(du, t0, s, k)
    slope = difference(lambda x: tangential_potential(x, t0, s, k).value, du)
    np.testing.assert_allclose(found.gradient, slope, atol=1e-6 * (1 + k))
    curvature = difference(lambda x: tangential_potential(x, t0, s, k).gradient, du)
    np.testing.assert_allclose(found.hessian, curvature, atol=1e-5 * (1 + k))
    np.testing.assert_array_equal(found.gradient, -tangential_traction(du, t0, s, k))
    np.testing.assert_array_equal(found.hessian, np.swapaxes(found.hessian, -1, -2))
    assert np.linalg.eigvalsh(found.hessian).min() >= -1e-14 * k


@both_dimensions
@given(data=st.data(), s=st.floats(0.0, 4.0), k=stiffness)
@quick
def test_without_history_the_envelope_misses_the_exact_term_by_at_most_its_bound(d, data, s, k):
    du = data.draw(vectors(d - 1))
    exact = s * np.linalg.norm(du, axis=-1)
    missing = exact - tangential_potential(du, np.zeros_like(du), s, k).value
    assert np.all(missing >= -1e-12)
    assert np.all(missing <= s**2 / (2.0 * k) + 1e-12)


@both_dimensions
def test_exact_solutions_are_the_fixed_points_of_refreshing_the_traction(d):
    rng, mu, k = np.random.default_rng(0), 0.4, 7.0
    gap = rng.uniform(0.0, 1.0, 30)
    tangents = rng.normal(size=(30, d - 1))
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    push = np.where(np.arange(30) < 10, 0.0, rng.uniform(0.5, 2.0, 30))
    room = np.where(np.arange(30) < 10, rng.uniform(0.1, 1.0, 30), 0.0)
    sliding = np.arange(30) >= 20
    slip = np.where((push > 0) & ~sliding, 0.0, rng.uniform(0.1, 1.0, 30))
    share = np.where(sliding, 1.0, 0.5)
    t = np.column_stack([push, -(mu * push * share)[:, None] * tangents])
    du = np.column_stack([room - gap, slip[:, None] * tangents])
    relative = np.column_stack([room, du[:, 1:]])
    assert satisfies_law(relative, t, mu, 1e-12).all()
    np.testing.assert_allclose(normal_traction(du[:, 0], gap, t[:, 0], k), t[:, 0], atol=1e-14)
    np.testing.assert_allclose(tangential_traction(du[:, 1:], t[:, 1:], mu * push, k), t[:, 1:], atol=1e-14)
    # And not of a law broken by a little penetration or by slip against a force inside the cone.
    assert np.all(normal_traction(du[10:, 0] - 0.01, gap[10:], push[10:], k) > push[10:])
    stuck = slice(10, 20)
    moved = tangential_traction(0.01 * tangents[stuck], t[stuck, 1:], mu * push[stuck], k)
    assert np.all(np.linalg.norm(moved - t[stuck, 1:], axis=1) > 0.01)


def test_penetration_already_carried_is_not_counted_twice():
    assert float(normal_traction(0.0, -0.01, 5.0, 500.0)) == 5.0
    assert float(normal_traction(-0.002, -0.01, 5.0, 500.0)) == pytest.approx(6.0, rel=1e-15)
    assert float(normal_traction(-0.03, 0.01, 0.0, 500.0)) == pytest.approx(10.0, rel=1e-15)


def test_penalties_and_thresholds_per_point():
    k, s = np.array([1.0, 2.0, 5.0]), np.array([0.1, np.inf, 0.0])
    du, t0 = np.array([[1.0, 0.0], [0.5, 1.0], [0.0, 2.0]]), np.zeros((3, 2))
    together = tangential_potential(du, t0, s, k)
    expected = [[0.1, 0.0], [1.0, 2.0], [0.0, 0.0]]
    np.testing.assert_allclose(together.gradient, expected, atol=1e-15)
    np.testing.assert_allclose(together.value, [0.1 - 0.005, 1.25, 0.0], atol=1e-15)
    np.testing.assert_allclose(together.hessian[1], 2.0 * np.eye(2))
    np.testing.assert_allclose(together.hessian[0], [[0.0, 0.0], [0.0, 0.1]], atol=1e-15)


def test_default_penalty():
    assert default_penalty(210e3, 0.5, 0.1) == pytest.approx(42e3)
    for arguments, field in (
        ((0.0, 1.0, 1.0), "young"),
        ((1.0, -1.0, 1.0), "edge"),
        ((1.0, 1.0, np.nan), "area"),
    ):
        with pytest.raises(SceneError, match=f"{field} = .*must be finite and > 0"):
            default_penalty(*arguments)
