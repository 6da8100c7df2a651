"""Hardening curves: closed forms, quadrature and finite differences, and what they refuse."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from bipot.errors import SceneError
from bipot.laws.hardening import Hardening, Linear, Perfect, Tabulated, Voce, hardening_from_text

TABLE = Tabulated((0.0, 0.1, 0.35, 1.0), (300.0, 350.0, 350.0, 800.0))
CURVES: list[Hardening] = [
    Perfect(300.0),
    Linear(300.0, 1000.0),
    Voce(300.0, 100.0, 10.0, 50.0),
    TABLE,
]
KINKS = np.array(TABLE.peeq)

quick = settings(deadline=None, derandomize=True, max_examples=60)
# Subnormal strains underflow in the quadrature, not in the curves.
strain = st.floats(0.0, 1.5, allow_subnormal=False)


def test_values_follow_the_formulas():
    p = np.array([0.0, 0.05, 2.0])
    np.testing.assert_array_equal(Perfect(300.0).yield_stress(p), [300.0, 300.0, 300.0])
    np.testing.assert_allclose(Linear(300.0, 1000.0).yield_stress(p), [300.0, 350.0, 2300.0])
    expected = 300.0 + 100.0 * (1.0 - np.exp(-10.0 * p)) + 50.0 * p
    np.testing.assert_allclose(Voce(300.0, 100.0, 10.0, 50.0).yield_stress(p), expected, rtol=1e-15)
    np.testing.assert_allclose(TABLE.yield_stress(np.array([0.0, 0.05, 0.2, 3.0])), [300.0, 325.0, 350.0, 800.0])


def test_slope_is_the_right_hand_one_at_kinks():
    np.testing.assert_allclose(TABLE.slope(KINKS), [500.0, 0.0, 450.0 / 0.65, 0.0])
    np.testing.assert_allclose(TABLE.slope(np.array([0.0999, 0.3, 5.0])), [500.0, 0.0, 0.0])


@pytest.mark.parametrize("curve", CURVES, ids=lambda c: type(c).__name__)
@given(p=strain)
@quick
def test_slope_matches_finite_differences(curve, p):
    h = 1e-6
    if np.min(np.abs(p - KINKS)) < 2 * h or p < 2 * h:
        p += 4 * h
    difference = (curve.yield_stress(p + h) - curve.yield_stress(p - h)) / (2 * h)
    np.testing.assert_allclose(curve.slope(p), difference, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("curve", CURVES, ids=lambda c: type(c).__name__)
@given(p=strain, dp=strain)
@quick
def test_energy_matches_quadrature(curve, p, dp):
    # Lengths near the least number there is are no task for the quadrature.
    dp = 0.0 if dp < 1e-14 else dp
    inner = [float(k) - p for k in KINKS if p < k < p + dp]
    ends = [0.0, *inner, dp]
    integral = sum(quad(lambda s: float(curve.yield_stress(p + s)), a, b)[0] for a, b in pairwise(ends))
    np.testing.assert_allclose(curve.energy(p, dp), integral, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("curve", CURVES, ids=lambda c: type(c).__name__)
@given(p=strain, dp=st.floats(1e-14, 1e-8))
@quick
def test_energy_of_a_tiny_increment_keeps_its_digits(curve, p, dp):
    mean = 0.5 * (curve.yield_stress(p) + curve.yield_stress(p + dp))
    np.testing.assert_allclose(curve.energy(p, dp), mean * dp, rtol=1e-14)


@pytest.mark.parametrize("curve", CURVES, ids=lambda c: type(c).__name__)
def test_arrays_broadcast(curve):
    p, dp = np.array([[0.0], [0.1]]), np.array([0.0, 0.2, 0.4])
    energy = curve.energy(p, dp)
    assert energy.shape == (2, 3)
    assert energy[1, 2] == pytest.approx(float(curve.energy(0.1, 0.4)), rel=1e-15)
    assert curve.yield_stress(p).shape == curve.slope(p).shape == (2, 1)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("perfect:300", Perfect(300.0)),
        ("linear:300,1000", Linear(300.0, 1000.0)),
        ("voce:300,100,10", Voce(300.0, 100.0, 10.0)),
        ("voce:300,100,10,50", Voce(300.0, 100.0, 10.0, 50.0)),
        ("table:0/300,0.1/350,1/400", Tabulated((0.0, 0.1, 1.0), (300.0, 350.0, 400.0))),
    ],
)
def test_text_is_read(text, expected):
    assert hardening_from_text(text) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("power:300", "hardening = 'power': must be one of linear, perfect, table, voce"),
        ("linear:300", "must be 2 numbers"),
        ("voce:300,1", "must be 3 or 4 numbers"),
        ("perfect:soft", "must be numbers separated by ','"),
        ("table:0/300,0.1", "must be pairs peeq/stress"),
        ("linear:300,-10", "modulus = -10.0: must be finite and >= 0 .softening makes"),
        ("", "must be one of"),
    ],
)
def test_text_is_refused(text, message):
    with pytest.raises(SceneError, match=message):
        hardening_from_text(text)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Perfect(0.0), "sigma_y = 0.0: must be finite and > 0"),
        (lambda: Perfect(float("nan")), "sigma_y = nan"),
        (lambda: Linear(-1.0, 0.0), "sigma_y = -1.0"),
        (lambda: Linear(1.0, float("inf")), "modulus = inf"),
        (lambda: Voce(1.0, -1.0, 1.0), "saturation = -1.0: .*non-convex"),
        (lambda: Voce(1.0, 1.0, 0.0), "rate = 0.0: must be finite and > 0"),
        (lambda: Voce(1.0, 1.0, 1.0, -1.0), "modulus = -1.0: .*non-convex"),
        (lambda: Tabulated((0.0,), (1.0,)), "at least two values"),
        (lambda: Tabulated((0.0, 1.0), (1.0,)), "as long as peeq"),
        (lambda: Tabulated((0.1, 1.0), (1.0, 2.0)), "strictly increasing from 0"),
        (lambda: Tabulated((0.0, 0.0), (1.0, 2.0)), "strictly increasing from 0"),
        (lambda: Tabulated((0.0, float("inf")), (1.0, 2.0)), "peeq = .*finite"),
        (lambda: Tabulated((0.0, 1.0), (0.0, 2.0)), "sigma_y = 0.0"),
        (lambda: Tabulated((0.0, 1.0), (2.0, 1.0)), "stress = .*non-convex"),
    ],
)
def test_bad_curves_are_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()
